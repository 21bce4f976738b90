//! The reasons that a step failed, missed a tolerance or has no force.

use std::fmt;

use elastocap_electrostatics::{Bounded, Shortfall};
use elastocap_mechanics::ForceLimit;
use serde::{Serialize, Serializer};

use crate::failure::StepFailure;
use crate::status::Missed;
use crate::words::FORCE_FORMULA;

/// The reason that a step failed, missed its tolerance or has no force: one or several causes, in reporting
/// order.
#[derive(Debug, Clone, PartialEq)]
pub struct Reason(Vec<Cause>);

/// A cause of an incomplete result of a step. The text is a sentence for the user.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Cause {
    /// The step failed.
    #[error(transparent)]
    Failure(Box<StepFailure>),
    /// The field solver did not reach its tolerance.
    #[error(transparent)]
    Field(Shortfall),
    /// The bounds are too far apart, for a reason that the solver does not give.
    #[error("the bounds are farther apart than asked for")]
    TooFarApart,
    /// All flux of the measured conductors is blocked.
    #[error("no flux leaves what is measured: it has no capacitance")]
    NoFlux,
    /// The layer may buckle.
    #[error("the equilibrium of the layer is unstable (its tangent has {negative_pivots} negative pivots)")]
    UnstableLayer {
        /// Negative pivots of the tangent.
        negative_pivots: usize,
    },
    /// The finest mesh of the layer is too coarse.
    #[error("the finest mesh of the layer leaves a relative error of {error:.1e}")]
    LayerMesh {
        /// Relative error of the force, an estimate.
        error: f64,
    },
    /// The error of the layer cannot be estimated.
    #[error("less than three meshes of the layer got to this load, so that its error is not known")]
    FewLayerMeshes,
    /// The finite elements of the layer leave too large an error in a quantity on which the capacitance
    /// depends.
    #[error(
        "the differences between the meshes of the layer leave a relative error of about {error:.1e} (an estimate) of {what}, where \
         {asked:.0e} was asked for"
    )]
    LayerDifferences {
        /// Relative error, an estimate.
        error: f64,
        /// The quantity that has this error.
        what: &'static str,
        /// The tolerance.
        asked: f64,
    },
    /// The polynomials of a map are too far from the bent bodies.
    #[error(
        "the polynomials that bend electrodes and layer leave a relative error of about {error:.0e} (an estimate), where {asked:.0e} was \
         asked for"
    )]
    Map {
        /// Relative error of the capacitance, an estimate.
        error: f64,
        /// The tolerance.
        asked: f64,
    },
    /// A map takes the surface of the layer as level far from the electrodes.
    #[error(
        "the field follows the surface of the layer beside the electrodes and takes it as level farther out, in open space, which leaves a \
         relative error of about {error:.0e} (an estimate), where {asked:.0e} was asked for; end the scene by walls, with `boundary` and \
         `side_margin`"
    )]
    LevelBeyond {
        /// Relative error of the capacitance, an estimate.
        error: f64,
        /// The tolerance.
        asked: f64,
    },
    /// A flat wall lies on the bent surface of the layer.
    #[error(
        "the layer's surface is bent, and the wall that lies on it is taken as flat, at the height under the indenter, which leaves a \
         relative error of about {error:.0e} (an estimate), where {asked:.0e} was asked for; put a medium on the layer, with \
         `above = {{ relative_permittivity = 1.0, thickness = .. }}`"
    )]
    FlatWall {
        /// Relative error of the capacitance, an estimate.
        error: f64,
        /// The tolerance.
        asked: f64,
    },
    /// The surface of the layer is not level where its finite elements end.
    #[error(
        "the layer's surface has not come back to its height where its finite elements end, at `half_length`, and goes on level from there, \
         which leaves a relative error of about {error:.0e} (an estimate), where {asked:.0e} was asked for; make `half_length` larger"
    )]
    SurfaceEnds {
        /// Relative error of the capacitance, an estimate.
        error: f64,
        /// The tolerance.
        asked: f64,
    },
    /// The shapes that represent curved or bent bodies are too far from them.
    #[error(
        "{instead} leave a relative error of about {error:.0e} (an estimate), with the bounds {together:.1e}, where {asked:.0e} was asked \
         for"
    )]
    Faces {
        /// The shapes that represent the bodies.
        instead: &'static str,
        /// Relative error of the capacitance, an estimate.
        error: f64,
        /// The sum of this error and the relative error of the bounds.
        together: f64,
        /// The tolerance.
        asked: f64,
    },
    /// The layer is compressed beyond the range of the formula for its force.
    #[error(
        "the force has its maximum of {:.4e} N at U/H = {:.4} by {FORCE_FORMULA}; beyond it the formula means nothing and no force is \
         given; the deformation and the capacitance are not affected",
        .0.force,
        .0.compression
    )]
    NoForce(ForceLimit),
    /// The first step has no capacitance, so that the change is unknown.
    #[error("the first step has no capacitance to change against")]
    NoFirstCapacitance,
    /// The change from the first step is not known to the tolerance.
    #[error(transparent)]
    Change(WideChange),
    /// An error outside the bounds is too large for the change from the first step.
    #[error(
        "{what} an error of about {error:.0e} F (an estimate) in a change of {change:.2e} F, where {asked:.0e} of it was asked for"
    )]
    ErrorOfChange {
        /// The source of the error.
        missed: Missed,
        /// The cause of the error, as the beginning of the sentence.
        what: &'static str,
        /// The error, F, an estimate.
        error: f64,
        /// The change, F.
        change: f64,
        /// The tolerance.
        asked: f64,
    },
    /// A reason from an earlier run, in the words of its result files.
    #[error("{text}")]
    Earlier {
        /// The error that was too large; `None` for a step without force.
        missed: Option<Missed>,
        /// The text of the earlier run.
        text: String,
    },
}

/// A change of capacitance that is not known to its tolerance.
#[derive(Debug, Clone, PartialEq)]
pub struct WideChange {
    /// The change, F.
    pub change: Bounded,
    /// The tolerance.
    pub asked: f64,
    /// The reason that it is not known better, if known.
    pub why: Option<Unsharpened>,
}

/// The reason that the field of a step was not solved to a smaller tolerance for its change.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Unsharpened {
    /// The run was stopped.
    #[error("the run was stopped before")]
    Stopped,
    /// The step, or the first one, did not reach the tolerance when it was solved again.
    #[error(transparent)]
    Solve(Reason),
    /// The step was not solved again, for an unknown reason.
    #[error("its field could not be solved again")]
    NotSolved,
}

impl Cause {
    /// The error that exceeds its tolerance; `None` where the step failed or only has no force.
    pub fn missed(&self) -> Option<Missed> {
        match self {
            Self::Failure(_) | Self::NoForce(_) => None,
            Self::Field(_) | Self::TooFarApart | Self::NoFlux => Some(Missed::Field),
            Self::UnstableLayer { .. }
            | Self::LayerMesh { .. }
            | Self::FewLayerMeshes
            | Self::LayerDifferences { .. } => Some(Missed::Mechanics),
            Self::Map { .. }
            | Self::LevelBeyond { .. }
            | Self::FlatWall { .. }
            | Self::SurfaceEnds { .. }
            | Self::Faces { .. } => Some(Missed::Geometry),
            Self::NoFirstCapacitance | Self::Change(_) => Some(Missed::Change),
            Self::ErrorOfChange { missed, .. } => Some(*missed),
            Self::Earlier { missed, .. } => *missed,
        }
    }
}

impl Reason {
    /// The reason of several causes; `None` without any.
    pub(crate) fn of(causes: Vec<Cause>) -> Option<Self> {
        (!causes.is_empty()).then_some(Self(causes))
    }

    /// The causes, in the order in which they are reported.
    pub fn causes(&self) -> &[Cause] {
        &self.0
    }

    /// Appends a cause.
    pub(crate) fn push(&mut self, cause: Cause) {
        self.0.push(cause);
    }
}

impl From<Cause> for Reason {
    fn from(cause: Cause) -> Self {
        Self(vec![cause])
    }
}

impl std::error::Error for Reason {}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (k, cause) in self.0.iter().enumerate() {
            write!(f, "{}{cause}", if k == 0 { "" } else { "; " })?;
        }
        Ok(())
    }
}

/// Serialised as its text.
impl Serialize for Reason {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl std::error::Error for WideChange {}

impl fmt::Display for WideChange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (Bounded { lower, upper, .. }, asked) = (self.change, self.asked);
        if self.change.holds_zero() {
            write!(
                f,
                "the change lies between {lower:e} F and {upper:e} F, and was to be known to {asked:.0e} of itself"
            )?;
        } else {
            let spread = self.change.spread_over_value();
            write!(f, "the change is known to {spread:.1e} of itself, where {asked:.0e} was asked for")?;
        }
        self.why.as_ref().map_or(Ok(()), |why| write!(f, ": {why}"))
    }
}
