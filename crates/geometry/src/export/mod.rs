//! Files that other programs open: the scene as glTF, the fields as VTK.
//!
//! Every function here returns the whole file in memory; the caller puts it on disk, whole or not at all.

pub mod body;
pub mod gltf;
pub mod surfaces;
mod unstructured;
pub mod vtk;
mod vtk_error;
