//! Replacement of connected flat tetrahedra by others around a new point.
//!
//! Where a surface is nearly flat, its points span tetrahedra without much volume in the shallow valleys
//! between its faces, and in several layers where many faces meet. The circumspheres of such tetrahedra may
//! lie anywhere, so that no point removes them by the Delaunay criterion. They are removed together, and the
//! hole is filled from one point at some height above the surface.

use super::Point;
use super::boundary_recovery::MeshInProgress;
use super::delaunay::Insertion;
use crate::meshing::tets::tetrahedron::{EDGES, Measure, angle_below_flat};
use elastocap_linalg::vector::{length, minus, normal};

/// A tetrahedron is flat if its largest angle between two faces is nearer to 180 degrees than this, rad.
/// Tuned: `cargo run --release -p elastocap-geometry --example mesh_surfaces -- FILE.obj`.
pub(super) const FLAT_ANGLE: f64 = 0.05;

/// The largest number of flat tetrahedra that a removal starts with. Not tuned: a limit that ordinary cases
/// do not reach.
const MAX_CLUSTER: usize = 60;

/// The wanted distances of the angles of the new tetrahedra from 180 degrees, rad, in the order in which they
/// are tried. Tuned: `cargo run --release -p elastocap-geometry --example mesh_surfaces -- FILE.obj`.
const WANTED: [f64; 4] = [0.3, 0.15, 0.07, 0.03];

/// Heights of the new point, over the length of the longest edge. Tuned:
/// `cargo run --release -p elastocap-geometry --example mesh_surfaces -- FILE.obj`.
const HEIGHTS: [f64; 8] = [0.5, 0.25, 0.12, 0.06, 0.03, 0.015, 0.007, 0.003];

/// The factor by which the angles of new tetrahedra must be farther from 180 degrees than those of the
/// tetrahedron that is removed. Tuned:
/// `cargo run --release -p elastocap-geometry --example mesh_surfaces -- FILE.obj`.
pub(super) const GAIN: f64 = 1.5;

impl MeshInProgress {
    /// Removes a flat tetrahedron, alone or with flat ones next to it, and fills the hole from a new point.
    /// Returns whether that was possible.
    pub(super) fn replace_flat(&mut self, t: u32, growth: f64) -> bool {
        let quality = angle_below_flat(self.mesh.corners(t));
        let cluster = self.flat_cluster(t);
        let places = self.places_over(&cluster, t);
        let ids = self.mesh.tets[t as usize];
        for least in WANTED.into_iter().filter(|least| *least > GAIN * quality) {
            for &at in &places {
                let Some(path) = self.mesh.tets_towards(t, at) else { continue };
                let mut cavity = path.clone();
                cavity.extend(cluster.iter().filter(|c| !path.contains(c)));
                for removed in [&cavity, &path] {
                    self.mesh.measure = Measure::AngleBelowFlat;
                    self.mesh.min_quality = least;
                    self.mesh.must_remove = Some(t);
                    let is_inserted = self.mesh.insert_instead_of(removed, &Insertion::free(at, t)).is_ok();
                    self.mesh.must_remove = None;
                    self.mesh.min_quality = f64::NEG_INFINITY;
                    self.mesh.measure = Measure::Roundness;
                    if is_inserted {
                        self.sizes.push(self.size_at(at, &ids, growth));
                        return true;
                    }
                    if cavity.len() == path.len() {
                        break;
                    }
                }
            }
        }
        false
    }

    /// A flat tetrahedron and the flat ones that are connected to it.
    fn flat_cluster(&self, t: u32) -> Vec<u32> {
        let mut out = vec![t];
        let mut next = 0;
        while next < out.len() {
            let t = out[next];
            next += 1;
            for i in 0..4 {
                if self.mesh.kept_face(t, i).is_none()
                    && let Some(n) = self.mesh.neighbour(t, i)
                    && out.len() < MAX_CLUSTER
                    && !out.contains(&n)
                    && angle_below_flat(self.mesh.corners(n)) < FLAT_ANGLE
                {
                    out.push(n);
                }
            }
        }
        out
    }

    /// Places for a point, m, at several distances from the kept faces of a cluster of tetrahedra: above the
    /// middle of its tetrahedron `t` and above the middle of them all. Where the cluster has no kept faces,
    /// the places are on both sides of these middles, in the direction of the normal of the largest face of
    /// `t`.
    fn places_over(&self, cluster: &[u32], t: u32) -> Vec<Point> {
        let mut up = [0.0; 3];
        for &t in cluster {
            for i in (0..4).filter(|&i| self.mesh.kept_face(t, i).is_some()) {
                let across = normal(self.mesh.face(t, i).map(|p| self.mesh.points[p as usize]));
                up = [0, 1, 2].map(|k| up[k] + across[k]);
            }
        }
        let mut signs: &[f64] = &[1.0];
        if length(up) == 0.0 {
            let normals =
                [0, 1, 2, 3].map(|i| normal(self.mesh.face(t, i).map(|p| self.mesh.points[p as usize])));
            up = normals.into_iter().fold(up, |best, n| if length(n) > length(best) { n } else { best });
            signs = &[1.0, -1.0];
        }
        let size = length(up);
        if size == 0.0 {
            return Vec::new();
        }
        let corners = |t: u32| self.mesh.corners(t);
        let middle = |t: u32| [0, 1, 2].map(|k| corners(t).iter().map(|c| c[k]).sum::<f64>() / 4.0);
        let longest = |t: u32| {
            EDGES.iter().map(|&[i, j]| length(minus(corners(t)[i], corners(t)[j]))).fold(0.0, f64::max)
        };
        let centre =
            [0, 1, 2].map(|k| cluster.iter().map(|&t| middle(t)[k]).sum::<f64>() / cluster.len() as f64);
        let reach = longest(t);
        let bases = if cluster.len() > 1 { vec![middle(t), centre] } else { vec![middle(t)] };
        let mut out = Vec::new();
        for height in HEIGHTS {
            for base in &bases {
                for sign in signs {
                    out.push([0, 1, 2].map(|k| base[k] + sign * height * reach * up[k] / size));
                }
            }
        }
        out
    }
}
