//! The settings of the solver on tetrahedra.

use crate::target::Target;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Tolerance, order and limits of the solver on tetrahedra.
///
/// It always proves both bounds: the flux behind the lower one steers the refinement.
#[derive(Debug, Clone)]
pub struct TetrahedraSettings {
    /// Largest relative spread (upper - lower) / value of the target.
    pub relative_tolerance: f64,
    /// The scale, F, that the spread is compared with where the value is smaller: see
    /// [`Settings::least_scale`](crate::Settings::least_scale).
    pub least_scale: f64,
    /// The quantity that the tolerance applies to.
    pub target: Target,
    /// Order of the potentials, 1 to 3.
    pub order: usize,
    /// Largest memory the solve may take, bytes.
    pub memory_limit: u64,
    /// Set from outside to stop at the next opportunity, with the best bounds by then, or with
    /// [`SolveError::Cancelled`](crate::SolveError::Cancelled) if there are no useful ones.
    pub cancel: Option<Arc<AtomicBool>>,
}

impl TetrahedraSettings {
    /// The default order. Quadratic potentials are the best choice at edges, where higher orders cost more
    /// than they gain. Measured:
    /// `cargo run --release -p elastocap-electrostatics --example tets_rate -- 2 1e-4`, and with 1 and 3.
    pub const USUAL_ORDER: usize = 2;
}

impl Default for TetrahedraSettings {
    fn default() -> Self {
        Self {
            relative_tolerance: 1e-3,
            least_scale: 0.0,
            target: Target::Matrix,
            order: Self::USUAL_ORDER,
            memory_limit: 16 << 30,
            cancel: None,
        }
    }
}
