//! Division of a coarse mesh towards marked corners and edges: first triangles are cut until each is graded
//! towards one corner or edge at most, then each is divided into rings and strips.

use super::bands::Band;
use super::coarse::{Coarse, RoundSide, Triangles, bent_triangles};
use super::{Graded, Layers, Marks, key};
use std::collections::{HashMap, HashSet};

/// A mesh on its way from coarse to graded.
pub(super) struct Grading {
    /// The points, with all triangles straight.
    points: Vec<[f64; 2]>,
    /// The triangles outside of bands, each with the number of the coarse triangle that it is a part of.
    triangles: Vec<([u32; 3], u32)>,
    /// The pairs of triangles that are divided together.
    bands: Vec<Band>,
    /// For each point whether it is a marked corner.
    corner: Vec<bool>,
    /// For each point whether it lies on a marked edge.
    on_edge: Vec<bool>,
    /// The marked edges, as in [`Marks::edges`].
    edges: HashSet<[u32; 2]>,
    /// The sides of chains, as in [`Marks::chains`].
    chains: HashMap<[u32; 2], u32>,
    /// The sides that stand for curves, as in [`Coarse::arcs`].
    arcs: HashMap<[u32; 2], RoundSide>,
    /// The parameters of the grading.
    layers: Layers,
    /// The points at which sides have been cut in two, by the sides.
    middles: HashMap<[u32; 2], u32>,
    /// The points between layers: that of layer `k` from one point towards another, by the numbers of the two
    /// and `k`.
    nodes: HashMap<(u32, u32, usize), u32>,
}

impl Grading {
    /// The triangles and bands of a coarse mesh, nothing of which is divided yet.
    pub(super) fn new(coarse: &Coarse, marks: &Marks, layers: Layers) -> Self {
        let mesh = &coarse.mesh;
        let edges = if layers.edges == 0 { HashSet::new() } else { marks.edges.clone() };
        let bands: &[Band] = if layers.edges == 0 { &[] } else { &marks.bands };
        let mut alone = vec![true; mesh.triangles.len()];
        bands.iter().flat_map(|band| band.triangles).for_each(|t| alone[t as usize] = false);
        let triangles = mesh.triangles.iter().zip(0..).filter(|(_, t)| alone[*t as usize]);
        let mut on_edge = vec![false; mesh.points.len()];
        edges.iter().flatten().for_each(|p| on_edge[*p as usize] = true);
        let corner = if layers.corners == 0 { vec![false; mesh.points.len()] } else { marks.corners.clone() };
        Self {
            points: mesh.points.clone(),
            triangles: triangles.map(|(t, parent)| (*t, parent)).collect(),
            bands: bands.to_vec(),
            corner,
            on_edge,
            edges,
            arcs: coarse.arcs.clone(),
            chains: marks.chains.clone(),
            layers,
            middles: HashMap::new(),
            nodes: HashMap::new(),
        }
    }

    /// Whether the mesh is graded towards a point: a marked corner, or a point on a marked edge.
    fn is_graded_towards(&self, p: u32) -> bool {
        self.corner[p as usize] || self.on_edge[p as usize]
    }

    /// Adds a point; returns its number.
    fn point(&mut self, at: [f64; 2], on_edge: bool) -> u32 {
        self.points.push(at);
        self.corner.push(false);
        self.on_edge.push(on_edge);
        (self.points.len() - 1) as u32
    }

    /// Cuts triangles until each of them has either one marked edge, at most one end of which is a corner, or
    /// no marked edge and at most one point that the mesh is graded towards.
    pub(super) fn separate(&mut self) {
        // A triangle with several curved sides, or with three marked ones, is divided from its middle.
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
            !grading.edges.contains(&[a, b]) && grading.is_graded_towards(a) && grading.is_graded_towards(b)
        }) {}
    }

    /// Cuts the sides for which `must_cut` holds in two, and with them their triangles. Returns whether there
    /// were any.
    fn split(&mut self, must_cut: impl Fn(&Self, [u32; 2]) -> bool) -> bool {
        let mut middles: HashMap<[u32; 2], u32> = HashMap::new();
        for ([a, b, c], _) in self.triangles.clone() {
            for side in [key(a, b), key(b, c), key(c, a)] {
                if middles.contains_key(&side) || !must_cut(self, side) {
                    continue;
                }
                let [p, q] = side.map(|p| self.points[p as usize]);
                let marked = self.edges.contains(&side);
                let round = self.arcs.get(&side).map(|arc| arc.halved([p, q]));
                let place = round.map_or_else(|| [0, 1].map(|k| 0.5 * (p[k] + q[k])), |(place, _)| place);
                let middle = self.point(place, marked);
                // The middle has the highest number of all, so that `key` leaves each end before it.
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
        let has_split = !middles.is_empty();
        self.middles.extend(middles);
        has_split
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

    /// Adds the point that lies this share of the way from one point to another; returns its number.
    fn between(&mut self, from: u32, to: u32, share: f64) -> u32 {
        let [p, q] = [from, to].map(|p| self.points[p as usize]);
        self.point([0, 1].map(|k| p[k] + share * (q[k] - p[k])), false)
    }

    /// Divides every triangle and band; triangles must have been separated before.
    pub(super) fn divide(mut self) -> Graded {
        let mut out = Vec::new();
        let (mut parents, mut bent) = (Vec::new(), Vec::new());
        for (triangle, parent) in std::mem::take(&mut self.triangles) {
            let marked =
                (0..3).find(|&k| self.edges.contains(&key(triangle[(k + 1) % 3], triangle[(k + 2) % 3])));
            let pieces = match (marked, (0..3).find(|&k| self.is_graded_towards(triangle[k]))) {
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
        for band in std::mem::take(&mut self.bands) {
            let pieces = self.between_edges(band.corners);
            bent.extend(std::iter::repeat_n(None, pieces.len()));
            parents.extend(std::iter::repeat_n(band.triangles[0], pieces.len()));
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

    /// The sides of the divided triangles that are parts of sides of chains: both their ends are ends of that
    /// side or lie on it.
    fn divided_chains(&self, triangles: &[[u32; 3]]) -> HashMap<[u32; 2], u32> {
        let mut out = HashMap::new();
        if self.chains.is_empty() {
            return out;
        }
        let mut sides_at: HashMap<u32, Vec<[u32; 2]>> = HashMap::new();
        for side in self.chains.keys() {
            side.iter().for_each(|end| sides_at.entry(*end).or_default().push(*side));
        }
        for ((from, to, _), node) in &self.nodes {
            let side = key(*from, *to);
            if self.chains.contains_key(&side) {
                sides_at.entry(*node).or_default().push(side);
            }
        }
        for [a, b, c] in triangles {
            for part in [key(*a, *b), key(*b, *c), key(*c, *a)] {
                let [Some(one), Some(other)] = part.map(|end| sides_at.get(&end)) else { continue };
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

    /// Rings around the point `a`, which is a corner or lies on a marked edge.
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

    /// Strips along the marked side from `a` to `b`, neither of which is a corner.
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

    /// Strips along the marked sides from `a` to `b` and from `c` to `d`, which meet in a line in the middle.
    fn between_edges(&mut self, [a, b, c, d]: [u32; 4]) -> Vec<[u32; 3]> {
        let [right, left] = [[b, c], [d, a]].map(|side| self.middle(side));
        let mut out = Vec::new();
        for ([from, to], [before, beyond]) in [([a, b], [left, right]), ([c, d], [right, left])] {
            let mut outer = [from, to];
            for k in (0..=self.layers.edges).rev() {
                let inner = [self.node(from, before, k), self.node(to, beyond, k)];
                out.extend(self.quadrilateral([outer[0], outer[1], inner[1], inner[0]]));
                outer = inner;
            }
        }
        out
    }

    /// The point in the middle of a straight side, which may have been cut there.
    fn middle(&mut self, [a, b]: [u32; 2]) -> u32 {
        if let Some(&middle) = self.middles.get(&key(a, b)) {
            return middle;
        }
        let middle = self.between(a, b, 0.5);
        self.middles.insert(key(a, b), middle);
        middle
    }

    /// Rings around the corner `a`, each divided into strips along the marked side from `a` to `b`.
    fn towards_edge_and_corner(&mut self, a: u32, b: u32, c: u32) -> Vec<[u32; 3]> {
        let (rings, strips) = (self.layers.corners, self.layers.edges);
        // For each ring the points on its outer line, from the side between a and c to that between a and b.
        // Their distances from the latter fall by the same ratio as the rings.
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
