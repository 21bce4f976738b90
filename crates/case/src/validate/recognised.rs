//! Bodies that consist of boxes though the file gives them in another way.

use elastocap_geometry::recognition::boxes_of;

use crate::model::{Body, Box3, Electrostatics, Shape, Wall};

/// Largest number of cells that the planes of all faces may divide the scene into. A plate over its like with round outlines in steps,
/// to 1e-2: with 2,900 cells the box solver takes as long as tetrahedra, with 11,000 2.7 times as long, for a third of their error.
const MAX_CELLS: usize = 12_000;

/// Above this tolerance, conductors that are far apart in open space stay as they are given unless each is one box. Their weak coupling
/// takes tetrahedra a few seconds there, and the box solver up to ten times as long; to 1e-2 both take about the same.
const LOOSE: f64 = 1e-2;

/// The same bodies as boxes, and the names of those that the file gives in another way; `None` if a body is no union of boxes, if
/// they have very many faces or are far apart (see [`LOOSE`]), or if conductors touch each other, which the mesher refuses in its own words. That they lie inside the
/// walls has been checked.
pub(super) fn as_boxes(
    bodies: &[Body],
    boundary: Option<Wall>,
    asked: &Electrostatics,
) -> Option<(Vec<Body>, Vec<String>)> {
    let mut recognised = Vec::new();
    let mut out = Vec::with_capacity(bodies.len());
    for body in bodies {
        let mut parts = Vec::new();
        for part in &body.parts {
            parts.extend(boxes_of(part, MAX_CELLS)?.into_iter().map(Shape::Box));
        }
        if body.boxes().is_none() {
            recognised.push(body.name.clone());
        }
        out.push(Body { parts, ..body.clone() });
    }
    if recognised.is_empty() || cells(&out) > MAX_CELLS {
        return None;
    }
    let is_loose = asked.solver.is_none() && asked.relative_tolerance > LOOSE;
    if is_loose && boundary == Some(Wall::Open) && any_far_union(&out) {
        return None;
    }
    let conductors: Vec<Vec<Box3>> =
        out.iter().filter(|body| body.is_conductor()).filter_map(Body::boxes).collect();
    let apart = (1..conductors.len()).all(|k| {
        let touch = |first: &Box3| conductors[k].iter().any(|second| first.touches(second));
        !conductors[..k].iter().flatten().any(touch)
    });
    apart.then_some((out, recognised))
}

/// How many cells the planes of all faces divide the scene into.
fn cells(bodies: &[Body]) -> usize {
    let boxes: Vec<Box3> = bodies.iter().filter_map(Body::boxes).flatten().collect();
    let between = |axis: usize| {
        let ends = boxes.iter().flat_map(|region| [region.min[axis], region.max[axis]]);
        let mut planes: Vec<f64> = ends.filter(|at| at.is_finite()).collect();
        planes.sort_by(f64::total_cmp);
        planes.dedup();
        planes.len().saturating_sub(1).max(1)
    };
    (0..3).map(between).fold(1, usize::saturating_mul)
}

/// Whether two conductors, not both a single box, are farther apart along an axis than the smaller of the two is large.
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
