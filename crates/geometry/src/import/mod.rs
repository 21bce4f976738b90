//! Shapes and meshes from the files of other programs, audited before anything is computed from them.
//!
//! A file is read by [`obj`] or [`gmsh`], never trusted: whatever its bytes are, the answer is a valid shape or an
//! [`ImportError`] that names the file, the place and the cure.

pub mod audit;
mod error;
pub mod gmsh;
pub(crate) mod intersect;
pub mod obj;
mod polygon;

pub use error::{ImportError, Place, Problem};
