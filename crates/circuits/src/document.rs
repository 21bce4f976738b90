//! The part of `result.json` that a model needs.

use serde::Deserialize;

/// The parts of `result.json` that make a model.
#[derive(Debug, Deserialize)]
pub(crate) struct Document {
    pub(crate) title: String,
    #[serde(default)]
    pub(crate) case: String,
    pub(crate) status: String,
    #[serde(default)]
    pub(crate) conductors: Vec<String>,
    pub(crate) measurement: Option<Measured>,
    pub(crate) bounds: Option<String>,
    pub(crate) steps: Vec<Step>,
    #[serde(default)]
    pub(crate) plan: Plan,
    #[serde(default)]
    pub(crate) versions: Versions,
}

#[derive(Debug, Default, Deserialize)]
pub(crate) struct Versions {
    #[serde(default)]
    pub(crate) elastocap: String,
}

#[derive(Debug, Default, Deserialize)]
pub(crate) struct Plan {
    #[serde(default)]
    pub(crate) steps: Vec<PlannedStep>,
}

#[derive(Debug, Deserialize)]
pub(crate) struct PlannedStep {
    /// The displacement of the attached bodies, if they have one.
    #[serde(default)]
    pub(crate) pose: Option<serde_json::Value>,
}

#[derive(Debug, Deserialize)]
pub(crate) struct Measured {
    /// "two_terminal", "mutual", "own", "guarded" or "matrix".
    pub(crate) kind: String,
    pub(crate) terminals: Vec<String>,
}

/// A step of the result. Forces in N, capacitances in F.
#[derive(Debug, Deserialize)]
pub(crate) struct Step {
    pub(crate) index: usize,
    #[serde(default)]
    pub(crate) compression: Option<f64>,
    pub(crate) force_n: Option<f64>,
    #[serde(default)]
    pub(crate) distance_m: Option<f64>,
    pub(crate) capacitance_f: Option<f64>,
    pub(crate) capacitance_lower_f: Option<f64>,
    pub(crate) capacitance_upper_f: Option<f64>,
    pub(crate) maxwell_matrix_f: Option<Vec<Vec<f64>>>,
    pub(crate) maxwell_matrix_lower_f: Option<Vec<Vec<f64>>>,
    pub(crate) maxwell_matrix_upper_f: Option<Vec<Vec<f64>>>,
    #[serde(default)]
    pub(crate) mechanics_error_estimate: Option<f64>,
    #[serde(default)]
    pub(crate) geometry_error_estimate: Option<f64>,
    #[serde(default)]
    pub(crate) model_error_estimate: Option<f64>,
    #[serde(default)]
    pub(crate) force_error_estimate: Option<f64>,
    pub(crate) status: String,
    #[serde(default)]
    pub(crate) reason: Option<String>,
}

impl Step {
    /// Whether the step is before contact, where a model of the force does not apply.
    pub(crate) fn is_before_contact(&self) -> bool {
        self.distance_m.is_some_and(|distance| distance > 0.0)
    }

    /// The relative error by which the bounds are widened: the estimated errors of the layer's finite
    /// elements and of the faceting.
    pub(crate) fn estimates(&self) -> f64 {
        self.mechanics_error_estimate.unwrap_or(0.0) + self.geometry_error_estimate.unwrap_or(0.0)
    }

    /// The reason why the step is incomplete, in the words of the run.
    pub(crate) fn why(&self) -> String {
        self.reason.clone().unwrap_or_else(|| self.status.clone())
    }
}
