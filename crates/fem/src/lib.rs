//! What both solvers share: reference elements, quadrature, the 1D matrices of tensor-product grids, vectors.

pub mod line;
pub mod mixed;
pub mod modes;
pub mod quadrature;
pub mod radial;
pub mod tensor;
