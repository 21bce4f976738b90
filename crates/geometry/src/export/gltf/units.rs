//! The scale at which a scene is shown, from nanometres to kilometres.

use super::GltfError;

/// The length that one unit of the viewer stands for.
pub(in crate::export) struct SceneUnit {
    /// Metres per unit.
    pub(super) metres: f64,
    /// Units per metre.
    pub(super) scale: f64,
    /// The length in words, such as `200 um`.
    pub(super) label: String,
}

/// The largest of 1, 2 and 5 times a power of ten metres that is not larger than `at_most`, m, and the same
/// in words, such as `200 um`: for a scale bar.
///
/// # Errors
/// [`GltfError::OutOfRange`] where `at_most` is too small or too large for a scene file.
pub fn round_length(at_most: f64) -> Result<(f64, String), GltfError> {
    SceneUnit::for_extent(at_most).map(|unit| (unit.metres, unit.label))
}

impl SceneUnit {
    /// The largest of 1, 2 and 5 times a power of ten metres that is not larger than `extent`, the largest
    /// extent of the scene, m.
    pub(in crate::export) fn for_extent(extent: f64) -> Result<Self, GltfError> {
        if !(1e-30..=1e30).contains(&extent) {
            return Err(GltfError::OutOfRange { extent });
        }
        // Through decimal text, because powi(10, -6) is not the number nearest to 1e-6.
        let decimal = |digit: i32, power: i32| format!("{digit}e{power}").parse::<f64>().unwrap_or(f64::NAN);
        let power = extent.log10().floor() as i32;
        // One decade to spare on each side: log10 may round across a power of ten.
        let mut candidates = (power - 1..=power + 1).flat_map(|k| [1, 2, 5].map(|digit| (digit, k)));
        let (digit, power) = candidates
            .rfind(|&(digit, k)| decimal(digit, k) <= extent)
            .ok_or(GltfError::OutOfRange { extent })?;
        let scale = match digit {
            1 => decimal(1, -power),
            2 => decimal(5, -power - 1),
            _ => decimal(2, -power - 1),
        };
        let prefixes = ["f", "p", "n", "u", "m", "", "k", "M", "G"];
        let label = match prefixes.get((power.div_euclid(3) + 5) as usize) {
            Some(prefix) => format!("{} {prefix}m", digit * 10_i32.pow(power.rem_euclid(3) as u32)),
            None => format!("{digit}e{power} m"),
        };
        Ok(Self { metres: decimal(digit, power), scale, label })
    }
}
