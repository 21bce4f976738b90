//! Files that other programs open: the scene as glTF, the fields as VTK.
//!
//! Every function here returns the whole file in memory; putting it on disk, whole or not at all, is the caller's.

pub mod body;
pub mod gltf;
pub mod surfaces;
pub mod vtk;
