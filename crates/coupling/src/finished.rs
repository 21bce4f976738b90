//! A step that was solved before, as it can be written down and read again.

use elastocap_electrostatics::{Bounded, Discretisation, Foresight};
use serde::{Deserialize, Serialize};

use crate::outcome::{
    EntryStatus, FloatingConductor, Missed, Row, SolverReport, Status, StepResult, StepSeconds,
};
use crate::reason::Cause;
use crate::route::Route;
use crate::route_change::RouteChange;

/// What the solution of a step's field gave. The layer and the bodies are not in it: they follow from the case in no time, or are
/// solved for all steps together.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FinishedStep {
    /// Position in the plan.
    pub index: usize,
    row: Row,
    how: How,
    reason: Option<String>,
    warnings: Vec<String>,
    route: Option<Route>,
    #[serde(default)]
    route_changes: Vec<String>,
    maxwell: Vec<Vec<Bounded>>,
    entry_status: Option<Vec<Vec<EntryStatus>>>,
    floating: Vec<FloatingConductor>,
    measured: Option<Bounded>,
    two_terminal: Option<Bounded>,
    solver: SolverReport,
    foresight: Option<Foresight>,
    seconds: StepSeconds,
}

/// How a finished step went.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
enum How {
    Ok,
    OkToDiagonal,
    ToleranceNotReached(Missed),
    BeyondForceLimit,
}

impl FinishedStep {
    /// A step that need not be solved again. `None` for one that was stopped or failed, whose bodies are known only on the mesh that it
    /// was solved on, or with a number that cannot be written down.
    pub fn of(step: &StepResult) -> Option<Self> {
        if let (Some(before), None) = (&step.before_change, step.same_as) {
            return Some(Self::clone(before));
        }
        let how = match step.row.status {
            // The error of the model is found anew.
            Status::Ok | Status::OkInModel => How::Ok,
            Status::OkToDiagonal => How::OkToDiagonal,
            Status::ToleranceNotReached(missed) if !step.interrupted => How::ToleranceNotReached(missed),
            Status::BeyondForceLimit => How::BeyondForceLimit,
            Status::ToleranceNotReached(_) | Status::Failed(_) | Status::Draft | Status::NotRun => {
                return None;
            }
        };
        let (solver, maxwell) = (step.solver.clone()?, step.maxwell.clone()?);
        let on_grid = matches!(solver.resolution, Discretisation::Grid(_)) && step.surfaces.is_empty();
        if !on_grid || step.same_as.is_some() {
            return None;
        }
        let potentials = step.floating.iter().flat_map(|f| f.per_volt.iter().chain([&f.from_charges]));
        let bounded =
            maxwell.iter().flatten().chain(potentials).chain(&step.measured).chain(&step.two_terminal);
        let numbers = step.row.numbers().into_iter().flatten();
        let all = bounded.flat_map(|b| [b.value, b.lower, b.upper]).chain(numbers);
        let charges = step.floating.iter().map(|f| f.charge);
        if !all.chain(charges).chain([solver.repair_share]).all(f64::is_finite) {
            return None;
        }
        Some(Self {
            index: step.index,
            row: step.row.clone(),
            how,
            reason: step.reason.as_ref().map(ToString::to_string),
            warnings: step.warnings.clone(),
            route: step.route,
            route_changes: step.route_changes.iter().map(ToString::to_string).collect(),
            maxwell,
            entry_status: step.entry_status.clone(),
            floating: step.floating.clone(),
            measured: step.measured,
            two_terminal: step.two_terminal,
            solver,
            foresight: step.foresight,
            seconds: step.seconds,
        })
    }

    /// Adds it to a `result` that has the layer and the bodies. `false`, and nothing is added, if what that says of them is not what it
    /// was: then it is another step.
    pub(crate) fn add_to(self, result: &mut StepResult) -> bool {
        let same = |(now, before): (Option<f64>, Option<f64>)| {
            now.is_none_or(|now| before.is_some_and(|before| before.to_bits() == now.to_bits()))
        };
        if !result.row.numbers().into_iter().zip(self.row.numbers()).all(same) {
            return false;
        }
        let missed = match self.how {
            How::ToleranceNotReached(missed) => Some(missed),
            How::Ok | How::OkToDiagonal | How::BeyondForceLimit => None,
        };
        let status = match self.how {
            How::Ok => Status::Ok,
            How::OkToDiagonal => Status::OkToDiagonal,
            How::ToleranceNotReached(missed) => Status::ToleranceNotReached(missed),
            How::BeyondForceLimit => Status::BeyondForceLimit,
        };
        result.row = Row { status, ..self.row };
        result.reason = self.reason.map(|text| Cause::Earlier { missed, text }.into());
        result.warnings = self.warnings;
        result.route = self.route;
        result.route_changes = self.route_changes.into_iter().map(RouteChange::Earlier).collect();
        result.maxwell = Some(self.maxwell);
        result.entry_status = self.entry_status;
        result.floating = self.floating;
        result.measured = self.measured;
        result.two_terminal = self.two_terminal;
        result.solver = Some(self.solver);
        result.foresight = self.foresight;
        result.seconds = self.seconds;
        true
    }
}
