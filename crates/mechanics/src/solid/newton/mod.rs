//! Newton's method with load steps that shrink where it fails and grow where it is easy.
//!
//! | module | contents |
//! |---|---|
//! | `settings` | tolerances and limits |
//! | `iteration` | the method under one load |
//! | `settling` | the method from a guess with points inside obstacles |
//! | `report` | the effort of a load, and the reason why it was not reached |

mod iteration;
mod report;
mod settings;
mod settling;

use super::dimension::{Dimension, Numbers};
use super::model::{Equations, Load, State};

pub use report::{Effort, StopReason, Stopped};
pub use settings::NewtonSettings;

/// The tolerances of an equilibrium.
#[derive(Debug, Clone, Copy)]
pub(super) struct Target {
    /// The largest unbalanced force over the largest nodal force.
    pub(super) force: f64,
    /// Relative error of the product of gap and contact force.
    pub(super) contact: f64,
}

/// The tolerances while the load moves. The equilibria at the requested loads are then found more closely.
const ON_THE_WAY: Target = Target { force: 1e-2, contact: 1.0 };

/// The ratio of the gap in a contact to the displacements, approximately, that is small enough. Tuned:
/// `benches/layer_errors.py --plane`.
const GAP_PART: f64 = 1e-4;
/// Smallest gap over the shortest side of the body: where nothing moves, there is no displacement to compare
/// it with. It is not tuned.
const MIN_GAP: f64 = 1e-20;

/// Factor by which the gaps are multiplied to close them a little. With a smaller factor, Newton's method
/// takes more than one or two steps at the points about to touch or separate at the edge of a contact. Tuned:
/// `benches/layer_errors.py --plane`.
const CLOSING: f64 = 0.1;

/// Shares of the reached load that are tried if the gaps cannot be closed at that load. Not tuned: gaps can
/// be closed at the load itself in ordinary cases.
const RETREATS: [f64; 3] = [0.95, 0.8, 0.5];

/// The reason why no equilibrium was found, and the smallest `J` with the element it is in.
pub(super) type Failure = (StopReason, (f64, usize));

impl<S: Dimension> Equations<S> {
    /// Takes `state`, in equilibrium under `from`, to an equilibrium under `to`. Loads in between are
    /// interpolated.
    ///
    /// # Errors
    /// [`Stopped`] says where and why; `state` is then the last equilibrium on the way, and `from` its load.
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
        let first = (state.clone(), from.clone());
        let mut result = self.march(state, from, to, settings, &mut effort);
        // A cancelled run is reported as such, whatever else ended it.
        if let Err(stopped) = &result
            && settings.cancelled()
        {
            return Err(stopped.clone());
        }
        if let Err((reason, (smallest_j, element))) =
            self.close_gaps(state, from, settings, result.is_err(), &mut effort)
        {
            let part = result.err().and_then(|stopped| {
                let part = self.retreat(state, from, &first, to, stopped.reached, settings, &mut effort)?;
                Some(Box::new(Stopped { reached: part, ..*stopped }))
            });
            result = Err(part.unwrap_or_else(|| {
                (*state, *from) = first;
                Box::new(Stopped { reached: 0.0, step: 1.0, reason, smallest_j, element, effort })
            }));
        }
        result.map(|()| effort).map_err(|mut stopped| {
            // The last assembly may have been at a discarded state.
            let residual = self.assemble(state, from);
            effort.smallest_j = residual.smallest_j.0;
            effort.residual = residual.force;
            stopped.effort = effort;
            stopped
        })
    }

    /// Goes back to a smaller load if the load could be followed only up to the part `reached` and the gaps
    /// cannot be closed there, as close to the limit of extension, where the rubber is too stiff. Follows the
    /// load from `first` to smaller and smaller parts of the way to `to` until the gaps can be closed.
    /// Returns that part, or `None`.
    fn retreat(
        &mut self,
        state: &mut State<S>,
        from: &mut Load<S>,
        first: &(State<S>, Load<S>),
        to: &Load<S>,
        reached: f64,
        settings: &NewtonSettings,
        effort: &mut Effort,
    ) -> Option<f64> {
        let parts = RETREATS.map(|share| share * reached);
        parts.into_iter().filter(|&part| part > 0.0).find(|&part| {
            (*state, *from) = first.clone();
            let load = first.1.toward(to, part);
            self.march(state, from, &load, settings, effort).is_ok()
                && self.close_gaps(state, from, settings, false, effort).is_ok()
        })
    }

    /// Follows the load from `from` to `to`, with the contact at [`NewtonSettings::moving_gap`].
    ///
    /// # Errors
    /// [`Stopped`] as for [`Equations::advance`].
    pub(super) fn march(
        &mut self,
        state: &mut State<S>,
        from: &mut Load<S>,
        to: &Load<S>,
        settings: &NewtonSettings,
        effort: &mut Effort,
    ) -> Result<(), Box<Stopped>> {
        let start = from.clone();
        let mut settings = *settings;
        let (mut reached, mut step) = (0.0, settings.first_step.clamp(settings.smallest_step, 1.0));
        let mut target = Target { force: settings.tolerance, contact: 0.0 };
        if self.has_contact() {
            target = ON_THE_WAY;
            // The last load step has to be met closely.
            settings.max_solves -= settings.max_solves / 5;
            self.gap_times_pressure = settings.moving_gap * self.modulus_times_size;
            if let Some(moving) = state.moving.take() {
                *state = *moving;
            }
            self.start_contact(state);
        }
        // Whether a step was given up because of the limit of extension.
        let mut at_limit = false;
        while reached < 1.0 {
            // A step that would leave only a small remainder is extended to the end.
            let part = if reached + 1.001 * step >= 1.0 { 1.0 } else { reached + step };
            let load = start.toward(to, part);
            let mut trial = state.clone();
            match self.equilibrate(&mut trial, &load, target, &settings, effort) {
                Ok(iterations) => {
                    *state = trial;
                    *from = load;
                    reached = part;
                    effort.steps += 1;
                    if iterations <= 5 {
                        step *= 1.6;
                    } else if iterations > 8 {
                        step *= 0.7;
                    }
                }
                Err((reason, (smallest_j, element))) => {
                    effort.cuts += 1;
                    step = 0.4 * (part - reached);
                    // Close to the limit of extension the rubber is so stiff that short steps converge slowly
                    // or not at all.
                    at_limit |= reason == StopReason::ExtensionLimit;
                    let over = matches!(reason, StopReason::TooLong | StopReason::Cancelled);
                    if step < settings.smallest_step || over {
                        let reason = match reason {
                            StopReason::NoConvergence | StopReason::TooLong if at_limit => {
                                StopReason::ExtensionLimit
                            }
                            StopReason::NoConvergence
                            | StopReason::TooLong
                            | StopReason::Inversion
                            | StopReason::ExtensionLimit
                            | StopReason::Cancelled
                            | StopReason::Singular => reason,
                        };
                        let (step, effort) = (part - reached, *effort);
                        return Err(Box::new(Stopped { reached, step, reason, smallest_j, element, effort }));
                    }
                }
            }
        }
        Ok(())
    }

    /// Finds the equilibrium under `load` from a configuration near it, with the contact left at
    /// [`NewtonSettings::moving_gap`].
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

    /// Closes the gaps, if there are any, from [`NewtonSettings::moving_gap`] to
    /// [`NewtonSettings::final_gap`] at one load. The elements are assembled first with `must_assemble`,
    /// which is needed if the last assembly was not one of `state` under `load`.
    pub(super) fn close_gaps(
        &mut self,
        state: &mut State<S>,
        load: &Load<S>,
        settings: &NewtonSettings,
        mut must_assemble: bool,
        effort: &mut Effort,
    ) -> Result<(), Failure> {
        if !self.has_contact() {
            return Ok(());
        }
        let moving = state.clone();
        let (mut gap, mut factor, mut met) = (settings.moving_gap, CLOSING, false);
        loop {
            // The displacements change with the gaps, and the limit with them; a slightly larger gap does not
            // matter.
            let wanted = settings.final_gap.min(self.gap_for(state));
            let small_enough = 1.5 * wanted;
            if met && gap <= small_enough {
                break;
            }
            let next = if gap <= small_enough { gap } else { (gap * factor).max(wanted) };
            let last = next <= small_enough;
            let target = if last {
                Target { force: settings.tolerance, contact: 1e-3 }
            } else {
                Target { force: settings.tolerance.max(1e-3), contact: 1.0 }
            };
            self.gap_times_pressure = next * self.modulus_times_size;
            let mut trial = state.clone();
            // The contributions of the elements at this configuration are known, except after a failure.
            let residual =
                if must_assemble { self.assemble(state, load) } else { self.assemble_again(state, load) };
            match self.equilibrate_from(residual, &mut trial, load, target, settings, effort) {
                Ok(_) => {
                    must_assemble = false;
                    met = last;
                    *state = trial;
                    gap = next;
                    factor = (factor * factor).max(CLOSING);
                }
                Err(failure) => {
                    must_assemble = true;
                    effort.cuts += 1;
                    factor = factor.sqrt();
                    if factor > 0.9 || matches!(failure.0, StopReason::TooLong | StopReason::Cancelled) {
                        return Err(failure);
                    }
                }
            }
        }
        state.moving = Some(Box::new(moving));
        Ok(())
    }

    /// Upper limit of [`NewtonSettings::final_gap`] for the displacements of `state`. The pressure under a
    /// smooth punch grows with its displacement `u`, so that a product `s` of gap and pressure keeps it away
    /// from the layer by about `s/u`. For that to stay small compared with `u`, `s` has to fall with `u^2`.
    fn gap_for(&self, state: &State<S>) -> f64 {
        let moved = state.displacement.iter().fold(0.0, |m: f64, u| m.max(u.abs()));
        (GAP_PART * (moved / self.shortest_side).powi(2)).max(MIN_GAP)
    }
}

impl<S: Dimension> Load<S> {
    /// The load at the fraction `part` of the way from this one to the load `to`.
    pub fn toward(&self, to: &Self, part: f64) -> Self {
        let mix = |a: &f64, b: &f64| if part == 1.0 { *b } else { a + part * (b - a) };
        let mixed = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| mix(a, b)).collect();
        Self {
            displacement: mixed(&self.displacement, &to.displacement),
            force: mixed(&self.force, &to.force),
            shift: self
                .shift
                .iter()
                .zip(&to.shift)
                .map(|(a, b)| S::Point::from_fn(|k| mix(&a[k], &b[k])))
                .collect(),
        }
    }
}
