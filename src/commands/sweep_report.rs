//! Prints the results of `elastocap sweep` and `gather`.

use std::fmt::Write as _;
use std::time::Duration;

use elastocap_sweeps::{CaseRecord, Influence, StepStatistics, Summary, SweepFolder};

use crate::exit::Exit;
use crate::output;
use crate::units::{grouped, prefixed, seconds};

/// The largest number of failed cases that are reported one by one.
const MAX_REPORTED: usize = 5;

/// Prints the outcome of a sweep, which took the time `took`: `before` cases were finished when it began, and
/// `spared` fields were those of other cases.
pub(super) fn report(
    folder: &SweepFolder,
    summary: &Summary,
    records: &[Option<CaseRecord>],
    before: usize,
    spared: usize,
    took: Duration,
    json: bool,
    quiet: bool,
) -> Exit {
    for case in summary.failed.iter().take(MAX_REPORTED) {
        let record = records.get(*case).and_then(Option::as_ref);
        let why = record.and_then(why_failed).unwrap_or_default();
        output::warning(&format!("case {case} failed: {why}"));
    }
    if summary.failed.len() > MAX_REPORTED {
        let more = summary.failed.len() - MAX_REPORTED;
        output::warning(&format!("{more} more cases failed; sweep.csv says why"));
    }
    if !summary.missed.is_empty() {
        let count = summary.missed.len();
        output::warning(&format!(
            "{count} cases missed their tolerance or have no force; sweep.csv says which"
        ));
    }
    let left = summary.cases - summary.finished;
    if left > 0 {
        output::warning(&format!("stopped before {left} cases were solved; the same command goes on"));
    }
    let solved = summary.finished.saturating_sub(before);
    let head = format!(
        "{}\n\n{} cases: {} finished before, {} solved in {}, {} failed\n",
        summary.title,
        grouped(summary.cases),
        grouped(before),
        grouped(solved),
        seconds(took.as_secs_f64()),
        grouped(summary.failed.len()),
    );
    let head = match spared {
        0 => head,
        spared => {
            format!("{head}{} fields were those of other cases and not solved again\n", grouped(spared))
        }
    };
    finish(summary, &head, &folder.path().display().to_string(), json, quiet)
}

/// Prints the summary, and returns the exit status.
pub(super) fn finish(summary: &Summary, head: &str, folder: &str, json: bool, quiet: bool) -> Exit {
    let printed = if json {
        match serde_json::to_string_pretty(summary) {
            Ok(text) => output::result(&(text + "\n")),
            Err(error) => {
                output::error(&format!("cannot write sweep.json: {error}"));
                Err(Exit::Failure)
            }
        }
    } else if quiet {
        Ok(())
    } else {
        let mut text = head.to_owned();
        if let Some(scatter) = &summary.scatter {
            text.push_str(&scatter_table(&scatter.statistics));
        }
        let _ = writeln!(text, "\n{folder}: {}", summary.files.join(", "));
        output::result(&output::plain(&text))
    };
    match printed {
        Err(exit) => exit,
        Ok(()) if summary.is_complete() => Exit::Done,
        Ok(()) => Exit::Incomplete,
    }
}

/// The reason why a case failed, if it did.
fn why_failed(record: &CaseRecord) -> Option<String> {
    let of_step = || {
        let (index, step) = record.steps.iter().enumerate().find(|(_, step)| step.failed)?;
        Some(format!("step {index} {}", step.status))
    };
    record.refused.clone().or_else(of_step)
}

/// The quantities that are printed, by their columns of curve.csv, with names and units.
const PRINTED: [(&str, &str, &str); 4] = [
    ("capacitance_f", "C", "F"),
    ("change_f", "change of C", "F"),
    ("sensitivity_f_per_n", "dC/dF", "F/N"),
    ("force_n", "force", "N"),
];

/// The keys that matter most, and the origins of the rest of the variance.
fn depends_on(influence: &Influence) -> String {
    let shares = influence.shares.iter().take(3).filter(|share| share.share >= 0.005);
    let mut shares: Vec<(String, f64)> = shares.map(|share| (share.key.clone(), share.share)).collect();
    let of_all: f64 = influence.shares.iter().map(|share| share.share).sum();
    let others = of_all - shares.iter().map(|(_, share)| share).sum::<f64>();
    shares.push(("other keys".to_owned(), others));
    shares.push(("several keys together or no rising or falling curve".to_owned(), 1.0 - of_all));
    let shares = shares.iter().filter(|(_, share)| *share >= 0.005);
    shares.map(|(key, share)| format!("{key} {:.0} %", 100.0 * share)).collect::<Vec<_>>().join(", ")
}

/// Mean, deviation, percentiles and the key that matters most, for each step.
fn scatter_table(statistics: &[StepStatistics]) -> String {
    let mut out = String::new();
    for (quantity, name, unit) in PRINTED {
        let lines: Vec<&StepStatistics> =
            statistics.iter().filter(|line| line.quantity == quantity).collect();
        // A quantity that is zero throughout says nothing.
        if lines.iter().all(|line| line.moments.least == 0.0 && line.moments.greatest == 0.0) {
            continue;
        }
        let _ = writeln!(
            out,
            "\n{name:<13}{:>13}{:>13}{:>13}{:>13}{:>13}   depends on (share of the variance of ranks)",
            "mean", "deviation", "5 %", "median", "95 %"
        );
        for line in lines {
            let moments = &line.moments;
            let percentile = |percent: f64| {
                moments.percentiles.iter().find(|(p, _)| *p == percent).map(|(_, value)| *value)
            };
            let shown = |value: Option<f64>| value.map_or_else(String::new, |value| prefixed(value, 4, unit));
            let _ = write!(
                out,
                "step {:<8}{:>13}{:>13}{:>13}{:>13}{:>13}",
                line.step,
                shown(Some(moments.mean)),
                shown(moments.deviation),
                shown(percentile(5.0)),
                shown(percentile(50.0)),
                shown(percentile(95.0)),
            );
            if let Some(influence) = &line.influence {
                let _ = write!(out, "   {}", depends_on(influence));
            }
            out.push('\n');
        }
    }
    out
}
