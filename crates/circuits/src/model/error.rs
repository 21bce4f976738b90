//! Errors of making a model.

use elastocap_results::force_answer::CurveFileError;

use super::MOST_TERMINALS;

/// The reason why a result has no model, with a remedy.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ModelError {
    /// The result cannot be read.
    #[error(transparent)]
    File(#[from] CurveFileError),
    /// The text is not the `result.json` of a run.
    #[error("this is not the result.json of a run ({0})")]
    Json(String),
    /// The run was stopped before its last step.
    #[error(
        "the run was stopped before its last step; complete it with `elastocap run CASE --resume`, and export the result of that"
    )]
    Stopped,
    /// The sensor was solved in one state only.
    #[error("the result has no load: a model needs capacitances at several forces; give the case a `[load]`")]
    NoLoad,
    /// The result has no conductors, or no measurement.
    #[error(
        "the result has no capacitances; give the case conductors or `[electrodes]`, and `[electrostatics]`"
    )]
    NoCapacitances,
    /// A step has no capacitance.
    #[error(
        "step {step} of the run has no result ({reason}); take its load out of `[load]` of the case, or change what made it fail, and run the \
         case again"
    )]
    FailedStep {
        /// The step.
        step: usize,
        /// The reason, in the words of the run.
        reason: String,
    },
    /// A step has no force.
    #[error(
        "step {step} of the run has no force ({reason}); give the case `[mechanics]` that computes forces, or smaller loads where the force \
         of the closed form has its maximum"
    )]
    NoForce {
        /// The step.
        step: usize,
        /// The reason, in the words of the run.
        reason: String,
    },
    /// The steps differ in more than their load.
    #[error(
        "the load steps of the result also shift or tilt what is attached, so that the force does not tell the capacitance; run the case \
         with the same shift and tilt at all steps"
    )]
    Moved,
    /// One force has two states.
    #[error(
        "the force does not grow from step {before} ({force_before} N) to step {after} ({force_after} N), although the compression does, so \
         that one force has two capacitances; end `[load]` of the case before the force has its maximum"
    )]
    ForceTurns {
        /// The step with less compression.
        before: usize,
        /// The force at that step, N.
        force_before: f64,
        /// The step with more compression.
        after: usize,
        /// The force at that step, N.
        force_after: f64,
    },
    /// There are too few forces for a curve.
    #[error(
        "the number of load steps with a force is {0}, and a model needs at least two, with different forces; give the case a `[load]` with more of them"
    )]
    TooFewSteps(usize),
    /// Two steps have nearly the same force.
    #[error(
        "steps {one} and {other} of the run have nearly the same force; take one of them out of `[load]` of the case"
    )]
    TooClose {
        /// One of the two steps.
        one: usize,
        /// The other step.
        other: usize,
    },
    /// A capacitance grows with the force in one place and falls in another.
    #[error(
        "the capacitance {name} grows with the force in one place and falls in another, around {force} N; add steps there and export with \
         --allow-turns, or run the loads of one side only"
    )]
    Turns {
        /// The name of the capacitance.
        name: String,
        /// The force of the turn, N.
        force: f64,
    },
    /// The lower bound of a capacitance is not positive.
    #[error(
        "the lower bound of the capacitance at step {step} is {lower:e} F, and a model must be passive within its bounds; give the case a \
         smaller `relative_tolerance`"
    )]
    NotPositive {
        /// The step.
        step: usize,
        /// The lower bound, F.
        lower: f64,
    },
    /// The numbers of a step are impossible.
    #[error("step {0} of the result has an impossible force, capacitance or bounds; run the case again")]
    Damaged(usize),
    /// The result has no matrix.
    #[error(
        "step {0} of the result has no Maxwell matrix: the run measured one capacitance alone; take `[measure]` out of the case and run it, \
         or export without --matrix"
    )]
    NoMatrix(usize),
    /// The network is too large.
    #[error(
        "the result has {0} terminals, and a model has at most {MOST_TERMINALS}; join conductors by `[[terminal]]`, or name a pair in `[measure]`"
    )]
    TooManyTerminals(usize),
}
