//! `elastocap sweep`: solves many cases from one file, with values changed.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use clap::Args;
use elastocap_sweeps::{
    CaseRecord, Design, DesignError, Manifest, Program, Setting, Settings, Shard, Sweep, SweepError,
    SweepFolder, SweepObserver, run, write_results,
};

use elastocap_files::{ReadError, read, result_name};

use super::arguments::time;
use super::progress::CaseProgress;
use super::stop::{end_in_time, stop_after, stop_without_files};
use super::sweep_report::report;
use crate::common::Common;
use crate::exit::Exit;
use crate::output;

const EXAMPLES: &str = "\
Examples:
  elastocap sweep cases/in-plane-pair.toml --set electrodes.in_plane_pair.gap=10um..100um:10
  elastocap sweep cases/in-plane-pair.toml --set electrodes.in_plane_pair.gap=20um,50um \\
      --set layer.thickness=400um..500um:3
  elastocap sweep cases/in-plane-pair.toml --list table.csv
  elastocap sweep cases/in-plane-pair.toml --random 1000 --seed 1 \\
      --set 'electrodes.in_plane_pair.gap=normal(50um, 2um)' --set 'layer.thickness=uniform(440um, 460um)'
  elastocap sweep cases/in-plane-pair.toml --list table.csv --shard 2/4 -o part-2

Values:
  400um,450um               these; arrays and tables in TOML, such as [0.0, 0.1],[0.0, 0.2]
  10um..100um:10            ten with equal distances, ends included; with :log with equal ratios
  normal(50um, 2um)         with --random; two more numbers are the lowest and the highest
  lognormal(90kPa, 0.1)     median, and deviation of the natural logarithm
  uniform(a, b)  loguniform(a, b)  triangular(lowest, most likely, highest)

Files in the output folder:
  sweep.csv       one row for each case and step: the values, the columns of curve.csv, a message
  sweep.svg       the capacitance over what is varied
  sweep.json      how many cases failed, and for --random how results scatter and by which key
  statistics.csv  for --random: mean, deviation and percentiles for each step
  manifest.json   what the sweep is of; cases/ holds the result of each case

A sweep that was stopped or killed goes on with the same command: finished cases are checked and kept.";

#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// The case file
    case: PathBuf,
    /// A key of the case file and its values, such as layer.thickness=400um,450um; may be repeated
    #[arg(long, value_name = "KEY=VALUES")]
    set: Vec<Setting>,
    /// Take the cases from a table of comma-separated values, whose header holds the paths of keys
    #[arg(long, value_name = "FILE", conflicts_with = "random")]
    list: Option<PathBuf>,
    /// Draw so many cases from the distributions given with --set
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    random: Option<u32>,
    /// What the random numbers start from; the same seed draws the same cases
    #[arg(long, value_name = "N", default_value_t = 1, requires = "random")]
    seed: u64,
    /// Solve only the I-th of N parts; `elastocap gather` joins them
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// Solve the cases again that are refused or have a failed step
    #[arg(long)]
    retry_failed: bool,
    /// Solve all cases anew, in place of the sweep that the folder holds
    #[arg(long, conflicts_with = "retry_failed")]
    overwrite: bool,
    /// Output folder; results/<case>-sweep by default
    #[arg(long, short, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Print sweep.json, and nothing else, on the standard output
    #[arg(long)]
    json: bool,
    /// Stop after this time, such as 90s, 10min or 2h, as Ctrl-C does
    #[arg(long, value_name = "TIME", value_parser = time)]
    max_time: Option<Duration>,
    /// Leave nothing out: solve for the same numbers without using symmetry, for instance
    #[arg(long)]
    no_prune: bool,
}

/// The largest list of cases that is read, bytes.
const LARGEST_LIST: u64 = 256 << 20;

/// The largest number of unusable records that are reported one by one.
const MAX_REPORTED: usize = 5;

/// The reason why a sweep has no results.
#[derive(Debug, thiserror::Error)]
enum Failure {
    #[error(transparent)]
    Design(#[from] DesignError),
    #[error("cannot read the list `{}`: {source}", file.display())]
    List { file: PathBuf, source: ReadError },
    #[error("cannot read the list `{}`: it is not a text in UTF-8", .0.display())]
    ListText(PathBuf),
    #[error("cannot read the program's own file, by which results are told from those of another build: {0}")]
    Program(std::io::Error),
    #[error(transparent)]
    Sweep(#[from] SweepError),
}

pub(crate) fn execute(arguments: &Arguments, common: &Common) -> Exit {
    sweep(arguments, common).unwrap_or_else(Failure::report)
}

impl Failure {
    /// Reports why there are no results.
    fn report(self) -> Exit {
        match &self {
            Self::Sweep(SweepError::Case(error)) => {
                output::message(&error.render(output::stderr_has_colour()));
            }
            other => output::error(&other.to_string()),
        }
        match self {
            Self::Design(_) | Self::List { .. } | Self::ListText(_) => Exit::BadInput,
            Self::Sweep(error) if error.is_bad_input() => Exit::BadInput,
            Self::Program(_) | Self::Sweep(_) => Exit::Failure,
        }
    }
}

/// The state of a running sweep.
struct Work<'a> {
    folder: &'a SweepFolder,
    /// The records so far, by case.
    records: Mutex<Vec<Option<CaseRecord>>>,
    progress: CaseProgress,
}

impl SweepObserver for Work<'_> {
    fn case_done(&self, record: CaseRecord) -> Result<(), SweepError> {
        self.folder.save(&record)?;
        self.progress.case_done();
        let mut records = self.records.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(place) = records.get_mut(record.case) {
            *place = Some(record);
        }
        Ok(())
    }
}

fn sweep(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    let started = Instant::now();
    let design = design(arguments)?;
    let settings = Settings { prune: !arguments.no_prune };
    let program = Program::of_this_process().map_err(Failure::Program)?;
    let cancel = Arc::new(AtomicBool::new(false));
    if let Some(time) = arguments.max_time {
        stop_after(time, started, &cancel);
    }
    let read = || Sweep::read(&arguments.case, design, settings, program);
    let sweep = end_in_time(&cancel, read, || {
        output::warning("stopped before the case was read: nothing was solved");
        Exit::Incomplete
    });
    let sweep = match sweep {
        Ok(sweep) => sweep?,
        Err(exit) => return Ok(exit),
    };
    let shard = arguments.shard.unwrap_or(Shard::WHOLE);
    let path = folder_of(arguments, shard);
    let folder = SweepFolder::open(&path, Manifest::of(&sweep, shard), arguments.overwrite)?;
    stop_without_files(&cancel);

    let finished = folder.finished();
    for (case, why) in finished.damaged.iter().take(MAX_REPORTED) {
        output::warning(&format!("case {case} is solved again: {why}"));
    }
    if finished.damaged.len() > MAX_REPORTED {
        let more = finished.damaged.len() - MAX_REPORTED;
        output::warning(&format!("{more} more cases are solved again, for such reasons"));
    }
    let mut records = finished.records;
    if arguments.retry_failed {
        records.iter_mut().for_each(|record| _ = record.take_if(|record| record.has_failed()));
    }
    let wanted: Vec<usize> = folder
        .manifest()
        .cases_of_shard()
        .filter(|case| records.get(*case).is_none_or(Option::is_none))
        .collect();
    let count = folder.manifest().cases_of_shard().count();
    let before = count - wanted.len();
    let work = Work {
        folder: &folder,
        records: Mutex::new(records),
        progress: CaseProgress::new(count, before, common.quiet),
    };
    let threads = rayon::current_num_threads();
    let conclude = || -> Result<Exit, Failure> {
        work.progress.finish();
        let records = work.records.lock().unwrap_or_else(PoisonError::into_inner);
        let summary = write_results(&folder, &records)?;
        let spared = sweep.fields_spared();
        Ok(report(
            &folder,
            &summary,
            &records,
            before,
            spared,
            started.elapsed(),
            arguments.json,
            common.quiet,
        ))
    };
    let solve = || run(&sweep, &wanted, threads, &cancel, &work);
    match end_in_time(&cancel, solve, || conclude().unwrap_or_else(Failure::report)) {
        Ok(solved) => solved?,
        Err(exit) => return Ok(exit),
    }
    conclude()
}

/// The cases that the arguments ask for.
fn design(arguments: &Arguments) -> Result<Design, Failure> {
    let settings = &arguments.set;
    Ok(match (&arguments.list, arguments.random) {
        (Some(file), _) => {
            let list =
                read(file, LARGEST_LIST).map_err(|source| Failure::List { file: file.clone(), source })?;
            let list = String::from_utf8(list).map_err(|_| Failure::ListText(file.clone()))?;
            Design::list(&list, settings)?
        }
        (None, Some(count)) => Design::random(settings, count as usize, arguments.seed)?,
        (None, None) => Design::grid(settings)?,
    })
}

/// The requested folder, or `results/` with the name of the case and the shard.
fn folder_of(arguments: &Arguments, shard: Shard) -> PathBuf {
    if let Some(folder) = &arguments.output {
        return folder.clone();
    }
    let mut name = result_name(&arguments.case) + "-sweep";
    if shard.of > 1 {
        name.push_str(&format!("-{}-of-{}", shard.number, shard.of));
    }
    Path::new("results").join(name)
}
