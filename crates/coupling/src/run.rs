//! Carries out a plan: its steps side by side, each on its own, the result the same at any number of threads.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use elastocap_electrostatics::Settings;

use crate::case::Case;
use crate::curve::{Outcome, Status, StepResult};
use crate::deform::{Prepared, prepare};
use crate::plan::{Options, Plan, PlannedStep};
use crate::results::{OutputError, OutputFolder, field_file, layer_files, stage_field};
use crate::scene_of::scene_of;
use crate::step::Solver;

/// What a run tells while it works.
#[derive(Debug, Clone, Copy)]
pub enum Progress<'a> {
    /// Work that all steps need, in words.
    Preparing(&'a str),
    /// A step was begun.
    Begun(usize),
    /// A step is done.
    Done(&'a StepResult),
}

/// Solves the steps of a plan.
///
/// Fields go into `folder` as soon as they are there, if one is given and `options` ask for them. `cancel` stops the run
/// at the next opportunity; steps that are done by then are kept.
///
/// # Errors
/// When a field cannot be written. A step that cannot be solved is no error: its status says why.
pub fn run(
    case: &Case,
    plan: &Plan,
    options: &Options,
    folder: Option<&OutputFolder>,
    cancel: &Arc<AtomicBool>,
    tell: &(dyn Fn(Progress<'_>) + Sync),
) -> Result<Outcome, OutputError> {
    let start = Instant::now();
    let settings = Settings { cancel: Some(Arc::clone(cancel)), ..plan.solver_settings(case, options) };
    let layer = prepare(case, plan, cancel, &|what| tell(Progress::Preparing(what)));
    let written = folder.filter(|_| options.fields);
    let mut warnings = Vec::new();
    if let Prepared::FiniteElement(run) = &layer {
        warnings
            .extend(run.too_large.iter().map(|reason| format!("the layer is not refined further: {reason}")));
        if let (Some(solution), Some(folder)) = (&run.solution, written) {
            warnings.extend(layer_files::stage(folder, solution)?);
        }
    }
    let solver =
        Solver { case, settings, prune: options.prune, force_limit: plan.force_limit, layer: &layer };
    let work: Vec<&PlannedStep> = plan.distinct_steps().collect();
    let done: Vec<Mutex<Option<StepResult>>> = work.iter().map(|_| Mutex::new(None)).collect();
    let broken: Mutex<Option<OutputError>> = Mutex::new(None);
    let next = AtomicUsize::new(0);
    let take_steps = || {
        while !cancel.load(Ordering::Relaxed) {
            let slot = next.fetch_add(1, Ordering::Relaxed);
            let (Some(step), Some(place)) = (work.get(slot), done.get(slot)) else { return };
            tell(Progress::Begun(step.index));
            let (mut result, field) = solver.solve(step);
            if let (Some(folder), Some(field)) = (written, field)
                && let Err(error) = stage_field(folder, &mut result, field)
            {
                *broken.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
                // Nothing can be kept: the other steps need not be done.
                cancel.store(true, Ordering::Relaxed);
                return;
            }
            tell(Progress::Done(&result));
            *place.lock().unwrap_or_else(PoisonError::into_inner) = Some(result);
        }
    };
    // Not a parallel iterator: while a solve waits for a part of itself, its thread must not begin another step.
    rayon::scope(|scope| {
        for _ in 0..plan.at_once.min(work.len()) {
            scope.spawn(|_| take_steps());
        }
    });
    if let Some(error) = broken.into_inner().unwrap_or_else(PoisonError::into_inner) {
        return Err(error);
    }

    let mut steps: Vec<StepResult> = Vec::with_capacity(plan.steps.len());
    let mut solved = done.into_iter().map(|slot| slot.into_inner().unwrap_or_else(PoisonError::into_inner));
    for step in &plan.steps {
        let result = match step.same_as {
            None => solved.next().flatten().unwrap_or_else(|| StepResult::not_run(step)),
            Some(first) => match steps.get(first) {
                Some(original) => copy_of(original, step, written)?,
                None => StepResult::not_run(step),
            },
        };
        steps.push(result);
    }
    let conductors = conductor_names(case);
    let (layer_meshes, layer_seconds) = match &layer {
        Prepared::StepByStep | Prepared::ClosedForm(_) => (Vec::new(), 0.0),
        Prepared::FiniteElement(run) => (run.meshes.clone(), run.seconds),
    };
    let stopped = steps.iter().any(|step| step.row.status == Status::NotRun);
    Ok(Outcome {
        plan: plan.clone(),
        warnings,
        steps,
        conductors,
        layer_meshes,
        layer_seconds,
        stopped,
        solve_seconds: start.elapsed().as_secs_f64(),
        threads: rayon::current_num_threads(),
    })
}

/// The result of a step that has the load of an earlier one.
fn copy_of(
    original: &StepResult,
    step: &PlannedStep,
    folder: Option<&OutputFolder>,
) -> Result<StepResult, OutputError> {
    let mut copy = StepResult {
        index: step.index,
        same_as: step.same_as,
        seconds: Default::default(),
        field_file: None,
        ..original.clone()
    };
    if let (Some(folder), Some(file)) = (folder, &original.field_file) {
        let name = field_file(step.index);
        folder.stage_copy(file, &name)?;
        copy.field_file = Some(name);
    }
    Ok(copy)
}

/// Names of the driven conductors, in the order of the Maxwell matrix.
pub fn conductor_names(case: &Case) -> Vec<String> {
    let pair = case.electrodes.iter().flat_map(|e| e.names()).map(str::to_owned);
    let driven = case.conductors.iter().filter(|c| c.floating_charge.is_none()).map(|c| &c.name);
    let shapes = case.shapes.iter().flat_map(|s| &s.conductors);
    let shapes = shapes.chain(case.beside.iter().flat_map(|b| &b.conductors));
    let shaped = shapes.filter(|c| c.floating_charge.is_none()).map(|c| &c.name);
    pair.chain(driven.chain(shaped).cloned()).collect()
}

/// The steps of a plan with the layer deformed and the bodies in place, and no field.
pub fn deform(case: &Case, plan: &Plan) -> Vec<StepResult> {
    let layer = prepare(case, plan, &AtomicBool::new(false), &|_| ());
    let deformed = |step: &PlannedStep| {
        let mut result = StepResult::not_run(step);
        match layer.deformation(case, step, true) {
            Ok(state) => {
                result.row.top_displacement_m = Some(state.as_ref().map_or(0.0, |s| s.top_displacement()));
                result.row.compression = state.as_ref().map(|s| s.compression()).or(result.row.compression);
                if case.shapes.is_some() || case.beside.is_some() {
                    result.row.status = Status::Failed(
                        "bodies of any shape are meshed as they are solved: `elastocap run` writes their mesh".to_owned(),
                    );
                } else if case.has_conductors() {
                    match scene_of(case, state.as_ref()) {
                        Ok(scene) => result.scene = Some(scene),
                        Err(error) => result.row.status = Status::Failed(error.to_string()),
                    }
                }
            }
            Err(error) => result.row.status = Status::Failed(error.to_string()),
        }
        result
    };
    plan.steps.iter().map(deformed).collect()
}
