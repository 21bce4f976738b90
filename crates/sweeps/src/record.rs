//! The stored result of one case.

use elastocap_coupling::outcome::{Outcome, Row, Status, StepResult};
use serde::{Deserialize, Serialize};

use crate::design::CaseValues;

/// The result of one case.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CaseRecord {
    /// The number of the case in the design.
    pub case: usize,
    /// The values of the varied keys.
    pub values: CaseValues,
    /// The reason why the case was not solved at all, such as a refused case file; then there are no steps.
    pub refused: Option<String>,
    /// The load steps.
    pub steps: Vec<StepRecord>,
    /// Warnings for the user.
    pub warnings: Vec<String>,
    /// Wall-clock seconds of the case, the only field that differs between runs.
    pub seconds: f64,
}

/// One load step of a case.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StepRecord {
    /// The columns of curve.csv before `unknowns`, in the order of [`Row::COLUMNS`] and in SI units.
    pub numbers: Vec<Option<f64>>,
    /// The number of unknowns of the largest problem solved.
    pub unknowns: Option<usize>,
    /// The last column of curve.csv.
    pub status: String,
    /// Whether the step has complete results.
    pub ok: bool,
    /// Whether the step could not be solved.
    pub failed: bool,
    /// The reason why the step failed, missed its tolerance or has no force.
    pub message: Option<String>,
}

impl CaseRecord {
    /// The record of a case that could not be solved.
    pub fn refused(case: usize, values: CaseValues, why: String) -> Self {
        Self { case, values, refused: Some(why), steps: Vec::new(), warnings: Vec::new(), seconds: 0.0 }
    }

    /// The record of a case that was solved, whether or not its steps failed.
    pub fn of_outcome(case: usize, values: CaseValues, outcome: &Outcome, seconds: f64) -> Self {
        let of_steps = outcome.steps.iter().flat_map(|step| &step.warnings);
        let warnings =
            outcome.plan.warnings.iter().chain(&outcome.warnings).chain(of_steps).cloned().collect();
        let steps = outcome.steps.iter().map(StepRecord::of).collect();
        Self { case, values, refused: None, steps, warnings, seconds }
    }

    /// Whether every step has complete results.
    pub fn is_ok(&self) -> bool {
        self.refused.is_none() && self.steps.iter().all(|step| step.ok)
    }

    /// Whether the case or one of its steps could not be solved.
    pub fn has_failed(&self) -> bool {
        self.refused.is_some() || self.steps.iter().any(|step| step.failed)
    }
}

impl StepRecord {
    fn of(step: &StepResult) -> Self {
        // JSON has no infinities: they are left out, so that a record is the same before and after it is on
        // disk.
        let numbers = step.row.numbers().into_iter().map(|number| number.filter(|value| value.is_finite()));
        Self {
            numbers: numbers.collect(),
            unknowns: step.row.unknowns,
            status: step.row.status.to_string(),
            ok: step.row.status.is_ok(),
            failed: matches!(step.row.status, Status::Failed(_)),
            message: step.reason.as_ref().map(ToString::to_string),
        }
    }

    /// A number by the name of its column in curve.csv, such as `capacitance_f`, in SI units.
    pub fn number(&self, column: &str) -> Option<f64> {
        let at = Row::COLUMNS.iter().position(|name| *name == column)?;
        self.numbers.get(at).copied().flatten()
    }
}
