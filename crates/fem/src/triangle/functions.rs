//! The polynomials on the reference triangle: orthonormal ones, continuous potentials and fluxes.

use super::SIDES;
use crate::jet::{Jet, barycentric};

/// Legendre polynomials of degree up to `degree`, made homogeneous: t^n L_n(x / t).
fn scaled_legendre(degree: usize, x: Jet, t: Jet) -> Vec<Jet> {
    let square = t.times(t);
    let mut out = vec![Jet::constant(1.0), x];
    for n in 1..degree {
        let k = n as f64;
        let next = x.times(out[n]).scaled(2.0 * k + 1.0).minus(square.times(out[n - 1]).scaled(k));
        out.push(next.scaled(1.0 / (k + 1.0)));
    }
    out.truncate(degree + 1);
    out
}

/// Polynomials of degree up to `p` that are orthonormal on the reference triangle (Dubiner, J. Sci. Comput.
/// 6, 1991), by ascending degree; the first one is constant.
pub(super) fn orthonormal(p: usize, point: [f64; 2]) -> Vec<Jet> {
    let [l0, l1, l2] = barycentric(point);
    let along = scaled_legendre(p, l1.minus(l0), l0.plus(l1));
    let mut out = Vec::with_capacity((p + 1) * (p + 2) / 2);
    for degree in 0..=p {
        for i in 0..=degree {
            let j = degree - i;
            let across = jacobi(j, (2 * i + 1) as f64, l2.scaled(2.0).minus(Jet::constant(1.0)));
            let norm = (2.0 * (2 * i + 1) as f64 * (degree + 1) as f64).sqrt();
            out.push(along[i].times(across).scaled(norm));
        }
    }
    out
}

/// The Jacobi polynomial P_n^(a, 0).
fn jacobi(n: usize, a: f64, x: Jet) -> Jet {
    let mut before = Jet::constant(1.0);
    if n == 0 {
        return before;
    }
    let mut now = x.scaled(0.5 * (a + 2.0)).plus(Jet::constant(0.5 * a));
    for k in 2..=n {
        let k = k as f64;
        let c = 2.0 * k + a;
        let first = x.scaled(c * (c - 2.0)).plus(Jet::constant(a * a)).scaled(c - 1.0);
        let second = 2.0 * (k + a - 1.0) * (k - 1.0) * c;
        let next =
            first.times(now).minus(before.scaled(second)).scaled(1.0 / (2.0 * k * (k + a) * (c - 2.0)));
        (before, now) = (now, next);
    }
    now
}

/// The number of continuous functions of degree `p` on a triangle.
pub fn continuous_functions(p: usize) -> usize {
    (p + 1) * (p + 2) / 2
}

/// The number of orthonormal polynomials of degree below `p`: the divergences of the fluxes of degree `p`.
pub fn divergences(p: usize) -> usize {
    p * (p + 1) / 2
}

/// The continuous functions of degree `p` at a point: those of the corners, of the sides and of the inside.
pub(super) fn continuous(p: usize, point: [f64; 2]) -> Vec<Jet> {
    let corners = barycentric(point);
    let mut out = corners.to_vec();
    for [a, b] in SIDES {
        let (a, b) = (corners[a], corners[b]);
        let square = a.plus(b).times(a.plus(b));
        let l = scaled_legendre(p, b.minus(a), a.plus(b));
        for j in 2..=p {
            let norm = 1.0 / (2.0 * (2 * j - 1) as f64).sqrt();
            out.push(l[j].minus(square.times(l[j - 2])).scaled(norm));
        }
    }
    if p >= 3 {
        let bubble = corners[0].times(corners[1]).times(corners[2]);
        out.extend(orthonormal(p - 3, point).into_iter().map(|q| bubble.times(q)));
    }
    out
}

/// The fluxes of degree `p` at a point of the reference triangle, and their divergences: polynomials of
/// degree below `p` along either axis, and those of degree `p - 1` times the position from the centroid.
pub(super) fn fluxes(p: usize, point: [f64; 2]) -> (Vec<[f64; 2]>, Vec<f64>) {
    let (mut values, mut divergences) = (Vec::with_capacity(p * (p + 2)), Vec::with_capacity(p * (p + 2)));
    let polynomials = orthonormal(p - 1, point);
    for q in &polynomials {
        values.extend([[q.value, 0.0], [0.0, q.value]]);
        divergences.extend(q.slope);
    }
    let from_centroid = [point[0] - 1.0 / 3.0, point[1] - 1.0 / 3.0];
    for q in &polynomials[polynomials.len() - p..] {
        values.push(from_centroid.map(|x| x * q.value));
        divergences.push(2.0 * q.value + from_centroid[0] * q.slope[0] + from_centroid[1] * q.slope[1]);
    }
    (values, divergences)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::line::hierarchical;
    use crate::triangle::rules::triangle_rule;

    #[test]
    fn the_orthonormal_polynomials_are_orthonormal() {
        let p = 7;
        let n = (p + 1) * (p + 2) / 2;
        let mut gram = vec![0.0; n * n];
        for (point, w) in triangle_rule(p + 2) {
            let q = orthonormal(p, point);
            for i in 0..n {
                for j in 0..n {
                    gram[i * n + j] += w * q[i].value * q[j].value;
                }
            }
        }
        for i in 0..n {
            for j in 0..n {
                assert!((gram[i * n + j] - f64::from(u8::from(i == j))).abs() < 1e-12, "{i} {j}");
            }
        }
    }

    #[test]
    fn slopes_are_differences_of_values() {
        let (at, h) = ([0.23, 0.41], 1e-6);
        for p in 1..6 {
            let f = continuous(p, at);
            for k in 0..2 {
                let step = |sign: f64| {
                    let mut x = at;
                    x[k] += sign * h;
                    continuous(p, x)
                };
                for ((f, up), down) in f.iter().zip(step(1.0)).zip(step(-1.0)) {
                    assert!((f.slope[k] - (up.value - down.value) / (2.0 * h)).abs() < 1e-8);
                }
            }
        }
    }

    #[test]
    fn on_a_side_the_functions_are_those_of_a_line() {
        let (p, s) = (6, 0.3);
        let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
        let line = hierarchical(p, s).0;
        for (side, ends) in SIDES.iter().enumerate() {
            let [a, b] = ends.map(|c| corners[c]);
            let f = continuous(p, [0, 1].map(|k| 0.5 * ((1.0 - s) * a[k] + (1.0 + s) * b[k])));
            let first = 3 + side * (p - 1);
            for (i, f) in f.iter().enumerate() {
                let expected = match i {
                    i if i == ends[0] => line[0],
                    i if i == ends[1] => line[1],
                    i if (first..first + p - 1).contains(&i) => line[2 + i - first],
                    _ => 0.0,
                };
                assert!((f.value - expected).abs() < 1e-14, "{side} {i}");
            }
        }
    }
}
