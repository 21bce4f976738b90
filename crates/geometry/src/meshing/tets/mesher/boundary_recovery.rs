//! Construction of a triangulation that contains a piecewise linear complex.
//!
//! Segments that are missing are split until all of them consist of edges; then facets are made out of faces
//! ([`super::facet_recovery`]).

use super::delaunay::{Delaunay, Encroachment, FlatTets, Insertion, Refusal, sorted};
use super::piecewise_linear_complex::{PiecewiseLinearComplex, Seed};
use super::{MeshError, Point, Sizing};
use elastocap_linalg::vector::{length, minus};
use std::cell::Cell;
use std::collections::BTreeSet;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A segment is not split into parts shorter than this share of its length. Not tuned: a limit that ordinary
/// cases do not reach.
const SHORTEST: f64 = 1e-5;

/// A part of a segment.
#[derive(Debug, Clone, Copy)]
struct Subsegment {
    /// The points at its ends.
    ends: [u32; 2],
    /// The index of its segment in [`MeshInProgress::segments`].
    segment: u32,
}

/// The approximate number of orientation tests that take as long as one insertion of a point. Many of the
/// tested points lie in the plane and need exact arithmetic. It only counts work towards a limit.
const ORIENTATIONS_PER_INSERTION: usize = 500;

/// The triangulation and the complex that it has to contain.
#[derive(Debug)]
pub(super) struct MeshInProgress {
    /// The triangulation.
    pub(super) mesh: Delaunay,
    /// The complex.
    pub(super) complex: PiecewiseLinearComplex,
    /// The element size wanted at each point of the mesh, m.
    pub(super) sizes: Vec<f64>,
    /// The facets on which each segment lies.
    pub(super) segments: Vec<Vec<u32>>,
    /// The length of each segment, m.
    lengths: Vec<f64>,
    /// The parts of all segments, until [`Self::recover_boundaries`] has made them edges that are kept.
    subsegments: Vec<Subsegment>,
    /// The points on each facet.
    points_of_facet: Vec<Vec<u32>>,
    /// The kept edges of the segments on each facet.
    edges_of_facet: Vec<BTreeSet<[u32; 2]>>,
    /// Points below this number come from the scene; the mesher added those from it on.
    first_added: u32,
    /// A tetrahedron at the last point, where the search for the next one starts.
    pub(super) last_tet: u32,
    /// The least roundness of tetrahedra that a point which refinement adds on a surface may make.
    pub(super) least_roundness: f64,
    /// The caller sets this to stop the mesher.
    cancel: Option<Arc<AtomicBool>>,
    /// See [`Sizing::most_insertions`].
    most_insertions: usize,
    /// Orientation tests that were made while cavities were filled.
    orientations: Cell<usize>,
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
    /// [`MeshError::Unreachable`] for a point that the triangulation cannot take, and
    /// [`MeshError::Cancelled`].
    pub(super) fn new(
        complex: PiecewiseLinearComplex,
        min: Point,
        max: Point,
        cancel: Option<Arc<AtomicBool>>,
        most_insertions: usize,
    ) -> Result<Self, MeshError> {
        let mesh = Delaunay::new(min, max);
        let mut out = Self {
            sizes: vec![f64::INFINITY; mesh.points.len()],
            mesh,
            segments: Vec::new(),
            lengths: Vec::new(),
            subsegments: Vec::new(),
            points_of_facet: vec![Vec::new(); complex.facets.len()],
            edges_of_facet: vec![BTreeSet::new(); complex.facets.len()],
            first_added: 0,
            last_tet: 0,
            least_roundness: f64::NEG_INFINITY,
            cancel,
            most_insertions,
            orientations: Cell::new(0),
            complex,
        };
        let mut order: Vec<usize> = (0..out.complex.points.len()).collect();
        order.sort_by_cached_key(|&k| (morton_code(out.complex.points[k], min, max), k));
        let mut ids = vec![0; order.len()];
        // A point that would make tetrahedra flat within a facet is inserted later, when other points may
        // prevent that.
        let mut put_off = Vec::new();
        for k in order {
            out.go_on()?;
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

    /// Counts orientation tests.
    pub(super) fn count_orientations(&self, more: usize) {
        self.orientations.set(self.orientations.get() + more);
    }

    /// Whether the caller has cancelled the mesher, or its limit of work is reached.
    pub(super) fn cancelled(&self) -> bool {
        self.mesh.insertions + self.orientations.get() / ORIENTATIONS_PER_INSERTION > self.most_insertions
            || self.cancel.as_ref().is_some_and(|cancel| cancel.load(Ordering::Relaxed))
    }

    /// Returns an error if the caller has cancelled the mesher, or if its limit of work is reached.
    ///
    /// # Errors
    /// [`MeshError::Cancelled`]
    pub(super) fn go_on(&self) -> Result<(), MeshError> {
        if self.cancelled() { Err(MeshError::Cancelled) } else { Ok(()) }
    }

    /// The error that the surfaces at a place cannot be built.
    pub(super) fn unreachable(&self, at: Point) -> MeshError {
        MeshError::Unreachable { at, points: self.mesh.points.len() }
    }

    /// Adds a point on these facets to the triangulation, in which nothing is kept yet; if possible without
    /// flat tetrahedra.
    fn add(&mut self, p: Point, facets: &[u32], size: f64) -> Result<u32, MeshError> {
        let mut result = self.insert(p, facets, FlatTets::Avoid);
        if result == Err(Refusal::Degenerate) {
            result = self.insert(p, facets, FlatTets::Allow);
        }
        self.record(result, p, facets, size)
    }

    /// Inserts a point on these facets into the triangulation, in which nothing is kept yet.
    fn insert(&mut self, at: Point, facets: &[u32], flat_tets: FlatTets) -> Result<u32, Refusal> {
        let mut hint = self.last_tet;
        if !self.mesh.alive(hint) {
            hint = self.mesh.tet_at(self.mesh.points.len() as u32 - 1);
        }
        let encroachment = Encroachment::Allow;
        self.mesh.insert(&Insertion { at, hint, facets, splits: None, flat_tets, encroachment, apart: 0.0 })
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

    /// The place where an edge of a segment is split, m: its middle, or, if one of its ends comes from the
    /// scene, a point on a sphere of radius 2^k around that end, so that all segments that meet there are
    /// split at the same distance (Shewchuk's concentric shells).
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

    /// Splits a subsegment in two.
    fn split_subsegment(&mut self, k: usize) -> Result<(), MeshError> {
        let Subsegment { ends: [a, b], segment } = self.subsegments[k];
        let p = self.split_point([a, b]);
        // Near a sharp corner every split may require another one.
        if self.is_short([a, b], segment) {
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
                    self.go_on()?;
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

    /// The centroid of a triangle, m.
    pub(super) fn centroid(&self, ids: [u32; 3]) -> Point {
        let [a, b, c] = ids.map(|p| self.mesh.points[p as usize]);
        [0, 1, 2].map(|k| (a[k] + b[k] + c[k]) / 3.0)
    }

    /// Whether a triangle in the plane of a facet lies within its polygons.
    fn in_facet(&self, f: usize, ids: [u32; 3]) -> bool {
        self.complex.facets[f].contains(self.centroid(ids))
    }

    /// Adds points until every segment consists of edges and every facet of faces, which are kept from then
    /// on.
    ///
    /// # Errors
    /// [`MeshError::Unreachable`] if that takes too many points or too small parts.
    pub(super) fn recover_boundaries(&mut self, sizing: &Sizing) -> Result<(), MeshError> {
        let max_points = sizing.max_points;
        loop {
            self.recover_segments(max_points)?;
            let before = self.mesh.points.len();
            self.split_tets_on_facets(max_points)?;
            if self.mesh.points.len() == before {
                break;
            }
        }
        self.keep_segments();
        self.recover_facets(max_points)
    }

    /// Adds a point in tetrahedra whose corners all lie on one facet: their faces on both sides would be
    /// kept, with nothing in between.
    fn split_tets_on_facets(&mut self, max_points: usize) -> Result<(), MeshError> {
        for t in 0..self.mesh.tets.len() as u32 {
            self.go_on()?;
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

    /// Marks the edges of segments as kept.
    fn keep_segments(&mut self) {
        for sub in std::mem::take(&mut self.subsegments) {
            let edge = sorted(sub.ends[0], sub.ends[1]);
            self.mesh.kept_edges.insert(edge, sub.segment);
            for &f in &self.segments[sub.segment as usize] {
                self.edges_of_facet[f as usize].insert(edge);
            }
        }
    }

    /// The kept edges of the segments on a facet.
    pub(super) fn kept_edges_of(&self, f: usize) -> &BTreeSet<[u32; 2]> {
        &self.edges_of_facet[f]
    }

    /// Records that a kept edge was split at the point `v`.
    pub(super) fn split_kept(&mut self, ends: [u32; 2], v: u32) {
        let Some(segment) = self.mesh.kept_edges.remove(&ends) else { return };
        let halves = ends.map(|end| sorted(end, v));
        self.mesh.kept_edges.extend(halves.map(|half| (half, segment)));
        for &f in &self.segments[segment as usize] {
            let edges = &mut self.edges_of_facet[f as usize];
            edges.remove(&ends);
            edges.extend(halves);
        }
    }

    /// Whether an edge of a segment is too short to be split.
    pub(super) fn is_short(&self, ends: [u32; 2], segment: u32) -> bool {
        let [a, b] = ends.map(|q| self.mesh.points[q as usize]);
        length(minus(b, a)) < SHORTEST * self.lengths[segment as usize]
    }

    /// The points on a facet.
    pub(super) fn points_of_facet(&self, f: usize) -> &[u32] {
        &self.points_of_facet[f]
    }

    /// Whether a point lies on a facet.
    pub(super) fn is_on(&self, p: u32, facet: u32) -> bool {
        self.mesh.facets_of_point[p as usize].contains(&facet)
    }

    /// Records facets and size of a new point.
    pub(super) fn note_point(&mut self, v: u32, facets: &[u32], size: f64) {
        self.sizes.push(size);
        facets.iter().for_each(|&f| self.points_of_facet[f as usize].push(v));
        self.last_tet = self.mesh.tet_at(v);
    }
}
