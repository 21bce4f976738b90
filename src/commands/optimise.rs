//! `elastocap optimise`: varies keys of a case until a quantity is largest or smallest.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use clap::{ArgGroup, Args};
use elastocap_fitting::objective::{Constraint, Quantity};
use elastocap_fitting::optimise::{
    Evaluation, MAX_EVALUATIONS, OptimiseError, Optimum, Search, case_of, optimise, varied,
};
use elastocap_fitting::parameter::{Free, Parameter};

use super::stop::{end_in_time, left_a_solve, stop_without_files};
use super::summary::table;
use super::written::{check_free, write_all};
use crate::common::Common;
use crate::exit::Exit;
use crate::output;
use crate::units::seconds;

const EXAMPLES: &str = "\
Examples:
  elastocap optimise cases/in-plane-pair.toml --vary electrodes.in_plane_pair.gap=20um..200um \\
      --vary electrodes.in_plane_pair.length=100um..400um \\
      --maximise \"sensitivity at 0.1 N\" --subject \"C0 > 30fF\" -o best.toml
  elastocap optimise sensor.toml --vary layer.thickness=100um..1mm --minimise \"force at 0.2\" \\
      --subject \"change at 0.2 > 5fF\"

Quantities: C0 (the capacitance without load), and at a force (0.1 N) or a compression U/H (0.2)
  C at LOAD             the capacitance
  change at LOAD        |C - C0|
  sensitivity at LOAD   |dC/dF|, by the difference of two loads 15 % below and above
  force at COMPRESSION  the force

The search is COBYLA's: it needs no derivatives, keeps the limits, and finds a local optimum. It
begins at the values of the case where these are in the ranges; another start is KEY=a..b@start.

Exit status 3: it was stopped, did not converge, or found nothing within the limits.";

#[derive(Debug, Args)]
#[command(after_help = EXAMPLES, group(ArgGroup::new("wish").required(true).args(["maximise", "minimise"])))]
pub(crate) struct Arguments {
    /// The case file
    case: PathBuf,
    /// A key that may vary, by its path, with its range and a start if need be: KEY=a..b@start
    #[arg(long, value_name = "KEY=a..b", required = true)]
    vary: Vec<Free>,
    /// What should be as large as possible, such as "sensitivity at 0.1 N"
    #[arg(long, visible_alias = "maximize", value_name = "QUANTITY")]
    maximise: Option<Quantity>,
    /// What should be as small as possible, such as "force at 0.2"
    #[arg(long, visible_alias = "minimize", value_name = "QUANTITY")]
    minimise: Option<Quantity>,
    /// A limit that must be kept, such as "C0 > 1pF"
    #[arg(long, value_name = "LIMIT")]
    subject: Vec<Constraint>,
    /// How well the keys are to be known, over their ranges
    #[arg(long, value_name = "SHARE", default_value_t = 0.01, value_parser = share)]
    tolerance: f64,
    /// Evaluations at most
    #[arg(long, value_name = "N", default_value_t = MAX_EVALUATIONS)]
    max_evaluations: usize,
    /// Write the case with the best values, comments kept
    #[arg(long, short, value_name = "FILE.toml")]
    output: Option<PathBuf>,
    /// Replace a file that is there already
    #[arg(long, requires = "output")]
    overwrite: bool,
    /// Print the result in JSON, and nothing else, on the standard output
    #[arg(long)]
    json: bool,
}

/// A share of a range.
fn share(text: &str) -> Result<f64, &'static str> {
    let value = text.parse::<f64>().ok().filter(|value| *value > 0.0 && *value <= 0.5);
    value.ok_or("a share above 0 and at most 0.5, such as 0.01")
}

pub(crate) fn execute(arguments: &Arguments, common: &Common) -> Exit {
    match run(arguments, common) {
        Ok(exit) | Err(exit) => exit,
    }
}

fn run(arguments: &Arguments, common: &Common) -> Result<Exit, Exit> {
    let started = Instant::now();
    let (quantity, maximise) = match (arguments.maximise, arguments.minimise) {
        (Some(quantity), _) => (quantity, true),
        (None, Some(quantity)) => (quantity, false),
        // Ruled out by the group of arguments.
        (None, None) => return Err(Exit::BadInput),
    };
    if let Some(file) = &arguments.output {
        check_free(&[file], arguments.overwrite)?;
    }
    let (source, case) = super::load_with_text(&arguments.case)?;
    let search = Search {
        quantity,
        maximise,
        constraints: arguments.subject.clone(),
        tolerance: arguments.tolerance,
        max_evaluations: arguments.max_evaluations.max(1),
    };
    let refused = |error: OptimiseError| {
        output::error(&error.to_string());
        match error {
            OptimiseError::Stopped => Exit::Incomplete,
            _ => Exit::BadInput,
        }
    };
    let parameters = varied(&arguments.vary, &source).map_err(refused)?;
    let cancel = Arc::new(AtomicBool::new(false));
    stop_without_files(&cancel);
    let report = |evaluation: &Evaluation, number: usize| {
        if !common.quiet && !arguments.json {
            output::message(&format!("{number:>3}  {}", in_words(evaluation, &parameters, &search)));
        }
    };
    let work = || optimise(&source, &arguments.case, &parameters, &search, &cancel, &report);
    let found = end_in_time(&cancel, work, left_a_solve)?.map_err(refused)?;
    if let (Some(file), Some(best)) = (&arguments.output, found.best) {
        let failed = |reason: String| {
            output::error(&format!("cannot write the case: {reason}"));
            Exit::Failure
        };
        let text = case_of(&source, &parameters, &found.evaluations[best].values)
            .map_err(|error| failed(error.to_string()))?;
        let text =
            super::moved_to(&text, &arguments.case, file).map_err(|error| failed(error.to_string()))?;
        write_all(&[(file.as_path(), text)], arguments.overwrite)?;
    }
    warn(&found, &search);
    let taken = started.elapsed().as_secs_f64();
    if arguments.json {
        output::result(&json(&case.title, arguments, &parameters, &search, &found, taken))?;
    } else if !common.quiet {
        let mut text = format!("{}\n\n{}", case.title, summary(&parameters, &search, &found, taken));
        if let (Some(file), Some(_)) = (&arguments.output, found.best) {
            text.push_str(&format!("\n{}\n", file.display()));
        }
        output::result(&text)?;
    }
    Ok(if found.converged && found.best.is_some() { Exit::Done } else { Exit::Incomplete })
}

/// Prints what the search did not achieve.
fn warn(found: &Optimum, search: &Search) {
    if found.stopped {
        output::warning("the search was stopped: this is the best by then");
    } else if !found.converged {
        output::warning(&format!(
            "the search did not converge within {} evaluations: this is the best by then; raise --max-evaluations",
            search.max_evaluations
        ));
    }
    if found.best.is_none() {
        output::warning(
            "nothing was found within the limits: widen the ranges, or begin nearer to what is allowed (KEY=a..b@start)",
        );
    }
    for name in &found.at_limit {
        output::warning(&format!("{name} ended at a limit of its range: a wider range may give more"));
    }
}

/// A number in the unit that suits it.
fn shown(value: f64, unit: &str, digits: usize) -> String {
    match unit.split_once('/') {
        Some((above, below)) => format!("{}/{below}", crate::units::prefixed(value, digits, above)),
        None => crate::units::prefixed(value, digits, unit),
    }
}

/// An evaluation in one line: keys, objective, limited quantities, and whether it is allowed.
fn in_words(evaluation: &Evaluation, parameters: &[Parameter], search: &Search) -> String {
    let values =
        parameters.iter().zip(&evaluation.values).map(|(parameter, value)| parameter.show(*value, 4));
    let mut parts: Vec<String> = values.collect();
    match evaluation.objective {
        Some(value) => parts.push(shown(value, search.quantity.unit(), 5)),
        None => parts.extend(evaluation.failure.as_ref().map(ToString::to_string)),
    }
    let limited = search.constraints.iter().zip(&evaluation.limited);
    parts.extend(limited.map(|(limit, value)| shown(*value, limit.quantity.unit(), 4)));
    parts.push(if evaluation.is_allowed { "ok".to_owned() } else { "not allowed".to_owned() });
    parts.join("   ")
}

/// The table of all evaluations, and the best of them.
fn summary(parameters: &[Parameter], search: &Search, found: &Optimum, taken: f64) -> String {
    let mut head = vec![String::new()];
    head.extend(
        parameters
            .iter()
            .map(|parameter| parameter.name.rsplit('.').next().unwrap_or(&parameter.name).to_owned()),
    );
    head.push(search.quantity.to_string());
    head.extend(search.constraints.iter().map(|constraint| constraint.quantity.to_string()));
    head.push("limits".to_owned());
    let mut lines = vec![head];
    for (k, evaluation) in found.evaluations.iter().enumerate() {
        let mut line = vec![format!("{}{}", if found.best == Some(k) { "best " } else { "" }, k + 1)];
        line.extend(
            parameters.iter().zip(&evaluation.values).map(|(parameter, value)| parameter.show(*value, 5)),
        );
        line.push(
            evaluation
                .objective
                .map_or_else(|| "-".to_owned(), |value| shown(value, search.quantity.unit(), 5)),
        );
        for (index, limit) in search.constraints.iter().enumerate() {
            line.push(
                evaluation
                    .limited
                    .get(index)
                    .map_or_else(|| "-".to_owned(), |value| shown(*value, limit.quantity.unit(), 4)),
            );
        }
        line.push(match (&evaluation.failure, evaluation.is_allowed) {
            (Some(reason), _) => reason.to_string(),
            (None, true) => "kept".to_owned(),
            (None, false) => "not kept".to_owned(),
        });
        lines.push(line);
    }
    let mut out = table(lines);
    if let Some(best) = found.best.map(|k| &found.evaluations[k]) {
        let word = if search.maximise { "largest" } else { "smallest" };
        let error = best
            .objective_error
            .map_or_else(String::new, |error| format!(" +- {}", shown(error, search.quantity.unit(), 2)));
        out.push_str(&format!(
            "\n  {word} {}: {}{error} at\n",
            search.quantity,
            best.objective.map_or_else(|| "-".to_owned(), |value| shown(value, search.quantity.unit(), 5))
        ));
        for (parameter, value) in parameters.iter().zip(&best.values) {
            out.push_str(&format!("    {} = {}\n", parameter.name, parameter.show(*value, 5)));
        }
        for limit in &search.constraints {
            out.push_str(&format!("  subject to {limit}\n"));
        }
    }
    out.push_str(&format!("  {} evaluations in {}\n", found.evaluations.len(), seconds(taken)));
    out
}

/// The search as JSON.
fn json(
    title: &str,
    arguments: &Arguments,
    parameters: &[Parameter],
    search: &Search,
    found: &Optimum,
    taken: f64,
) -> String {
    let values = |evaluation: &Evaluation| -> serde_json::Map<String, serde_json::Value> {
        parameters
            .iter()
            .zip(&evaluation.values)
            .map(|(parameter, value)| (parameter.name.clone(), (*value).into()))
            .collect()
    };
    let document = serde_json::json!({
        "title": title,
        "case": arguments.case.display().to_string(),
        "quantity": search.quantity.to_string(),
        "unit": search.quantity.unit(),
        "wish": if search.maximise { "maximise" } else { "minimise" },
        "subject": search.constraints.iter().map(ToString::to_string).collect::<Vec<_>>(),
        "best": found.best.map(|k| values(&found.evaluations[k])),
        "best_objective": found.best.map(|k| found.evaluations[k].objective),
        "best_limited": found.best.map(|k| found.evaluations[k].limited.clone()),
        "search": found,
        "seconds": taken,
    });
    format!("{document:#}\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use elastocap_case::Amount;

    #[test]
    fn quantities_over_newtons_keep_their_denominator() {
        assert_eq!(shown(52.13e-15, "F/N", 4), "52.13 fF/N");
        let amount: Amount = "1 fF/N".parse().unwrap();
        assert!((amount.si - 1e-15).abs() < 1e-27);
    }
}
