//! Steps that do not have all that was asked for, as they are told: those with the same shortfall together.

use crate::outcome::{Status, StepResult};
use crate::route_change::RouteChange;
use crate::words::counted;

/// Shortfalls that are told, at most.
const MAX_LINES: usize = 10;

/// The shortfall of a step that was begun, in words: what was asked for and is missing. `None` if nothing is.
pub fn of_step(step: &StepResult) -> Option<String> {
    let reason = step.reason.as_ref().map_or_else(String::new, |reason| format!(": {reason}"));
    match &step.row.status {
        Status::Failed(reason) => Some(format!("failed: {reason}")),
        Status::ToleranceNotReached(_) => Some(format!("missed the tolerance{reason}")),
        Status::BeyondForceLimit => Some(format!("got no force{reason}")),
        Status::Draft => Some("has a draft alone, because the run was stopped".to_owned()),
        Status::Ok | Status::OkToDiagonal | Status::OkInModel | Status::NotRun => None,
    }
}

/// The lines of all steps of a run that do not have what was asked for; steps that are taken from another one are left out.
pub fn of_run(steps: &[StepResult]) -> Vec<String> {
    let solved = steps.iter().filter(|step| step.same_as.is_none());
    lines(solved.filter_map(|step| Some((step.index, of_step(step)?))))
}

/// The lines of all steps of a run that were not solved on the route that was meant for them; steps that are taken from another one are
/// left out.
pub fn route_changes(steps: &[StepResult]) -> Vec<String> {
    let solved = steps.iter().filter(|step| step.same_as.is_none());
    let told = |step: &StepResult| {
        let index = step.index;
        let told = |change: &RouteChange| (index, format!("took another route: {change}"));
        step.route_changes.iter().map(told).collect::<Vec<_>>()
    };
    lines(solved.flat_map(told))
}

/// A line for each different text, in the order of the first steps that have it; `told` has the index of a step and the text, in words
/// that fit one step and several.
pub fn lines(told: impl IntoIterator<Item = (usize, String)>) -> Vec<String> {
    let mut found: Vec<(String, Vec<usize>)> = Vec::new();
    for (step, text) in told {
        match found.iter_mut().find(|(known, _)| *known == text) {
            Some((_, steps)) => steps.push(step),
            None => found.push((text, vec![step])),
        }
    }
    let mut out: Vec<String> = found
        .iter()
        .take(MAX_LINES)
        .map(|(text, steps)| match steps.as_slice() {
            [first, _, ..] => format!("{}, from step {first} on, {text}", counted(steps.len(), "step")),
            [] | [_] => format!("step {} {text}", steps.first().copied().unwrap_or_default()),
        })
        .collect();
    if found.len() > MAX_LINES {
        let rest = found[MAX_LINES..].iter().map(|(_, steps)| steps.len()).sum();
        out.push(format!("{} more; --json has the reasons", counted(rest, "step")));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::lines;

    #[test]
    fn steps_that_say_the_same_share_a_line_and_ten_lines_are_enough() {
        let told =
            [(1, "failed: a"), (2, "failed: b"), (4, "failed: a")].map(|(k, text)| (k, text.to_owned()));
        assert_eq!(lines(told), ["2 steps, from step 1 on, failed: a", "step 2 failed: b"]);
        let many = lines((0..13).map(|k| (k, format!("failed: {k}"))));
        assert_eq!(many.len(), 11);
        assert!(many[10].starts_with("3 steps more"), "{}", many[10]);
        assert!(lines([]).is_empty());
    }
}
