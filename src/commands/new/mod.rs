//! `elastocap new`: writes a commented case file to start from.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::written::write_all;
use crate::common::Common;
use crate::exit::Exit;
use crate::output;

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
    /// A grounded finger that approaches, touches and presses a layer over two pads
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
    if let Err(exit) = write_all(&[(file.as_path(), text)], arguments.overwrite) {
        return exit;
    }
    if common.quiet {
        return Exit::Done;
    }
    match output::result(&format!("{}\n", file.display())) {
        Ok(()) => Exit::Done,
        Err(exit) => exit,
    }
}
