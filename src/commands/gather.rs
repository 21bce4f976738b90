//! `elastocap gather`: joins the shards of a sweep.

use std::path::PathBuf;

use clap::Args;
use elastocap_sweeps::gather;

use super::sweep_report::finish;
use crate::common::Common;
use crate::exit::Exit;
use crate::output;
use crate::units::grouped;

const EXAMPLES: &str = "\
Examples:
  elastocap gather part-1 part-2 -o whole
  elastocap gather results/in-plane-pair-sweep-*-of-4 -o results/in-plane-pair-sweep

The folder gets what a single run would have written; sweep.csv is the same to the byte.";

#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// The folders of all shards, in any order
    #[arg(required = true, value_name = "DIR")]
    folders: Vec<PathBuf>,
    /// Output folder
    #[arg(long, short, value_name = "DIR")]
    output: PathBuf,
    /// Replace the sweep that the output folder holds
    #[arg(long)]
    overwrite: bool,
    /// Print sweep.json, and nothing else, on the standard output
    #[arg(long)]
    json: bool,
}

pub(crate) fn execute(arguments: &Arguments, common: &Common) -> Exit {
    match gather(&arguments.folders, &arguments.output, arguments.overwrite) {
        Ok(summary) => {
            let shards = arguments.folders.len();
            let head = format!(
                "{}\n\n{} cases from {shards} shards, {} failed\n",
                summary.title,
                grouped(summary.cases),
                grouped(summary.failed.len())
            );
            finish(&summary, &head, &arguments.output.display().to_string(), arguments.json, common.quiet)
        }
        Err(error) => {
            output::error(&error.to_string());
            if error.is_bad_input() { Exit::BadInput } else { Exit::Failure }
        }
    }
}
