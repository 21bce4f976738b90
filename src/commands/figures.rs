//! `elastocap figures`: draws the figures and tables of the paper.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use clap::Args;
use elastocap_evidence::figures::{Drawn, FigureError, Item, Session};
use elastocap_results::{OutputError, OutputFolder};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use thiserror::Error;

use super::arguments::ArgumentError;
use super::stop::{end_in_time, stop_on_signal};
use crate::common::Common;
use crate::exit::Exit;
use crate::output;

const EXAMPLES: &str = "\
Examples:
  elastocap figures                        all figures and tables, in results/figures
  elastocap figures --only 9,16            two figures
  elastocap figures --only table-1,table-2 -o /tmp/tables
  elastocap figures --only shear-length    L(U/H, contact length) for [mechanics.closed_form]
  elastocap figures --list                 the names of all figures and tables

The paper is \"Large deformation mechanics of a soft elastomeric layer under compressive loading for
a MEMS tactile sensor application\". Each panel of a figure is one SVG, with its data in a CSV of the
same name: the closed form as lines, finite elements as points. Tables are CSV.

Where the finite elements stop short of a compression, that point is left out and named, and the
exit status is 3.";

#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// Output folder
    #[arg(long, short, value_name = "DIR", default_value = "results/figures")]
    output: PathBuf,
    /// Draw only these, separated by commas: 4, 6, 7, 9, 10, 11, 12, 13, 16, table-1, table-2, shear-length
    #[arg(long, value_name = "N,...", value_delimiter = ',', value_parser = item)]
    only: Vec<Item>,
    /// Print the names of all figures and tables, without drawing
    #[arg(long)]
    list: bool,
}

fn item(text: &str) -> Result<Item, ArgumentError> {
    Item::from_name(text.trim()).ok_or_else(|| ArgumentError::Item(Item::ALL.map(Item::name).join(", ")))
}

pub(crate) fn execute(arguments: &Arguments, common: &Common) -> Exit {
    let wanted = |item: &Item| arguments.only.is_empty() || arguments.only.contains(item);
    let items: Vec<Item> = Item::ALL.into_iter().filter(wanted).collect();
    if arguments.list {
        let list: String = items.iter().map(|i| format!("{:<13} {}\n", i.name(), i.title())).collect();
        return output::result(&list).err().unwrap_or(Exit::Done);
    }
    let begin = Instant::now();
    let folder = match OutputFolder::open(&arguments.output) {
        Ok(folder) => folder,
        Err(error) => {
            output::error(&error.to_string());
            return Exit::Failure;
        }
    };
    let stop = Arc::new(AtomicBool::new(false));
    stop_on_signal(&stop, &folder);
    let drawn = Mutex::new(Vec::new());
    let conclude = || {
        let drawn = std::mem::take(&mut *drawn.lock().unwrap_or_else(PoisonError::into_inner));
        conclude(&drawn, items.len(), &folder, common, begin)
    };
    match end_in_time(&stop, || draw(&items, &folder, &drawn, &stop, common.quiet), conclude) {
        Ok(Ok(())) => conclude(),
        Ok(Err(error)) => {
            output::error(&error.to_string());
            Exit::Failure
        }
        Err(exit) => exit,
    }
}

/// The reason why an item is not drawn.
#[derive(Debug, Error)]
enum NotDrawn {
    #[error("{item}: {error}")]
    Figure { item: &'static str, error: FigureError },
    #[error(transparent)]
    Output(#[from] OutputError),
}

/// Draws the items one after the other, until a signal stops the work.
fn draw(
    items: &[Item],
    folder: &OutputFolder,
    finished: &Mutex<Vec<(Item, Drawn)>>,
    stop: &AtomicBool,
    quiet: bool,
) -> Result<(), NotDrawn> {
    let bar = progress_bar(items.len(), quiet);
    let mut session = Session::default();
    for item in items {
        if stop.load(Ordering::Relaxed) {
            break;
        }
        bar.set_message(item.title());
        let drawn = session.draw(*item).map_err(|error| NotDrawn::Figure { item: item.name(), error })?;
        for (name, text) in &drawn.files {
            folder.stage(name, text.as_bytes())?;
        }
        finished.lock().unwrap_or_else(PoisonError::into_inner).push((*item, drawn));
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(())
}

fn progress_bar(items: usize, quiet: bool) -> ProgressBar {
    if quiet {
        return ProgressBar::hidden();
    }
    // The bar is hidden if stderr is not a terminal.
    let bar = ProgressBar::with_draw_target(Some(items as u64), ProgressDrawTarget::stderr());
    if let Ok(style) = ProgressStyle::with_template("{bar:30} {pos}/{len} {msg}, {elapsed} elapsed") {
        bar.set_style(style);
    }
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}

/// Puts the files in place and prints the findings.
fn conclude(
    drawn: &[(Item, Drawn)],
    requested: usize,
    folder: &OutputFolder,
    common: &Common,
    begin: Instant,
) -> Exit {
    let place = folder.path().to_owned();
    let placed = match folder.commit_beside() {
        Ok(placed) => placed,
        Err(error) => {
            output::error(&error.to_string());
            return Exit::Failure;
        }
    };
    placed.warnings.iter().for_each(|text| output::warning(text));
    let mut exit = Exit::Done;
    for (_, drawn) in drawn {
        for missing in &drawn.missing {
            output::warning(missing);
            exit = Exit::Incomplete;
        }
    }
    if drawn.len() < requested {
        output::warning(&format!(
            "stopped after {} of {requested} figures and tables; those are kept",
            drawn.len()
        ));
        exit = Exit::Incomplete;
    }
    if common.quiet {
        return exit;
    }
    output::result(&report(drawn, &place, placed.files.len(), begin)).err().unwrap_or(exit)
}

/// The findings of each item, and the number of files.
fn report(drawn: &[(Item, Drawn)], place: &Path, files: usize, begin: Instant) -> String {
    let mut out = String::new();
    for (item, drawn) in drawn {
        out.push_str(&format!("{}: {}\n", item.name(), item.title()));
        for finding in &drawn.findings {
            out.push_str(&format!("  {finding}\n"));
        }
    }
    let seconds = begin.elapsed().as_secs_f64();
    out.push_str(&format!("\n{files} files in {}, {seconds:.1} s\n", place.display()));
    out
}
