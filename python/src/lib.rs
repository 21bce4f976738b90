//! The extension module `elastocap._core`: what the Python package `elastocap` needs of the library, and no more.
//!
//! It converts. Numbers go to Python as bytes, in the machine's own order, of which NumPy makes arrays without another copy; texts, names and
//! exceptions have the words of the command. The classes that people see are written in Python, in `elastocap/`, beside `_core.pyi`, which
//! has the types of all that is here.
//!
//! | file | what is in it |
//! |---|---|
//! | `case.rs` | a case: its text and what it means |
//! | `run.rs` | a run in threads of its own, while the calling one waits for signals and tells of the progress |
//! | `outcome.rs` | what a run found, and its files |
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
