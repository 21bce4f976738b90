//! Reads loads and capacitance matrices from the output folder of a run.

use std::path::Path;

use serde::Deserialize;

use crate::force_answer::{CurveFileError, read_document};

/// The reason why a result has no table of loads and capacitances.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LoadTableError {
    /// There is no result.
    #[error(transparent)]
    File(#[from] CurveFileError),
    /// No step has both loads and a matrix.
    #[error(
        "no step of the result has a force and a capacitance matrix; the case has no `[load]`, or its steps failed"
    )]
    NoSteps,
}

/// The steps of a run, from contact on.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadTable {
    /// The title of the case.
    pub title: String,
    /// Names of the terminals, in the order of the matrices.
    pub terminals: Vec<String>,
    pub(super) steps: Vec<LoadStep>,
}

/// A step with its load and its matrix.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct LoadStep {
    /// Normal force, N; shift along x1 and x3, m; tilt about x3 and x1, rad.
    pub(super) load: [f64; 5],
    /// Horizontal forces along x1 and x3, N, where they are known.
    pub(super) sideways: Option<[f64; 2]>,
    /// Lower bounds, values and upper bounds of the Maxwell matrix, with the errors of mechanics and geometry
    /// in the bounds, F.
    pub(super) maxwell: [Vec<Vec<f64>>; 3],
}

/// The parts of `result.json` that make the table.
#[derive(Deserialize)]
struct Document {
    title: String,
    #[serde(default)]
    conductors: Vec<String>,
    steps: Vec<Step>,
    #[serde(default)]
    plan: Plan,
}

#[derive(Default, Deserialize)]
struct Plan {
    #[serde(default)]
    steps: Vec<PlannedStep>,
}

#[derive(Deserialize)]
struct PlannedStep {
    #[serde(default)]
    pose: Option<Pose>,
}

#[derive(Default, Clone, Copy, Deserialize)]
struct Pose {
    #[serde(default)]
    shift_m: [f64; 2],
    #[serde(default)]
    tilt_rad: [f64; 2],
}

#[derive(Deserialize)]
struct Step {
    force_n: Option<f64>,
    #[serde(default)]
    force_x1_n: Option<f64>,
    #[serde(default)]
    force_x3_n: Option<f64>,
    #[serde(default)]
    distance_m: Option<f64>,
    maxwell_matrix_f: Option<Vec<Vec<f64>>>,
    maxwell_matrix_lower_f: Option<Vec<Vec<f64>>>,
    maxwell_matrix_upper_f: Option<Vec<Vec<f64>>>,
    #[serde(default)]
    mechanics_error_estimate: Option<f64>,
    #[serde(default)]
    geometry_error_estimate: Option<f64>,
}

/// The table of a run, given its output folder or the `result.json` in it.
///
/// # Errors
/// [`LoadTableError`] where there is none.
pub fn read_table(result: &Path) -> Result<LoadTable, LoadTableError> {
    let Document { title, conductors, steps, plan }: Document = read_document(result)?;
    let count = conductors.len();
    let is_square = |m: &Vec<Vec<f64>>| m.len() == count && m.iter().all(|row| row.len() == count);
    let load_step = |(k, step): (usize, Step)| {
        if step.distance_m.is_some_and(|distance| distance > 0.0) {
            return None;
        }
        let pose = plan.steps.get(k).and_then(|planned| planned.pose).unwrap_or_default();
        let ([shift1, shift3], [tilt1, tilt3]) = (pose.shift_m, pose.tilt_rad);
        let mut maxwell =
            [step.maxwell_matrix_lower_f?, step.maxwell_matrix_f?, step.maxwell_matrix_upper_f?];
        if !maxwell.iter().all(is_square) {
            return None;
        }
        let estimates =
            step.mechanics_error_estimate.unwrap_or(0.0) + step.geometry_error_estimate.unwrap_or(0.0);
        let [lower, values, upper] = &mut maxwell;
        for (k, row) in values.iter().enumerate() {
            for (l, value) in row.iter().enumerate() {
                lower[k][l] -= estimates * value.abs();
                upper[k][l] += estimates * value.abs();
            }
        }
        Some(LoadStep {
            load: [step.force_n?, shift1, shift3, tilt1, tilt3],
            sideways: step.force_x1_n.zip(step.force_x3_n).map(|(x1, x3)| [x1, x3]),
            maxwell,
        })
    };
    let steps: Vec<LoadStep> = steps.into_iter().enumerate().filter_map(load_step).collect();
    if steps.is_empty() {
        return Err(LoadTableError::NoSteps);
    }
    Ok(LoadTable { title, terminals: conductors, steps })
}
