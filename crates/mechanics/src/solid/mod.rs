//! Finite elements.
pub mod element;
pub mod material;
pub mod mesh;
pub mod model;
pub mod newton;
pub mod obstacle;
pub mod sparse;
