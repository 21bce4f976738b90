//! Keeps the fields of a run in memory, for a caller of the library that decides after the run whether to
//! write them.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use elastocap_case::Case;
use elastocap_coupling::deform::Solution;
use elastocap_coupling::finished::FinishedStep;
use elastocap_coupling::outcome::{Outcome, StepResult};
use elastocap_coupling::plan::Options;
use elastocap_coupling::run::Observer;
use elastocap_coupling::step::StepField;

use crate::layer_files::{self, LayerFiles};
use crate::{FieldWriter, OutputError, OutputFolder, Request, Saved, save};

/// An observer that keeps the fields of a run, and passes its notifications on to another observer.
///
/// A field takes some 100 bytes for each node of its grid, and a few hundred for each node of tetrahedra.
pub struct KeptFields<'a> {
    watcher: &'a dyn Observer,
    /// Whether the fields of the layer are kept. Those of the steps are kept in any case: a run gives them
    /// only if its options ask for fields.
    wanted: bool,
    fields: Mutex<StepFields>,
}

/// The fields of a run that has ended.
#[derive(Debug, Clone, Default)]
pub struct StepFields {
    steps: BTreeMap<usize, StepField>,
    layer: LayerFiles,
}

impl StepFields {
    /// The field of a step, or of the earlier one that its result is taken from.
    pub fn of(&self, step: &StepResult) -> Option<&StepField> {
        self.steps.get(&step.same_as.unwrap_or(step.index))
    }
}

impl<'a> KeptFields<'a> {
    /// Keeps the fields of a run; `wanted` says whether its options ask for them. `watcher` gets the
    /// progress.
    pub fn new(wanted: bool, watcher: &'a dyn Observer) -> Self {
        Self { watcher, wanted, fields: Mutex::default() }
    }

    /// The fields of a run that has ended.
    pub fn finish(self) -> StepFields {
        self.fields.into_inner().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Observer for KeptFields<'_> {
    fn preparing(&self, what: &str) {
        self.watcher.preparing(what);
    }

    fn layer_solved(&self, solution: &Solution) -> ControlFlow<()> {
        if self.wanted {
            let files = layer_files::files(solution);
            self.fields.lock().unwrap_or_else(PoisonError::into_inner).layer = files;
        }
        self.watcher.layer_solved(solution)
    }

    fn finished_before(&self, index: usize) -> Option<FinishedStep> {
        self.watcher.finished_before(index)
    }

    fn step_begun(&self, index: usize) {
        self.watcher.step_begun(index);
    }

    fn field_solved(&self, step: &StepResult, field: StepField) -> ControlFlow<()> {
        self.fields.lock().unwrap_or_else(PoisonError::into_inner).steps.insert(step.index, field);
        ControlFlow::Continue(())
    }

    fn step_done(&self, step: &StepResult) {
        self.watcher.step_done(step);
    }
}

/// Writes the files of a run that has ended into `folder`, as [`save`] does for a run that writes its fields
/// while it works.
///
/// `planning` is how long reading and planning took, `case_text` the text of the case for result.json and the
/// report.
///
/// # Errors
/// [`OutputError`], if the folder cannot be made or holds files of others that a run would replace; then it
/// is unchanged.
pub fn save_kept(
    case: &Case,
    outcome: &Outcome,
    options: &Options,
    folder: &Path,
    fields: &StepFields,
    planning: Duration,
    case_text: Option<&str>,
) -> Result<Saved, OutputError> {
    let now = Instant::now();
    let solving = Duration::try_from_secs_f64(outcome.solve_seconds).unwrap_or_default();
    let started = now.checked_sub(planning + solving).unwrap_or(now);
    let folder = OutputFolder::open(folder)?;
    folder.holds_nothing_foreign()?;
    let request = Request { case_text, ..Request::of(options) };
    let writer = FieldWriter::new(&folder, &()).writing(request.wanted);
    let writer = writer.drawing_sections(&outcome.plan, case);
    // If staging stops early, `finish` reports the reason.
    let _ = stage(&writer, outcome, fields);
    let files = writer.finish(outcome)?;
    save(case, outcome, options, &request, &folder, &files, started, planning)
}

/// Stages the files of the layer, and the fields of the steps with their pictures.
fn stage(writer: &FieldWriter<'_>, outcome: &Outcome, fields: &StepFields) -> ControlFlow<()> {
    writer.stage_layer(&fields.layer)?;
    for step in &outcome.steps {
        if let Some(field) = fields.steps.get(&step.index) {
            writer.field_solved(step, field.clone())?;
        }
    }
    ControlFlow::Continue(())
}
