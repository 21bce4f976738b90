//! Triangulations of the plane that contain given outlines.
//!
//! The outlines are constraints of a Delaunay triangulation (crate `spade`), which is refined until angles
//! are wide enough (Ruppert's algorithm).

use super::outlines::{Outline, SAME, contains, distance, minus, sides};
use crate::meshing::indices::Renumbering;
use spade::handles::{FaceHandle, InnerTag};
use spade::{
    AngleLimit, CdtEdge, ConstrainedDelaunayTriangulation, HasPosition, Point2, RefinementParameters,
    Triangulation, mitigate_underflow,
};
use std::collections::HashSet;

/// Triangles with an angle below this, in degrees, are refined; angles of the outlines stay as they are.
const MIN_ANGLE: f64 = 25.0;

/// Limit on the number of points that fill the frame, and on that of the points that refinement adds. Not
/// tuned: limits that ordinary cases do not reach.
const MAX_POINTS: usize = 50_000;

/// A mesh of the plane.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PlaneMesh {
    /// Positions, m.
    pub(crate) points: Vec<[f64; 2]>,
    /// Corners of each triangle, anticlockwise, as indices into `points`.
    pub(crate) triangles: Vec<[u32; 3]>,
}

/// Divides a simple polygon into anticlockwise triangles between its corners. Empty if that fails.
pub(crate) fn fill_polygon(outline: &[[f64; 2]]) -> Vec<[[f64; 2]; 3]> {
    let mut cdt = ConstrainedDelaunayTriangulation::<Point2<f64>>::new();
    let mut insert = |p: [f64; 2]| cdt.insert(Point2::new(p[0], p[1])).ok();
    let Some(corners) = outline.iter().map(|p| insert(*p)).collect::<Option<Vec<_>>>() else {
        return Vec::new();
    };
    for (k, &from) in corners.iter().enumerate() {
        let to = corners[(k + 1) % corners.len()];
        if from != to && cdt.can_add_constraint(from, to) {
            cdt.add_constraint(from, to);
        }
    }
    let faces = cdt.inner_faces().map(|face| face.positions().map(|p| [p.x, p.y]));
    faces.filter(|t| contains(outline, [0, 1].map(|k| (t[0][k] + t[1][k] + t[2][k]) / 3.0))).collect()
}

/// Triangulates the rectangle with the lower and the upper corner `frame`, m, so that all outlines consist of
/// sides of triangles. Triangles have the size [`Outline::near`] at an outline and at most `near + growth *
/// distance` away from it. `None` if that takes too many.
pub(crate) fn triangulate(outlines: &[Outline], frame: [[f64; 2]; 2], growth: f64) -> Option<PlaneMesh> {
    let [low, high] = frame;
    let whole = [low, [high[0], low[1]], high, [low[0], high[1]]];
    let mut cdt = ConstrainedDelaunayTriangulation::<Point2<f64>>::new();
    let position = |p: [f64; 2]| Point2::new(p[0], p[1]);
    let pieces = outlines.iter().map(|r| (&r.corners[..], r.near)).chain([(&whole[..], f64::INFINITY)]);
    for (corners, near) in pieces {
        for [a, b] in sides(corners) {
            // A side is divided from the same end, whichever outline it belongs to. Otherwise rounding would
            // separate the points of neighbouring outlines.
            let [a, b] = if a <= b { [a, b] } else { [b, a] };
            let along = minus(b, a);
            let count = (along[0].hypot(along[1]) / near).ceil().clamp(1.0, 1e4) as usize;
            let mut last = cdt.insert(position(a)).ok()?;
            for i in 1..=count {
                let s = i as f64 / count as f64;
                let p = if i == count { b } else { [a[0] + s * along[0], a[1] + s * along[1]] };
                let next = cdt.insert(position(p)).ok()?;
                if last != next {
                    cdt.add_constraint_and_split(last, next, |p| p);
                }
                last = next;
            }
        }
    }
    for p in inner_points(outlines, frame, growth)? {
        cdt.insert(position(p)).ok()?;
    }
    let scale = (high[0] - low[0]).max(high[1] - low[1]);
    let outcome = cdt.refine(
        RefinementParameters::new()
            .with_angle_limit(AngleLimit::from_deg(MIN_ANGLE))
            .with_min_required_area((SAME * scale) * (SAME * scale))
            .with_max_additional_vertices(MAX_POINTS),
    );
    if !outcome.refinement_complete {
        return None;
    }
    // Rounding moves points on the sides of the frame off these; they move back.
    let place = |p: Point2<f64>| {
        let mut p = [p.x, p.y];
        for k in 0..2 {
            for end in [low[k], high[k]] {
                if (p[k] - end).abs() <= 1e-3 * SAME * scale {
                    p[k] = end;
                }
            }
        }
        p
    };
    let mut planar = PlaneMesh { points: Vec::new(), triangles: Vec::new() };
    let mut numbers = Renumbering::new(cdt.num_vertices());
    for face in cdt.inner_faces() {
        let corners = face.vertices().map(|v| (v.index(), place(v.position())));
        let middle = [0, 1].map(|k| corners.iter().map(|c| c.1[k]).sum::<f64>() / 3.0);
        let on_side =
            |k: usize| corners.iter().all(|c| c.1[k] == low[k]) || corners.iter().all(|c| c.1[k] == high[k]);
        if (0..2).any(|k| middle[k] <= low[k] || middle[k] >= high[k] || on_side(k)) {
            continue;
        }
        let triangle = corners.map(|(v, place)| numbers.number(v, || planar.points.push(place)));
        planar.triangles.push(triangle);
    }
    Some(planar)
}

/// Points that fill the frame: the centres of the cells of a quadtree whose sides are as long as triangles
/// may be. `None` if they are too many.
fn inner_points(outlines: &[Outline], [low, high]: [[f64; 2]; 2], growth: f64) -> Option<Vec<[f64; 2]>> {
    let segments: Vec<_> = outlines.iter().flat_map(|r| sides(&r.corners).map(|s| (s, r.near))).collect();
    let size = (high[0] - low[0]).max(high[1] - low[1]);
    let mut open = vec![([0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1])], size)];
    let mut points = Vec::new();
    while let Some((middle, side)) = open.pop() {
        if (0..2).any(|k| middle[k] + 0.5 * side <= low[k] || middle[k] - 0.5 * side >= high[k]) {
            continue;
        }
        let mut wanted = 0.25 * size;
        let mut nearest = f64::INFINITY;
        for &(segment, near) in &segments {
            let d = distance(middle, segment);
            wanted = wanted.min(near + growth * d);
            nearest = nearest.min(d);
        }
        if side > wanted {
            let q = 0.25 * side;
            for [x, y] in [[-q, -q], [q, -q], [-q, q], [q, q]] {
                open.push(([middle[0] + x, middle[1] + y], 0.5 * side));
            }
            continue;
        }
        for k in 0..2 {
            nearest = nearest.min(middle[k] - low[k]).min(high[k] - middle[k]);
        }
        if nearest > 0.4 * side {
            points.push(middle);
            if points.len() > MAX_POINTS {
                return None;
            }
        }
    }
    Some(points)
}

/// A vertex of the triangulation that knows its index in the list of points.
struct Numbered {
    /// The position.
    at: Point2<f64>,
    /// The index.
    number: usize,
}

impl HasPosition for Numbered {
    type Scalar = f64;

    fn position(&self) -> Point2<f64> {
        self.at
    }
}

/// A part of the constrained Delaunay triangulation of points: anticlockwise triangles, by the indices of
/// their corners. The edges of `outlines` and the `further` ones, all by the indices of their ends, are sides
/// of triangles. The outlines divide the plane into cells; triangles are returned of the cells whose widest
/// triangle has its centre `inside`.
///
/// Points at the same place count once, and edges that would cross earlier ones are left out: rounding alone
/// makes them do so. A cell that no outline separates from the space around all points is outside. Where an
/// edge of an outline has been left out, cells may have merged, and each triangle counts by its own centre.
pub(crate) fn constrained_triangles(
    points: &[[f64; 2]],
    outlines: &[[usize; 2]],
    further: &[[usize; 2]],
    inside: impl Fn([f64; 2]) -> bool,
) -> Vec<[usize; 3]> {
    let mut cdt = ConstrainedDelaunayTriangulation::<Numbered>::new();
    let mut handles = Vec::with_capacity(points.len());
    for (number, p) in points.iter().enumerate() {
        let at = mitigate_underflow(Point2::new(p[0], p[1]));
        let Ok(handle) = cdt.insert(Numbered { at, number }) else { return Vec::new() };
        handles.push(handle);
    }
    let mut has_all_outlines = true;
    let mut separating = HashSet::new();
    for (k, [a, b]) in outlines.iter().chain(further).enumerate() {
        let [from, to] = [*a, *b].map(|p| handles[p]);
        let fits = from != to && cdt.can_add_constraint(from, to);
        if fits {
            cdt.add_constraint(from, to);
        }
        if k < outlines.len() {
            has_all_outlines &= fits;
            separating.insert([from.min(to), from.max(to)]);
        }
    }
    let mut out = Vec::new();
    let mut seen = HashSet::new();
    for face in cdt.inner_faces() {
        if !seen.insert(face.fix()) {
            continue;
        }
        let mut cell = vec![face];
        let mut next = 0;
        let mut is_open = false;
        while next < cell.len() {
            for edge in cell[next].adjacent_edges() {
                let [a, b] = edge.vertices().map(|v| v.fix());
                if separating.contains(&[a.min(b), a.max(b)]) {
                    continue;
                }
                match edge.rev().face().as_inner() {
                    None => is_open = true,
                    Some(across) => {
                        if seen.insert(across.fix()) {
                            cell.push(across);
                        }
                    }
                }
            }
            next += 1;
        }
        let width = |f: &FaceHandle<'_, InnerTag, Numbered, (), CdtEdge<()>, ()>| {
            let longest = f.adjacent_edges().map(|e| e.length_2()).into_iter().fold(0.0, f64::max);
            if longest > 0.0 { f.area() / longest.sqrt() } else { 0.0 }
        };
        let center = |f: &FaceHandle<'_, InnerTag, Numbered, (), CdtEdge<()>, ()>| {
            let middle = f.center();
            [middle.x, middle.y]
        };
        if !has_all_outlines {
            cell.retain(|f| inside(center(f)));
        } else {
            let widest =
                cell.iter().copied().reduce(|best, f| if width(&f) > width(&best) { f } else { best });
            if is_open || !widest.is_some_and(|f| inside(center(&f))) {
                continue;
            }
        }
        out.extend(cell.iter().map(|f| f.vertices().map(|v| v.data().number)));
    }
    out
}
