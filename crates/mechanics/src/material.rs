//! Incompressible rubber: Mooney-Rivlin and neo-Hookean.

use crate::error::{MechanicsError, require_positive};

/// An incompressible hyperelastic material, `W = c10 (I1 - 3) + c01 (I2 - 3)` per reference volume.
///
/// The paper writes its stress `sigma = -P I + C1 B + C2 B^-1` (17) with constants that differ from the
/// standard `c10` and `c01` by factors of two and a sign; [`Material::paper_constants`] translates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Material {
    /// The two-constant law. In plane strain only `c10 + c01` acts, except in the stress along `x3`.
    MooneyRivlin {
        /// Factor of `I1 - 3` in Pa.
        c10: f64,
        /// Factor of `I2 - 3` in Pa.
        c01: f64,
    },
    /// The one-constant law, `c10 = mu / 2` and `c01 = 0`.
    NeoHookean {
        /// Shear modulus `mu` in Pa.
        shear_modulus: f64,
    },
}

impl Material {
    /// The shear modulus at zero strain, `mu = 2 (c10 + c01) = C1 - C2`, in Pa (16a, corrected).
    pub fn shear_modulus(&self) -> f64 {
        match *self {
            Self::MooneyRivlin { c10, c01 } => 2.0 * (c10 + c01),
            Self::NeoHookean { shear_modulus } => shear_modulus,
        }
    }

    /// The constants `(C1, C2) = (2 c10, -2 c01)` of equation (17), in Pa.
    pub fn paper_constants(&self) -> (f64, f64) {
        match *self {
            Self::MooneyRivlin { c10, c01 } => (2.0 * c10, -2.0 * c01),
            Self::NeoHookean { shear_modulus } => (shear_modulus, 0.0),
        }
    }

    /// Returns the shear modulus in Pa, or an error unless it is positive and finite.
    ///
    /// One of `c10` and `c01` may be negative (fitted constants sometimes are); their sum may not.
    pub(crate) fn valid_shear_modulus(&self) -> Result<f64, MechanicsError> {
        let quantity = match self {
            Self::MooneyRivlin { .. } => "shear modulus 2 (c10 + c01) of the layer",
            Self::NeoHookean { .. } => "shear modulus of the layer",
        };
        require_positive(quantity, self.shear_modulus(), "Pa")
    }
}
