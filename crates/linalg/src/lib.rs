//! Linear algebra that the solvers share: dense products, vectors in space, conjugate gradients.

pub mod conjugate_gradients;
pub mod gemm;
pub mod reduction;
pub mod vector;
