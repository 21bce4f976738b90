//! The scene as axis-aligned bodies, the graded grid of it, and the files other programs open.

pub mod export;
pub mod import;
pub mod meshing;
pub mod mirror;
#[cfg(test)]
mod samples;
pub mod scene;
pub mod shapes;
pub mod winding;
