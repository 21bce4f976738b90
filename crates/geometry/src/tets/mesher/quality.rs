//! How round tetrahedra are.

use super::delaunay::{EDGES, FACES, sphere_center};
use crate::tets::TetMesh;

/// Figures of the worst tetrahedra of a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quality {
    /// Smallest angle between two faces of a tetrahedron, degrees; 70.5 at best.
    pub smallest_angle: f64,
    /// Largest angle between two faces of a tetrahedron, degrees.
    pub largest_angle: f64,
    /// Largest radius of the sphere around a tetrahedron relative to its shortest edge; 0.61 at best.
    pub radius_to_edge: f64,
}

impl Quality {
    /// Of all tetrahedra of a mesh.
    pub fn of(mesh: &TetMesh) -> Self {
        let mut out = Self { smallest_angle: 180.0, largest_angle: 0.0, radius_to_edge: 0.0 };
        let minus = |a: [f64; 3], b: [f64; 3]| [0, 1, 2].map(|k| a[k] - b[k]);
        let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        for tet in &mesh.tets {
            let at = tet.map(|p| mesh.points[p as usize]);
            let normals = FACES.map(|f| {
                let (u, v) = (minus(at[f[1]], at[f[0]]), minus(at[f[2]], at[f[0]]));
                let n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
                let length = dot(n, n).sqrt();
                n.map(|x| x / length)
            });
            for [i, j] in EDGES {
                let angle = (-dot(normals[i], normals[j])).clamp(-1.0, 1.0).acos().to_degrees();
                out.smallest_angle = out.smallest_angle.min(angle);
                out.largest_angle = out.largest_angle.max(angle);
            }
            let length = |a: [f64; 3], b: [f64; 3]| dot(minus(a, b), minus(a, b)).sqrt();
            let shortest = EDGES.iter().fold(f64::INFINITY, |s, &[i, j]| s.min(length(at[i], at[j])));
            out.radius_to_edge = out.radius_to_edge.max(length(sphere_center(at), at[0]) / shortest);
        }
        out
    }
}
