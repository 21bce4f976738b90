//! Laplace's equation on tetrahedra: potentials for the upper bound, fluxes for the lower bound, and adaptive refinement.

pub(crate) mod adaptive;
pub(crate) mod flux;
mod marking;
pub(crate) mod potentials;
