//! Judges the answers to an entry.

use std::fmt;

use elastocap_electrostatics::{Bounded, SolveError};

use super::answer::Answer;
use super::claim::{Claim, Claims};
use elastocap_coupling::failure::StepFailure;
use elastocap_coupling::load_steps::StepLoad;
use elastocap_coupling::outcome::{Outcome, Status, StepResult};

/// The expected answer to an entry.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Expect {
    /// A right number.
    Number,
    /// A refusal with a reason: of the case, of the step, or of its force.
    Refusal,
}

/// The verdict on an entry.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Verdict {
    /// The truth lies within the stated error.
    Right,
    /// The answer is an expected refusal, with this reason.
    Refused(String),
    /// The tolerance was missed, or the time ran out, and the result says so. The stated limits hold.
    NotReached(String),
    /// The answer is wrong.
    Wrong(String),
    /// The user stopped the entry.
    Stopped,
}

impl Verdict {
    /// The reason, if there is one.
    pub fn reason(&self) -> Option<&str> {
        match self {
            Self::Right | Self::Stopped => None,
            Self::Refused(reason) | Self::NotReached(reason) | Self::Wrong(reason) => Some(reason),
        }
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Right => "right",
            Self::Refused(_) => "refused",
            Self::NotReached(_) => "not reached",
            Self::Wrong(_) => "WRONG",
            Self::Stopped => "stopped",
        })
    }
}

/// Judges the answers to an entry; the claims are the numbers to show.
pub(super) fn judge(
    expect: Expect,
    answers: Vec<Answer>,
    claims: &dyn Fn(&[Outcome]) -> Claims,
) -> (Verdict, Vec<Claim>) {
    let mut outcomes = Vec::new();
    for answer in answers {
        match answer {
            Answer::Run(outcome, allowed) => {
                if let Some(flaw) = outcome.steps.iter().find_map(|step| flaw(step, allowed)) {
                    return (Verdict::Wrong(flaw), Vec::new());
                }
                outcomes.push(*outcome);
            }
            Answer::Refused(reason) => return (refusal(expect, reason), Vec::new()),
            Answer::TooLong(limit) => {
                let reason = format!("not done within {} s", limit.as_secs_f64());
                return (Verdict::NotReached(reason), Vec::new());
            }
            Answer::Stopped => return (Verdict::Stopped, Vec::new()),
            Answer::Broken(reason) => return (Verdict::Wrong(reason), Vec::new()),
        }
    }
    let steps = || outcomes.iter().flat_map(|outcome| &outcome.steps);
    for step in steps() {
        if let Status::Failed(failure) = &step.row.status {
            let verdict = match failure.as_ref() {
                // There are no bounds then.
                StepFailure::Field(SolveError::NotConverged) => Verdict::NotReached(failure.to_string()),
                failure if failure.is_defect() => Verdict::Wrong(failure.to_string()),
                failure => refusal(expect, failure.to_string()),
            };
            return (verdict, Vec::new());
        }
    }
    let pressed = |step: &StepResult| matches!(step.load, StepLoad::Compression(_));
    let no_force = steps().find(|step| pressed(step) && step.row.force_n.is_none());
    if expect == Expect::Refusal && no_force.is_none() {
        return (Verdict::Wrong("a number where a refusal is expected".to_owned()), Vec::new());
    }
    if expect == Expect::Number && no_force.is_some() {
        return (Verdict::Wrong("no force where one is expected".to_owned()), Vec::new());
    }
    let claims = match claims(&outcomes) {
        Ok(claims) => claims,
        Err(missing) => return (Verdict::Wrong(missing.to_string()), Vec::new()),
    };
    if let Some(at) = claims.iter().position(|claim| !claim.holds()) {
        let wrong = claims[at].clone();
        let reason = format!(
            "{}: stated {:.9e} in [{:.9e}, {:.9e}], truth in [{:.9e}, {:.9e}]",
            wrong.what, wrong.value, wrong.lower, wrong.upper, wrong.truth.low, wrong.truth.high
        );
        return (Verdict::Wrong(reason), vec![wrong]);
    }
    let reason = |step: &StepResult| {
        step.reason.as_ref().map_or_else(|| "no reason was given".to_owned(), ToString::to_string)
    };
    let first_with = |wanted: fn(&Status) -> bool| steps().find(|step| wanted(&step.row.status));
    let not_reached = first_with(|status| matches!(status, Status::ToleranceNotReached(_)));
    let verdict = match (not_reached, first_with(|status| *status == Status::BeyondForceLimit)) {
        (Some(step), _) => Verdict::NotReached(reason(step)),
        (None, Some(step)) => Verdict::Refused(reason(step)),
        (None, None) => match steps().find(|step| !step.row.status.is_ok()) {
            Some(step) => Verdict::Wrong(format!("the status is `{}`", step.row.status)),
            None if no_force.is_some() => Verdict::Wrong("ok without a force".to_owned()),
            None => Verdict::Right,
        },
    };
    (verdict, claims)
}

fn refusal(expect: Expect, reason: String) -> Verdict {
    match expect {
        Expect::Refusal if !reason.is_empty() => Verdict::Refused(reason),
        Expect::Refusal | Expect::Number => Verdict::Wrong(format!("refused: {reason}")),
    }
}

/// A flaw that no step may have, whatever the truth; `None` if the step has none.
fn flaw(step: &StepResult, allowed: f64) -> Option<String> {
    let numbers = step.row.numbers();
    if let Some(bad) = numbers.iter().flatten().find(|number| !number.is_finite()) {
        return Some(format!("a number of the row is {bad}"));
    }
    if step.row.force_n.is_some_and(|force| force < 0.0) {
        return Some("the force is negative".to_owned());
    }
    let error = step.measured.map_or(0.0, |c| c.relative_error());
    // The status says so where a small mutual capacitance is known less closely than the tolerance.
    let is_to_tolerance = step.row.status.is_ok() && step.row.status != Status::OkToDiagonal;
    if is_to_tolerance && error > allowed * (1.0 + 1e-9) {
        return Some(format!("ok with an error of {error:.1e}, where {allowed:.1e} was asked for"));
    }
    let entries = step.maxwell.iter().flatten().flatten().chain(&step.measured);
    let sound =
        |c: &Bounded| c.lower.is_finite() && c.upper.is_finite() && (c.lower..=c.upper).contains(&c.value);
    if let Some(bad) = entries.into_iter().find(|c| !sound(c)) {
        return Some(format!("{:e} is not between {:e} and {:e}", bad.value, bad.lower, bad.upper));
    }
    None
}
