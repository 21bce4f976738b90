//! Scenes of boxes under a map that bends them, in the coordinates of the boxes.
//!
//! The energy of a potential u(X) is the integral of grad u K grad u with K = eps J F^-1 F^-T, that of a flux
//! s the integral of s K^-1 s, and a flux without divergence stays one (Piola's map). So both principles hold
//! on the grid of the boxes, with a tensor in place of the permittivity wherever the map is not the identity.

pub(crate) mod gradients;
pub(crate) mod metric;
pub(crate) mod points;
pub(crate) mod pool;
pub(crate) mod runs;
pub(crate) mod sums;
