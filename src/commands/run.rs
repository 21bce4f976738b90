//! `elastocap run`: solve a case and write its results.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use clap::Args;
use elastocap_case::Case;
use elastocap_coupling::outcome::Outcome;
use elastocap_coupling::plan::{Options, Plan};
use elastocap_coupling::run::run;
use elastocap_results::{FieldWriter, OutputError, OutputFolder, Resume, ResumeError, Saved, save};

use super::arguments::time;
use super::progress::Progress;
use super::shortfalls;
use super::stop::{stop_after, stop_on_signal};
use super::summary::summary;
use crate::guard::Guard;
use crate::{Common, Exit, output};

const EXAMPLES: &str = "\
Examples:
  elastocap run cases/in-plane-pair.toml
  elastocap run cases/in-plane-pair.toml -o /tmp/pair --threads 2
  elastocap run cases/pair-under-sphere.toml --max-time 10min
  elastocap run cases/pair-under-sphere.toml --resume
  elastocap run cases/isolated-cube.toml --json | jq .maxwell_matrix_f

Files in the output folder:
  curve.csv        one row for each load step, in SI units
  capacitance.csv  all capacitances of each step
  curve.svg        by how much C changes under load, with bounds; C itself beside that of parallel plates
  approach.svg     the same against the distance of the indenter, with `approach`
  result.json      all results, with the Maxwell matrices, the plan and the time of each phase
  scene.glb        bodies, indenter and a scale bar for any glTF viewer, the load steps as an animation
  fields.pvd       the fields around the sensor for ParaView, one step_NNN.vtu for each load step
  section_NNN.svg  potential and field in a plane through the gap, of the first and the last step
  mechanics.csv    for finite-element layers, the force and its error on each mesh; layer.pvd,
                   layer_NNN.vtu and profile_NNN.csv hold displacement and stress

The folder gets its files all at once, in place of those of an earlier run; your own files stay.
Ctrl-C (SIGTERM, SIGHUP) stops the run and keeps what is finished in FOLDER.partial, marked (exit
status 3). A second Ctrl-C ends it at once. A run with failed steps goes there too where FOLDER
holds a complete result.";

#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// The case file
    case: PathBuf,
    /// Output folder; results/<case> by default
    #[arg(long, short, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Print result.json, and nothing else, on the standard output
    #[arg(long)]
    json: bool,
    /// Stop after this time, such as 90s, 10min or 2h, as Ctrl-C does
    #[arg(long, value_name = "TIME", value_parser = time)]
    max_time: Option<Duration>,
    /// Go on from the run of this case that was stopped, in FOLDER.partial
    #[arg(long)]
    resume: bool,
    /// Leave nothing out: solve for the same numbers without using symmetry, for instance
    #[arg(long)]
    no_prune: bool,
    /// Do not write the fields (.vtu) and the sections through them
    #[arg(long)]
    no_fields: bool,
    /// Do not write scene.glb
    #[arg(long)]
    no_scene: bool,
}

pub(crate) fn execute(arguments: &Arguments, common: &Common, guard: &Guard) -> Exit {
    let started = Instant::now();
    let case = match super::load(&arguments.case) {
        Ok(case) => case,
        Err(exit) => return exit,
    };
    let folder = super::output_folder(arguments.output.as_deref(), &arguments.case);
    match solve_and_save(&case, arguments, common, &folder, guard, started) {
        Ok((outcome, saved)) => report(&case, &outcome, &saved, arguments, common),
        Err(error) => {
            output::error(&error.to_string());
            match error {
                RunError::Output(_) => Exit::Failure,
                RunError::Resume(_) => Exit::BadInput,
            }
        }
    }
}

/// Why a run has no results.
#[derive(Debug, thiserror::Error)]
enum RunError {
    #[error(transparent)]
    Output(#[from] OutputError),
    #[error(transparent)]
    Resume(#[from] ResumeError),
}

fn solve_and_save(
    case: &Case,
    arguments: &Arguments,
    common: &Common,
    folder: &Path,
    guard: &Guard,
    started: Instant,
) -> Result<(Outcome, Saved), RunError> {
    let options =
        Options { prune: !arguments.no_prune, fields: !arguments.no_fields, scene: !arguments.no_scene };
    // Opened before anything is solved: a run must not be lost to a folder that cannot be written to.
    let folder = OutputFolder::open(folder)?;
    guard.remove_on_failure(folder.staging(), folder.created());
    folder.holds_nothing_foreign()?;
    let resume = match arguments.resume {
        true => Some(Resume::read(&folder.partial(), case, &options)?),
        false => None,
    };
    if let Some(resume) = resume.as_ref().filter(|_| !common.quiet) {
        output::message(&format!("{} steps are taken from the run that was stopped", resume.steps()));
    }
    let cancel = Arc::new(AtomicBool::new(false));
    stop_on_signal(&cancel, &folder);
    if let Some(time) = arguments.max_time {
        stop_after(time, started, &cancel);
    }
    let plan = Plan::new(case, &options);
    let planning = started.elapsed();
    let progress = Progress::new(&plan, common.quiet);
    let writer = FieldWriter::new(&folder, &progress)
        .only_if(options.fields)
        .drawing_sections(&plan, &case.title)
        .going_on_from(resume);
    let outcome = run(case, &plan, &options, &cancel, &writer);
    progress.finish();
    let fields = writer.finish(&outcome)?;
    let saved = save(case, &outcome, &options, folder, &fields, started, planning)?;
    Ok((outcome, saved))
}

fn report(case: &Case, outcome: &Outcome, saved: &Saved, arguments: &Arguments, common: &Common) -> Exit {
    outcome.plan.warnings.iter().chain(&saved.warnings).for_each(|text| output::warning(text));
    shortfalls::of_run(&outcome.steps).iter().for_each(|line| output::warning(line));
    if outcome.stopped {
        output::warning("stopped before all steps were done; the results are marked incomplete");
    }
    let printed = if arguments.json {
        output::result(&saved.json)
    } else if common.quiet {
        Ok(())
    } else {
        output::result(&summary(case, outcome, saved))
    };
    match printed {
        Err(exit) => exit,
        Ok(()) if outcome.is_complete() => Exit::Done,
        Ok(()) => Exit::Incomplete,
    }
}
