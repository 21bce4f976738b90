//! Moves of points so that the worst tetrahedra become better.

use super::Point;
use super::boundary_recovery::MeshInProgress;
use super::flat_clusters::FLAT_ANGLE;
use crate::meshing::tets::tetrahedron::{angle_below_flat, roundness};
use elastocap_linalg::vector::{length, minus};

/// Points move only where a tetrahedron is less round than this. Tuned:
/// `cargo run --release -p elastocap-geometry --example mesh_surfaces -- FILE.obj`.
const ROUND_ENOUGH: f64 = 0.3;

/// Rounds of moves of the corners of a flat tetrahedron. Tuned:
/// `cargo run --release -p elastocap-geometry --example mesh_surfaces -- FILE.obj`.
const MOVES: usize = 8;

/// Lengths of the moves, over the distance of the nearest other point. Tuned:
/// `cargo run --release -p elastocap-geometry --example mesh_surfaces -- FILE.obj`.
const STEPS: [f64; 6] = [1.0, 0.5, 0.25, 0.1, 0.04, 0.01];

/// Points do not move nearer to another point than this, over the wanted element size: tetrahedra at
/// coincident points may have good angles. It is not tuned.
const LEAST_DISTANCE: f64 = 0.02;

/// Number of directions in which points move. Tuned:
/// `cargo run --release -p elastocap-geometry --example mesh_surfaces -- FILE.obj`.
const DIRECTIONS: u32 = 64;

/// A unit vector out of [`DIRECTIONS`] that are distributed evenly: points on a spiral around the sphere.
fn direction(k: u32) -> Point {
    let z = (2.0 * f64::from(k) + 1.0) / f64::from(DIRECTIONS) - 1.0;
    let turn = f64::from(k) * std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let r = (1.0 - z * z).sqrt();
    [r * turn.cos(), r * turn.sin(), z]
}

impl MeshInProgress {
    /// Moves those corners of a flat tetrahedron that lie on no facet, in many directions, so that the
    /// largest angle between faces of the tetrahedra at each becomes smaller. Returns the corners that moved,
    /// some of them more than once.
    pub(super) fn move_corners(&mut self, t: u32) -> Vec<u32> {
        let mut moved = Vec::new();
        for _ in 0..MOVES {
            for v in self.mesh.tets[t as usize] {
                // The first eight points are the corners of the box.
                if v < 8 || !self.mesh.facets_of_point[v as usize].is_empty() {
                    continue;
                }
                let at = self.mesh.points[v as usize];
                let star = self.mesh.star(v);
                let mut others: Vec<u32> =
                    star.iter().flat_map(|&t| self.mesh.tets[t as usize]).filter(|&q| q != v).collect();
                others.sort_unstable();
                others.dedup();
                let nearest_to = |p: Point| {
                    let distances = others.iter().map(|&q| length(minus(self.mesh.points[q as usize], p)));
                    distances.fold(f64::INFINITY, f64::min)
                };
                let nearest = nearest_to(at);
                let least = nearest.min(LEAST_DISTANCE * self.sizes[v as usize]);
                let offsets: Vec<Point> = STEPS
                    .iter()
                    .flat_map(|step| (0..DIRECTIONS).map(move |k| direction(k).map(|x| step * nearest * x)))
                    .filter(|offset| nearest_to([0, 1, 2].map(|k| at[k] + offset[k])) >= least)
                    .collect();
                if self.mesh.improve(v, angle_below_flat, &offsets) {
                    moved.push(v);
                }
            }
            if angle_below_flat(self.mesh.corners(t)) > FLAT_ANGLE {
                break;
            }
        }
        moved
    }

    /// Moves points that lie on no facet so that the least round tetrahedron at each becomes rounder.
    pub(super) fn smooth(&mut self) {
        let points: Vec<u32> = (8..self.mesh.points.len() as u32).collect();
        self.smooth_points(&points);
    }

    /// Moves those of `points` that lie on no facet so that the least round tetrahedron at each becomes
    /// rounder. Returns those that were moved, some of them more than once.
    pub(super) fn smooth_points(&mut self, points: &[u32]) -> Vec<u32> {
        let mut moved = Vec::new();
        for round in 0..4 {
            for &v in points {
                if self.cancelled() {
                    return moved;
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
                if self.mesh.improve(v, roundness, &offsets) {
                    moved.push(v);
                }
            }
        }
        moved
    }
}
