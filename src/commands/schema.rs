//! `elastocap schema`: prints the JSON Schema of case files.

use clap::Args;
use elastocap_case::json_schema;

use crate::exit::Exit;
use crate::output;

const EXAMPLES: &str = "\
Examples:
  elastocap schema > elastocap.schema.json

An editor with a TOML language server (Even Better TOML in VS Code, taplo elsewhere) uses the schema
if the first line of a case file is
  #:schema ./elastocap.schema.json";

#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {}

pub(crate) fn execute(_: &Arguments) -> Exit {
    match output::result(&format!("{:#}\n", json_schema())) {
        Ok(()) => Exit::Done,
        Err(exit) => exit,
    }
}
