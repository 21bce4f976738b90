//! Triangulations of the plane for fields that are singular at corners and along edges.
//!
//! A coarse triangulation follows the outlines ([`coarse()`]). Its triangles are then divided geometrically ([`graded`]): towards each
//! marked corner into rings, towards each marked edge into strips, every one a fixed share of the width of the one before. With
//! polynomials on such meshes the error falls exponentially with the number of layers (Babuska and Guo, Comput. Mech. 1, 1986).

mod circles;
mod coarse;
mod cubics;
mod outline;

pub use circles::Circle;
pub use coarse::{Coarse, RoundSide, Triangles, coarse};
pub use outline::{Course, Outline, Side};

use coarse::bent_triangles;
use elastocap_fem::bent::Bent;
use std::collections::{HashMap, HashSet};

/// Which corners and edges of a coarse triangulation are graded.
#[derive(Debug, Clone, Default)]
pub struct Marks {
    /// For each point whether it is a corner.
    pub corners: Vec<bool>,
    /// Sides of triangles, by the numbers of their ends in ascending order.
    pub edges: HashSet<[u32; 2]>,
    /// Sides of triangles that belong to chains, by their ends in the same way, each with the number of its chain.
    pub chains: HashMap<[u32; 2], u32>,
}

/// How a triangulation is graded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Layers {
    /// Rings around each marked corner.
    pub corners: usize,
    /// Strips along each marked edge; at most as many as rings.
    pub edges: usize,
    /// Width of a layer over that of the next one outwards.
    pub ratio: f64,
}

/// A divided mesh.
#[derive(Debug, Clone, Default)]
pub struct Graded {
    /// Its points, those in bent triangles moved with them, and its triangles.
    pub mesh: Triangles,
    /// For each triangle the one of the coarse mesh that it is a part of.
    pub parents: Vec<u32>,
    /// For each triangle the bent one that it is a part of, if it is.
    pub bent: Vec<Option<Bent>>,
    /// Where each point would be if nothing were bent.
    pub straight: Vec<[f64; 2]>,
    /// As [`Marks::chains`], of the divided sides.
    pub chains: HashMap<[u32; 2], u32>,
}

/// Divides the triangles of a mesh towards marked corners and edges.
pub fn graded(coarse: &Coarse, marks: &Marks, layers: Layers) -> Graded {
    let mesh = &coarse.mesh;
    let edges = if layers.edges == 0 { HashSet::new() } else { marks.edges.clone() };
    let mut work = Grading {
        points: mesh.points.clone(),
        triangles: mesh.triangles.iter().zip(0..).map(|(t, parent)| (*t, parent)).collect(),
        corner: marks.corners.clone(),
        on_edge: vec![false; mesh.points.len()],
        edges,
        arcs: coarse.arcs.clone(),
        chains: marks.chains.clone(),
        layers,
        nodes: HashMap::new(),
    };
    for [a, b] in work.edges.iter().copied().collect::<Vec<_>>() {
        work.on_edge[a as usize] = true;
        work.on_edge[b as usize] = true;
    }
    if layers.corners == 0 {
        work.corner.fill(false);
    }
    work.separate();
    work.divide()
}

/// A mesh on its way from coarse to graded.
struct Grading {
    points: Vec<[f64; 2]>,
    /// Each with its parent.
    triangles: Vec<([u32; 3], u32)>,
    corner: Vec<bool>,
    on_edge: Vec<bool>,
    edges: HashSet<[u32; 2]>,
    chains: HashMap<[u32; 2], u32>,
    arcs: HashMap<[u32; 2], RoundSide>,
    layers: Layers,
    /// The point at the so-manyth layer from the first point towards the second.
    nodes: HashMap<(u32, u32, usize), u32>,
}

fn key(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

impl Grading {
    fn touched(&self, p: u32) -> bool {
        self.corner[p as usize] || self.on_edge[p as usize]
    }

    fn point(&mut self, at: [f64; 2], on_edge: bool) -> u32 {
        self.points.push(at);
        self.corner.push(false);
        self.on_edge.push(on_edge);
        (self.points.len() - 1) as u32
    }

    /// Divides triangles until each has at most one marked edge with at most one corner on it, and otherwise at most one point that
    /// is graded towards.
    fn separate(&mut self) {
        for ([a, b, c], parent) in std::mem::take(&mut self.triangles) {
            let sides = [key(a, b), key(b, c), key(c, a)];
            let arcs = sides.iter().filter(|side| self.arcs.contains_key(*side)).count();
            if arcs > 1 || sides.iter().all(|side| self.edges.contains(side)) {
                let [x, y, z] = [a, b, c].map(|p| self.points[p as usize]);
                let middle = self.point([0, 1].map(|k| (x[k] + y[k] + z[k]) / 3.0), false);
                self.triangles.extend([[a, b, middle], [b, c, middle], [c, a, middle]].map(|t| (t, parent)));
            } else {
                self.triangles.push(([a, b, c], parent));
            }
        }
        self.split(|grading, [a, b]| {
            grading.edges.contains(&[a, b]) && grading.corner[a as usize] && grading.corner[b as usize]
        });
        while self.split(|grading, [a, b]| {
            !grading.edges.contains(&[a, b]) && grading.touched(a) && grading.touched(b)
        }) {}
    }

    /// Cuts sides in two, and with them their triangles. Returns whether there were any.
    fn split(&mut self, cut: impl Fn(&Self, [u32; 2]) -> bool) -> bool {
        let mut middles: HashMap<[u32; 2], u32> = HashMap::new();
        for ([a, b, c], _) in self.triangles.clone() {
            for side in [key(a, b), key(b, c), key(c, a)] {
                if middles.contains_key(&side) || !cut(self, side) {
                    continue;
                }
                let [p, q] = side.map(|p| self.points[p as usize]);
                let marked = self.edges.contains(&side);
                let round = self.arcs.get(&side).map(|arc| arc.halved([p, q]));
                let place = round.map_or_else(|| [0, 1].map(|k| 0.5 * (p[k] + q[k])), |(place, _)| place);
                let middle = self.point(place, marked);
                // It has the highest number of all.
                if let Some((_, parts)) = round {
                    self.arcs.remove(&side);
                    self.arcs.extend(side.map(|end| key(end, middle)).into_iter().zip(parts));
                }
                middles.insert(side, middle);
            }
        }
        for (side, middle) in &middles {
            if self.edges.remove(side) {
                self.edges.extend(side.map(|end| key(end, *middle)));
            }
            if let Some(chain) = self.chains.remove(side) {
                self.chains.extend(side.map(|end| (key(end, *middle), chain)));
            }
        }
        for (triangle, parent) in std::mem::take(&mut self.triangles) {
            let middle = |k: usize| middles.get(&key(triangle[(k + 1) % 3], triangle[(k + 2) % 3])).copied();
            let halves = [0, 1, 2].map(middle);
            let pieces: Vec<[u32; 3]> = match halves.iter().flatten().count() {
                0 => vec![triangle],
                1 => {
                    let k = halves.iter().position(Option::is_some).unwrap_or(0);
                    let m = halves[k].unwrap_or(0);
                    let [a, b, c] = [0, 1, 2].map(|i| triangle[(k + i) % 3]);
                    vec![[a, b, m], [a, m, c]]
                }
                2 => {
                    let k = halves.iter().position(Option::is_none).unwrap_or(0);
                    let [a, b, c] = [0, 1, 2].map(|i| triangle[(k + i) % 3]);
                    let (m, n) = (halves[(k + 1) % 3].unwrap_or(0), halves[(k + 2) % 3].unwrap_or(0));
                    // m lies between c and a, n between a and b.
                    let length = |p: u32, q: u32| self.distance(p, q);
                    if length(b, m) <= length(c, n) {
                        vec![[a, n, m], [n, b, m], [b, c, m]]
                    } else {
                        vec![[a, n, m], [n, b, c], [n, c, m]]
                    }
                }
                _ => {
                    let [a, b, c] = triangle;
                    let [x, y, z] = halves.map(|m| m.unwrap_or(0));
                    vec![[a, z, y], [z, b, x], [y, x, c], [x, y, z]]
                }
            };
            self.triangles.extend(pieces.into_iter().map(|t| (t, parent)));
        }
        !middles.is_empty()
    }

    fn distance(&self, p: u32, q: u32) -> f64 {
        let [p, q] = [p, q].map(|p| self.points[p as usize]);
        (p[0] - q[0]).hypot(p[1] - q[1])
    }

    /// The point at layer `k` from `from` towards `to`, which is at layer 0.
    fn node(&mut self, from: u32, to: u32, k: usize) -> u32 {
        if k == 0 {
            return to;
        }
        if let Some(&node) = self.nodes.get(&(from, to, k)) {
            return node;
        }
        let node = self.between(from, to, self.layers.ratio.powi(k as i32));
        self.nodes.insert((from, to, k), node);
        node
    }

    fn between(&mut self, from: u32, to: u32, share: f64) -> u32 {
        let [p, q] = [from, to].map(|p| self.points[p as usize]);
        self.point([0, 1].map(|k| p[k] + share * (q[k] - p[k])), false)
    }

    fn divide(mut self) -> Graded {
        let mut out = Vec::new();
        let (mut parents, mut bent) = (Vec::new(), Vec::new());
        for (triangle, parent) in std::mem::take(&mut self.triangles) {
            let marked =
                (0..3).find(|&k| self.edges.contains(&key(triangle[(k + 1) % 3], triangle[(k + 2) % 3])));
            let pieces = match (marked, (0..3).find(|&k| self.touched(triangle[k]))) {
                (Some(k), _) => {
                    let [c, a, b] = [0, 1, 2].map(|i| triangle[(k + i) % 3]);
                    if self.corner[a as usize] {
                        self.towards_edge_and_corner(a, b, c)
                    } else if self.corner[b as usize] {
                        self.towards_edge_and_corner(b, a, c)
                    } else {
                        self.towards_edge(a, b, c)
                    }
                }
                (None, Some(k)) => {
                    let [a, x, y] = [0, 1, 2].map(|i| triangle[(k + i) % 3]);
                    self.towards_point(a, x, y)
                }
                (None, None) => vec![triangle],
            };
            let arc = bent_triangles(&triangle, &self.arcs, |p| self.points[p as usize]).pop();
            bent.extend(std::iter::repeat_n(arc, pieces.len()));
            parents.extend(std::iter::repeat_n(parent, pieces.len()));
            out.extend(pieces);
        }
        let mut points = self.points.clone();
        for (triangle, arc) in out.iter().zip(&bent) {
            if let Some(arc) = arc {
                let moved = |p: &u32| arc.place(arc.shares(self.points[*p as usize]));
                triangle.iter().for_each(|p| points[*p as usize] = moved(p));
            }
        }
        let chains = self.divided_chains(&out);
        Graded { mesh: Triangles { points, triangles: out }, parents, bent, straight: self.points, chains }
    }

    /// The sides of the divided triangles that are parts of sides of chains: both their ends are ends of that side or lie on it.
    fn divided_chains(&self, triangles: &[[u32; 3]]) -> HashMap<[u32; 2], u32> {
        let mut out = HashMap::new();
        if self.chains.is_empty() {
            return out;
        }
        let mut on: HashMap<u32, Vec<[u32; 2]>> = HashMap::new();
        for side in self.chains.keys() {
            side.iter().for_each(|end| on.entry(*end).or_default().push(*side));
        }
        for ((from, to, _), node) in &self.nodes {
            let side = key(*from, *to);
            if self.chains.contains_key(&side) {
                on.entry(*node).or_default().push(side);
            }
        }
        for [a, b, c] in triangles {
            for part in [key(*a, *b), key(*b, *c), key(*c, *a)] {
                let [Some(one), Some(other)] = part.map(|end| on.get(&end)) else { continue };
                if let Some(side) = one.iter().find(|side| other.contains(side)) {
                    out.insert(part, self.chains[side]);
                }
            }
        }
        out
    }

    /// Two triangles between two segments, from `a` to `b` and from `d` to `c`.
    fn quadrilateral(&self, [a, b, c, d]: [u32; 4]) -> [[u32; 3]; 2] {
        if self.distance(a, c) <= self.distance(b, d) {
            [[a, b, c], [a, c, d]]
        } else {
            [[a, b, d], [b, c, d]]
        }
    }

    fn towards_point(&mut self, a: u32, x: u32, y: u32) -> Vec<[u32; 3]> {
        let layers = if self.corner[a as usize] { self.layers.corners } else { self.layers.edges };
        let mut out = Vec::new();
        let mut outer = [x, y];
        for k in 1..=layers {
            let inner = [self.node(a, x, k), self.node(a, y, k)];
            out.extend(self.quadrilateral([outer[0], outer[1], inner[1], inner[0]]));
            outer = inner;
        }
        out.push([a, outer[0], outer[1]]);
        out
    }

    /// Strips along the side from `a` to `b`, neither of which is a corner.
    fn towards_edge(&mut self, a: u32, b: u32, c: u32) -> Vec<[u32; 3]> {
        let mut out = Vec::new();
        let mut outer = [c, c];
        for k in 1..=self.layers.edges {
            let inner = [self.node(a, c, k), self.node(b, c, k)];
            if k == 1 {
                out.push([c, inner[0], inner[1]]);
            } else {
                out.extend(self.quadrilateral([outer[0], outer[1], inner[1], inner[0]]));
            }
            outer = inner;
        }
        out.extend(self.quadrilateral([outer[0], outer[1], b, a]));
        out
    }

    /// Rings around the corner `a`, each divided into strips along the side from `a` to `b`.
    fn towards_edge_and_corner(&mut self, a: u32, b: u32, c: u32) -> Vec<[u32; 3]> {
        let (rings, strips) = (self.layers.corners, self.layers.edges);
        // Ring by ring the points from the side to c down to that to b; the distance from the side to b falls like the rings.
        let lines: Vec<Vec<u32>> = (0..=rings)
            .map(|ring| {
                let far = self.node(a, c, ring);
                let near = self.node(a, b, ring);
                let mut line = vec![far];
                for strip in ring + 1..=strips {
                    let node = if ring == 0 {
                        self.node(b, c, strip)
                    } else {
                        self.between(near, far, self.layers.ratio.powi((strip - ring) as i32))
                    };
                    line.push(node);
                }
                line.push(near);
                line
            })
            .collect();
        let mut out = Vec::new();
        for pair in lines.windows(2) {
            let (outer, inner) = (&pair[0], &pair[1]);
            // Where the outer line has one point more, a triangle makes up for it.
            let extra = outer.len() - inner.len();
            if extra == 1 {
                out.push([outer[0], outer[1], inner[0]]);
            }
            for k in 1..inner.len() {
                out.extend(self.quadrilateral([
                    outer[k - 1 + extra],
                    outer[k + extra],
                    inner[k],
                    inner[k - 1],
                ]));
            }
        }
        let last = &lines[rings];
        out.extend((1..last.len()).map(|k| [a, last[k - 1], last[k]]));
        out
    }
}

#[cfg(test)]
mod tests {
    use super::circles::apart;
    use super::*;
    use std::f64::consts::TAU;

    const L: [[f64; 2]; 6] = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
    const FRAME: [[f64; 2]; 2] = [[-3.0, -2.0], [4.0, 5.0]];

    fn area(mesh: &Triangles, t: &[u32; 3]) -> f64 {
        let [a, b, c] = t.map(|p| mesh.points[p as usize]);
        0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])).abs()
    }

    /// Each side belongs to two triangles, or to one and lies on the frame.
    fn is_conforming(mesh: &Triangles) -> bool {
        let mut count: HashMap<[u32; 2], usize> = HashMap::new();
        for [a, b, c] in &mesh.triangles {
            for side in [key(*a, *b), key(*b, *c), key(*c, *a)] {
                *count.entry(side).or_default() += 1;
            }
        }
        let on_frame = |side: &[u32; 2]| {
            let [p, q] = side.map(|p| mesh.points[p as usize]);
            (0..2).any(|k| p[k] == q[k] && (p[k] == FRAME[0][k] || p[k] == FRAME[1][k]))
        };
        count.iter().all(|(side, n)| *n == 2 || (*n == 1 && on_frame(side)))
    }

    fn on_outline(outline: &[[f64; 2]], p: [f64; 2]) -> bool {
        outline.iter().zip(outline.iter().cycle().skip(1)).any(|(a, b)| {
            let along = [b[0] - a[0], b[1] - a[1]];
            let from = [p[0] - a[0], p[1] - a[1]];
            let cross = along[0] * from[1] - along[1] * from[0];
            let dot = (along[0] * from[0] + along[1] * from[1]) / (along[0].powi(2) + along[1].powi(2));
            cross.abs() < 1e-12 && (-1e-12..=1.0 + 1e-12).contains(&dot)
        })
    }

    fn marks(mesh: &Triangles, outline: &[[f64; 2]]) -> Marks {
        let mut edges = HashSet::new();
        for [a, b, c] in &mesh.triangles {
            for side in [key(*a, *b), key(*b, *c), key(*c, *a)] {
                let [p, q] = side.map(|p| mesh.points[p as usize]);
                let middle = [0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1])];
                if on_outline(outline, p) && on_outline(outline, q) && on_outline(outline, middle) {
                    edges.insert(side);
                }
            }
        }
        let chains = edges.iter().map(|side| (*side, 7)).collect();
        Marks { corners: mesh.points.iter().map(|p| outline.contains(p)).collect(), edges, chains }
    }

    #[test]
    fn a_graded_mesh_fills_the_frame_and_conforms_at_any_number_of_layers() {
        let coarse = coarse(&[Outline::polygon(&L)], FRAME).unwrap();
        let mesh = &coarse.mesh;
        assert!(is_conforming(mesh));
        let marks = marks(mesh, &L);
        assert!(marks.corners.iter().filter(|c| **c).count() == 6 && marks.edges.len() >= 6);
        for corners in 0..4 {
            for edges in 0..=corners {
                let Graded { mesh: fine, parents, chains, .. } =
                    graded(&coarse, &marks, Layers { corners, edges, ratio: 0.15 });
                assert!(is_conforming(&fine), "{corners} {edges}");
                let total: f64 = fine.triangles.iter().map(|t| area(&fine, t)).sum();
                assert!((total - 49.0).abs() < 1e-11, "{corners} {edges}: {total}");
                let mut of_parent = vec![0.0; mesh.triangles.len()];
                fine.triangles
                    .iter()
                    .zip(&parents)
                    .for_each(|(t, p)| of_parent[*p as usize] += area(&fine, t));
                let differ = mesh.triangles.iter().zip(of_parent).map(|(t, a)| (a - area(mesh, t)).abs());
                assert!(differ.fold(0.0, f64::max) < 1e-12);
                let nearest = fine.points.iter().filter(|p| !on_outline(&L, **p));
                let nearest = nearest.map(|p| p[0].hypot(p[1])).fold(f64::INFINITY, f64::min);
                assert!(corners == 0 || nearest < 1.5 * 0.15_f64.powi(corners as i32));
                let length = |side: &[u32; 2]| {
                    let [p, q] = side.map(|p| fine.points[p as usize]);
                    (p[0] - q[0]).hypot(p[1] - q[1])
                };
                let followed: f64 = chains.keys().map(length).sum();
                assert!(
                    (followed - 8.0).abs() < 1e-12 && chains.values().all(|chain| *chain == 7),
                    "{followed}"
                );
                let lies = |side: &&[u32; 2]| side.iter().all(|p| on_outline(&L, fine.points[*p as usize]));
                assert_eq!(chains.keys().filter(lies).count(), chains.len());
            }
        }
    }

    #[test]
    fn a_triangle_and_a_needle_all_of_whose_edges_are_marked_are_graded_too() {
        for outline in [vec![[0.0, 0.0], [1.0, 0.1], [0.2, 0.9]], vec![[0.0, 0.0], [3.0, 0.0], [3.0, 0.02]]] {
            let coarse = coarse(&[Outline::polygon(&outline)], FRAME).unwrap();
            let layers = Layers { corners: 3, edges: 2, ratio: 0.15 };
            let fine = graded(&coarse, &marks(&coarse.mesh, &outline), layers);
            assert!(is_conforming(&fine.mesh));
        }
    }

    #[test]
    fn circles_are_followed_by_arcs_that_end_where_other_outlines_cross_them() {
        let circle = Circle { center: [0.0, 1.0], radius: 1.5 };
        let outlines = [Outline::Circle(circle), Outline::polygon(&L)];
        // Whole, and cut in two by the frame through its middle.
        for frame in [FRAME, [[0.0, -2.0], [4.0, 5.0]]] {
            let coarse = coarse(&outlines, frame).unwrap();
            let turned: f64 = coarse
                .arcs
                .keys()
                .map(|side| {
                    let [p, q] = side.map(|p| coarse.mesh.points[p as usize]);
                    for p in [p, q] {
                        let distance = (p[0] - circle.center[0]).hypot(p[1] - circle.center[1]);
                        assert!((distance - circle.radius).abs() < 1e-12);
                    }
                    apart(circle.angle(p), circle.angle(q))
                })
                .sum();
            let share = if frame[0][0] == 0.0 { 0.5 } else { 1.0 };
            assert!((turned - share * TAU).abs() < 1e-9, "{turned}");
            let crosses = |t: &[u32; 3]| {
                let x = t.map(|p| coarse.mesh.points[p as usize]);
                let middle = [0, 1].map(|k| x.iter().map(|p| p[k]).sum::<f64>() / 3.0);
                let inside = crate::outline::contains(&L, middle);
                let strictly = |p: &[f64; 2]| crate::outline::contains(&L, *p) && !on_outline(&L, *p);
                !inside && x.iter().any(strictly)
            };
            assert!(!coarse.mesh.triangles.iter().any(crosses));
        }
    }

    #[test]
    fn arcs_that_go_over_into_straight_sides_or_into_one_another_are_followed() {
        let arc = |from: [f64; 2], center: [f64; 2], radius: f64, turn: f64| Side {
            from,
            arc: Some(Course::Circle(Circle { center, radius }, turn)),
        };
        let straight = |from: [f64; 2]| Side { from, arc: None };
        let stadium = vec![
            straight([-1.0, 0.0]),
            arc([1.0, 0.0], [1.0, 1.0], 1.0, 0.5 * TAU),
            straight([1.0, 2.0]),
            arc([-1.0, 2.0], [-1.0, 1.0], 1.0, 0.5 * TAU),
        ];
        let drop = vec![
            arc([0.0, 0.0], [0.0, 1.0], 1.0, 0.25 * TAU),
            arc([1.0, 1.0], [2.0, 1.0], 1.0, -0.25 * TAU),
            straight([2.0, 2.0]),
            straight([0.0, 2.0]),
        ];
        // Twice, as the outlines of an electrode and of what it lies on.
        let both = [Outline::Path(stadium.clone()), Outline::Path(stadium.clone())];
        for (outlines, turn) in [(&both[..1], 1.0), (&both, 1.0), (&[Outline::Path(drop)][..], 0.5)] {
            let coarse = coarse(outlines, FRAME).unwrap();
            assert!(is_conforming(&coarse.mesh));
            let turned = coarse.arcs.iter().map(|([p, q], arc)| {
                let RoundSide::Circle(circle) = arc else { panic!("{arc:?}") };
                let [p, q] = [p, q].map(|p| coarse.mesh.points[*p as usize]);
                circle.turn(p, q).abs()
            });
            let turned: f64 = turned.sum();
            assert!((turned - turn * TAU).abs() < 1e-9, "{turned}");
        }
        // An arc that touches a circle elsewhere than at its own ends has no mesh.
        let touching = Outline::Circle(Circle { center: [2.5, 1.0], radius: 0.5 });
        assert!(coarse(&[both[0].clone(), touching], FRAME).is_none());
        let apart = Outline::Circle(Circle { center: [0.0, 1.0], radius: 0.5 });
        assert!(
            coarse(&[both[0].clone(), apart], FRAME).is_some(),
            "it touches the circle, but no arc of it"
        );
    }

    #[test]
    fn circles_that_cross_are_divided_where_they_do_and_those_that_touch_have_no_mesh() {
        let one = Circle { center: [0.0, 1.0], radius: 1.5 };
        let coarse_of = |other: Circle| coarse(&[one, other].map(Outline::Circle), FRAME);
        for other in [
            Circle { center: [1.1, 1.7], radius: 0.9 },
            Circle { center: [0.0, 1.4], radius: 1.5 },
            Circle { center: [-0.3, 0.8], radius: 0.2 },
        ] {
            let coarse = coarse_of(other).unwrap();
            for circle in [one, other] {
                let own = coarse.arcs.iter().filter(|(_, of)| **of == RoundSide::Circle(circle));
                let turned: f64 = own
                    .map(|(side, _)| {
                        let [p, q] = side.map(|p| coarse.mesh.points[p as usize]);
                        apart(circle.angle(p), circle.angle(q))
                    })
                    .sum();
                assert!((turned - TAU).abs() < 1e-9, "{circle:?}: {turned}");
            }
        }
        assert!(coarse_of(Circle { center: [2.0, 1.0], radius: 0.5 }).is_none());
        assert!(coarse_of(Circle { center: [0.5, 1.0], radius: 1.0 }).is_none());
    }

    #[test]
    fn outlines_that_reach_beyond_the_frame_end_on_it() {
        let wide = [[-9.0, 1.0], [9.0, 1.0], [9.0, 2.0], [-9.0, 2.0]];
        let mesh = coarse(&[&wide[..], &L].map(Outline::polygon), FRAME).unwrap().mesh;
        assert!(is_conforming(&mesh));
        let total: f64 = mesh.triangles.iter().map(|t| area(&mesh, t)).sum();
        assert!((total - 49.0).abs() < 1e-12);
        let crosses = |t: &[u32; 3]| {
            let y = t.map(|p| mesh.points[p as usize][1]);
            y.iter().any(|y| *y < 1.0 - 1e-12) && y.iter().any(|y| *y > 1.0 + 1e-12)
        };
        assert!(!mesh.triangles.iter().any(crosses));
    }

    #[test]
    fn every_point_on_the_frame_is_on_it_to_the_last_bit() {
        for k in 0..40 {
            let shift = 0.013 * f64::from(k);
            let frame = [[-0.95 / 1.1 - shift, -1.0 / 0.7], [1.05 / 1.1 + shift, 3.0_f64.sqrt()]];
            let outline = vec![[-0.5, -0.3], [0.4, -0.3], [0.4, 0.35 + shift], [-0.5, 0.35]];
            let mesh = coarse(&[Outline::polygon(&outline)], frame).unwrap().mesh;
            for p in &mesh.points {
                for c in 0..2 {
                    for end in frame.map(|corner| corner[c]) {
                        assert!(p[c] == end || (p[c] - end).abs() > 1e-6, "{p:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn outlines_that_cross_are_both_followed() {
        let one = vec![[0.1, -0.4], [0.5, -0.4], [0.5, 0.5], [0.1, 0.5]];
        let other = vec![[-0.6, -0.5], [0.4, -0.5], [0.4, 0.3], [-0.6, 0.3]];
        for turn in [0.0_f64, 0.3, 1.1] {
            let turned = |outline: &[[f64; 2]]| -> Vec<[f64; 2]> {
                let (s, c) = turn.sin_cos();
                outline.iter().map(|p| [c * p[0] - s * p[1], s * p[0] + c * p[1]]).collect()
            };
            let outlines = [turned(&one), turned(&other)];
            let mesh =
                coarse(&outlines.each_ref().map(|corners| Outline::polygon(corners)), FRAME).unwrap().mesh;
            for (outline, exact) in outlines.iter().zip([0.36, 0.8]) {
                let inside = mesh.triangles.iter().filter(|t| {
                    let x = t.map(|p| mesh.points[p as usize]);
                    let middle = [0, 1].map(|k| x.iter().map(|p| p[k]).sum::<f64>() / 3.0);
                    crate::outline::contains(outline, middle)
                });
                let total: f64 = inside.map(|t| area(&mesh, t)).sum();
                assert!((total - exact).abs() < 1e-12, "{turn}: {total} {exact}");
            }
        }
    }
}
