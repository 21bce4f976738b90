//! `elastocap check`: prints the plan of a run.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use clap::Args;
use elastocap_coupling::model_error;
use elastocap_coupling::plan::{Decision, Kind, Options, Plan, PlannedStep};
use elastocap_coupling::step_messages::lines;
use elastocap_coupling::words::counted;
use elastocap_results::Wanted;

use super::{catching_defects, inputs};
use crate::common::Common;
use crate::exit::Exit;
use crate::output;
use crate::units::{bytes, grouped, seconds};

const EXAMPLES: &str = "\
Examples:
  elastocap check cases/stacked-pair.toml
  elastocap check cases/stacked-pair.toml --json | jq .seconds
  elastocap check cases/*.toml --quiet             messages and exit status only
  elastocap new pair | elastocap check -

Several cases are planned one after another; the exit status is the worst: 1 before 2 before 3
before 0. `-` reads a case from the standard input.";

#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// The case file, or several; `-` is the standard input
    #[arg(required = true, value_name = "CASE")]
    cases: Vec<PathBuf>,
    /// Print the plan as JSON
    #[arg(long)]
    json: bool,
    /// Plan a run that leaves nothing out
    #[arg(long)]
    no_prune: bool,
}

pub(crate) fn execute(arguments: &Arguments, common: &Common) -> Exit {
    if let Err(error) = inputs::check_stdin(&arguments.cases) {
        output::error(&error.to_string());
        return Exit::BadInput;
    }
    let several = arguments.cases.len() > 1;
    arguments.cases.iter().enumerate().fold(Exit::Done, |worst, (index, case)| {
        if several && !arguments.json && !common.quiet {
            // A reader that has gone away is noticed at the plan.
            let gap = if index > 0 { "\n" } else { "" };
            let _ = output::result(&format!("{gap}{}\n", case.display()));
        }
        let checked = catching_defects(case, || check(case, arguments, common));
        worst.or_worse(checked.unwrap_or_else(|defect| defect))
    })
}

fn check(path: &Path, arguments: &Arguments, common: &Common) -> Exit {
    let case = match super::load(path) {
        Ok(case) => case,
        Err(exit) => return exit,
    };
    let options = Options { prune: !arguments.no_prune, ..Options::default() };
    let mut plan = Plan::new(&case, &options);
    Wanted::of(&options).note_in(&case, &options, &mut plan);
    plan.forecast(&case, &options);
    model_error::add_forecast(&case, &options, &mut plan);
    print(arguments, common, &case.title, &plan)
}

/// Prints the plan, and returns the status of the command.
fn print(arguments: &Arguments, common: &Common, title: &str, plan: &Plan) -> Exit {
    let text = if arguments.json {
        match serde_json::to_string_pretty(plan) {
            Ok(json) => json + "\n",
            Err(error) => {
                output::error(&format!("cannot print the plan: {error}"));
                return Exit::Failure;
            }
        }
    } else if common.quiet {
        failures(plan).iter().for_each(|text| output::error(text));
        return exit(plan);
    } else {
        describe(title, plan)
    };
    match output::result(&text) {
        Ok(()) => exit(plan),
        Err(exit) => exit,
    }
}

/// The status that the plan implies: bad input if no step can be solved, incomplete if some cannot.
fn exit(plan: &Plan) -> Exit {
    let fails = |step: &PlannedStep| step.failure.is_some();
    if plan.steps.iter().all(fails) {
        Exit::BadInput
    } else if plan.steps.iter().any(fails) {
        Exit::Incomplete
    } else {
        Exit::Done
    }
}

/// The plan in words.
fn describe(title: &str, plan: &Plan) -> String {
    let mut out = format!("{title}\n");
    let mut line = |head: &str, text: &str| {
        let _ = writeln!(out, "  {head:<14} {text}");
    };
    for planned in &plan.solved {
        line(planned.part, &planned.what);
    }
    if let Some(layer) = &plan.layer {
        let text = format!(
            "at most {} and about {} on two cores, {} if every load needs every mesh (estimates)",
            bytes(layer.memory_bytes),
            seconds(layer.seconds),
            seconds(layer.most_seconds)
        );
        line("layer", &text);
    }
    if plan.kind != Kind::Mechanics {
        if plan.unknowns > 0 {
            line("unknowns", &format!("about {} in the largest problem", grouped(plan.unknowns)));
            line(
                "memory",
                &format!(
                    "at most {}, with {} at a time",
                    bytes(plan.memory_bytes),
                    counted(plan.at_once, "step")
                ),
            );
            line("time", &format!("about {} on two cores", seconds(plan.seconds)));
        } else if plan.steps.iter().any(|step| step.failure.is_none()) {
            line("time", "not estimated for this scene");
        }
    }
    if !plan.left_out.is_empty() {
        out.push_str("left out\n");
    }
    for left in &plan.left_out {
        let whose = match left.by {
            Decision::Plan => "",
            Decision::Case => " [the case does not ask for it]",
            Decision::Caller => " [left out on request]",
        };
        let _ = writeln!(out, "  {}: {}{whose}. {}", left.what, left.why, left.saving);
    }
    for warning in &plan.warnings {
        let _ = writeln!(out, "warning: {warning}");
    }
    for text in failures(plan) {
        let _ = writeln!(out, "{text}");
    }
    out
}

/// The failures that are known in advance, a line for each reason.
fn failures(plan: &Plan) -> Vec<String> {
    let failures = plan.distinct_steps().filter_map(|step| Some((step.index, step.failure.as_ref()?)));
    lines(failures.map(|(step, failure)| (step, format!("will fail: {failure}"))))
}
