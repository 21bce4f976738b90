//! Delaunay refinement: new points where tetrahedra are too large or too elongated.
//!
//! The point is the circumcentre of such a tetrahedron; if it encroaches upon a kept face or edge, that face
//! or edge is split instead (Ruppert, J. Algorithms 18, 1995; Shewchuk, Proc. 14th Symp. Comput. Geom.,
//! 1998).

use super::boundary_recovery::MeshInProgress;
use super::delaunay::{
    Encroachment, FlatTets, Insertion, Refusal, TetFace, circumcenter, circumsphere_center, sorted,
};
use super::{Point, Sizing};
use crate::meshing::tets::tetrahedron::{EDGES, roundness};
use elastocap_linalg::vector::{length, minus};
use std::collections::VecDeque;

/// The ratio of the growth of sizes towards points of walls and dielectrics to that elsewhere. With 1.0 a
/// comb and a spiral have a tenth to a quarter more unknowns; without such a limit a pair beside its mirror
/// plane has 2.6 times as many. Measured: the unknowns of `elastocap run cases/spiral.toml` with
/// `solver = "tetrahedra"`.
const WALL_GROWTH: f64 = 2.0;

/// The least distance of a new point from other points, relative to the radius of the circumsphere whose
/// centre it is. It is not tuned.
const LEAST_DISTANCE: f64 = 0.01;

/// The distance between two points, m.
fn distance(a: Point, b: Point) -> f64 {
    length(minus(a, b))
}

impl MeshInProgress {
    /// The element size wanted at a new point, from those at points next to it, m.
    pub(super) fn size_at(&self, p: Point, points: &[u32], growth: f64) -> f64 {
        points.iter().fold(f64::INFINITY, |size, &q| {
            size.min(self.sizes[q as usize] + growth * distance(p, self.mesh.points[q as usize]))
        })
    }

    /// The place of a new point, m, for a tetrahedron that is too large, too elongated or too flat: its
    /// circumcentre, or its centroid if that is too far away. `None` for a tetrahedron that meets the
    /// requirements, lies in a conductor or has been removed.
    fn refinement_point(&self, t: u32, sizing: &Sizing) -> Option<Point> {
        if !self.mesh.alive(t) || self.mesh.regions[t as usize].is_conductor() {
            return None;
        }
        let corners = self.mesh.corners(t);
        let center = circumsphere_center(corners);
        let radius = distance(center, corners[0]);
        let size = self.smallest_size(&self.mesh.tets[t as usize]);
        let (mut shortest, mut longest) = (f64::INFINITY, 0.0_f64);
        for i in 0..4 {
            for j in 0..i {
                shortest = shortest.min(distance(corners[i], corners[j]));
                longest = longest.max(distance(corners[i], corners[j]));
            }
        }
        // The circumcentre of four points nearly in a plane may be anywhere.
        if !radius.is_finite() || radius >= 100.0 * longest {
            let centroid = [0, 1, 2].map(|k| corners.iter().map(|c| c[k]).sum::<f64>() / 4.0);
            return (longest > 0.5 * size).then_some(centroid);
        }
        let is_flat = roundness(corners) < 0.05 && radius > 0.4 * size;
        let is_large = radius > size + sizing.growth * radius;
        let is_long = radius > sizing.radius_to_edge * shortest && radius > 0.05 * size;
        (is_large || is_long || is_flat).then_some(center)
    }

    /// Sets the sizes at points of walls and dielectrics by their distances from other points along edges.
    /// Corners of walls have no size at first, and faces with such corners only would not be split, however
    /// near a conductor is. Conductors keep the sizes that their shape requires.
    fn grade_sizes(&mut self, growth: f64) {
        let mut neighbours: Vec<Vec<u32>> = vec![Vec::new(); self.mesh.points.len()];
        let mut on_conductor = vec![false; self.mesh.points.len()];
        for t in (0..self.mesh.tets.len() as u32).filter(|&t| self.mesh.alive(t)) {
            let ids = self.mesh.tets[t as usize];
            for [i, j] in EDGES {
                neighbours[ids[i] as usize].push(ids[j]);
                neighbours[ids[j] as usize].push(ids[i]);
            }
            if self.mesh.regions[t as usize].is_conductor() {
                ids.iter().for_each(|&p| on_conductor[p as usize] = true);
            }
        }
        let mut queue: VecDeque<u32> = (0..self.mesh.points.len() as u32).collect();
        while let Some(p) = queue.pop_front() {
            for &q in &neighbours[p as usize] {
                let apart = distance(self.mesh.points[p as usize], self.mesh.points[q as usize]);
                let graded = self.sizes[p as usize] + growth * apart;
                if !on_conductor[q as usize] && graded < self.sizes[q as usize] {
                    self.sizes[q as usize] = graded;
                    queue.push_back(q);
                }
            }
        }
    }

    /// Refines until sizes and shapes meet the requirements; `false` if the limit on points or a cancellation
    /// came first.
    pub(super) fn refine(&mut self, sizing: &Sizing) -> bool {
        self.grade_sizes(WALL_GROWTH * sizing.growth);
        let mut queue: VecDeque<u32> = (0..self.mesh.tets.len() as u32).collect();
        while let Some(t) = queue.pop_front() {
            let Some(at) = self.refinement_point(t, sizing) else { continue };
            if self.mesh.points.len() >= sizing.max_points || self.cancelled() {
                return false;
            }
            let before = self.mesh.points.len();
            let ids = self.mesh.tets[t as usize];
            self.mesh.must_remove = Some(t);
            // A mesh with kept faces is not Delaunay, so a circumcentre may lie next to an existing point.
            // The new tetrahedra would be long again, and refining them would never end.
            let apart = LEAST_DISTANCE * distance(at, self.mesh.points[ids[0] as usize]);
            let encroachment = Encroachment::Refuse;
            let result = self.mesh.insert(&Insertion { encroachment, apart, ..Insertion::free(at, t) });
            self.mesh.must_remove = None;
            match result {
                Ok(_) => self.sizes.push(self.size_at(at, &ids, sizing.growth)),
                Err(Refusal::MissesTarget) => {
                    if let Some(face) = self.mesh.kept_face_towards(t, at) {
                        self.split_face(face, sizing);
                    }
                }
                Err(Refusal::BehindKeptFace(face) | Refusal::NearKeptFace(face)) => {
                    self.split_face(face, sizing);
                }
                Err(Refusal::KeptEdge(edge)) => self.split_edge(edge, sizing),
                Err(Refusal::Outside | Refusal::Duplicate(_) | Refusal::Degenerate) => {}
            }
            if self.mesh.points.len() > before {
                queue.extend(&self.mesh.new_tets);
                if self.mesh.alive(t) && self.mesh.tets[t as usize] == ids {
                    queue.push_back(t);
                }
            }
        }
        true
    }

    /// Adds the circumcentre of a kept face, or splits a kept edge in its way. Small faces stay as they are.
    fn split_face(&mut self, face: TetFace, sizing: &Sizing) {
        let TetFace { tet, opposite } = face;
        let ids = self.mesh.face(tet, opposite);
        let corners = ids.map(|p| self.mesh.points[p as usize]);
        let Some(f) = self.mesh.kept_face(tet, opposite) else { return };
        let Some(center) = circumcenter(corners) else { return };
        if distance(center, corners[0]) < 0.25 * self.smallest_size(&ids) {
            return;
        }
        let at = self.complex.facets[f as usize].nearest(center);
        self.mesh.min_quality = self.least_roundness;
        let result = self.mesh.insert(&Insertion {
            at,
            hint: tet,
            facets: &[f],
            splits: None,
            flat_tets: FlatTets::Avoid,
            encroachment: Encroachment::Refuse,
            apart: 0.0,
        });
        self.mesh.min_quality = f64::NEG_INFINITY;
        match result {
            Ok(_) => self.sizes.push(self.size_at(at, &ids, sizing.growth)),
            Err(Refusal::KeptEdge(edge)) => self.split_edge(edge, sizing),
            // The circumcentre lies beyond an edge of the facet.
            Err(Refusal::BehindKeptFace(_) | Refusal::Outside) => {
                let longest = [[0, 1], [1, 2], [2, 0]]
                    .map(|[a, b]| sorted(ids[a], ids[b]))
                    .into_iter()
                    .filter(|e| self.mesh.kept_edges.contains_key(e))
                    .max_by(|a, b| self.length(*a).total_cmp(&self.length(*b)));
                if let Some(edge) = longest {
                    self.split_edge(edge, sizing);
                }
            }
            Err(
                Refusal::Duplicate(_)
                | Refusal::NearKeptFace(_)
                | Refusal::MissesTarget
                | Refusal::Degenerate,
            ) => {}
        }
    }

    /// The length of an edge, m.
    fn length(&self, ends: [u32; 2]) -> f64 {
        distance(self.mesh.points[ends[0] as usize], self.mesh.points[ends[1] as usize])
    }

    /// Splits a kept edge, given by its ascending ends. Short edges stay as they are.
    fn split_edge(&mut self, [a, b]: [u32; 2], sizing: &Sizing) {
        let Some(&segment) = self.mesh.kept_edges.get(&[a, b]) else { return };
        if self.length([a, b]) < 0.5 * self.smallest_size(&[a, b]) {
            return;
        }
        let at = self.split_point([a, b]);
        let star = self.mesh.star(a);
        let Some(&hint) = star.iter().find(|&&t| self.mesh.tets[t as usize].contains(&b)) else { return };
        self.mesh.min_quality = self.least_roundness;
        let result = self.mesh.insert(&Insertion {
            at,
            hint,
            facets: &self.segments[segment as usize],
            splits: Some(segment),
            flat_tets: FlatTets::Avoid,
            encroachment: Encroachment::Allow,
            apart: 0.0,
        });
        self.mesh.min_quality = f64::NEG_INFINITY;
        if let Ok(v) = result {
            self.sizes.push(self.size_at(at, &[a, b], sizing.growth));
            self.mesh.kept_edges.remove(&[a, b]);
            self.mesh.kept_edges.insert(sorted(a, v), segment);
            self.mesh.kept_edges.insert(sorted(v, b), segment);
        }
    }
}
