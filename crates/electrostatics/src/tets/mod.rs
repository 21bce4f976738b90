//! Laplace's equation on tetrahedra: potentials and their upper bound, fluxes and their lower bound, and adaptive refinement.

pub mod adaptive;
pub mod flux;
pub mod potentials;
