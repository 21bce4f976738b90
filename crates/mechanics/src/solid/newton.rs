//! Newton's method with load steps that shrink where it fails and grow where it is easy.

use super::dimension::{Dimension, Numbers};
use super::model::{Equations, Load, Residual, State};

/// When to stop, and what to try.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NewtonSettings {
    /// Largest unbalanced nodal force over the largest nodal force, or what rounding leaves of it where that is more (at most
    /// 1e-6); also for volume errors.
    pub tolerance: f64,
    /// Newton steps before a load step is cut.
    pub most_iterations: usize,
    /// Linear systems that one [`Equations::advance`] may solve.
    pub most_solves: usize,
    /// Gap over the shortest side of the body where the contact pressure is the shear modulus, while the load moves; see
    /// the contact module.
    pub moving_gap: f64,
    /// The same at the loads that are asked for; less where displacements are small against that side.
    pub final_gap: f64,
    /// First load step, as a part of the way from one load to the next.
    pub first_step: f64,
    /// Load steps below this part of the way are not tried.
    pub smallest_step: f64,
    /// A Newton step may shrink no `J` by more than this factor.
    pub smallest_ratio: f64,
    /// Whether a body may fold: points of rubbers that [know what that costs](super::material::Rubber::knows_inside_out)
    /// may turn inside out, and where an equilibrium ceases to be, the body falls into the next; see
    /// [`folds`](super::folds).
    pub through_folds: bool,
    /// What equilibria of a coarser mesh are good for.
    pub from_coarser: FromCoarser,
    /// How far an obstacle goes in one step at most, in m.
    pub longest_move: f64,
    /// Steps that keep `J > 0` only because they are cut, on the way to one equilibrium at most.
    pub most_cut_steps: usize,
}

/// How the equilibrium of a coarser mesh is used under the same load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FromCoarser {
    /// Not at all: equilibria depend on the way to them, and the load is followed on every mesh.
    Nothing,
    /// That on the finer mesh is found from it.
    Equilibrium,
    /// One is found from it with the indenter so far (m) before the load. The rest of the way, on which the surface forgets how
    /// it came there, is gone on the finer mesh.
    RunUp(f64),
}

impl Default for NewtonSettings {
    fn default() -> Self {
        Self {
            tolerance: 1e-9,
            most_iterations: 80,
            most_solves: 2500,
            moving_gap: 1e-3,
            final_gap: 1e-8,
            first_step: 0.25,
            smallest_step: 1e-4,
            smallest_ratio: 0.2,
            through_folds: false,
            from_coarser: FromCoarser::Equilibrium,
            longest_move: f64::INFINITY,
            most_cut_steps: 6,
        }
    }
}

/// What it took to reach a load.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Effort {
    /// Load steps that converged.
    pub steps: usize,
    /// Load steps that were given up and cut.
    pub cuts: usize,
    /// Linear systems solved.
    pub solves: usize,
    /// Smallest `J` of the quadrature points at the end.
    pub smallest_j: f64,
    /// Largest unbalanced force over the largest force at the end.
    pub residual: f64,
    /// Largest residual of a linear system.
    pub linear_residual: f64,
    /// Negative pivots of the last tangent: zero for a stable equilibrium.
    pub negative_pivots: usize,
}

impl Effort {
    /// This one together with what came before.
    pub(super) fn after(self, before: Self) -> Self {
        Self {
            steps: before.steps + self.steps,
            cuts: before.cuts + self.cuts,
            solves: before.solves + self.solves,
            ..self
        }
    }
}

/// Why Newton's method stopped short. The state is the last one in equilibrium.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error(
    "no equilibrium found beyond {reached} of this load step: {reason}; the smallest J is {smallest_j} in element \
     {element}, the smallest part tried {step}"
)]
pub struct Stopped {
    /// The part of the way from the last load to this one at which an equilibrium was found.
    pub reached: f64,
    /// The part of the way that was tried last.
    pub step: f64,
    /// What happened in the last try.
    pub reason: StopReason,
    /// Smallest `J` of the quadrature points in the last try.
    pub smallest_j: f64,
    /// The element it is in.
    pub element: usize,
    /// What it took so far.
    pub effort: Effort,
}

/// What a load step failed by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum StopReason {
    /// Steps that keep `J > 0` have become too short.
    #[error("every step would turn an element inside out")]
    Inversion,
    /// The residual did not fall.
    #[error("Newton's method did not converge")]
    NoConvergence,
    /// [`NewtonSettings::most_solves`] is used up.
    #[error("the number of linear systems has reached its limit")]
    TooLong,
    /// A linear system had no solution.
    #[error("the tangent is singular")]
    Singular,
}

/// How well an equilibrium has to be met, and how close contact has to be.
#[derive(Debug, Clone, Copy)]
pub(super) struct Target {
    pub(super) force: f64,
    /// Relative error of the product of gap and contact force.
    pub(super) contact: f64,
}

/// Damping, over the shear modulus, that is tried first and last where the tangent has negative pivots.
const LEAST_DAMPING: f64 = 0.02;
const MOST_DAMPING: f64 = 1e4;

/// Where the load moves, contact only has to be followed: the loads that are asked for are met from there.
const ON_THE_WAY: Target = Target { force: 1e-2, contact: 1.0 };

/// Gap over displacement that is small enough, about, and the gap (over the shortest side of the body) below which none is
/// closed: where nothing moves there is nothing to compare it with.
const GAP_PART: f64 = 1e-4;
const LEAST_GAP: f64 = 1e-20;

/// The part of its size that a gap is taken to at a time: points at the edge of the contact, which are about to touch or to
/// leave, let Newton's method go no farther in one or two steps.
const CLOSING: f64 = 0.1;

/// Where obstacles may not go far in one step, one in which the smallest `J` falls to this part has left the way of the surface
/// for a fold of it; unless it was shorter than this part of the longest.
const STRAYED: f64 = 0.9;
const LONG: f64 = 0.05;

pub(super) type Failure = (StopReason, (f64, usize));

impl<S: Dimension> Equations<S> {
    /// Takes `state`, in equilibrium under `from`, to an equilibrium under `to`. Loads in between are
    /// interpolated.
    ///
    /// # Errors
    /// [`Stopped`] where and why; `state` is then the last equilibrium on the way, and `from` its load.
    pub fn advance(
        &mut self,
        state: &mut State<S>,
        from: &mut Load<S>,
        to: &Load<S>,
        settings: &NewtonSettings,
    ) -> Result<Effort, Box<Stopped>> {
        if settings.through_folds {
            return self.advance_through_folds(state, from, to, settings);
        }
        let mut effort = Effort::default();
        let (first_state, first_load) = (state.clone(), from.clone());
        let mut result = self.march(state, from, to, settings, &mut effort);
        if self.has_contact()
            && let Err((reason, (smallest_j, element))) =
                self.close_gaps(state, from, settings, result.is_err(), &mut effort)
        {
            *state = first_state;
            *from = first_load;
            result = Err(Box::new(Stopped { reached: 0.0, step: 1.0, reason, smallest_j, element, effort }));
        }
        result.map(|()| effort).map_err(|mut stopped| {
            // The last assembly may have been of a state that was given up.
            let residual = self.assemble(state, from);
            effort.smallest_j = residual.smallest_j.0;
            effort.residual = residual.force;
            stopped.effort = effort;
            stopped
        })
    }

    /// The way from load to load, contact at [`NewtonSettings::moving_gap`].
    fn march(
        &mut self,
        state: &mut State<S>,
        from: &mut Load<S>,
        to: &Load<S>,
        settings: &NewtonSettings,
        effort: &mut Effort,
    ) -> Result<(), Box<Stopped>> {
        let start = from.clone();
        let mut settings = *settings;
        let longest = (settings.longest_move / start.farthest_shift(to)).min(1.0);
        let (mut reached, mut step) =
            (0.0, settings.first_step.clamp(settings.smallest_step, 1.0).min(longest));
        let mut target = Target { force: settings.tolerance, contact: 0.0 };
        if self.has_contact() {
            target = ON_THE_WAY;
            // What is reached has to be met closely with the rest.
            settings.most_solves -= settings.most_solves / 5;
            self.gap_times_pressure = settings.moving_gap * self.modulus_times_size;
            if let Some(moving) = state.moving.take() {
                *state = *moving;
            }
            self.start_contact(state);
        }
        let mut smallest_j = self.smallest_j(&state.displacement, &state.displacement, false).0;
        while reached < 1.0 {
            // A last step that would leave a sliver is stretched to the end.
            let part = if reached + 1.001 * step >= 1.0 { 1.0 } else { reached + step };
            let load = start.toward(to, part);
            let mut trial = state.clone();
            let mut found = self.equilibrate(&mut trial, &load, target, &settings, effort);
            let strays = step > LONG * longest && effort.smallest_j < STRAYED * smallest_j;
            if found.is_ok() && longest < 1.0 && strays {
                found = Err((StopReason::NoConvergence, (effort.smallest_j, 0)));
            }
            match found {
                Ok(iterations) => {
                    smallest_j = effort.smallest_j;
                    *state = trial;
                    *from = load;
                    reached = part;
                    effort.steps += 1;
                    if iterations <= 5 {
                        step *= 1.6;
                    } else if iterations > 8 {
                        step *= 0.7;
                    }
                    step = step.min(longest);
                }
                Err((reason, (smallest_j, element))) => {
                    effort.cuts += 1;
                    step = 0.4 * (part - reached);
                    if step < settings.smallest_step || reason == StopReason::TooLong {
                        let (step, effort) = (part - reached, *effort);
                        return Err(Box::new(Stopped { reached, step, reason, smallest_j, element, effort }));
                    }
                }
            }
        }
        Ok(())
    }

    /// From a configuration near it to the equilibrium under `load`; contact forces are those of
    /// [`NewtonSettings::moving_gap`].
    pub(super) fn settle_at(
        &mut self,
        state: &mut State<S>,
        load: &Load<S>,
        settings: &NewtonSettings,
        effort: &mut Effort,
    ) -> Result<(), Failure> {
        self.follow_to(state, load, settings, effort)?;
        if self.has_contact() {
            self.close_gaps(state, load, settings, false, effort)?;
        }
        Ok(())
    }

    /// The same with the contact left at [`NewtonSettings::moving_gap`].
    pub(super) fn follow_to(
        &mut self,
        state: &mut State<S>,
        load: &Load<S>,
        settings: &NewtonSettings,
        effort: &mut Effort,
    ) -> Result<(), Failure> {
        let target = match self.has_contact() {
            true => ON_THE_WAY,
            false => Target { force: settings.tolerance, contact: 0.0 },
        };
        self.equilibrate(state, load, target, settings, effort)?;
        effort.steps += 1;
        Ok(())
    }

    /// From [`NewtonSettings::moving_gap`] to [`NewtonSettings::final_gap`] at one load; `fresh` unless the last assembly was of
    /// `state` under `load`.
    fn close_gaps(
        &mut self,
        state: &mut State<S>,
        load: &Load<S>,
        settings: &NewtonSettings,
        mut fresh: bool,
        effort: &mut Effort,
    ) -> Result<(), Failure> {
        let moving = state.clone();
        let (mut gap, mut factor, mut met) = (settings.moving_gap, CLOSING, false);
        loop {
            // The displacements change with the gaps, and what is wanted with them: a little too large is no matter.
            let wanted = settings.final_gap.min(self.gap_for(state));
            let most = 1.5 * wanted;
            if met && gap <= most {
                break;
            }
            let next = if gap <= most { gap } else { (gap * factor).max(wanted) };
            let last = next <= most;
            let target = if last {
                Target { force: settings.tolerance, contact: 1e-3 }
            } else {
                Target { force: settings.tolerance.max(1e-3), contact: 1.0 }
            };
            self.gap_times_pressure = next * self.modulus_times_size;
            let mut trial = state.clone();
            // What the elements say of this configuration is known already, but after a failure.
            let residual = if fresh { self.assemble(state, load) } else { self.assemble_again(state, load) };
            match self.equilibrate_from(residual, &mut trial, load, target, settings, effort) {
                Ok(_) => {
                    fresh = false;
                    met = last;
                    *state = trial;
                    gap = next;
                    factor = (factor * factor).max(CLOSING);
                }
                Err(failure) => {
                    fresh = true;
                    effort.cuts += 1;
                    factor = factor.sqrt();
                    if factor > 0.9 || failure.0 == StopReason::TooLong {
                        return Err(failure);
                    }
                }
            }
        }
        state.moving = Some(Box::new(moving));
        Ok(())
    }

    /// What [`NewtonSettings::final_gap`] has to be at most for the displacements of `state`. The pressure under a smooth punch
    /// grows with its displacement `u`, so that a product `s` of gap and pressure keeps it away from the layer by something
    /// like `s/u`: for that to stay a small part of `u`, `s` has to fall with `u^2`.
    fn gap_for(&self, state: &State<S>) -> f64 {
        let moved = state.displacement.iter().fold(0.0, |m: f64, u| m.max(u.abs()));
        (GAP_PART * (moved / self.shortest_side).powi(2)).max(LEAST_GAP)
    }

    pub(super) fn equilibrate(
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

    /// The same from what the last assembly, one of `state` under `load`, left as `residual`.
    fn equilibrate_from(
        &mut self,
        mut residual: Residual,
        state: &mut State<S>,
        load: &Load<S>,
        target: Target,
        settings: &NewtonSettings,
        effort: &mut Effort,
    ) -> Result<usize, Failure> {
        let mut cut_steps = 0;
        let mut damping = 0.0;
        for iteration in 0..settings.most_iterations {
            if effort.solves >= settings.most_solves {
                return Err((StopReason::TooLong, residual.smallest_j));
            }
            let singular = (StopReason::Singular, residual.smallest_j);
            if damping > 0.0 {
                self.damp(damping);
            }
            // Springs that hold the displacements where they are make the step one downhill where the tangent has negative
            // pivots: so a piece of surface that snaps past a corner finds the next equilibrium. Without contact an
            // unstable equilibrium may be what is asked for, as with the dead tractions of the closed form.
            let mut negative = self.factorise().ok_or(singular)?;
            let first_negative = negative;
            effort.solves += 1;
            // Without contact an unstable equilibrium is taken as it is: dead loads may have no other near.
            while self.has_contact() && negative > 0 && damping < MOST_DAMPING {
                let more = (4.0 * damping).max(LEAST_DAMPING);
                self.damp(more - damping);
                damping = more;
                negative = self.factorise().ok_or(singular)?;
                effort.solves += 1;
            }
            let damped = damping > 0.0;
            let (step, linear_residual) = self.solve(state, load).ok_or(singular)?;
            effort.linear_residual = effort.linear_residual.max(linear_residual);
            effort.negative_pivots = first_negative;
            let mut part = 1.0;
            let mut trial = state.plus(&step, part);
            let mut turned = false;
            loop {
                let (j, element, ratio) =
                    self.smallest_j(&state.displacement, &trial.displacement, settings.through_folds);
                let whole = j > 0.0 && ratio > settings.smallest_ratio;
                let clear = self.clear_part(state, &mut trial);
                if whole && clear == 1.0 {
                    break;
                }
                turned |= !whole;
                part *= if whole { clear } else { clear.min(0.5) };
                if part < 1e-3 {
                    let reason = if whole { StopReason::NoConvergence } else { StopReason::Inversion };
                    return Err((reason, (j, element)));
                }
                trial = state.plus(&step, part);
            }
            if turned {
                cut_steps += 1;
                if cut_steps > settings.most_cut_steps {
                    return Err((StopReason::Inversion, residual.smallest_j));
                }
            }
            residual = self.assemble(&trial, load);
            *state = trial;
            if first_negative == 0 {
                damping = if damping > LEAST_DAMPING { 0.25 * damping } else { 0.0 };
            }
            effort.smallest_j = residual.smallest_j.0;
            effort.residual = residual.force;
            if part == 1.0
                && (!damped || target.force >= ON_THE_WAY.force)
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
}

impl Residual {
    fn within(&self, tolerance: f64, target: Target) -> bool {
        self.force <= target.force.max(self.rounding)
            && self.volume <= target.force.max(tolerance)
            && self.contact <= target.contact
    }
}

impl<S: Dimension> Load<S> {
    /// How far an obstacle goes along any axis from this load to another, in m.
    fn farthest_shift(&self, to: &Self) -> f64 {
        let along = |k: usize| self.shift.iter().zip(&to.shift).map(move |(a, b)| (b[k] - a[k]).abs());
        (0..S::AXES).flat_map(along).fold(0.0, f64::max)
    }

    /// The load a part of the way from this one to another.
    pub fn toward(&self, to: &Self, part: f64) -> Self {
        let mix = |a: &f64, b: &f64| if part == 1.0 { *b } else { a + part * (b - a) };
        let all = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| mix(a, b)).collect();
        Self {
            displacement: all(&self.displacement, &to.displacement),
            force: all(&self.force, &to.force),
            shift: self
                .shift
                .iter()
                .zip(&to.shift)
                .map(|(a, b)| S::Point::from_fn(|k| mix(&a[k], &b[k])))
                .collect(),
        }
    }
}

impl<S: Dimension> State<S> {
    fn plus(&self, step: &Self, part: f64) -> Self {
        let sum = |a: &f64, b: &f64| a + part * b;
        let all = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| sum(a, b)).collect();
        fn both<N: Numbers>(a: &[N], b: &[N], part: f64) -> Vec<N> {
            a.iter().zip(b).map(|(a, b)| N::from_fn(|k| a[k] + part * b[k])).collect()
        }
        Self {
            displacement: all(&self.displacement, &step.displacement),
            pressure: both(&self.pressure, &step.pressure, part),
            contact: all(&self.contact, &step.contact),
            shift: both(&self.shift, &step.shift, part),
            moving: None,
        }
    }
}
