//! The two constants of the Mooney-Rivlin law, as the closed form of the layer takes them.

/// The incompressible law `W = c10 (I1 - 3) + c01 (I2 - 3)` per reference volume.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MooneyRivlin {
    /// Factor of `I1 - 3` in Pa.
    pub c10: f64,
    /// Factor of `I2 - 3` in Pa.
    pub c01: f64,
}

impl MooneyRivlin {
    /// The neo-Hookean law with this shear modulus in Pa: `c10 = mu/2` and `c01 = 0`.
    pub const fn neo_hookean(shear_modulus: f64) -> Self {
        Self { c10: 0.5 * shear_modulus, c01: 0.0 }
    }

    /// Shear modulus at zero strain, `mu = 2 (c10 + c01)`, in Pa.
    pub fn shear_modulus(&self) -> f64 {
        2.0 * (self.c10 + self.c01)
    }
}
