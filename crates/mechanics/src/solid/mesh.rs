//! Meshes, and those of nine-node quadrilaterals put together from mapped patches.
//!
//! A [`Patch`] is a logical grid of corner points; its quadrilaterals have straight sides. Patches that share
//! points share nodes. A side of a quadrilateral may be collapsed into one point: that is how a *fan* is
//! made, sectors around a corner, each of which takes its share of the angle by which the corner opens. One
//! quadrilateral alone in a right angle must turn inside out when the angle passes 180 degrees, as it does
//! where the bonded end of a compressed layer meets its free face.

use std::collections::HashMap;

use super::dimension::{Dimension, Plane};
use super::hanging::Hanging;

/// A mesh in the reference configuration: nine-node quadrilaterals in the plane, 27-node hexahedra in space.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh<S: Dimension = Plane> {
    /// Reference positions of the nodes in m.
    pub nodes: Vec<S::Point>,
    /// Nodes of each element: node `3 j + i` is at `(i - 1, j - 1)` of the reference square, node
    /// `9 k + 3 j + i` at `(i - 1, j - 1, k - 1)` of the reference cube.
    pub elements: Vec<S::Nodes>,
    /// The hanging nodes and sides where elements are finer than their neighbours; none in a mesh that was
    /// not refined.
    pub hanging: Hanging,
}

/// A grid of corner points: `points[j * columns + i]`.
#[derive(Debug, Clone, PartialEq)]
pub struct Patch {
    /// The number of points along the first logical direction.
    pub columns: usize,
    /// Corner points in m, row after row.
    pub points: Vec<[f64; 2]>,
}

impl Patch {
    /// The tensor product of the breakpoints `x1` and `x2` in m.
    pub fn tensor(x1: &[f64], x2: &[f64]) -> Self {
        let points = x2.iter().flat_map(|&b| x1.iter().map(move |&a| [a, b])).collect();
        Self { columns: x1.len(), points }
    }

    /// Sectors from `centre` to the points of the polyline `rim`, cut at the fractions `radii` (ascending,
    /// from 0 to 1) of the way. At the fraction 0 the quadrilaterals collapse into the centre.
    pub fn fan(centre: [f64; 2], rim: &[[f64; 2]], radii: &[f64]) -> Self {
        let toward = |rim: &[f64; 2], r: f64| -> [f64; 2] {
            if r == 1.0 {
                return *rim;
            }
            std::array::from_fn(|k| centre[k] + r * (rim[k] - centre[k]))
        };
        let points = rim.iter().flat_map(|p| radii.iter().map(move |&r| toward(p, r))).collect();
        Self { columns: radii.len(), points }
    }

    /// The patch with its points moved by `map`.
    pub fn mapped(mut self, map: impl Fn([f64; 2]) -> [f64; 2]) -> Self {
        for p in &mut self.points {
            *p = map(*p);
        }
        self
    }
}

impl Mesh {
    /// The mesh of `patches`; points closer than `1e-9` of the extent are one node.
    pub fn from_patches(patches: &[Patch]) -> Self {
        let mut mesh = Self::default();
        let extent = patches
            .iter()
            .flat_map(|p| &p.points)
            .flat_map(|p| p.map(f64::abs))
            .fold(f64::MIN_POSITIVE, f64::max);
        let mut known: HashMap<[i64; 2], u32> = HashMap::new();
        let mut node = |mesh: &mut Self, p: [f64; 2]| -> u32 {
            let cell = p.map(|x| (x / (1e-9 * extent)).round() as i64);
            for dx in [0, -1, 1] {
                for dy in [0, -1, 1] {
                    if let Some(&found) = known.get(&[cell[0] + dx, cell[1] + dy]) {
                        return found;
                    }
                }
            }
            let new = mesh.nodes.len() as u32;
            mesh.nodes.push(p);
            known.insert(cell, new);
            new
        };
        for patch in patches {
            let rows = patch.points.len() / patch.columns;
            for j in 1..rows {
                for i in 1..patch.columns {
                    let corner = |a: usize, b: usize| patch.points[(j - 1 + b) * patch.columns + i - 1 + a];
                    let mut c = [corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1)];
                    let cross = |o: [f64; 2], p: [f64; 2], q: [f64; 2]| {
                        (p[0] - o[0]) * (q[1] - o[1]) - (p[1] - o[1]) * (q[0] - o[0])
                    };
                    // Twice the area: the two triangles along one diagonal, of which one may be collapsed.
                    if cross(c[0], c[1], c[3]) + cross(c[0], c[3], c[2]) < 0.0 {
                        c.swap(1, 2);
                    }
                    let mut element = [0; 9];
                    for b in 0..3 {
                        for a in 0..3 {
                            let (s, t) = (0.5 * a as f64, 0.5 * b as f64);
                            let p = std::array::from_fn(|k| {
                                (1.0 - t) * ((1.0 - s) * c[0][k] + s * c[1][k])
                                    + t * ((1.0 - s) * c[2][k] + s * c[3][k])
                            });
                            element[3 * b + a] = node(&mut mesh, p);
                        }
                    }
                    mesh.elements.push(element);
                }
            }
        }
        mesh
    }

    /// A rectangle `[0, length] x [0, height]` (m) of `n1` by `n2` equal quadrilaterals.
    pub fn rectangle(length: f64, height: f64, n1: usize, n2: usize) -> Self {
        Self::from_patches(&[Patch::tensor(&uniform(0.0, length, n1), &uniform(0.0, height, n2))])
    }

    /// The quadrilateral in which the reference position `x` (m) lies, and the coordinates of `x` in its
    /// reference square. On the line between two quadrilaterals it is either of them. `None` outside the mesh
    /// and at the point of a collapsed side.
    pub fn locate(&self, x: [f64; 2]) -> Option<(usize, [f64; 2])> {
        // Not tuned: it only has to lie above rounding errors and below distances that matter.
        const SLACK: f64 = 1e-7;
        self.elements.iter().enumerate().find_map(|(e, nodes)| {
            let c = [0, 2, 6, 8].map(|k| self.nodes[nodes[k] as usize]);
            let outside = (0..2).any(|k| {
                let (low, high) = c.iter().fold((f64::MAX, f64::MIN), |(l, h), p| (l.min(p[k]), h.max(p[k])));
                let room = SLACK * (high - low);
                x[k] < low - room || x[k] > high + room
            });
            if outside {
                return None;
            }
            // Sides are straight: the map is bilinear, p0 + p1 s + p2 t + p3 s t.
            let coefficient = |signs: [f64; 4]| -> [f64; 2] {
                std::array::from_fn(|k| 0.25 * (0..4).map(|a| signs[a] * c[a][k]).sum::<f64>())
            };
            let p = [
                coefficient([1.0; 4]),
                coefficient([-1.0, 1.0, -1.0, 1.0]),
                coefficient([-1.0, -1.0, 1.0, 1.0]),
                coefficient([1.0, -1.0, -1.0, 1.0]),
            ];
            let (mut s, mut t) = (0.0f64, 0.0f64);
            for _ in 0..50 {
                let miss: [f64; 2] =
                    std::array::from_fn(|k| x[k] - p[0][k] - p[1][k] * s - p[2][k] * t - p[3][k] * s * t);
                let by_s: [f64; 2] = std::array::from_fn(|k| p[1][k] + p[3][k] * t);
                let by_t: [f64; 2] = std::array::from_fn(|k| p[2][k] + p[3][k] * s);
                let area = by_s[0] * by_t[1] - by_s[1] * by_t[0];
                let step = [
                    (miss[0] * by_t[1] - miss[1] * by_t[0]) / area,
                    (by_s[0] * miss[1] - by_s[1] * miss[0]) / area,
                ];
                (s, t) = (s + step[0], t + step[1]);
                if !(s.abs() + t.abs()).is_finite() {
                    return None;
                }
                if step[0].abs() + step[1].abs() < 1e-13 {
                    break;
                }
            }
            let inside = s.abs() <= 1.0 + SLACK && t.abs() <= 1.0 + SLACK;
            inside.then(|| (e, [s.clamp(-1.0, 1.0), t.clamp(-1.0, 1.0)]))
        })
    }
}

impl<S: Dimension> Mesh<S> {
    /// The shortest side in m of the box around the mesh.
    pub fn shortest_side(&self) -> f64 {
        let extent = |k: usize| {
            let ends = self.nodes.iter().fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(x[k]), h.max(x[k])));
            ends.1 - ends.0
        };
        (0..S::AXES).map(extent).fold(f64::INFINITY, f64::min)
    }

    /// The node nearest to `point`.
    pub fn nearest_node(&self, point: S::Point) -> usize {
        let square = |n: &S::Point| (0..S::AXES).map(|k| (n[k] - point[k]).powi(2)).sum::<f64>();
        let nearest = |a: &(usize, f64), b: &(usize, f64)| a.1.total_cmp(&b.1);
        self.nodes.iter().map(square).enumerate().min_by(nearest).map_or(0, |(n, _)| n)
    }
}

/// The largest number of steps along one axis. No mesh with so many is solved: each has more elements than
/// [`LayerMesh::MAX_ELEMENTS`](super::layer_mesh::LayerMesh::MAX_ELEMENTS), and is refused before it is made.
const MAX_STEPS: usize = 2_000_000;

/// `n` equal steps from `a` to `b`: `n + 1` breakpoints. At most two million steps.
pub fn uniform(a: f64, b: f64, n: usize) -> Vec<f64> {
    let n = n.min(MAX_STEPS);
    (0..=n).map(|k| if k == n { b } else { a + (b - a) * k as f64 / n as f64 }).collect()
}

/// Breakpoints from `a` to `b` whose steps near `x` are about `size(x)` (m) long, scaled so that they fit; at
/// most two million steps.
pub fn graded(a: f64, b: f64, size: impl Fn(f64) -> f64) -> Vec<f64> {
    /// Not tuned: many more than an axis has steps.
    const FINE: usize = 4000;
    let place = |k: usize| if k == FINE { b } else { a + (b - a) * k as f64 / FINE as f64 };
    let places: Vec<f64> = (0..=FINE).map(place).collect();
    graded_between(&places, |k| (places[k + 1] - places[k]) / size(0.5 * (places[k] + places[k + 1])))
}

/// Breakpoints from `a` to `b` (m) that include each of the `edges` between the two. Steps near `x` are about
/// `size(x)` long: from one edge to the next, their number is rounded up, unless it is less than a quarter
/// above a whole number.
pub fn graded_to_edges(a: f64, b: f64, edges: &[f64], size: impl Fn(f64) -> f64) -> Vec<f64> {
    /// Not tuned: many more than an axis has steps.
    const FINE: usize = 1000;
    let tiny = 1e-9 * (b - a);
    let mut ends: Vec<f64> = edges.iter().copied().filter(|e| *e > a + tiny && *e < b - tiny).collect();
    ends.push(b);
    ends.sort_by(f64::total_cmp);
    ends.dedup_by(|x, y| (*x - *y).abs() < tiny);
    let mut breakpoints = vec![a];
    for (k, &to) in ends.iter().enumerate() {
        let from = if k == 0 { a } else { ends[k - 1] };
        let place = |k: usize| if k == FINE { to } else { from + (to - from) * k as f64 / FINE as f64 };
        let places: Vec<f64> = (0..=FINE).map(place).collect();
        let steps = |k: usize| (places[k + 1] - places[k]) / size(0.5 * (places[k] + places[k + 1]));
        let count: f64 = (0..FINE).map(steps).sum();
        let rounded = (count - 0.25).ceil().max(1.0) / count;
        breakpoints.extend(graded_between(&places, |k| rounded * steps(k)).iter().skip(1));
    }
    breakpoints
}

/// Breakpoints from the first to the last of the ascending `places` (m), of which about `steps(k)` lie
/// between place `k` and the next one, scaled so that they fit; at most two million.
pub fn graded_between(places: &[f64], steps: impl Fn(usize) -> f64) -> Vec<f64> {
    let last = places.len() - 1;
    // The number of steps up to each place.
    let mut count = vec![0.0];
    for k in 0..last {
        count.push(count[k] + steps(k));
    }
    let n = (count[last].round().max(1.0) as usize).min(MAX_STEPS);
    let place = |k: usize| {
        let goal = count[last] * k as f64 / n as f64;
        let above = count.partition_point(|c| *c < goal).clamp(1, last);
        let part = (goal - count[above - 1]) / (count[above] - count[above - 1]);
        places[above - 1] + part * (places[above] - places[above - 1])
    };
    let inner = (1..n).map(place);
    std::iter::once(places[0]).chain(inner).chain(std::iter::once(places[last])).collect()
}

/// Breakpoints from 0 to 1 that shrink by `ratio` towards 0: `0, ratio^n, ..., ratio, 1`.
pub fn geometric(ratio: f64, n: usize) -> Vec<f64> {
    std::iter::once(0.0).chain((0..=n).rev().map(|k| ratio.powi(k as i32))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_between_edges_are_as_long_as_asked_and_every_edge_is_a_breakpoint() {
        let edges = [0.9, 0.2, 0.2, 0.25, -1.0, 2.0];
        let size = |x: f64| 0.05 + 0.1 * x;
        let breakpoints = graded_to_edges(0.0, 2.0, &edges, size);
        for edge in [0.0, 0.2, 0.25, 0.9, 2.0] {
            assert!(breakpoints.contains(&edge), "{edge} is not in {breakpoints:?}");
        }
        for w in breakpoints.windows(2) {
            let (step, wanted) = (w[1] - w[0], size(0.5 * (w[0] + w[1])));
            assert!(step > 0.0 && step < 1.3 * wanted, "{step} where {wanted} is wanted");
        }
        // Not much shorter either, but for the narrow body.
        assert_eq!(breakpoints.len(), 18, "{breakpoints:?}");
    }

    #[test]
    fn patches_that_touch_share_their_nodes() {
        let left = Patch::tensor(&uniform(0.0, 1.0, 2), &uniform(0.0, 1.0, 2));
        let mut rim: Vec<[f64; 2]> = uniform(0.0, 1.0, 2).iter().map(|&y| [1.0, y]).collect();
        rim.extend(uniform(1.0, 2.0, 2).iter().skip(1).map(|&x| [x, 1.0]));
        let fan = Patch::fan([2.0, 0.0], &rim, &geometric(0.5, 2));
        let mesh = Mesh::from_patches(&[left, fan]);
        assert_eq!(mesh.elements.len(), 4 + 4 * 3);
        // 5 x 5 nodes on the left; of the fan 9 rays with 6 nodes and the centre, 5 shared.
        assert_eq!(mesh.nodes.len(), 25 + 9 * 6 + 1 - 5);
        let length: f64 = mesh
            .boundary()
            .iter()
            .map(|e| {
                let [a, b] = [e.nodes[0], e.nodes[2]].map(|n| mesh.nodes[n as usize]);
                (a[0] - b[0]).hypot(a[1] - b[1])
            })
            .sum();
        assert!((length - 6.0).abs() < 1e-12, "{length}");
    }
}
