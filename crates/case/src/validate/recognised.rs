//! Recognises bodies that consist of boxes or are extruded outlines, though the file gives them in another
//! form.

use elastocap_geometry::recognition::{Prism, boxes_of, cells_between, prisms_of};

use crate::model::{Body, Box3, Electrostatics, Shape, Terminal, Wall};

/// The largest number of cells into which the planes of all faces may divide the scene. Measured for a plate
/// over an equal one, whose round outlines are stepped, to 1e-2: with 2,900 cells the box solver takes as
/// long as tetrahedra, with 11,000 2.7 times as long, for a third of their error.
const MAX_CELLS: usize = 12_000;

/// The tolerance above which conductors that are far apart in open space stay in their given form unless each
/// is one box. Their weak coupling takes tetrahedra a few seconds, and the box solver up to ten times as
/// long; to 1e-2 both take about the same time.
const LOOSE: f64 = 1e-2;

/// All bodies as boxes, with the names of those that the file gives as surfaces or outlines.
///
/// `None` if there are no such bodies, if one does not consist of boxes, or if tetrahedra suit the scene
/// better: see [`MAX_CELLS`] and [`LOOSE`]. Touching conductors of different terminals give `None` too, since
/// the mesher reports them. The walls were checked before. `drawn` are the names of bodies that the file
/// gives as outlines with holes, even if they are boxes by now.
pub(super) fn as_boxes(
    bodies: &[Body],
    drawn: &[&str],
    terminals: &[Terminal],
    boundary: Option<Wall>,
    settings: &Electrostatics,
) -> Option<(Vec<Body>, Vec<String>)> {
    let mut recognised = Vec::new();
    let mut out = Vec::with_capacity(bodies.len());
    for body in bodies {
        let mut parts = Vec::new();
        for part in &body.parts {
            parts.extend(boxes_of(part, MAX_CELLS)?.into_iter().map(Shape::Box));
        }
        if body.boxes().is_none() || drawn.contains(&body.name.as_str()) {
            recognised.push(body.name.clone());
        }
        out.push(Body { name: body.name.clone(), parts, role: body.role, purpose: body.purpose });
    }
    if recognised.is_empty() || cells_between(out.iter().filter_map(Body::boxes).flatten()) > MAX_CELLS {
        return None;
    }
    let is_loose = settings.solver.is_none()
        && settings.change_tolerance.is_none()
        && settings.relative_tolerance > LOOSE;
    if is_loose && boundary == Some(Wall::Open) && any_far_union(&out) {
        return None;
    }
    let conductors = out.iter().filter(|body| body.is_conductor());
    let conductors: Vec<(&str, Vec<Box3>)> =
        conductors.filter_map(|body| Some((body.name.as_str(), body.boxes()?))).collect();
    let apart = conductors.iter().enumerate().all(|(k, (name, boxes))| {
        let others = conductors[..k].iter().filter(|(other, _)| !Terminal::joins(terminals, name, other));
        let touch = |first: &Box3| boxes.iter().any(|second| first.touches(second));
        !others.flat_map(|(_, other_boxes)| other_boxes).any(touch)
    });
    apart.then_some((out, recognised))
}

/// All bodies with their surfaces as extrusions along one axis, with the names of those that are surfaces, or
/// of all bodies of a mesh.
///
/// `None` if no body is a surface, or if they are not all extruded along one axis. A surface with holes or
/// steps, which is not a single extrusion, stays a surface, which the extruded solver takes as well.
pub(super) fn as_extrusions(bodies: &[Body], from_mesh: bool) -> Option<(Vec<Body>, Vec<String>)> {
    let is_surface =
        |body: &&Body| from_mesh || body.parts.iter().any(|part| matches!(part, Shape::Surface(_)));
    let recognised: Vec<String> = bodies.iter().filter(is_surface).map(|body| body.name.clone()).collect();
    if recognised.is_empty() {
        return None;
    }
    let along = |axis: usize| -> Option<Vec<Body>> {
        let extruded = |body: &Body| {
            let parts = body.parts.iter().map(|part| as_extrusion(part, axis)).collect::<Option<_>>()?;
            Some(Body { parts, ..body.clone() })
        };
        bodies.iter().map(extruded).collect()
    };
    Some(((0..3).find_map(along)?, recognised))
}

/// The shape, as an extrusion if it is the surface of a single one; `None` if it is not extruded along the
/// axis.
fn as_extrusion(shape: &Shape, axis: usize) -> Option<Shape> {
    match shape {
        Shape::Box(_) => Some(shape.clone()),
        Shape::Extrusion { axis: shape_axis, .. }
        | Shape::Cylinder { axis: shape_axis, .. }
        | Shape::Tube { axis: shape_axis, .. } => (*shape_axis == axis).then(|| shape.clone()),
        Shape::Surface(surface) => {
            let prisms = prisms_of(surface, axis)?;
            let [Prism { outlines, ends: [from, to] }] = prisms.as_slice() else {
                return Some(shape.clone());
            };
            let [outline] = outlines.as_slice() else { return Some(shape.clone()) };
            Some(Shape::Extrusion { axis, from: *from, to: *to, outline: outline.clone(), arcs: Vec::new() })
        }
        Shape::Sphere { .. } | Shape::Shell { .. } | Shape::Capsule { .. } | Shape::Physical(_) => None,
    }
}

/// Whether two conductors, at least one of them more than one box, are farther apart along an axis than the
/// size of the smaller one.
fn any_far_union(bodies: &[Body]) -> bool {
    let conductors: Vec<(&Body, Box3)> = bodies
        .iter()
        .filter(|body| body.is_conductor())
        .filter_map(|body| Some((body, body.bounds()?)))
        .collect();
    let size = |region: &Box3| [0, 1, 2].map(|a| region.extent(a)).into_iter().fold(0.0, f64::max);
    let are_far = |(first, a): &(&Body, Box3), (second, b): &(&Body, Box3)| {
        let gap =
            [0, 1, 2].map(|k| (a.min[k] - b.max[k]).max(b.min[k] - a.max[k])).into_iter().fold(0.0, f64::max);
        first.parts.len() + second.parts.len() > 2 && gap > size(a).min(size(b))
    };
    conductors
        .iter()
        .enumerate()
        .any(|(k, second)| conductors[..k].iter().any(|first| are_far(first, second)))
}
