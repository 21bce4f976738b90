//! `elastocap check`: the plan of a run.

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::Args;
use elastocap_case::Case;
use elastocap_coupling::plan::{Decision, Kind, LeftOut, Options, Plan};

use crate::units::{bytes, grouped, seconds};
use crate::{Common, Exit, output};

const EXAMPLES: &str = "\
Examples:
  elastocap check cases/stacked-pair.toml
  elastocap check cases/stacked-pair.toml --json | jq .seconds";

#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// The case file
    case: PathBuf,
    /// Print the plan as JSON
    #[arg(long)]
    json: bool,
    /// Plan a run that leaves nothing out
    #[arg(long)]
    no_prune: bool,
}

pub(crate) fn execute(arguments: &Arguments, common: &Common) -> Exit {
    let case = match super::load(&arguments.case) {
        Ok(case) => case,
        Err(exit) => return exit,
    };
    let options = Options { prune: !arguments.no_prune, ..Options::default() };
    let mut plan = Plan::new(&case, &options);
    if let Err(reason) = plan.foretell(&case, &options) {
        plan.warnings.push(format!("the run will fail: {reason}"));
    }
    let text = if arguments.json {
        match serde_json::to_string_pretty(&plan) {
            Ok(json) => json + "\n",
            Err(error) => {
                output::error(&format!("cannot print the plan: {error}"));
                return Exit::Failure;
            }
        }
    } else if common.quiet {
        return Exit::Done;
    } else {
        describe(&case, &plan)
    };
    match output::result(&text) {
        Ok(()) => Exit::Done,
        Err(exit) => exit,
    }
}

/// The plan in words.
fn describe(case: &Case, plan: &Plan) -> String {
    let mut out = format!("{}\n", case.title);
    let mut line = |head: &str, text: &str| {
        let _ = writeln!(out, "  {head:<14} {text}");
    };
    for planned in &plan.solved {
        line(planned.part, &planned.what);
    }
    if let Some(layer) = &plan.layer {
        let text = format!(
            "at most {} and about {} on two cores, if every load needs every mesh (estimates)",
            bytes(layer.memory_bytes),
            seconds(layer.seconds)
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
                    counted_steps(plan.at_once)
                ),
            );
            line("time", &format!("about {} on two cores", seconds(plan.seconds)));
        } else {
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
        let _ = writeln!(out, "  {}: {}; {}{whose}", left.what, left.why, saving(left, plan));
    }
    for warning in &plan.warnings {
        let _ = writeln!(out, "warning: {warning}");
    }
    for step in &plan.steps {
        if let (Some(failure), None) = (&step.failure, step.same_as) {
            let _ = writeln!(out, "step {} will fail: {failure}", step.index);
        }
    }
    out
}

/// What leaving something out saves, in words.
fn saving(left: &LeftOut, plan: &Plan) -> String {
    match (left.saved_unknowns, left.saved_seconds) {
        (Some(unknowns), Some(time)) => format!(
            "this cuts the unknowns from {} to {} and saves about {}",
            grouped(plan.unknowns + unknowns),
            grouped(plan.unknowns),
            seconds(time)
        ),
        (Some(_), None) | (None, _) => format!("this saves {}", left.saving),
    }
}

/// "1 step", "2 steps".
fn counted_steps(count: usize) -> String {
    format!("{count} step{}", if count == 1 { "" } else { "s" })
}
