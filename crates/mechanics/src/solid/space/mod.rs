//! Finite elements in three dimensions: layers of finite width.

pub mod element;
pub mod layer;
pub mod material;
pub mod mesh;
