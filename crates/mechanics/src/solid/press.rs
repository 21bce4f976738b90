//! A layer pressed to given loads on finer and finer meshes, until its force is known to a tolerance.
//!
//! The error of a force is estimated on each mesh alone, and is at least a multiple of the change of the
//! force from the meshes before.

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

/// The criteria that end the refinement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Refinement {
    /// Error of the force to reach, relative to the force.
    pub relative_tolerance: f64,
    /// The largest number of meshes.
    pub meshes: usize,
}

/// The result for one goal.
#[derive(Debug, Clone)]
pub struct Pressed<S: Dimension = Plane> {
    /// Forces and contact on the finest mesh that reached the goal.
    pub step: LayerStep,
    /// The index of that mesh among the levels.
    pub level: usize,
    /// The equilibrium.
    pub state: State<S>,
    /// The load of the equilibrium.
    pub load: Load<S>,
    /// The absolute error of the force or, where the goal is a force, of the compression; `None` with too few
    /// meshes.
    pub error: Option<f64>,
    /// The value that `error` belongs to, on each mesh that reached the goal, coarse to fine.
    pub refinement: Vec<f64>,
    /// The largest relative error of [`Places`], if it was estimated.
    pub places_error: Option<f64>,
    /// The smallest relative error that is ever stated for [`Places`].
    pub least_places_error: f64,
    /// Whether a finer mesh would not help: the error is within the tolerance, or is the least that is ever
    /// stated.
    pub(super) mesh_is_enough: bool,
    /// Whether `error` is within the tolerance.
    pub converged: bool,
}

/// Why a goal was not reached.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PressError {
    /// Newton's method stopped before the goal.
    #[error("{stopped}; the layer was followed to a compression of {compression:.4}")]
    Stopped {
        /// Compression of the last equilibrium.
        compression: f64,
        /// The point at which the load was given up, and the reason.
        stopped: Box<Stopped>,
    },
    /// The state found is not one of a layer under its indenter.
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

/// The results for all goals, in their order.
#[derive(Debug)]
pub struct Pressing<S: Dimension = Plane> {
    /// The meshes, coarse to fine.
    pub levels: Vec<Arc<Level<S>>>,
    /// The result for each goal.
    pub goals: Vec<Result<Pressed<S>, PressError>>,
    /// The error of the next mesh if it was too large for the memory.
    pub too_large: Option<ModelError>,
}

/// A layer at rest on a mesh.
pub(crate) struct Meshed<S: Dimension> {
    pub(crate) model: LayerModel<S>,
    /// The mesh in a form that can be refined, if the next mesh is a refinement of it.
    pub(crate) mesh: Option<Refinable<S>>,
    /// Size of the elements, relative to that of the other meshes.
    pub(crate) size: f64,
    /// The settings with which the layer is pressed on this mesh.
    pub(crate) settings: NewtonSettings<'static>,
}

/// Makes the layer on the mesh with the given index, from the levels before it and the indices of the goals
/// whose results are not known yet; `None` after the last mesh.
type NextMesh<'a, S> =
    dyn Fn(usize, &[Arc<Level<S>>], &[usize]) -> Option<Result<Meshed<S>, ModelError>> + 'a;

/// The least relative errors that are stated, where values scatter from mesh to mesh, or where the model
/// approximates the requested one.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct LeastErrors {
    /// The least error of a force, or of a compression, from a compression of [`LeastErrors::SMALL`] on.
    pub(crate) force: f64,
    /// The least error of a force, or of a compression, at the smallest loads; from there to a compression of
    /// [`LeastErrors::SMALL`] it falls in proportion to the compression.
    pub(crate) force_at_rest: f64,
    /// The least error of the numbers besides the force.
    pub(crate) numbers: f64,
}

impl LeastErrors {
    /// The compression below which [`LeastErrors::force_at_rest`] counts. It is not tuned.
    const SMALL: f64 = 0.05;

    /// The least error of a force, or of a compression, at this compression.
    fn of_force(&self, compression: f64) -> f64 {
        let small = (1.0 - compression / Self::SMALL).max(0.0);
        self.force + small * (self.force_at_rest - self.force)
    }
}

/// The layers that [`press_on`] presses.
pub(crate) struct Layers<'a, S: Dimension> {
    /// Makes the layer on the next mesh.
    pub(crate) meshed: &'a NextMesh<'a, S>,
    /// Whether there is memory for two such layers at once.
    pub(crate) room_for_two: &'a dyn Fn(&LayerModel<S>) -> bool,
    /// The least errors that are stated.
    pub(crate) least_errors: LeastErrors,
    /// The numbers to be computed besides the force.
    pub(crate) places: Option<&'a Places<'a, S>>,
    /// The largest number of meshes for these numbers after the force is known.
    pub(crate) for_places: usize,
    /// Receives the results of each mesh but the last.
    pub(crate) drafted: &'a Drafted<'a, S>,
}

/// Receives the results on the meshes so far before the next mesh is begun. On the first mesh the errors are
/// those estimated on it alone.
pub type Drafted<'a, S> = dyn Fn(Pressing<S>) + 'a;

/// A weighted mean of displacements: the index of each displacement among those of all nodes, and its weight.
pub type Mean = Vec<(usize, f64)>;

/// Numbers to be computed from an equilibrium besides the force, as the distance of two bodies in the layer.
pub struct Places<'a, S: Dimension> {
    /// The means of displacements that the numbers depend on.
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

/// The step of the difference quotients of the numbers, over the thickness of the layer. Not tuned: it only
/// has to lie above rounding errors and below strains that matter.
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
            let slopes = means.iter().zip(&slopes).filter(|(_, slopes)| slopes[k] != 0.0).flat_map(of_mean);
            WantedNumber { value, slopes: slopes.collect(), tolerance: tolerances[k] }
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
    report: &(dyn Fn(usize, usize) + Sync),
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
            // Whether as many meshes as are allowed for places were made after the force was known.
            let places_had_their_meshes = || {
                let before = levels.len().saturating_sub(layers.for_places);
                before > 0 && force_known(&levels[..before], g)
            };
            let places_known = || {
                numbers_met(levels, g, layers.least_errors.numbers)
                    || places_had_their_meshes()
                    || errors_stay(levels, g)
            };
            force_known(levels, g) && (goals[g].value() == 0.0 || places_known())
        };
        let wanted: Vec<bool> = (0..goals.len()).map(|g| !known(&levels, g)).collect();
        let force_is_known: Vec<bool> = (0..goals.len()).map(|g| force_known(&levels, g)).collect();
        let (coarser, report) = (levels.as_slice(), &|done: usize| report(k, done));
        let room = layers.room_for_two;
        let further =
            level.walk(coarser, goals, &order, &wanted, &force_is_known, &settings, &estimate, room, report);
        level.model.release();
        level.seconds = start.elapsed().as_secs_f64();
        levels.push(Arc::new(level));
        let done = order.iter().all(|&g| known(&levels, g));
        // Goals that this mesh did not reach would take longest on the next one.
        if k > 0 {
            order.truncate(further);
            order.retain(|&g| levels.last().is_none_or(|level| level.stopped[g].is_none()));
        }
        // Finer meshes are for goals that are not known yet. Where the layer snaps from fold to fold, each
        // load is needed to reach the next.
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
    // Also a run that was stopped on its first mesh states the errors estimated there.
    Ok(if cancel.load(Ordering::Relaxed) { drafted(pressing) } else { pressing })
}

/// If there is only one mesh so far, states the errors that were estimated on it for results whose errors are
/// not known otherwise.
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

/// The result for each goal on the levels so far.
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
    // Not tuned: it only shapes the first mesh.
    const OF_FORCES: f64 = 0.5;
    goals.iter().fold(0.0, |deepest: f64, goal| match *goal {
        Goal::Compression(compression) => deepest.max(compression),
        Goal::Force(_) => deepest.max(OF_FORCES),
    })
}

impl<S: Dimension> Reached<S> {
    /// The equilibrium as a result on this level with an unknown error.
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

    /// The results for goal `g` on all meshes but the finest that reached it, coarse to fine, each with the
    /// size of the elements. The change of a number from these meshes to the finest indicates its error; see
    /// [`error_on_finest`](super::mesh_error::error_on_finest). The errors of these results are not known.
    pub fn on_coarser_meshes(&self, g: usize) -> Vec<(f64, Pressed<S>)> {
        let reached =
            |(level, l): (usize, &Arc<Level<S>>)| Some((l.size, l.reached[g].as_ref()?.unjudged(level)));
        let mut coarser: Vec<_> = self.levels.iter().enumerate().filter_map(reached).collect();
        coarser.pop();
        coarser
    }

    /// Size of the elements of the mesh that a result is of, relative to those of the other meshes.
    pub fn size_of(&self, pressed: &Pressed<S>) -> f64 {
        self.levels[pressed.level].size
    }
}

/// The numbers besides the force on the last of the `levels`, if they were estimated there under goal `g`,
/// with errors of no less than `at_least`.
fn numbers_of<S: Dimension>(levels: &[Arc<Level<S>>], g: usize, at_least: f64) -> Option<Vec<Estimated>> {
    let (last, before) = levels.split_last()?;
    let estimated = &last.estimates[g].as_ref()?.numbers;
    let number = |(k, now): (usize, &Estimated)| {
        let before = Before::of(before, g, |level| Some(level.estimates[g].as_ref()?.numbers[k].value));
        let least = before.least_error::<S>(now.value, at_least)? / now.value.abs();
        Some(Estimated { error: now.error.max(least).max(at_least), ..*now })
    };
    estimated.iter().enumerate().map(number).collect()
}

/// Whether the numbers besides the force are known on the finest level that reached goal `g`: to their
/// tolerances, or to `at_least`, the least error that is stated.
fn numbers_met<S: Dimension>(levels: &[Arc<Level<S>>], g: usize, at_least: f64) -> bool {
    let met = |number: &Estimated| number.error <= number.tolerance.max(at_least);
    let finest = levels.iter().rposition(|level| level.reached[g].is_some());
    let numbers = finest.and_then(|finest| numbers_of(&levels[..=finest], g, at_least));
    numbers.is_none_or(|numbers| numbers.iter().all(met))
}

/// Whether the errors of the numbers besides the force have not decreased over two meshes: a singular strain,
/// as of rubber that folds at the edge of an electrode, has the same error on every mesh.
fn errors_stay<S: Dimension>(levels: &[Arc<Level<S>>], g: usize) -> bool {
    let error = |level: &Level<S>| {
        level.reached[g].as_ref()?;
        let numbers = &level.estimates[g].as_ref()?.numbers;
        numbers.iter().map(|number| number.error / number.tolerance).reduce(f64::max)
    };
    let [.., first, _, last] = levels else { return false };
    matches!((error(first), error(last)), (Some(first), Some(last)) if last > STAYS * first)
}

/// An error above this share of the one two meshes before has not decreased. Tuned:
/// `benches/layer_errors.py --plane`.
const STAYS: f64 = 0.8;

/// The result of all levels for goal `g`, with errors of no less than `at_least`; `None` if no level reached
/// the goal.
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
        // Without a load the result is exact on any mesh.
        _ if goals[g].value() == 0.0 => Some(0.0),
        Some(estimate) => {
            // A layer becomes stiffer as it is pressed, so that a compression has no larger relative error
            // than the force.
            let of_estimate = estimate.force * now.abs();
            let before = Before::of(&levels[..level], g, |l| l.step(g).map(value_of));
            let scatter = at_least.of_force(reached.step.compression);
            before.least_error::<S>(now, scatter).map(|least| of_estimate.max(least))
        }
        None => None,
    };
    let at_least_of_force = at_least.of_force(reached.step.compression) * now.abs();
    let tolerance = refinement.relative_tolerance * now.abs();
    let mesh_is_enough = error.is_some_and(|error| error <= tolerance.max(at_least_of_force));
    let error = error.map(|error| error.max(at_least_of_force));
    let converged = error.is_some_and(|error| error <= tolerance);
    let numbers = numbers_of(&levels[..=level], g, at_least.numbers);
    let places_error = numbers.and_then(|numbers| numbers.iter().map(|number| number.error).reduce(f64::max));
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

/// Bounds of the ratio of the remaining change of a value to its last step from mesh to mesh, in the plane.
/// Tuned:
/// `benches/layer_errors.py --plane`.
const REMAINING: [f64; 2] = [1.5, 4.0];

/// The values on the coarser meshes: a safeguard against underestimated errors on the finest one.
struct Before {
    /// The number of meshes on which the value was found.
    meshes: usize,
    /// The values from states without a fault, the finest mesh first; if all states had a fault, that of the
    /// finest mesh alone.
    sound: Vec<f64>,
}

impl Before {
    /// The values on `levels` under goal `g`, where `value` gives that of a level.
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

    /// The least error of the value `now`. In the plane, where meshes cost little, two coarser values are
    /// needed, since two values may agree by accident; `None` with fewer. Steps within twice the relative
    /// `scatter` do not indicate a rate of convergence.
    fn least_error<S: Dimension>(&self, now: f64, scatter: f64) -> Option<f64> {
        let largest =
            |step: f64| if step.abs() <= 2.0 * scatter * now.abs() { REMAINING[0] } else { REMAINING[1] };
        match (S::AXES, self.meshes, self.sound.as_slice()) {
            (2, 2.., [last, first, ..]) => {
                let (step, earlier) = (now - last, last - first);
                let remaining = remaining_over_step(step, earlier).clamp(REMAINING[0], largest(step));
                Some((remaining * step.abs()).max(0.5 * earlier.abs()))
            }
            (2, 2.., [last]) => Some(largest(now - last) * (now - last).abs()),
            (3, _, [last, ..]) => Some(0.5 * (now - last).abs()),
            _ => None,
        }
    }
}

/// The ratio of the remaining change of a value to its last `step` from mesh to mesh, if further steps shrink
/// by the same factor as this one from the `earlier` one. It is infinite where they do not shrink, as before
/// the meshes resolve the source of the error, and 0 where the value oscillates.
fn remaining_over_step(step: f64, earlier: f64) -> f64 {
    let ratio = step / earlier;
    match ratio {
        // The ratio is NaN where both steps are zero.
        _ if ratio.is_nan() || ratio <= 0.0 => 0.0,
        _ if ratio < 1.0 => ratio / (1.0 - ratio),
        _ => f64::INFINITY,
    }
}

/// The reason why goal `g` was not reached on any level.
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
