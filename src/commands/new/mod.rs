//! `elastocap new`: a commented case file to start from.

use std::fs::{self, File};
use std::io::{self, ErrorKind, Write as _};
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};

use crate::{Common, Exit, output};

const EXAMPLES: &str = "\
Examples:
  elastocap new pair                     prints the case file
  elastocap new pair sensor.toml         writes it
  elastocap check sensor.toml            what will be solved, and how long it will take
  elastocap run sensor.toml              solves it, in some seconds
  elastocap new finger sensor.toml --overwrite

Every key has a comment: its unit, what it means, and what could stand there instead. docs/keys.md
has all keys. A file that is there already is left alone, with exit status 2, unless
--overwrite is given.";

#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// The sensor to start from
    #[arg(value_enum)]
    sensor: Sensor,
    /// Where to write the case file; the standard output by default
    file: Option<PathBuf>,
    /// Replace a file that is there already
    #[arg(long, requires = "file")]
    overwrite: bool,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Sensor {
    /// Two combs on a board under a pressed layer
    Comb,
    /// Pads on a board under a common plate that rides on the layer
    Array,
    /// Two electrodes side by side in a layer under force
    Pair,
    /// Two plates, one above the other, in a layer under force
    Stack,
    /// Four pads under a floating plate that is pressed, shifted and tilted
    Quadrants,
    /// A grounded fingertip that approaches, touches and presses a layer over two pads
    Finger,
}

impl Sensor {
    fn case_file(self) -> &'static str {
        match self {
            Self::Comb => include_str!("comb.toml"),
            Self::Array => include_str!("array.toml"),
            Self::Pair => include_str!("pair.toml"),
            Self::Stack => include_str!("stack.toml"),
            Self::Quadrants => include_str!("quadrants.toml"),
            Self::Finger => include_str!("finger.toml"),
        }
    }
}

pub(crate) fn execute(arguments: &Arguments, common: &Common) -> Exit {
    let text = arguments.sensor.case_file();
    let Some(file) = &arguments.file else {
        return match output::result(text) {
            Ok(()) => Exit::Done,
            Err(exit) => exit,
        };
    };
    match write(file, text, arguments.overwrite) {
        Ok(()) => {}
        Err(error) if error.kind() == ErrorKind::AlreadyExists => {
            output::error(&format!(
                "`{}` is there already and would be replaced: name another file, or add --overwrite",
                file.display()
            ));
            return Exit::BadInput;
        }
        Err(error) => {
            output::error(&format!("cannot write `{}`: {error}; name another file", file.display()));
            return Exit::Failure;
        }
    }
    if common.quiet {
        return Exit::Done;
    }
    match output::result(&format!("{}\n", file.display())) {
        Ok(()) => Exit::Done,
        Err(exit) => exit,
    }
}

fn write(file: &Path, text: &str, overwrite: bool) -> io::Result<()> {
    if overwrite {
        return fs::write(file, text);
    }
    // Opened as a new file, so that one that appears in the meantime is not replaced either.
    File::create_new(file)?.write_all(text.as_bytes())
}
