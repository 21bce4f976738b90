//! Checks that bodies lie in, below or above a layer.

use elastocap_geometry::scene::Purpose;

use super::super::diagnostics::{Diagnostic, shown};
use super::super::model::{Box3, Face, Wall};
use super::super::raw::{self, Document};
use super::super::reader::{Log, Read};
use super::super::values::Either;
use super::given;
use super::layered::micrometres;
use super::placed_boxes::PlacedBoxes;
use super::regions::AXES;

/// The layer, as far as it decides where bodies may lie.
pub(super) struct LayerRoom {
    /// The thickness, m.
    thickness: f64,
    /// Half of the size along x1 and x3, m; infinite where it does not matter.
    half: [f64; 2],
    /// Whether there are load steps.
    is_loaded: bool,
    /// Whether the top stays a plane under every load, so that bodies may ride on it.
    stays_flat: bool,
    /// Whether a conductor of the field presses on the layer.
    under_metal: bool,
    /// Whether load steps shift or tilt the attached bodies.
    is_moved: bool,
}

/// Whether the top of the layer stays a plane under every load.
pub(super) fn is_pressed_flat(raw: &Document) -> bool {
    match given(&raw.mechanics) {
        Some(raw::Mechanics::PlaneStrain(model)) => {
            matches!(model.indenter.get(), Some(Either::First(_)) | None)
        }
        Some(raw::Mechanics::Solid(model)) => matches!(model.indenter.get(), Some(Either::First(_)) | None),
        Some(raw::Mechanics::ClosedForm(_) | raw::Mechanics::Auto(_)) | None => true,
    }
}

/// Whether the indenter is a conductor of the field.
pub(super) fn is_metal(raw: &Document) -> bool {
    match given(&raw.indenter).and_then(|table| table.role.get()) {
        Some(Either::First(raw::IndenterRole::Grounded | raw::IndenterRole::Floating)) => true,
        Some(Either::First(raw::IndenterRole::Absent) | Either::Second(_)) | None => false,
    }
}

impl LayerRoom {
    /// The layer of a file; `None` without a layer, or if it could not be read.
    pub(super) fn of(raw: &Document) -> Option<Self> {
        let layer = given(&raw.layer)?;
        let half_length = given(&layer.half_length).map(|size| size.si);
        let half = match given(&raw.mechanics) {
            Some(raw::Mechanics::PlaneStrain(_)) => [half_length, None],
            Some(raw::Mechanics::Solid(solid)) => [half_length, solid.width.get().map(|size| 0.5 * size.si)],
            Some(raw::Mechanics::ClosedForm(_) | raw::Mechanics::Auto(_)) | None => [None; 2],
        };
        Some(Self {
            thickness: layer.thickness.get()?.si,
            half: half.map(|half| half.unwrap_or(f64::INFINITY)),
            is_loaded: raw.load.is_some(),
            stays_flat: is_pressed_flat(raw),
            under_metal: is_metal(raw),
            is_moved: given(&raw.load).and_then(|load| given(&load.steps)).is_some_and(|steps| {
                steps.iter().filter_map(Read::get).any(|step| step.shift.is_some() || step.tilt.is_some())
            }),
        })
    }
}

impl LayerRoom {
    /// The possible values of `attached` for a body above the layer, in words. A body that touched a metal
    /// indenter would be one conductor with it.
    fn carriers(&self) -> &'static str {
        match (self.stays_flat, self.under_metal) {
            (true, true) => "`attached = \"layer-top\"`, beside the indenter",
            (true, false) => "`attached = \"layer-top\"` or `attached = \"indenter\"`",
            (false, true) => "`attached = \"indenter\"`, apart from that",
            (false, false) => "`attached = \"indenter\"`, or `attached = \"layer\"` for a sheet on the top",
        }
    }
}

/// Checks that all parts of a body lie where bodies of its purpose may; `faces` are what is below and above
/// the layer.
pub(super) fn check_body(body: &PlacedBoxes<'_>, layer: &LayerRoom, faces: [Face; 2], log: &mut Log<'_>) {
    for region in &body.regions {
        let has_place = match body.purpose {
            Purpose::InLayer => is_inside_layer(body, region, layer, faces, log),
            _ => is_apart_from_layer(body, [region.min[1], region.max[1]], layer, faces, log),
        };
        if !has_place {
            return;
        }
    }
}

/// Checks that a part of a body that moves with the material of the layer lies in it.
fn is_inside_layer(
    body: &PlacedBoxes<'_>,
    region: &Box3,
    layer: &LayerRoom,
    faces: [Face; 2],
    log: &mut Log<'_>,
) -> bool {
    let (what, name) = (body.what, shown(body.name));
    let mut report = |message: String, label: String, help: &str| {
        log.push(Diagnostic::at(&body.span, message).label(label).help(help));
    };
    let thickness = layer.thickness;
    if region.min[1] < 0.0 || region.max[1] > thickness {
        let help = match region.min[1] >= thickness {
            true => format!("write what it is attached to instead: {}", layer.carriers()),
            false => "move it into the layer, or make it of two bodies".to_owned(),
        };
        report(
            format!("the {what} \"{name}\" moves with the layer, and reaches out of it"),
            format!("the layer is between x2 = 0 and x2 = {}", micrometres(thickness)),
            &help,
        );
        return false;
    }
    for (axis, half, end) in [(0, layer.half[0], "end"), (2, layer.half[1], "side")] {
        let reach = region.max[axis].max(-region.min[axis]);
        if reach > half && !body.is_slab {
            report(
                format!("the {what} \"{name}\" moves with the layer, and reaches beyond its {end}"),
                format!("the layer ends {} from the middle along {}", micrometres(half), AXES[axis]),
                "make the layer larger, or the body smaller",
            );
            return false;
        }
    }
    let [below, above] = faces;
    let touches = [(below, region.min[1] == 0.0), (above, region.max[1] == thickness)];
    if what == "conductor" && touches.contains(&(Face::Grounded, true)) {
        report(
            format!("the conductor \"{name}\" touches the grounded face of the layer, which would short it"),
            "shares a point with it".to_owned(),
            "leave a gap between the two",
        );
        return false;
    }
    true
}

/// Checks that a part of a body that does not move with the material, between two heights, has its place
/// below or above the layer; without a load it may also lie in it.
fn is_apart_from_layer(
    body: &PlacedBoxes<'_>,
    [low, high]: [f64; 2],
    layer: &LayerRoom,
    [below, above]: [Face; 2],
    log: &mut Log<'_>,
) -> bool {
    let &LayerRoom { thickness, is_loaded, .. } = layer;
    let (what, name) = (body.what, shown(body.name));
    let is_conductor = what == "conductor";
    let mut report = |message: String, label: String, help: &str| {
        log.push(Diagnostic::at(&body.span, message).label(label).help(help));
    };
    // A conductor on the top that is not attached would stay behind when the top sinks.
    let is_fixed = body.purpose == Purpose::Fixed;
    let stays_behind = is_conductor && is_loaded && is_fixed && low == thickness && high > 0.0;
    if is_loaded && high > 0.0 && low < thickness {
        report(
            format!("the {what} \"{name}\" reaches into the layer"),
            format!("the layer is between x2 = 0 and x2 = {}", micrometres(thickness)),
            match (layer.is_moved, body.is_boxes && low >= 0.0 && high <= thickness) {
                (false, true) => {
                    "add `attached = \"layer\"` if it moves with the layer's material, or move it below x2 = 0 or above the layer"
                }
                (false, false) => {
                    "move it below x2 = 0 or above the layer: what moves with the layer's material, with `attached = \"layer\"`, consists of \
                     boxes and sheets inside the layer"
                }
                (true, _) => "move it below x2 = 0 or above the layer",
            },
        );
        return false;
    } else if stays_behind {
        report(
            format!("the {what} \"{name}\" lies on the layer, and stays where it is when the layer sinks"),
            "not attached".to_owned(),
            &format!("add {}, or leave a gap", layer.carriers()),
        );
        return false;
    }
    if high > 0.0 && low < thickness {
        return true;
    }
    let is_below = high <= 0.0;
    let (side, face) = if is_below { ("below", below) } else { ("above", above) };
    let reach = if is_below { -low } else { high - thickness };
    match face {
        Face::Insulated | Face::Grounded => {
            report(
                format!("the {what} \"{name}\" lies where there is no field"),
                format!("the field ends at the plane {side} the layer"),
                &format!("give `{side}` in [surroundings] a medium, or leave the body out"),
            );
            return false;
        }
        Face::Medium { thickness: Some(depth), then, .. } if then != Wall::Open => {
            let shorted = is_conductor && then == Wall::Grounded && reach >= depth;
            if shorted || (reach > depth && !body.is_slab) {
                report(
                    format!("the {what} \"{name}\" reaches the wall {side} the layer"),
                    format!("the wall is {} from the layer", micrometres(depth)),
                    &format!("make the medium `{side}` thicker, or move the body"),
                );
                return false;
            }
        }
        Face::Medium { .. } => {}
    }
    true
}
