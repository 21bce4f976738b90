//! Finite elements.
pub mod material;
pub mod mesh;
pub mod sparse;
