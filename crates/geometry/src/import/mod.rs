//! Shapes and meshes from the files of other programs, audited before anything is computed from them.
//!
//! [`obj`] and [`gmsh`] read files without trusting them: whatever the bytes, the answer is a valid shape or mesh, or an
//! [`ImportError`] that names the file, the place and the cure.

pub mod audit;
mod error;
pub mod gmsh;
pub(crate) mod intersect;
pub mod obj;
mod polygon;
mod triangles;

pub use error::{ImportError, ImportProblem, Place};
