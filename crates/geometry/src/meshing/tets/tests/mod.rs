//! Tests of several meshers together, and checks for any mesh.

mod layered;
pub(super) mod mesh_checks;
mod mirror;
