//! Runs a plan: solves its steps concurrently and independently, with the same result at any number of
//! threads.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::Instant;

use elastocap_case::{Case, Mechanics};
use elastocap_mechanics::LayerState;

use crate::change::{ChangeSearch, note_changes};
use crate::deform::{
    DeformError, Deformation, Prepared, Solution, force_warning, prepare, prepare_with_drafts, shear_warning,
};
use crate::failure::StepFailure;
use crate::finished::FinishedStep;
use crate::load_steps::StepLoad;
use crate::model_error::{NotCompared, PlaneStrainCurve, is_compared, note_model_errors};
use crate::outcome::{Outcome, Row, Status, StepResult};
use crate::plan::{Options, Plan, PlannedStep};
use crate::route::{Bending, Bodies, Route, asked, route};
use crate::scene::{DeformedScene, scene_of};
use crate::sensitivity::note_sensitivities;
use crate::settings::FieldSettings;
use crate::shared_fields::SharedFields;
use crate::side_by_side::side_by_side;
use crate::step::{Solver, StepField};

/// Observes a run, and takes results that are too large to keep until its end.
///
/// The methods are called from several threads at once. The default implementations do nothing.
pub trait Observer: Sync {
    /// Work that all steps need has begun; `what` describes it.
    fn preparing(&self, what: &str) {
        let _ = what;
    }

    /// The finite elements of the layer are solved at every load. [`ControlFlow::Break`] stops the run.
    fn layer_solved(&self, solution: &Solution) -> ControlFlow<()> {
        let _ = solution;
        ControlFlow::Continue(())
    }

    /// Returns the result of a step from an earlier, interrupted run, if there is one. The step is then not
    /// solved again, and [`Observer::step_done`] follows at once.
    fn finished_before(&self, index: usize) -> Option<FinishedStep> {
        let _ = index;
        None
    }

    /// A step has begun.
    fn step_begun(&self, index: usize) {
        let _ = index;
    }

    /// The field of a step is solved; called only if the options request fields. [`ControlFlow::Break`] stops
    /// the run: no other step is begun.
    fn field_solved(&self, step: &StepResult, field: StepField) -> ControlFlow<()> {
        let _ = (step, field);
        ControlFlow::Continue(())
    }

    /// A step is done.
    fn step_done(&self, step: &StepResult) {
        let _ = step;
    }
}

/// An observer that does nothing.
impl Observer for () {}

/// Solves the steps of a plan. A step that cannot be solved is no error: its status says why.
///
/// `cancel` stops the run at the next opportunity. Results of finished steps are kept, and so are partial
/// results of the others: forces, and bounds that do not meet the tolerance yet.
pub fn run(
    case: &Case,
    plan: &Plan,
    options: &Options,
    cancel: &Arc<AtomicBool>,
    observer: &dyn Observer,
) -> Outcome {
    let run = Run::new(case, plan, options, cancel);
    run.solve(observer, None);
    run.outcome()
}

/// Solves the steps of a plan like [`run`], for one of many cases that share the solutions of equal fields.
/// The outcome is that of [`run`] except for its seconds.
pub fn run_sharing(
    case: &Case,
    plan: &Plan,
    options: &Options,
    cancel: &Arc<AtomicBool>,
    observer: &dyn Observer,
    shared: &Arc<SharedFields>,
) -> Outcome {
    let run = Run::new(case, plan, options, cancel);
    run.solve(observer, Some(shared));
    run.outcome()
}

/// Least number of unknowns of a mesh of the layer for drafts. On smaller meshes a load takes about a second,
/// as do the fields of the drafts, which made runs of four seconds a sixth slower (cases/comb-in-layer.toml).
/// Tuned: `time elastocap run cases/comb-in-layer.toml`.
const UNKNOWNS_OF_DRAFT: usize = 5000;

/// A run in progress. Its results so far can be taken while another thread still solves: a caller that cannot
/// wait for a stopped run, because some part of a solve is long and cannot be interrupted, leaves that thread
/// behind.
pub struct Run<'a> {
    case: &'a Case,
    plan: &'a Plan,
    options: &'a Options,
    cancel: &'a Arc<AtomicBool>,
    start: Instant,
    layer: OnceLock<Prepared>,
    /// The plane-strain curve with which the closed form is compared, if it is compared.
    better: OnceLock<Result<PlaneStrainCurve, NotCompared>>,
    /// The results of the distinct steps of the plan, in their order.
    solved: Mutex<Vec<Option<StepResult>>>,
    /// Drafts of the distinct steps, where the layer takes long.
    drafts: Mutex<Vec<Option<StepResult>>>,
    is_over: AtomicBool,
}

impl<'a> Run<'a> {
    /// A run before its start; for `cancel` see [`run`].
    pub fn new(case: &'a Case, plan: &'a Plan, options: &'a Options, cancel: &'a Arc<AtomicBool>) -> Self {
        let [solved, drafts] = [(); 2].map(|()| Mutex::new(vec![None; plan.distinct_steps().count()]));
        let (layer, better, is_over) = (OnceLock::new(), OnceLock::new(), AtomicBool::new(false));
        Self { case, plan, options, cancel, start: Instant::now(), layer, better, solved, drafts, is_over }
    }

    fn solved(&self) -> MutexGuard<'_, Vec<Option<StepResult>>> {
        self.solved.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn drafts(&self) -> MutexGuard<'_, Vec<Option<StepResult>>> {
        self.drafts.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The solver of the steps for a solved layer.
    fn solver<'b>(&'b self, layer: &'b Prepared, shared: Option<&Arc<SharedFields>>) -> Solver<'b> {
        let settings = FieldSettings {
            cancel: Some(Arc::clone(self.cancel)),
            shared: shared.cloned(),
            ..self.plan.solver_settings(self.case, self.options)
        };
        Solver {
            coarser: 0,
            case: self.case,
            settings,
            prune: self.options.prune,
            force_limit: self.plan.force_limit.or(layer.force_limit()),
            layer,
            base: None,
        }
    }

    /// Solves all steps. With `shared`, solutions of equal fields are taken from other cases.
    pub fn solve(&self, observer: &dyn Observer, shared: Option<&Arc<SharedFields>>) {
        let Self { case, plan, options, cancel, .. } = *self;
        let work: Vec<&PlannedStep> = plan.distinct_steps().collect();
        let solve = |solver: &Solver<'_>, step: &PlannedStep| {
            let found = observer.finished_before(step.index);
            if let Some(result) = found.and_then(|found| solver.restored(step, found)) {
                observer.step_done(&result);
                return Some(result);
            }
            observer.step_begun(step.index);
            let (mut result, field) = solver.solve(step);
            result.interrupted =
                cancel.load(Ordering::Relaxed) && matches!(result.row.status, Status::ToleranceNotReached(_));
            if let Some(field) = field.filter(|_| options.fields)
                && observer.field_solved(&result, field).is_break()
            {
                cancel.store(true, Ordering::Relaxed);
                return None;
            }
            observer.step_done(&result);
            Some(result)
        };
        let solve_all = |layer: &Prepared, slots: &[usize]| {
            let solver = self.solver(layer, shared);
            side_by_side(plan.at_once, slots.len(), cancel, |k| {
                let Some((&slot, step)) = slots.get(k).and_then(|slot| Some((slot, *work.get(*slot)?)))
                else {
                    return;
                };
                let result = solve(&solver, step);
                if let Some(place) = self.solved().get_mut(slot) {
                    *place = result;
                }
            });
        };
        let at_rest = self.slots_at_rest(&work);
        if let Some(&last) = at_rest.last() {
            let loads = vec![StepLoad::None; work.get(last).map_or(0, |step| step.index + 1)];
            solve_all(&prepare(case, &loads, plan.layer_memory_limit, cancel, &|_| ()), &at_rest);
        }
        let loaded: Vec<usize> = (0..work.len()).filter(|slot| !at_rest.contains(slot)).collect();
        let layer = self.layer.get_or_init(|| {
            let report = |what: &str| observer.preparing(what);
            let drafted = |layer: &Prepared| self.draft(layer, &work, &loaded);
            let watched = (&**cancel, &report as &(dyn Fn(&str) + Sync));
            prepare_with_drafts(case, &plan.loads(), plan.layer_memory_limit, watched, &drafted)
        });
        if let Prepared::FiniteElement(run) = layer
            && let Some(solution) = &run.solution
            && observer.layer_solved(solution).is_break()
        {
            cancel.store(true, Ordering::Relaxed);
        }
        solve_all(layer, &loaded);
        let solver = self.solver(layer, shared);
        if let Some(tolerance) = case.electrostatics.and_then(|settings| settings.change_tolerance) {
            let what = "steps are solved again for their change";
            observer.preparing(what);
            let report =
                |done: usize, count: usize| observer.preparing(&format!("{what}: {done} of {count}"));
            let (solver, work) = (&solver, work.as_slice());
            let (at_once, memory_limit) = (plan.at_once, plan.memory_limit);
            // A copy, so that `outcome` finds the earlier results until the end.
            let mut again = self.solved().clone();
            ChangeSearch { solver, work, at_once, memory_limit, cancel, tolerance, report: &report }
                .run(&mut again);
            *self.solved() = again;
        }
        if self.compares_models() {
            observer.preparing("the layer in plane strain, for the error of the closed form");
            let steps: Vec<StepResult> = self.solved().iter().flatten().cloned().collect();
            let found = PlaneStrainCurve::of(case, &steps, cancel, &|plane_case, plan, options| {
                run(plane_case, plan, options, cancel, &())
            });
            if !cancel.load(Ordering::Relaxed) {
                let _ = self.better.set(found);
            }
        }
        self.is_over.store(true, Ordering::Release);
    }

    /// Solves the fields of steps coarsely on the meshes of the layer so far, so that an interrupted run has
    /// a capacitance for each step whose load a mesh has reached. Small meshes have no drafts: their next
    /// mesh takes no longer.
    fn draft(&self, layer: &Prepared, work: &[&PlannedStep], slots: &[usize]) {
        let is_quick = match layer {
            Prepared::FiniteElement(run) => {
                run.meshes.last().is_none_or(|mesh| mesh.unknowns < UNKNOWNS_OF_DRAFT)
            }
            Prepared::StepByStep | Prepared::ClosedForm(_) => true,
        };
        if is_quick || !self.case.has_conductors() {
            return;
        }
        let solver = self.solver(layer, None);
        let solver = Solver { settings: solver.settings_of_draft(), ..solver };
        side_by_side(self.plan.at_once, slots.len(), self.cancel, |k| {
            let Some((&slot, step)) = slots.get(k).and_then(|slot| Some((slot, *work.get(*slot)?))) else {
                return;
            };
            let (mut result, _) = solver.solve(step);
            if result.row.capacitance_f.is_none() {
                return;
            }
            result.row.status = Status::Draft;
            result.reason = None;
            result.interrupted = true;
            if let Some(place) = self.drafts().get_mut(slot) {
                *place = Some(result);
            }
        });
    }

    /// Whether the model of the layer is compared with the next better one.
    fn compares_models(&self) -> bool {
        is_compared(self.case, self.options)
    }

    /// The indices in `work` of the steps that are solved before the layer is pressed: those without load, if
    /// the layer is solved by finite elements in three dimensions, which may take minutes.
    fn slots_at_rest(&self, work: &[&PlannedStep]) -> Vec<usize> {
        let is_slow = matches!(self.case.mechanics, Some(Mechanics::Solid(_))) && self.case.has_conductors();
        let is_at_rest = |step: &PlannedStep| step.load.is_zero();
        if !is_slow || work.iter().all(|step| is_at_rest(step)) {
            return Vec::new();
        }
        (0..work.len()).filter(|slot| work.get(*slot).is_some_and(|step| is_at_rest(step))).collect()
    }

    /// Takes the outcome so far from the run. Steps that are not finished count as not run, even if another
    /// thread is solving them.
    pub fn outcome(&self) -> Outcome {
        let (case, plan) = (self.case, self.plan);
        let lacks_better = self.compares_models() && self.better.get().is_none();
        let was_left = !self.is_over.load(Ordering::Acquire) || lacks_better;
        let solved = std::mem::take(&mut *self.solved());
        let drafts = std::mem::take(&mut *self.drafts());
        let solved = solved.into_iter().zip(drafts).map(|(solved, draft)| solved.or(draft));
        let layer = self.layer.get();
        let solver = layer.map(|layer| self.solver(layer, None));
        let not_run = |step: &PlannedStep| match &solver {
            Some(solver) => solver.not_run(step),
            None => StepResult::not_run(step),
        };
        let mut steps = in_order(plan, solved, &not_run);
        note_changes(case, &mut steps);
        let of_model = note_model_errors(case, self.better.get(), &mut steps);
        note_sensitivities(case, &mut steps);
        let conductors = case.driven_terminals();
        let measurement = case.has_conductors().then(|| case.measurement());
        let (layer_meshes, layer_seconds) = match layer {
            None | Some(Prepared::StepByStep | Prepared::ClosedForm(_)) => (Vec::new(), 0.0),
            Some(Prepared::FiniteElement(run)) => (run.meshes.clone(), run.seconds),
        };
        let is_stopped = |step: &StepResult| step.interrupted || step.row.status == Status::NotRun;
        Outcome {
            plan: plan.clone(),
            warnings: layer
                .map_or_else(Vec::new, |layer| layer_warnings(case, layer))
                .into_iter()
                .chain(of_model)
                .collect(),
            stopped: was_left || steps.iter().any(is_stopped),
            steps,
            conductors,
            measurement,
            layer_meshes,
            layer_seconds,
            solve_seconds: self.start.elapsed().as_secs_f64(),
            threads: rayon::current_num_threads(),
        }
    }
}

/// Warnings about the layer of all steps.
fn layer_warnings(case: &Case, layer: &Prepared) -> Vec<String> {
    match layer {
        Prepared::StepByStep => Vec::new(),
        Prepared::FiniteElement(run) => {
            let too_large = run.too_large.iter();
            too_large.map(|reason| format!("the layer is not refined further: {reason}")).collect()
        }
        Prepared::ClosedForm(run) => {
            let states = || run.states.iter().enumerate();
            let closed = |state: &Result<LayerState, DeformError>| {
                state.as_ref().ok().copied().map(Deformation::ClosedForm)
            };
            let of_force = force_warning(case, states().filter_map(|(_, s)| closed(s)), run.force_limit);
            let with_pose = |(k, state): (usize, &Result<_, _>)| Some((closed(state)?, case.pose(k)));
            of_force.into_iter().chain(shear_warning(states().filter_map(with_pose))).collect()
        }
    }
}

/// The results of all steps of a plan, from those of its distinct steps in order.
fn in_order(
    plan: &Plan,
    mut solved: impl Iterator<Item = Option<StepResult>>,
    not_run: &dyn Fn(&PlannedStep) -> StepResult,
) -> Vec<StepResult> {
    let mut steps: Vec<StepResult> = Vec::with_capacity(plan.steps.len());
    for step in &plan.steps {
        let result = match step.same_as {
            None => solved.next().flatten().unwrap_or_else(|| not_run(step)),
            Some(first) => match steps.get(first) {
                Some(original) => copy_of(original, step),
                None => not_run(step),
            },
        };
        steps.push(result);
    }
    steps
}

/// The result of a step that has the load and the scene of an earlier one.
fn copy_of(original: &StepResult, step: &PlannedStep) -> StepResult {
    let distance_m = original.row.distance_m.map(|_| step.pose.distance);
    let row = Row { distance_m, ..original.row.clone() };
    StepResult {
        index: step.index,
        same_as: step.same_as,
        seconds: Default::default(),
        row,
        ..original.clone()
    }
}

/// The steps of a plan with the deformed layer and bodies, but without a field: boxes, which have a grid
/// without a solve. A step that is solved on other shapes has a warning.
pub fn deform(case: &Case, plan: &Plan) -> Vec<StepResult> {
    let layer = prepare(case, &plan.loads(), plan.layer_memory_limit, &AtomicBool::new(false), &|_| ());
    let deformed = |step: &PlannedStep| {
        let mut result = StepResult::not_run(step);
        if let Err(failure) = deform_step(case, &layer, step, &mut result) {
            result.row.status = failure.into();
        }
        result
    };
    plan.steps.iter().map(deformed).collect()
}

fn deform_step(
    case: &Case,
    layer: &Prepared,
    step: &PlannedStep,
    result: &mut StepResult,
) -> Result<(), StepFailure> {
    let state = layer.deformation(case, step.index, step.load, true)?;
    result.row.top_displacement_m = Some(state.as_ref().map_or(0.0, |s| s.top_displacement()));
    result.row.compression = state.as_ref().map(|s| s.compression()).or(result.row.compression);
    if !case.has_conductors() {
        return Ok(());
    }
    let scene = scene_of(case, state.as_ref(), &step.pose)?;
    let bodies = Bodies::of(&scene.scene);
    let taken = route(bodies, Bending::found(case, &scene, state.as_ref(), step.pose.distance), asked(case))?;
    match bodies {
        Bodies::Boxes { .. } => {}
        Bodies::Outlines { .. } | Bodies::AnyShape => return Err(StepFailure::NoGrid),
    }
    if taken != Route::BOXES {
        result.warnings.push(shown_as_boxes(&scene, taken));
    }
    result.route = Some(taken);
    result.scene = Some(scene);
    Ok(())
}

/// The warning that a step shown as boxes is solved on other shapes.
fn shown_as_boxes(scene: &DeformedScene, taken: Route) -> String {
    let bodies = if scene.electrodes_are_bent {
        "the bent electrodes are shown as the boxes of their mean faces"
    } else {
        "the bodies are shown on a grid of boxes"
    };
    format!("{bodies}; a run solves this step by {taken}")
}
