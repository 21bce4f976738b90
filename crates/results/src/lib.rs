//! The results of a run on disk: files, figures, reports, and forces read from them.

mod checked_files;
pub mod comparison;
pub mod csv;
mod field_files;
mod fields;
mod figure;
pub mod force_answer;
mod indenter;
mod json;
mod kept;
mod layer_files;
pub mod load_answer;
pub mod load_curve;
pub mod measured;
mod output_files;
mod output_folder;
pub mod pairs;
pub mod plot;
mod pose;
pub mod report;
mod resume;
pub mod scene_files;
mod section;
mod space_layer_files;
mod typeset;
mod wanted;

use std::path::PathBuf;
use std::time::{Duration, Instant};

use elastocap_geometry::export::gltf::glb;
use elastocap_geometry::export::surfaces::surfaces_glb;
use elastocap_geometry::export::vtk::{pvd, vtu};

pub use checked_files::{fault, read_bounded};
pub use field_files::{FieldFiles, field_file};
pub use fields::FieldWriter;
pub use figure::{approach, figure, figure_with_points};
pub use json::{RunSeconds, document};
pub use kept::{KeptFields, StepFields, save_kept};
pub use output_files::{FileGroup, UnknownFileGroup, files_in_words};
use output_files::{INDEX, MESH_INDEX, REPORT, RESUME, is_result_name};
pub use output_folder::{Finish, OutputError, OutputFolder, Placed, Unfinished};
pub use report::MeasuredPoint;
use report::Report;
pub use resume::{Resume, ResumeError};
use scene_files::Shown;
pub use wanted::Wanted;

use elastocap_case::Case;
use elastocap_coupling::outcome::{Outcome, StepResult};
use elastocap_coupling::plan::{Kind, Options};

/// The files that a run has put on disk.
#[derive(Debug, Clone, PartialEq)]
pub struct Saved {
    /// The folder: the requested one, or the one for unfinished results beside it.
    pub folder: PathBuf,
    /// The files, sorted.
    pub files: Vec<PathBuf>,
    /// The text of `result.json`.
    pub json: String,
    /// Warnings about what could not be shown; the numbers are not affected.
    pub warnings: Vec<String>,
}

/// The field files of a run with the parameter under which a viewer lists each: the compression, or the index
/// of the step where it has none.
fn series(steps: &[StepResult], fields: &FieldFiles) -> Vec<(f64, String)> {
    let parameter = |step: &StepResult| step.row.compression.unwrap_or(step.index as f64);
    steps.iter().filter_map(|step| Some((parameter(step), fields.name(step.index)?.to_owned()))).collect()
}

/// Stages `fields.pvd`, which lists the field files. Returns a warning if the format cannot hold the list.
fn stage_series(
    folder: &OutputFolder,
    steps: &[StepResult],
    fields: &FieldFiles,
) -> Result<Option<String>, OutputError> {
    let series = series(steps, fields);
    if series.is_empty() {
        return Ok(None);
    }
    match pvd(&series) {
        Ok(text) => folder.stage("fields.pvd", text.as_bytes()).map(|()| None),
        Err(error) => Ok(Some(format!("fields.pvd is not written: {error}"))),
    }
}

/// Stages `scene.glb`. Returns a warning if there is no scene, or if the format cannot hold it.
fn stage_scene(folder: &OutputFolder, shown: &Shown) -> Result<Option<String>, OutputError> {
    let file = match shown {
        Shown::Surfaces(surfaces) => surfaces_glb(surfaces),
        Shown::Boxes(bodies, _) if bodies.is_empty() => {
            return Ok(Some("scene.glb is not written: no step has a scene".to_owned()));
        }
        Shown::Boxes(bodies, labels) => glb(bodies, labels),
    };
    match file {
        Ok(bytes) => folder.stage("scene.glb", &bytes).map(|()| None),
        Err(error) => Ok(Some(format!("scene.glb is not written: {error}"))),
    }
}

/// The requests for a run besides its results.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Request<'a> {
    /// The files to be written.
    pub wanted: Wanted,
    /// The text of the case file, for result.json and the report.
    pub case_text: Option<&'a str>,
    /// The command that repeats the run, for the report.
    pub command: Option<&'a str>,
}

impl Request<'_> {
    /// A request for all files that the options of the run ask for.
    pub fn of(options: &Options) -> Self {
        Self { wanted: Wanted::of(options), ..Self::default() }
    }
}

/// Writes the results of a run, beside the fields staged before, and puts all of it in place: see
/// [`OutputFolder::commit_run`].
///
/// `started` is the time when the run began, `planning` the time that reading and planning took.
///
/// # Errors
/// If a file cannot be written; then the folder is unchanged.
pub fn save(
    case: &Case,
    outcome: &Outcome,
    options: &Options,
    request: &Request<'_>,
    folder: &OutputFolder,
    fields: &FieldFiles,
    started: Instant,
    planning: Duration,
) -> Result<Saved, OutputError> {
    let writing = Instant::now();
    let wanted = &request.wanted;
    let mut warnings = [outcome.warnings.as_slice(), fields.layer_warnings()].concat();
    if outcome.has_curve() && wanted.has(FileGroup::Curve) {
        folder.stage("curve.csv", csv::curve(outcome).as_bytes())?;
    }
    if outcome.plan.kind != Kind::Mechanics && wanted.has(FileGroup::Capacitance) {
        let table = csv::capacitance(case, outcome);
        folder.stage("capacitance.csv", table.as_bytes())?;
    }
    if !outcome.layer_meshes.is_empty() && wanted.has(FileGroup::Mechanics) {
        folder.stage("mechanics.csv", layer_files::table(outcome).as_bytes())?;
    }
    let comparison = measured::compare(case, outcome);
    if let Some(Err(error)) = &comparison {
        warnings.push(format!("the measured points are not compared: {error}"));
    }
    let comparison = comparison.and_then(Result::ok);
    if wanted.has(FileGroup::Curve) {
        let drawn = case.measured_points.as_ref().zip(comparison.as_ref());
        if let Some(panels) = figure_with_points(&case.title, outcome, drawn) {
            folder.stage("curve.svg", panels.to_svg().as_bytes())?;
        }
        if let Some(panels) = approach(&case.title, outcome) {
            folder.stage("approach.svg", panels.to_svg().as_bytes())?;
        }
    }
    let shown = match wanted.has(FileGroup::Scene) || wanted.has(FileGroup::Report) {
        true => scene_files::shown(case, &outcome.steps),
        false => Shown::Boxes(Vec::new(), Vec::new()),
    };
    if wanted.has(FileGroup::Scene) {
        warnings.extend(stage_scene(folder, &shown)?);
    }
    warnings.extend(stage_series(folder, &outcome.steps, fields)?);
    if outcome.stopped {
        let text = resume::document(case, options, wanted, &outcome.steps, fields);
        let text = text
            .map_err(|error| OutputError::File { file: folder.path().join(RESUME), source: error.into() })?;
        folder.stage(RESUME, text.as_bytes())?;
    }
    let seconds = || RunSeconds {
        plan: planning.as_secs_f64(),
        solve: outcome.solve_seconds,
        files: writing.elapsed().as_secs_f64(),
        total: started.elapsed().as_secs_f64(),
    };
    let mut names = folder.staged();
    names.push(INDEX.to_owned());
    if wanted.has(FileGroup::Report) {
        names.push(REPORT.to_owned());
    }
    names.sort();
    if wanted.has(FileGroup::Report) {
        let measured = comparison.as_ref().map(MeasuredPoint::under_force).unwrap_or_default();
        let report = Report {
            case,
            outcome,
            fields,
            warnings: &warnings,
            seconds: seconds(),
            files: &names,
            shown: &shown,
            case_text: request.case_text,
            command: request.command,
            measured: &measured,
        };
        folder.stage(REPORT, report.html().as_bytes())?;
    }
    let json = document(case, outcome, fields, names, warnings.clone(), seconds(), request.case_text)
        .map_err(|error| OutputError::File { file: folder.path().join(INDEX), source: error.into() })?;
    folder.stage(INDEX, json.as_bytes())?;
    let finish = match (outcome.stopped, outcome.is_complete()) {
        (true, _) => Finish::Stopped,
        (false, true) => Finish::Complete,
        (false, false) => Finish::Incomplete,
    };
    debug_assert!(
        folder.staged().iter().all(|name| is_result_name(name)),
        "a later run would not replace it"
    );
    let placed = folder.commit_run(finish)?;
    warnings.extend(placed.warnings);
    Ok(Saved { folder: placed.folder, files: placed.files, json, warnings })
}

/// Writes the bodies and the grid of a case without solving for a field: `scene.glb`, one `.vtu` for each
/// step, and `mesh.json`, which lists them.
///
/// `steps` must come from [`elastocap_coupling::run::deform`].
///
/// # Errors
/// If a file cannot be written; then the folder is unchanged.
pub fn save_mesh(case: &Case, steps: &[StepResult], folder: OutputFolder) -> Result<Placed, OutputError> {
    let mut warnings: Vec<String> =
        stage_scene(&folder, &scene_files::shown(case, steps))?.into_iter().collect();
    let mut fields = FieldFiles::default();
    for step in steps {
        if let Some(scene) = &step.scene {
            match vtu(&scene_files::geometry_grid(&scene.scene)) {
                Ok(bytes) => {
                    let name = field_file(step.index);
                    folder.stage(&name, &bytes)?;
                    fields.set_name(step.index, name);
                }
                Err(error) => {
                    warnings.push(format!("the grid of step {} is not written: {error}", step.index))
                }
            }
        }
    }
    warnings.extend(stage_series(&folder, steps, &fields)?);
    let mut names = folder.staged();
    names.push(MESH_INDEX.to_owned());
    folder.stage(MESH_INDEX, json::mesh_document(case, &names).as_bytes())?;
    debug_assert!(
        folder.staged().iter().all(|name| is_result_name(name)),
        "a later one would not replace it"
    );
    let mut placed = folder.commit()?;
    placed.warnings.splice(0..0, warnings);
    Ok(placed)
}
