//! Measures of the shapes of the tetrahedra of a mesh.

use super::delaunay::circumsphere_center;
use crate::meshing::tets::TetMesh;
use crate::meshing::tets::tetrahedron::{EDGES, FACES};
use elastocap_linalg::vector::{dot, length, minus, normal};

/// Shapes of the worst tetrahedra of a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quality {
    /// Smallest angle between two faces of a tetrahedron, degrees; 70.5 at best.
    pub smallest_angle: f64,
    /// Largest angle between two faces of a tetrahedron, degrees.
    pub largest_angle: f64,
    /// Largest circumradius of a tetrahedron relative to its shortest edge; 0.61 at best.
    pub radius_to_edge: f64,
}

impl Quality {
    /// The worst values of all tetrahedra of a mesh.
    pub fn of(mesh: &TetMesh) -> Self {
        let mut out = Self { smallest_angle: 180.0, largest_angle: 0.0, radius_to_edge: 0.0 };
        for tet in &mesh.tets {
            let corners = tet.map(|p| mesh.points[p as usize]);
            let normals = FACES.map(|f| {
                let n = normal(f.map(|k| corners[k]));
                n.map(|x| x / length(n))
            });
            for [i, j] in EDGES {
                let angle = (-dot(normals[i], normals[j])).clamp(-1.0, 1.0).acos().to_degrees();
                out.smallest_angle = out.smallest_angle.min(angle);
                out.largest_angle = out.largest_angle.max(angle);
            }
            let edge = |[i, j]: [usize; 2]| length(minus(corners[i], corners[j]));
            let shortest = EDGES.iter().fold(f64::INFINITY, |s, &ends| s.min(edge(ends)));
            out.radius_to_edge =
                out.radius_to_edge.max(length(minus(circumsphere_center(corners), corners[0])) / shortest);
        }
        out
    }
}
