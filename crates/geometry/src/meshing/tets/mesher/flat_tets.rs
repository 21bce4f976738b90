//! Removal of flat tetrahedra after refinement: by flips, by adding points and by moving points.
//!
//! In a tetrahedron whose faces meet at almost 180 degrees, any difference between the fluxes through its two
//! sides has to leave sideways through a tiny area. A single large one, a thousand times as wide as high, can
//! ruin the lower bound.

use super::boundary_recovery::MeshInProgress;
use super::delaunay::Insertion;
use super::flat_clusters::{FLAT_ANGLE, GAIN};
use super::{Point, Sizing};
use crate::meshing::tets::tetrahedron::{EDGES, angle_below_flat, roundness};
use elastocap_linalg::vector::{length, minus, normal};
use std::collections::{BTreeSet, HashSet};

/// Tetrahedra less round than this get a new point. Tuned:
/// `cargo run --release -p elastocap-geometry --example mesh_surfaces -- FILE.obj`.
const FLAT: f64 = 0.01;

/// Tetrahedra less round than this have no volume up to rounding. It is not tuned.
const NO_VOLUME: f64 = 1e-10;

/// Rounds over all flat tetrahedra; the last one only checks whether any remains. It is not tuned.
const ROUNDS: i32 = 10;

/// The largest number of tetrahedra whose corners are moved because nothing else has helped. After that, no
/// corners are moved and no flat clusters replaced. Not tuned: a limit that ordinary cases do not reach.
const MAX_FAILURES: usize = 1000;

impl MeshInProgress {
    /// Flips each tetrahedron that is still flat, or adds a point near it, or moves its corners.
    ///
    /// # Errors
    ///
    /// A corner of a tetrahedron that remains without volume, m.
    pub(super) fn remove_flat_tets(&mut self, sizing: &Sizing) -> Result<(), Point> {
        // Where nothing has changed since the round before, nothing is tried again.
        let mut changed: Option<HashSet<u32>> = None;
        let mut failures = 0;
        for round in 0..ROUNDS {
            let mut without_volume = None;
            // The corners of tetrahedra that have changed in this round.
            let mut touched = BTreeSet::new();
            for t in 0..self.mesh.tets.len() as u32 {
                if !self.mesh.alive(t) || self.mesh.regions[t as usize].is_conductor() || self.cancelled() {
                    continue;
                }
                let corners = self.mesh.corners(t);
                let roundness_before = roundness(corners);
                if roundness_before > FLAT && angle_below_flat(corners) > FLAT_ANGLE {
                    continue;
                }
                if roundness_before < NO_VOLUME {
                    without_volume = Some(corners[0]);
                }
                let ids = self.mesh.tets[t as usize];
                let is_unchanged =
                    changed.as_ref().is_some_and(|changed| !ids.iter().any(|p| changed.contains(p)));
                if is_unchanged || round + 1 == ROUNDS {
                    continue;
                }
                let is_flat = angle_below_flat(corners) <= FLAT_ANGLE;
                let before = self.mesh.points.len();
                let mut is_replaced = is_flat && self.flip_flat(t, GAIN);
                if !is_replaced && before < sizing.max_points {
                    is_replaced = self.add_point_at(t, round, sizing)
                        || (is_flat && failures < MAX_FAILURES && self.replace_flat(t, sizing.growth));
                    let mut moved = Vec::new();
                    if !is_replaced && is_flat && failures < MAX_FAILURES {
                        failures += 1;
                        moved = self.move_corners(t);
                    }
                    if !is_replaced && moved.is_empty() && roundness_before <= FLAT {
                        is_replaced = self.add_point(t, off_centre(corners, round), roundness_before, sizing);
                    }
                    touched.extend(moved);
                }
                if is_replaced {
                    touched.extend(self.mesh.new_tets.iter().flat_map(|&n| self.mesh.tets[n as usize]));
                }
            }
            if round + 1 == ROUNDS || touched.is_empty() {
                return without_volume.map_or(Ok(()), Err);
            }
            // The first eight points are the corners of the box.
            let points: Vec<u32> = touched.iter().copied().filter(|&p| p >= 8).collect();
            let moved = self.smooth_points(&points);
            changed = Some(touched.into_iter().chain(moved).collect());
        }
        Ok(())
    }

    /// Adds a point in a tetrahedron that is not round, or above its kept faces. Returns whether that was
    /// possible.
    fn add_point_at(&mut self, t: u32, round: i32, sizing: &Sizing) -> bool {
        let corners = self.mesh.corners(t);
        let roundness_before = roundness(corners);
        if roundness_before > FLAT {
            return false;
        }
        let mut places = self.places_above_kept_faces(t);
        // Where kept faces leave no room for rounder ones, the tetrahedron stays as it is.
        let middle = off_centre(corners, round);
        places.extend([FLAT, 0.1 * FLAT].map(|least| (middle, least)));
        // Tetrahedra that are hardly rounder would only be split again.
        places.retain(|(_, least)| *least >= 10.0 * roundness_before);
        places.into_iter().any(|(at, least)| self.add_point(t, at, least, sizing))
    }

    /// Adds a point in place of a tetrahedron if all new tetrahedra are rounder than `least`. Returns whether
    /// they are.
    fn add_point(&mut self, t: u32, at: Point, least: f64, sizing: &Sizing) -> bool {
        let ids = self.mesh.tets[t as usize];
        self.mesh.min_quality = least;
        self.mesh.must_remove = Some(t);
        let is_inserted = self.mesh.insert(&Insertion::free(at, t)).is_ok();
        self.mesh.must_remove = None;
        self.mesh.min_quality = f64::NEG_INFINITY;
        if is_inserted {
            self.sizes.push(self.size_at(at, &ids, sizing.growth));
        }
        is_inserted
    }

    /// Places for a point, m, at some distance from the kept faces of a flat tetrahedron, each with the least
    /// roundness wanted of new tetrahedra there. In a valley between two faces that are almost in one plane,
    /// no point is far enough from both.
    fn places_above_kept_faces(&self, t: u32) -> Vec<(Point, f64)> {
        let corners = self.mesh.corners(t);
        let mut up = [0.0; 3];
        for i in (0..4).filter(|&i| self.mesh.kept_face(t, i).is_some()) {
            let across = normal(self.mesh.face(t, i).map(|p| self.mesh.points[p as usize]));
            up = [0, 1, 2].map(|k| up[k] + across[k]);
        }
        let size = length(up);
        if size == 0.0 {
            return Vec::new();
        }
        let edges = EDGES.iter().map(|&[i, j]| length(minus(corners[i], corners[j])));
        let shortest = edges.fold(f64::INFINITY, f64::min);
        let middle = [0, 1, 2].map(|k| corners.iter().map(|c| c[k]).sum::<f64>() / 4.0);
        let place = |height: f64| [0, 1, 2].map(|k| middle[k] + height * shortest * up[k] / size);
        [(1.0, FLAT), (0.5, FLAT), (0.25, FLAT), (0.5, 0.1 * FLAT), (0.1, 0.1 * FLAT)]
            .map(|(height, least)| (place(height), least))
            .to_vec()
    }
}

/// A point a little off the centroid of a tetrahedron, m, at another place each round.
fn off_centre(corners: [Point; 4], round: i32) -> Point {
    let weights = [0, 1, 2, 3].map(|k| 1.0 + 0.1 * f64::from((k + round) % 4));
    let sum: f64 = weights.iter().sum();
    [0, 1, 2].map(|a| (0..4).map(|k| weights[k] * corners[k][a]).sum::<f64>() / sum)
}
