//! Meshes: graded grids of boxes ([`grid`]), triangulations in the plane, and conforming meshes of tetrahedra ([`tets`]).

pub mod grid;
mod indices;
pub(crate) mod plane;
pub mod tets;
