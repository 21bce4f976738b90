//! One line of the study.

use elastocap_coupling::failure::StepFailure;
use elastocap_electrostatics::{Bounded, ResolutionLevel};

/// The kind of error that a line has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// Both bounds proved: the certified error is half of their spread.
    Bounds,
    /// The upper bound alone, with an error estimate (`bounds = false`).
    Estimate,
    /// The parallel-plate formula.
    ParallelPlates,
}

impl Kind {
    pub(super) fn of(bounds: bool) -> Self {
        if bounds { Self::Bounds } else { Self::Estimate }
    }

    /// As in the table.
    pub fn name(self) -> &'static str {
        match self {
            Self::Bounds => "bounds",
            Self::Estimate => "estimate",
            Self::ParallelPlates => "parallel_plates",
        }
    }
}

/// Who chose the grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Choice {
    /// The study: order and layers are given.
    Table,
    /// The solver, from the tolerance; its time includes the grids it tried on the way.
    Own,
}

/// One solve, or why there is none.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// The kind of error that it has.
    pub kind: Kind,
    /// Who chose the grid.
    pub choice: Choice,
    /// The tolerance asked for. For a given grid, the tolerance that its outer reach and its iterations are set for.
    pub tolerance: Option<f64>,
    /// The result, or the reason why there is none.
    pub outcome: Result<Found, Missing>,
}

/// The result of a solve.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// The order and the layers of the grid; of the last one, if there were several.
    pub level: Option<ResolutionLevel>,
    /// The number of unknowns of the largest problem.
    pub unknowns: Option<usize>,
    /// Wall-clock seconds, the least of all repeats.
    pub seconds: f64,
    /// How often the solve was timed.
    pub repeats: usize,
    /// The capacitance, F, with bounds or an error estimate; bare for parallel plates.
    pub value: Bounded,
    /// The error that the solver compares with the tolerance: a spread or an estimate, of the whole Maxwell matrix where the case asks for it.
    pub reported_error: f64,
}

/// Why a line has no numbers.
#[derive(Debug, Clone, PartialEq)]
pub enum Missing {
    /// It would take too long; with the seconds expected.
    LeftOut(f64),
    /// The study was stopped before.
    NotRun,
    /// It cannot be solved.
    Failed(Box<StepFailure>),
}

impl Run {
    /// The result, if there is one.
    pub fn found(&self) -> Option<&Found> {
        self.outcome.as_ref().ok()
    }

    /// Whether it is known to meet a tolerance.
    pub fn meets(&self, tolerance: f64) -> bool {
        self.found().is_some_and(|found| found.reported_error <= tolerance)
    }

    /// `ok`, `tolerance not reached`, or why there is nothing.
    pub fn status(&self) -> String {
        match (&self.outcome, self.tolerance) {
            (Ok(found), Some(tolerance)) if found.reported_error > tolerance => {
                "tolerance not reached".to_owned()
            }
            (Ok(_), _) => "ok".to_owned(),
            (Err(Missing::LeftOut(seconds)), _) => format!("left out: about {seconds:.1} s"),
            (Err(Missing::NotRun), _) => "not run".to_owned(),
            (Err(Missing::Failed(reason)), _) => format!("failed: {reason}"),
        }
    }

    pub(super) fn measured(
        kind: Kind,
        choice: Choice,
        tolerance: f64,
        measured: super::subject::Measured,
    ) -> Self {
        let super::subject::Measured { seconds, value, reported_error, level, unknowns } = measured;
        let unknowns = Some(unknowns);
        let found = Found { level, unknowns, seconds, repeats: 1, value, reported_error };
        Self { kind, choice, tolerance: Some(tolerance), outcome: Ok(found) }
    }

    pub(super) fn missing(kind: Kind, choice: Choice, tolerance: f64, why: Missing) -> Self {
        Self { kind, choice, tolerance: Some(tolerance), outcome: Err(why) }
    }
}
