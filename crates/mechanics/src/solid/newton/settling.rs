//! From a guess with points inside obstacles to the equilibrium near it.

use super::iteration::{Course, Taken};
use super::{CLOSING, Effort, Failure, NewtonSettings, ON_THE_WAY, StopReason, Target};
use crate::solid::dimension::Dimension;
use crate::solid::model::{Equations, Linearisation, Load, State};

/// The gap at the start, over the gap that is small enough for the displacements: about the error of the gaps
/// of a guess from a mesh that is half as fine. Tuned: `benches/layer_errors.py --plane`.
const FIRST_GAP: f64 = 100.0;

/// The ratio of the unbalanced force to the largest force below which the gaps are closed farther. Tuned:
/// `benches/layer_errors.py --plane`.
const NEAR: f64 = 3e-3;

/// The largest number of steps. Following the load from rest takes more steps than this. Tuned:
/// `benches/layer_errors.py --plane`.
const MAX_STEPS: usize = 60;

impl<S: Dimension> Equations<S> {
    /// Takes the guess `state` to the equilibrium under `load` with the gaps at
    /// [`NewtonSettings::final_gap`], by Newton's method without bounds for gaps and contact forces: see
    /// [`Linearisation::Smoothed`]. The gaps are closed on the way as far as is small enough for the
    /// displacements; the interior method closes them farther if needed.
    ///
    /// # Errors
    /// [`Failure`] with the reason; `state` is then not an equilibrium.
    pub(in crate::solid) fn settle_without_bounds(
        &mut self,
        state: &mut State<S>,
        load: &Load<S>,
        settings: &NewtonSettings,
        effort: &mut Effort,
    ) -> Result<(), Failure> {
        self.linearisation = Linearisation::Smoothed(Vec::new());
        let gap = self.close_without_bounds(state, load, settings, effort);
        self.linearisation = Linearisation::Interior;
        let closing = NewtonSettings { moving_gap: gap?, ..*settings };
        if closing.moving_gap > 1.5 * settings.final_gap.min(self.gap_for(state)) {
            self.close_gaps(state, load, &closing, false, effort)?;
        }
        Ok(())
    }

    /// Takes the guess to an equilibrium without bounds for gaps and contact forces, and closes the gaps on
    /// the way. Returns the gap at the end, over the shortest side of the body.
    fn close_without_bounds(
        &mut self,
        state: &mut State<S>,
        load: &Load<S>,
        settings: &NewtonSettings,
        effort: &mut Effort,
    ) -> Result<f64, Failure> {
        let mut gap = (FIRST_GAP * self.gap_for(state)).min(settings.moving_gap);
        self.gap_times_pressure = gap * self.modulus_times_size;
        let mut residual = self.assemble(state, load);
        let mut course = Course::default();
        for _ in 0..MAX_STEPS {
            if !residual.force.is_finite() || !self.is_near_surface(state) {
                break;
            }
            let taken = self.step_from(&residual, state, load, &mut course, settings, effort)?;
            let Taken { whole, damped, .. } = taken;
            residual = taken.residual;
            let enough = self.gap_for(state);
            let wanted = settings.final_gap.min(enough);
            // Whether the gap is small enough for the displacements, and whether no smaller one is wanted
            // then.
            let is_small = gap <= 1.5 * enough.max(wanted);
            let is_final = enough <= 1.5 * wanted;
            let target =
                if is_final { Target { force: settings.tolerance, contact: 1e-3 } } else { ON_THE_WAY };
            let met = residual.within(settings.tolerance, target) && self.penetration(state) < 0.0;
            if whole && !damped && is_small && met {
                effort.steps += 1;
                return Ok(gap);
            }
            if whole && !is_small && residual.force < NEAR {
                gap = (gap * CLOSING).max(enough.max(wanted));
                self.gap_times_pressure = gap * self.modulus_times_size;
                residual = self.assemble_again(state, load);
            }
        }
        Err((StopReason::NoConvergence, residual.smallest_j))
    }
}
