//! `elastocap run`: solve a case and write its results.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use clap::Args;
use elastocap_case::Case;
use elastocap_coupling::outcome::{Outcome, Status, StepResult};
use elastocap_coupling::plan::{Options, Plan};
use elastocap_coupling::run::{Observer, run};
use elastocap_results::{FieldWriter, OutputFolder, Saved, save};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::stop::stop_on_signal;
use super::summary::summary;
use crate::guard::Guard;
use crate::{Common, Exit, output};

const EXAMPLES: &str = "\
Examples:
  elastocap run cases/in-plane-pair.toml
  elastocap run cases/in-plane-pair.toml -o /tmp/pair --threads 2
  elastocap run cases/isolated-cube.toml --json | jq .maxwell_matrix_f

Files in the output folder:
  curve.csv        one row for each load step, in SI units
  capacitance.csv  the capacitances of a case without load
  curve.svg        C(F) with its bounds, and that of parallel plates
  result.json      all results, with the Maxwell matrices, the plan and the time of each phase
  scene.glb        the bodies for any glTF viewer, the load steps as an animation
  fields.pvd       the fields for ParaView, one step_NNN.vtu for each load step
  mechanics.csv    for finite-element layers, the force and its error on each mesh; layer.pvd,
                   layer_NNN.vtu and profile_NNN.csv hold displacement and stress

Ctrl-C ends the run and keeps what is finished, marked incomplete (exit status 3). A second Ctrl-C
ends it at once.";

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
    /// Leave nothing out: solve for the same numbers without using symmetry, for instance
    #[arg(long)]
    no_prune: bool,
    /// Do not write the fields (.vtu)
    #[arg(long)]
    no_fields: bool,
    /// Do not write scene.glb
    #[arg(long)]
    no_scene: bool,
}

pub(crate) fn execute(arguments: &Arguments, common: &Common) -> Exit {
    let started = Instant::now();
    let guard = Guard::start();
    let case = match super::load(&arguments.case) {
        Ok(case) => case,
        Err(exit) => return exit,
    };
    let folder = super::output_folder(arguments.output.as_deref(), &arguments.case);
    match solve_and_save(&case, arguments, common, &folder, &guard, started) {
        Ok((outcome, saved)) => report(&case, &outcome, &saved, arguments, common, &folder),
        Err(error) => {
            output::error(&error.to_string());
            Exit::Failure
        }
    }
}

fn solve_and_save(
    case: &Case,
    arguments: &Arguments,
    common: &Common,
    folder: &Path,
    guard: &Guard,
    started: Instant,
) -> Result<(Outcome, Saved), elastocap_results::OutputError> {
    let options =
        Options { prune: !arguments.no_prune, fields: !arguments.no_fields, scene: !arguments.no_scene };
    // Opened before anything is solved: a run must not be lost to a folder that cannot be written to.
    let folder = OutputFolder::open(folder)?;
    guard.remove_on_failure(folder.staging(), folder.created());
    let cancel = Arc::new(AtomicBool::new(false));
    stop_on_signal(&cancel, &folder);
    let plan = Plan::new(case, &options);
    let planning = started.elapsed();
    let bar = progress_bar(plan.distinct_steps().count(), common.quiet);
    let writer = FieldWriter::new(&folder, &bar);
    let observer: &dyn Observer = if options.fields { &writer } else { &bar };
    let outcome = run(case, &plan, &options, &cancel, observer);
    bar.0.finish_and_clear();
    let fields = writer.finish(&outcome)?;
    let saved = save(case, &outcome, &options, folder, &fields, started, planning)?;
    Ok((outcome, saved))
}

/// Shows on the terminal how many steps are done.
struct Bar(ProgressBar);

impl Observer for Bar {
    fn preparing(&self, what: &str) {
        self.0.set_message(format!(", {what}"));
    }

    fn step_begun(&self, _index: usize) {
        self.0.set_message("");
    }

    fn step_done(&self, _step: &StepResult) {
        self.0.inc(1);
    }
}

fn progress_bar(steps: usize, quiet: bool) -> Bar {
    if quiet {
        return Bar(ProgressBar::hidden());
    }
    // Hides itself where stderr is not a terminal.
    let bar = ProgressBar::with_draw_target(Some(steps as u64), ProgressDrawTarget::stderr());
    let style =
        ProgressStyle::with_template("{bar:30} {pos}/{len} steps, {elapsed} elapsed, about {eta} left{msg}");
    if let Ok(style) = style {
        bar.set_style(style);
    }
    bar.enable_steady_tick(Duration::from_millis(200));
    Bar(bar)
}

fn report(
    case: &Case,
    outcome: &Outcome,
    saved: &Saved,
    arguments: &Arguments,
    common: &Common,
    folder: &Path,
) -> Exit {
    outcome.plan.warnings.iter().chain(&saved.warnings).for_each(|text| output::warning(text));
    for step in outcome.steps.iter().filter(|step| step.same_as.is_none()) {
        match (&step.row.status, &step.reason) {
            (Status::Failed(reason), _) => output::warning(&format!("step {} failed: {reason}", step.index)),
            (Status::ToleranceNotReached, Some(reason)) => {
                output::warning(&format!("step {} missed its tolerance: {reason}", step.index));
            }
            (Status::ToleranceNotReached, None) => {
                output::warning(&format!("step {} missed its tolerance", step.index));
            }
            (Status::BeyondForceLimit, Some(reason)) => {
                output::warning(&format!("step {} has no force: {reason}", step.index));
            }
            (Status::Ok | Status::BeyondForceLimit | Status::NotRun, _) => {}
        }
    }
    if outcome.stopped {
        output::warning("stopped before all steps were done; the results are marked incomplete");
    }
    let printed = if arguments.json {
        output::result(&saved.json)
    } else if common.quiet {
        Ok(())
    } else {
        output::result(&summary(case, outcome, saved, folder))
    };
    match printed {
        Err(exit) => exit,
        Ok(()) if outcome.is_complete() => Exit::Done,
        Ok(()) => Exit::Incomplete,
    }
}
