//! Laplace's equation in box scenes, and on tetrahedra: Maxwell capacitance matrices with proved bounds.

pub mod boxes;
pub mod floating;
pub mod matrix;
pub mod solution;
pub mod tets;

pub use boxes::forecast::forecast;
pub use boxes::solve::solve;
pub use solution::{
    Bounded, Discretisation, Field, FloatingPotential, Forecast, PhaseSeconds, ResolutionLevel, Settings,
    Solution, Target,
};

/// Permittivity of vacuum, eps_0, F/m (CODATA 2018): the only definition of it in the project.
pub const VACUUM_PERMITTIVITY: f64 = 8.854_187_812_8e-12;

/// A solve that cannot be carried out.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SolveError {
    /// The box solver was given a body of another shape.
    #[error(
        "`{body}` is neither a box nor a sheet, and the box solver takes no other shape; solve the scene on tetrahedra"
    )]
    NotBoxes {
        /// Its name.
        body: String,
    },
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
    Potentials(tets::potentials::TetsError),
    /// The fluxes on a mesh failed.
    #[error(transparent)]
    Flux(#[from] tets::flux::FluxError),
}

impl From<tets::potentials::TetsError> for SolveError {
    fn from(error: tets::potentials::TetsError) -> Self {
        if error == tets::potentials::TetsError::Cancelled {
            Self::Cancelled
        } else {
            Self::Potentials(error)
        }
    }
}
