//! Laplace's equation among axis-aligned boxes and sheets, on graded tensor-product grids, with proved bounds.

pub mod conductor_free;
pub mod domain;
pub mod dual;
pub mod energy;
pub mod field;
pub(crate) mod forecast;
pub mod grid_refinement;
mod grid_search;
pub mod layout;
pub mod primal;
pub mod ray_permittivity;
pub mod resolution;
pub mod schwarz;
pub mod solve;
pub mod symmetry;
