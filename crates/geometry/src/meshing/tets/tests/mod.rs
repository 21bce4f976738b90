//! Tests of several meshers together, and what they check of any mesh.

mod layered;
pub(super) mod mesh_checks;
mod mirror;
