//! Reads the curve from the output folder of a run.

use std::io;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use serde::de::DeserializeOwned;

use super::curve::{CurveError, CurveStep, ForceCurve};
use crate::checked_files::{fault, read_bounded};

/// The reason why a result has no curve.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CurveFileError {
    /// The file does not exist or cannot be read.
    #[error("`{}` cannot be read ({source}); name the output folder of a run, such as results/in-plane-pair", file.display())]
    Unreadable {
        /// The file.
        file: PathBuf,
        /// The error that the system reports.
        source: io::Error,
    },
    /// The file is not the `result.json` of a run.
    #[error("`{}` is not the result.json of a run ({fault}); name the output folder of a run, or the result.json in it", file.display())]
    NotAResult {
        /// The file.
        file: PathBuf,
        /// The position of the error and its kind.
        fault: String,
    },
    /// The run measured a matrix.
    #[error(
        "the result has a matrix of {0} terminals, and a force belongs to one capacitance; name it in `[measure]` of the case and run \
         that, or give several with their terminals, as `-c A=2.3pF+-1fF -c B=2.4pF+-1fF`"
    )]
    Matrix(usize),
    /// The steps differ in more than their load.
    #[error(
        "the load steps of the result also shift or tilt what is attached, so that a capacitance does not tell the force; give several \
         with their terminals, as `-c A=2.3pF+-1fF -c B=2.4pF+-1fF`, or run the case with the same shift and tilt at all steps"
    )]
    Moved,
    /// The result has no force.
    #[error(
        "the result has no forces: the case has no `[load]`, or its steps failed or lie beyond the largest force of the closed form"
    )]
    NoForces,
    /// The result has no capacitance.
    #[error("the result has no capacitances; the case has no conductors, or its steps failed")]
    NoCapacitances,
    /// The steps are not a curve.
    #[error(transparent)]
    Curve(#[from] CurveError),
}

/// A curve, and what else its file says that matters to a force read from the curve.
#[derive(Debug, Clone, PartialEq)]
pub struct CurveOnFile {
    /// The title of the case.
    pub title: String,
    /// The curve.
    pub curve: ForceCurve,
    /// Errors that the limits of a force do not include.
    pub warnings: Vec<String>,
}

/// The parts of `result.json` that make the curve.
#[derive(Deserialize)]
struct Document {
    title: String,
    status: String,
    measurement: Option<Measured>,
    bounds: Option<String>,
    steps: Vec<Step>,
    #[serde(default)]
    plan: Plan,
}

#[derive(Default, Deserialize)]
struct Plan {
    steps: Vec<PlannedStep>,
}

#[derive(Deserialize)]
struct PlannedStep {
    /// The displacement of the attached bodies, if they have one.
    pose: Option<serde_json::Value>,
}

#[derive(Deserialize)]
struct Measured {
    kind: String,
    terminals: Vec<String>,
}

#[derive(Deserialize)]
struct Step {
    index: usize,
    force_n: Option<f64>,
    #[serde(default)]
    distance_m: Option<f64>,
    capacitance_f: Option<f64>,
    capacitance_lower_f: Option<f64>,
    capacitance_upper_f: Option<f64>,
    mechanics_error_estimate: Option<f64>,
    geometry_error_estimate: Option<f64>,
    model_error_estimate: Option<f64>,
    force_error_estimate: Option<f64>,
    layer: Option<LayerStep>,
}

#[derive(Deserialize)]
struct LayerStep {
    relative_error_estimate: Option<f64>,
}

impl Step {
    fn is_before_contact(&self) -> bool {
        self.distance_m.is_some_and(|distance| distance > 0.0)
    }

    /// The step as a point of the curve; `None` without force or capacitance, and before contact.
    fn on_curve(&self) -> Option<CurveStep> {
        if self.is_before_contact() {
            return None;
        }
        let (force, capacitance) = (self.force_n?, self.capacitance_f?);
        let estimates =
            self.mechanics_error_estimate.unwrap_or(0.0) + self.geometry_error_estimate.unwrap_or(0.0);
        let estimated = capacitance.abs() * estimates;
        let relative = self.layer.as_ref().and_then(|layer| layer.relative_error_estimate).unwrap_or(0.0);
        Some(CurveStep {
            index: self.index,
            force,
            force_error: force * relative,
            capacitance,
            lower: self.capacitance_lower_f? - estimated,
            upper: self.capacitance_upper_f? + estimated,
            estimated,
        })
    }
}

/// Reads the curve of a run from its output folder or from the `result.json` in it.
///
/// # Errors
/// [`CurveFileError`] if there is no file, or no curve that forces can be read from.
pub fn read_curve(result: &Path) -> Result<CurveOnFile, CurveFileError> {
    let document: Document = read_document(result)?;
    if let Some(Measured { kind, terminals }) = &document.measurement
        && kind == "matrix"
    {
        return Err(CurveFileError::Matrix(terminals.len()));
    }
    let pressed =
        document.plan.steps.iter().zip(&document.steps).filter(|(_, step)| !step.is_before_contact());
    let poses: Vec<_> = pressed.map(|(planned, _)| &planned.pose).collect();
    if poses.windows(2).any(|pair| pair[0] != pair[1]) {
        return Err(CurveFileError::Moved);
    }
    if document.steps.iter().all(|step| step.force_n.is_none()) {
        return Err(CurveFileError::NoForces);
    }
    if document.steps.iter().all(|step| step.capacitance_f.is_none()) {
        return Err(CurveFileError::NoCapacitances);
    }
    let steps: Vec<CurveStep> = document.steps.iter().filter_map(Step::on_curve).collect();
    let warnings = warnings(&document, steps.len());
    Ok(CurveOnFile { title: document.title, curve: ForceCurve::new(steps)?, warnings })
}

/// The part `T` of a result, given its folder or the `result.json` in it.
///
/// # Errors
/// [`CurveFileError`] if there is no readable file.
pub fn read_document<T: DeserializeOwned>(result: &Path) -> Result<T, CurveFileError> {
    let file = if result.is_dir() { result.join("result.json") } else { result.to_owned() };
    let text = match read_bounded(&file) {
        Ok(text) => text,
        Err(error) => return Err(CurveFileError::Unreadable { file, source: error.into() }),
    };
    serde_json::from_slice(&text).map_err(|error| CurveFileError::NotAResult { file, fault: fault(&error) })
}

/// The error of the layer's model, over the capacitance or the force, above which a warning says that the
/// limits do not include it.
const NOTABLE: f64 = 0.02;

/// Warnings of errors that the limits of a force do not include; `used` is the number of steps in the curve.
fn warnings(document: &Document, used: usize) -> Vec<String> {
    let mut out = Vec::new();
    if document.status != "complete" {
        let count = document.steps.len();
        out.push(format!(
            "the run is {}: {used} of its {count} steps have a force and a capacitance",
            document.status
        ));
    }
    if document.bounds.as_deref() == Some("estimated") {
        out.push(
            "the capacitances of the run have estimated errors and no proved bounds (`bounds = false`)"
                .to_owned(),
        );
    }
    if document
        .steps
        .iter()
        .any(|step| step.layer.as_ref().is_some_and(|l| l.relative_error_estimate.is_none()))
    {
        out.push("the error of the force is not known at all steps, and is not counted there".to_owned());
    }
    let worst =
        |error: &dyn Fn(&Step) -> Option<f64>| document.steps.iter().filter_map(error).fold(0.0, f64::max);
    let of_capacitance = worst(&|step| step.model_error_estimate);
    // The error of finite elements is already in the limits of the force.
    let of_force = worst(&|step| {
        let of_mesh = step.layer.as_ref().and_then(|layer| layer.relative_error_estimate);
        Some(step.force_error_estimate? - of_mesh.unwrap_or(0.0))
    });
    if of_capacitance.max(of_force) > NOTABLE {
        out.push(format!(
            "the limits are those of the model of the layer, which is off besides by up to {:.0} % of the capacitance \
             (`model_error_estimate`) and {:.0} % of the force (`force_error_estimate`)",
            1e2 * of_capacitance,
            1e2 * of_force
        ));
    }
    out
}
