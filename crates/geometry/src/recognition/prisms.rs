//! Recognition of surfaces of triangles that are polygons extruded along an axis.
//!
//! The test is exact up to rounding. Every triangle must lie in a plane normal or parallel to the axis. A
//! line along the axis enters or leaves the body at the triangles normal to it, so that the cross-section
//! between two of their planes is the set of points that an odd number of the triangles below covers: the
//! edges of these triangles that do not cancel in pairs are its outlines. Where outlines of one body touch,
//! or edges of two of its steps overlap, their edges are divided so that they have corners in common.

use super::{ascending, encloses};
use crate::outline;
use crate::scene::across;
use crate::shapes::TriangleSurface;
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::TAU;

/// Distances below this share of the size of a surface are due to rounding. Not tuned: it only has to lie
/// above rounding errors and below distances that matter.
const NEAR: f64 = 1e-12;

/// Polygons pulled along an axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Prism {
    /// Corners in the two other coordinates in ascending order of axis, m. A point inside an odd number of
    /// these polygons is in the body.
    pub outlines: Vec<Vec<[f64; 2]>>,
    /// Lower and upper end along the axis, m.
    pub ends: [f64; 2],
}

/// The prisms along an axis that a closed surface consists of, stacked one on the other; `None` if it does
/// not consist of such prisms.
pub fn prisms_of(surface: &TriangleSurface, axis: usize) -> Option<Vec<Prism>> {
    let [p, q] = across(axis);
    let near = NEAR * size(surface.points.iter());
    let mut flat = Vec::new();
    for face in &surface.faces {
        let corners = face.map(|k| surface.points[k as usize]);
        let plan = corners.map(|corner| [corner[p], corner[q]]);
        if corners.iter().all(|corner| (corner[axis] - corners[0][axis]).abs() <= near) {
            flat.push((corners[0][axis], plan));
        } else if !is_on_a_line(plan, near) {
            return None;
        }
    }
    let levels = distinct(flat.iter().map(|(at, _)| *at), near);
    let level_of = |at: f64| levels.partition_point(|level| *level <= at).saturating_sub(1);
    flat.sort_by_key(|(at, _)| level_of(*at));
    let mut edges = Edges::between(flat.iter().flat_map(|(_, plan)| plan), near);
    let mut prisms = Vec::new();
    for same in flat.chunk_by(|(a, _), (b, _)| level_of(*a) == level_of(*b)) {
        same.iter().for_each(|(_, triangle)| edges.flip_around(triangle));
        edges.divide();
        let outlines = edges.loops();
        let level = level_of(same[0].0);
        match levels.get(level + 1) {
            Some(next) if !outlines.is_empty() => {
                prisms.push(Prism { outlines, ends: [levels[level], *next] });
            }
            Some(_) => {}
            None if outlines.is_empty() => {}
            None => return None,
        }
    }
    let volume: f64 = prisms.iter().map(Prism::volume).sum();
    encloses(surface, volume).then_some(prisms)
}

/// The outlines of the area that triangles in a plane normal to an axis cover; an odd number of outlines
/// contains each of its points.
pub fn outlines_in_plane(triangles: &[[[f64; 3]; 3]], axis: usize) -> Vec<Vec<[f64; 2]>> {
    let [p, q] = across(axis);
    let plan: Vec<_> = triangles.iter().map(|t| t.map(|corner| [corner[p], corner[q]])).collect();
    let mut edges = Edges::between(plan.iter().flatten(), NEAR * size(triangles.iter().flatten()));
    plan.iter().for_each(|triangle| edges.flip_around(triangle));
    edges.divide();
    edges.loops()
}

/// The largest extent of some points along an axis.
fn size<'a>(points: impl Iterator<Item = &'a [f64; 3]> + Clone) -> f64 {
    let extent = |a: usize| {
        let along = || points.clone().map(|point| point[a]);
        along().fold(f64::NEG_INFINITY, f64::max) - along().fold(f64::INFINITY, f64::min)
    };
    (0..3).map(extent).fold(0.0, f64::max)
}

/// Whether the points of a triangle lie on a line: its height over its longest side is at most `near`.
fn is_on_a_line(plan: [[f64; 2]; 3], near: f64) -> bool {
    let side = |k: usize| {
        let [a, b] = [plan[k], plan[(k + 1) % 3]];
        [b[0] - a[0], b[1] - a[1]]
    };
    let longest = (0..3).map(|k| side(k)[0].hypot(side(k)[1])).fold(0.0, f64::max);
    let [u, v] = [side(0), side(1)];
    (u[0] * v[1] - u[1] * v[0]).abs() <= near * longest
}

impl Prism {
    /// The volume, m^3. The area of an outline in an odd number of others is that of a hole, and negative.
    fn volume(&self) -> f64 {
        let inside = |k: usize| {
            let others = (0..self.outlines.len()).filter(|other| *other != k);
            // Outlines may touch at corners, but not in the middle of a side.
            let [a, b] = [self.outlines[k][0], self.outlines[k][1]];
            let point = [0, 1].map(|axis| a[axis] + 0.5 * (b[axis] - a[axis]));
            others.filter(|other| outline::contains(&self.outlines[*other], point)).count() % 2 == 1
        };
        let area = |(k, polygon): (usize, &Vec<[f64; 2]>)| {
            let from = polygon[0];
            let sides = polygon.iter().zip(polygon.iter().cycle().skip(1));
            let twice: f64 = sides
                .map(|(a, b)| (a[0] - from[0]) * (b[1] - from[1]) - (a[1] - from[1]) * (b[0] - from[0]))
                .sum();
            if inside(k) { -0.5 * twice.abs() } else { 0.5 * twice.abs() }
        };
        (self.ends[1] - self.ends[0]) * self.outlines.iter().enumerate().map(area).sum::<f64>()
    }
}

/// Coordinates in ascending order, one for each group of neighbours that differ by `near` at most.
fn distinct(coordinates: impl Iterator<Item = f64>, near: f64) -> Vec<f64> {
    let mut out = ascending(coordinates.collect());
    out.dedup_by(|above, below| *above - *below <= near);
    out
}

/// A point as the indices of its two coordinates among [`Edges::distinct`].
type Key = [usize; 2];

/// A set of edges in the plane.
#[derive(Debug)]
struct Edges {
    /// The distinct coordinates of all points along each of the two axes, ascending, m.
    distinct: [Vec<f64>; 2],
    /// Coordinates that differ by less than this are the same, m.
    near: f64,
    /// The position of each point, m.
    points: BTreeMap<Key, [f64; 2]>,
    /// For each point the other ends of its edges.
    neighbours: BTreeMap<Key, BTreeSet<Key>>,
}

impl Edges {
    /// An empty set; the ends of all future edges are among these points.
    fn between<'a>(points: impl Iterator<Item = &'a [f64; 2]> + Clone, near: f64) -> Self {
        let distinct = [0, 1].map(|k| distinct(points.clone().map(|point| point[k]), near));
        let mut edges = Self { distinct, near, points: BTreeMap::new(), neighbours: BTreeMap::new() };
        for point in points {
            let key = edges.key(*point);
            let known = edges.points.entry(key).or_insert(*point);
            // The least of the coordinates that are the same, so that the order of the points does not
            // matter.
            *known = [0, 1].map(|k| known[k].min(point[k]));
        }
        edges
    }

    /// The key of one of the points that [`Edges::between`] was given.
    fn key(&self, point: [f64; 2]) -> Key {
        [0, 1].map(|k| self.distinct[k].partition_point(|at| *at <= point[k]).saturating_sub(1))
    }

    /// Adds an edge, or removes it if it is in the set.
    fn flip(&mut self, a: Key, b: Key) {
        if a == b {
            return;
        }
        for (from, to) in [(a, b), (b, a)] {
            let others = self.neighbours.entry(from).or_default();
            if !others.remove(&to) {
                others.insert(to);
            }
            if others.is_empty() {
                self.neighbours.remove(&from);
            }
        }
    }

    /// Flips the three edges of a triangle.
    fn flip_around(&mut self, triangle: &[[f64; 2]; 3]) {
        let [a, b, c] = triangle.map(|corner| self.key(corner));
        [(a, b), (b, c), (c, a)].into_iter().for_each(|(from, to)| self.flip(from, to));
    }

    /// Divides edges at the ends of other edges that lie on them. Parts that lie on one another then cancel.
    fn divide(&mut self) {
        let ends: [Vec<Key>; 2] = [0, 1].map(|k| {
            let mut ends: Vec<Key> = self.neighbours.keys().copied().collect();
            ends.sort_by_key(|key| key[k]);
            ends
        });
        let edges: Vec<[Key; 2]> =
            self.neighbours.iter().flat_map(|(a, others)| others.range(*a..).map(|b| [*a, *b])).collect();
        for [a, b] in edges {
            let [from, to] = [a, b].map(|key| self.points[&key]);
            let along = [to[0] - from[0], to[1] - from[1]];
            let k = usize::from(along[1].abs() > along[0].abs());
            let [low, high] = [a[k].min(b[k]), a[k].max(b[k])];
            let first = ends[k].partition_point(|key| key[k] < low);
            let last = ends[k].partition_point(|key| key[k] <= high);
            let mut on_it: Vec<Key> = ends[k][first..last]
                .iter()
                .filter(|key| **key != a && **key != b)
                .filter(|key| is_on_a_line([from, self.points[*key], to], self.near))
                .copied()
                .collect();
            if on_it.is_empty() {
                continue;
            }
            on_it.sort_by_key(|key| if a[k] < b[k] { key[k] } else { usize::MAX - key[k] });
            self.flip(a, b);
            let parts = [a].into_iter().chain(on_it.iter().copied()).zip(on_it.iter().copied().chain([b]));
            parts.for_each(|(from, to)| self.flip(from, to));
        }
    }

    /// Closed polygons of all edges, which neither cross nor pass a point twice, without corners where they
    /// go straight on.
    fn loops(&self) -> Vec<Vec<[f64; 2]>> {
        let mut remaining = self.neighbours.clone();
        let mut out = Vec::new();
        for start in self.neighbours.keys() {
            // At every point an even number of edges meets, so that a path always returns to its start.
            let mut path = vec![*start];
            let mut passed = BTreeMap::from([(*start, 0)]);
            let mut from = *start;
            while let Some(at) = path.last().copied() {
                let Some(next) = remaining.get(&at).and_then(|others| self.first_from(from, at, others))
                else {
                    break;
                };
                for (one, other) in [(at, next), (next, at)] {
                    if let Some(others) = remaining.get_mut(&one) {
                        others.remove(&other);
                    }
                }
                from = at;
                let Some(before) = passed.get(&next).copied() else {
                    passed.insert(next, path.len());
                    path.push(next);
                    continue;
                };
                let mut ring = path.split_off(before + 1);
                for key in &ring {
                    passed.remove(key);
                }
                ring.push(next);
                let corners = ring.iter().map(|key| self.points[key]).collect();
                let polygon = straightened(corners, self.near);
                if polygon.len() > 2 {
                    out.push(polygon);
                }
            }
        }
        out
    }

    /// The first of the edges at a point, anticlockwise from the one that leads to it: paths that follow this
    /// rule do not cross.
    fn first_from(&self, from: Key, at: Key, others: &BTreeSet<Key>) -> Option<Key> {
        let direction = |key: &Key| {
            let [a, b] = [self.points[&at], self.points[key]];
            (b[1] - a[1]).atan2(b[0] - a[0])
        };
        if others.len() < 2 || from == at {
            return others.first().copied();
        }
        let back = direction(&from);
        let turn = |key: &Key| (direction(key) - back).rem_euclid(TAU);
        others.iter().min_by(|a, b| turn(a).total_cmp(&turn(b))).copied()
    }
}

/// A closed polygon without the corners at which it goes straight on or back.
fn straightened(mut polygon: Vec<[f64; 2]>, near: f64) -> Vec<[f64; 2]> {
    let (mut k, mut passed) = (0, 0);
    while passed < polygon.len() && polygon.len() > 2 {
        let n = polygon.len();
        if is_on_a_line([k + n - 1, k, k + 1].map(|k| polygon[k % n]), near) {
            polygon.remove(k);
            // The corner before has another side now.
            (k, passed) = ((k + n - 2) % (n - 1), 0);
        } else {
            (k, passed) = ((k + 1) % n, passed + 1);
        }
    }
    polygon
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::outline::{contains, on_circle};

    /// The surface of what lies between polygons of the same number of corners, one on each level; triangles
    /// of the ends as fans about a corner.
    fn pulled(outline: &[[f64; 2]], levels: &[f64], axis: usize) -> TriangleSurface {
        let n = outline.len() as u32;
        let [p, q] = across(axis);
        let mut points = Vec::new();
        for at in levels {
            for corner in outline {
                let mut point = [0.0; 3];
                (point[axis], point[p], point[q]) = (*at, corner[0], corner[1]);
                points.push(point);
            }
        }
        let mut faces = Vec::new();
        for level in 0..levels.len() as u32 - 1 {
            for k in 0..n {
                let [a, b] = [k, (k + 1) % n].map(|k| level * n + k);
                faces.extend([[a, b, b + n], [a, b + n, a + n]]);
            }
        }
        let top = n * (levels.len() as u32 - 1);
        for k in 1..n - 1 {
            faces.extend([[0, k + 1, k], [top, top + k, top + k + 1]]);
        }
        if axis == 1 {
            faces.iter_mut().for_each(|face| face.reverse());
        }
        TriangleSurface { points, faces }
    }

    #[test]
    fn a_polygon_pulled_along_an_axis_is_found_along_that_axis_only() {
        let outline = on_circle([0.3, -0.7], 0.9, 7);
        for axis in 0..3 {
            let surface = pulled(&outline, &[-0.3, 0.1], axis);
            for other in (0..3).filter(|other| *other != axis) {
                assert_eq!(prisms_of(&surface, other), None);
            }
            let [prism] = prisms_of(&surface, axis).unwrap().try_into().unwrap();
            assert_eq!(prism.ends, [-0.3, 0.1]);
            let [mut found] = <[_; 1]>::try_from(prism.outlines).unwrap();
            let first = found.iter().position(|corner| *corner == outline[0]).unwrap();
            found.rotate_left(first);
            if found[1] != outline[1] {
                found[1..].reverse();
            }
            assert_eq!(found, outline);
        }
    }

    #[test]
    fn edges_that_divide_straight_sides_leave_no_corners() {
        let outline = [[0.0, 0.0], [0.3, 0.0], [1.0, 0.0], [1.0, 0.7], [1.0, 1.0], [0.0, 1.0], [0.0, 0.2]];
        let [prism] = prisms_of(&pulled(&outline, &[0.0, 0.4, 1.0], 2), 2).unwrap().try_into().unwrap();
        assert_eq!((prism.outlines.len(), prism.outlines[0].len(), prism.ends), (1, 4, [0.0, 1.0]));
    }

    #[test]
    fn walls_that_are_upright_but_for_rounding_are_walls() {
        // Points on the walls, as a mesher puts them there.
        let corners =
            on_circle([0.1, 0.3], 1.0, 7).iter().map(|[x, y]| [x / 3.0, y / 7.0]).collect::<Vec<_>>();
        let on_wall = |k: usize, share: f64| {
            let [a, b] = [corners[k], corners[(k + 1) % 7]];
            [a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])]
        };
        let outline: Vec<[f64; 2]> = (0..7).flat_map(|k| [corners[k], on_wall(k, 1.0 / 3.0)]).collect();
        let mut surface = pulled(&outline, &[0.0, 0.3, 1.0], 2);
        for k in 0..7 {
            let [x, y] = on_wall(k, 0.1 + 0.11 * k as f64);
            surface.points[14 + 2 * k + 1] = [x, y, 0.3];
        }
        // The top is not quite over the bottom, nor quite level.
        surface.points[30][0] += 1e-16;
        surface.points[33][2] += 1e-15;
        let [prism] = prisms_of(&surface, 2).unwrap().try_into().unwrap();
        assert_eq!((prism.outlines.len(), prism.outlines[0].len(), prism.ends), (1, 7, [0.0, 1.0]));
    }

    #[test]
    fn a_pyramid_and_a_surface_inside_out_are_no_prisms() {
        let outline = on_circle([0.0; 2], 1.0, 5);
        let mut surface = pulled(&outline, &[0.0, 1.0], 2);
        surface.points[7][0] *= 0.99;
        assert_eq!(prisms_of(&surface, 2), None);
        let mut surface = pulled(&outline, &[0.0, 1.0], 2);
        surface.faces.iter_mut().for_each(|face| face.reverse());
        assert_eq!(prisms_of(&surface, 2), None);
    }

    #[test]
    fn a_step_and_a_hole_are_kept() {
        // A frame on a plate of the same outer outline.
        let square = |half: f64| [[-half, -half], [half, -half], [half, half], [-half, half]];
        let (outer, inner) = (square(1.0), square(0.5));
        let points = [(0.0, outer), (1.0, outer), (1.0, inner), (0.5, inner)]
            .iter()
            .flat_map(|(z, corners)| corners.map(|c| [c[0], c[1], *z]))
            .collect();
        let mut faces = vec![[0, 2, 1], [0, 3, 2], [12, 13, 14], [12, 14, 15]];
        for k in 0..4 {
            let l = (k + 1) % 4;
            faces.extend([[k, l, 4 + l], [k, 4 + l, 4 + k]]);
            faces.extend([[4 + k, 4 + l, 8 + l], [4 + k, 8 + l, 8 + k]]);
            faces.extend([[8 + k, 8 + l, 12 + l], [8 + k, 12 + l, 12 + k]]);
        }
        let prisms = prisms_of(&TriangleSurface { points, faces }, 2).unwrap();
        assert_eq!(prisms.iter().map(|prism| prism.ends).collect::<Vec<_>>(), [[0.0, 0.5], [0.5, 1.0]]);
        let holds = |prism: &Prism, point| {
            prism.outlines.iter().filter(|outline| contains(outline, point)).count() % 2 == 1
        };
        assert!(holds(&prisms[0], [0.1, 0.2]) && !holds(&prisms[1], [0.1, 0.2]));
        assert!(prisms.iter().all(|prism| holds(prism, [0.7, 0.2]) && !holds(prism, [1.1, 0.2])));
        assert!((prisms.iter().map(Prism::volume).sum::<f64>() - 3.5).abs() < 1e-12);
    }
}
