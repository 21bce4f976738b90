//! Conforming meshes of tetrahedra: making them ([`mesh`] for bodies of any shape, [`layered`] for bodies in
//! layers, [`of_boxes`] from a grid), refining them ([`TetMesh::bisected_towards`]) and reflecting them
//! ([`TetMesh::reflected`]).

mod beyond_mesh;
mod bisection;
mod edge_grading;
mod grid_cells;
mod layered;
mod mesher;
mod reflection;
#[cfg(test)]
mod tests;
mod tetrahedron;

pub use bisection::Bisected;
pub use edge_grading::Grading;
pub use grid_cells::of_boxes;
pub use layered::{LayeredError, LayeredSizing, layered};
pub use mesher::{MeshError, Meshed, Quality, Sizing, mesh, mesh_unless};
pub(crate) use mesher::{bounds, flat_parts};
pub use reflection::Reflected;

/// The role of a face of the mesh: the condition on the field there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FaceRole {
    /// The face lies on the conductor with this index. There are no tetrahedra inside conductors, but on both
    /// sides of a sheet.
    Conductor(u32),
    /// The face lies on an outer wall at potential zero.
    Grounded,
    /// The mesh ends here and open space continues along straight rays from [`TetMesh::center`], which lies
    /// on the inner side of the face.
    Open {
        /// Smallest and largest relative permittivity that rays through the face can meet beyond it.
        permittivity: [f64; 2],
    },
}

/// A face of the mesh with a boundary condition.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoundaryFace {
    /// The corners, in any order.
    pub face: [u32; 3],
    /// The condition on the field there.
    pub role: FaceRole,
}

/// A conforming mesh of the space around the conductors: two tetrahedra have a whole face, an edge, a corner
/// or nothing in common.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TetMesh {
    /// Positions, m. Every point belongs to a tetrahedron.
    pub points: Vec<[f64; 3]>,
    /// Corners of the tetrahedra: det(p1 - p0, p2 - p0, p3 - p0) > 0.
    pub tets: Vec<[u32; 4]>,
    /// The material of each tetrahedron, as an index into tables of materials: 0 for the background, 1 + k
    /// for dielectric k.
    pub regions: Vec<u32>,
    /// Faces on conductors, on grounded walls and towards open space. No flux passes through any other outer
    /// face.
    pub boundary: Vec<BoundaryFace>,
    /// The start of the rays to infinity, m; unused without open space.
    pub center: [f64; 3],
}

impl TetMesh {
    /// Six times the volume of tetrahedron `t`, m^3: positive.
    pub fn determinant(&self, t: usize) -> f64 {
        let [a, b, c, d] = self.tets[t].map(|p| self.points[p as usize]);
        determinant(a, b, c, d)
    }
}

/// det(b - a, c - a, d - a), m^3: six times the volume of a tetrahedron.
pub fn determinant(a: [f64; 3], b: [f64; 3], c: [f64; 3], d: [f64; 3]) -> f64 {
    let [u, v, w] = [b, c, d].map(|p| [p[0] - a[0], p[1] - a[1], p[2] - a[2]]);
    u[0] * (v[1] * w[2] - v[2] * w[1])
        + u[1] * (v[2] * w[0] - v[0] * w[2])
        + u[2] * (v[0] * w[1] - v[1] * w[0])
}
