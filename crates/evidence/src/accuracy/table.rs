//! `accuracy.csv`: one line for each run.

use super::{Choice, Honesty, Kind, Study};
use elastocap_results::csv::{number, optional, quoted};

/// The columns, in their order.
const COLUMNS: [&str; 20] = [
    "kind",
    "choice",
    "tolerance",
    "order",
    "levels",
    "unknowns",
    "seconds",
    "repeats",
    "value_f",
    "lower_f",
    "upper_f",
    "certified_error",
    "true_error",
    "reference_half_width",
    "below_reference",
    "spread_or_estimate",
    "estimate_over_true",
    "estimate_is",
    "time_over_best",
    "status",
];

/// One line for each run; a cell is empty where a run does not have the quantity.
pub fn csv(study: &Study) -> String {
    let mut out = COLUMNS.join(",");
    out.push('\n');
    let half_width = study.reference.map(|reference| reference.half_width());
    for (i, run) in study.runs.iter().enumerate() {
        let found = run.found();
        let count = |n: Option<usize>| n.map_or_else(String::new, |n| n.to_string());
        let level = found.and_then(|f| f.level);
        let plates = run.kind == Kind::ParallelPlates;
        let limits = found.filter(|_| !plates).map(|f| f.value);
        let true_error = study.true_error(run);
        let below = true_error.zip(half_width).map(|(error, least)| if error < least { "yes" } else { "no" });
        let honesty = study.honesty(run).map(|honesty| match honesty {
            Honesty::Fair => "fair",
            Honesty::TooLow => "too low",
            Honesty::TooHigh => "too high",
        });
        let choice = match run.choice {
            _ if plates => "",
            Choice::Table => "table",
            Choice::Own => "own",
        };
        let fields: [String; COLUMNS.len()] = [
            run.kind.name().to_owned(),
            choice.to_owned(),
            optional(run.tolerance),
            count(level.map(|level| level.order)),
            count(level.map(|level| level.levels)),
            count(found.and_then(|f| f.unknowns)),
            optional(found.map(|f| f.seconds)),
            count(found.map(|f| f.repeats)),
            optional(found.map(|f| f.value.value)),
            optional(limits.map(|c| c.lower)),
            optional(limits.map(|c| c.upper)),
            optional(study.certified_error(run)),
            optional(true_error),
            optional(half_width.filter(|_| found.is_some())),
            below.unwrap_or_default().to_owned(),
            optional(found.filter(|_| !plates).map(|f| f.reported_error)),
            optional(study.estimate_over_true(run)),
            honesty.unwrap_or_default().to_owned(),
            study.verdict(i).map_or_else(String::new, |verdict| number(verdict.ratio)),
            quoted(&run.status()),
        ];
        out.push_str(&fields.join(","));
        out.push('\n');
    }
    out
}
