//! The report that `elastocap accuracy` prints.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use elastocap_case::Measurement;
use elastocap_coupling::load_steps::StepLoad;
use elastocap_evidence::accuracy::{
    ALLOWED, Choice, Honesty, Kind, MAX_CAUTION, Missing, Quantity, Run, Study,
};

use super::summary::table;
use crate::units::{prefixed, seconds};

/// The report on a study whose `files` are in `folder`.
pub(super) fn report(study: &Study, folder: &Path, files: &[PathBuf]) -> String {
    let state = match study.load {
        StepLoad::None => "no load".to_owned(),
        StepLoad::Compression(c) => format!("step {}, U/H = {c:.4}", study.step),
        StepLoad::ForceN(force) => format!("step {}, {}", study.step, prefixed(force, 4, "N")),
    };
    let quantity = match study.quantity {
        Quantity::Measured(Measurement::Mutual(_)) => "mutual capacitance that the case measures",
        Quantity::Measured(Measurement::Own(_) | Measurement::Guarded(_)) => "capacitance against ground",
        Quantity::Measured(Measurement::TwoTerminal(_) | Measurement::Matrix { .. }) => {
            "two-terminal capacitance"
        }
        Quantity::FirstEntry => "C11 of the Maxwell matrix, since there are not two terminals",
    };
    let mut out = format!("{}\n{state}; {quantity}\n\n", study.title);
    if let Some(reference) = study.reference {
        let _ = writeln!(
            out,
            "reference {} +- {:.1e}, from {} proved intervals{}",
            prefixed(reference.value(), 9, "F"),
            reference.half_width(),
            reference.intervals,
            if study.contradicts() { "" } else { ", which all overlap" }
        );
    }
    out.push('\n');
    out.push_str(&table(choices(study)));
    out.push('\n');
    verdicts(study, &mut out);
    honesty(study, &mut out);
    if let Some(run) = study.parallel_plates()
        && let (Some(found), Some(error)) = (run.found(), study.true_error(run))
    {
        let value = prefixed(found.value.value, 4, "F");
        let _ =
            writeln!(out, "parallel plates: {value}, an error of {error:.2e}, in {}", short(found.seconds));
    }
    let names: Vec<_> =
        files.iter().filter_map(|f| f.file_name()).map(|f| f.to_string_lossy().into_owned()).collect();
    let _ = writeln!(out, "\n{}: {}", folder.display(), names.join(", "));
    out
}

/// Seconds, with a resolution of microseconds.
fn short(value: f64) -> String {
    if value < 1e-3 { prefixed(value, 2, "s") } else { seconds(value) }
}

/// Seconds with more digits than [`seconds`] gives, for comparison.
fn time(value: f64) -> String {
    if value < 0.0995 { format!("{:.1} ms", 1e3 * value) } else { format!("{value:.2} s") }
}

/// One line for each grid that the solver chose.
fn choices(study: &Study) -> Vec<Vec<String>> {
    let heads = [
        "tolerance",
        "",
        "own grid",
        "time",
        "spread",
        "estimate",
        "true error",
        "best grid",
        "time",
        "ratio",
    ];
    let mut lines = vec![heads.map(str::to_owned).to_vec()];
    let grid = |run: &Run| {
        let level = run.found().and_then(|found| found.level);
        level.map_or_else(String::new, |level| format!("{} / {}", level.order, level.levels))
    };
    for (i, run) in study.runs.iter().enumerate().filter(|(_, run)| run.choice == Choice::Own) {
        let Some(tolerance) = run.tolerance else { continue };
        let kind = if run.kind == Kind::Bounds { "bounds" } else { "no bounds" };
        let mut line = vec![format!("{tolerance:.0e}"), kind.to_owned()];
        let Some(found) = run.found() else {
            line.push(match &run.outcome {
                Err(Missing::Failed(_)) => "failed".to_owned(),
                Err(Missing::LeftOut(_) | Missing::NotRun) | Ok(_) => run.status(),
            });
            lines.push(line);
            continue;
        };
        let reported_error = format!("{:.1e}", found.reported_error);
        let (spread, estimate) = if run.kind == Kind::Bounds {
            (reported_error, String::new())
        } else {
            (String::new(), reported_error)
        };
        let least = study.reference.map_or(0.0, |reference| reference.half_width());
        let error = study.true_error(run).map_or_else(String::new, |error| {
            if error < least { format!("< {least:.1e}") } else { format!("{error:.1e}") }
        });
        line.extend([grid(run), time(found.seconds), spread, estimate, error]);
        if let Some(verdict) = study.verdict(i) {
            let best = &study.runs[verdict.best];
            line.extend([grid(best), time(best.found().map_or(f64::NAN, |f| f.seconds))]);
            line.push(format!("{:.2}", verdict.ratio));
        }
        lines.push(line);
    }
    lines
}

/// Appends how many of the solver's choices are good.
fn verdicts(study: &Study, out: &mut String) {
    let count = study.verdicts.len();
    let Some(worst) = study.verdicts.iter().map(|verdict| verdict.ratio).reduce(f64::max) else { return };
    let good = study.verdicts.iter().filter(|verdict| verdict.is_good()).count();
    let _ = writeln!(
        out,
        "own choice within {ALLOWED} times the time of the best grid: {good} of {count}, worst {worst:.2} (grids are \
         order / layers)"
    );
}

/// Appends the ratios of error estimates to true errors.
fn honesty(study: &Study, out: &mut String) {
    for (choice, whose) in [(Choice::Own, "own choice"), (Choice::Table, "all given grids")] {
        let runs = || study.runs.iter().filter(|run| run.choice == choice);
        let ratios: Vec<f64> = runs().filter_map(|run| study.estimate_over_true(run)).collect();
        if ratios.is_empty() {
            continue;
        }
        let (low, high) =
            ratios.iter().fold((f64::INFINITY, 0.0_f64), |(low, high), r| (low.min(*r), high.max(*r)));
        let count = |honesty| runs().filter(|run| study.honesty(run) == Some(honesty)).count();
        let (below, above) = (count(Honesty::TooLow), count(Honesty::TooHigh));
        let _ = write!(out, "estimate over true error, {whose}: {low:.1} to {high:.1}");
        if below + above > 0 {
            let _ = write!(
                out,
                "; {below} of {} below the true error, {above} above {MAX_CAUTION} times it",
                ratios.len()
            );
        }
        out.push('\n');
    }
}
