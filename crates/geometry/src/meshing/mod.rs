//! Meshes: graded grids of boxes ([`grid`]), triangulations in the plane, and conforming meshes of tetrahedra
//! ([`tets`]).

pub mod grid;
mod indices;
pub mod plane;
pub mod tets;
