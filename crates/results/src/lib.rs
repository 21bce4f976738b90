//! Results on disk.

pub mod csv;
mod fields;
mod figure;
pub mod force_answer;
mod indenter;
mod json;
mod layer_files;
pub mod load_answer;
pub mod load_curve;
pub mod measured;
mod output_folder;
pub mod plot;
mod resume;
pub mod scene_files;
mod section;
mod space_layer_files;

use std::path::PathBuf;
use std::time::{Duration, Instant};

use elastocap_geometry::export::gltf::glb;
use elastocap_geometry::export::surfaces::surfaces_glb;
use elastocap_geometry::export::vtk::{pvd, vtu};

pub use fields::{FieldFiles, FieldWriter, field_file};
pub use figure::{approach, figure, figure_with_points};
pub use json::{RunSeconds, document};
pub use output_folder::{Finish, OutputError, OutputFolder, Placed};
use output_folder::{INDEX, MESH_INDEX, is_result_name};
pub use resume::{Resume, ResumeError};

use elastocap_case::Case;
use elastocap_coupling::outcome::{Outcome, StepResult};
use elastocap_coupling::plan::{Kind, Options};

/// What a run has put on disk.
#[derive(Debug, Clone, PartialEq)]
pub struct Saved {
    /// The folder: that asked for, or the one for unfinished results beside it.
    pub folder: PathBuf,
    /// The files, sorted.
    pub files: Vec<PathBuf>,
    /// The text of `result.json`.
    pub json: String,
    /// What could not be shown; the numbers are not touched by it.
    pub warnings: Vec<String>,
}

/// The times and files of a field series: compressions where there is a load.
fn series(steps: &[StepResult], fields: &FieldFiles) -> Vec<(f64, String)> {
    let time = |step: &StepResult| step.row.compression.unwrap_or(step.index as f64);
    steps.iter().filter_map(|step| Some((time(step), fields.name(step.index)?.to_owned()))).collect()
}

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

fn stage_scene(
    folder: &OutputFolder,
    case: &Case,
    steps: &[StepResult],
) -> Result<Option<String>, OutputError> {
    let file = match scene_files::surfaces(case, steps) {
        Some(surfaces) => surfaces_glb(&surfaces),
        None => {
            let (bodies, labels) = scene_files::bodies(case, steps);
            if bodies.is_empty() {
                return Ok(Some("scene.glb is not written: no step has a scene".to_owned()));
            }
            glb(&bodies, &labels)
        }
    };
    match file {
        Ok(bytes) => folder.stage("scene.glb", &bytes).map(|()| None),
        Err(error) => Ok(Some(format!("scene.glb is not written: {error}"))),
    }
}

/// Writes what a run found, beside the fields staged before, and puts all of it in place: see [`OutputFolder::commit_run`].
///
/// `started` is when the run began, `planning` how long reading and planning took.
///
/// # Errors
/// When a file cannot be written; then the folder is as it was before.
pub fn save(
    case: &Case,
    outcome: &Outcome,
    options: &Options,
    folder: OutputFolder,
    fields: &FieldFiles,
    started: Instant,
    planning: Duration,
) -> Result<Saved, OutputError> {
    let writing = Instant::now();
    let mut warnings = [outcome.warnings.as_slice(), fields.layer_warnings()].concat();
    if outcome.has_curve() {
        folder.stage("curve.csv", csv::curve(outcome).as_bytes())?;
    }
    if outcome.plan.kind != Kind::Mechanics {
        let table = csv::capacitance(&outcome.conductors, outcome.measurement, &outcome.steps);
        folder.stage("capacitance.csv", table.as_bytes())?;
    }
    if !outcome.layer_meshes.is_empty() {
        folder.stage("mechanics.csv", layer_files::table(outcome).as_bytes())?;
    }
    let comparison = measured::compare(case, outcome);
    if let Some(Err(error)) = &comparison {
        warnings.push(format!("the measured points are not compared: {error}"));
    }
    let comparison = comparison.and_then(Result::ok);
    let drawn = case.measured_points.as_ref().zip(comparison.as_ref());
    if let Some(panels) = figure_with_points(&case.title, outcome, drawn) {
        folder.stage("curve.svg", panels.to_svg().as_bytes())?;
    }
    if let Some(panels) = approach(&case.title, outcome) {
        folder.stage("approach.svg", panels.to_svg().as_bytes())?;
    }
    if options.scene {
        warnings.extend(stage_scene(&folder, case, &outcome.steps)?);
    }
    warnings.extend(stage_series(&folder, &outcome.steps, fields)?);
    if outcome.stopped {
        let text = resume::document(case, options, &outcome.steps, fields);
        let text = text.map_err(|error| OutputError::File {
            file: folder.path().join(resume::RESUME),
            source: error.into(),
        })?;
        folder.stage(resume::RESUME, text.as_bytes())?;
    }
    let seconds = RunSeconds {
        plan: planning.as_secs_f64(),
        solve: outcome.solve_seconds,
        files: writing.elapsed().as_secs_f64(),
        total: started.elapsed().as_secs_f64(),
    };
    let mut names = folder.staged();
    names.push(INDEX.to_owned());
    names.sort();
    let json = document(case, outcome, fields, names, warnings.clone(), seconds)
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

/// Writes the bodies and the grid of a case without solving for a field: `scene.glb`, one `.vtu` for each step, and `mesh.json`,
/// which lists them.
///
/// `steps` must come from [`elastocap_coupling::run::deform`].
///
/// # Errors
/// When a file cannot be written; then the folder is as it was before.
pub fn save_mesh(case: &Case, steps: &[StepResult], folder: OutputFolder) -> Result<Placed, OutputError> {
    let mut warnings: Vec<String> = stage_scene(&folder, case, steps)?.into_iter().collect();
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
