//! The linear algebra that the solvers share. It depends on no other crate of the workspace.
//!
//! | module | holds |
//! |---|---|
//! | [`sparse`] | matrices by rows on the pattern of nalgebra-sparse, with parallel products |
//! | [`conjugate_gradients`] | the one iterative solver, preconditioned in single or double precision |
//! | [`multigrid`] | a preconditioner for conjugate gradients: smoothed aggregation |
//! | [`ldlt`] | sparse symmetric systems, factorised again and again on one pattern by faer |
//! | [`lanes`] | factors of several sparse matrices on one pattern, side by side in vector registers |
//! | [`ordering`] | the order of elimination: nested dissection |
//! | [`cholesky`] | dense factors of small semi-definite matrices, by faer |
//! | [`dense`] | dense products, factors, singular values and eigenvectors, by faer on one thread |
//! | [`gemm`] | products of small dense matrices |
//! | [`reduction`] | sums and updates of long vectors |
//! | [`memory`] | amounts of memory as text for messages |
//! | [`vector`] | vectors in space |
//!
//! All of it gives the same bytes at any number of threads.

pub mod cholesky;
pub mod conjugate_gradients;
pub mod dense;
pub mod gemm;
pub mod lanes;
pub mod ldlt;
pub mod memory;
pub mod multigrid;
pub mod ordering;
pub mod reduction;
pub mod sparse;
pub mod vector;
