//! `elastocap stability`: checks the answers to stiff and extreme cases.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use clap::Args;
use elastocap_evidence::stability::{Claim, Entry, Report, Verdict, catalogue, save};

use super::arguments::positive_seconds;
use super::stop::stop_without_files;
use crate::common::Common;
use crate::exit::Exit;
use crate::output;
use crate::units::prefixed;

const EXAMPLES: &str = "\
Examples:
  elastocap stability                        the whole catalogue
  elastocap stability --quick                a part of it that takes a few seconds
  elastocap stability --only permittivity    the cases whose subject or name contains a word
  elastocap stability -o results/stability   the catalogue, and stability.csv with every number

Verdicts:
  right        the truth lies within the stated error
  refused      there is no answer, and the reason is given
  not reached  the tolerance was missed or the time ran out, and the result says so; the bounds
               it gives hold the truth
  WRONG        anything else; the exit status is then 1

The column `error` is the distance to what is known independently: `< 1e-3` where that is a range,
`holds` where it is a limit.";

#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// Solve only a part of the catalogue, which takes a few seconds
    #[arg(long)]
    quick: bool,
    /// Solve only cases whose subject or name contains this
    #[arg(long, value_name = "PATTERN")]
    only: Option<String>,
    /// Print the catalogue, without solving
    #[arg(long)]
    list: bool,
    /// Seconds after which a case is abandoned and marked
    #[arg(long, value_name = "SECONDS", default_value_t = 3.0, value_parser = positive_seconds)]
    limit: f64,
    /// Folder for stability.csv
    #[arg(long, short, value_name = "DIR")]
    output: Option<PathBuf>,
}

pub(crate) fn execute(arguments: &Arguments, common: &Common) -> Exit {
    let chosen = |entry: &Entry| {
        let matches = |pattern: &String| {
            let pattern = pattern.to_lowercase();
            [entry.subject, &entry.name].iter().any(|text| text.to_lowercase().contains(&pattern))
        };
        (entry.quick || !arguments.quick) && arguments.only.as_ref().is_none_or(matches)
    };
    let entries: Vec<_> = catalogue().into_iter().filter(chosen).collect();
    if entries.is_empty() {
        output::error("no case matches; `elastocap stability --list` prints the catalogue");
        return Exit::BadInput;
    }
    if arguments.list {
        return printed(&list(&entries), Exit::Done);
    }
    let stop = Arc::new(AtomicBool::new(false));
    stop_without_files(&stop);
    let begin = Instant::now();
    let limit = Duration::from_secs_f64(arguments.limit);
    let mut reports: Vec<Report> = Vec::new();
    for entry in &entries {
        let report = entry.run(rayon::current_num_threads(), limit, &stop);
        let is_new_subject = reports.last().map(|last| last.subject) != Some(report.subject);
        let text = lines(&report, is_new_subject, reports.is_empty());
        let shown = !common.quiet || matches!(report.verdict, Verdict::Wrong(_));
        if shown && let Err(exit) = output::result(&text) {
            return exit;
        }
        reports.push(report);
        if stop.load(Ordering::Relaxed) {
            break;
        }
    }
    if let Some(folder) = &arguments.output
        && let Err(error) = save(&reports, folder)
    {
        output::error(&error.to_string());
        return Exit::Failure;
    }
    let wrong = reports.iter().any(|report| matches!(report.verdict, Verdict::Wrong(_)));
    let exit = match (wrong, stop.load(Ordering::Relaxed)) {
        (true, _) => Exit::Failure,
        (false, true) => Exit::Incomplete,
        (false, false) => Exit::Done,
    };
    if common.quiet { exit } else { printed(&counts(&reports, entries.len(), begin), exit) }
}

/// Prints a text; gives `exit`, or the status of the failure to print.
fn printed(text: &str, exit: Exit) -> Exit {
    output::result(text).err().unwrap_or(exit)
}

/// The catalogue, without solving.
fn list(entries: &[Entry]) -> String {
    let mut out = String::new();
    let mut subject = "";
    for entry in entries {
        if subject != entry.subject {
            subject = entry.subject;
            out.push_str(&format!("{subject}\n"));
        }
        out.push_str(&format!("  {}{}\n", entry.name, if entry.quick { " (quick)" } else { "" }));
    }
    out
}

fn line(cells: [&str; 6]) -> String {
    let [name, result, stated, error, verdict, seconds] = cells;
    format!("  {name:<46} {result:>15} {stated:>8} {error:>9}  {verdict:<11} {seconds:>7}\n")
}

/// The lines of one report, below its subject if the subject is new, and below the head of the table if it is
/// the first report.
fn lines(report: &Report, is_new_subject: bool, is_first: bool) -> String {
    let mut out = String::new();
    if is_first {
        out.push_str(&line(["case", "result", "stated", "error", "verdict", "seconds"]));
    }
    if is_new_subject {
        out.push_str(&format!("{}\n", report.subject));
    }
    let (result, stated, error) = match report.claims.first() {
        Some(claim) => (quantity(claim), format!("{:.1e}", claim.stated_error()), error(claim)),
        None => ("-".to_owned(), "-".to_owned(), "-".to_owned()),
    };
    let (verdict, seconds) = (report.verdict.to_string(), format!("{:.2}", report.seconds));
    out.push_str(&line([&report.name, &result, &stated, &error, &verdict, &seconds]));
    if let Some(reason) = report.verdict.reason() {
        out.push_str(&format!("      {reason}\n"));
    }
    out
}

fn quantity(claim: &Claim) -> String {
    match claim.unit {
        "" => format!("{:.6e}", claim.value),
        unit => prefixed(claim.value, 6, unit),
    }
}

fn error(claim: &Claim) -> String {
    match claim.true_error() {
        None => "holds".to_owned(),
        Some(error) if claim.is_sharp() => format!("{error:.1e}"),
        Some(error) => format!("< {error:.0e}"),
    }
}

/// The number of entries with each verdict.
fn counts(reports: &[Report], of: usize, begin: Instant) -> String {
    let count = |wanted: fn(&Verdict) -> bool| reports.iter().filter(|r| wanted(&r.verdict)).count();
    format!(
        "\n{} of {of} cases: {} right, {} refused, {} not reached, {} WRONG; {:.1} s\n",
        reports.len(),
        count(|v| matches!(v, Verdict::Right)),
        count(|v| matches!(v, Verdict::Refused(_))),
        count(|v| matches!(v, Verdict::NotReached(_))),
        count(|v| matches!(v, Verdict::Wrong(_))),
        begin.elapsed().as_secs_f64()
    )
}
