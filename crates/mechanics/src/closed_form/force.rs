//! The force of the punch: section 5.1 of the paper.
//!
//! Equation numbers are those of the paper "Large deformation mechanics of a soft elastomeric layer under
//! compressive loading for a MEMS tactile sensor application".

use super::axial_balance::{mean_ratio, mean_ratio_slope, top_pressure_part, top_pressure_part_slope};
use super::phase::Phase;

/// The compressive force as a function of the state of compression, equation (50) with `B` from (45).
///
/// Divided by `2 w L mu` it is `lambda [ B/mu - 1/(2 lambda^2) - theta^2 b^2 lambda^2 / 6 ]` with `b = L /
/// H`, the contact half-length over the thickness. (50) gives it a minus sign; here compression counts as
/// positive.
///
/// It starts as `n^2 (3/2 + a^2/2 - b^2/6)`, rises to a single maximum and then falls through zero: the
/// pressure that (45) finds grows as `lambda^2 / n`, the pull at the edge of the contact as `lambda^2`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ForceCurve {
    /// `2 w L mu` in N.
    pub(crate) scale: f64,
    /// `b`: contact half-length over thickness.
    pub(crate) contact_ratio: f64,
    /// `a`: shear length over thickness.
    pub(crate) shear_ratio: f64,
}

impl ForceCurve {
    /// The compressive force in N.
    pub(crate) fn force(&self, phase: &Phase) -> f64 {
        self.scale * self.normalised(phase)
    }

    /// The force over `2 w L mu`.
    pub(crate) fn normalised(&self, phase: &Phase) -> f64 {
        phase.lambda() * self.mean_pressure(phase)
    }

    /// The ratio `L / H` of (45) with which a contact of half-length `contact_ratio` times `H` has this
    /// `normalised` force, over `2 w L mu`. `None` without compression, and where even without any shear on
    /// the bottom the force would be larger.
    pub(crate) fn shear_ratio_for(phase: &Phase, contact_ratio: f64, normalised: f64) -> Option<f64> {
        let without_shear = Self { scale: 1.0, contact_ratio, shear_ratio: 0.0 };
        let lacking = normalised / phase.lambda() - without_shear.mean_pressure(phase);
        let square = 2.0 * lacking / (phase.theta.powi(2) * mean_ratio(phase.n));
        (square >= 0.0).then(|| square.sqrt())
    }

    /// Derivative of [`ForceCurve::normalised`] by `n`, for `n > 0`.
    pub(crate) fn normalised_slope(&self, phase: &Phase) -> f64 {
        let Phase { theta, n, .. } = *phase;
        let (a2, b2) = (self.shear_ratio.powi(2), self.contact_ratio.powi(2));
        let (sinh, cosh) = (n.sinh(), n.cosh());
        let sheared = 0.5 * a2 * mean_ratio(n) - b2 * cosh * cosh / 6.0;
        let sheared_slope = 0.5 * a2 * mean_ratio_slope(n) - b2 * cosh * sinh / 3.0;
        // d theta / dn = 1 / lambda.
        let slope = top_pressure_part_slope(n) + 2.0 * theta / cosh * sheared + theta * theta * sheared_slope;
        sinh * self.mean_pressure(phase) + cosh * slope
    }

    /// The factor of `n^2` in the force at small compression; the force rises if and only if it is positive.
    pub(crate) fn initial_curvature(&self) -> f64 {
        1.5 + 0.5 * self.shear_ratio.powi(2) - self.contact_ratio.powi(2) / 6.0
    }

    /// Mean pressure on the deformed contact over `mu`.
    fn mean_pressure(&self, phase: &Phase) -> f64 {
        let Phase { theta, n, .. } = *phase;
        let (a2, b2) = (self.shear_ratio.powi(2), self.contact_ratio.powi(2));
        let sheared = 0.5 * a2 * mean_ratio(n) - b2 * n.cosh().powi(2) / 6.0;
        top_pressure_part(n) + theta * theta * sheared
    }
}
