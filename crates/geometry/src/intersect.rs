//! Intersection tests for triangles: a tree of boxes finds candidate pairs, and exact predicates decide.

use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use robust::{Coord, Coord3D, orient2d, orient3d};

/// A point in space, m.
pub(crate) type Point = [f64; 3];

/// A bounding volume hierarchy of triangles, or of other objects with bounds.
pub(crate) struct Search {
    /// The tree, whose leaves hold indices into `boxes`.
    tree: Bvh2,
    /// The bounds of each object.
    boxes: Vec<Aabb>,
}

/// A shift and a scale that bring all coordinates to [-1, 1], where single precision is enough: every step
/// keeps the order of two numbers, so boxes that overlap still overlap.
#[derive(Clone, Copy)]
pub(crate) struct Frame {
    /// The point that becomes the origin.
    middle: Point,
    /// The length that becomes 1.
    scale: f64,
}

impl Frame {
    /// The frame in which these points fill [-1, 1].
    pub(crate) fn around<'a>(points: impl Iterator<Item = &'a Point>) -> Self {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for p in points {
            for a in 0..3 {
                low[a] = low[a].min(p[a]);
                high[a] = high[a].max(p[a]);
            }
        }
        let middle = [0, 1, 2].map(|a| 0.5 * low[a] + 0.5 * high[a]);
        let half = (0..3).fold(0.0, |half: f64, a| half.max(0.5 * (high[a] - low[a])));
        Self { middle, scale: if half > 0.0 { half } else { 1.0 } }
    }

    /// The smallest box that holds the points, in the coordinates of the frame.
    pub(crate) fn bounds(&self, points: &[Point]) -> Aabb {
        let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        for p in points {
            for a in 0..3 {
                let x = ((p[a] - self.middle[a]) / self.scale) as f32;
                low[a] = low[a].min(x);
                high[a] = high[a].max(x);
            }
        }
        Aabb::new(low.into(), high.into())
    }
}

impl Search {
    /// A tree of the faces of a surface.
    fn new(frame: Frame, points: &[Point], faces: &[[u32; 3]]) -> Self {
        Self::of(faces.iter().map(|f| frame.bounds(&f.map(|p| points[p as usize]))).collect())
    }

    /// A tree of these boxes.
    pub(crate) fn of(boxes: Vec<Aabb>) -> Self {
        let indices = (0..boxes.len() as u32).collect();
        let tree = PlocBuilder::new().build(PlocSearchDistance::Low, &boxes, indices, SortPrecision::U64, 0);
        Self { tree, boxes }
    }

    /// Calls `each` with the number of every box that meets `bounds`; `stack` is working memory.
    pub(crate) fn near(&self, bounds: &Aabb, stack: &mut Vec<u32>, mut each: impl FnMut(u32)) {
        stack.clear();
        if !self.tree.nodes.is_empty() {
            stack.push(0);
        }
        while let Some(index) = stack.pop() {
            let node = &self.tree.nodes[index as usize];
            if !node.aabb().intersect_aabb(bounds) {
                continue;
            }
            if node.is_leaf() {
                for k in node.first_index..node.first_index + node.prim_count {
                    each(self.tree.primitive_indices[k as usize]);
                }
            } else {
                stack.push(node.first_index);
                stack.push(node.first_index + 1);
            }
        }
    }
}

/// The first two faces, by their indices, that have a point in common beyond the corners and edges they
/// share.
///
/// No face may be degenerate.
pub(super) fn within(points: &[Point], faces: &[[u32; 3]]) -> Option<(usize, usize)> {
    let frame = Frame::around(points.iter());
    let search = Search::new(frame, points, faces);
    let mut stack = Vec::new();
    for i in 0..faces.len() {
        let mut first_hit: Option<usize> = None;
        search.near(&search.boxes[i], &mut stack, |j| {
            let j = j as usize;
            if j > i && first_hit.is_none_or(|f| j < f) && faces_meet(points, faces[i], faces[j]) {
                first_hit = Some(j);
            }
        });
        if let Some(j) = first_hit {
            return Some((i, j));
        }
    }
    None
}

/// The first face of `left` that has a point in common with a face of `right`, and the first such face of
/// `right`. Both surfaces are points and the indices of the corners of their faces.
pub(super) fn between(
    left: (&[Point], &[[u32; 3]]),
    right: (&[Point], &[[u32; 3]]),
) -> Option<(usize, usize)> {
    let frame = Frame::around(left.0.iter().chain(right.0));
    let search = Search::new(frame, right.0, right.1);
    let mut stack = Vec::new();
    for (i, face) in left.1.iter().enumerate() {
        let corners = face.map(|p| left.0[p as usize]);
        let mut first_hit: Option<usize> = None;
        search.near(&frame.bounds(&corners), &mut stack, |j| {
            let j = j as usize;
            if first_hit.is_none_or(|f| j < f)
                && triangles_meet(corners, right.1[j].map(|p| right.0[p as usize]))
            {
                first_hit = Some(j);
            }
        });
        if let Some(j) = first_hit {
            return Some((i, j));
        }
    }
    None
}

/// Whether two faces of one surface meet beyond the corners they share by index.
fn faces_meet(points: &[Point], f: [u32; 3], g: [u32; 3]) -> bool {
    let point = |p: u32| points[p as usize];
    let shared: Vec<u32> = f.into_iter().filter(|p| g.contains(p)).collect();
    match shared[..] {
        [] => triangles_meet(f.map(point), g.map(point)),
        // Two triangles with a common corner intersect in a star around it. If it is more than the corner, it
        // reaches the opposite edge of one of the two.
        [corner] => {
            let opposite = |t: [u32; 3]| {
                let k = t.iter().position(|&p| p == corner).unwrap_or(0);
                [point(t[(k + 1) % 3]), point(t[(k + 2) % 3])]
            };
            segment_meets(opposite(f), g.map(point)) || segment_meets(opposite(g), f.map(point))
        }
        // Triangles with a common edge meet elsewhere only if they are folded flat onto each other.
        [u, v] => {
            let other = |t: [u32; 3]| t.into_iter().find(|p| *p != u && *p != v).map(point);
            let (Some(a), Some(b)) = (other(f), other(g)) else { return true };
            if side(point(u), point(v), a, b) != 0.0 {
                return false;
            }
            let axes = flat_axes([point(u), point(v), a]);
            let turn = |p| flat_turn(axes, point(u), point(v), p);
            (turn(a) > 0.0) == (turn(b) > 0.0)
        }
        _ => true,
    }
}

/// Whether two closed triangles have a point in common. If they do, an edge of one meets the other.
fn triangles_meet(f: [Point; 3], g: [Point; 3]) -> bool {
    let beyond = |t: [Point; 3], other: [Point; 3]| {
        let s = other.map(|p| side(t[0], t[1], t[2], p));
        s.iter().all(|&s| s > 0.0) || s.iter().all(|&s| s < 0.0)
    };
    if beyond(f, g) || beyond(g, f) {
        return false;
    }
    (0..3).any(|k| segment_meets([f[k], f[(k + 1) % 3]], g) || segment_meets([g[k], g[(k + 1) % 3]], f))
}

/// Whether a closed segment and a closed triangle have a point in common.
fn segment_meets([p, q]: [Point; 2], t: [Point; 3]) -> bool {
    let (sp, sq) = (side(t[0], t[1], t[2], p), side(t[0], t[1], t[2], q));
    if (sp > 0.0 && sq > 0.0) || (sp < 0.0 && sq < 0.0) {
        return false;
    }
    if sp == 0.0 && sq == 0.0 {
        let axes = flat_axes(t);
        let inside = |p| {
            let s = [0, 1, 2].map(|k| flat_turn(axes, t[k], t[(k + 1) % 3], p));
            s.iter().all(|&s| s >= 0.0) || s.iter().all(|&s| s <= 0.0)
        };
        return inside(p) || inside(q) || (0..3).any(|k| segments_meet(axes, [p, q], [t[k], t[(k + 1) % 3]]));
    }
    let s = [0, 1, 2].map(|k| side(p, q, t[k], t[(k + 1) % 3]));
    s.iter().all(|&s| s >= 0.0) || s.iter().all(|&s| s <= 0.0)
}

/// Whether two closed segments in a plane meet, projected onto two axes. Segments on one line meet if they
/// overlap along both axes.
fn segments_meet(axes: [usize; 2], [p, q]: [Point; 2], [a, b]: [Point; 2]) -> bool {
    let (pa, pb) = (flat_turn(axes, p, q, a), flat_turn(axes, p, q, b));
    let (ap, aq) = (flat_turn(axes, a, b, p), flat_turn(axes, a, b, q));
    let apart = |s: f64, t: f64| (s > 0.0 && t > 0.0) || (s < 0.0 && t < 0.0);
    if apart(pa, pb) || apart(ap, aq) {
        return false;
    }
    if pa == 0.0 && pb == 0.0 {
        let overlap = |x: usize| p[x].min(q[x]) <= a[x].max(b[x]) && a[x].min(b[x]) <= p[x].max(q[x]);
        return axes.into_iter().all(overlap);
    }
    true
}

/// The two axes onto which a triangle projects with the largest area, so that it does not become flat.
fn flat_axes(t: [Point; 3]) -> [usize; 2] {
    let projections = [[0, 1], [1, 2], [2, 0]];
    let size = projections.map(|axes| flat_turn(axes, t[0], t[1], t[2]).abs());
    let best = (0..3).fold(0, |best, k| if size[k] > size[best] { k } else { best });
    projections[best]
}

/// Whether the three points lie on one line, exactly.
pub(super) fn collinear(t: [Point; 3]) -> bool {
    [[0, 1], [1, 2], [2, 0]].iter().all(|&axes| flat_turn(axes, t[0], t[1], t[2]) == 0.0)
}

/// The side of the plane abc on which d lies, as a number whose sign is exact.
fn side(a: Point, b: Point, c: Point, d: Point) -> f64 {
    let [a, b, c, d] = [a, b, c, d].map(|[x, y, z]| Coord3D { x, y, z });
    orient3d(a, b, c, d)
}

/// The orientation of abc, projected onto two axes: positive if anticlockwise, with an exact sign.
pub(crate) fn flat_turn(axes: [usize; 2], a: Point, b: Point, c: Point) -> f64 {
    let [a, b, c] = [a, b, c].map(|p| Coord { x: p[axes[0]], y: p[axes[1]] });
    orient2d(a, b, c)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_is_compared_with_those_of_neighbouring_cells_however_many_there_are() {
        for n in [8_u32, 64] {
            // A square of n by n cells of two triangles each, bent to a saddle.
            let along = |k: u32| f64::from(k) / f64::from(n) - 0.5;
            let points: Vec<Point> = (0..=n)
                .flat_map(|i| (0..=n).map(move |j| [along(i), along(j), along(i) * along(j)]))
                .collect();
            let at = |i: u32, j: u32| i * (n + 1) + j;
            let cell = |i, j| {
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                [[a, b, c], [a, c, d]]
            };
            let faces: Vec<[u32; 3]> = (0..n).flat_map(|i| (0..n).flat_map(move |j| cell(i, j))).collect();
            let search = Search::new(Frame::around(points.iter()), &points, &faces);
            let mut stack = Vec::new();
            let mut compared = 0;
            for bounds in &search.boxes {
                search.near(bounds, &mut stack, |_| compared += 1);
            }
            // The box of a triangle is that of its cell, which meets nine cells, itself among them.
            assert!((faces.len()..=18 * faces.len()).contains(&compared), "{compared} of {}", faces.len());
            assert_eq!(within(&points, &faces), None);
        }
    }
}
