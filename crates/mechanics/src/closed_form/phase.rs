//! The one unknown of the closed form: the phase angle `theta = alpha H` and its relatives (40), (46).
//!
//! Equation numbers are those of the paper "Large deformation mechanics of a soft elastomeric layer under
//! compressive loading for a MEMS tactile sensor application".

use crate::error::MechanicsError;
use crate::numerics::integrate_from_zero;

/// Up to this angle `1 - h/H` is integrated (no cancellation); above it the direct form loses less than two
/// bits. The 16-point rule is exact to rounding up to larger angles: at 1 rad its error is about 4^-32.
const LARGEST_INTEGRATED_ANGLE: f64 = 1.0;

/// The state of compression, as the numbers that the formulas contain. All without unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Phase {
    /// `theta = alpha H`, in `[0, pi/2)`.
    pub(crate) theta: f64,
    /// `n = asinh(tan theta)` (46).
    pub(crate) n: f64,
    /// `U/H`.
    pub(crate) compression: f64,
    /// `h/H = 1 - U/H`.
    pub(crate) thickness_ratio: f64,
}

impl Phase {
    /// Solves equation (40), `h/H = cos(theta) n / theta`, for a compression in `[0, 1)`.
    ///
    /// The relative error of `theta` and `n` is a few units of rounding for every compression, however small.
    pub(crate) fn from_compression(compression: f64) -> Result<Self, MechanicsError> {
        if !(0.0..1.0).contains(&compression) {
            return Err(MechanicsError::Compression { compression });
        }
        let compression = compression + 0.0; // -0 becomes 0
        // ln(h/H) falls and is concave in n, so Newton's method converges from any start; near n = 0 it is
        // -n^2 / 3, whence the start.
        let target = (-compression).ln_1p();
        let mut n = (3.0 * compression).sqrt();
        for _ in 0..100 {
            if n == 0.0 {
                break;
            }
            let trial = Self::from_n(n);
            let ratio = trial.thickness_ratio;
            let slope = (trial.compression / trial.theta / ratio - n.sinh()) / n.cosh();
            let log_ratio = if trial.compression < 0.5 { (-trial.compression).ln_1p() } else { ratio.ln() };
            let step = (target - log_ratio) / slope;
            n += step;
            if step.abs() <= 2.0 * f64::EPSILON * n {
                break;
            }
        }
        Ok(Self { theta: gudermannian(n), n, compression, thickness_ratio: 1.0 - compression })
    }

    /// The state with a given `n >= 0`.
    pub(crate) fn from_n(n: f64) -> Self {
        let theta = gudermannian(n);
        if theta <= LARGEST_INTEGRATED_ANGLE {
            // U/H is the integral of 1 - g' = (f - 1) / f over the thickness.
            let compression = integrate_from_zero(1.0, |xi| {
                let excess = stretch_excess(theta, n, theta * xi);
                excess / (1.0 + excess)
            });
            Self { theta, n, compression, thickness_ratio: 1.0 - compression }
        } else {
            let thickness_ratio = n / (n.cosh() * theta);
            Self { theta, n, compression: 1.0 - thickness_ratio, thickness_ratio }
        }
    }

    /// `lambda = 1 / cos(theta)` (36).
    pub(crate) fn lambda(&self) -> f64 {
        self.n.cosh()
    }

    /// Whether the integral over the thickness, rather than the direct form, gives differences their digits.
    pub(crate) fn is_small(&self) -> bool {
        self.theta <= LARGEST_INTEGRATED_ANGLE
    }
}

/// `f - 1` at the angle `alpha x2`, from (37): `2 sin(a) sin(theta - a) / cos(theta)` with `a = alpha x2 /
/// 2`.
pub(crate) fn stretch_excess(theta: f64, n: f64, angle: f64) -> f64 {
    let half = 0.5 * angle;
    2.0 * n.cosh() * half.sin() * (theta - half).sin()
}

/// `theta = atan(sinh n)`, written so that no argument overflows or loses digits.
fn gudermannian(n: f64) -> f64 {
    2.0 * (0.5 * n).tanh().atan()
}
