//! Laplace's equation in box scenes: Maxwell capacitance matrices with proved bounds.

pub mod boxes;
pub mod domain;
pub mod dual;
pub mod krylov;
pub mod primal;
pub mod schwarz;

/// A solve that cannot be carried out.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SolveError {
    /// A 1D eigenproblem failed.
    #[error("an eigenvalue problem of the grid failed: its elements are too unequal for double precision")]
    Eigenvalues,
    /// A 1D mixed matrix failed.
    #[error(transparent)]
    IllConditioned(#[from] elastocap_fem::mixed::IllConditioned),
}
