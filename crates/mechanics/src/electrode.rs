//! The motion and thinning of an electrode in the layer.

use crate::closed_form::LayerMap;
use crate::error::{MechanicsError, require_positive};

/// The stiffness of an electrode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ElectrodeStiffness {
    /// It keeps its thickness and length.
    Rigid,
    /// Incompressible neo-Hookean with this shear modulus in Pa. With the modulus of the layer it deforms as
    /// the layer does.
    ShearModulus(f64),
}

/// An electrode in the deformed layer: its position and the changes of its dimensions.
///
/// Electrodes float with the layer. The gap between two of them side by side opens with the layer's stretch,
/// `d = D f(S)`, the mid-plane comes down to `g(S)`, the width along `x3` stays.
/// The thickness follows from a separate problem (announced in section 2 of the paper): in plane strain the
/// electrode carries the stress difference of the layer at its height on the axis,
/// `sigma22 - sigma11 = mu (f^-2 - f^2)`. Two electrodes one above the other are two poses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElectrodePose {
    /// Height of the mid-plane above the substrate in the deformed layer, `g(S)`, in m.
    pub height: f64,
    /// Stretch `f(S)` of the layer along `x1` at the electrode's height; distances in the layer grow by it.
    pub layer_stretch: f64,
    /// Thickness after over thickness before, `t/T`; at most 1.
    pub thickness_stretch: f64,
    /// Length of the electrode along `x1` after over before, `T/t` (its volume is constant).
    pub length_stretch: f64,
}

impl ElectrodePose {
    /// The pose in a layer of shear modulus `layer_modulus` (Pa) deformed by `map`, for an electrode whose
    /// mid-plane is at reference height `reference_height` `S` (m).
    ///
    /// # Errors
    /// [`MechanicsError::ElectrodeOutsideLayer`] unless `0 <= S <= H`, [`MechanicsError::NotPositive`] for
    /// either shear modulus.
    pub fn new(
        map: &LayerMap,
        layer_modulus: f64,
        reference_height: f64,
        stiffness: ElectrodeStiffness,
    ) -> Result<Self, MechanicsError> {
        if !(0.0..=map.thickness()).contains(&reference_height) {
            let (height, thickness) = (reference_height, map.thickness());
            return Err(MechanicsError::ElectrodeOutsideLayer { height, thickness });
        }
        let layer_modulus = require_positive("shear modulus of the layer", layer_modulus, "Pa")?;
        let excess = map.stretch_excess(reference_height);
        let thickness_stretch = match stiffness {
            ElectrodeStiffness::Rigid => 1.0,
            ElectrodeStiffness::ShearModulus(modulus) => {
                let modulus = require_positive("shear modulus of the electrode", modulus, "Pa")?;
                thickness_stretch(-layer_modulus / modulus * square_difference(excess))
            }
        };
        Ok(Self {
            height: map.height(reference_height),
            layer_stretch: 1.0 + excess,
            thickness_stretch,
            length_stretch: 1.0 / thickness_stretch,
        })
    }

    /// The gap `d = D f(S)` (m) between two electrodes side by side at this height, from the gap `D` before
    /// (m).
    pub fn gap(&self, reference_gap: f64) -> f64 {
        reference_gap * self.layer_stretch
    }

    /// The thickness `t` (m) from the thickness `T` before (m).
    pub fn thickness(&self, reference_thickness: f64) -> f64 {
        reference_thickness * self.thickness_stretch
    }

    /// The length of the electrode along `x1` (m) from its length before (m).
    pub fn length(&self, reference_length: f64) -> f64 {
        reference_length * self.length_stretch
    }
}

/// `f^2 - f^-2` for the stretch `f = 1 + excess`.
fn square_difference(excess: f64) -> f64 {
    let square_minus_one = excess * (2.0 + excess);
    square_minus_one + square_minus_one / (1.0 + square_minus_one)
}

/// `t/T = sqrt((k + sqrt(k^2 + 4)) / 2)`, the positive root of `s^2 - s^-2 = k`.
///
/// `k` is the load over the electrode's shear modulus, negative under compression. There the printed form is
/// a difference of nearly equal numbers; its reciprocal for `-k` is the same root as a sum.
fn thickness_stretch(k: f64) -> f64 {
    let magnitude = k.abs();
    let root = (0.5 * (magnitude + magnitude.hypot(2.0))).sqrt();
    if k < 0.0 { 1.0 / root } else { root }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_thickness_stretch_keeps_its_digits_at_any_load() {
        // Reference digits: mpmath, 50 digits.
        for (k, expected) in [
            (-1e12, 1e-6),
            (-1e3, 0.031_622_760_790_323_16),
            (-1.0, 0.786_151_377_757_423_3),
            (-1e-9, 0.999_999_999_75),
            (0.0, 1.0),
            (1e-9, 1.000_000_000_25),
            (2.5, 1.688_425_615_583_408_6),
            (1e12, 1e6),
        ] {
            let got = thickness_stretch(k);
            assert!((got / expected - 1.0).abs() < 1e-15, "k = {k}: {got} instead of {expected}");
        }
    }
}
