//! Why a field was not solved on the route that was meant for it.

use elastocap_electrostatics::{Shortfall, SolveError};
use serde::{Serialize, Serializer};

/// A change of the route of a step, with its reason. The text is a sentence for the user.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RouteChange {
    /// The solver for outlines could not take the curves.
    #[error("the outlines have polygons in place of curves: {0}")]
    Polygons(SolveError),
    /// The solver for outlines could not take the scene.
    #[error("the field is solved on tetrahedra in place of outlines pulled along an axis: {0}")]
    Tetrahedra(SolveError),
    /// The field could not be added to that of the scene without its indenter.
    #[error("the field is solved by itself, and not by what the indenter changes in that without it: {0}")]
    WithoutBase(NoBase),
    /// A change that an earlier run reported, in the words of its files.
    #[error("{0}")]
    Earlier(String),
}

/// Why no base serves for a step.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NoBase {
    /// The base was solved for another scene.
    #[error("what is there besides the indenter differs from the first step")]
    OtherScene,
    /// Nothing is measured without the indenter.
    #[error("nothing is measured without the indenter")]
    NotMeasured,
    /// The base itself, or what is added to it, misses the tolerance.
    #[error("that misses the tolerance")]
    Tolerance,
    /// The base itself, or what is added to it, misses the tolerance for a reason that is known.
    #[error("that misses the tolerance: {0}")]
    Shortfall(Shortfall),
    /// The base, or what is added to it, could not be solved.
    #[error(transparent)]
    Solve(#[from] SolveError),
}

/// Serialised as its text.
impl Serialize for RouteChange {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}
