//! Finds conductors that touch, overlap or contain one another.

use std::borrow::Cow;
use std::ops::Range;

use super::super::diagnostics::{Diagnostic, shown};
use super::super::model::{Body, Shape, Terminal};
use super::super::reader::Log;

/// The largest number of points of a shape that are tested for lying in another one. It is not tuned.
const CORNERS: usize = 32;

/// A conductor with the place in the file that gives its shape.
pub(super) struct PlacedConductor<'a> {
    pub(super) name: &'a str,
    pub(super) span: &'a Range<usize>,
    pub(super) parts: Cow<'a, [Shape]>,
}

impl<'a> PlacedConductor<'a> {
    /// The conductors among these bodies.
    pub(super) fn of(bodies: &'a [(Body, Range<usize>)]) -> Vec<Self> {
        let conductors = bodies.iter().filter(|(body, _)| body.is_conductor());
        let placed = |(body, span): &'a (Body, Range<usize>)| Self {
            name: &body.name,
            span,
            parts: Cow::Borrowed(&body.parts),
        };
        conductors.map(placed).collect()
    }
}

/// Refuses conductors that share a point unless they belong to one terminal. This finds touching boxes, and
/// bodies with a corner or the middle inside another one; the mesher finds the others.
pub(super) fn check_touching(bodies: &[PlacedConductor<'_>], terminals: &[Terminal], log: &mut Log<'_>) {
    for (k, second) in bodies.iter().enumerate() {
        for first in &bodies[..k] {
            if log.is_full() {
                return;
            }
            let meet = |part: &Shape| second.parts.iter().any(|other| share_a_point(part, other));
            if first.parts.iter().any(meet) && !Terminal::joins(terminals, first.name, second.name) {
                let (a, b) = (shown(first.name), shown(second.name));
                log.push(
                    Diagnostic::at(
                        second.span,
                        format!("the conductors \"{a}\" and \"{b}\" touch or overlap"),
                    )
                    .label(format!("\"{b}\" shares a point with \"{a}\""))
                    .related(first.span, format!("\"{a}\" is here"))
                    .help(
                        "leave a gap between the two, or join them: as one conductor, or in one [[terminal]]",
                    ),
                );
            }
        }
    }
}

/// Whether two shapes are known to share a point.
fn share_a_point(first: &Shape, second: &Shape) -> bool {
    if let (Some(a), Some(b)) = (first.bounds(), second.bounds())
        && !a.touches(&b)
    {
        return false;
    }
    match (first, second) {
        (Shape::Box(a), Shape::Box(b)) => a.touches(b),
        _ => holds_some_of(first, second) || holds_some_of(second, first),
    }
}

/// Whether one of some points of `inner` lies in `outer`.
fn holds_some_of(outer: &Shape, inner: &Shape) -> bool {
    // Each point is compared with all triangles of a surface, so that one must suffice.
    let most = if matches!(outer, Shape::Surface(_)) { 1 } else { CORNERS };
    points_of(inner).into_iter().take(most).any(|point| outer.contains(point))
}

/// Some points of a shape.
fn points_of(shape: &Shape) -> Vec<[f64; 3]> {
    match shape {
        Shape::Box(b) => {
            let corner = |k: usize| [0, 1, 2].map(|a| if k >> a & 1 == 0 { b.min[a] } else { b.max[a] });
            let middle = [0, 1, 2].map(|a| 0.5 * (b.min[a] + b.max[a]));
            (0..8).map(corner).chain([middle]).collect()
        }
        Shape::Sphere { center, .. } => vec![*center],
        Shape::Capsule { from, to, .. } => vec![*from, *to],
        Shape::Cylinder { axis, base, height, .. } => {
            let mut top = *base;
            top[*axis] += height;
            vec![*base, top]
        }
        Shape::Tube { axis, base, radii, height } => {
            let mut within = *base;
            within[(axis + 1) % 3] += 0.5 * (radii[0] + radii[1]);
            let mut top = within;
            top[*axis] += height;
            vec![within, top]
        }
        Shape::Extrusion { axis, from, to, outline, .. } => {
            let [first, second] = match axis {
                0 => [1, 2],
                1 => [0, 2],
                _ => [0, 1],
            };
            let placed = |corner: &[f64; 2], end: f64| {
                let mut point = [end; 3];
                (point[first], point[second]) = (corner[0], corner[1]);
                point
            };
            let corners = outline.iter().step_by(outline.len().div_ceil(CORNERS / 2).max(1));
            corners.flat_map(|corner| [placed(corner, *from), placed(corner, *to)]).collect()
        }
        Shape::Surface(surface) => surface.points.first().copied().into_iter().collect(),
        // Points outside of a shell are outside of the scene, and the cells of a group are known only to its
        // mesh.
        Shape::Shell { .. } | Shape::Physical(_) => Vec::new(),
    }
}
