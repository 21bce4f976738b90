//! The tolerances and limits of Newton's method and of its load steps.

use std::sync::atomic::{AtomicBool, Ordering};

/// Tolerances and limits of Newton's method and of its load steps.
#[derive(Debug, Clone, Copy)]
pub struct NewtonSettings<'a> {
    /// Largest unbalanced nodal force over the largest nodal force at which an equilibrium is accepted; also
    /// the largest mean volume error of an element. Where rounding alone leaves a larger unbalanced force,
    /// that is accepted up to 1e-6.
    pub tolerance: f64,
    /// The largest number of Newton steps per load step; a load step that needs more is cut.
    pub max_iterations: usize,
    /// The largest number of linear systems that one
    /// [`Equations::advance`](crate::solid::model::Equations::advance) may solve.
    pub max_solves: usize,
    /// Gap over the shortest side of the body where the contact pressure equals the shear modulus, while the
    /// load moves; see the contact module.
    pub moving_gap: f64,
    /// Gap over the shortest side of the body where the contact pressure equals the shear modulus, at the
    /// requested loads. The solver takes a smaller gap where displacements are small compared with that side.
    pub final_gap: f64,
    /// Gap over the shortest side of the body where the contact pressure equals the shear modulus, while an
    /// equilibrium is first searched near that of a coarser mesh. It is used if it is smaller than
    /// `moving_gap`: the coarser contact forces then indicate where the surface touches, so that the gaps
    /// need not be opened first.
    pub first_gap: f64,
    /// First load step, as a fraction of the way from one load to the next.
    pub first_step: f64,
    /// Load steps below this fraction of the way are not tried.
    pub smallest_step: f64,
    /// The smallest factor by which one Newton step may shrink `J`, or the extension that a rubber has left,
    /// at any point.
    pub smallest_ratio: f64,
    /// Whether a body may fold: points of rubbers whose energy is [defined for
    /// it](elastocap_materials::Rubber::knows_inside_out) may turn inside out, and where an equilibrium
    /// ceases to exist, the body moves on to the next; see [`folds`](crate::solid::folds).
    pub through_folds: bool,
    /// Whether the equilibrium of a coarser mesh is the first guess for the equilibrium under the same load.
    /// Without that, as where equilibria depend on the path to them, the load is followed on every mesh.
    pub from_coarser: bool,
    /// Whether an equilibrium is only searched for near that of a coarser mesh, if that has no fault; if it
    /// is not found, it is left to the next mesh. A surface that slides around corners as the load is
    /// followed on a fine mesh takes hundreds of systems, and may end on the wrong side of a corner.
    pub only_near: bool,
    /// Set from outside to stop before the next linear system.
    pub cancel: Option<&'a AtomicBool>,
}

impl NewtonSettings<'_> {
    /// The relative tolerance of a given force.
    pub(crate) fn force_tolerance(&self) -> f64 {
        self.tolerance.max(1e-10)
    }

    /// Whether cancellation was requested.
    pub(crate) fn cancelled(&self) -> bool {
        self.cancel.is_some_and(|cancel| cancel.load(Ordering::Relaxed))
    }
}

impl Default for NewtonSettings<'_> {
    fn default() -> Self {
        Self {
            tolerance: 1e-9,
            max_iterations: 80,
            max_solves: 2500,
            moving_gap: 1e-3,
            final_gap: 1e-8,
            first_gap: f64::INFINITY,
            first_step: 0.25,
            smallest_step: 1e-4,
            smallest_ratio: 0.2,
            through_folds: false,
            from_coarser: true,
            only_near: false,
            cancel: None,
        }
    }
}
