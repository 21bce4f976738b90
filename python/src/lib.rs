//! The extension module `elastocap._core`: the parts of the library that the Python package `elastocap`
//! needs.
//!
//! It converts values. Numbers go to Python as bytes in native byte order, which NumPy uses without another
//! copy; texts, names and exceptions have the words of the command. The public classes are written in Python,
//! in `elastocap/`, beside `_core.pyi`, which has the types of this module.
//!
//! | file | what is in it |
//! |---|---|
//! | `case.rs` | a case: its text and its content |
//! | `run.rs` | a run in separate threads, while the calling thread handles signals and progress |
//! | `outcome.rs` | the results of a run, and their files |
//! | `field.rs` | the field of a step |
//! | `sweep.rs` | the values of a key, as the command takes them |
//! | `errors.rs` | the exceptions |
//! | `numbers.rs` | numbers as bytes |

mod case;
mod errors;
mod field;
mod numbers;
mod outcome;
mod run;
mod sweep;

use pyo3::prelude::*;

/// The compiled part of the package `elastocap`. Use that package.
#[pymodule]
mod _core {
    #[pymodule_export]
    use super::case::{PyCase, load, number_in_si, parse, with_value};
    #[pymodule_export]
    use super::outcome::PyOutcome;
    #[pymodule_export]
    use super::run::run;
    #[pymodule_export]
    use super::sweep::sweep_values;

    /// The version of the library.
    #[pymodule_export]
    const VERSION: &str = env!("CARGO_PKG_VERSION");
}
