//! `elastocap mesh`: writes the bodies and a grid of them, for viewers.

use std::path::{Path, PathBuf};

use clap::{Args, ValueHint};
use elastocap_coupling::outcome::Status;
use elastocap_coupling::plan::{Options, Plan};
use elastocap_coupling::run::deform;
use elastocap_results::{OutputError, OutputFolder, save_mesh};

use crate::common::Common;
use crate::exit::Exit;
use crate::output;

const EXAMPLES: &str = "\
Examples:
  elastocap mesh cases/in-plane-pair.toml
  elastocap mesh cases/in-plane-pair.toml -o /tmp/scene

The folder gets its files all at once, mesh.json with their names among them. A folder with the
result of a run is refused. scene.glb opens in any glTF viewer, and its load steps play as an
animation. fields.pvd opens in ParaView: the files step_NNN.vtu hold the body and the permittivity of
each cell of a graded grid of the deformed scene. Nothing is solved, so the potential and the electric
field in them are zero.
Bodies that are not boxes are not shown: a run meshes them as it solves them. Electrodes that the load
bends are shown as boxes, with a warning.";

#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// The case file; `-` is the standard input
    case: PathBuf,
    /// Output folder; results/<case>-mesh by default
    #[arg(long, short, value_name = "DIR", value_hint = ValueHint::DirPath)]
    output: Option<PathBuf>,
}

pub(crate) fn execute(arguments: &Arguments, common: &Common) -> Exit {
    let case = match super::load(&arguments.case) {
        Ok(case) => case,
        Err(exit) => return exit,
    };
    let folder = match open(arguments) {
        Ok(folder) => folder,
        Err(error) => {
            output::error(&error.to_string());
            return Exit::Failure;
        }
    };
    let steps = deform(&case, &Plan::new(&case, &Options::default()));
    let mut failed = false;
    for step in &steps {
        if let Status::Failed(failure) = &step.row.status {
            failed = true;
            output::warning(&format!("step {}: {failure}", step.index));
        }
        for warning in &step.warnings {
            output::warning(&format!("step {}: {warning}", step.index));
        }
    }
    match save_mesh(&case, &steps, folder) {
        Ok(placed) => {
            placed.warnings.iter().for_each(|text| output::warning(text));
            if !common.quiet {
                let list: String = placed.files.iter().map(|file| format!("{}\n", file.display())).collect();
                if let Err(exit) = output::result(&list) {
                    return exit;
                }
            }
            if failed { Exit::Incomplete } else { Exit::Done }
        }
        Err(error) => {
            output::error(&error.to_string());
            Exit::Failure
        }
    }
}

/// Opens the output folder, but not that of a run, whose fields and scene have the same names.
fn open(arguments: &Arguments) -> Result<OutputFolder, OutputError> {
    let mut folder = super::output_folder(arguments.output.as_deref(), &arguments.case).into_os_string();
    if arguments.output.is_none() {
        folder.push("-mesh");
    }
    let folder = OutputFolder::open(Path::new(&folder))?;
    folder.holds_no_run()?;
    folder.holds_nothing_foreign()?;
    Ok(folder)
}
