//! Until segments and facets are made of edges and faces of the triangulation.

use super::complex::Complex;
use super::delaunay::{Delaunay, FACES, Refusal, circumcenter, sorted};
use super::{MeshError, Sizing};
use elastocap_linalg::vector::{length, minus};
use std::collections::HashSet;

type P = [f64; 3];

/// A segment is not cut into parts shorter than this part of it.
const SHORTEST: f64 = 1e-5;

/// The triangulation with what it has to keep.
#[derive(Debug)]
pub(super) struct Work {
    pub(super) mesh: Delaunay,
    pub(super) complex: Complex,
    /// The size of elements wanted at each point, m.
    pub(super) sizes: Vec<f64>,
    /// Facets of each segment.
    pub(super) segments: Vec<Vec<u32>>,
    /// How long each segment is as a whole, m.
    lengths: Vec<f64>,
    /// Parts of segments, and of which.
    subs: Vec<([u32; 2], u32)>,
    of_facet: Vec<Vec<u32>>,
    /// Points from here on are none of the scene's.
    given: u32,
    last: u32,
}

/// A number that puts points near each other in space near each other in line (Morton order).
fn along(p: P, min: P, max: P) -> u64 {
    let cell =
        [0, 1, 2].map(|a| (((p[a] - min[a]) / (max[a] - min[a])).clamp(0.0, 1.0) * 1_048_575.0) as u64);
    (0..20).fold(0, |code, bit| (0..3).fold(code, |code, a| code | (cell[a] >> bit & 1) << (3 * bit + a)))
}

impl Work {
    /// The Delaunay triangulation of the points of a complex within a box.
    pub(super) fn new(complex: Complex, min: P, max: P) -> Result<Self, MeshError> {
        let mesh = Delaunay::new(min, max);
        let mut out = Self {
            sizes: vec![f64::INFINITY; mesh.points.len()],
            mesh,
            segments: Vec::new(),
            lengths: Vec::new(),
            subs: Vec::new(),
            of_facet: vec![Vec::new(); complex.facets.len()],
            given: 0,
            last: 0,
            complex,
        };
        let mut order: Vec<usize> = (0..out.complex.points.len()).collect();
        order.sort_by_cached_key(|&k| (along(out.complex.points[k], min, max), k));
        let mut ids = vec![0; order.len()];
        // Those that would make a tetrahedron flat within a facet may come later, among other points.
        let mut later = Vec::new();
        for last in [false, true] {
            for k in std::mem::take(if last { &mut later } else { &mut order }) {
                let (p, size) = (out.complex.points[k], out.complex.sizes[k]);
                let on = out.complex.on[k].clone();
                let mut taken = out.insert(p, &on, true);
                if taken == Err(Refusal::Shape) && !last {
                    later.push(k);
                    continue;
                }
                if taken == Err(Refusal::Shape) {
                    taken = out.insert(p, &on, false);
                }
                ids[k] = out.taken(taken, p, &on, size)?;
            }
        }
        for (ends, facets) in &out.complex.segments {
            out.subs.push((ends.map(|p| ids[p as usize]), out.segments.len() as u32));
            out.segments.push(facets.clone());
            let [a, b] = ends.map(|p| out.complex.points[p as usize]);
            out.lengths.push(length(minus(b, a)));
        }
        out.given = out.mesh.points.len() as u32;
        for k in 0..out.complex.seeds.len() {
            let (p, size) = out.complex.seeds[k];
            if (0..3).all(|a| min[a] < p[a] && p[a] < max[a]) {
                out.add(p, &[], size)?;
            }
        }
        Ok(out)
    }

    fn unreachable(&self, at: P) -> MeshError {
        MeshError::Unreachable { at, points: self.mesh.points.len() }
    }

    /// Takes a point in while nothing is kept yet.
    fn add(&mut self, p: P, on: &[u32], size: f64) -> Result<u32, MeshError> {
        let mut taken = self.insert(p, on, true);
        if taken == Err(Refusal::Shape) {
            taken = self.insert(p, on, false);
        }
        self.taken(taken, p, on, size)
    }

    fn insert(&mut self, p: P, on: &[u32], strict: bool) -> Result<u32, Refusal> {
        let mut hint = self.last;
        if !self.mesh.alive(hint) {
            hint = self.mesh.at(self.mesh.points.len() as u32 - 1);
        }
        self.mesh.insert(p, hint, on, None, strict, false)
    }

    /// Writes down what a point that was taken in is on.
    fn taken(&mut self, taken: Result<u32, Refusal>, p: P, on: &[u32], size: f64) -> Result<u32, MeshError> {
        let v = match taken {
            Ok(v) => {
                self.sizes.push(size);
                v
            }
            Err(Refusal::Known(v)) => {
                for f in on {
                    if !self.mesh.on[v as usize].contains(f) {
                        self.mesh.on[v as usize].push(*f);
                    }
                }
                self.sizes[v as usize] = self.sizes[v as usize].min(size);
                v
            }
            Err(_) => return Err(self.unreachable(p)),
        };
        for &f in on {
            if !self.of_facet[f as usize].contains(&v) || v < 8 {
                let list = &mut self.of_facet[f as usize];
                if list.last() != Some(&v) {
                    list.push(v);
                }
            }
        }
        self.last = self.mesh.at(v);
        Ok(v)
    }

    /// Where a segment between two points is cut: in the middle, or on one of the spheres of radius 2^k around an end that the
    /// scene gave, so that segments that meet there are cut alike.
    pub(super) fn cut(&self, [a, b]: [u32; 2]) -> P {
        let [p, q] = [a, b].map(|i| self.mesh.points[i as usize]);
        let given = [a, b].map(|i| i < self.given);
        let mut s = 0.5;
        if given[0] != given[1] {
            let length = (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt();
            let part = 2.0_f64.powi((0.5 * length).log2().round() as i32) / length;
            s = if given[0] { part } else { 1.0 - part };
        }
        [0, 1, 2].map(|k| if p[k] == q[k] { p[k] } else { p[k] + s * (q[k] - p[k]) })
    }

    fn between(&self, ends: [u32; 2]) -> f64 {
        ends.iter().fold(f64::INFINITY, |s, &p| s.min(self.sizes[p as usize]))
    }

    fn split(&mut self, k: usize) -> Result<(), MeshError> {
        let ([a, b], segment) = self.subs[k];
        let p = self.cut([a, b]);
        // Around a sharp corner every part may ask for smaller ones.
        let [from, to] = [a, b].map(|q| self.mesh.points[q as usize]);
        if length(minus(to, from)) < SHORTEST * self.lengths[segment as usize] {
            return Err(self.unreachable(p));
        }
        let on = self.segments[segment as usize].clone();
        let v = self.add(p, &on, self.between([a, b]))?;
        if v == a || v == b {
            return Err(self.unreachable(p));
        }
        self.subs[k].0 = [a, v];
        self.subs.push(([v, b], segment));
        Ok(())
    }

    /// Cuts segments that are not there.
    fn segments(&mut self, most: usize) -> Result<(), MeshError> {
        loop {
            let mut whole = true;
            for k in 0..self.subs.len() {
                if !self.mesh.has(&self.subs[k].0) {
                    whole = false;
                    if self.mesh.points.len() > most {
                        return Err(self.unreachable(self.mesh.points[self.subs[k].0[0] as usize]));
                    }
                    self.split(k)?;
                }
            }
            if whole {
                return Ok(());
            }
        }
    }

    /// Triangles of facet `f` that should be there and are not, by the circles through their corners.
    fn missing(&mut self, f: usize) -> Vec<[u32; 3]> {
        let points = self.of_facet[f].clone();
        if let &[a, b, c] = &points[..] {
            return if self.mesh.has(&[a, b, c]) { Vec::new() } else { vec![[a, b, c]] };
        }
        let name = f as u32;
        let mut there: HashSet<[u32; 3]> = HashSet::new();
        let mut covered = 0.0;
        for &v in &points {
            for t in self.mesh.star(v) {
                for face in FACES {
                    let mut ids = face.map(|k| self.mesh.tets[t as usize][k]);
                    ids.sort_unstable();
                    if ids[0] != v || !ids.iter().all(|&p| self.mesh.on[p as usize].contains(&name)) {
                        continue;
                    }
                    if there.insert(ids) && self.inside(f, ids) {
                        covered += self.area(f, ids);
                    }
                }
            }
        }
        let facet = &self.complex.facets[f];
        let flat: Vec<delaunator::Point> = points
            .iter()
            .map(|&p| {
                let [x, y] = facet.flat(self.mesh.points[p as usize]);
                delaunator::Point { x, y }
            })
            .collect();
        let plane = delaunator::triangulate(&flat);
        let mut whole = 0.0;
        let mut missing = Vec::new();
        for t in plane.triangles.chunks_exact(3) {
            let mut ids = [0, 1, 2].map(|k| points[t[k]]);
            ids.sort_unstable();
            if self.inside(f, ids) {
                whole += self.area(f, ids);
                if !there.contains(&ids) {
                    missing.push(ids);
                }
            }
        }
        // Among points on one circle either diagonal will do.
        if (covered - whole).abs() <= 1e-9 * whole {
            missing.clear();
        }
        missing
    }

    fn middle(&self, ids: [u32; 3]) -> P {
        let [a, b, c] = ids.map(|p| self.mesh.points[p as usize]);
        [0, 1, 2].map(|k| (a[k] + b[k] + c[k]) / 3.0)
    }

    pub(super) fn inside(&self, f: usize, ids: [u32; 3]) -> bool {
        self.complex.facets[f].holds(self.middle(ids))
    }

    /// Area as seen on the plane of the facet, which its points may lie a little off.
    fn area(&self, f: usize, ids: [u32; 3]) -> f64 {
        let facet = &self.complex.facets[f];
        let [a, b, c] = ids.map(|p| facet.flat(self.mesh.points[p as usize]));
        0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])).abs()
    }

    /// Adds points until every segment and facet is there; then they are kept.
    pub(super) fn conform(&mut self, sizing: &Sizing) -> Result<(), MeshError> {
        let most = sizing.most_points;
        loop {
            self.segments(most)?;
            let before = self.mesh.points.len();
            for f in 0..self.complex.facets.len() {
                for ids in self.missing(f) {
                    if self.mesh.points.len() > most {
                        return Err(self.unreachable(self.middle(ids)));
                    }
                    self.fill(f, ids)?;
                }
            }
            if self.mesh.points.len() == before {
                self.bulge(most)?;
            }
            if self.mesh.points.len() == before {
                break;
            }
        }
        self.keep();
        Ok(())
    }

    /// Adds the middle of the circle through a triangle that is not there, or cuts a segment that it is too near to.
    fn fill(&mut self, f: usize, ids: [u32; 3]) -> Result<(), MeshError> {
        let name = f as u32;
        let corners = ids.map(|p| self.mesh.points[p as usize]);
        let center = circumcenter(corners).unwrap_or_else(|| self.middle(ids));
        let squared = |a: P, b: P| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>();
        let near = |ends: [u32; 2]| {
            let [a, b] = ends.map(|p| self.mesh.points[p as usize]);
            squared(a, center) + squared(b, center) <= squared(a, b) * (1.0 + 1e-12)
        };
        // A point of the same pass may lie in the circle: what comes of it is seen in the next one.
        let radius = squared(corners[0], center);
        let stale = |&p: &u32| squared(self.mesh.points[p as usize], center) < 0.8 * radius;
        if self.of_facet[f].iter().any(stale) {
            return Ok(());
        }
        let encroached = (0..self.subs.len())
            .find(|&k| self.segments[self.subs[k].1 as usize].contains(&name) && near(self.subs[k].0));
        if let Some(k) = encroached {
            return self.split(k);
        }
        let facet = &self.complex.facets[f];
        let at = if facet.holds(center) { center } else { self.middle(ids) };
        let at = facet.raise(facet.flat(at));
        let size = ids.iter().fold(f64::INFINITY, |s, &p| s.min(self.sizes[p as usize]));
        self.add(at, &[name], size).map(|_| ())
    }

    /// Adds points in tetrahedra whose corners all lie on one facet: both sides of them would be kept, with nothing between.
    fn bulge(&mut self, most: usize) -> Result<(), MeshError> {
        for t in 0..self.mesh.tets.len() as u32 {
            if !self.mesh.alive(t) {
                continue;
            }
            let ids = self.mesh.tets[t as usize];
            let common = self.mesh.on[ids[0] as usize].iter().copied().find(|f| {
                ids[1..].iter().all(|&p| self.mesh.on[p as usize].contains(f))
                    && (0..4).any(|i| self.inside(*f as usize, self.mesh.face(t, i)))
            });
            let Some(f) = common else { continue };
            if self.mesh.points.len() > most {
                return Err(self.unreachable(self.mesh.corners(t)[0]));
            }
            let corners = self.mesh.corners(t);
            let facet = &self.complex.facets[f as usize];
            let middle = [0, 1, 2].map(|k| corners.iter().map(|c| c[k]).sum::<f64>() / 4.0);
            let middle = facet.raise(facet.flat(middle));
            let size = ids.iter().fold(f64::INFINITY, |s, &p| s.min(self.sizes[p as usize]));
            self.add(middle, &[f], size)?;
        }
        Ok(())
    }

    /// Marks what has to stay.
    fn keep(&mut self) {
        for &(ends, segment) in &self.subs {
            self.mesh.kept.insert(sorted(ends[0], ends[1]), segment);
        }
        for t in 0..self.mesh.tets.len() {
            if !self.mesh.alive(t as u32) {
                continue;
            }
            for i in 0..4 {
                let ids = self.mesh.face(t as u32, i);
                let [a, b, c] = ids.map(|p| p as usize);
                let wall = self.mesh.on[a].iter().copied().find(|f| {
                    self.mesh.on[b].contains(f)
                        && self.mesh.on[c].contains(f)
                        && self.inside(*f as usize, ids)
                });
                self.mesh.walls[t][i] = wall.map_or(0, |f| f + 1);
            }
        }
    }
}
