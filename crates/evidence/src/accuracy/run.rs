//! One run of the study.

use elastocap_coupling::failure::StepFailure;
use elastocap_electrostatics::{Bounded, ResolutionLevel};

/// The kind of error of a run.
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

    /// The name in the table.
    pub fn name(self) -> &'static str {
        match self {
            Self::Bounds => "bounds",
            Self::Estimate => "estimate",
            Self::ParallelPlates => "parallel_plates",
        }
    }
}

/// The origin of the grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Choice {
    /// A grid of the study, with given order and layers.
    Table,
    /// The solver's choice from the tolerance; its time includes the grids tried before.
    Own,
}

/// One solve, or the reason why there is none.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// The kind of error.
    pub kind: Kind,
    /// The origin of the grid.
    pub choice: Choice,
    /// The requested tolerance. For a given grid it sets the distance to the outer boundary and the accuracy
    /// of the iterations.
    pub tolerance: Option<f64>,
    /// The result, or the reason why there is none.
    pub outcome: Result<Solved, Missing>,
}

/// The result of a solve.
#[derive(Debug, Clone, PartialEq)]
pub struct Solved {
    /// The order and the layers of the grid; of the last grid, if there were several.
    pub level: Option<ResolutionLevel>,
    /// The number of unknowns of the largest problem.
    pub unknowns: Option<usize>,
    /// Wall-clock seconds, the least of all repeats.
    pub seconds: f64,
    /// The number of timed solves.
    pub repeats: usize,
    /// The capacitance, F, with bounds or an error estimate; without errors for parallel plates.
    pub value: Bounded,
    /// The error that the solver compares with the tolerance: a spread or an estimate, of the whole Maxwell
    /// matrix if the case measures it.
    pub reported_error: f64,
}

/// The reason why a run has no numbers.
#[derive(Debug, Clone, PartialEq)]
pub enum Missing {
    /// It would take too long, with the expected seconds.
    LeftOut(f64),
    /// The study was stopped before.
    NotRun,
    /// The solve failed.
    Failed(Box<StepFailure>),
}

impl Run {
    /// The result, if there is one.
    pub fn found(&self) -> Option<&Solved> {
        self.outcome.as_ref().ok()
    }

    /// Whether the run is known to meet a tolerance.
    pub fn meets(&self, tolerance: f64) -> bool {
        self.found().is_some_and(|found| found.reported_error <= tolerance)
    }

    /// `ok`, `tolerance not reached`, or the reason why there is no result.
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
        let found = Solved { level, unknowns, seconds, repeats: 1, value, reported_error };
        Self { kind, choice, tolerance: Some(tolerance), outcome: Ok(found) }
    }

    pub(super) fn missing(kind: Kind, choice: Choice, tolerance: f64, why: Missing) -> Self {
        Self { kind, choice, tolerance: Some(tolerance), outcome: Err(why) }
    }
}
