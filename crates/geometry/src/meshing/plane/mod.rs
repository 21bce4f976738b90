//! Triangles of a planar pattern: small at outlines, growing with the distance from them.

use spade::{AngleLimit, ConstrainedDelaunayTriangulation, Point2, RefinementParameters, Triangulation};

/// Points nearer to one another than this, over the size of the pattern, are one.
const SAME: f64 = 1e-9;

/// Angles of triangles, degrees, below which points are added; input angles stay as they are.
const LEAST_ANGLE: f64 = 25.0;

/// So many points are added at most to get there.
const MOST_POINTS: usize = 50_000;

/// A closed outline.
#[derive(Debug, Clone)]
pub(super) struct Ring {
    /// m, a simple polygon, anticlockwise.
    pub(super) corners: Vec<[f64; 2]>,
    /// Size of the triangles at it, m.
    pub(super) near: f64,
}

/// What is wrong with an outline.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Fault {
    /// Fewer than three corners, or no area.
    Degenerate,
    /// It crosses or touches itself.
    Crossing,
}

/// Triangles, anticlockwise.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Planar {
    pub(super) points: Vec<[f64; 2]>,
    pub(super) triangles: Vec<[u32; 3]>,
}

fn minus(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

/// Distance of a point from a segment.
fn distance(p: [f64; 2], [a, b]: [[f64; 2]; 2]) -> f64 {
    let (along, to) = (minus(b, a), minus(p, a));
    let square = dot(along, along);
    let s = if square > 0.0 { (dot(to, along) / square).clamp(0.0, 1.0) } else { 0.0 };
    (to[0] - s * along[0]).hypot(to[1] - s * along[1])
}

/// Signed area of a polygon, positive if anticlockwise.
pub(crate) fn area(corners: &[[f64; 2]]) -> f64 {
    let from = corners.first().copied().unwrap_or_default();
    sides(corners).map(|[a, b]| 0.5 * cross(minus(a, from), minus(b, from))).sum()
}

/// The segments of a polygon.
fn sides(corners: &[[f64; 2]]) -> impl Iterator<Item = [[f64; 2]; 2]> + '_ {
    (0..corners.len()).map(|i| [corners[i], corners[(i + 1) % corners.len()]])
}

/// Whether a point lies in a polygon; any answer on its sides.
pub(super) fn contains(corners: &[[f64; 2]], p: [f64; 2]) -> bool {
    let crossed = sides(corners).filter(|[a, b]| {
        (a[1] > p[1]) != (b[1] > p[1]) && {
            let turn = cross(minus(*b, *a), minus(p, *a));
            (turn > 0.0) == (b[1] > a[1])
        }
    });
    crossed.count() % 2 == 1
}

/// The polygon anticlockwise and without doubled corners.
///
/// # Errors
/// [`Fault`] where it encloses nothing or is not simple. `scale` is the size of the pattern, m.
pub(super) fn cleaned(outline: &[[f64; 2]], scale: f64) -> Result<Vec<[f64; 2]>, Fault> {
    let same = SAME * scale;
    let apart = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]) > same;
    let mut corners: Vec<[f64; 2]> = Vec::with_capacity(outline.len());
    for &p in outline {
        if corners.last().is_none_or(|&last| apart(last, p)) {
            corners.push(p);
        }
    }
    while corners.len() > 1 && !apart(corners[0], corners[corners.len() - 1]) {
        corners.pop();
    }
    let count = corners.len();
    if count < 3 {
        return Err(Fault::Degenerate);
    }
    let all: Vec<_> = sides(&corners).collect();
    for i in 0..count {
        let ([a, b], [_, c]) = (all[i], all[(i + 1) % count]);
        let (u, v) = (minus(b, a), minus(c, b));
        if dot(u, v) < 0.0 && (distance(c, all[i]) <= same || distance(a, [b, c]) <= same) {
            return Err(Fault::Crossing);
        }
        for j in i + 2..count - usize::from(i == 0) {
            let [c, d] = all[j];
            let turn = |[a, b]: [[f64; 2]; 2], p| cross(minus(b, a), minus(p, a)) > 0.0;
            let through = turn(all[i], c) != turn(all[i], d) && turn(all[j], a) != turn(all[j], b);
            let touch = [(a, all[j]), (b, all[j]), (c, all[i]), (d, all[i])];
            if through || touch.into_iter().any(|(p, side)| distance(p, side) <= same) {
                return Err(Fault::Crossing);
            }
        }
    }
    let area = area(&corners);
    if area.abs() <= same * scale {
        return Err(Fault::Degenerate);
    }
    if area < 0.0 {
        corners.reverse();
    }
    Ok(corners)
}

/// Corners that (nearly) coincide with corners or sides of other outlines become exactly those: hair-thin triangles between
/// them would be refined without end. `frame` is a rectangle that counts as an outline and keeps its place.
pub(super) fn snapped(rings: &mut [Ring], frame: [[f64; 2]; 2]) {
    let same = SAME * (frame[1][0] - frame[0][0]).max(frame[1][1] - frame[0][1]).max(0.0);
    let same = rings.iter().fold(same, |same, r| same.min(1e-3 * r.near));
    let mut known: Vec<[f64; 2]> = Vec::new();
    for ring in rings.iter_mut() {
        for p in &mut ring.corners {
            for axis in 0..2 {
                for end in frame {
                    if (p[axis] - end[axis]).abs() <= same {
                        p[axis] = end[axis];
                    }
                }
            }
            match known.iter().find(|q| (p[0] - q[0]).hypot(p[1] - q[1]) <= same) {
                Some(&q) => *p = q,
                None => known.push(*p),
            }
        }
    }
    for ring in rings.iter_mut() {
        let mut corners = Vec::with_capacity(ring.corners.len());
        for [a, b] in sides(&ring.corners) {
            corners.push(a);
            let mut on: Vec<[f64; 2]> =
                known.iter().copied().filter(|&p| p != a && p != b && distance(p, [a, b]) <= same).collect();
            let along = minus(b, a);
            on.sort_by(|p, q| dot(minus(*p, a), along).total_cmp(&dot(minus(*q, a), along)));
            corners.extend(on);
        }
        ring.corners = corners;
    }
}

/// Triangles, anticlockwise, that fill a simple polygon and have no other corners than its own.
pub(crate) fn filled(outline: &[[f64; 2]]) -> Vec<[[f64; 2]; 3]> {
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

/// Triangles of the rectangle `frame` whose sides keep to all outlines: of size `near` at each outline and at most
/// `near + growth * distance` away from it. `None` where that takes too many.
pub(super) fn triangulate(rings: &[Ring], frame: [[f64; 2]; 2], growth: f64) -> Option<Planar> {
    let [low, high] = frame;
    let whole = [low, [high[0], low[1]], high, [low[0], high[1]]];
    let mut cdt = ConstrainedDelaunayTriangulation::<Point2<f64>>::new();
    let at = |p: [f64; 2]| Point2::new(p[0], p[1]);
    let pieces = rings.iter().map(|r| (&r.corners[..], r.near)).chain([(&whole[..], f64::INFINITY)]);
    for (corners, near) in pieces {
        for [a, b] in sides(corners) {
            let along = minus(b, a);
            let count = (along[0].hypot(along[1]) / near).ceil().clamp(1.0, 1e4) as usize;
            let mut last = cdt.insert(at(a)).ok()?;
            for i in 1..=count {
                let s = i as f64 / count as f64;
                let p = if i == count { b } else { [a[0] + s * along[0], a[1] + s * along[1]] };
                let next = cdt.insert(at(p)).ok()?;
                if last != next {
                    cdt.add_constraint_and_split(last, next, |p| p);
                }
                last = next;
            }
        }
    }
    for p in filling(rings, frame, growth)? {
        cdt.insert(at(p)).ok()?;
    }
    let scale = (high[0] - low[0]).max(high[1] - low[1]);
    let outcome = cdt.refine(
        RefinementParameters::new()
            .with_angle_limit(AngleLimit::from_deg(LEAST_ANGLE))
            .with_min_required_area((SAME * scale) * (SAME * scale))
            .with_max_additional_vertices(MOST_POINTS),
    );
    if !outcome.refinement_complete {
        return None;
    }
    // Points of split sides leave the frame by rounding; they go back to it.
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
    let mut planar = Planar { points: Vec::new(), triangles: Vec::new() };
    let mut index = vec![u32::MAX; cdt.num_vertices()];
    for face in cdt.inner_faces() {
        let corners = face.vertices().map(|v| (v.index(), place(v.position())));
        let middle = [0, 1].map(|k| corners.iter().map(|c| c.1[k]).sum::<f64>() / 3.0);
        let on_side =
            |k: usize| corners.iter().all(|c| c.1[k] == low[k]) || corners.iter().all(|c| c.1[k] == high[k]);
        if (0..2).any(|k| middle[k] <= low[k] || middle[k] >= high[k] || on_side(k)) {
            continue;
        }
        planar.triangles.push(corners.map(|(v, place)| {
            if index[v] == u32::MAX {
                index[v] = planar.points.len() as u32;
                planar.points.push(place);
            }
            index[v]
        }));
    }
    Some(planar)
}

/// Points that fill the frame: the middles of the cells of a quadtree.
fn filling(rings: &[Ring], [low, high]: [[f64; 2]; 2], growth: f64) -> Option<Vec<[f64; 2]>> {
    let all: Vec<_> = rings.iter().flat_map(|r| sides(&r.corners).map(|s| (s, r.near))).collect();
    let size = (high[0] - low[0]).max(high[1] - low[1]);
    let mut open = vec![([0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1])], size)];
    let mut points = Vec::new();
    while let Some((middle, side)) = open.pop() {
        if (0..2).any(|k| middle[k] + 0.5 * side <= low[k] || middle[k] - 0.5 * side >= high[k]) {
            continue;
        }
        let mut wanted = 0.25 * size;
        let mut nearest = f64::INFINITY;
        for &(segment, near) in &all {
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
            if points.len() > MOST_POINTS {
                return None;
            }
        }
    }
    Some(points)
}
