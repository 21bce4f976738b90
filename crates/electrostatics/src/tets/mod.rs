//! Laplace's equation on tetrahedra: potentials for the upper bound, fluxes for the lower bound, and adaptive
//! refinement.

pub(crate) mod adaptive;
pub(crate) mod flux;
pub(crate) mod forecast;
mod marking;
pub(crate) mod mesh_scene;
mod one_mesh;
mod parity;
pub(crate) mod potentials;
mod refinement;
pub(crate) mod settings;
mod spread;
