//! Bodies that move with the material of a layer.

use elastocap_case::Case;
use elastocap_geometry::scene::{Body, Box3, Purpose};
use elastocap_geometry::shapes::Shape;
use elastocap_mechanics::{ElectrodeStiffness, LayerState, MechanicsError};

use super::SceneError;
use crate::deform::{Deformation, FiniteElementStep};

/// The bodies, with those in the layer at their deformed positions. By the closed form, a point at height S
/// moves down to `g(S)`, and its distance from the middle along x1 grows by the stretch there, which is taken
/// at the mid-plane of a box. With finite elements a map deforms the boxes; here only their heights are
/// multiplied by [`scale_of_heights`].
///
/// # Errors
/// A body that is not made of boxes, or that reaches out of the layer.
pub(super) fn with_material(case: &Case, state: Option<&Deformation<'_>>) -> Result<Vec<Body>, SceneError> {
    let thickness = case.layer.as_ref().map_or(f64::INFINITY, |layer| layer.thickness);
    let flush = |mut to: Box3, from: &Box3, state: &Deformation<'_>| {
        // Faces in the surface stay in it.
        for (x, before) in [(&mut to.min[1], from.min[1]), (&mut to.max[1], from.max[1])] {
            if before == thickness {
                *x = state.deformed_thickness();
            }
        }
        to
    };
    let moved = |region: &Box3| match state {
        None => Ok(*region),
        Some(deformation @ Deformation::ClosedForm(state)) => {
            Ok(moved_box(region, state).map(|to| flush(to, region, deformation))?)
        }
        Some(Deformation::Foam(_)) => Err(SceneError::WithinFoam),
        Some(deformation @ Deformation::FiniteElement(step)) => {
            let scale = scale_of_heights(case, step);
            let to = lowered(region, scale);
            Ok(if scale == 1.0 { to } else { flush(to, region, deformation) })
        }
    };
    let is_moved = state.is_some_and(|state| state.top_displacement() != 0.0);
    let with_material = |mut body: Body| {
        if body.purpose == Purpose::InLayer && is_moved {
            let regions = body.boxes().ok_or_else(|| SceneError::NoBoxInLayer { body: body.name.clone() })?;
            let parts: Result<Vec<Shape>, SceneError> =
                regions.iter().map(|region| Ok(Shape::Box(moved(region)?))).collect();
            body.parts = parts?;
        }
        Ok(body)
    };
    case.bodies.iter().cloned().map(with_material).collect()
}

/// Height of the boxes of a layer over that of its material before loading. Where the surface stays flat, the
/// boxes are as high as under load, so that the layer continues outside the map as inside. Otherwise the
/// ratio is 1.
pub(crate) fn scale_of_heights(case: &Case, step: &FiniteElementStep) -> f64 {
    let layer =
        case.layer.as_ref().filter(|_| case.mechanics.is_some_and(|mechanics| mechanics.covers_all()));
    layer.map_or(1.0, |layer| step.deformed_thickness / layer.thickness)
}

/// A box with heights times `scale`.
pub(crate) fn lowered(region: &Box3, scale: f64) -> Box3 {
    let mut out = *region;
    (out.min[1], out.max[1]) = (scale * out.min[1], scale * out.max[1]);
    out
}

fn moved_box(region: &Box3, state: &LayerState) -> Result<Box3, MechanicsError> {
    // Only the parts of the pose that do not depend on the stiffness are used.
    let at = |height: f64| state.electrode_pose(height, ElectrodeStiffness::Rigid);
    let [low, high] = [region.min[1], region.max[1]];
    let stretch = at(0.5 * (low + high))?.layer_stretch;
    Ok(Box3 {
        min: [stretch * region.min[0], at(low)?.height, region.min[2]],
        max: [stretch * region.max[0], at(high)?.height, region.max[2]],
    })
}
