//! `elastocap compare`: compares results.

use std::path::PathBuf;

use clap::Args;
use elastocap_results::comparison::{Comparison, Difference, compare};
use elastocap_results::report::{WordTable, comparison_page};

use super::summary::table;
use super::written::write_all;
use crate::exit::Exit;
use crate::output;
use crate::units::{grouped, prefixed, seconds};

const EXAMPLES: &str = "\
Examples:
  elastocap compare results/in-plane-pair results/stacked-pair
  elastocap compare before after --html comparison.html
  elastocap compare before after --json | jq '.steps[].against_first[0].relative'

The first result is the one that the others are compared with. Two capacitances agree where their
bounds overlap; otherwise they differ by the distance between the bounds at least. Steps belong
together that have the same load in the case.";

#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// Output folders of runs, or the result.json in them
    #[arg(required = true, num_args = 2.., value_name = "RESULT")]
    results: Vec<PathBuf>,
    /// Print the comparison in JSON, and nothing else, on the standard output
    #[arg(long)]
    json: bool,
    /// Write it as one page for a browser, too
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
}

pub(crate) fn execute(arguments: &Arguments) -> Exit {
    let comparison = match compare(&arguments.results) {
        Ok(comparison) => comparison,
        Err(error) => {
            output::error(&error.to_string());
            return Exit::BadInput;
        }
    };
    if comparison.measured_differently() {
        output::warning("the results measure different capacitances");
    }
    let parts = parts(&comparison);
    if let Some(file) = &arguments.html {
        let chart = comparison.chart();
        let page = comparison_page("Results side by side", &sentence(&comparison), chart.as_ref(), &parts);
        if let Err(exit) = write_all(&[(file.as_path(), page)], true) {
            return exit;
        }
    }
    let text = if arguments.json {
        format!("{:#}\n", comparison.json())
    } else {
        output::plain(&text(&comparison, &parts))
    };
    match output::result(&text) {
        Ok(()) => Exit::Done,
        Err(exit) => exit,
    }
}

/// The number of agreeing steps, for each result after the first.
fn sentence(comparison: &Comparison) -> String {
    let first = comparison.letter(0);
    let sentence_on = |k: usize| {
        let known: Vec<Difference> = comparison.steps.iter().filter_map(|step| step.difference(k)).collect();
        let letter = comparison.letter(k);
        if known.is_empty() {
            return format!("{letter} and {first} have no capacitance at the same load.");
        }
        let agreeing = known.iter().filter(|difference| difference.agrees()).count();
        let largest = known
            .iter()
            .map(|difference| difference.relative)
            .fold(0.0_f64, |m, r| if r.abs() > m.abs() { r } else { m });
        format!(
            "{letter} agrees with {first} within the bounds at {agreeing} of {} steps; the largest difference is {}.",
            known.len(),
            percent(largest)
        )
    };
    (1..comparison.results.len()).map(sentence_on).collect::<Vec<_>>().join(" ")
}

/// A share in percent with its sign, with more decimals for smaller ones.
fn percent(share: f64) -> String {
    let value = 100.0 * share;
    match value.abs() {
        0.0 => "0 %".to_owned(),
        0.0995.. => format!("{value:+.2} %"),
        0.0001.. => format!("{value:+.4} %"),
        _ => format!("{value:+.1e} %"),
    }
}

fn verdict(difference: &Difference) -> String {
    match difference.agrees() {
        true => "agree".to_owned(),
        false => format!("differ by {} or more", prefixed(difference.at_least(), 3, "F")),
    }
}

/// The tables, under their headings.
fn parts(comparison: &Comparison) -> Vec<(String, Vec<WordTable>)> {
    let letters: Vec<String> = (0..comparison.results.len()).map(|k| comparison.letter(k)).collect();
    let head = |first: &str| -> Vec<String> {
        std::iter::once(first.to_owned()).chain(letters.iter().cloned()).collect()
    };
    let row =
        |name: &str, value: &dyn Fn(&elastocap_results::comparison::OneResult) -> String| -> Vec<String> {
            std::iter::once(name.to_owned()).chain(comparison.results.iter().map(value)).collect()
        };
    let absent = || "-".to_owned();
    let words = |words: &[&str]| -> Vec<String> { words.iter().map(|word| (*word).to_owned()).collect() };
    let results: Vec<Vec<String>> = (comparison.results.iter().zip(&letters))
        .map(|(result, letter)| {
            let measured = result.measured.clone().unwrap_or_else(absent);
            let bounds = if result.proved { "proved" } else { "estimated" }.to_owned();
            let folder = result.path.display().to_string();
            vec![letter.clone(), result.title.clone(), result.status.clone(), measured, bounds, folder]
        })
        .collect();
    let of_results = words(&["", "title", "status", "measured", "bounds", "result"]);
    let keys: Vec<Vec<String>> = (comparison.keys.iter().flatten())
        .map(|key| {
            let values = key.values.iter().map(|value| value.clone().unwrap_or_else(absent));
            std::iter::once(key.path.clone()).chain(values).collect()
        })
        .collect();
    let mut step_head = head("load");
    for letter in letters.iter().skip(1) {
        step_head.extend([format!("{letter} - A"), "relative".to_owned(), "bounds".to_owned()]);
    }
    let steps: Vec<Vec<String>> = (comparison.steps.iter())
        .map(|step| {
            let mut cells = vec![step.label.clone()];
            let value = |value: &Option<elastocap_results::comparison::StepValue>| {
                value.and_then(|value| value.capacitance).map_or_else(absent, |c| prefixed(c[0], 6, "F"))
            };
            cells.extend(step.values.iter().map(value));
            for k in 1..letters.len() {
                match step.difference(k) {
                    Some(difference) => cells.extend([
                        prefixed(difference.value, 4, "F"),
                        percent(difference.relative),
                        verdict(&difference),
                    ]),
                    None => cells.extend([absent(), absent(), "not comparable".to_owned()]),
                }
            }
            cells
        })
        .collect();
    let force = |value: &elastocap_results::comparison::StepValue| value.force_n;
    let has_forces =
        comparison.steps.iter().any(|step| step.values.iter().flatten().any(|value| force(value).is_some()));
    let forces: Vec<Vec<String>> = (comparison.steps.iter())
        .map(|step| {
            let value = |value: &Option<elastocap_results::comparison::StepValue>| {
                value.as_ref().and_then(force).map_or_else(absent, |f| prefixed(f, 5, "N"))
            };
            std::iter::once(step.label.clone()).chain(step.values.iter().map(value)).collect()
        })
        .collect();
    let times = vec![
        row("run", &|result| seconds(result.seconds)),
        row("threads", &|result| result.threads.to_string()),
        row("unknowns, largest step", &|result| {
            result.unknowns.map_or_else(absent, |n| grouped(usize::try_from(n).unwrap_or(usize::MAX)))
        }),
        row("elastocap", &|result| result.version.clone()),
    ];
    let mut parts = vec![("Results".to_owned(), vec![("What is compared".to_owned(), of_results, results)])];
    if !keys.is_empty() {
        parts.push((
            "Case".to_owned(),
            vec![("Keys of the case files that differ".to_owned(), head("key"), keys)],
        ));
    }
    let mut of_steps = vec![("Capacitance at each load".to_owned(), step_head, steps)];
    if has_forces {
        of_steps.push(("Force at each load".to_owned(), head("load"), forces));
    }
    parts.push(("Capacitance and force".to_owned(), of_steps));
    parts.push(("Time".to_owned(), vec![("What the runs took".to_owned(), head(""), times)]));
    parts
}

/// The comparison for a terminal.
fn text(comparison: &Comparison, parts: &[(String, Vec<WordTable>)]) -> String {
    let mut out = String::new();
    for (k, result) in comparison.results.iter().enumerate() {
        let status =
            if result.status == "complete" { String::new() } else { format!(" ({})", result.status) };
        out.push_str(&format!(
            "{}  {}: {}{status}\n",
            comparison.letter(k),
            result.path.display(),
            result.title
        ));
    }
    out.push('\n');
    // The first part is the list above.
    for (_, tables) in parts.iter().skip(1) {
        for (caption, head, rows) in tables {
            let lines = std::iter::once(head.clone()).chain(rows.iter().cloned()).collect();
            out.push_str(&format!("{caption}\n\n{}\n", table(lines)));
        }
    }
    match &comparison.keys {
        None => {
            out.push_str("The cases are not compared: a result was written without the text of its case.\n")
        }
        Some(keys) if keys.is_empty() => out.push_str("The cases have the same keys and values.\n"),
        Some(_) => {}
    }
    out.push_str(&sentence(comparison));
    out.push('\n');
    out
}
