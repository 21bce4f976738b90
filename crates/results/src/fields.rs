//! Writes the fields of a run while it works, since they would be too large to keep in memory until its end.

use std::ops::ControlFlow;
use std::sync::{Mutex, MutexGuard, PoisonError, RwLock};
use std::time::Instant;

use elastocap_case::Case;
use elastocap_coupling::deform::Solution;
use elastocap_coupling::finished::FinishedStep;
use elastocap_coupling::outcome::{Outcome, StepResult};
use elastocap_coupling::plan::Plan;
use elastocap_coupling::run::Observer;
use elastocap_coupling::step::StepField;
use elastocap_coupling::view::loaded_at;
use elastocap_electrostatics::FieldSection;
use elastocap_geometry::export::body::body_vtu;
use elastocap_geometry::export::vtk::vtu;

use crate::checked_files::read_bounded;
use crate::field_files::{FieldFile, FieldFiles, field_file};
use crate::layer_files::LayerFiles;
use crate::plot::Section;
use crate::section::{MOST_SECTIONS, of_slab, of_tetrahedra, section_file};
use crate::{FileGroup, OutputError, OutputFolder, Resume, Wanted, layer_files, scene_files};

/// An observer that stages the fields of a run in a folder, and passes on what it sees to another observer.
pub struct FieldWriter<'a> {
    folder: &'a OutputFolder,
    /// The observer that notifications are passed on to.
    watcher: &'a dyn Observer,
    /// The stopped run that this run goes on from, if it does.
    resume: Option<Resume>,
    /// Which files are written.
    wanted: Wanted,
    /// Steps whose field is drawn in sections, and the title of the drawings.
    sections: (Vec<usize>, String),
    /// Where the load acts, if the sections go through that place.
    loaded_at: Option<[f64; 2]>,
    /// The files and pictures so far.
    files: Mutex<FieldFiles>,
    /// The error that stopped the run, if a file could not be written.
    broken: Mutex<Option<OutputError>>,
    /// Whether files are still accepted: a run that was left behind goes on after its results are written.
    is_open: RwLock<bool>,
}

impl<'a> FieldWriter<'a> {
    /// Writes into `folder`; `watcher` gets the progress.
    pub fn new(folder: &'a OutputFolder, watcher: &'a dyn Observer) -> Self {
        Self {
            folder,
            watcher,
            resume: None,
            wanted: Wanted::default(),
            sections: Default::default(),
            loaded_at: None,
            files: Mutex::default(),
            broken: Mutex::default(),
            is_open: RwLock::new(true),
        }
    }

    /// Writes only the wanted files.
    #[must_use]
    pub fn writing(self, wanted: Wanted) -> Self {
        Self { wanted, ..self }
    }

    /// Draws sections through the field of the first and of the last step of a case.
    #[must_use]
    pub fn drawing_sections(self, plan: &Plan, case: &Case) -> Self {
        let ends = [plan.steps.first(), plan.steps.last()].into_iter().flatten();
        let numbers = ends.map(|step| step.same_as.unwrap_or(step.index)).collect();
        Self { sections: (numbers, case.title.clone()), loaded_at: loaded_at(case), ..self }
    }

    /// Takes the finished steps of a stopped run, and their fields, from `folder`.
    #[must_use]
    pub fn going_on_from(self, resume: Option<Resume>) -> Self {
        Self { resume, ..self }
    }

    /// The files of a run that has ended, including those of repeated steps. From now on no more are staged:
    /// a thread that still solves is stopped when it would stage one.
    ///
    /// # Errors
    /// [`OutputError`] if a file could not be written, for which the run was stopped, or if the file of a
    /// repeated step cannot be.
    pub fn finish(&self, outcome: &Outcome) -> Result<FieldFiles, OutputError> {
        *self.is_open.write().unwrap_or_else(PoisonError::into_inner) = false;
        if let Some(error) = self.broken.lock().unwrap_or_else(PoisonError::into_inner).take() {
            return Err(error);
        }
        let mut files = std::mem::take(&mut *self.files());
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

    fn is_drawn(&self, index: usize) -> bool {
        self.wanted.needs_sections() && self.sections.0.contains(&index)
    }

    /// Stages a file, unless [`FieldWriter::finish`] has been called.
    fn stage(&self, name: &str, bytes: &[u8]) -> ControlFlow<()> {
        let is_open = self.is_open.read().unwrap_or_else(PoisonError::into_inner);
        if !*is_open {
            return ControlFlow::Break(());
        }
        match self.folder.stage(name, bytes) {
            Ok(()) => ControlFlow::Continue(()),
            Err(error) => {
                *self.broken.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
                ControlFlow::Break(())
            }
        }
    }

    fn files(&self) -> MutexGuard<'_, FieldFiles> {
        self.files.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Stages the pictures of a step where they are wanted as files, and keeps them for the report.
    fn keep_sections(&self, index: usize, svgs: Vec<String>) -> ControlFlow<()> {
        if self.wanted.has(FileGroup::Sections) {
            for (number, svg) in svgs.iter().enumerate() {
                self.stage(&section_file(index, number), svg.as_bytes())?;
            }
        }
        if self.wanted.has(FileGroup::Report) {
            self.files().sections.insert(index, svgs);
        }
        ControlFlow::Continue(())
    }

    /// Stages the files of the layer.
    pub(crate) fn stage_layer(&self, layer: &LayerFiles) -> ControlFlow<()> {
        for (name, bytes) in &layer.files {
            self.stage(name, bytes)?;
        }
        self.files().layer_warnings = layer.warnings.clone();
        ControlFlow::Continue(())
    }
}

impl Observer for FieldWriter<'_> {
    fn preparing(&self, what: &str) {
        self.watcher.preparing(what);
    }

    fn layer_solved(&self, solution: &Solution) -> ControlFlow<()> {
        if !self.wanted.has(FileGroup::Layer) {
            return self.watcher.layer_solved(solution);
        }
        match self.stage_layer(&layer_files::files(solution)) {
            ControlFlow::Continue(()) => self.watcher.layer_solved(solution),
            stopped @ ControlFlow::Break(()) => stopped,
        }
    }

    /// The result of a step in the stopped run, whose field and pictures are taken over. A step whose field
    /// or picture is missing or cannot be read is solved again.
    fn finished_before(&self, index: usize) -> Option<FinishedStep> {
        let (step, folder, field) = self.resume.as_ref()?.step(index)?;
        let mut sections = Vec::new();
        if self.is_drawn(index) {
            let read = |number| {
                String::from_utf8(read_bounded(&folder.join(section_file(index, number))).ok()?).ok()
            };
            sections.push(read(0)?);
            sections.extend((1..MOST_SECTIONS).map_while(read));
        }
        if let Some(field) = field {
            let name = field_file(index);
            // While this guard lives, `finish` waits.
            let _open = self.is_open.read().ok().filter(|is_open| **is_open)?;
            self.folder.stage_from(&field, &name).ok()?;
            self.files().set_name(index, name);
        }
        if !sections.is_empty() {
            self.keep_sections(index, sections).continue_value()?;
        }
        Some(step)
    }

    fn step_begun(&self, index: usize) {
        self.watcher.step_begun(index);
    }

    /// Stages the field and its pictures. A field that the format cannot hold gives a warning.
    fn field_solved(&self, step: &StepResult, field: StepField) -> ControlFlow<()> {
        let start = Instant::now();
        let drawn = self.is_drawn(step.index);
        let written = self.wanted.has(FileGroup::Fields);
        let title = || format!("{}: {}", self.sections.1, scene_files::label(step));
        let (bytes, sections) = match (field, &step.scene) {
            (StepField::Grid(mut field), Some(scene)) => {
                let first = 1 + scene.scene.dielectrics().count() as i32;
                let metal = first..first + scene.scene.conductors().count() as i32;
                let planes = std::mem::take(&mut field.sections).into_iter().filter(|_| drawn);
                let section = |section: FieldSection| {
                    let slab = scene_files::field_grid(&scene.scene, section.field);
                    of_slab(step, &title(), (section.plane, &slab), metal.clone())
                };
                let sections: Vec<Section> = planes.filter_map(section).collect();
                (written.then(|| vtu(&scene_files::field_grid(&scene.scene, field))), sections)
            }
            (StepField::Grid(_), None) => return ControlFlow::Continue(()),
            (StepField::Tetrahedra(mesh), _) => {
                let sections = || of_tetrahedra(step, &title(), &mesh, self.loaded_at);
                (written.then(|| body_vtu(&mesh)), if drawn { sections() } else { Vec::new() })
            }
        };
        if !sections.is_empty() {
            self.keep_sections(step.index, sections.iter().map(Section::to_svg).collect())?;
        }
        let mut file = FieldFile::default();
        match bytes {
            Some(Ok(bytes)) => {
                let name = field_file(step.index);
                self.stage(&name, &bytes)?;
                file.name = Some(name);
            }
            Some(Err(error)) => file.warning = Some(format!("the field is not written: {error}")),
            None => {}
        }
        file.seconds = start.elapsed().as_secs_f64();
        self.files().steps.insert(step.index, file);
        ControlFlow::Continue(())
    }

    fn step_done(&self, step: &StepResult) {
        self.watcher.step_done(step);
    }
}
