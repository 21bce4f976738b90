//! `elastocap run`: solves a case and writes its results.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use clap::{Args, ValueHint};
use elastocap_case::Case;
use elastocap_coupling::outcome::Outcome;
use elastocap_coupling::plan::{Options, Plan};
use elastocap_coupling::run::Run;
use elastocap_results::{
    FieldWriter, FileGroup, OutputError, OutputFolder, Request, Resume, ResumeError, Saved, UnknownFileGroup,
    Wanted, files_in_words, save,
};

use super::arguments::time;
use super::inputs::Input;
use super::progress::Progress;
use super::stop::{Stop, end_in_time, stop_after};
use super::summary::summary;
use super::{catching_defects, inputs, shortfalls, watch};
use crate::common::Common;
use crate::exit::Exit;
use crate::guard::Guard;
use crate::output;

const EXAMPLES: &str = "\
Examples:
  elastocap run cases/in-plane-pair.toml
  elastocap run cases/in-plane-pair.toml -o /tmp/pair --threads 2
  elastocap run cases/pair-under-sphere.toml --max-time 10min
  elastocap run cases/pair-under-sphere.toml --resume
  elastocap run cases/isolated-cube.toml --json | jq .maxwell_matrix_f
  elastocap run cases/comb.toml cases/discs.toml -o /tmp/both    in /tmp/both/comb and /tmp/both/discs
  sed 's/50 um/60 um/' cases/in-plane-pair.toml | elastocap run -
  elastocap run sensor.toml --watch";

const RUNS: &str = "\
Several cases are solved one after another, each in a folder of its own: results/<case>, or DIR/<case>
with -o DIR. What is wrong in any of the files is told before the first is solved (exit status 2).
The exit status is the worst: 1 before 2 before 3 before 0. With --json there is one document after
the other. `-` reads a case from the standard input; its results go to results/stdin, its messages
name <stdin>, and the files that it names are looked for from the current folder.

--watch solves the case again each time its file, or a mesh or surface that it names, has changed.
A case that is wrong prints its message and waits for the next change. Ctrl-C ends it: with exit
status 0 while it waits, and as that of a run while it solves.

The folder gets its files all at once, in place of those of an earlier run; your own files stay.
Ctrl-C (SIGTERM, SIGHUP) stops the run and keeps what is finished in FOLDER.partial, marked (exit
status 3). A second Ctrl-C ends it at once. A run with failed steps goes there too where FOLDER
holds a complete result.";

fn after_help() -> String {
    format!("{EXAMPLES}\n\nFiles in the output folder:\n{}\n{RUNS}", files_in_words())
}

#[derive(Debug, Args)]
#[command(after_help = after_help())]
pub(crate) struct Arguments {
    /// The case file, or several; `-` is the standard input
    #[arg(required = true, value_name = "CASE")]
    cases: Vec<PathBuf>,
    /// Output folder, for several cases the parent of theirs; results/<case> by default
    #[arg(long, short, value_name = "DIR", value_hint = ValueHint::DirPath)]
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
    /// Solve the case again each time its file or one that it names has changed; Ctrl-C ends
    #[arg(long, conflicts_with_all = ["json", "resume", "max_time"])]
    watch: bool,
    /// Leave nothing out: solve for the same numbers without using symmetry, for instance
    #[arg(long)]
    no_prune: bool,
    /// Write these files alone: curve, capacitance, report, scene, fields, sections, mechanics, layer, json,
    /// several with commas; result.json is always written, since it lists the others
    #[arg(long, value_name = "FILES", value_delimiter = ',', value_parser = file_group)]
    only: Vec<FileGroup>,
    /// Do not write the fields (.vtu) and the sections through them, nor the fields of the layer
    #[arg(long)]
    no_fields: bool,
    /// Do not write scene.glb
    #[arg(long)]
    no_scene: bool,
}

fn file_group(word: &str) -> Result<FileGroup, UnknownFileGroup> {
    word.parse()
}

impl Arguments {
    /// The requested files.
    fn wanted(&self) -> Wanted {
        let mut wanted = if self.only.is_empty() { Wanted::default() } else { Wanted::only(&self.only) };
        if self.no_fields {
            wanted = wanted.without(&[FileGroup::Fields, FileGroup::Sections, FileGroup::Layer]);
        }
        if self.no_scene {
            wanted = wanted.without(&[FileGroup::Scene]);
        }
        wanted
    }
}

/// The command that repeats this run, for a shell.
fn command() -> String {
    let arguments = std::env::args_os().skip(1).filter(|word| word != "--resume");
    let words = arguments.map(|word| quoted(&word.to_string_lossy()));
    std::iter::once("elastocap".to_owned()).chain(words).collect::<Vec<_>>().join(" ")
}

/// A word for a shell, in quotes where it holds more than letters, digits and the usual characters of paths.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_./,:=+@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', "'\\''"))
}

pub(crate) fn execute(arguments: &Arguments, common: &Common, guard: &Guard) -> Exit {
    let started = Instant::now();
    let stop = Stop::default();
    let several = arguments.cases.len() > 1;
    if arguments.watch {
        return match arguments.cases.as_slice() {
            [case] => {
                watch::watch(case, common.quiet, &stop, || one_after_another(arguments, common, guard, &stop))
            }
            _ => refused("--watch takes one case: start one command for each"),
        };
    }
    if arguments.resume && several {
        return refused("--resume takes one case: go on from each stopped run by a command of its own");
    }
    if let Some(time) = arguments.max_time {
        stop_after(time, started, stop.cancel());
    }
    one_after_another(arguments, common, guard, &stop)
}

fn refused(why: &str) -> Exit {
    output::error(why);
    Exit::BadInput
}

/// Solves all cases, if all can be read, and returns the worst status.
fn one_after_another(arguments: &Arguments, common: &Common, guard: &Guard, stop: &Stop) -> Exit {
    let mut started = Instant::now();
    let load = || inputs::load_all(&arguments.cases, arguments.output.as_deref());
    let (inputs, mut worst) = match end_in_time(stop.cancel(), load, || stopped_before("was read")) {
        Ok(Ok(loaded)) => loaded,
        Ok(Err(exit)) | Err(exit) => return exit,
    };
    let count = inputs.len();
    for (index, input) in inputs.iter().enumerate() {
        // A signal during or after a case prevents the start of the others.
        if index > 0 && stop.is_asked() {
            return not_begun(worst, count - index, count);
        }
        if count > 1 && !common.quiet {
            output::message(&format!("case {} of {count}: {}", index + 1, input.path.display()));
        }
        // If the case cannot be stopped in time, the process ends with it.
        let last = |exit: Exit| match count - index - 1 {
            0 => worst.or_worse(exit),
            left => not_begun(worst.or_worse(exit), left, count),
        };
        let command = Command { arguments, common, guard, stop, started, last: &last };
        let solved = catching_defects(&input.path, || command.solve_one(input));
        worst = worst.or_worse(solved.unwrap_or_else(|defect| {
            stop.release();
            guard.let_end();
            defect
        }));
        started = Instant::now();
    }
    worst
}

/// Reports that some cases were not begun.
fn not_begun(worst: Exit, left: usize, count: usize) -> Exit {
    output::warning(&format!("stopped: {left} of {count} cases were not begun"));
    worst.or_worse(Exit::Incomplete)
}

/// Reports that a run was stopped before there was anything to keep; `done` says what was not yet done with
/// the case, such as "was read".
fn stopped_before(done: &str) -> Exit {
    output::warning(&format!("stopped before the case {done}: nothing was solved, and nothing is written"));
    Exit::Incomplete
}

/// The arguments and shared state for solving one case.
struct Command<'a> {
    arguments: &'a Arguments,
    common: &'a Common,
    guard: &'a Guard,
    stop: &'a Stop,
    /// The time when the work on the case began.
    started: Instant,
    /// Gives the status of the process if it ends with this status of the case.
    last: &'a dyn Fn(Exit) -> Exit,
}

/// The reason why a run has no results.
#[derive(Debug, thiserror::Error)]
enum RunError {
    #[error(transparent)]
    Output(#[from] OutputError),
    #[error(transparent)]
    Resume(#[from] ResumeError),
    #[error("it could not be started")]
    NotStarted(Exit),
}

impl Command<'_> {
    /// Solves a case, and prints and writes its results.
    fn solve_one(&self, input: &Input) -> Exit {
        let solved = self.solve_and_save(input);
        self.conclude(&input.case, solved)
    }

    /// Prints the results, or the reason why there are none.
    fn conclude(&self, case: &Case, solved: Result<(Outcome, Saved), RunError>) -> Exit {
        self.stop.release();
        // A process that is being ended has printed the reason, and has removed the folder of the files.
        self.guard.let_end();
        match solved {
            Ok((outcome, saved)) => report(case, &outcome, &saved, self.arguments, self.common),
            Err(RunError::NotStarted(exit)) => exit,
            Err(error @ RunError::Output(_)) => failed(&error, Exit::Failure),
            Err(error @ RunError::Resume(_)) => failed(&error, Exit::BadInput),
        }
    }

    /// Solves a case and writes its results.
    fn solve_and_save(&self, input: &Input) -> Result<(Outcome, Saved), RunError> {
        let Self { arguments, common, guard, stop, started, last } = *self;
        let case = &input.case;
        let wanted = arguments.wanted();
        let options = Options {
            prune: !arguments.no_prune,
            fields: !arguments.no_fields && wanted.needs_fields(),
            scene: wanted.has(FileGroup::Scene),
            model_error: true,
        };
        // The folder is opened before anything is solved: a run must not be lost because its folder is not
        // writable.
        let folder =
            OutputFolder::open_announced(&input.folder, |unfinished| guard.remove_on_failure(unfinished))?;
        folder.holds_nothing_foreign()?;
        let resume = match arguments.resume {
            true => Some(Resume::read(&folder.partial(), case, &options, &wanted)?),
            false => None,
        };
        if let Some(resume) = resume.as_ref().filter(|_| !common.quiet) {
            output::message(&format!("{} steps are taken from the run that was stopped", resume.steps()));
        }
        stop.guard(&folder);
        let give_up = || {
            folder.unfinished().give_up();
            last(stopped_before("was planned"))
        };
        let planned = end_in_time(stop.cancel(), || Plan::new(case, &options), give_up);
        let mut plan = planned.map_err(RunError::NotStarted)?;
        wanted.note_in(case, &options, &mut plan);
        let planning = started.elapsed();
        let progress = Progress::new(&plan, common.quiet);
        let mut writer = FieldWriter::new(&folder, &progress).writing(wanted).going_on_from(resume);
        if options.fields {
            writer = writer.drawing_sections(&plan, case);
        }
        let run = Run::new(case, &plan, &options, stop.cancel());
        let save_found = || -> Result<(Outcome, Saved), RunError> {
            progress.finish();
            let outcome = run.outcome();
            let fields = writer.finish(&outcome)?;
            let command = command();
            let request = Request { wanted, case_text: Some(&input.text), command: Some(&command) };
            let saved = save(case, &outcome, &options, &request, &folder, &fields, started, planning)?;
            Ok((outcome, saved))
        };
        let leave = || {
            let saved = save_found();
            if saved.is_err() {
                folder.unfinished().give_up();
            }
            last(self.conclude(case, saved))
        };
        end_in_time(stop.cancel(), || run.solve(&writer, None), leave).map_err(RunError::NotStarted)?;
        save_found()
    }
}

fn failed(error: &RunError, exit: Exit) -> Exit {
    output::error(&error.to_string());
    exit
}

/// Prints warnings and results, and gives the exit status.
fn report(case: &Case, outcome: &Outcome, saved: &Saved, arguments: &Arguments, common: &Common) -> Exit {
    outcome.plan.warnings.iter().chain(&saved.warnings).for_each(|text| output::warning(text));
    shortfalls::of_run(&outcome.steps).iter().for_each(|line| output::warning(line));
    if !common.quiet {
        let changes = shortfalls::route_changes(&outcome.steps);
        changes.iter().for_each(|line| output::message(&format!("note: {line}")));
    }
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
        Ok(()) if outcome.steps.iter().any(|step| step.row.status.defect().is_some()) => Exit::Failure,
        Ok(()) if outcome.is_complete() => Exit::Done,
        Ok(()) => Exit::Incomplete,
    }
}
