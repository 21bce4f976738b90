//! Why a result has no model.

use elastocap_results::force_answer::CurveFileError;

use super::MOST_TERMINALS;

/// Why a result has no model, and what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ModelError {
    /// No result.
    #[error(transparent)]
    File(#[from] CurveFileError),
    /// A text that is no result.
    #[error("this is not the result.json of a run ({0})")]
    Json(#[from] serde_json::Error),
    /// Some steps were not run.
    #[error(
        "the run was stopped before its last step; complete it with `elastocap run CASE --resume`, and export the result of that"
    )]
    Stopped,
    /// One state.
    #[error("the result has no load: a model needs capacitances at several forces; give the case a `[load]`")]
    NoLoad,
    /// No conductors, or no measurement.
    #[error(
        "the result has no capacitances; give the case conductors or `[electrodes]`, and `[electrostatics]`"
    )]
    NoCapacitances,
    /// A step without result.
    #[error(
        "step {step} of the run has no result ({reason}); take its load out of `[load]` of the case, or change what made it fail, and run the \
         case again"
    )]
    FailedStep {
        /// Which.
        step: usize,
        /// In the words of the run.
        reason: String,
    },
    /// A step without force.
    #[error(
        "step {step} of the run has no force ({reason}); give the case `[mechanics]` that computes forces, or smaller loads where the force \
         of the closed form has its maximum"
    )]
    NoForce {
        /// Which.
        step: usize,
        /// In the words of the run.
        reason: String,
    },
    /// The load is not all that differs.
    #[error(
        "the load steps of the result also shift or tilt what is attached, so that the force does not tell the capacitance; run the case \
         with the same shift and tilt at all steps"
    )]
    Moved,
    /// Two states at one force.
    #[error(
        "the force does not grow from step {before} ({force_before} N) to step {after} ({force_after} N), although the compression does, so \
         that one force has two capacitances; end `[load]` of the case before the force has its maximum"
    )]
    ForceTurns {
        /// The step with less compression.
        before: usize,
        /// N.
        force_before: f64,
        /// The step with more.
        after: usize,
        /// N.
        force_after: f64,
    },
    /// No curve.
    #[error(
        "the result has {0} step with a force; a model needs two at least, of different forces: give `[load]` of the case more of them"
    )]
    TooFewSteps(usize),
    /// Two steps that are one.
    #[error(
        "steps {one} and {other} of the run have forces that differ by next to nothing; take one of them out of `[load]` of the case"
    )]
    TooClose {
        /// One of them.
        one: usize,
        /// The other.
        other: usize,
    },
    /// A capacitance turns.
    #[error(
        "the capacitance {name} grows with the force in one place and falls in another, around {force} N; add steps there and export with \
         --allow-turns, or run the loads of one side only"
    )]
    Turns {
        /// Which capacitance.
        name: String,
        /// Where, N.
        force: f64,
    },
    /// Not a capacitance.
    #[error(
        "the lower bound of the capacitance at step {step} is {lower:e} F, and a model must be passive within its bounds; give the case a \
         smaller `relative_tolerance`"
    )]
    NotPositive {
        /// Which step.
        step: usize,
        /// F.
        lower: f64,
    },
    /// Numbers that cannot be.
    #[error("step {0} of the result has a force, a capacitance or bounds that cannot be; run the case again")]
    Damaged(usize),
    /// No matrix in it.
    #[error(
        "step {0} of the result has no Maxwell matrix: the run measured one capacitance alone; take `[measure]` out of the case and run it, \
         or export without --matrix"
    )]
    NoMatrix(usize),
    /// Too large a network.
    #[error(
        "the result has {0} terminals, and a model has {MOST_TERMINALS} at most; join conductors by `[[terminal]]`, or name a pair in `[measure]`"
    )]
    TooManyTerminals(usize),
}
