//! A layer pressed to given loads on finer and finer meshes, until its force is known to a tolerance.
//!
//! The error of a force is estimated on each mesh by itself, and is at least what the force changed by from the meshes before.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use super::dimension::{Dimension, Plane};
use super::estimate::{Estimated, WantedNumber};
use super::layer::{LayerModel, LayerStep};
use super::level::Reached;
use super::model::{Load, ModelError, State};
use super::newton::{NewtonSettings, Stopped};
use super::refinement::Refinable;
use super::soundness::StateFault;

pub use super::level::{Goal, Level};

/// When to stop refining.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Refinement {
    /// Error of the force to reach, relative to the force.
    pub relative_tolerance: f64,
    /// Meshes at most.
    pub meshes: usize,
}

/// The result for one goal.
#[derive(Debug, Clone)]
pub struct Pressed<S: Dimension = Plane> {
    /// Forces and contact on the finest mesh that reached it.
    pub step: LayerStep,
    /// Number of that mesh among the levels.
    pub level: usize,
    /// Its equilibrium.
    pub state: State<S>,
    /// The load of that equilibrium.
    pub load: Load<S>,
    /// Error of the force (of the compression, where the goal is a force), absolute; `None` with too few meshes.
    pub error: Option<f64>,
    /// The value that `error` belongs to, on each mesh that reached the goal, coarse to fine.
    pub refinement: Vec<f64>,
    /// The largest relative error of [`Places`], where it was estimated on this mesh by itself.
    pub places_error: Option<f64>,
    /// The smallest error that is ever stated for [`Places`], relative.
    pub least_places_error: f64,
    /// Whether a finer mesh would not help: the error is within the tolerance, or within what is stated at least.
    pub(super) mesh_is_enough: bool,
    /// Whether `error` is within the tolerance.
    pub converged: bool,
}

/// Why a goal was not reached.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PressError {
    /// Newton's method stopped before it.
    #[error("{stopped}; the layer was followed to a compression of {compression:.4}")]
    Stopped {
        /// Compression of the last equilibrium.
        compression: f64,
        /// Where and why.
        stopped: Box<Stopped>,
    },
    /// The state that was found is not one of a layer under its indenter.
    #[error("at a compression of {compression:.4} {fault}: the meshes are too coarse for this load")]
    Unsound {
        /// Compression of the state.
        compression: f64,
        /// The fault of that state.
        fault: StateFault,
    },
    /// The run was stopped on request.
    #[error("stopped on request")]
    Cancelled,
}

/// All goals, in the order they were asked for.
#[derive(Debug)]
pub struct Pressing<S: Dimension = Plane> {
    /// The meshes, coarse to fine.
    pub levels: Vec<Arc<Level<S>>>,
    /// The result for each goal.
    pub goals: Vec<Result<Pressed<S>, PressError>>,
    /// Why the next mesh was not solved on, where it was too large for the memory.
    pub too_large: Option<ModelError>,
}

/// A layer at rest on a mesh.
pub(crate) struct Meshed<S: Dimension> {
    pub(crate) model: LayerModel<S>,
    /// The mesh as one whose elements can be cut, where the next one is made from it.
    pub(crate) mesh: Option<Refinable<S>>,
    /// Size of its elements, to be compared with that of the other meshes.
    pub(crate) size: f64,
    /// How the layer is pressed on it.
    pub(crate) settings: NewtonSettings<'static>,
}

/// Makes the mesh of a number from the ones before it and the numbers of the goals that are not known yet; `None` after the last one.
type NextMesh<'a, S> =
    dyn Fn(usize, &[Arc<Level<S>>], &[usize]) -> Option<Result<Meshed<S>, ModelError>> + 'a;

/// The least relative errors that are stated, where values scatter from mesh to mesh, or what is solved is not quite what was asked for.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct LeastErrors {
    /// The least error of a force, or of a compression, from a compression of [`LeastErrors::SMALL`] on.
    pub(crate) force: f64,
    /// The least error of a force, or of a compression, at the smallest loads; from there to a compression of [`LeastErrors::SMALL`] it
    /// falls in proportion to the compression.
    pub(crate) force_at_rest: f64,
    /// The least error of the numbers that are known besides the force.
    pub(crate) numbers: f64,
}

impl LeastErrors {
    /// The compression below which [`LeastErrors::force_at_rest`] counts.
    const SMALL: f64 = 0.05;

    /// The least error of a force, or of a compression, at this compression.
    fn of_force(&self, compression: f64) -> f64 {
        let small = (1.0 - compression / Self::SMALL).max(0.0);
        self.force + small * (self.force_at_rest - self.force)
    }
}

/// The layers that [`press_on`] presses.
pub(crate) struct Layers<'a, S: Dimension> {
    /// The next one.
    pub(crate) meshed: &'a NextMesh<'a, S>,
    /// Whether there is memory for two such layers at once.
    pub(crate) room_for_two: &'a dyn Fn(&LayerModel<S>) -> bool,
    /// The least errors that are stated.
    pub(crate) least_errors: LeastErrors,
    /// The numbers that are to be known besides the force.
    pub(crate) places: Option<&'a Places<'a, S>>,
    /// Meshes that are solved on for that after the force is known, at most: it may depend on what is asked for weakly.
    pub(crate) for_places: usize,
    /// Takes the results of each mesh that another one follows.
    pub(crate) drafted: &'a Drafted<'a, S>,
}

/// Takes the results of the meshes so far before the next mesh is solved on. On the first mesh the errors are those that it estimates by
/// itself.
pub type Drafted<'a, S> = dyn Fn(Pressing<S>) + 'a;

/// A mean of displacements: for each of its displacements the place among those of all nodes, and its weight.
pub type Mean = Vec<(usize, f64)>;

/// Numbers that are read off an equilibrium, as the distance of two bodies in the layer, and are to be known besides the force.
pub struct Places<'a, S: Dimension> {
    /// The means of displacements that they depend on.
    pub means: &'a (dyn Fn(&LayerModel<S>) -> Vec<Mean> + Sync),
    /// The numbers, from these means in m.
    pub of: &'a (dyn Fn(&[f64]) -> Vec<f64> + Sync),
    /// The relative error to reach of each number, from all of them.
    pub tolerances: &'a (dyn Fn(&[f64]) -> Vec<f64> + Sync),
}

impl<S: Dimension> std::fmt::Debug for Places<'_, S> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Places")
    }
}

/// Displacement, over the thickness of the layer, by which slopes of numbers are found.
const SMALL: f64 = 1e-6;

impl<S: Dimension> Places<'_, S> {
    /// The numbers of the last equilibrium of a layer, and their slopes by displacements.
    fn wanted(&self, model: &LayerModel<S>) -> Vec<WantedNumber> {
        let means = (self.means)(model);
        let displacement = &model.state().displacement;
        let value = |mean: &Mean| mean.iter().map(|&(d, weight)| weight * displacement[d]).sum::<f64>();
        let values: Vec<f64> = means.iter().map(value).collect();
        let numbers = (self.of)(&values);
        let tolerances = (self.tolerances)(&numbers);
        let small = SMALL * model.thickness();
        let slope_by = |m: usize| {
            let moved = |by: f64| {
                let mut values = values.clone();
                values[m] += by;
                (self.of)(&values)
            };
            let (up, down) = (moved(small), moved(-small));
            up.iter().zip(&down).map(|(up, down)| (up - down) / (2.0 * small)).collect::<Vec<f64>>()
        };
        let slopes: Vec<Vec<f64>> = (0..means.len()).map(slope_by).collect();
        let number = |(k, value): (usize, f64)| {
            let of_mean = |(mean, slopes): (&Mean, &Vec<f64>)| {
                let slope = slopes[k];
                mean.iter().map(move |&(d, weight)| (d, slope * weight)).collect::<Vec<_>>()
            };
            let all = means.iter().zip(&slopes).filter(|(_, slopes)| slopes[k] != 0.0).flat_map(of_mean);
            WantedNumber { value, slopes: all.collect(), tolerance: tolerances[k] }
        };
        numbers.into_iter().enumerate().map(number).collect()
    }
}

/// Presses layers to each of `goals`, mesh after mesh. A mesh too large for the memory ends the refinement.
pub(crate) fn press_on<S: Dimension>(
    goals: &[Goal],
    refinement: &Refinement,
    layers: &Layers<'_, S>,
    cancel: &AtomicBool,
    tell: &(dyn Fn(usize, usize) + Sync),
) -> Result<Pressing<S>, ModelError> {
    let mut order: Vec<usize> = (0..goals.len()).collect();
    order.sort_by(|&a, &b| goals[a].value().total_cmp(&goals[b].value()));
    let mut levels: Vec<Arc<Level<S>>> = Vec::new();
    let mut too_large = None;
    let places = layers.places;
    let estimate = |model: &mut LayerModel<S>, step: &LayerStep| {
        let numbers = places.map_or_else(Vec::new, |places| places.wanted(model));
        model.estimate(step, refinement.relative_tolerance, numbers)
    };
    while let Some(next) = (layers.meshed)(levels.len(), &levels, &order) {
        let (k, start) = (levels.len(), Instant::now());
        let Meshed { model, mesh, size, settings } = match next {
            Ok(meshed) => meshed,
            Err(error @ (ModelError::TooLarge { .. } | ModelError::TooManyElements { .. })) if k > 0 => {
                too_large = Some(error);
                break;
            }
            Err(error) => return Err(error),
        };
        let settings = NewtonSettings { cancel: Some(cancel), ..settings };
        let mut level = Level::new(model, mesh, size, goals.len());
        let force_known = |levels: &[Arc<Level<S>>], g: usize| {
            judge(levels, goals, g, refinement, layers.least_errors)
                .is_some_and(|pressed| pressed.mesh_is_enough)
        };
        let known = |levels: &[Arc<Level<S>>], g: usize| {
            // For what else is to be known there are only so many meshes more.
            let many = || {
                let before = levels.len().saturating_sub(layers.for_places);
                before > 0 && force_known(&levels[..before], g)
            };
            let places_known =
                || numbers_met(levels, g, layers.least_errors.numbers) || many() || numbers_stay(levels, g);
            force_known(levels, g) && (goals[g].value() == 0.0 || places_known())
        };
        let wanted: Vec<bool> = (0..goals.len()).map(|g| !known(&levels, g)).collect();
        let good_enough: Vec<bool> = (0..goals.len()).map(|g| force_known(&levels, g)).collect();
        let (coarser, tell) = (levels.as_slice(), &|done: usize| tell(k, done));
        let room = layers.room_for_two;
        let further =
            level.walk(coarser, goals, &order, &wanted, &good_enough, &settings, &estimate, room, tell);
        level.model.release();
        level.seconds = start.elapsed().as_secs_f64();
        levels.push(Arc::new(level));
        let done = order.iter().all(|&g| known(&levels, g));
        // What neither this mesh nor one before reached, or only one before, takes longest on the next one.
        if k > 0 {
            order.truncate(further);
            order.retain(|&g| levels.last().is_none_or(|level| level.stopped[g].is_none()));
        }
        // Finer meshes are for what is not known yet. Where the layer falls from fold to fold each load is on the way to
        // the next.
        if settings.through_folds {
            let last = order.iter().rposition(|&g| !known(&levels, g));
            order.truncate(last.map_or(0, |last| last + 1));
        } else {
            order.retain(|&g| !known(&levels, g));
        }
        if cancel.load(Ordering::Relaxed) || done || order.is_empty() {
            break;
        }
        (layers.drafted)(drafted(judged(levels.clone(), goals, refinement, layers.least_errors)));
    }
    let pressing = Pressing { too_large, ..judged(levels, goals, refinement, layers.least_errors) };
    // What is left by a run that was stopped is a draft.
    Ok(if cancel.load(Ordering::Relaxed) { drafted(pressing) } else { pressing })
}

/// Gives the results of the only mesh the errors that this mesh estimates by itself, where no other error is known.
fn drafted<S: Dimension>(mut pressing: Pressing<S>) -> Pressing<S> {
    if let [only] = pressing.levels.as_slice() {
        for (found, estimate) in pressing.goals.iter_mut().zip(&only.estimates) {
            let (Ok(pressed), Some(estimate)) = (found, estimate) else { continue };
            let error = estimate.force * pressed.refinement.last().map_or(0.0, |value| value.abs());
            pressed.error = pressed.error.or(Some(error));
            let numbers = estimate.numbers.iter().map(|number| number.error).reduce(f64::max);
            pressed.places_error = pressed.places_error.or(numbers);
        }
    }
    pressing
}

/// The result for each goal on the levels that there are.
fn judged<S: Dimension>(
    levels: Vec<Arc<Level<S>>>,
    goals: &[Goal],
    refinement: &Refinement,
    least_errors: LeastErrors,
) -> Pressing<S> {
    let goal =
        |g: usize| judge(&levels, goals, g, refinement, least_errors).ok_or_else(|| why_not(&levels, g));
    let goals = (0..goals.len()).map(goal).collect();
    Pressing { levels, goals, too_large: None }
}

/// The deepest compression among the goals; an upper guess where they are forces.
pub fn deepest(goals: &[Goal]) -> f64 {
    const OF_FORCES: f64 = 0.5;
    goals.iter().fold(0.0, |deepest: f64, goal| match *goal {
        Goal::Compression(compression) => deepest.max(compression),
        Goal::Force(_) => deepest.max(OF_FORCES),
    })
}

impl<S: Dimension> Reached<S> {
    /// It as a result on this level, of whose error nothing is known.
    fn unjudged(&self, level: usize) -> Pressed<S> {
        Pressed {
            step: self.step,
            level,
            state: self.state.clone(),
            load: self.load.clone(),
            error: None,
            refinement: Vec::new(),
            places_error: None,
            least_places_error: 0.0,
            mesh_is_enough: false,
            converged: false,
        }
    }
}

impl<S: Dimension> Pressing<S> {
    /// The layer that a result is of.
    pub fn model_of(&self, pressed: &Pressed<S>) -> &LayerModel<S> {
        &self.levels[pressed.level].model
    }

    /// Goal `g` on all meshes but the finest that reached it, coarse to fine, each with the size of its elements: how anything that is
    /// read off a state moves from there to the finest says how well it is known; see [`error_on_finest`](super::mesh_error::error_on_finest). Their
    /// own errors are not judged.
    pub fn on_coarser_meshes(&self, g: usize) -> Vec<(f64, Pressed<S>)> {
        let reached =
            |(level, l): (usize, &Arc<Level<S>>)| Some((l.size, l.reached[g].as_ref()?.unjudged(level)));
        let mut all: Vec<_> = self.levels.iter().enumerate().filter_map(reached).collect();
        all.pop();
        all
    }

    /// Size of the elements of the mesh that a result is of, to be compared with those of the other meshes.
    pub fn size_of(&self, pressed: &Pressed<S>) -> f64 {
        self.levels[pressed.level].size
    }
}

/// The numbers besides the force on the last level, if they were estimated there under goal `g`.
fn numbers_of<S: Dimension>(levels: &[Arc<Level<S>>], g: usize, at_least: f64) -> Option<Vec<Estimated>> {
    let (last, before) = levels.split_last()?;
    let own = &last.estimates[g].as_ref()?.numbers;
    let number = |(k, now): (usize, &Estimated)| {
        let before = Before::of(before, g, |level| Some(level.estimates[g].as_ref()?.numbers[k].value));
        let least = before.least_error::<S>(now.value, at_least)? / now.value.abs();
        Some(Estimated { error: now.error.max(least).max(at_least), ..*now })
    };
    own.iter().enumerate().map(number).collect()
}

/// Whether the numbers besides the force are known on the finest level that reached goal `g`: to their tolerances, or to the error that
/// is stated at least.
fn numbers_met<S: Dimension>(levels: &[Arc<Level<S>>], g: usize, at_least: f64) -> bool {
    let met = |number: &Estimated| number.error <= number.tolerance.max(at_least);
    let finest = levels.iter().rposition(|level| level.reached[g].is_some());
    let numbers = finest.and_then(|finest| numbers_of(&levels[..=finest], g, at_least));
    numbers.is_none_or(|all| all.iter().all(met))
}

/// Whether the errors of these numbers have not become smaller over two meshes: what is strained without limit, as rubber that folds at
/// the edge of an electrode, looks the same on every mesh.
fn numbers_stay<S: Dimension>(levels: &[Arc<Level<S>>], g: usize) -> bool {
    let error = |level: &Level<S>| {
        level.reached[g].as_ref()?;
        let numbers = &level.estimates[g].as_ref()?.numbers;
        numbers.iter().map(|number| number.error / number.tolerance).reduce(f64::max)
    };
    let [.., first, _, last] = levels else { return false };
    matches!((error(first), error(last)), (Some(first), Some(last)) if last > STAYS * first)
}

/// Part of an error above which it counts as no smaller, two meshes later.
const STAYS: f64 = 0.8;

/// The result of all levels for goal `g`; `None` if none reached it.
fn judge<S: Dimension>(
    levels: &[Arc<Level<S>>],
    goals: &[Goal],
    g: usize,
    refinement: &Refinement,
    at_least: LeastErrors,
) -> Option<Pressed<S>> {
    let (level, reached) =
        levels.iter().enumerate().rev().find_map(|(k, l)| Some((k, l.reached[g].as_ref()?)))?;
    let value_of = |step: &LayerStep| match goals[g] {
        Goal::Compression(_) => step.force,
        Goal::Force(_) => step.compression,
    };
    let value = |r: &Reached<S>| value_of(&r.step);
    let values: Vec<f64> = levels.iter().filter_map(|l| Some(value(l.reached[g].as_ref()?))).collect();
    let now = value(reached);
    let estimate = levels[level].estimates[g].as_ref();
    let error = match estimate {
        // Nothing presses: no mesh can be wrong about it.
        _ if goals[g].value() == 0.0 => Some(0.0),
        Some(estimate) => {
            // A layer becomes stiffer as it is pressed, so that a compression has no larger relative error than the force.
            let of_estimate = estimate.force * now.abs();
            let before = Before::of(&levels[..level], g, |l| l.step(g).map(value_of));
            let scatter = at_least.of_force(reached.step.compression);
            before.least_error::<S>(now, scatter).map(|least| of_estimate.max(least))
        }
        None => None,
    };
    let at_least_of_force = at_least.of_force(reached.step.compression) * now.abs();
    let asked = refinement.relative_tolerance * now.abs();
    let mesh_is_enough = error.is_some_and(|error| error <= asked.max(at_least_of_force));
    let error = error.map(|error| error.max(at_least_of_force));
    let converged = error.is_some_and(|error| error <= asked);
    let numbers = numbers_of(&levels[..=level], g, at_least.numbers);
    let places_error = numbers.and_then(|all| all.iter().map(|number| number.error).reduce(f64::max));
    let (refinement, least_places_error) = (values, at_least.numbers);
    Some(Pressed {
        error,
        refinement,
        places_error,
        least_places_error,
        mesh_is_enough,
        converged,
        ..reached.unjudged(level)
    })
}

/// The change of a value that is still to come in the plane, over its last step from mesh to mesh, at least and at most.
const LEFT: [f64; 2] = [1.5, 4.0];

/// A value on the meshes before one: a guard against errors that are estimated too small on that mesh by itself.
struct Before {
    /// On how many of them it was found.
    meshes: usize,
    /// The value on those whose state had no fault, the last of them first; where each had one, the last one alone.
    sound: Vec<f64>,
}

impl Before {
    fn of<S: Dimension>(
        levels: &[Arc<Level<S>>],
        g: usize,
        value: impl Fn(&Level<S>) -> Option<f64>,
    ) -> Self {
        let found: Vec<(bool, f64)> =
            levels.iter().rev().filter_map(|l| Some((l.reached[g].is_some(), value(l)?))).collect();
        let mut sound: Vec<f64> = found.iter().filter(|(sound, _)| *sound).map(|(_, value)| *value).collect();
        if sound.is_empty() {
            sound.extend(found.first().map(|(_, value)| *value));
        }
        Self { meshes: found.len(), sound }
    }

    /// The least error of the value `now`. In the plane, where meshes cost little, it has to have been found on two before, since two may be
    /// as wrong as each other by accident; `None` where it was not. Steps of twice the relative `scatter` say nothing of how they will fall.
    fn least_error<S: Dimension>(&self, now: f64, scatter: f64) -> Option<f64> {
        let most = |step: f64| if step.abs() <= 2.0 * scatter * now.abs() { LEFT[0] } else { LEFT[1] };
        match (S::AXES, self.meshes, self.sound.as_slice()) {
            (2, 2.., [last, first, ..]) => {
                let (step, earlier) = (now - last, last - first);
                let left = left_of(step, earlier).clamp(LEFT[0], most(step));
                Some((left * step.abs()).max(0.5 * earlier.abs()))
            }
            (2, 2.., [last]) => Some(most(now - last) * (now - last).abs()),
            (3, _, [last, ..]) => Some(0.5 * (now - last).abs()),
            _ => None,
        }
    }
}

/// The change of a value that is still to come, over its last `step` from mesh to mesh, if the steps go on to fall as they did from the
/// `earlier` one: where meshes do not resolve yet what makes the error, they hardly fall. 0 where the value goes up and down.
fn left_of(step: f64, earlier: f64) -> f64 {
    let falls = step / earlier;
    match falls {
        // Also where both are zero.
        _ if falls.is_nan() || falls <= 0.0 => 0.0,
        _ if falls < 1.0 => falls / (1.0 - falls),
        _ => f64::INFINITY,
    }
}

fn why_not<S: Dimension>(levels: &[Arc<Level<S>>], g: usize) -> PressError {
    // The mesh that came farthest is the most informative.
    let stopped = levels.iter().filter_map(|l| {
        let stopped = l.stopped[g].clone()?;
        Some((l.model.compression(), stopped))
    });
    let fault = levels.iter().rev().find_map(|l| l.fault(g));
    if let Some((compression, fault)) = fault {
        return PressError::Unsound { compression, fault };
    }
    match stopped.max_by(|a, b| a.0.total_cmp(&b.0)) {
        Some((compression, stopped)) => PressError::Stopped { compression, stopped },
        None => PressError::Cancelled,
    }
}
