//! Adding points until every segment consists of edges and every facet of faces of the triangulation.
//!
//! Segments that are missing are split. A facet is compared with the two-dimensional Delaunay triangulation of its points:
//! where a triangle of it is no face of a tetrahedron, the centre of its circumcircle becomes a point, or a segment is split if
//! that centre encroaches upon it (Shewchuk, Proc. 14th Symp. Comput. Geom., 1998).

use super::delaunay::{Delaunay, Encroachment, FACES, FlatTets, Insertion, Refusal, circumcenter, sorted};
use super::piecewise_linear_complex::{PiecewiseLinearComplex, Seed};
use super::{MeshError, Point, Sizing};
use crate::meshing::indices::OptionalIndex;
use crate::meshing::plane::delaunay_triangles;
use elastocap_linalg::vector::{length, minus};
use std::collections::HashSet;

/// A segment is not split into parts shorter than this share of its length.
const SHORTEST: f64 = 1e-5;

/// A part of a segment.
#[derive(Debug, Clone, Copy)]
struct Subsegment {
    ends: [u32; 2],
    /// The segment, by its place in [`MeshInProgress::segments`].
    segment: u32,
}

/// The triangulation and the complex that it has to contain.
#[derive(Debug)]
pub(super) struct MeshInProgress {
    pub(super) mesh: Delaunay,
    pub(super) complex: PiecewiseLinearComplex,
    /// The element size wanted at each point of the mesh, m.
    pub(super) sizes: Vec<f64>,
    /// The facets on which each segment lies.
    pub(super) segments: Vec<Vec<u32>>,
    /// The length of each segment, m.
    lengths: Vec<f64>,
    subsegments: Vec<Subsegment>,
    points_of_facet: Vec<Vec<u32>>,
    /// Points below this number come from the scene; the mesher added those from it on.
    first_added: u32,
    /// A tetrahedron at the last point, where the search for the next one starts.
    last_tet: u32,
}

/// The place of a point on a space-filling curve: points with near places are near in space (Morton order).
fn morton_code(p: Point, min: Point, max: Point) -> u64 {
    let cell =
        [0, 1, 2].map(|a| (((p[a] - min[a]) / (max[a] - min[a])).clamp(0.0, 1.0) * 1_048_575.0) as u64);
    (0..20).fold(0, |code, bit| (0..3).fold(code, |code, a| code | (cell[a] >> bit & 1) << (3 * bit + a)))
}

impl MeshInProgress {
    /// The Delaunay triangulation of the points of a complex within a box.
    ///
    /// # Errors
    /// [`MeshError::Unreachable`] for a point that the triangulation cannot take.
    pub(super) fn new(complex: PiecewiseLinearComplex, min: Point, max: Point) -> Result<Self, MeshError> {
        let mesh = Delaunay::new(min, max);
        let mut out = Self {
            sizes: vec![f64::INFINITY; mesh.points.len()],
            mesh,
            segments: Vec::new(),
            lengths: Vec::new(),
            subsegments: Vec::new(),
            points_of_facet: vec![Vec::new(); complex.facets.len()],
            first_added: 0,
            last_tet: 0,
            complex,
        };
        let mut order: Vec<usize> = (0..out.complex.points.len()).collect();
        order.sort_by_cached_key(|&k| (morton_code(out.complex.points[k], min, max), k));
        let mut ids = vec![0; order.len()];
        // A point that would make tetrahedra flat within a facet is put off: among other points it may not.
        let mut put_off = Vec::new();
        for k in order {
            let p = out.complex.points[k];
            let facets = out.complex.facets_of_point[k].clone();
            let result = out.insert(p, &facets, FlatTets::Avoid);
            if result == Err(Refusal::Degenerate) {
                put_off.push(k);
            } else {
                ids[k] = out.record(result, p, &facets, out.complex.sizes[k])?;
            }
        }
        for k in put_off {
            let facets = out.complex.facets_of_point[k].clone();
            ids[k] = out.add(out.complex.points[k], &facets, out.complex.sizes[k])?;
        }
        for (ends, facets) in &out.complex.segments {
            let segment = out.segments.len() as u32;
            out.subsegments.push(Subsegment { ends: ends.map(|p| ids[p as usize]), segment });
            out.segments.push(facets.clone());
            let [a, b] = ends.map(|p| out.complex.points[p as usize]);
            out.lengths.push(length(minus(b, a)));
        }
        out.first_added = out.mesh.points.len() as u32;
        for k in 0..out.complex.seeds.len() {
            let Seed { at, size } = out.complex.seeds[k];
            if (0..3).all(|a| min[a] < at[a] && at[a] < max[a]) {
                out.add(at, &[], size)?;
            }
        }
        Ok(out)
    }

    fn unreachable(&self, at: Point) -> MeshError {
        MeshError::Unreachable { at, points: self.mesh.points.len() }
    }

    /// Adds a point on these facets to the triangulation, in which nothing is kept yet; if possible without flat tetrahedra.
    fn add(&mut self, p: Point, facets: &[u32], size: f64) -> Result<u32, MeshError> {
        let mut result = self.insert(p, facets, FlatTets::Avoid);
        if result == Err(Refusal::Degenerate) {
            result = self.insert(p, facets, FlatTets::Allow);
        }
        self.record(result, p, facets, size)
    }

    fn insert(&mut self, at: Point, facets: &[u32], flat_tets: FlatTets) -> Result<u32, Refusal> {
        let mut hint = self.last_tet;
        if !self.mesh.alive(hint) {
            hint = self.mesh.tet_at(self.mesh.points.len() as u32 - 1);
        }
        let encroachment = Encroachment::Allow;
        self.mesh.insert(&Insertion { at, hint, facets, splits: None, flat_tets, encroachment })
    }

    /// Records size and facets of a point that was inserted, or of the one that was at its place before.
    fn record(
        &mut self,
        result: Result<u32, Refusal>,
        p: Point,
        facets: &[u32],
        size: f64,
    ) -> Result<u32, MeshError> {
        let v = match result {
            Ok(v) => {
                self.sizes.push(size);
                v
            }
            Err(Refusal::Duplicate(v)) => {
                for f in facets {
                    if !self.mesh.facets_of_point[v as usize].contains(f) {
                        self.mesh.facets_of_point[v as usize].push(*f);
                    }
                }
                self.sizes[v as usize] = self.sizes[v as usize].min(size);
                v
            }
            Err(_) => return Err(self.unreachable(p)),
        };
        for &f in facets {
            if !self.points_of_facet[f as usize].contains(&v) || v < 8 {
                let list = &mut self.points_of_facet[f as usize];
                if list.last() != Some(&v) {
                    list.push(v);
                }
            }
        }
        self.last_tet = self.mesh.tet_at(v);
        Ok(v)
    }

    /// Where an edge of a segment is split, m: in the middle, or on a sphere of radius 2^k around its one end that comes from the
    /// scene, so that all segments that meet there are split at the same distance (Shewchuk's concentric shells).
    pub(super) fn split_point(&self, [a, b]: [u32; 2]) -> Point {
        let [p, q] = [a, b].map(|i| self.mesh.points[i as usize]);
        let given = [a, b].map(|i| i < self.first_added);
        let mut s = 0.5;
        if given[0] != given[1] {
            let length = (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt();
            let part = 2.0_f64.powi((0.5 * length).log2().round() as i32) / length;
            s = if given[0] { part } else { 1.0 - part };
        }
        [0, 1, 2].map(|k| if p[k] == q[k] { p[k] } else { p[k] + s * (q[k] - p[k]) })
    }

    /// The smallest element size wanted at any of the points, m.
    pub(super) fn smallest_size(&self, points: &[u32]) -> f64 {
        points.iter().fold(f64::INFINITY, |s, &p| s.min(self.sizes[p as usize]))
    }

    fn split_subsegment(&mut self, k: usize) -> Result<(), MeshError> {
        let Subsegment { ends: [a, b], segment } = self.subsegments[k];
        let p = self.split_point([a, b]);
        // Near a sharp corner every split may call for another one.
        let [from, to] = [a, b].map(|q| self.mesh.points[q as usize]);
        if length(minus(to, from)) < SHORTEST * self.lengths[segment as usize] {
            return Err(self.unreachable(p));
        }
        let facets = self.segments[segment as usize].clone();
        let v = self.add(p, &facets, self.smallest_size(&[a, b]))?;
        if v == a || v == b {
            return Err(self.unreachable(p));
        }
        self.subsegments[k].ends = [a, v];
        self.subsegments.push(Subsegment { ends: [v, b], segment });
        Ok(())
    }

    /// Splits subsegments until all of them are edges of the triangulation.
    fn recover_segments(&mut self, max_points: usize) -> Result<(), MeshError> {
        loop {
            let mut complete = true;
            for k in 0..self.subsegments.len() {
                let ends = self.subsegments[k].ends;
                if !self.mesh.has(&ends) {
                    complete = false;
                    if self.mesh.points.len() > max_points {
                        return Err(self.unreachable(self.mesh.points[ends[0] as usize]));
                    }
                    self.split_subsegment(k)?;
                }
            }
            if complete {
                return Ok(());
            }
        }
    }

    /// Triangles of the plane Delaunay triangulation of facet `f` that are no faces of tetrahedra.
    fn missing_triangles(&mut self, f: usize) -> Vec<[u32; 3]> {
        let points = self.points_of_facet[f].clone();
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
                    if ids[0] != v
                        || !ids.iter().all(|&p| self.mesh.facets_of_point[p as usize].contains(&name))
                    {
                        continue;
                    }
                    if there.insert(ids) && self.in_facet(f, ids) {
                        covered += self.area(f, ids);
                    }
                }
            }
        }
        let facet = &self.complex.facets[f];
        let flat: Vec<[f64; 2]> =
            points.iter().map(|&p| facet.project(self.mesh.points[p as usize])).collect();
        let mut whole = 0.0;
        let mut missing = Vec::new();
        for t in delaunay_triangles(&flat) {
            let mut ids = t.map(|k| points[k]);
            ids.sort_unstable();
            if self.in_facet(f, ids) {
                whole += self.area(f, ids);
                if !there.contains(&ids) {
                    missing.push(ids);
                }
            }
        }
        // Of four points on a circle either diagonal will do: if the faces cover the facet, none is missing.
        if (covered - whole).abs() <= 1e-9 * whole {
            missing.clear();
        }
        missing
    }

    /// The centroid of a triangle, m.
    fn centroid(&self, ids: [u32; 3]) -> Point {
        let [a, b, c] = ids.map(|p| self.mesh.points[p as usize]);
        [0, 1, 2].map(|k| (a[k] + b[k] + c[k]) / 3.0)
    }

    /// Whether a triangle in the plane of a facet lies within its polygons.
    fn in_facet(&self, f: usize, ids: [u32; 3]) -> bool {
        self.complex.facets[f].contains(self.centroid(ids))
    }

    /// The area of a triangle in projection to the plane of the facet, m^2: rounding may put its points a little off the plane.
    fn area(&self, f: usize, ids: [u32; 3]) -> f64 {
        let facet = &self.complex.facets[f];
        let [a, b, c] = ids.map(|p| facet.project(self.mesh.points[p as usize]));
        0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])).abs()
    }

    /// Adds points until every segment consists of edges and every facet of faces, which are kept from then on.
    ///
    /// # Errors
    /// [`MeshError::Unreachable`] if that takes too many points or too small parts.
    pub(super) fn recover_boundaries(&mut self, sizing: &Sizing) -> Result<(), MeshError> {
        let max_points = sizing.max_points;
        loop {
            self.recover_segments(max_points)?;
            let before = self.mesh.points.len();
            for f in 0..self.complex.facets.len() {
                for ids in self.missing_triangles(f) {
                    if self.mesh.points.len() > max_points {
                        return Err(self.unreachable(self.centroid(ids)));
                    }
                    self.recover_triangle(f, ids)?;
                }
            }
            if self.mesh.points.len() == before {
                self.split_tets_on_facets(max_points)?;
            }
            if self.mesh.points.len() == before {
                break;
            }
        }
        self.mark_kept();
        Ok(())
    }

    /// Adds the circumcentre of a triangle that is missing, or splits a segment upon which it encroaches.
    fn recover_triangle(&mut self, f: usize, ids: [u32; 3]) -> Result<(), MeshError> {
        let name = f as u32;
        let corners = ids.map(|p| self.mesh.points[p as usize]);
        let center = circumcenter(corners).unwrap_or_else(|| self.centroid(ids));
        let squared = |a: Point, b: Point| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>();
        let encroaches_on = |ends: [u32; 2]| {
            let [a, b] = ends.map(|p| self.mesh.points[p as usize]);
            squared(a, center) + squared(b, center) <= squared(a, b) * (1.0 + 1e-12)
        };
        // A point added in the same pass may lie in the circle; then the next pass sees what is missing still.
        let radius = squared(corners[0], center);
        let stale = |&p: &u32| squared(self.mesh.points[p as usize], center) < 0.8 * radius;
        if self.points_of_facet[f].iter().any(stale) {
            return Ok(());
        }
        let encroached = self
            .subsegments
            .iter()
            .position(|sub| self.segments[sub.segment as usize].contains(&name) && encroaches_on(sub.ends));
        if let Some(k) = encroached {
            return self.split_subsegment(k);
        }
        let facet = &self.complex.facets[f];
        let at = facet.nearest(if facet.contains(center) { center } else { self.centroid(ids) });
        self.add(at, &[name], self.smallest_size(&ids)).map(|_| ())
    }

    /// Adds a point in tetrahedra whose corners all lie on one facet: their faces on both sides would be kept, with nothing in
    /// between.
    fn split_tets_on_facets(&mut self, max_points: usize) -> Result<(), MeshError> {
        for t in 0..self.mesh.tets.len() as u32 {
            if !self.mesh.alive(t) {
                continue;
            }
            let ids = self.mesh.tets[t as usize];
            let common = self.mesh.facets_of_point[ids[0] as usize].iter().copied().find(|f| {
                ids[1..].iter().all(|&p| self.mesh.facets_of_point[p as usize].contains(f))
                    && (0..4).any(|i| self.in_facet(*f as usize, self.mesh.face(t, i)))
            });
            let Some(f) = common else { continue };
            if self.mesh.points.len() > max_points {
                return Err(self.unreachable(self.mesh.corners(t)[0]));
            }
            let corners = self.mesh.corners(t);
            let centroid = [0, 1, 2].map(|k| corners.iter().map(|c| c[k]).sum::<f64>() / 4.0);
            let at = self.complex.facets[f as usize].nearest(centroid);
            self.add(at, &[f], self.smallest_size(&ids))?;
        }
        Ok(())
    }

    /// Marks the edges of segments and the faces of facets as kept.
    fn mark_kept(&mut self) {
        for sub in &self.subsegments {
            self.mesh.kept_edges.insert(sorted(sub.ends[0], sub.ends[1]), sub.segment);
        }
        for t in 0..self.mesh.tets.len() {
            if !self.mesh.alive(t as u32) {
                continue;
            }
            for i in 0..4 {
                let ids = self.mesh.face(t as u32, i);
                let [a, b, c] = ids.map(|p| p as usize);
                let facet = self.mesh.facets_of_point[a].iter().copied().find(|f| {
                    self.mesh.facets_of_point[b].contains(f)
                        && self.mesh.facets_of_point[c].contains(f)
                        && self.in_facet(*f as usize, ids)
                });
                self.mesh.kept_faces[t][i] = facet.map_or(OptionalIndex::NONE, OptionalIndex::some);
            }
        }
    }
}
