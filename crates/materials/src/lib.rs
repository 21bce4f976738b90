//! Hyperelastic rubbers: the energy, the stress and the tangent that belong to a deformation gradient.
//!
//! A [`Rubber`] is a [`HyperelasticLaw`], which says how it resists distortion, together with a [`Volume`],
//! which says how it resists a change of volume. Case files name these laws; finite elements and the closed
//! form of the layer evaluate them.
//!
//! ```
//! use elastocap_materials::{HyperelasticLaw, Rubber, Volume};
//!
//! let law = HyperelasticLaw::Gent { shear_modulus: 90e3, limiting_invariant: 30.0 };
//! let rubber = Rubber { distortion: law, volume: Volume::Incompressible, volume_barrier: 0.0 };
//! // Pure shear by a stretch of 2: P11 = mu (l - l^-3) J_m / (J_m - (I1 - 3)) - p, and p from P22 = 0.
//! let f = [2.0, 0.0, 0.0, 0.5];
//! let p = rubber.derivatives(&f).first_piola(&f);
//! let nominal_stress = p[0] - p[3] * f[3] / f[0];
//! assert!((nominal_stress - 90e3 * (2.0 - 0.125) * 30.0 / (30.0 - 2.25)).abs() < 1e-9 * nominal_stress);
//! ```
//!
//! # Units
//! Moduli, stresses and energies per reference volume are in Pa; deformation gradients and invariants are
//! dimensionless.
//!
//! # Modules
//! | module | contents |
//! |---|---|
//! | `law` | the laws, and what each of them contributes in the plane and in space |
//! | `rubber` | a law with its volumetric part: energy, stress, tangent |
//! | [`plane`] | tensors and invariants in plane strain, derivatives of an energy by them |
//! | [`space`] | tensors and measures of deformation in three dimensions |
//! | `gent`, `yeoh`, `ogden`, `mooney_rivlin` | the formulas of single laws |
//! | [`hyperfoam`] | the law of foams, and foams that are pressed along one axis |
//! | [`stress_table`] | measured stress of a foam over its compression |
//!
//! # Adding a law
//! Write its formulas in a new file, add a variant to [`HyperelasticLaw`] and fill in the match arms that
//! then fail to compile. `tests/integration` checks every law in its list against finite differences, in the
//! plane and in space.

mod gent;
pub mod hyperfoam;
mod law;
mod mooney_rivlin;
mod ogden;
pub mod plane;
mod rubber;
pub mod space;
pub mod stress_table;
mod yeoh;

pub use hyperfoam::HyperfoamTerm;
pub use law::HyperelasticLaw;
pub use mooney_rivlin::MooneyRivlin;
pub use plane::EnergyDerivatives;
pub use rubber::{Rubber, Volume};
pub use space::Response;
pub use stress_table::StressTable;
