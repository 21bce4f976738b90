//! The energy matrix of a problem, of upper or of lower bounds, and what it took to compute it.

use faer::Mat;

/// The energies V^T C V for the potentials V of the right-hand sides, with C over eps0 and in the domain's
/// unit of length.
#[derive(Debug)]
pub(crate) struct Energies {
    /// One row and column per right-hand side.
    pub matrix: Mat<f64>,
    /// Unknowns, conductors not subtracted.
    pub unknowns: usize,
    /// Iterations of all right-hand sides.
    pub iterations: usize,
    /// Whether the linear solver reached its goal for every right-hand side.
    pub converged: bool,
    /// Largest share of an energy by which the repair of the divergence lowers it (lower bounds only).
    pub repair_share: f64,
    /// Primal coefficients, one array per right-hand side (upper bounds only).
    pub coefficients: Vec<Vec<f64>>,
    /// Lower and upper bounds of the energies of a solution that is added to a base, the energies of the
    /// error of the base included: see [`crate::boxes::superposed`].
    pub with_error_of_base: Option<[Mat<f64>; 2]>,
    /// Seconds assembling and seconds solving.
    pub seconds: [f64; 2],
}
