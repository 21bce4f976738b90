//! Bodies drawn at random, their surfaces, and the files that these are written to.

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::fmt::Write;

use elastocap_geometry::outline::contains;
use elastocap_geometry::scene::across;
use elastocap_geometry::shapes::TriangleSurface;
use proptest::prelude::Rng;
use proptest::test_runner::{RngAlgorithm, TestRng};

pub(crate) struct Draw(TestRng);

impl Draw {
    pub(crate) fn new(seed: u8) -> Self {
        Self(TestRng::from_seed(RngAlgorithm::ChaCha, &[seed; 32]))
    }

    pub(crate) fn below(&mut self, n: usize) -> usize {
        (self.0.next_u64() % n.max(1) as u64) as usize
    }

    pub(crate) fn within(&mut self, from: f64, to: f64) -> f64 {
        from + (to - from) * (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub(crate) fn one_in(&mut self, n: usize) -> bool {
        self.below(n) == 0
    }

    pub(crate) fn shuffle<T>(&mut self, all: &mut [T]) {
        for k in (1..all.len()).rev() {
            all.swap(k, self.below(k + 1));
        }
    }

    /// In any direction, but in none of the planes of two axes.
    pub(crate) fn step(&mut self, length: f64) -> [f64; 3] {
        [0; 3].map(|_| length * self.within(0.3, 1.0) * if self.one_in(2) { -1.0 } else { 1.0 })
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Kind {
    /// Sides along the other two axes: a union of boxes.
    Boxes,
    /// The same, turned about the axis.
    Turned,
    /// Cells of four unequal sides.
    Warped,
    /// Sectors of rings.
    Rings,
}

pub(crate) const KINDS: [Kind; 4] = [Kind::Boxes, Kind::Turned, Kind::Warped, Kind::Rings];

/// Cells of a plane, some of which are filled between some of the levels along an axis.
#[derive(Debug, Clone)]
pub(crate) struct Body {
    pub(crate) kind: Kind,
    pub(crate) axis: usize,
    pub(crate) nodes: Vec<[f64; 2]>,
    /// Anticlockwise.
    pub(crate) cells: Vec<[usize; 4]>,
    pub(crate) levels: Vec<f64>,
    /// For each interval of levels, the cells.
    pub(crate) filled: Vec<Vec<bool>>,
}

impl Body {
    pub(crate) fn random(kind: Kind, draw: &mut Draw) -> Self {
        let axis = draw.below(3);
        let [n, m] = [1 + draw.below(4), 1 + draw.below(4)];
        let unit = 10_f64.powf(draw.within(-6.0, 0.0));
        let (sectors, rows) = (3 + draw.below(9), m);
        let mut ticks = |n: usize, least: f64| {
            let mut at = draw.within(-3.0, 3.0);
            let mut next = || {
                at += draw.within(least, 1.0);
                at
            };
            (0..=n).map(|_| next()).collect::<Vec<f64>>()
        };
        let (columns, lines, mut levels) = (ticks(n, 0.1), ticks(m, 0.1), ticks(3, 0.1));
        let flatness = 10_f64.powf(draw.within(-2.0, 0.5));
        levels.truncate(2 + draw.below(3));
        levels.iter_mut().for_each(|z| *z *= unit * flatness);
        let turn = draw.within(0.02, 1.5);
        let place = |[x, y]: [f64; 2]| [unit * x, unit * y];
        let turned = |[x, y]: [f64; 2]| [turn.cos() * x - turn.sin() * y, turn.sin() * x + turn.cos() * y];
        let (mut nodes, mut cells) = (Vec::new(), Vec::new());
        if kind == Kind::Rings {
            for k in 0..=rows {
                for l in 0..sectors {
                    let (radius, angle) = (0.2 + lines[k] - lines[0], l as f64 * TAU / sectors as f64 + turn);
                    nodes.push(place([columns[0] + radius * angle.cos(), lines[0] + radius * angle.sin()]));
                }
            }
            for k in 0..rows {
                for l in 0..sectors {
                    let (a, b) = (k * sectors + l, k * sectors + (l + 1) % sectors);
                    cells.push([a, a + sectors, b + sectors, b]);
                }
            }
        } else {
            for (k, y) in lines.iter().enumerate() {
                for (l, x) in columns.iter().enumerate() {
                    nodes.push(place(match kind {
                        Kind::Boxes | Kind::Rings => [*x, *y],
                        Kind::Turned => turned([*x, *y]),
                        Kind::Warped => {
                            [l as f64 + draw.within(-0.2, 0.2), k as f64 + draw.within(-0.2, 0.2)]
                        }
                    }));
                }
            }
            for k in 0..m {
                for l in 0..n {
                    let a = k * (n + 1) + l;
                    cells.push([a, a + 1, a + n + 2, a + n + 1]);
                }
            }
        }
        let sparse = 1 + draw.below(5);
        let mut filled: Vec<Vec<bool>> =
            (1..levels.len()).map(|_| cells.iter().map(|_| !draw.one_in(1 + sparse)).collect()).collect();
        if filled.iter().flatten().all(|filled| !filled) {
            filled[0][0] = true;
        }
        Self { kind, axis, nodes, cells, levels, filled }
    }

    pub(crate) fn point(&self, [x, y]: [f64; 2], z: f64) -> [f64; 3] {
        let [p, q] = across(self.axis);
        let mut point = [0.0; 3];
        (point[p], point[q], point[self.axis]) = (x, y, z);
        point
    }

    pub(crate) fn corners(&self, cell: usize) -> [[f64; 2]; 4] {
        self.cells[cell].map(|node| self.nodes[node])
    }

    pub(crate) fn volume(&self) -> f64 {
        let area = |cell: usize| {
            let [a, b, c, d] = self.corners(cell);
            0.5 * ((c[0] - a[0]) * (d[1] - b[1]) - (d[0] - b[0]) * (c[1] - a[1]))
        };
        let layer_volume = |(k, filled): (usize, &Vec<bool>)| {
            let full: f64 = (0..filled.len()).filter(|cell| filled[*cell]).map(area).sum();
            full * (self.levels[k + 1] - self.levels[k])
        };
        self.filled.iter().enumerate().map(layer_volume).sum()
    }

    /// Points with whether the body holds them: in all cells, near their corners, and around the body.
    pub(crate) fn probes(&self, draw: &mut Draw) -> Vec<([f64; 3], bool)> {
        let mut probes = Vec::new();
        for k in 0..self.filled.len() {
            let mut height = || draw.within(self.levels[k], self.levels[k + 1]);
            for (cell, filled) in self.filled[k].iter().enumerate() {
                let corners = self.corners(cell);
                let centre = [0, 1].map(|a| corners.iter().map(|c| c[a]).sum::<f64>() / 4.0);
                probes.push((self.point(centre, height()), *filled));
                for corner in corners {
                    let near = [0, 1].map(|a| 0.99 * corner[a] + 0.01 * centre[a]);
                    probes.push((self.point(near, height()), *filled));
                }
            }
        }
        let ends = |a: usize| {
            let along = || self.nodes.iter().map(move |node| node[a]);
            [along().fold(f64::INFINITY, f64::min), along().fold(f64::NEG_INFINITY, f64::max)]
        };
        let reach = [ends(0), ends(1), [self.levels[0], self.levels[self.levels.len() - 1]]];
        for _ in 0..30 {
            let [x, y, z] = reach.map(|[a, b]| draw.within(a - 0.5 * (b - a), b + 0.5 * (b - a)));
            let cell = (0..self.cells.len()).find(|cell| contains(&self.corners(*cell), [x, y]));
            let interval = self.levels.windows(2).position(|ends| ends[0] < z && z < ends[1]);
            let held = cell.zip(interval).is_some_and(|(cell, k)| self.filled[k][cell]);
            probes.push((self.point([x, y], z), held));
        }
        probes
    }

    /// Its faces as triangles, turned outward.
    pub(crate) fn surface(&self, draw: &mut Draw) -> TriangleSurface {
        let of_edge: BTreeMap<[usize; 2], usize> = (0..self.cells.len())
            .flat_map(|c| (0..4).map(move |k| (c, k)))
            .map(|(c, k)| ([self.cells[c][k], self.cells[c][(k + 1) % 4]], c))
            .collect();
        let mut known = BTreeMap::new();
        let mut surface = TriangleSurface::default();
        let mut add = |quad: [(usize, usize); 4]| {
            let [a, b, c, d] = quad.map(|(node, level)| {
                *known.entry((node, level)).or_insert_with(|| {
                    surface.points.push(self.point(self.nodes[node], self.levels[level]));
                    surface.points.len() as u32 - 1
                })
            });
            let mut two = if draw.one_in(2) { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] };
            if self.axis == 1 {
                two.iter_mut().for_each(|face| face.reverse());
            }
            surface.faces.extend(two);
        };
        for (k, filled) in self.filled.iter().enumerate() {
            for (cell, corners) in self.cells.iter().enumerate().filter(|(cell, _)| filled[*cell]) {
                if k == 0 || !self.filled[k - 1][cell] {
                    let [a, b, c, d] = *corners;
                    add([d, c, b, a].map(|node| (node, k)));
                }
                if k + 1 == self.filled.len() || !self.filled[k + 1][cell] {
                    add(corners.map(|node| (node, k + 1)));
                }
                for l in 0..4 {
                    let [a, b] = [corners[l], corners[(l + 1) % 4]];
                    if !of_edge.get(&[b, a]).is_some_and(|other| filled[*other]) {
                        add([(a, k), (b, k), (b, k + 1), (a, k + 1)]);
                    }
                }
            }
        }
        surface
    }
}

/// Whether parts of a surface touch along an edge, or at a corner, only.
pub(crate) fn touches_itself(surface: &TriangleSurface) -> bool {
    let mut around = vec![Vec::new(); surface.points.len()];
    for [a, b, c] in &surface.faces {
        for (p, edge) in [(a, [b, c]), (b, [c, a]), (c, [a, b])] {
            around[*p as usize].push(edge);
        }
    }
    // The edges opposite to a point are one circle around it.
    around.iter().filter(|edges| !edges.is_empty()).any(|edges| {
        let mut at = edges[0][1];
        let mut passed = 1;
        while at != edges[0][0] && passed <= edges.len() {
            let mut next = edges.iter().filter(|edge| *edge[0] == *at);
            let Some(edge) = next.next() else { return true };
            at = edge[1];
            passed += 1;
        }
        passed != edges.len()
    })
}

/// Divides edges of the triangles at random points, mostly the longest ones.
pub(crate) fn divide(surface: &mut TriangleSurface, times: usize, draw: &mut Draw) {
    for _ in 0..times {
        let face = surface.faces[draw.below(surface.faces.len())];
        let side = |k: usize| [face[k], face[(k + 1) % 3]];
        let length = |[a, b]: [u32; 2]| {
            let [a, b] = [a, b].map(|p| surface.points[p as usize]);
            (0..3).map(|k| (b[k] - a[k]).powi(2)).sum::<f64>()
        };
        let longest = (0..3).max_by(|k, l| length(side(*k)).total_cmp(&length(side(*l)))).unwrap();
        let [a, b] = side(if draw.one_in(4) { draw.below(3) } else { longest });
        let share = draw.within(0.3, 0.7);
        divide_edge(surface, [a, b], share);
    }
}

/// Divides all triangles at an edge, at a share of it from its first end; the number of the new point.
pub(crate) fn divide_edge(surface: &mut TriangleSurface, [a, b]: [u32; 2], share: f64) -> u32 {
    let [from, to] = [a, b].map(|p| surface.points[p as usize]);
    let new = surface.points.len() as u32;
    surface.points.push([0, 1, 2].map(|k| from[k] + share * (to[k] - from[k])));
    for f in 0..surface.faces.len() {
        let face = surface.faces[f];
        if face.contains(&a) && face.contains(&b) {
            surface.faces[f] = face.map(|p| if p == b { new } else { p });
            surface.faces.push(face.map(|p| if p == a { new } else { p }));
        }
    }
    new
}

/// An OBJ file of a surface: points and faces in any order, points twice, points of no face, and faces
/// turned.
pub(crate) fn file(surface: &TriangleSurface, draw: &mut Draw) -> String {
    // Each point that the file has: the number of the one that it is in the surface.
    let mut listed: Vec<usize> = (0..surface.points.len()).collect();
    (0..draw.below(4)).for_each(|_| listed.push(draw.below(surface.points.len())));
    draw.shuffle(&mut listed);
    let mut text = String::new();
    for point in &listed {
        let [x, y, z] = surface.points[*point];
        writeln!(text, "v {x} {y} {z}").unwrap();
    }
    text += "v 7 -8 9e3\n";
    let mut faces = surface.faces.clone();
    draw.shuffle(&mut faces);
    let turns = draw.one_in(2);
    for mut face in faces {
        if turns && draw.one_in(2) {
            face.reverse();
        }
        face.rotate_left(draw.below(3));
        let [a, b, c] = face.map(|p| {
            let same: Vec<usize> = (0..listed.len()).filter(|k| listed[*k] == p as usize).collect();
            same[draw.below(same.len())] + 1
        });
        writeln!(text, "f {a} {b} {c}").unwrap();
    }
    text
}
