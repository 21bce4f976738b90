//! Meshes: graded grids of boxes, triangles in the plane, tetrahedra.

pub mod grid;
pub(crate) mod plane;
pub mod tets;
