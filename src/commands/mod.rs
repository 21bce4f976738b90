//! One file for each subcommand.

pub(crate) mod accuracy;
mod accuracy_report;
mod arguments;
pub(crate) mod check;
pub(crate) mod compare;
pub(crate) mod completions;
pub(crate) mod export;
pub(crate) mod figures;
pub(crate) mod force;
pub(crate) mod gather;
mod inputs;
pub(crate) mod man;
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
mod watch;

use std::io::{self, Read};
use std::path::{Path, PathBuf};

use elastocap_case::Case;

use crate::{Exit, output};

/// What stands for the standard input where a case file is named.
const STDIN: &str = "-";

/// The standard input in messages, and as the file that a case from there came from.
const STDIN_NAME: &str = "<stdin>";

/// Loads the case, from the standard input if `path` is `-`; prints what is wrong with the file on stderr.
fn load(path: &Path) -> Result<Case, Exit> {
    load_with_text(path).map(|(case, _)| case)
}

/// The same, with the text of the case where it came from the standard input, which cannot be read again.
fn load_with_text(path: &Path) -> Result<(Case, Option<String>), Exit> {
    let loaded = match path.as_os_str() == STDIN {
        true => {
            let mut input = Kept { stream: std::io::stdin().lock(), bytes: Vec::new() };
            let case = elastocap_case::load_from(&mut input, Path::new(STDIN_NAME));
            case.map(|case| (case, String::from_utf8(input.bytes).ok()))
        }
        false => elastocap_case::load(path).map(|case| (case, None)),
    };
    loaded.map_err(|error| {
        output::message(&error.render(output::stderr_has_colour()));
        Exit::BadInput
    })
}

/// A stream that keeps a copy of what is read from it.
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

/// The folder for results: as asked for, or `results/` and the name of the case.
fn output_folder(asked: Option<&Path>, case: &Path) -> PathBuf {
    match asked {
        Some(folder) => folder.to_owned(),
        None => Path::new("results").join(inputs::folder_name(case)),
    }
}
