//! The result of a run: one row per load step, and the matrices, scenes and reports behind it.

use elastocap_case::Measurement;
use elastocap_electrostatics::{Bounded, Discretisation, Foresight};
use elastocap_geometry::export::surfaces::SurfaceBody;

use crate::deform::{FiniteElementStep, ForceCheck, MeshReport};
use crate::finished::{FinishedStep, How};
use crate::load_steps::StepLoad;
use crate::plan::{Kind, Plan};
use crate::reason::{Cause, Reason};
use crate::route::Route;
use crate::route_change::RouteChange;
use crate::scene::DeformedScene;

pub use crate::field_report::{FloatingConductor, SolverReport, StepSeconds};
pub use crate::row::Row;
pub use crate::status::{EntryStatus, Missed, Status};

/// All results of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// The plan of the run.
    pub plan: Plan,
    /// Warnings that concern the whole run.
    pub warnings: Vec<String>,
    /// The steps of the plan, in its order.
    pub steps: Vec<StepResult>,
    /// Names of the driven terminals, in the order of the Maxwell matrices.
    pub conductors: Vec<String>,
    /// The capacitance that is measured, by these names; `None` without conductors.
    pub measurement: Option<Measurement>,
    /// The meshes of the layer's finite elements, coarse to fine; empty without them.
    pub layer_meshes: Vec<MeshReport>,
    /// Wall-clock seconds of the layer's finite elements, all steps together.
    pub layer_seconds: f64,
    /// Whether the run was stopped on request before all steps were done.
    pub stopped: bool,
    /// Wall-clock seconds of all steps together.
    pub solve_seconds: f64,
    /// Number of threads.
    pub threads: usize,
}

impl Outcome {
    /// Whether every step was solved to its tolerance, and nothing else was left when the run was stopped.
    pub fn is_complete(&self) -> bool {
        !self.stopped && self.steps.iter().all(|step| step.row.status.is_ok())
    }

    /// Whether the result is a curve: there is a load, or a pair of electrodes.
    pub fn has_curve(&self) -> bool {
        self.plan.kind != Kind::Capacitance || self.steps.iter().any(|s| s.row.gap_m.is_some())
    }
}

/// One load step.
#[derive(Debug, Clone, PartialEq)]
pub struct StepResult {
    /// The index of the step in the plan.
    pub index: usize,
    /// The load.
    pub load: StepLoad,
    /// The earlier step that this result is taken from.
    pub same_as: Option<usize>,
    /// The route that its field took; `None` if it was not solved or has none.
    pub route: Option<Route>,
    /// The reasons that this is not the planned route, if it is not.
    pub route_changes: Vec<RouteChange>,
    /// The row of curve.csv.
    pub row: Row,
    /// The reason that the step failed, missed its tolerance or has no force.
    pub reason: Option<Reason>,
    /// Whether the step was interrupted on request before it met its tolerance; its bounds are those at that
    /// time.
    pub interrupted: bool,
    /// Warnings about this step.
    pub warnings: Vec<String>,
    /// The report of the layer's finite elements, if it has any.
    pub layer: Option<FiniteElementStep>,
    /// The comparison of the closed form's force with finite elements, if there is one.
    pub force_check: Option<ForceCheck>,
    /// The deformed bodies, if they are boxes.
    pub scene: Option<DeformedScene>,
    /// The surfaces of bodies of any shape.
    pub surfaces: Vec<SurfaceBody>,
    /// The Maxwell capacitance matrix, F, in the order of the scene's driven conductors. If the step was
    /// solved again for its change at opposite potentials only, it is that of the first solve.
    pub maxwell: Option<Vec<Vec<Bounded>>>,
    /// The status of each entry of `maxwell`.
    pub entry_status: Option<Vec<Vec<EntryStatus>>>,
    /// Potentials of the floating conductors.
    pub floating: Vec<FloatingConductor>,
    /// The measured capacitance, F: [`Row::capacitance_f`] with its bounds.
    pub measured: Option<Bounded>,
    /// The capacitance of the only two terminals with equal and opposite charges, F, or of the only terminal
    /// against ground, where it meets the tolerance.
    pub two_terminal: Option<Bounded>,
    /// The number of the base that the field was added to, and the measured capacitance plus the error of
    /// this base, F. That error is the same for all steps on the same base, so that it cancels in differences
    /// of these values.
    pub with_error_of_base: Option<(usize, Bounded)>,
    /// How the field was solved.
    pub solver: Option<SolverReport>,
    /// The results from which a solve of the same step to another tolerance may start.
    pub foresight: Option<Foresight>,
    /// The result to the tolerance of the capacitance, where the case also asks for the change to a
    /// tolerance. An interrupted run continues from it.
    pub before_change: Option<Box<FinishedStep>>,
    /// Whether [`Row::mechanics_error_estimate`] follows from capacitances on coarser meshes of the layer,
    /// instead of distances in it.
    pub mechanics_by_capacitance: bool,
    /// The times of the phases of the step.
    pub seconds: StepSeconds,
}

impl FinishedStep {
    /// The result of a step that need not be solved again. `None` for a step that was interrupted or failed,
    /// whose bodies exist only on the mesh of its solve, or with a number that cannot be serialized.
    pub fn of(step: &StepResult) -> Option<Self> {
        if let (Some(before), None) = (&step.before_change, step.same_as) {
            return Some(Self::clone(before));
        }
        let how = match step.row.status {
            // The error of the model is computed again.
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
        let values = bounded.flat_map(|b| [b.value, b.lower, b.upper]).chain(numbers);
        let charges = step.floating.iter().map(|f| f.charge);
        if !values.chain(charges).chain([solver.repair_share]).all(f64::is_finite) {
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

    /// Adds the finished step to a `result` that has the layer and the bodies. Returns `false`, and adds
    /// nothing, if these differ from the finished step, which is then another step.
    pub(crate) fn add_to(self, result: &mut StepResult) -> bool {
        let is_same = |(now, before): (Option<f64>, Option<f64>)| {
            now.is_none_or(|now| before.is_some_and(|before| before.to_bits() == now.to_bits()))
        };
        if !result.row.numbers().into_iter().zip(self.row.numbers()).all(is_same) {
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
