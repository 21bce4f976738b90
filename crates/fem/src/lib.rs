//! Building blocks of the finite-element solvers: quadrature, elements on lines and triangles and their
//! matrices, operations along the axes of three-dimensional arrays.
//!
//! * [`quadrature`]: Gauss-Legendre rules, for elements of any kind.
//! * [`mod@line`]: one axis of a tensor-product grid, with elements of any degree and, where it is open,
//!   infinite elements.
//! * [`mod@embedding`]: functions of a line as functions of a finer one.
//! * [`reflection`]: the mirror images of functions on a symmetric line.
//! * [`mixed`]: the Raviart-Thomas pair of fluxes and discontinuous potentials on a line.
//! * [`condensed`]: fast products with the dual operator of these two.
//! * [`modes`]: eigenvectors of a line, for fast diagonalisation.
//! * [`radial`]: a basis in which the squared distance from a pole is diagonal.
//! * [`triangle`]: potentials and Raviart-Thomas fluxes of any degree on a triangle, straight or with one
//!   side on a curve.
//! * [`bent`]: the maps of triangles with one side on a curve.
//! * [`tensor`]: matrices applied along one axis of an array, with the same bytes at any thread count.
//!
//! Coordinates are in the unit of the caller. Elements on tetrahedra are in the crates of the solvers.

pub mod bent;
pub mod condensed;
pub mod embedding;
mod jet;
pub mod line;
pub mod mixed;
pub mod modes;
pub mod quadrature;
pub mod radial;
pub mod reflection;
pub mod tensor;
pub mod triangle;
