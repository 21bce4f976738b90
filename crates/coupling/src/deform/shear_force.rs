//! The horizontal force that shifts the attached bodies.

use elastocap_case::Pose;

use super::Deformation;

/// Largest compression U/H at which finite elements converge to the force of the sheared layer under mesh
/// refinement (docs/mechanics.md).
const CHECKED_COMPRESSION: f64 = 0.02;

/// The horizontal force along x1 and x3, N. `None` under a tilt, for a foam, and for a layer by finite
/// elements, which are not shifted.
pub(crate) fn shear_force(state: &Deformation<'_>, pose: &Pose) -> [Option<f64>; 2] {
    match state {
        Deformation::ClosedForm(state) if pose.tilt == [0.0; 2] => state.shear_force(pose.shift),
        Deformation::ClosedForm(_) | Deformation::Foam(_) | Deformation::FiniteElement(_) => [None; 2],
    }
}

/// The warning about the horizontal forces of a closed-form layer, if there is one; `steps` are its states
/// and poses.
pub(crate) fn shear_warning(steps: impl Iterator<Item = (Deformation<'static>, Pose)>) -> Option<String> {
    let is_shifted = |pose: &Pose| pose.shift != [0.0; 2] && pose.tilt == [0.0; 2];
    let shifted = steps.filter(|(_, pose)| is_shifted(pose)).map(|(state, _)| state.compression());
    let most = shifted.fold(0.0, f64::max);
    (most > CHECKED_COMPRESSION).then(|| {
        format!(
            "the horizontal force of a shift is that of simple shear, up to U/H = {most:.4}; above {CHECKED_COMPRESSION} its accuracy is \
             not known: pressure lowers the stiffness of a layer with free ends (docs/mechanics.md)"
        )
    })
}
