//! Newton's method under one load: from a configuration to an equilibrium near it.

use super::{Effort, Failure, ON_THE_WAY, Target};
use super::{NewtonSettings, StopReason};
use crate::solid::dimension::{Dimension, Numbers};
use crate::solid::model::{Equations, Load, Residual, State};

/// The first and the largest damping, over the shear modulus, that is tried where the tangent has negative
/// pivots.
/// Tuned: `benches/layer_errors.py --plane`.
const MIN_DAMPING: f64 = 0.02;
const MAX_DAMPING: f64 = 1e4;

/// Damping below this, over the shear modulus, is left out once the tangent has no negative pivots. Near an
/// unstable equilibrium the damping has to become this small: the less a step is damped, the farther it leads
/// away from it. Tuned: `benches/layer_errors.py --plane`.
const LEAST_DAMPING: f64 = 2e-4;

/// The largest number of Newton steps per equilibrium that may be shortened to keep `J > 0`, or to keep the
/// extension within its limit. Tuned: `benches/layer_errors.py --plane`.
const MAX_CUT_STEPS: usize = 6;

/// The shortest part of a Newton step that is tried. Not tuned: a limit that ordinary cases do not reach.
const SHORTEST_PART: f64 = 1e-3;

/// The data that Newton's method keeps from one step to the next under one load.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Course {
    /// Steps taken.
    steps: usize,
    /// Steps that the elements have shortened.
    cut_steps: usize,
    /// Damping of the next step over the shear modulus.
    damping: f64,
}

/// A step that was taken.
pub(super) struct Taken {
    /// The residual after the step.
    pub(super) residual: Residual,
    /// Whether the whole step was taken.
    pub(super) whole: bool,
    /// Whether the step was damped.
    pub(super) damped: bool,
}

/// A Newton step, or the part of it that the elements and the contact admit.
struct Shortened<S: Dimension> {
    /// The state after that part of the step.
    trial: State<S>,
    /// The fraction of the step; 1 for the whole step.
    part: f64,
    /// The reason why the elements do not admit the whole step, if they do not.
    refused: Option<StopReason>,
}

impl<S: Dimension> Equations<S> {
    /// Takes `state` to the equilibrium under `load`, within the tolerances of `target`. Returns the number
    /// of iterations.
    pub(in crate::solid) fn equilibrate(
        &mut self,
        state: &mut State<S>,
        load: &Load<S>,
        target: Target,
        settings: &NewtonSettings,
        effort: &mut Effort,
    ) -> Result<usize, Failure> {
        let residual = self.assemble(state, load);
        self.equilibrate_from(residual, state, load, target, settings, effort)
    }

    /// Takes `state` to the equilibrium under `load` as [`Equations::equilibrate`] does. The last assembly
    /// must have been one of `state` under `load`, and have returned `residual`.
    pub(super) fn equilibrate_from(
        &mut self,
        mut residual: Residual,
        state: &mut State<S>,
        load: &Load<S>,
        target: Target,
        settings: &NewtonSettings,
        effort: &mut Effort,
    ) -> Result<usize, Failure> {
        let mut course = Course::default();
        for iteration in 0..settings.max_iterations {
            let taken = self.step_from(&residual, state, load, &mut course, settings, effort)?;
            residual = taken.residual;
            if taken.whole
                && (!taken.damped || target.force >= ON_THE_WAY.force)
                && residual.within(settings.tolerance, target)
            {
                return Ok(iteration + 1);
            }
            if !residual.force.is_finite() {
                return Err((StopReason::NoConvergence, residual.smallest_j));
            }
        }
        Err((StopReason::NoConvergence, residual.smallest_j))
    }

    /// Takes one Newton step from `state` under `load`, by the last assembly, which returned `residual`. The
    /// new state is assembled.
    pub(super) fn step_from(
        &mut self,
        residual: &Residual,
        state: &mut State<S>,
        load: &Load<S>,
        course: &mut Course,
        settings: &NewtonSettings,
        effort: &mut Effort,
    ) -> Result<Taken, Failure> {
        if settings.cancelled() {
            return Err((StopReason::Cancelled, residual.smallest_j));
        }
        if effort.solves >= settings.max_solves {
            return Err((StopReason::TooLong, residual.smallest_j));
        }
        let singular = (StopReason::Singular, residual.smallest_j);
        let negative_pivots = self.factorise_damped(&mut course.damping, effort).ok_or(singular)?;
        if settings.cancelled() {
            return Err((StopReason::Cancelled, residual.smallest_j));
        }
        let damped = course.damping > 0.0;
        let (step, linear_residual) = self.solve(state, load).ok_or(singular)?;
        self.keep_slopes(state);
        effort.linear_residual = effort.linear_residual.max(linear_residual);
        effort.negative_pivots = negative_pivots;
        let Shortened { trial, part, refused } = self.shortened(state, &step, settings)?;
        if let Some(reason) = refused {
            course.cut_steps += 1;
            if course.cut_steps > MAX_CUT_STEPS {
                return Err((reason, residual.smallest_j));
            }
        }
        let residual = self.assemble(&trial, load);
        *state = trial;
        let damping = course.damping;
        if negative_pivots == 0 {
            course.damping = if damping > LEAST_DAMPING { 0.25 * damping } else { 0.0 };
        }
        effort.smallest_j = residual.smallest_j.0;
        effort.residual = residual.force;
        course.steps += 1;
        Ok(Taken { residual, whole: part == 1.0, damped })
    }

    /// Factorises the tangent of the last assembly, damped by `damping`. With contact, the damping is raised
    /// until there are no negative pivots. Returns the number of negative pivots before it was raised, or
    /// `None` if the tangent is singular.
    ///
    /// Springs at the present displacements turn the step downhill, so that a piece of surface that snaps
    /// past a corner finds the next equilibrium. Without contact, an unstable equilibrium may be the wanted
    /// one, as under the dead tractions of the closed form, where no other may be near; it is accepted.
    fn factorise_damped(&mut self, damping: &mut f64, effort: &mut Effort) -> Option<usize> {
        if *damping > 0.0 {
            self.damp(*damping);
        }
        let first = self.factorise()?;
        effort.solves += 1;
        let mut negative = first;
        while self.has_contact() && negative > 0 && *damping < MAX_DAMPING {
            let more = if *damping > 0.0 { 4.0 * *damping } else { MIN_DAMPING };
            self.damp(more - *damping);
            *damping = more;
            negative = self.factorise()?;
            effort.solves += 1;
        }
        Some(first)
    }

    /// The longest tried part of `step` from `state` that the elements and the contact admit.
    fn shortened(
        &self,
        state: &State<S>,
        step: &State<S>,
        settings: &NewtonSettings,
    ) -> Result<Shortened<S>, Failure> {
        let mut part = 1.0;
        let mut trial = state.plus(step, part);
        let mut refused = None;
        loop {
            let (reason, smallest_j) = self.refuses(state, &trial, settings);
            let clear = self.clear_part(state, &mut trial);
            if reason.is_none() && clear == 1.0 {
                return Ok(Shortened { trial, part, refused });
            }
            refused = refused.or(reason);
            part *= if reason.is_none() { clear } else { clear.min(0.5) };
            if part < SHORTEST_PART {
                return Err((reason.unwrap_or(StopReason::NoConvergence), smallest_j));
            }
            trial = state.plus(step, part);
        }
    }

    /// The reason why the step from `state` to `trial` is too long for the elements, if it is: it turns one
    /// inside out, or shrinks a volume or the remaining extension of a rubber too much at once. Also the
    /// smallest `J` of `trial`, and the element it is in.
    fn refuses(
        &self,
        state: &State<S>,
        trial: &State<S>,
        settings: &NewtonSettings,
    ) -> (Option<StopReason>, (f64, usize)) {
        let (before, after) = (&state.displacement, &trial.displacement);
        let (j, element, ratio) = self.smallest_j(before, after, settings.through_folds);
        let keeps_volume = j > 0.0 && ratio > settings.smallest_ratio;
        if !keeps_volume {
            return (Some(StopReason::Inversion), (j, element));
        }
        match self.extension_left(before, after) {
            Some((left, element)) if left <= settings.smallest_ratio => {
                (Some(StopReason::ExtensionLimit), (j, element))
            }
            Some(_) | None => (None, (j, element)),
        }
    }
}

impl Residual {
    /// Whether the residual is within the tolerances of `target`, where `tolerance` is that of the settings.
    pub(super) fn within(&self, tolerance: f64, target: Target) -> bool {
        self.force <= target.force.max(self.rounding)
            && self.volume <= target.force.max(tolerance)
            && self.contact <= target.contact
            && self.given_force <= target.force.max(tolerance)
    }
}

impl<S: Dimension> State<S> {
    /// The state after the fraction `part` of `step`.
    fn plus(&self, step: &Self, part: f64) -> Self {
        let sum = |a: &f64, b: &f64| a + part * b;
        let added = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| sum(a, b)).collect();
        fn arrays_added<N: Numbers>(a: &[N], b: &[N], part: f64) -> Vec<N> {
            a.iter().zip(b).map(|(a, b)| N::from_fn(|k| a[k] + part * b[k])).collect()
        }
        Self {
            displacement: added(&self.displacement, &step.displacement),
            pressure: arrays_added(&self.pressure, &step.pressure, part),
            contact: added(&self.contact, &step.contact),
            shift: arrays_added(&self.shift, &step.shift, part),
            moving: None,
        }
    }
}
