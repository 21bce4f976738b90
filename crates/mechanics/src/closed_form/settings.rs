//! The lengths that the closed form takes from outside the layer, and the force curve that they give.
//!
//! Equation numbers are those of the paper "Large deformation mechanics of a soft elastomeric layer under
//! compressive loading for a MEMS tactile sensor application".

use super::constants::valid_shear_modulus;
use super::force::ForceCurve;
use crate::error::{MechanicsError, require_positive};
use elastocap_materials::MooneyRivlin;

/// The lengths that the closed form takes from outside the layer, in m. All must be positive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClosedFormSettings {
    /// Half the reference length of the contact along `x1`, `L` of equation (50).
    pub contact_half_length: f64,
    /// Width of the contact along `x3`, `w` of equation (50).
    pub contact_width: f64,
    /// Length of bonded bottom, from the axis, that carries shear: `L` of equation (45). It sets the pressure
    /// level, and with it the force; the paper leaves it to calibration. The contact half-length is a start.
    pub shear_length: f64,
}

impl ClosedFormSettings {
    /// The force curve of a layer with these settings.
    pub(crate) fn force_curve(
        &self,
        thickness: f64,
        rubber: MooneyRivlin,
    ) -> Result<ForceCurve, MechanicsError> {
        let thickness = require_positive("thickness of the layer", thickness, "m")?;
        let modulus = valid_shear_modulus(rubber)?;
        let half_length = require_positive("contact half-length", self.contact_half_length, "m")?;
        let width = require_positive("contact width", self.contact_width, "m")?;
        let shear_length = require_positive("shear length", self.shear_length, "m")?;
        let curve = ForceCurve {
            scale: 2.0 * width * half_length * modulus,
            contact_ratio: half_length / thickness,
            shear_ratio: shear_length / thickness,
        };
        if curve.initial_curvature() > 0.0 {
            Ok(curve)
        } else {
            let contact_half_length = half_length;
            Err(MechanicsError::ForceDoesNotRise { contact_half_length, shear_length, thickness })
        }
    }
}
