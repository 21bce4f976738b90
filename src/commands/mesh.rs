//! `elastocap mesh`: the bodies and a grid of them, for viewers.

use std::path::PathBuf;

use clap::Args;
use elastocap_coupling::outcome::Status;
use elastocap_coupling::plan::{Options, Plan};
use elastocap_coupling::run::deform;
use elastocap_results::{OutputFolder, save_mesh};

use crate::{Common, Exit, output};

const EXAMPLES: &str = "\
Examples:
  elastocap mesh cases/in-plane-pair.toml
  elastocap mesh cases/in-plane-pair.toml -o /tmp/scene

scene.glb opens in any glTF viewer, and its load steps play as an animation. fields.pvd opens in
ParaView: the files step_NNN.vtu hold the body and the permittivity of each cell of a graded grid of
the deformed scene. Nothing is solved, so the potential and the electric field in them are zero. Bodies that are no boxes are not shown: a run meshes them as
it solves them. Electrodes that the load bends are shown as boxes, with a warning.";

#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// The case file
    case: PathBuf,
    /// Output folder; results/<case> by default
    #[arg(long, short, value_name = "DIR")]
    output: Option<PathBuf>,
}

pub(crate) fn execute(arguments: &Arguments, common: &Common) -> Exit {
    let case = match super::load(&arguments.case) {
        Ok(case) => case,
        Err(exit) => return exit,
    };
    let folder = super::output_folder(arguments.output.as_deref(), &arguments.case);
    let folder = match OutputFolder::open(&folder) {
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
        Ok((files, warnings)) => {
            warnings.iter().for_each(|text| output::warning(text));
            if !common.quiet {
                let list: String = files.iter().map(|file| format!("{}\n", file.display())).collect();
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
