//! One file for each subcommand.

pub(crate) mod accuracy;
mod accuracy_report;
mod arguments;
pub(crate) mod check;
pub(crate) mod figures;
pub(crate) mod force;
pub(crate) mod gather;
pub(crate) mod mesh;
pub(crate) mod new;
mod progress;
pub(crate) mod run;
pub(crate) mod schema;
pub(crate) mod stability;
mod stop;
mod summary;
pub(crate) mod sweep;
mod sweep_report;

use std::path::{Path, PathBuf};

use elastocap_case::Case;
use elastocap_coupling::shortfalls;

use crate::{Exit, output};

/// Loads the case; prints what is wrong with the file on stderr.
fn load(path: &Path) -> Result<Case, Exit> {
    elastocap_case::load(path).map_err(|error| {
        output::message(&error.render(output::stderr_has_colour()));
        Exit::BadInput
    })
}

/// The folder for results: as asked for, or `results/` and the name of the case.
fn output_folder(asked: Option<&Path>, case: &Path) -> PathBuf {
    match asked {
        Some(folder) => folder.to_owned(),
        None => Path::new("results").join(case.file_stem().unwrap_or(case.as_os_str())),
    }
}
