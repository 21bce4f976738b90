//! Removing flat tetrahedra after refinement: by moving points, and by adding some.

use super::boundary_recovery::MeshInProgress;
use super::delaunay::{EDGES, Insertion};
use super::quality::roundness;
use super::{Point, Sizing};
use elastocap_linalg::vector::{length, minus, normal};

/// Tetrahedra less round than this get a point of their own.
const FLAT: f64 = 0.01;

/// Tetrahedra less round than this have no volume but for rounding.
const NO_VOLUME: f64 = 1e-10;

/// Points move only where a tetrahedron is less round than this.
const ROUND_ENOUGH: f64 = 0.3;

/// Rounds of adding points to flat tetrahedra, of which the last only looks whether any is left.
const ROUNDS: i32 = 6;

impl MeshInProgress {
    /// Adds a point near the centroid of each tetrahedron that is still flat, whatever is near it.
    ///
    /// # Errors
    ///
    /// A corner of a tetrahedron that remains without volume, m.
    pub(super) fn split_flat_tets(&mut self, sizing: &Sizing) -> Result<(), Point> {
        for round in 0..ROUNDS {
            let mut left = None;
            let before = self.mesh.points.len();
            for t in 0..self.mesh.tets.len() as u32 {
                if !self.mesh.alive(t) || self.mesh.regions[t as usize].is_conductor() || self.cancelled() {
                    continue;
                }
                let corners = self.mesh.corners(t);
                let own_roundness = roundness(corners);
                if own_roundness > FLAT {
                    continue;
                }
                if own_roundness < NO_VOLUME {
                    left = Some(corners[0]);
                }
                if round + 1 == ROUNDS {
                    continue;
                }
                let ids = self.mesh.tets[t as usize];
                let mut places = self.places_above_kept_faces(t);
                // A little off the centroid, and at another place each round.
                let weights = [0, 1, 2, 3].map(|k| 1.0 + 0.1 * f64::from((k + round) % 4));
                let sum: f64 = weights.iter().sum();
                let middle = [0, 1, 2].map(|a| (0..4).map(|k| weights[k] * corners[k][a]).sum::<f64>() / sum);
                // Where kept faces leave no room for rounder ones, the tetrahedron stays as it is.
                places.extend([FLAT, 0.1 * FLAT].map(|least| (middle, least)));
                // What is hardly rounder would only be split again.
                places.retain(|(_, least)| *least >= 10.0 * own_roundness);
                places.push((middle, own_roundness));
                for (at, least) in places {
                    self.mesh.min_roundness = least;
                    self.mesh.must_remove = Some(t);
                    let taken = self.mesh.insert(&Insertion::free(at, t)).is_ok();
                    self.mesh.must_remove = None;
                    self.mesh.min_roundness = f64::NEG_INFINITY;
                    if taken {
                        self.sizes.push(self.size_at(at, &ids, sizing.growth));
                        break;
                    }
                }
            }
            if round + 1 == ROUNDS || self.mesh.points.len() == before {
                return left.map_or(Ok(()), Err);
            }
            self.smooth();
        }
        Ok(())
    }

    /// Places for a point, m, at some distance from the kept faces of a flat tetrahedron, each with the least roundness wanted of
    /// new tetrahedra there. In a valley between two faces that are almost in one plane, no point is far enough from both.
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

    /// Moves points that lie on no facet so that the flattest tetrahedron at each becomes rounder.
    pub(super) fn smooth(&mut self) {
        for round in 0..4 {
            for v in 8..self.mesh.points.len() as u32 {
                if self.cancelled() {
                    return;
                }
                let t = self.mesh.tet_at(v);
                let fixed = !self.mesh.facets_of_point[v as usize].is_empty();
                if fixed || self.mesh.regions[t as usize].is_conductor() {
                    continue;
                }
                let star = self.mesh.star(v);
                let worst =
                    star.iter().map(|&t| roundness(self.mesh.corners(t))).fold(f64::INFINITY, f64::min);
                if worst > ROUND_ENOUGH {
                    continue;
                }
                let at = self.mesh.points[v as usize];
                let others: Vec<Point> = star
                    .iter()
                    .flat_map(|&t| self.mesh.tets[t as usize])
                    .filter(|&q| q != v)
                    .map(|q| self.mesh.points[q as usize])
                    .collect();
                let n = others.len() as f64;
                let to_mean = [0, 1, 2].map(|k| others.iter().map(|q| q[k]).sum::<f64>() / n - at[k]);
                let reach = others.iter().map(|&q| length(minus(q, at))).fold(f64::INFINITY, f64::min);
                let mut offsets = vec![to_mean, to_mean.map(|x| 0.5 * x)];
                let step = reach * [0.3, 0.2, 0.1, 0.05][round];
                for k in 0..3 {
                    for l in 0..3 {
                        for s in [-step, step] {
                            let mut d = [0.0; 3];
                            d[k] += s;
                            d[l] += step;
                            offsets.push(d);
                            offsets.push(d.map(|x| -x));
                        }
                    }
                }
                self.mesh.improve(v, roundness, &offsets);
            }
        }
    }
}
