//! The stress in the layer: sections 2.3 to 2.5 and 2.8 of the paper.
//!
//! Equation numbers are those of the paper "Large deformation mechanics of a soft elastomeric layer under
//! compressive loading for a MEMS tactile sensor application".

use nalgebra::Matrix3;

use super::axial_balance::constant_excess;
use super::constants::{paper_constants, valid_shear_modulus};
use super::map::LayerMap;
use crate::error::{MechanicsError, require_positive};
use elastocap_materials::MooneyRivlin;

/// The stress of the compressed layer. Tension is positive; points are reference positions in m.
///
/// The stresses are not evaluated as printed, as a pressure plus large parts that nearly cancel, but from
/// combinations that vanish with the compression, so that a tiny load gives a tiny stress with all its
/// digits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LayerStress {
    /// The deformation that the stress belongs to.
    map: LayerMap,
    /// The constants `C1` and `C2` of the paper in Pa; see [`paper_constants`].
    c1: f64,
    c2: f64,
    /// Shear modulus `mu` of the layer in Pa.
    shear_modulus: f64,
    /// `B / mu - 1/2`.
    constant_excess: f64,
}

impl LayerStress {
    /// The stress of `rubber` under the deformation `map`, with the pressure level that (45) finds for the
    /// `shear_length` `L` in m (the length of bonded bottom, from the axis, that carries shear).
    ///
    /// # Errors
    /// [`MechanicsError::NotPositive`] for the shear modulus or the shear length.
    pub fn new(map: LayerMap, rubber: MooneyRivlin, shear_length: f64) -> Result<Self, MechanicsError> {
        let shear_modulus = valid_shear_modulus(rubber)?;
        let shear_length = require_positive("shear length", shear_length, "m")?;
        let (c1, c2) = paper_constants(rubber);
        let constant_excess = constant_excess(map.phase(), shear_length / map.thickness());
        Ok(Self { map, c1, c2, shear_modulus, constant_excess })
    }

    /// The deformation that this stress belongs to.
    pub fn map(&self) -> &LayerMap {
        &self.map
    }

    /// The integration constant `B` in Pa (45); half the shear modulus without load.
    pub fn integration_constant(&self) -> f64 {
        self.shear_modulus * (0.5 + self.constant_excess)
    }

    /// The term `P` in Pa of `sigma = -P I + C1 B + C2 B^-1`, from (25) with `x1^2 f'^2` as (41) has it.
    ///
    /// It is the paper's pressure, not minus the mean stress: it does not vanish without load.
    pub fn pressure(&self, x: [f64; 3]) -> f64 {
        let Self { c1, c2, shear_modulus, .. } = *self;
        let (f2, spread, shear2) = self.squares(x);
        -0.5 * shear_modulus * spread
            + 0.5 * (c1 + c2) / f2
            + c2 * (shear2 + f2)
            + self.integration_constant()
    }

    /// Cauchy stress `sigma` in Pa at reference position `x`, 3 x 3 and symmetric (18, corrected).
    pub fn cauchy(&self, x: [f64; 3]) -> Matrix3<f64> {
        let Self { c1, c2, shear_modulus, constant_excess, .. } = *self;
        let (f2, spread, shear2) = self.squares(x);
        let excess = self.map.stretch_excess(x[1]);
        let f2_minus_1 = excess * (2.0 + excess);
        let one_minus_inverse = f2_minus_1 / f2;
        let sigma_22 = shear_modulus * (0.5 * spread - 0.5 * one_minus_inverse - constant_excess);
        let sigma_11 = sigma_22 + shear_modulus * (shear2 + f2_minus_1 + one_minus_inverse);
        let sigma_33 = sigma_22 + c1 * one_minus_inverse - c2 * (f2_minus_1 + shear2);
        let sigma_12 = shear_modulus * x[0] * self.map.stretch_slope(x[1]) / self.map.stretch(x[1]);
        Matrix3::new(sigma_11, sigma_12, 0.0, sigma_12, sigma_22, 0.0, 0.0, 0.0, sigma_33)
    }

    /// The paper's `T = F^-1 sigma` in Pa at reference position `x`, 3 x 3 (19, 20a corrected).
    ///
    /// `T_ij` acts on the reference face with normal `i` in direction `j`, and equilibrium is
    /// `dT_kj / dx_k = 0` (21). The paper calls it the first Piola-Kirchhoff stress; most books call `T` the
    /// nominal stress and its transpose, [`LayerStress::first_piola`], the first Piola-Kirchhoff stress.
    pub fn nominal(&self, x: [f64; 3]) -> Matrix3<f64> {
        let sigma = self.cauchy(x);
        let f = self.map.stretch(x[1]);
        let shear = x[0] * self.map.stretch_slope(x[1]);
        let inverse = Matrix3::new(1.0 / f, -shear, 0.0, 0.0, f, 0.0, 0.0, 0.0, 1.0);
        inverse * sigma
    }

    /// First Piola-Kirchhoff stress `P = sigma F^-T` in Pa, the transpose of [`LayerStress::nominal`]:
    /// `P_ij` acts in direction `i` on the reference face with normal `j`.
    pub fn first_piola(&self, x: [f64; 3]) -> Matrix3<f64> {
        self.nominal(x).transpose()
    }

    /// `(f^2, alpha^2 x1^2 f^2, x1^2 f'^2)` at `x`.
    fn squares(&self, x: [f64; 3]) -> (f64, f64, f64) {
        let f = self.map.stretch(x[1]);
        let spread = self.map.alpha() * x[0] * f;
        let shear = x[0] * self.map.stretch_slope(x[1]);
        (f * f, spread * spread, shear * shear)
    }
}
