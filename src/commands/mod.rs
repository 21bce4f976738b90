//! The subcommands, one file for each.

pub(crate) mod accuracy;
mod accuracy_report;
mod arguments;
pub(crate) mod check;
pub(crate) mod compare;
pub(crate) mod completions;
pub(crate) mod export;
pub(crate) mod figures;
pub(crate) mod fit;
pub(crate) mod force;
pub(crate) mod gather;
mod inputs;
pub(crate) mod man;
pub(crate) mod mesh;
pub(crate) mod new;
pub(crate) mod optimise;
mod progress;
pub(crate) mod run;
pub(crate) mod schema;
pub(crate) mod stability;
mod stop;
mod summary;
pub(crate) mod sweep;
mod sweep_report;
mod watch;
mod written;

use std::io::{self, Read};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use elastocap_case::{Case, OverrideError};
use elastocap_coupling::failure::panic_message;
use elastocap_coupling::shortfalls;

use crate::exit::Exit;
use crate::output;

/// The name that stands for the standard input where a case file is named.
const STDIN: &str = "-";

/// The standard input in messages, and as the file name of a case read from it.
const STDIN_NAME: &str = "<stdin>";

/// Loads the case, from the standard input if `path` is `-`; prints the errors in it on stderr.
fn load(path: &Path) -> Result<Case, Exit> {
    load_with_text(path).map(|(_, case)| case)
}

/// Loads the case as [`load`] does, and returns its text too: the standard input cannot be read again, and a
/// file may change meanwhile.
fn load_with_text(path: &Path) -> Result<(String, Case), Exit> {
    let loaded = match path.as_os_str() == STDIN {
        true => {
            let mut input = Kept { stream: std::io::stdin().lock(), bytes: Vec::new() };
            let case = elastocap_case::load_from(&mut input, Path::new(STDIN_NAME));
            case.map(|case| (String::from_utf8_lossy(&input.bytes).into_owned(), case))
        }
        false => elastocap_case::read_source(path).and_then(|text| {
            let case = elastocap_case::parse(&text, path)?;
            Ok((text, case))
        }),
    };
    loaded.map_err(|error| {
        output::message(&error.render(output::stderr_has_colour()));
        Exit::BadInput
    })
}

/// Does the work for one case of several. A defect of the program in it, a panic, is reported and does not
/// stop the other cases.
fn catching_defects<T>(case: &Path, work: impl FnOnce() -> T) -> Result<T, Exit> {
    // Unwind-safe: results are put in place at the end, so that a panic leaves no half-done work that others
    // would see.
    catch_unwind(AssertUnwindSafe(work)).map_err(|defect| {
        output::error(&format!(
            "`{}` met a defect of elastocap, please report it with the case file: {}",
            case.display(),
            panic_message(&*defect)
        ));
        Exit::Failure
    })
}

/// A stream that keeps a copy of the bytes read from it.
struct Kept<R> {
    stream: R,
    bytes: Vec<u8>,
}

impl<R: Read> Read for Kept<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.stream.read(buffer)?;
        self.bytes.extend(buffer.iter().take(read));
        Ok(read)
    }
}

/// The text of a case for another folder than that of its file: the path of its measured points still leads
/// to them.
fn moved_to(text: &str, from: &Path, to: &Path) -> Result<String, OverrideError> {
    let folder = |path: &Path| {
        let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
        parent.canonicalize().unwrap_or_else(|_| parent.to_owned())
    };
    let (from, to) = (folder(from), folder(to));
    let written = elastocap_case::value_at(text, MEASURED_FILE)?;
    let (Some(file), true) = (written, from != to) else { return Ok(text.to_owned()) };
    let file = from.join(file.trim_matches(['"', '\'']));
    elastocap_case::with_value(text, MEASURED_FILE, &format!("{:?}", file.display().to_string()))
}

/// The key that names the file of measured points.
const MEASURED_FILE: &str = "measurement.file";

/// The folder for results: the requested one, or `results/` and the name of the case.
fn output_folder(requested: Option<&Path>, case: &Path) -> PathBuf {
    match requested {
        Some(folder) => folder.to_owned(),
        None => Path::new("results").join(inputs::folder_name(case)),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::panic, reason = "a panic is what is tested")]
    use super::*;

    #[test]
    fn a_panic_in_one_case_of_several_is_a_failure_of_that_case_alone() {
        let paths = ["a.toml", "b.toml", "c.toml"].map(Path::new);
        let done = paths.map(|path| {
            catching_defects(path, || match path.starts_with("b.toml") {
                true => panic!("a defect"),
                false => Exit::Done,
            })
        });
        assert_eq!(done, [Ok(Exit::Done), Err(Exit::Failure), Ok(Exit::Done)]);
    }
}
