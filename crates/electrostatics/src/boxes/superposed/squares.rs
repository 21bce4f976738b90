//! Bounds on squares of sums of lengths, where only the squares of the lengths are known, as forms.

use faer::{Mat, Scale};

/// An upper bound on the square of a sum of lengths, from the squares of the lengths.
pub(super) fn squared_sum<'m>(squares: impl IntoIterator<Item = &'m Mat<f64>>) -> Mat<f64> {
    let sized: Vec<_> = squares.into_iter().map(|m| (m, size(m))).collect();
    let total: f64 = sized.iter().map(|(_, size)| size).sum();
    // (a + b + ..)^2 <= (s + t + ..) (a^2 / s + b^2 / t + ..) for positive s, t, ..: here the sizes of the
    // forms.
    let n = sized.first().map_or(0, |(m, _)| m.nrows());
    let mut out = Mat::zeros(n, n);
    for (m, size) in sized.into_iter().filter(|(_, size)| *size != 0.0) {
        out += m * Scale(total / size);
    }
    out
}

/// An upper bound on twice the product of two lengths, from their squares.
pub(super) fn twice_the_product(a: &Mat<f64>, b: &Mat<f64>) -> Mat<f64> {
    let ratio = size(b) / size(a);
    // 2 a b <= t a^2 + b^2 / t for positive t.
    if ratio.is_finite() && ratio > 0.0 {
        a * Scale(ratio) + b * Scale(1.0 / ratio)
    } else {
        squared_sum([a, b])
    }
}

/// The sum of the diagonal.
pub(super) fn trace(m: &Mat<f64>) -> f64 {
    (0..m.nrows()).map(|i| m[(i, i)]).sum()
}

/// The root of the trace of a form; NaN where an entry is not finite.
pub(super) fn size(m: &Mat<f64>) -> f64 {
    let is_finite = (0..m.ncols()).all(|j| (0..m.nrows()).all(|i| m[(i, j)].is_finite()));
    if is_finite { trace(m).max(0.0).sqrt() } else { f64::NAN }
}
