//! Error against run time over order and grading: the cost of accuracy, and the quality of the solver's
//! choice of grid.
//!
//! One state of a case is solved on many grids, with bounds and without, and on the grids that the solver
//! chooses. The intersection of all proved intervals is the reference for the true errors; an empty
//! intersection would mean a wrong bound.
//!
//! All errors are relative. Times are those of the field solve alone, the shortest of all repeats, on all
//! threads.

mod engine;
mod figure;
mod reference;
mod run;
mod subject;
mod table;
mod verdict;
mod walk;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use elastocap_electrostatics::Bounded;

pub use figure::figure;
pub use reference::{Honesty, MAX_CAUTION, Reference};
pub use run::{Choice, Kind, Missing, Run, Solved};
pub use subject::Quantity;
pub use table::csv;
pub use verdict::{ALLOWED, Verdict};

use elastocap_case::Case;
use elastocap_coupling::failure::StepFailure;
use elastocap_coupling::load_steps::StepLoad;
use elastocap_coupling::plan::{Options, Plan};
use elastocap_coupling::route::Route;
use engine::Engine;
use subject::Subject;

/// The settings of a study.
#[derive(Debug, Clone, PartialEq)]
pub struct Request {
    /// The load step to study.
    pub step: usize,
    /// The tolerances at which the solver's choice is compared, from coarse to fine.
    pub tolerances: Vec<f64>,
    /// The approximate time for the study, s.
    pub seconds: f64,
}

impl Request {
    /// The settings of a usual study: four tolerances, a minute.
    pub fn usual(step: usize) -> Self {
        Self { step, tolerances: vec![1e-2, 1e-3, 1e-4, 1e-5], seconds: 60.0 }
    }

    /// The settings of a quick study: two tolerances, a few seconds.
    pub fn quick(step: usize) -> Self {
        Self { step, tolerances: vec![1e-2, 1e-3], seconds: 5.0 }
    }
}

/// The result of a study.
#[derive(Debug, Clone, PartialEq)]
pub struct Study {
    /// The title of the case.
    pub title: String,
    /// The load step studied.
    pub step: usize,
    /// The load of the step.
    pub load: StepLoad,
    /// The capacitance studied.
    pub quantity: Quantity,
    /// All solves, in their order; parallel plates last.
    pub runs: Vec<Run>,
    /// The reference for true errors; `None` if nothing was proved.
    pub reference: Option<Reference>,
    /// The comparisons of the solver's choices.
    pub verdicts: Vec<Verdict>,
    /// Whether the study was stopped on request before its end.
    pub stopped: bool,
}

impl Study {
    /// The true error of a run, known up to [`Reference::half_width`].
    pub fn true_error(&self, run: &Run) -> Option<f64> {
        Some(self.reference?.true_error(run.found()?.value.value))
    }

    /// The error that a run gives for itself: half the spread, or the estimate.
    pub fn certified_error(&self, run: &Run) -> Option<f64> {
        (run.kind != Kind::ParallelPlates).then(|| run.found().map(|f| f.value.relative_error())).flatten()
    }

    /// An error estimate over the true error, where both are known.
    pub fn estimate_over_true(&self, run: &Run) -> Option<f64> {
        let estimate = self.certified_error(run).filter(|_| run.kind == Kind::Estimate)?;
        self.reference?.estimate_over_true(run.found()?.value.value, estimate)
    }

    /// The verdict on a run's error estimate; `None` where it has none.
    pub fn honesty(&self, run: &Run) -> Option<Honesty> {
        let estimate = self.certified_error(run).filter(|_| run.kind == Kind::Estimate)?;
        Some(self.reference?.judge(run.found()?.value.value, estimate))
    }

    /// Whether two proved intervals are disjoint.
    pub fn contradicts(&self) -> bool {
        self.reference.is_some_and(|reference| reference.contradicts())
    }

    /// The verdict on a run; `None` if its grid is not the solver's choice, or has no verdict.
    pub fn verdict(&self, run: usize) -> Option<Verdict> {
        self.verdicts.iter().find(|verdict| verdict.chosen == run).copied()
    }

    /// The run of the parallel-plate formula.
    pub fn parallel_plates(&self) -> Option<&Run> {
        self.runs.iter().find(|run| run.kind == Kind::ParallelPlates)
    }
}

/// The reason why a case cannot be studied.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Refused {
    /// The case has no conductors.
    #[error(
        "the case has no electrodes and no conductors, so there is no capacitance to study; add [electrodes] or \
         [[conductor]]"
    )]
    NoConductors,
    /// The case has no such step.
    #[error("there is no step {asked}: the steps of this case are 0 to {last}")]
    NoSuchStep {
        /// The requested step.
        asked: usize,
        /// The last step.
        last: usize,
    },
    /// The step has no scene, or no solver.
    #[error("step {step} cannot be solved: {failure}")]
    Step {
        /// The step.
        step: usize,
        /// The reason.
        failure: Box<StepFailure>,
    },
    /// The box solver, which the study is about, does not solve the step.
    #[error(
        "the study is of the box solver and the grids it chooses, and step {step} is solved by {taken}: a study of boxes in \
         place of its bodies would say nothing about its error; its own bounds do, in the results of `elastocap run`"
    )]
    Route {
        /// The step.
        step: usize,
        /// The route that a run takes.
        taken: Route,
    },
}

/// Studies one load step of a case. `report` gets a description of each solve; `cancel` ends the study with
/// the runs done so far.
///
/// # Errors
/// [`Refused`] if there is nothing to study. A solve that fails is no error: its status has the reason.
pub fn study(
    case: &Case,
    request: &Request,
    cancel: &Arc<AtomicBool>,
    report: &(dyn Fn(&str) + Sync),
) -> Result<Study, Refused> {
    if !case.has_conductors() {
        return Err(Refused::NoConductors);
    }
    let plan = Plan::new(case, &Options::default());
    let missing = Refused::NoSuchStep { asked: request.step, last: plan.steps.len().saturating_sub(1) };
    let step = plan.steps.get(request.step).ok_or(missing)?;
    let subject = Subject::new(case, &plan, step, cancel)?;
    let mut engine = Engine::new(&subject, request.seconds, cancel, report);
    // Inside the pool, as the steps of a run are.
    rayon::scope(|_| engine.study(&request.tolerances));
    let mut runs = engine.runs;
    if let Some((value, seconds)) = subject.plates {
        let value = Bounded { value, lower: value, upper: value };
        let found = Solved { level: None, unknowns: None, seconds, repeats: 1, value, reported_error: 0.0 };
        runs.push(Run {
            kind: Kind::ParallelPlates,
            choice: Choice::Table,
            tolerance: None,
            outcome: Ok(found),
        });
    }
    let proved = runs.iter().filter(|run| run.kind == Kind::Bounds).filter_map(Run::found);
    let reference = Reference::of(proved.map(|found| found.value));
    let verdicts = (0..runs.len()).filter_map(|run| Verdict::of(&runs, run, reference.as_ref())).collect();
    Ok(Study {
        title: case.title.clone(),
        step: request.step,
        load: step.load,
        quantity: subject.quantity,
        runs,
        reference,
        verdicts,
        stopped: cancel.load(Ordering::Relaxed),
    })
}
