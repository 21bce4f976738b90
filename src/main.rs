//! The `elastocap` command: arguments in, exit status out. The work is done in the crates.

mod commands;
mod common;
mod exit;
mod guard;
mod output;
mod units;

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use elastocap_coupling::memory;

use crate::common::Common;
use crate::exit::Exit;
use crate::guard::Guard;

const EXAMPLES: &str = "\
Examples:
  elastocap new pair sensor.toml               a commented case file to start from
  elastocap run cases/in-plane-pair.toml       C(F) with its bounds, in results/in-plane-pair
  elastocap check cases/in-plane-pair.toml     what will be solved, and how long it will take
  elastocap force results/in-plane-pair --capacitance 41.2fF+-0.05fF
                                               the force that belongs to a measured capacitance
  elastocap compare results/a results/b        what differs in the cases, in C and in time
  elastocap export spice results/in-plane-pair
                                               its curve as a subcircuit, for circuit simulators
  elastocap sweep cases/in-plane-pair.toml --set electrodes.in_plane_pair.gap=10um..100um:10
                                               one table of many cases
  elastocap accuracy cases/in-plane-pair.toml  what accuracy costs: errors against run time
  elastocap stability --quick                  whether extreme cases are answered right
  elastocap figures --only 9,16                figures of the paper, with finite elements
  elastocap schema > elastocap.schema.json     for editors that check case files as you type
  elastocap completions bash                   completions for a shell; `elastocap man DIR` man pages

Exit status:
  0  done
  1  failed: results cannot be written, for instance
  2  bad input: nothing was solved or written
  3  finished, but a step failed, missed its tolerance or was not run; its results are kept
     and marked";

/// What capacitance does this soft sensor show under this force, and how far may the number be trusted?
#[derive(Debug, Parser)]
#[command(name = "elastocap", version, after_help = EXAMPLES, arg_required_else_help = true)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
    #[command(flatten)]
    common: Common,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Write a commented case file of an everyday sensor to start from
    New(commands::new::Arguments),
    /// Solve a case and write its results
    Run(commands::run::Arguments),
    /// Validate a case and print the plan: what is solved and left out, with estimates of memory and time
    Check(commands::check::Arguments),
    /// Give the force that belongs to a measured capacitance, with its limits, by the curve of a run
    Force(commands::force::Arguments),
    /// Lay results side by side: what differs in the cases, in the capacitances with their bounds, and in
    /// time
    Compare(commands::compare::Arguments),
    /// Write a model of a solved sensor for circuit and system simulators: SPICE, Verilog-A, FMI 3.0, tables
    Export(commands::export::Arguments),
    /// Fit keys of a case to measured points, with intervals, and say what the data cannot tell apart
    Fit(commands::fit::Arguments),
    /// Vary keys of a case until a quantity is largest or smallest, within limits
    Optimise(commands::optimise::Arguments),
    /// Show what accuracy costs: errors against run time on many grids, and on those that the solver chooses
    Accuracy(commands::accuracy::Arguments),
    /// Solve many cases from one file with values changed: grids, lists, tolerances; one table, resumable
    Sweep(commands::sweep::Arguments),
    /// Join the shards of a sweep into one table
    Gather(commands::gather::Arguments),
    /// Write the bodies (scene.glb) and a grid of them (.vtu) without solving
    Mesh(commands::mesh::Arguments),
    /// Solve a catalogue of stiff and extreme cases and say whether the answers are right
    Stability(commands::stability::Arguments),
    /// Draw the figures and tables of the paper: closed form as lines, finite elements as points, data as CSV
    Figures(commands::figures::Arguments),
    /// Print the JSON Schema of case files, for editors
    Schema(commands::schema::Arguments),
    /// Print a script that completes commands, options and files in a shell
    Completions(commands::completions::Arguments),
    /// Print the man page, or write those of all commands to a folder
    Man(commands::man::Arguments),
}

/// The default number of threads. Under a limit on the address space it is the number that the limit has room
/// for, at most one for each processor. Without a limit it is 0, and rayon chooses.
fn default_threads() -> usize {
    let processors = std::thread::available_parallelism().map_or(1, usize::from);
    memory::max_threads().map_or(0, |most| processors.min(most))
}

fn main() -> ExitCode {
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => {
            // Help and version arrive here too, but are not errors: clap knows the stream and the status of
            // each.
            let _ = error.print();
            return ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(2));
        }
    };
    // The guard starts before the computing threads, whose memory its threads might lack.
    let guard = match Guard::start() {
        Ok(guard) => guard,
        Err(error) => {
            output::error(&format!("cannot start a thread: {error}"));
            return Exit::Failure.into();
        }
    };
    let threads = arguments.common.threads.map_or_else(default_threads, usize::from);
    if let Err(error) = rayon::ThreadPoolBuilder::new().num_threads(threads).build_global() {
        output::error(&format!("cannot start the threads: {error}"));
        return Exit::Failure.into();
    }
    let common = &arguments.common;
    let exit = match &arguments.command {
        Command::New(arguments) => commands::new::execute(arguments, common),
        Command::Run(arguments) => commands::run::execute(arguments, common, &guard),
        Command::Check(arguments) => commands::check::execute(arguments, common),
        Command::Force(arguments) => commands::force::execute(arguments),
        Command::Compare(arguments) => commands::compare::execute(arguments),
        Command::Export(arguments) => commands::export::execute(arguments, common),
        Command::Fit(arguments) => commands::fit::execute(arguments, common),
        Command::Optimise(arguments) => commands::optimise::execute(arguments, common),
        Command::Accuracy(arguments) => commands::accuracy::execute(arguments, common),
        Command::Sweep(arguments) => commands::sweep::execute(arguments, common),
        Command::Gather(arguments) => commands::gather::execute(arguments, common),
        Command::Mesh(arguments) => commands::mesh::execute(arguments, common),
        Command::Stability(arguments) => commands::stability::execute(arguments, common),
        Command::Figures(arguments) => commands::figures::execute(arguments, common),
        Command::Schema(arguments) => commands::schema::execute(arguments),
        Command::Completions(arguments) => commands::completions::execute(arguments),
        Command::Man(arguments) => commands::man::execute(arguments, common),
    };
    exit.into()
}
