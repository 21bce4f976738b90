//! `elastocap accuracy`: error against run time, over order and grading.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use clap::{Args, ValueHint};
use elastocap_evidence::accuracy::{Choice, Request, Study, csv, figure, study};
use elastocap_results::{OutputError, OutputFolder, Placed};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::accuracy_report::report;
use super::arguments::positive_seconds;
use super::stop::{end_in_time, left_a_solve, stop_on_signal};
use crate::common::Common;
use crate::exit::Exit;
use crate::output;

const EXAMPLES: &str = "\
Examples:
  elastocap accuracy cases/in-plane-pair.toml                  a study of about a minute
  elastocap accuracy cases/stacked-pair.toml --step 3 --quick  two tolerances, a few seconds
  elastocap accuracy cases/isolated-cube.toml --seconds 300    finer tolerances, sharper reference

Files in the output folder, added to those of a run:
  accuracy.csv  one line for each solve: grid, time, value, bounds, certified and true error
  accuracy.svg  both errors against run time

The true error is measured against the intersection of all proved intervals. If two of them do
not overlap, a bound is wrong: the command reports it and exits with status 1.

Ctrl-C ends the study and keeps what is finished, marked (exit status 3). A second Ctrl-C ends it
at once.";

#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// The case file; `-` is the standard input
    case: PathBuf,
    /// Output folder; results/<case> by default
    #[arg(long, short, value_name = "DIR", value_hint = ValueHint::DirPath)]
    output: Option<PathBuf>,
    /// The load step to study, counted from 0
    #[arg(long, value_name = "N", default_value_t = 0)]
    step: usize,
    /// About how long the study may take; 60 by default, 5 with --quick
    #[arg(long, value_name = "SECONDS", value_parser = positive_seconds)]
    seconds: Option<f64>,
    /// Study the tolerances 1e-2 and 1e-3 only
    #[arg(long)]
    quick: bool,
}

pub(crate) fn execute(arguments: &Arguments, common: &Common) -> Exit {
    let case = match super::load(&arguments.case) {
        Ok(case) => case,
        Err(exit) => return exit,
    };
    let usual = if arguments.quick { Request::quick } else { Request::usual };
    let mut request = usual(arguments.step);
    request.seconds = arguments.seconds.unwrap_or(request.seconds);
    let path = super::output_folder(arguments.output.as_deref(), &arguments.case);
    // The folder is opened before anything is solved: a study must not be lost because its folder is not
    // writable.
    let folder = match OutputFolder::open(&path) {
        Ok(folder) => folder,
        Err(error) => return failure(&error),
    };
    let cancel = Arc::new(AtomicBool::new(false));
    stop_on_signal(&cancel, &folder);
    let bar = progress(common.quiet);
    let work = || study(&case, &request, &cancel, &|what| bar.set_message(what.to_owned()));
    let found = end_in_time(&cancel, work, || {
        folder.unfinished().give_up();
        left_a_solve()
    });
    bar.finish_and_clear();
    let found = match found {
        Ok(Ok(found)) => found,
        Err(exit) => return exit,
        Ok(Err(refused)) => {
            output::error(&format!("{}: {refused}", arguments.case.display()));
            return Exit::BadInput;
        }
    };
    match save(&found, &folder) {
        Ok(placed) => {
            placed.warnings.iter().for_each(|text| output::warning(text));
            conclude(&found, &path, &placed.files, common)
        }
        Err(error) => failure(&error),
    }
}

/// Prints the error and gives the exit status.
fn failure(error: &OutputError) -> Exit {
    output::error(&error.to_string());
    Exit::Failure
}

/// A line on stderr with the elapsed time and the current solve.
fn progress(quiet: bool) -> ProgressBar {
    if quiet {
        return ProgressBar::hidden();
    }
    // The bar is hidden if stderr is not a terminal.
    let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
    if let Ok(style) = ProgressStyle::with_template("{elapsed} {msg}") {
        bar.set_style(style);
    }
    bar.enable_steady_tick(Duration::from_millis(500));
    bar
}

fn save(found: &Study, folder: &OutputFolder) -> Result<Placed, OutputError> {
    folder.stage("accuracy.csv", csv(found).as_bytes())?;
    if let Some(chart) = figure(found) {
        folder.stage("accuracy.svg", chart.to_svg().as_bytes())?;
    }
    folder.commit_beside()
}

/// Prints the report and what went wrong, and gives the exit status.
fn conclude(found: &Study, folder: &Path, files: &[PathBuf], common: &Common) -> Exit {
    if !common.quiet
        && let Err(exit) = output::result(&report(found, folder, files))
    {
        return exit;
    }
    if let Some(reference) = found.reference.filter(|_| found.contradicts()) {
        output::error(&format!(
            "a bound is wrong: two proved intervals do not overlap, since the largest lower bound, {:e} F, lies above \
             the smallest upper bound, {:e} F; please report this with the case file",
            reference.lower, reference.upper
        ));
        return Exit::Failure;
    }
    if found.stopped {
        output::warning("stopped early; the figure and the solves that were not run are marked");
        return Exit::Incomplete;
    }
    let mut exit = Exit::Done;
    for run in found.runs.iter().filter(|run| run.choice == Choice::Own) {
        let missed = run.tolerance.is_some_and(|tolerance| run.found().is_some() && !run.meets(tolerance));
        let failed = run.status().starts_with("failed");
        if let Some(tolerance) = run.tolerance.filter(|_| missed || failed) {
            output::warning(&format!("{}, tolerance {tolerance:e}: {}", run.kind.name(), run.status()));
            exit = Exit::Incomplete;
        }
    }
    exit
}
