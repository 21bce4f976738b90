//! The balance of forces along `x1` that fixes the pressure level: section 2.8 of the paper.
//!
//! The deformation leaves the pressure open by a constant `B`. The paper fixes it by asking that the force in
//! the cross-section `x1 = 0` is carried by the shear stress on the bonded bottom over a length `L`, the
//! *shear length* (29). The result (45), with `M = lambda tan(theta) / n = sinh(2n) / (2n)`, is
//!
//! `B / mu = M (1 + theta^2 a^2 / 2) - tanh(n) / (4n) - 1 / (4 lambda^2)`, `a = L / H`.
//!
//! `B` is `mu/2` without load. The parts of `B` are computed here without this constant, as sums of terms
//! that vanish with the compression, so that the smallest load keeps its digits.
//!
//! Equation numbers are those of the paper "Large deformation mechanics of a soft elastomeric layer under
//! compressive loading for a MEMS tactile sensor application".

use super::phase::Phase;
use crate::numerics::{cosh_minus_sinh_ratio, sinh_ratio_excess};

/// `M = sinh(2n) / (2n)`.
pub(crate) fn mean_ratio(n: f64) -> f64 {
    1.0 + sinh_ratio_excess(2.0 * n)
}

/// `dM/dn`, for `n > 0`.
pub(crate) fn mean_ratio_slope(n: f64) -> f64 {
    cosh_minus_sinh_ratio(2.0 * n) / n
}

/// `1 - tanh(n) / n`.
fn tanh_ratio_deficit(n: f64) -> f64 {
    cosh_minus_sinh_ratio(n) / n.cosh()
}

/// Derivative of [`tanh_ratio_deficit`], for `n > 0`.
fn tanh_ratio_deficit_slope(n: f64) -> f64 {
    sinh_ratio_excess(2.0 * n) / (n * n.cosh().powi(2))
}

/// The part of `B / mu - 1/2` that does not contain the shear length.
fn stretch_part(n: f64) -> f64 {
    sinh_ratio_excess(2.0 * n) + 0.25 * tanh_ratio_deficit(n) + 0.25 * n.tanh().powi(2)
}

/// `B / mu - 1/2` from (45), where `shear_ratio` is the shear length over the thickness.
pub(crate) fn constant_excess(phase: &Phase, shear_ratio: f64) -> f64 {
    let sheared = phase.theta * shear_ratio;
    stretch_part(phase.n) + 0.5 * sheared * sheared * mean_ratio(phase.n)
}

/// `L / H` for which the shear stress on the bonded bottom carries the compressive force `mu H axial_force`
/// through the cross-section `x1 = 0`: from (43) and (44b), `N = mu alpha tan(theta) L^2 / 2`. `None` without
/// compression, and where the section pulls.
pub(crate) fn shear_ratio_for_axial_force(phase: &Phase, axial_force: f64) -> Option<f64> {
    let square = 2.0 * axial_force / (phase.theta * phase.n.sinh());
    (square >= 0.0).then(|| square.sqrt())
}

/// `B / mu - 1 / (2 lambda^2)` without the shear length: the mean top pressure that stretching alone causes.
pub(crate) fn top_pressure_part(n: f64) -> f64 {
    stretch_part(n) + 0.5 * n.tanh().powi(2)
}

/// Derivative of [`top_pressure_part`] by `n`, for `n > 0`.
pub(crate) fn top_pressure_part_slope(n: f64) -> f64 {
    mean_ratio_slope(n) + 0.25 * tanh_ratio_deficit_slope(n) + 1.5 * n.tanh() / n.cosh().powi(2)
}
