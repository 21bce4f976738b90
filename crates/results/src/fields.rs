//! The fields of a run, written while it works: kept in memory until its end they would be too large.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use elastocap_coupling::deform::Solution;
use elastocap_coupling::finished::FinishedStep;
use elastocap_coupling::outcome::{Outcome, StepResult};
use elastocap_coupling::run::Observer;
use elastocap_coupling::step::StepField;
use elastocap_geometry::export::body::body_vtu;
use elastocap_geometry::export::vtk::vtu;

use crate::{OutputError, OutputFolder, Resume, layer_files, scene_files};

/// The name of a step's field file.
pub fn field_file(index: usize) -> String {
    format!("step_{index:03}.vtu")
}

/// What became of the fields of a run.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FieldFiles {
    steps: BTreeMap<usize, FieldFile>,
    layer_warnings: Vec<String>,
}

#[derive(Debug, Clone, Default, PartialEq)]
struct FieldFile {
    name: Option<String>,
    warning: Option<String>,
    seconds: f64,
}

impl FieldFiles {
    /// The file with the field of a step, if there is one.
    pub fn name(&self, step: usize) -> Option<&str> {
        self.steps.get(&step)?.name.as_deref()
    }

    /// Why the field of a step was not written, if it could not be.
    pub fn warning(&self, step: usize) -> Option<&str> {
        self.steps.get(&step)?.warning.as_deref()
    }

    /// Wall-clock seconds that making and writing the field of a step took.
    pub fn seconds(&self, step: usize) -> f64 {
        self.steps.get(&step).map_or(0.0, |file| file.seconds)
    }

    /// What the files of the layer could not hold.
    pub fn layer_warnings(&self) -> &[String] {
        &self.layer_warnings
    }

    pub(crate) fn set_name(&mut self, step: usize, name: String) {
        self.steps.entry(step).or_default().name = Some(name);
    }
}

/// An observer that stages the fields of a run in a folder, and passes on what it sees to another observer.
pub struct FieldWriter<'a> {
    folder: &'a OutputFolder,
    watcher: &'a dyn Observer,
    resume: Option<Resume>,
    /// Whether fields, those of the layer among them, are written.
    wanted: bool,
    files: Mutex<FieldFiles>,
    broken: Mutex<Option<OutputError>>,
}

impl<'a> FieldWriter<'a> {
    /// Writes into `folder`; `watcher` is told of the progress.
    pub fn new(folder: &'a OutputFolder, watcher: &'a dyn Observer) -> Self {
        Self {
            folder,
            watcher,
            resume: None,
            wanted: true,
            files: Mutex::default(),
            broken: Mutex::default(),
        }
    }

    /// Writes nothing unless fields are `wanted`.
    #[must_use]
    pub fn only_if(self, wanted: bool) -> Self {
        Self { wanted, ..self }
    }

    /// Takes the steps that a stopped run has finished, and their fields, from there.
    #[must_use]
    pub fn going_on_from(self, resume: Option<Resume>) -> Self {
        Self { resume, ..self }
    }

    /// The files of a run that has ended, those of repeated steps among them.
    ///
    /// # Errors
    /// When a file could not be written; the run was stopped then.
    pub fn finish(self, outcome: &Outcome) -> Result<FieldFiles, OutputError> {
        if let Some(error) = self.broken.into_inner().unwrap_or_else(PoisonError::into_inner) {
            return Err(error);
        }
        let mut files = self.files.into_inner().unwrap_or_else(PoisonError::into_inner);
        for step in &outcome.steps {
            let Some(original) = step.same_as.and_then(|first| files.steps.get(&first)).cloned() else {
                continue;
            };
            let mut copy = FieldFile { seconds: 0.0, ..original };
            if let Some(file) = &mut copy.name {
                let name = field_file(step.index);
                self.folder.stage_copy(file, &name)?;
                *file = name;
            }
            files.steps.insert(step.index, copy);
        }
        Ok(files)
    }

    fn stopped_by(&self, error: OutputError) -> ControlFlow<()> {
        *self.broken.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
        ControlFlow::Break(())
    }
}

impl Observer for FieldWriter<'_> {
    fn preparing(&self, what: &str) {
        self.watcher.preparing(what);
    }

    fn layer_solved(&self, solution: &Solution) -> ControlFlow<()> {
        if !self.wanted {
            return self.watcher.layer_solved(solution);
        }
        match layer_files::stage(self.folder, solution) {
            Ok(warnings) => {
                self.files.lock().unwrap_or_else(PoisonError::into_inner).layer_warnings = warnings;
                self.watcher.layer_solved(solution)
            }
            Err(error) => self.stopped_by(error),
        }
    }

    /// A step whose field is not there any more is solved again.
    fn finished_before(&self, index: usize) -> Option<FinishedStep> {
        let (step, field) = self.resume.as_ref()?.step(index)?;
        if let Some(field) = field {
            let name = field_file(index);
            self.folder.stage_from(&field, &name).ok()?;
            self.files.lock().unwrap_or_else(PoisonError::into_inner).set_name(index, name);
        }
        Some(step)
    }

    fn step_begun(&self, index: usize) {
        self.watcher.step_begun(index);
    }

    /// A field that the format cannot hold is a warning.
    fn field_solved(&self, step: &StepResult, field: StepField) -> ControlFlow<()> {
        let start = Instant::now();
        let bytes = match (field, &step.scene) {
            (StepField::Grid(field), Some(scene)) => vtu(&scene_files::field_grid(&scene.scene, field)),
            (StepField::Grid(_), None) => return ControlFlow::Continue(()),
            (StepField::Tetrahedra(mesh), _) => body_vtu(&mesh),
        };
        let mut file = FieldFile::default();
        match bytes {
            Ok(bytes) => {
                let name = field_file(step.index);
                if let Err(error) = self.folder.stage(&name, &bytes) {
                    return self.stopped_by(error);
                }
                file.name = Some(name);
            }
            Err(error) => file.warning = Some(format!("the field is not written: {error}")),
        }
        file.seconds = start.elapsed().as_secs_f64();
        self.files.lock().unwrap_or_else(PoisonError::into_inner).steps.insert(step.index, file);
        ControlFlow::Continue(())
    }

    fn step_done(&self, step: &StepResult) {
        self.watcher.step_done(step);
    }
}
