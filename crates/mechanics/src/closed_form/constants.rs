//! The constants of the rubber as the paper "Large deformation mechanics of a soft elastomeric layer under
//! compressive loading for a MEMS tactile sensor application" writes them, and as most books do.

use elastocap_materials::MooneyRivlin;

use crate::error::{MechanicsError, require_positive};

/// The constants `(C1, C2) = (2 c10, -2 c01)` in Pa of the paper's stress `sigma = -P I + C1 B + C2 B^-1`
/// (17).
///
/// They differ by factors of two and a sign from those of the energy `W = c10 (I1 - 3) + c01 (I2 - 3)`, which
/// the paper uses as well; `mu = C1 - C2` (16a, corrected).
pub(crate) fn paper_constants(rubber: MooneyRivlin) -> (f64, f64) {
    // Not -2 c01: a neo-Hookean rubber has a C2 of plain zero.
    (2.0 * rubber.c10, 0.0 - 2.0 * rubber.c01)
}

/// The shear modulus of the layer in Pa, or an error unless it is positive and finite.
///
/// One of `c10` and `c01` may be negative (fitted constants sometimes are); their sum may not.
pub(super) fn valid_shear_modulus(rubber: MooneyRivlin) -> Result<f64, MechanicsError> {
    require_positive("shear modulus of the layer, 2 (c10 + c01),", rubber.shear_modulus(), "Pa")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_constants_of_the_paper_are_twice_the_standard_ones() {
        let paper = MooneyRivlin { c10: 682.15, c01: 43931.9 };
        assert_eq!(paper_constants(paper), (1364.3, -87863.8));
        assert!((paper.shear_modulus() / 89228.1 - 1.0).abs() < 3e-16);
        let (c1, c2) = paper_constants(MooneyRivlin::neo_hookean(3.0));
        assert!(c1 == 3.0 && c2 == 0.0 && c2.is_sign_positive());
    }
}
