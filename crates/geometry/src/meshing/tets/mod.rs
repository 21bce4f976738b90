//! Conforming meshes of tetrahedra.

mod beyond_mesh;
mod bisect;
mod boxes;
#[cfg(test)]
mod checks;
mod faces;
mod grading;
mod layered;
#[cfg(test)]
mod layered_tests;
mod mesher;
#[cfg(test)]
mod mirror_tests;
mod reflect;

pub use bisect::Bisected;
pub use boxes::of_boxes;
pub use grading::Grading;
pub use layered::{LayeredError, LayeredSizing, layered};
pub use mesher::{MeshError, Meshed, Quality, Sizing, mesh};
pub(crate) use mesher::{bounds, flat_parts};
pub use reflect::Reflected;

/// What holds on a face of the mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FaceRole {
    /// On the conductor with this index; the mesh has no tetrahedra in conductors, but on both sides of a sheet.
    Conductor(u32),
    /// On an outer wall at potential zero.
    Grounded,
    /// Where the mesh ends and open space goes on, along straight rays from [`TetMesh::center`]; the face sees the centre from
    /// its inner side.
    Open {
        /// Smallest and largest relative permittivity that rays through the face meet beyond it.
        permittivity: [f64; 2],
    },
}

/// A face with something to hold on it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoundaryFace {
    /// Its corners, in any order.
    pub face: [u32; 3],
    /// What holds there.
    pub role: FaceRole,
}

/// A conforming mesh of the space around the conductors: two tetrahedra share a face, an edge, a corner, or nothing.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TetMesh {
    /// m. Every point belongs to a tetrahedron.
    pub points: Vec<[f64; 3]>,
    /// Corners of the tetrahedra: det(p1 - p0, p2 - p0, p3 - p0) > 0.
    pub tets: Vec<[u32; 4]>,
    /// What each tetrahedron is filled with: 0 for the background, 1 + k for dielectric k of the scene.
    pub regions: Vec<u32>,
    /// Faces on conductors, grounded walls and at open space. Through every other outer face goes no flux.
    pub boundary: Vec<BoundaryFace>,
    /// From where the rays of open space start, m; of no meaning where there is none.
    pub center: [f64; 3],
}

impl TetMesh {
    /// Six times the volume of tetrahedron `t`, m^3: positive.
    pub fn determinant(&self, t: usize) -> f64 {
        let [a, b, c, d] = self.tets[t].map(|p| self.points[p as usize]);
        determinant(a, b, c, d)
    }
}

/// det(b - a, c - a, d - a).
pub fn determinant(a: [f64; 3], b: [f64; 3], c: [f64; 3], d: [f64; 3]) -> f64 {
    let [u, v, w] = [b, c, d].map(|p| [p[0] - a[0], p[1] - a[1], p[2] - a[2]]);
    u[0] * (v[1] * w[2] - v[2] * w[1])
        + u[1] * (v[2] * w[0] - v[0] * w[2])
        + u[2] * (v[0] * w[1] - v[1] * w[0])
}
