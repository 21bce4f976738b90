//! What the tests share: the paper's material, quadrature and differences that owe nothing to the library.

use elastocap_mechanics::{ClosedFormSettings, MooneyRivlin};

/// C1 = 1364.3 Pa and C2 = -87863.8 Pa of the paper.
pub(crate) const PAPER: MooneyRivlin = MooneyRivlin { c10: 682.15, c01: 43931.9 };

/// Shear modulus of [`PAPER`] in Pa, exactly rounded.
pub(crate) const PAPER_MU: f64 = 89228.1;

/// A contact and a shear length of `half_length`, one metre wide.
pub(crate) fn equal_lengths(half_length: f64) -> ClosedFormSettings {
    ClosedFormSettings { contact_half_length: half_length, contact_width: 1.0, shear_length: half_length }
}

/// Fails unless `got` is within `relative` of `expected`.
#[track_caller]
pub(crate) fn assert_close(got: f64, expected: f64, relative: f64, what: &str) {
    let error = (got - expected).abs();
    let allowed = relative * expected.abs();
    assert!(error <= allowed, "{what}: {got:e} instead of {expected:e}, off by {:e}", error / expected.abs());
}

/// The integral over `[from, to]` by the double-exponential (tanh-sinh) rule.
pub(crate) fn integrate(from: f64, to: f64, integrand: impl Fn(f64) -> f64) -> f64 {
    let (half, step) = (0.5 * (to - from), 1.0 / 64.0);
    let mut sum = 0.0;
    for k in -200..=200_i32 {
        let t = f64::from(k) * step;
        let inner = std::f64::consts::FRAC_PI_2 * t.sinh();
        let weight = std::f64::consts::FRAC_PI_2 * t.cosh() / inner.cosh().powi(2);
        // The distance to the nearer end keeps its digits.
        let near = half * (-inner.abs()).exp() / inner.cosh();
        let x = if t < 0.0 { from + near } else { to - near };
        sum += weight * integrand(x);
    }
    half * step * sum
}

/// The derivative of `function` at `x` by central differences of eighth order.
pub(crate) fn derivative(x: f64, step: f64, function: impl Fn(f64) -> f64) -> f64 {
    let weights = [4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0];
    let terms = weights.iter().zip(1..).map(|(w, k)| {
        let offset = f64::from(k) * step;
        w * (function(x + offset) - function(x - offset))
    });
    terms.sum::<f64>() / step
}
