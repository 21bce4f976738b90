//! The equilibria of a layer under several loads on one mesh: each load is followed from the one before, or
//! its equilibrium is searched for near that of a coarser mesh.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use super::dimension::{Dimension, Plane};
use super::estimate::Estimate;
use super::layer::{LayerModel, LayerStep};
use super::model::{Load, State};
use super::newton::{Effort, NewtonSettings, StopReason, Stopped};
use super::refinement::Refinable;
use super::soundness::StateFault;

/// A load to reach.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Goal {
    /// Displacement of the indenter over the thickness.
    Compression(f64),
    /// Force on the whole layer, positive in compression: in N, in the plane in N per metre of width.
    Force(f64),
}

impl Goal {
    /// The compression or the force.
    pub(super) fn value(self) -> f64 {
        match self {
            Self::Compression(value) | Self::Force(value) => value,
        }
    }
}

/// A mesh, and the equilibria found on it.
#[derive(Debug)]
pub struct Level<S: Dimension = Plane> {
    /// The layer on this mesh.
    pub model: LayerModel<S>,
    /// The mesh in a form that can be refined, if the next mesh is a refinement of it.
    pub(super) mesh: Option<Refinable<S>>,
    /// Size of the elements, relative to those of the other meshes.
    pub(super) size: f64,
    /// Wall-clock seconds spent on this mesh.
    pub seconds: f64,
    /// The equilibrium found for each goal; `None` for goals that were not reached.
    pub(super) reached: Vec<Option<Reached<S>>>,
    /// For each goal, why it was not reached, if Newton's method stopped before it.
    pub(super) stopped: Vec<Option<Box<Stopped>>>,
    /// States found for goals that do not count as reached because of a fault. On a finer mesh, the
    /// equilibrium is searched for near them.
    faulty: Vec<Option<(Reached<S>, StateFault)>>,
    /// The estimated errors of the states found for the goals, including those with a fault.
    pub(super) estimates: Vec<Option<Estimate>>,
}

/// Estimates the errors of the last equilibrium of a layer.
pub(super) type Estimator<'a, S> = dyn Fn(&mut LayerModel<S>, &LayerStep) -> Estimate + Sync + 'a;

/// The equilibrium found for a goal.
#[derive(Debug, Clone)]
pub(super) struct Reached<S: Dimension> {
    /// Forces and contact.
    pub(super) step: LayerStep,
    /// The configuration.
    pub(super) state: State<S>,
    /// The load under which it is in equilibrium.
    pub(super) load: Load<S>,
}

/// A state found for a goal. It counts as reached if it has no fault.
struct Candidate<S: Dimension> {
    /// Forces and contact.
    step: LayerStep,
    /// The configuration.
    state: State<S>,
    /// The load under which it is in equilibrium.
    load: Load<S>,
    /// The first fault that was found.
    fault: Option<StateFault>,
    /// The estimated errors; `None` at rest.
    estimate: Option<Estimate>,
}

/// The result of the search near the equilibrium of a coarser mesh: `None` if none was found near it, so that
/// the load has to be followed.
type SearchResult<S> = Option<Result<Candidate<S>, Box<Stopped>>>;

impl<S: Dimension> Candidate<S> {
    /// The last equilibrium of `model`, to which `step` belongs.
    fn of(model: &mut LayerModel<S>, step: LayerStep, estimator: &Estimator<'_, S>) -> Self {
        let estimate = Some(estimator(model, &step));
        let (state, load) = (model.state().clone(), model.load().clone());
        Self { step, state, load, fault: model.fault(step.force), estimate }
    }

    /// Searches for the equilibrium of a goal near that of a coarser layer.
    fn near(
        (coarser, reached): (&LayerModel<S>, &Reached<S>),
        model: &mut LayerModel<S>,
        goal: Goal,
        settings: &NewtonSettings,
        estimator: &Estimator<'_, S>,
    ) -> SearchResult<S> {
        let mut take_over = |force: Option<f64>| {
            model.take_over(coarser, &reached.state, reached.step.compression, force, settings)
        };
        let step = match goal {
            Goal::Compression(_) => Ok(take_over(None)?),
            Goal::Force(force) => {
                let step = take_over(Some(force)).or_else(|| take_over(None))?;
                if step.meets(force, settings) { Ok(step) } else { model.press_with(force, settings) }
            }
        };
        Some(step.map(|step| Self::of(model, step, estimator)))
    }

    /// Follows the load from the present state of `model`.
    fn after(
        model: &mut LayerModel<S>,
        goal: Goal,
        settings: &NewtonSettings,
        estimator: &Estimator<'_, S>,
    ) -> Result<Self, Box<Stopped>> {
        let step = match goal {
            Goal::Compression(compression) => model.press(compression, settings),
            Goal::Force(force) => model.press_with(force, settings),
        };
        step.map(|step| Self::of(model, step, estimator))
    }
}

impl<S: Dimension> Level<S> {
    /// A level without equilibria.
    pub(super) fn new(model: LayerModel<S>, mesh: Option<Refinable<S>>, size: f64, goals: usize) -> Self {
        Self {
            model,
            mesh,
            size,
            seconds: 0.0,
            reached: vec![None; goals],
            stopped: vec![None; goals],
            faulty: vec![None; goals],
            estimates: vec![None; goals],
        }
    }

    /// Presses to the goals from the smallest up, until one is not reached. Equilibria of goals that are not
    /// `wanted` are not kept. Where one of the `coarser` meshes has an equilibrium under a load, the one on
    /// this mesh is searched for near it, two at a time where there is `room_for_two` layers; otherwise the
    /// load is followed, unless its `force_is_known` or [`NewtonSettings::only_near`] leaves the goal to the
    /// next mesh. Returns the number of goals in `order` before the one at which it ended, whether they were
    /// reached or left out.
    pub(super) fn walk(
        &mut self,
        coarser: &[Arc<Self>],
        goals: &[Goal],
        order: &[usize],
        wanted: &[bool],
        force_is_known: &[bool],
        settings: &NewtonSettings,
        estimator: &Estimator<'_, S>,
        room_for_two: &dyn Fn(&LayerModel<S>) -> bool,
        report: &(dyn Fn(usize) + Sync),
    ) -> usize {
        let coarser = if settings.from_coarser { coarser } else { &[] };
        let finest = |g: usize| coarser.iter().rev().find(|level| level.to_start_from(g).is_some());
        let near =
            |g: usize| finest(g).and_then(|level| level.to_start_from(g)).filter(|_| goals[g].value() != 0.0);
        let is_sound = |g: usize| finest(g).is_some_and(|level| level.reached[g].is_some());
        let mut searched = self.side_by_side(&near, goals, order, settings, estimator, room_for_two, report);
        for (done, &g) in order.iter().enumerate() {
            if settings.cancelled() {
                return done;
            }
            let found = if goals[g].value() == 0.0 {
                let (state, load) = (self.model.state().clone(), self.model.load().clone());
                Ok(Candidate { step: self.at_rest(), state, load, fault: None, estimate: None })
            } else {
                let searched = match searched[g].take() {
                    Some(searched) => searched,
                    None => {
                        let model = &mut self.model;
                        near(g).and_then(|n| Candidate::near(n, model, goals[g], settings, estimator))
                    }
                };
                if searched.is_none() && settings.only_near && is_sound(g) {
                    continue;
                }
                if searched.is_none() && force_is_known[g] {
                    self.stopped[g] = Some(Stopped::not_near());
                    continue;
                }
                searched.unwrap_or_else(|| Candidate::after(&mut self.model, goals[g], settings, estimator))
            };
            match found {
                Ok(Candidate { step, state, load, fault, estimate }) => {
                    self.estimates[g] = estimate;
                    if wanted[g] {
                        let (state, load) = (state.clone(), load.clone());
                        self.keep(goals, g, Reached { step, state, load }, fault);
                    }
                    // The next load is followed from this state, also if it was found on the twin.
                    self.model.set_equilibrium(state, load);
                }
                // A goal that was cancelled may still be reachable.
                Err(stopped) if stopped.reason == StopReason::Cancelled => return done,
                Err(stopped) => {
                    for &g in &order[done..] {
                        self.stopped[g] = Some(stopped.clone());
                    }
                    return done;
                }
            }
            report(done + 1);
        }
        order.len()
    }

    /// Searches for the equilibria near those of a coarser mesh on two layers at once, each on one thread.
    /// The layer of this level is afterwards in the state it was in before. Nothing is searched if there are
    /// fewer than two such equilibria, only one thread, or no `room_for_two`.
    fn side_by_side<'a>(
        &mut self,
        near: &(dyn Fn(usize) -> Option<(&'a LayerModel<S>, &'a Reached<S>)> + Sync),
        goals: &[Goal],
        order: &[usize],
        settings: &NewtonSettings,
        estimator: &Estimator<'_, S>,
        room_for_two: &dyn Fn(&LayerModel<S>) -> bool,
        report: &(dyn Fn(usize) + Sync),
    ) -> Vec<Option<SearchResult<S>>> {
        let mut searched: Vec<Option<SearchResult<S>>> = goals.iter().map(|_| None).collect();
        let starts: Vec<_> = order.iter().filter_map(|&g| Some((g, near(g)?))).collect();
        if starts.len() < 2 || rayon::current_num_threads() < 2 {
            return searched;
        }
        if !room_for_two(&self.model) {
            return searched;
        }
        let Some(mut twin) = self.model.twin() else { return searched };
        let start = (self.model.state().clone(), self.model.load().clone());
        let done = AtomicUsize::new(0);
        let each_second = |model: &mut LayerModel<S>, first: usize| -> Vec<(usize, SearchResult<S>)> {
            let mut found = Vec::new();
            for &(g, start) in starts.iter().skip(first).step_by(2) {
                if settings.cancelled() {
                    break;
                }
                found.push((g, Candidate::near(start, model, goals[g], settings, estimator)));
                report(done.fetch_add(1, Ordering::Relaxed) + 1);
            }
            found
        };
        let (even, odd) = rayon::join(|| each_second(&mut self.model, 0), || each_second(&mut twin, 1));
        // A load without an equilibrium near the coarser one is followed from the load before it, not from
        // the last one found above.
        self.model.set_equilibrium(start.0, start.1);
        for (g, found) in even.into_iter().chain(odd) {
            searched[g] = Some(found);
        }
        searched
    }

    /// The layer at rest, before the indenter closes its first gap.
    fn at_rest(&self) -> LayerStep {
        self.model.step(Effort { smallest_j: 1.0, ..Effort::default() })
    }

    /// Stores the equilibrium found for a goal among the reached ones, or among the faulty ones if it has a
    /// fault.
    fn keep(&mut self, goals: &[Goal], g: usize, mut reached: Reached<S>, fault: Option<StateFault>) {
        if let Some(fault) = fault {
            self.faulty[g] = Some((reached, fault));
            return;
        }
        if let Goal::Compression(compression) = goals[g] {
            reached.step.compression = compression; // equal up to rounding
        }
        self.reached[g] = Some(reached);
    }

    /// The layer and its equilibrium under goal `g`, if it was reached.
    fn equilibrium(&self, g: usize) -> Option<(&LayerModel<S>, &Reached<S>)> {
        let reached = self.reached.get(g)?.as_ref()?;
        Some((&self.model, reached))
    }

    /// The compression and the fault of the state found for goal `g`, if it has a fault.
    pub(super) fn fault(&self, g: usize) -> Option<(f64, StateFault)> {
        self.faulty[g].as_ref().map(|(reached, fault)| (reached.step.compression, *fault))
    }

    /// The step found for goal `g`, with or without a fault.
    pub(super) fn step(&self, g: usize) -> Option<&LayerStep> {
        self.to_start_from(g).map(|(_, reached)| &reached.step)
    }

    /// The state near which the equilibrium under goal `g` may be searched for on a finer mesh.
    fn to_start_from(&self, g: usize) -> Option<(&LayerModel<S>, &Reached<S>)> {
        self.equilibrium(g)
            .or_else(|| self.faulty.get(g)?.as_ref().map(|(reached, _)| (&self.model, reached)))
    }

    /// The layer and the state found for goal `g`, with or without a fault.
    pub(super) fn start(&self, g: usize) -> Option<(&LayerModel<S>, &State<S>)> {
        self.to_start_from(g).map(|(model, reached)| (model, &reached.state))
    }

    /// The layer and its configuration under goal `g`, if that was reached.
    pub fn state(&self, g: usize) -> Option<(&LayerModel<S>, &State<S>)> {
        self.equilibrium(g).map(|(model, reached)| (model, &reached.state))
    }
}

#[cfg(test)]
mod tests {
    use super::super::dimension::Space;
    use super::super::layer::{End, Indenter, LayerMesh};
    use super::super::obstacle::IndenterProfile;
    use super::super::space::layer::{SideCondition, SpaceLayerMesh};
    use super::*;
    use elastocap_materials::Rubber;

    fn layer(n: usize) -> LayerModel<Space> {
        let mesh = SpaceLayerMesh::new(LayerMesh::uniform(1.0, 2.0, n, 0.5, 1), 0.8, n);
        let ball = Indenter::Smooth(IndenterProfile::Sphere { radius: 1.5 });
        let (rubber, free) = (Rubber::neo_hookean(1.0), SideCondition::Free);
        LayerModel::of_finite_width(&mesh, rubber, ball, End::Free, free).unwrap()
    }

    #[test]
    fn a_load_that_is_not_found_near_the_coarser_one_is_followed_alike_on_one_thread_and_on_two() {
        let goals = [0.02, 0.05, 0.1].map(Goal::Compression);
        let (order, wanted) = ([0, 1, 2], [true; 3]);
        let settings = NewtonSettings { first_step: 0.5, ..NewtonSettings::default() };
        let mut coarser = Level::new(layer(3), None, 1.0, goals.len());
        let estimator =
            |model: &mut LayerModel<Space>, step: &LayerStep| model.estimate(step, 0.1, Vec::new());
        coarser.walk(&[], &goals, &order, &wanted, &[false; 3], &settings, &estimator, &|_| false, &|_| ());
        assert!(coarser.reached.iter().all(Option::is_some), "{:?}", coarser.fault(0));
        // No equilibrium is found near a state that is not a number.
        let first = coarser.reached[0].as_mut().unwrap();
        first.state.moving = None;
        first.state.displacement.fill(f64::NAN);
        let coarser = [Arc::new(coarser)];
        let walked = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let mut level = Level::new(layer(4), None, 0.75, goals.len());
            pool.install(|| {
                level.walk(
                    &coarser,
                    &goals,
                    &order,
                    &wanted,
                    &[false; 3],
                    &settings,
                    &estimator,
                    &|_| true,
                    &|_| (),
                )
            });
            let step = |k: usize| level.reached[k].as_ref().map(|r| (r.step.force, r.step.effort.solves));
            [0, 1, 2].map(|k| step(k).unwrap())
        };
        assert_eq!(walked(1), walked(2));
    }
}
