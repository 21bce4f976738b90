//! Newton's method with load steps that shrink where it fails and grow where it is easy.

use super::model::{Equations, Load, Residual, State};

/// When to stop, and what to try.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NewtonSettings {
    /// Largest unbalanced nodal force over the largest nodal force; also for volume errors and gaps.
    pub tolerance: f64,
    /// Newton steps before a load step is cut.
    pub most_iterations: usize,
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
}

impl Default for NewtonSettings {
    fn default() -> Self {
        Self {
            tolerance: 1e-9,
            most_iterations: 20,
            first_step: 0.25,
            smallest_step: 1e-4,
            smallest_ratio: 0.2,
            through_folds: false,
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
    /// A linear system had no solution.
    #[error("the tangent is singular")]
    Singular,
}

impl Equations {
    /// Takes `state`, in equilibrium under `from`, to an equilibrium under `to`. Loads in between are
    /// interpolated.
    ///
    /// # Errors
    /// [`Stopped`] where and why; `state` is then the last equilibrium on the way, and `from` its load.
    pub fn advance(
        &mut self,
        state: &mut State,
        from: &mut Load,
        to: &Load,
        settings: &NewtonSettings,
    ) -> Result<Effort, Box<Stopped>> {
        if settings.through_folds {
            return self.advance_through_folds(state, from, to, settings);
        }
        let start = from.clone();
        let (mut reached, mut step) = (0.0, settings.first_step.clamp(settings.smallest_step, 1.0));
        let mut effort = Effort::default();
        while reached < 1.0 {
            // A last step that would leave a sliver is stretched to the end.
            let target = if reached + 1.001 * step >= 1.0 { 1.0 } else { reached + step };
            let load = start.toward(to, target);
            let mut trial = state.clone();
            match self.equilibrate(&mut trial, &load, settings, &mut effort) {
                Ok(iterations) => {
                    *state = trial;
                    *from = load;
                    reached = target;
                    effort.steps += 1;
                    if iterations <= 5 {
                        step *= 1.6;
                    } else if iterations > 8 {
                        step *= 0.7;
                    }
                }
                Err((reason, (smallest_j, element))) => {
                    effort.cuts += 1;
                    step = 0.4 * (target - reached);
                    if step < settings.smallest_step {
                        let step = target - reached;
                        return Err(Box::new(Stopped { reached, step, reason, smallest_j, element, effort }));
                    }
                }
            }
        }
        Ok(effort)
    }

    pub(crate) fn equilibrate(
        &mut self,
        state: &mut State,
        load: &Load,
        settings: &NewtonSettings,
        effort: &mut Effort,
    ) -> Result<usize, (StopReason, (f64, usize))> {
        let mut residual = self.assemble(state, load);
        let mut short_steps = 0;
        for iteration in 0..settings.most_iterations {
            let Some((step, linear_residual, negative)) = self.solve(state, load) else {
                return Err((StopReason::Singular, residual.smallest_j));
            };
            effort.solves += 1;
            effort.linear_residual = effort.linear_residual.max(linear_residual);
            effort.negative_pivots = negative;
            let mut part = 1.0;
            let mut trial = state.plus(&step, part);
            loop {
                let (j, element, ratio) =
                    self.smallest_j(&state.displacement, &trial.displacement, settings.through_folds);
                if j > 0.0 && ratio > settings.smallest_ratio {
                    break;
                }
                part *= 0.5;
                if part < 0.01 {
                    return Err((StopReason::Inversion, (j, element)));
                }
                trial = state.plus(&step, part);
            }
            if part < 1.0 {
                short_steps += 1;
                if short_steps > 6 {
                    return Err((StopReason::Inversion, residual.smallest_j));
                }
            }
            let before = residual.force;
            residual = self.assemble(&trial, load);
            // Contact that opens and closes in turn: full steps go back and forth between two sets of touching
            // nodes. The residual is continuous, and falls along the step if that is short enough.
            let shortest = if self.has_contact() && iteration >= 3 { 0.02 } else { part };
            while residual.force > before && part > shortest {
                part *= 0.5;
                trial = state.plus(&step, part);
                residual = self.assemble(&trial, load);
            }
            *state = trial;
            effort.smallest_j = residual.smallest_j.0;
            effort.residual = residual.force;
            if part == 1.0 && residual.within(settings.tolerance) {
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
    fn within(&self, tolerance: f64) -> bool {
        self.force <= tolerance && self.volume <= tolerance && self.gap <= tolerance
    }
}

impl Load {
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
                .map(|(a, b)| std::array::from_fn(|k| mix(&a[k], &b[k])))
                .collect(),
        }
    }
}

impl State {
    fn plus(&self, step: &Self, part: f64) -> Self {
        let sum = |a: &f64, b: &f64| a + part * b;
        let all = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| sum(a, b)).collect();
        Self {
            displacement: all(&self.displacement, &step.displacement),
            pressure: self
                .pressure
                .iter()
                .zip(&step.pressure)
                .map(|(a, b)| std::array::from_fn(|k| sum(&a[k], &b[k])))
                .collect(),
            contact: all(&self.contact, &step.contact),
        }
    }
}
