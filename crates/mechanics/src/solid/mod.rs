//! Finite elements.
pub mod element;
pub mod material;
pub mod mesh;
pub mod obstacle;
pub mod sparse;
