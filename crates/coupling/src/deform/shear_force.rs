//! The horizontal force that a shift of the attached bodies takes, where it is known.

use elastocap_case::Pose;

use super::Deformation;

/// Compression U/H up to which finite elements on finer and finer meshes agree on the force of the sheared layer (docs/mechanics.md).
const CHECKED_COMPRESSION: f64 = 0.02;

/// Along x1 and x3, N. `None` under a tilt, and of a layer by finite elements, which are not shifted.
pub(crate) fn shear_force(state: &Deformation<'_>, pose: &Pose) -> [Option<f64>; 2] {
    match state {
        Deformation::ClosedForm(state) if pose.tilt == [0.0; 2] => state.shear_force(pose.shift),
        Deformation::ClosedForm(_) | Deformation::FiniteElement(_) => [None; 2],
    }
}

/// What the user should know of it.
pub(crate) fn shear_warning(state: &Deformation<'_>, pose: &Pose) -> Option<String> {
    let has_force = pose.shift != [0.0; 2] && shear_force(state, pose).iter().any(Option::is_some);
    let compression = state.compression();
    (has_force && compression > CHECKED_COMPRESSION).then(|| {
        format!(
            "the horizontal force at U/H = {compression:.4} is that of simple shear of the layer, whose accuracy above U/H = \
             {CHECKED_COMPRESSION} is not known (docs/mechanics.md)"
        )
    })
}
