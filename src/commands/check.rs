//! `elastocap check`: the plan of a run.

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::Args;
use elastocap_case::Case;
use elastocap_coupling::plan::{Decision, Kind, Options, Plan};
use elastocap_coupling::words::counted;

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
    plan.forecast(&case, &options);
    let text = if arguments.json {
        match serde_json::to_string_pretty(&plan) {
            Ok(json) => json + "\n",
            Err(error) => {
                output::error(&format!("cannot print the plan: {error}"));
                return Exit::Failure;
            }
        }
    } else if common.quiet {
        return exit(&plan);
    } else {
        describe(&case, &plan)
    };
    match output::result(&text) {
        Ok(()) => exit(&plan),
        Err(exit) => exit,
    }
}

/// The status that a run is known to end with: a step that fails makes it incomplete.
fn exit(plan: &Plan) -> Exit {
    if plan.steps.iter().any(|step| step.failure.is_some()) { Exit::Incomplete } else { Exit::Done }
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
    for step in &plan.steps {
        if let (Some(failure), None) = (&step.failure, step.same_as) {
            let _ = writeln!(out, "step {} will fail: {failure}", step.index);
        }
    }
    out
}
