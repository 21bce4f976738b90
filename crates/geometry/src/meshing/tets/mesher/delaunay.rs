//! A Delaunay triangulation of points in a box, grown point by point, that later keeps given faces and edges.
//!
//! A point takes the place of the tetrahedra whose circumspheres hold it (Bowyer, Watson, 1981). Orientation and sphere tests
//! are exact (Shewchuk, 1997), so that points on common spheres and planes do no harm. The hull is the box of the start: every
//! later point lies in it or, with the very same coordinate, on it.

use super::refine::roundness;
use elastocap_linalg::vector::{cross, dot, minus};
use std::collections::HashMap;

/// No tetrahedron, no point.
pub(super) const NONE: u32 = u32::MAX;
/// Corners of the face opposite each corner; with that corner they make a positive determinant.
pub(super) const FACES: [[usize; 3]; 4] = [[1, 3, 2], [0, 2, 3], [0, 3, 1], [0, 1, 2]];
/// Corners of the edges.
pub(super) const EDGES: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];

type P = [f64; 3];

/// Why a point was not taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Refusal {
    /// It is this one.
    Known(u32),
    /// It lies outside the box.
    Outside,
    /// Face `.1` of tetrahedron `.0`, to be kept, is in between.
    Behind(u32, usize),
    /// It would take away this edge, to be kept.
    Edge(u32, u32),
    /// It lies in the sphere over this face, to be kept, or over this edge.
    Near(u32, usize),
    /// Faces to be kept lie between it and the tetrahedron it is for, which would stay.
    Far,
    /// Rounding, or a point that would be lost.
    Shape,
}

/// The triangulation.
#[derive(Debug, Default)]
pub(super) struct Delaunay {
    pub(super) points: Vec<P>,
    /// Facets each point lies on.
    pub(super) on: Vec<Vec<u32>>,
    /// Corners; the first is [`NONE`] where there is no tetrahedron any more.
    pub(super) tets: Vec<[u32; 4]>,
    /// Across the face opposite each corner.
    pub(super) near: Vec<[u32; 4]>,
    /// 1 + the facet of each face that is kept, else 0.
    pub(super) walls: Vec<[u32; 4]>,
    /// A number that each tetrahedron hands on to those that take its place on the same side of all kept faces.
    pub(super) regions: Vec<i32>,
    /// Edges to be kept, and what they are part of.
    pub(super) kept: HashMap<[u32; 2], u32>,
    /// The tetrahedra of the last point taken.
    pub(super) fresh: Vec<u32>,
    /// New tetrahedra must be rounder than this, or the point is refused.
    pub(super) least: f64,
    /// The tetrahedron that a point is taken in to get rid of, or none.
    pub(super) doomed: u32,
    tet_of: Vec<u32>,
    free: Vec<u32>,
    stamps: Vec<u32>,
    point_stamps: Vec<u32>,
    stamp: u32,
    random: u32,
}

fn coord(p: P) -> robust::Coord3D<f64> {
    robust::Coord3D { x: p[0], y: p[1], z: p[2] }
}

/// The sign of det(b - a, c - a, d - a), exactly.
pub(super) fn orient(a: P, b: P, c: P, d: P) -> f64 {
    -robust::orient3d(coord(a), coord(b), coord(c), coord(d))
}

fn in_sphere(t: [P; 4], p: P) -> bool {
    robust::insphere(coord(t[0]), coord(t[1]), coord(t[2]), coord(t[3]), coord(p)) < 0.0
}

pub(super) fn sorted(a: u32, b: u32) -> [u32; 2] {
    if a < b { [a, b] } else { [b, a] }
}

fn squared(a: P, b: P) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum()
}

impl Delaunay {
    /// The box alone. Its eight corners are points 0 to 7, axis 0 fastest.
    pub(super) fn new(min: P, max: P) -> Self {
        let mut out = Self { random: 1, least: f64::NEG_INFINITY, doomed: NONE, ..Self::default() };
        for corner in 0..8 {
            out.points.push([0, 1, 2].map(|a| if corner >> a & 1 == 0 { min[a] } else { max[a] }));
            out.on.push(Vec::new());
            out.tet_of.push(0);
            out.point_stamps.push(0);
        }
        for (a, b) in [(1, 2), (2, 1), (1, 4), (4, 1), (2, 4), (4, 2)] {
            let mut tet = [0, a, a + b, 7];
            let at = tet.map(|p: u32| out.points[p as usize]);
            if orient(at[0], at[1], at[2], at[3]) < 0.0 {
                tet.swap(2, 3);
            }
            out.tets.push(tet);
            out.near.push([NONE; 4]);
            out.walls.push([0; 4]);
            out.regions.push(0);
            out.stamps.push(0);
            for p in tet {
                out.tet_of[p as usize] = out.tets.len() as u32 - 1;
            }
        }
        let mut open: HashMap<[u32; 3], (usize, usize)> = HashMap::new();
        for t in 0..6 {
            for i in 0..4 {
                let mut face = FACES[i].map(|k| out.tets[t][k]);
                face.sort_unstable();
                if let Some((n, j)) = open.remove(&face) {
                    out.near[t][i] = n as u32;
                    out.near[n][j] = t as u32;
                } else {
                    open.insert(face, (t, i));
                }
            }
        }
        out
    }

    pub(super) fn alive(&self, t: u32) -> bool {
        self.tets[t as usize][0] != NONE
    }

    pub(super) fn corners(&self, t: u32) -> [P; 4] {
        self.tets[t as usize].map(|p| self.points[p as usize])
    }

    pub(super) fn face(&self, t: u32, i: usize) -> [u32; 3] {
        FACES[i].map(|k| self.tets[t as usize][k])
    }

    /// All tetrahedra at a point.
    pub(super) fn star(&mut self, v: u32) -> Vec<u32> {
        self.stamp += 1;
        let mut out = vec![self.tet_of[v as usize]];
        self.stamps[out[0] as usize] = self.stamp;
        let mut next = 0;
        while next < out.len() {
            let t = out[next] as usize;
            next += 1;
            for i in 0..4 {
                let n = self.near[t][i];
                if self.tets[t][i] != v && n != NONE && self.stamps[n as usize] != self.stamp {
                    self.stamps[n as usize] = self.stamp;
                    out.push(n);
                }
            }
        }
        out
    }

    /// Whether the points are corners of one tetrahedron.
    pub(super) fn has(&mut self, simplex: &[u32]) -> bool {
        let star = self.star(simplex[0]);
        star.iter().any(|&t| simplex.iter().all(|p| self.tets[t as usize].contains(p)))
    }

    /// A tetrahedron at the point.
    pub(super) fn at(&self, v: u32) -> u32 {
        self.tet_of[v as usize]
    }

    /// The tetrahedron that holds `p`, by a walk from `hint` that crosses no kept face but those of the facets `own`.
    fn locate(&mut self, p: P, hint: u32, own: &[u32]) -> Result<u32, Refusal> {
        let mut t = hint;
        'walk: for _ in 0..20_000 {
            self.random = self.random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let first = (self.random >> 16) as usize;
            for k in 0..4 {
                let i = (first + k) % 4;
                let [a, b, c] = self.face(t, i).map(|q| self.points[q as usize]);
                if orient(a, b, c, p) < 0.0 {
                    let (n, wall) = (self.near[t as usize][i], self.walls[t as usize][i]);
                    if wall != 0 && !own.contains(&(wall - 1)) {
                        return Err(Refusal::Behind(t, i));
                    }
                    if n == NONE {
                        return Err(Refusal::Outside);
                    }
                    t = n;
                    continue 'walk;
                }
            }
            return Ok(t);
        }
        Err(Refusal::Shape)
    }

    /// The first face to be kept on the straight way from the middle of a tetrahedron to `p`.
    pub(super) fn wall_before(&self, mut t: u32, p: P) -> Option<(u32, usize)> {
        let corners = self.corners(t);
        let from = [0, 1, 2].map(|k| corners.iter().map(|c| c[k]).sum::<f64>() / 4.0);
        for _ in 0..1000 {
            let i = (0..4).find(|&i| {
                let [a, b, c] = self.face(t, i).map(|q| self.points[q as usize]);
                let sides = [[a, b], [b, c], [c, a]].map(|[q, r]| orient(from, p, q, r));
                let through = sides.iter().all(|&s| s >= 0.0) || sides.iter().all(|&s| s <= 0.0);
                through && orient(a, b, c, p) < 0.0 && orient(a, b, c, from) > 0.0
            })?;
            if self.walls[t as usize][i] != 0 {
                return Some((t, i));
            }
            t = self.near[t as usize][i];
            if t == NONE {
                return None;
            }
        }
        None
    }

    /// Takes a point on the facets `own` into the triangulation. Tetrahedra flat within a facet are avoided if `strict`; a
    /// point too near to kept faces and edges other than its own is refused if `polite`.
    pub(super) fn insert(
        &mut self,
        p: P,
        hint: u32,
        own: &[u32],
        splits: Option<u32>,
        strict: bool,
        polite: bool,
    ) -> Result<u32, Refusal> {
        let start = self.locate(p, hint, own)?;
        if let Some(&known) = self.tets[start as usize].iter().find(|&&q| self.points[q as usize] == p) {
            return Err(Refusal::Known(known));
        }
        let mut cavity = vec![start];
        self.stamp += 2;
        // In the cavity; once thrown out, never in again.
        let (inside, banned) = (self.stamp, self.stamp - 1);
        self.stamps[start as usize] = inside;
        let crossed = |wall: u32| wall == 0 || own.contains(&(wall - 1));
        let mut next = 0;
        let mut rim: Vec<(u32, usize)> = Vec::new();
        loop {
            while next < cavity.len() {
                let t = cavity[next] as usize;
                next += 1;
                for i in 0..4 {
                    let n = self.near[t][i];
                    if n == NONE || self.stamps[n as usize] >= banned || !crossed(self.walls[t][i]) {
                        continue;
                    }
                    if in_sphere(self.corners(n), p) {
                        self.stamps[n as usize] = inside;
                        cavity.push(n);
                    }
                }
            }
            rim.clear();
            let mut changed = false;
            for k in 0..cavity.len() {
                let t = cavity[k];
                for i in 0..4 {
                    let n = self.near[t as usize][i];
                    if self.stamps[t as usize] != inside || (n != NONE && self.stamps[n as usize] == inside) {
                        continue;
                    }
                    let face = self.face(t, i);
                    let flat = own.iter().any(|f| face.iter().all(|&q| self.on[q as usize].contains(f)));
                    if strict && flat && n != NONE {
                        if self.stamps[n as usize] == banned {
                            return Err(Refusal::Shape);
                        }
                        self.stamps[n as usize] = inside;
                        cavity.push(n);
                        changed = true;
                        continue;
                    }
                    let [a, b, c] = face.map(|q| self.points[q as usize]);
                    let side = orient(a, b, c, p);
                    if side == 0.0 && n == NONE {
                        // In the plane of a facet that it does not know of it would be moved off it later.
                        if !crossed(self.walls[t as usize][i]) {
                            return Err(Refusal::Near(t, i));
                        }
                        continue;
                    }
                    if side <= 0.0 {
                        if t == start {
                            return Err(Refusal::Shape);
                        }
                        self.stamps[t as usize] = banned;
                        changed = true;
                        continue;
                    }
                    rim.push((t, i));
                }
            }
            if !changed {
                break;
            }
            cavity.retain(|&t| self.stamps[t as usize] == inside);
            next = 0;
        }
        if self.doomed != NONE && self.stamps[self.doomed as usize] != inside {
            return Err(Refusal::Far);
        }
        self.guard(p, &cavity, &rim, own, splits, polite)?;
        Ok(self.fill(p, &cavity, &rim, own))
    }

    /// Whether the cavity loses no point and no kept edge, and the point keeps its distance.
    fn guard(
        &mut self,
        p: P,
        cavity: &[u32],
        rim: &[(u32, usize)],
        own: &[u32],
        splits: Option<u32>,
        polite: bool,
    ) -> Result<(), Refusal> {
        self.stamp += 1;
        let mut edges = Vec::new();
        for &(t, i) in rim {
            let face = self.face(t, i);
            if self.least.is_finite() {
                let [a, b, c] = face.map(|q| self.points[q as usize]);
                if roundness([a, b, c, p]) <= self.least {
                    return Err(Refusal::Shape);
                }
            }
            for k in 0..3 {
                self.point_stamps[face[k] as usize] = self.stamp;
                edges.push(sorted(face[k], face[(k + 1) % 3]));
            }
        }
        let lost =
            |t: &&u32| self.tets[**t as usize].iter().any(|&q| self.point_stamps[q as usize] != self.stamp);
        if cavity.iter().find(lost).is_some() {
            return Err(Refusal::Shape);
        }
        if self.kept.is_empty() {
            return Ok(());
        }
        edges.sort_unstable();
        for &t in cavity {
            for [i, j] in EDGES {
                let edge = sorted(self.tets[t as usize][i], self.tets[t as usize][j]);
                if self.on[edge[0] as usize].is_empty() {
                    continue;
                }
                let Some(&segment) = self.kept.get(&edge) else { continue };
                if splits == Some(segment) {
                    continue;
                }
                let [a, b] = edge.map(|q| self.points[q as usize]);
                let close = polite && squared(a, p) + squared(b, p) < squared(a, b);
                if close || edges.binary_search(&edge).is_err() {
                    return Err(Refusal::Edge(edge[0], edge[1]));
                }
            }
        }
        if polite && own.is_empty() {
            for &(t, i) in rim {
                let wall = self.walls[t as usize][i];
                if wall == 0 || own.contains(&(wall - 1)) {
                    continue;
                }
                let corners = self.face(t, i).map(|q| self.points[q as usize]);
                if let Some(middle) = circumcenter(corners)
                    && squared(middle, p) < squared(middle, corners[0])
                {
                    return Err(Refusal::Near(t, i));
                }
            }
        }
        Ok(())
    }

    /// Moves a point if all tetrahedra at it, none of which is then worse than the worst was, stay positive.
    pub(super) fn improve(&mut self, v: u32, worth: impl Fn([P; 4]) -> f64, offsets: &[P]) -> bool {
        let star = self.star(v);
        let worst = |mesh: &Self| star.iter().map(|&t| worth(mesh.corners(t))).fold(f64::INFINITY, f64::min);
        let start = self.points[v as usize];
        let mut best = (worst(self), start);
        let before = best.0;
        for d in offsets {
            self.points[v as usize] = [0, 1, 2].map(|k| start[k] + d[k]);
            let now = worst(self);
            if now > best.0 {
                best = (now, self.points[v as usize]);
            }
        }
        self.points[v as usize] = best.1;
        best.0 > before
    }

    /// Puts tetrahedra between the point and the faces around the cavity.
    fn fill(&mut self, p: P, cavity: &[u32], rim: &[(u32, usize)], own: &[u32]) -> u32 {
        let v = self.points.len() as u32;
        self.points.push(p);
        self.on.push(own.to_vec());
        self.point_stamps.push(0);
        self.tet_of.push(NONE);
        // What is left of a facet around the point: edges of one face of it only.
        let mut around: Vec<([u32; 2], u32)> = Vec::new();
        for &t in cavity {
            for i in 0..4 {
                let (n, wall) = (self.near[t as usize][i], self.walls[t as usize][i]);
                if wall != 0 && own.contains(&(wall - 1)) && (n == NONE || t < n) && !rim.contains(&(t, i)) {
                    let face = self.face(t, i);
                    for k in 0..3 {
                        let edge = (sorted(face[k], face[(k + 1) % 3]), wall);
                        if let Some(twin) = around.iter().position(|&e| e == edge) {
                            around.swap_remove(twin);
                        } else {
                            around.push(edge);
                        }
                    }
                }
            }
        }
        self.fresh.clear();
        let mut sides: Vec<([u32; 2], u32, usize)> = Vec::with_capacity(3 * rim.len());
        for &(t, i) in rim {
            let [a, b, c] = self.face(t, i);
            let (n, wall, region) =
                (self.near[t as usize][i], self.walls[t as usize][i], self.regions[t as usize]);
            let new = self.free.pop().unwrap_or_else(|| {
                self.tets.push([NONE; 4]);
                self.near.push([NONE; 4]);
                self.walls.push([0; 4]);
                self.regions.push(0);
                self.stamps.push(0);
                self.tets.len() as u32 - 1
            });
            let at = new as usize;
            self.tets[at] = [a, b, c, v];
            self.near[at] = [NONE, NONE, NONE, n];
            self.walls[at] = [0, 0, 0, wall];
            self.regions[at] = region;
            if n != NONE {
                let back = self.near[n as usize].iter().position(|&x| x == t);
                if let Some(back) = back {
                    self.near[n as usize][back] = new;
                }
            }
            for q in [a, b, c, v] {
                self.tet_of[q as usize] = new;
            }
            for (k, edge) in [(0, sorted(b, c)), (1, sorted(a, c)), (2, sorted(a, b))] {
                sides.push((edge, new, k));
                if let Some(&(_, wall)) = around.iter().find(|e| e.0 == edge) {
                    self.walls[at][k] = wall;
                }
            }
            self.fresh.push(new);
        }
        sides.sort_unstable();
        for pair in sides.windows(2) {
            if pair[0].0 == pair[1].0 {
                self.near[pair[0].1 as usize][pair[0].2] = pair[1].1;
                self.near[pair[1].1 as usize][pair[1].2] = pair[0].1;
            }
        }
        for &t in cavity {
            self.tets[t as usize][0] = NONE;
            self.free.push(t);
        }
        v
    }
}

/// The middle of the circle through three points; `None` if they lie on a line.
pub(super) fn circumcenter([a, b, c]: [P; 3]) -> Option<P> {
    let [u, v] = [b, c].map(|q| minus(q, a));
    let (uu, vv, uv) = (dot(u, u), dot(v, v), dot(u, v));
    let det = 2.0 * (uu * vv - uv * uv);
    let (s, t) = (vv * (uu - uv) / det, uu * (vv - uv) / det);
    (s.is_finite() && t.is_finite()).then(|| [0, 1, 2].map(|k| a[k] + s * u[k] + t * v[k]))
}

/// The middle of the sphere through four points, not finite if they lie in a plane.
pub(super) fn sphere_center([a, b, c, d]: [P; 4]) -> P {
    let [u, v, w] = [b, c, d].map(|q| minus(q, a));
    let (vw, wu, uv) = (cross(v, w), cross(w, u), cross(u, v));
    let scale = 0.5 / dot(u, vw);
    [0, 1, 2].map(|k| a[k] + scale * (dot(u, u) * vw[k] + dot(v, v) * wu[k] + dot(w, w) * uv[k]))
}
