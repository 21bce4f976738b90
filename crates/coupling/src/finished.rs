//! A finished step in the form in which it is serialized and read back.

use elastocap_electrostatics::{Bounded, Foresight};
use serde::{Deserialize, Serialize};

use crate::field_report::{FloatingConductor, SolverReport, StepSeconds};
use crate::route::Route;
use crate::row::Row;
use crate::status::{EntryStatus, Missed};

/// The results of a step's field solve. The layer and the bodies are not included: they follow quickly from
/// the case, or are solved for all steps together.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FinishedStep {
    /// The index of the step in the plan.
    pub index: usize,
    pub(crate) row: Row,
    pub(crate) how: How,
    pub(crate) reason: Option<String>,
    pub(crate) warnings: Vec<String>,
    pub(crate) route: Option<Route>,
    #[serde(default)]
    pub(crate) route_changes: Vec<String>,
    pub(crate) maxwell: Vec<Vec<Bounded>>,
    pub(crate) entry_status: Option<Vec<Vec<EntryStatus>>>,
    pub(crate) floating: Vec<FloatingConductor>,
    pub(crate) measured: Option<Bounded>,
    pub(crate) two_terminal: Option<Bounded>,
    pub(crate) solver: SolverReport,
    pub(crate) foresight: Option<Foresight>,
    pub(crate) seconds: StepSeconds,
}

/// The status of a finished step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum How {
    Ok,
    OkToDiagonal,
    ToleranceNotReached(Missed),
    BeyondForceLimit,
}
