//! Laplace's equation on tetrahedra: potentials for the upper bound, fluxes for the lower bound, and adaptive refinement.

pub(crate) mod adaptive;
pub(crate) mod flux;
pub(crate) mod forecast;
mod marking;
mod parity;
pub(crate) mod potentials;
mod refinement;
mod spread;
