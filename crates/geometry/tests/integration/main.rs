//! Meshes and surfaces read and written.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops by panicking")]

mod export_body;
mod export_gltf;
mod export_vtk;
mod import_gmsh;
mod import_obj;
