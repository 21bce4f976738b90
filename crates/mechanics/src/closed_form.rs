//! The closed form of the compressed layer (sections 2.1 to 2.8 and 5.1 of the paper).
//!
//! Horizontal lines stay horizontal: `y1 = x1 f(x2)`, `y2 = g(x2)`, `y3 = x3`. Constant volume asks for
//! `f g' = 1`, equilibrium for `f'' = -alpha^2 f`, the bonded bottom and the smooth punch for `f(0) = 1` and
//! `f'(H) = 0`. One number is left, `theta = alpha H`, and the compression fixes it.
//!
//! Everything is computed from `n = asinh(tan theta)` (46), not from `theta`: `cos theta = 1 / cosh n` and
//! `tan theta = sinh n` keep all their digits at both ends, whereas near full compression `theta` is within
//! rounding of `pi/2` and its cosine is lost.
//!
//! Equation numbers are those of the paper "Large deformation mechanics of a soft elastomeric layer under
//! compressive loading for a MEMS tactile sensor application".

mod axial_balance;
mod constants;
mod force;
mod map;
mod phase;
mod settings;
mod shear;
mod stress;

pub(crate) use axial_balance::shear_ratio_for_axial_force;
pub(crate) use force::ForceCurve;
pub use map::LayerMap;
pub(crate) use phase::Phase;
pub use settings::ClosedFormSettings;
pub(crate) use shear::shear_stiffness;
pub use stress::LayerStress;
