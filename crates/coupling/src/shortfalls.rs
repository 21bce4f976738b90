//! Messages about steps with incomplete results or on another route than planned, merged where several steps
//! have the same one.

use crate::outcome::{Status, StepResult};
use crate::route_change::RouteChange;
use crate::step_messages::lines;

/// The shortfall of a step that was begun, in words; `None` if its result is complete.
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

/// The messages about all steps of a run with incomplete results, without steps that are taken from another
/// one.
pub fn of_run(steps: &[StepResult]) -> Vec<String> {
    let solved = steps.iter().filter(|step| step.same_as.is_none());
    lines(solved.filter_map(|step| Some((step.index, of_step(step)?))))
}

/// The messages about all steps of a run that were not solved on their planned route, without steps that are
/// taken from another one.
pub fn route_changes(steps: &[StepResult]) -> Vec<String> {
    let solved = steps.iter().filter(|step| step.same_as.is_none());
    let messages = |step: &StepResult| {
        let index = step.index;
        let message = |change: &RouteChange| (index, format!("took another route: {change}"));
        step.route_changes.iter().map(message).collect::<Vec<_>>()
    };
    lines(solved.flat_map(messages))
}
