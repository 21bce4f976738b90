//! The exceptions of the package, with the words of the command.

use elastocap::case::{CaseError as InvalidCase, OverrideError};
use elastocap::results::OutputError as Unwritable;
use pyo3::PyErr;

mod classes {
    //! Written in Python, in `elastocap/errors.py`.
    #![allow(missing_docs)]

    pyo3::import_exception!(elastocap.errors, CaseError);
    pyo3::import_exception!(elastocap.errors, ElastocapError);
    pyo3::import_exception!(elastocap.errors, OutputError);
}

/// The exception for all errors in a case: the message that the command prints, and each error as (message,
/// line, column, help); line and column are counted from 1.
pub(crate) fn invalid_case(error: &InvalidCase) -> PyErr {
    let problems: Vec<_> = (error.diagnostics().iter())
        .map(|problem| {
            let (line, column) = error.line_column(problem).unzip();
            (problem.message.clone(), line, column, problem.help.clone())
        })
        .collect();
    classes::CaseError::new_err((error.render(false), problems))
}

/// The exception for a key that cannot be set.
pub(crate) fn bad_override(error: &OverrideError) -> PyErr {
    classes::CaseError::new_err(format!("error: {error}"))
}

/// The exception for values that cannot be read.
pub(crate) fn bad_values(what: &str) -> PyErr {
    classes::CaseError::new_err(format!("error: {what}"))
}

/// The exception for results that cannot be written.
pub(crate) fn unwritable(error: &Unwritable) -> PyErr {
    classes::OutputError::new_err(format!("error: {error}"))
}

/// The exception for any other failure.
pub(crate) fn failed(what: &str) -> PyErr {
    classes::ElastocapError::new_err(format!("error: {what}"))
}
