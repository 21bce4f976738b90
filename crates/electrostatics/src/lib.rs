//! Laplace's equation in box scenes, and on tetrahedra: Maxwell capacitance matrices with proved bounds.

pub mod adapt;
pub mod ahead;
pub mod boxes;
pub mod domain;
pub mod dual;
pub mod energy;
pub mod field;
pub mod floating;
pub mod flux;
mod forecast;
pub mod general;
pub mod krylov;
pub mod layout;
pub mod matrix;
pub mod primal;
pub mod resolution;
pub mod schwarz;
mod search;
pub mod solution;
pub mod solve;
pub mod symmetry;
pub mod tets;

pub use solution::{
    Bounded, Field, FloatingPotential, Forecast, PhaseSeconds, ResolutionLevel, Settings, Solution, Target,
};

pub use forecast::forecast;
pub use solve::{EPS0, solve};

/// A solve that cannot be carried out.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SolveError {
    /// A 1D eigenproblem failed.
    #[error("an eigenvalue problem of the grid failed: its elements are too unequal for double precision")]
    Eigenvalues,
    /// Asked to stop.
    #[error("stopped on request")]
    Cancelled,
    /// A 1D mixed matrix failed.
    #[error(transparent)]
    IllConditioned(#[from] elastocap_fem::mixed::IllConditioned),
    /// The potentials on a mesh failed.
    #[error(transparent)]
    Potentials(tets::TetsError),
    /// The fluxes on a mesh failed.
    #[error(transparent)]
    Flux(#[from] flux::FluxError),
}

impl From<tets::TetsError> for SolveError {
    fn from(error: tets::TetsError) -> Self {
        if error == tets::TetsError::Cancelled { Self::Cancelled } else { Self::Potentials(error) }
    }
}
