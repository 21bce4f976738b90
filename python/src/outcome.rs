//! The result of a run.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use elastocap::case::Case;
use elastocap::coupling::outcome::{Outcome, Row, StepResult};
use elastocap::coupling::plan::Options;
use elastocap::coupling::shortfalls;
use elastocap::coupling::terminals::named;
use elastocap::electrostatics::Bounded;
use elastocap::results::{FieldFiles, RunSeconds, StepFields, document, save_kept};
use pyo3::exceptions::{PyIndexError, PyKeyError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::errors::{failed, unwritable};
use crate::field;
use crate::numbers::bytes;

/// The steps of a run with their numbers, and the fields if they were kept.
#[pyclass(frozen, name = "Outcome", module = "elastocap._core")]
pub(crate) struct PyOutcome {
    pub(crate) case: Arc<Case>,
    pub(crate) outcome: Outcome,
    pub(crate) options: Options,
    pub(crate) fields: StepFields,
    /// The time that planning took.
    pub(crate) planning: Duration,
    /// The text of the case.
    pub(crate) text: String,
}

impl PyOutcome {
    fn step(&self, index: usize) -> PyResult<&StepResult> {
        let count = self.outcome.steps.len();
        self.outcome.steps.get(index).ok_or_else(|| {
            PyIndexError::new_err(format!("there is no step {index}: the run has {count}, counted from 0"))
        })
    }

    /// A value of each step.
    fn of_steps<T>(&self, value: impl Fn(&StepResult) -> T) -> Vec<T> {
        self.outcome.steps.iter().map(value).collect()
    }
}

#[pymethods]
impl PyOutcome {
    fn __len__(&self) -> usize {
        self.outcome.steps.len()
    }

    /// The columns of curve.csv, in their order.
    #[staticmethod]
    fn columns() -> Vec<&'static str> {
        Row::COLUMNS.to_vec()
    }

    /// A column of curve.csv before `unknowns`: a number for each step, NaN where the cell is empty.
    fn numbers<'py>(&self, py: Python<'py>, column: &str) -> PyResult<Bound<'py, PyBytes>> {
        let known = Row::default().numbers().len();
        let place = Row::COLUMNS.iter().take(known).position(|name| *name == column);
        let place = place.ok_or_else(|| PyKeyError::new_err(column.to_owned()))?;
        let steps = &self.outcome.steps;
        bytes(py, steps.len(), steps.iter().map(|step| step.row.numbers()[place].unwrap_or(f64::NAN)))
    }

    /// Unknowns of the largest problem of each step.
    #[getter]
    fn unknowns(&self) -> Vec<Option<usize>> {
        self.of_steps(|step| step.row.unknowns)
    }

    /// How each step went, in the words of curve.csv.
    #[getter]
    fn statuses(&self) -> Vec<String> {
        self.of_steps(|step| step.row.status.to_string())
    }

    /// Whether each step has all that was asked for.
    #[getter]
    fn ok(&self) -> Vec<bool> {
        self.of_steps(|step| step.row.status.is_ok())
    }

    /// Why each step failed, missed its tolerance or has no force.
    #[getter]
    fn reasons(&self) -> Vec<Option<String>> {
        self.of_steps(|step| step.reason.as_ref().map(ToString::to_string))
    }

    /// Seconds that each step took; zero for a repeated one.
    #[getter]
    fn seconds(&self) -> Vec<f64> {
        self.of_steps(|step| step.seconds.total)
    }

    /// Warnings about each step.
    #[getter]
    fn step_warnings(&self) -> Vec<Vec<String>> {
        self.of_steps(|step| step.warnings.clone())
    }

    /// Names of the driven terminals, in the order of the matrices.
    #[getter]
    fn terminals(&self) -> Vec<String> {
        self.outcome.conductors.clone()
    }

    /// The measurement: its kind, and the names of its terminals.
    #[getter]
    fn measurement(&self) -> Option<(&'static str, Vec<&str>)> {
        self.outcome.measurement.map(|measured| named(measured, &self.outcome.conductors))
    }

    /// Maxwell matrices of all steps, their lower bounds and their upper bounds, each of shape (steps,
    /// terminals, terminals); NaN where a step was not solved.
    fn maxwell<'py>(&self, py: Python<'py>) -> PyResult<[Bound<'py, PyBytes>; 3]> {
        let order = self.outcome.conductors.len();
        let steps = &self.outcome.steps;
        let part = |pick: fn(&Bounded) -> f64| {
            let entries = steps.iter().flat_map(|step| {
                (0..order * order).map(move |k| {
                    let entry =
                        step.maxwell.as_ref().and_then(|matrix| matrix.get(k / order)?.get(k % order));
                    entry.map_or(f64::NAN, pick)
                })
            });
            bytes(py, steps.len() * order * order, entries)
        };
        Ok([part(|c| c.value)?, part(|c| c.lower)?, part(|c| c.upper)?])
    }

    /// The field of a step, if the run kept fields and the step has one.
    fn field<'py>(&self, py: Python<'py>, index: usize) -> PyResult<Option<Bound<'py, PyDict>>> {
        let step = self.step(index)?;
        match self.fields.of(step) {
            Some(found) => field::of(py, step, found),
            None => Ok(None),
        }
    }

    /// Whether every step has all that was asked for.
    #[getter]
    fn complete(&self) -> bool {
        self.outcome.is_complete()
    }

    /// Whether the run was stopped before all steps were done.
    #[getter]
    fn stopped(&self) -> bool {
        self.outcome.stopped
    }

    /// The warnings that the command prints: the plan's warnings, those of the run, and steps that lack
    /// something.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        let Outcome { plan, warnings, steps, .. } = &self.outcome;
        [plan.warnings.clone(), warnings.clone(), shortfalls::of_run(steps)].concat()
    }

    /// Wall-clock seconds of all steps together.
    #[getter]
    fn solve_seconds(&self) -> f64 {
        self.outcome.solve_seconds
    }

    /// Threads that worked on it.
    #[getter]
    fn threads(&self) -> usize {
        self.outcome.threads
    }

    /// The text of result.json, without names of files.
    fn json(&self) -> PyResult<String> {
        let seconds = RunSeconds {
            plan: self.planning.as_secs_f64(),
            solve: self.outcome.solve_seconds,
            files: 0.0,
            total: self.planning.as_secs_f64() + self.outcome.solve_seconds,
        };
        let warnings = self.outcome.warnings.clone();
        document(
            &self.case,
            &self.outcome,
            &FieldFiles::default(),
            Vec::new(),
            warnings,
            seconds,
            Some(&self.text),
        )
        .map_err(|error| failed(&format!("the result has no form in JSON: {error}")))
    }

    /// Writes the files of the run; returns the folder, the files and what the user should know of them.
    fn save(
        &self,
        py: Python<'_>,
        folder: PathBuf,
        scene: bool,
    ) -> PyResult<(PathBuf, Vec<PathBuf>, Vec<String>)> {
        let options = Options { scene, ..self.options };
        let write = || {
            save_kept(
                &self.case,
                &self.outcome,
                &options,
                &folder,
                &self.fields,
                self.planning,
                Some(&self.text),
            )
        };
        let saved = py.detach(write);
        let saved = saved.map_err(|error| unwritable(&error))?;
        Ok((saved.folder, saved.files, saved.warnings))
    }
}
