//! Reads the values of a varied key, as `--set` of the command has them.

use elastocap_sweeps::{Setting, Values};
use pyo3::prelude::*;

use crate::errors::bad_values;

/// The values of a key, in TOML, of a text such as `10um..100um:10` or `400um, 450um`.
#[pyfunction]
pub(crate) fn sweep_values(key: &str, values: &str) -> PyResult<Vec<String>> {
    let read =
        format!("{key}={values}").parse::<Setting>().map_err(|error| bad_values(&error.to_string()))?;
    match read.values {
        Values::Listed(values) => Ok(values),
        Values::Drawn(_) => {
            let message = format!(
                "`{values}` is a distribution; draw its values, with NumPy for instance, and give them as a list"
            );
            Err(bad_values(&message))
        }
    }
}
