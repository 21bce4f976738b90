//! How the soft layer of a capacitive sensor deforms under load, and where its electrodes go.
//!
//! A rubber layer of thickness `H`, bonded to a rigid substrate, is compressed by `U` under a smooth punch.
//! Rubber keeps its volume, so it flows outwards: two electrodes side by side move *apart* and get thinner.
//! This crate answers, for one load step: where every point of the layer goes ([`LayerMap`]), what stress it
//! carries ([`LayerStress`]), what force the punch needs ([`LayerState::force`]), and how an electrode sits
//! in the deformed layer ([`ElectrodePose`]). [`LayerState`] holds all of these.
//!
//! The layer is the closed form of sections 2 and 5.1 of the seed paper ("Large deformation mechanics of a
//! soft elastomeric layer under compressive loading for a MEMS tactile sensor application"), with the
//! misprints corrected. Equation numbers in this crate are those of this paper.
//!
//! Axes: `x1` in-plane from the symmetry axis, `x2` up from the substrate, `x3` along the width. Reference
//! coordinates are `x`, deformed ones `y`. Everything is SI: metres, pascals, newtons.
//!
//! ```
//! use elastocap_mechanics::{ClosedFormSettings, ElectrodeStiffness, LayerState, MooneyRivlin};
//!
//! let rubber = MooneyRivlin { c10: 682.15, c01: 43931.9 };
//! let settings =
//!     ClosedFormSettings { contact_half_length: 500e-6, contact_width: 500e-6, shear_length: 500e-6 };
//! let layer = LayerState::new(450e-6, rubber, 0.2, settings)?;
//! let electrode = layer.electrode_pose(225e-6, ElectrodeStiffness::ShearModulus(1e6))?;
//! assert!((layer.force() - 0.08309948987).abs() < 1e-11); // newtons
//! assert!((electrode.gap(50e-6) - 64.70120634e-6).abs() < 1e-14); // metres
//! # Ok::<(), elastocap_mechanics::MechanicsError>(())
//! ```
//!
//! # Current limitations
//! - Plane strain and incompressible; the electrodes do not stiffen the layer.
//! - Two material constants act only as their sum: `mu = 2 (c10 + c01)` is all that the displacements, the
//!   in-plane stresses and the force contain.
//! - The force of the closed form has a maximum (see [`ForceLimit`]): beyond it the formula, not the rubber,
//!   softens.

mod closed_form;
mod electrode;
mod error;
mod foam;
mod inverse;
mod layer;
mod numerics;
pub mod punch_force;
pub mod solid;

pub use closed_form::{ClosedFormSettings, LayerMap, LayerStress};
pub use elastocap_materials as materials;
pub use elastocap_materials::MooneyRivlin;
pub use electrode::{ElectrodePose, ElectrodeStiffness};
pub use error::MechanicsError;
pub use foam::{FoamLaw, FoamState};
pub use inverse::{ForceLimit, compression_for_force, force_limit};
pub use layer::LayerState;
