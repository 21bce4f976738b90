//! `elastocap export`: a model of a solved sensor for circuit and system simulators.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use elastocap_circuits::model::{Content, Model, Settings};
use elastocap_circuits::{fmu, spice, table, verilog_a};
use elastocap_files::result_name;

use super::written::write_all;
use crate::common::Common;
use crate::exit::Exit;
use crate::output;

const EXAMPLES: &str = "\
Examples:
  elastocap run cases/in-plane-pair-by-force.toml -o results/pair
  elastocap export spice results/pair                   pair.lib, a subcircuit for ngspice and LTspice
  elastocap export verilog-a results/pair -o pair.va    a module for Spectre, ADS, OpenVAF
  elastocap export fmu results/pair                     pair.fmu, FMI 3.0: model exchange and co-simulation
  elastocap export table results/pair                   pair.csv: force, C, its bounds and dC/dF
  elastocap export table results/pair -o pair.json      the same, with the coefficients of the cubics
  elastocap export spice results/pair --matrix -o -     all conductors, on the standard output

The force is an input: in SPICE and Verilog-A the voltage of a node, 1 V for 1 N. Currents are the
derivative of the charge C(F) V, so that charge is conserved. Between the steps of the run C(F) is a
monotone cubic with a continuous derivative. `band` from -1 to 1 moves it from its lower to its
upper bound. Outside the range of the forces SPICE and Verilog-A keep the capacitance at the
range's end and raise the node `outside` to 1 V; an FMU refuses the force.

Refused with exit status 2: runs that were stopped, whose steps failed or have no force, whose force
does not grow with the compression, and capacitances that turn. docs/circuit-models.md has the rest.";

#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// What to write
    #[arg(value_enum)]
    format: Format,
    /// The output folder of a run, or the result.json in it
    result: PathBuf,
    /// Where to write it; `-` is the standard output [default: the name of the result, in this folder]
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Replace a file that is there already
    #[arg(long)]
    overwrite: bool,
    /// All conductors with their mutual capacitances and those to ground, where the run measured one
    /// capacitance
    #[arg(long)]
    matrix: bool,
    /// The name of the subcircuit, module or model [default: that of the result]
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
    /// Export capacitances too that grow with the force in one place and fall in another
    #[arg(long)]
    allow_turns: bool,
    /// Table: points for each interval between load steps
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = clap::value_parser!(u16).range(1..=10_000))]
    points: u16,
    /// FMU: the C compiler for its binary
    #[arg(long, value_name = "PROGRAM", default_value = "cc")]
    compiler: PathBuf,
    /// FMU: sources alone, no binary
    #[arg(long)]
    no_binary: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    /// A subcircuit for SPICE
    Spice,
    /// A module in Verilog-A
    VerilogA,
    /// An FMU of FMI 3.0
    Fmu,
    /// A table as CSV, or as JSON with the coefficients where FILE ends in .json
    Table,
}

impl Format {
    /// The extension of its file name.
    fn extension(self) -> &'static str {
        match self {
            Self::Spice => "lib",
            Self::VerilogA => "va",
            Self::Fmu => "fmu",
            Self::Table => "csv",
        }
    }
}

pub(crate) fn execute(arguments: &Arguments, common: &Common) -> Exit {
    let settings = Settings {
        content: if arguments.matrix { Content::Matrix } else { Content::Measured },
        name: arguments.name.clone(),
        allow_turns: arguments.allow_turns,
    };
    let model = match Model::read(&arguments.result, &settings) {
        Ok(model) => model,
        Err(error) => {
            output::error(&error.to_string());
            return Exit::BadInput;
        }
    };
    let name = format!("{}.{}", model.identifier, arguments.format.extension());
    let default_file =
        PathBuf::from(result_name(Path::new(&name))).with_extension(arguments.format.extension());
    let file = arguments.output.as_deref().unwrap_or(&default_file);
    let is_standard_output = file == Path::new("-");
    if is_standard_output && arguments.format == Format::Fmu {
        output::error("an FMU is an archive and does not go to the standard output; name a file with -o");
        return Exit::BadInput;
    }
    let bytes = match bytes(arguments, &model, file) {
        Ok(bytes) => bytes,
        Err(error) => {
            output::error(&error);
            return Exit::Failure;
        }
    };
    model.notes.iter().for_each(|note| output::warning(note));
    if is_standard_output {
        return output::result(&String::from_utf8_lossy(&bytes)).err().unwrap_or(Exit::Done);
    }
    if let Err(exit) = write_all(&[(file, bytes)], arguments.overwrite) {
        return exit;
    }
    if common.quiet {
        return Exit::Done;
    }
    output::result(&format!("{}\n", file.display())).err().unwrap_or(Exit::Done)
}

/// The file of a format.
fn bytes(arguments: &Arguments, model: &Model, file: &Path) -> Result<Vec<u8>, String> {
    let points = usize::from(arguments.points);
    match arguments.format {
        Format::Spice => Ok(spice::subcircuit(model).into_bytes()),
        Format::VerilogA => Ok(verilog_a::module(model).into_bytes()),
        Format::Table if file.extension().is_some_and(|e| e.eq_ignore_ascii_case("json")) => {
            table::json(model, points).map(String::into_bytes).map_err(|error| error.to_string())
        }
        Format::Table => Ok(table::csv(model, points).into_bytes()),
        Format::Fmu => {
            let binary = if arguments.no_binary {
                None
            } else {
                match fmu::compile(model, &arguments.compiler) {
                    Ok(binary) => Some(binary),
                    Err(error) => {
                        output::warning(&format!(
                            "{error}; the FMU has its sources and no binary: name a compiler with --compiler, or let the importer compile it"
                        ));
                        None
                    }
                }
            };
            fmu::archive(model, binary.as_deref()).map_err(|error| error.to_string())
        }
    }
}
