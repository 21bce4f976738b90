//! Cases, with their text.

use std::ffi::OsStr;
use std::path::PathBuf;
use std::sync::Arc;

use elastocap::case::{self, Case};
use elastocap::coupling::plan::{Options, Plan};
use pyo3::prelude::*;

use crate::errors::{bad_override, invalid_case};

/// A valid case and the text that it was read from.
#[pyclass(frozen, name = "Case", module = "elastocap._core")]
pub(crate) struct PyCase {
    pub(crate) case: Arc<Case>,
    pub(crate) text: String,
    origin: PathBuf,
}

#[pymethods]
impl PyCase {
    /// The text of the case in TOML.
    #[getter]
    fn text(&self) -> &str {
        &self.text
    }

    /// The file that it is from; paths in the case are relative to its folder.
    #[getter]
    fn origin(&self) -> &OsStr {
        self.origin.as_os_str()
    }

    /// One line that says what the case is.
    #[getter]
    fn title(&self) -> &str {
        &self.case.title
    }

    /// How many steps a run of it has.
    fn count_steps(&self, py: Python<'_>) -> usize {
        py.detach(|| Plan::new(&self.case, &Options::default()).steps.len())
    }
}

/// Reads and validates a case file.
#[pyfunction]
pub(crate) fn load(py: Python<'_>, path: PathBuf) -> PyResult<PyCase> {
    let text = py.detach(|| case::read_source(&path)).map_err(|error| invalid_case(&error))?;
    parse(py, text, path)
}

/// Validates the text of a case; `origin` is the file it is from, for messages and relative paths.
#[pyfunction]
pub(crate) fn parse(py: Python<'_>, text: String, origin: PathBuf) -> PyResult<PyCase> {
    let case = py.detach(|| case::parse(&text, &origin)).map_err(|error| invalid_case(&error))?;
    Ok(PyCase { case: Arc::new(case), text, origin })
}

/// The text of a case with the value at a path replaced or added; the value is TOML.
#[pyfunction]
pub(crate) fn with_value(text: &str, path: &str, value: &str) -> PyResult<String> {
    case::with_value(text, path, value).map_err(|error| bad_override(&error))
}

/// A text as a number in SI units, if it is one with a unit or without.
#[pyfunction]
pub(crate) fn number_in_si(text: &str) -> Option<f64> {
    text.parse::<case::Amount>().ok().map(|number| number.si)
}
