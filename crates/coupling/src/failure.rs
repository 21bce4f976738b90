//! The reasons that a load step has no result.

use std::any::Any;

use elastocap_electrostatics::SolveError;
use elastocap_geometry::meshing::tets::{LayeredError, MeshError};
use serde::{Serialize, Serializer};

use crate::deform::DeformError;
use crate::route::RouteError;
use crate::scene::SceneError;

/// The reason that a load step failed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StepFailure {
    /// The layer cannot be deformed under this load.
    #[error(transparent)]
    Layer(#[from] DeformError),
    /// The deformed bodies do not fit together.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// No field solver takes the scene.
    #[error(transparent)]
    Route(#[from] RouteError),
    /// The layer has no outline.
    #[error(transparent)]
    Outline(#[from] SurfaceCrossesItself),
    /// The scene cannot be meshed.
    #[error(transparent)]
    Tetrahedra(#[from] TetrahedraError),
    /// The field cannot be solved.
    #[error(transparent)]
    Field(SolveError),
    /// No map from boxes to the bent bodies exists.
    #[error(
        "no map takes boxes to the layer, the indenter and the other bodies as they are bent: the layer is bent too far, or its finite \
         elements are too coarse where it touches the indenter"
    )]
    NoMap,
    /// All flux of the conductors is blocked: they carry no charge at any potential.
    #[error("there is nothing to hold charge against: the capacitance is zero")]
    ZeroCapacitance,
    /// Bounds and value contradict each other: a defect.
    #[error("the solver's bounds do not enclose its value")]
    BoundsExcludeValue,
    /// A grid was requested, but the step is solved on a mesh.
    #[error("bodies of any shape are meshed as they are solved: `elastocap run` writes their mesh")]
    NoGrid,
    /// The program panicked: a defect.
    #[error("a defect of elastocap, please report it with the case file: {0}")]
    Defect(String),
}

impl StepFailure {
    /// Whether the program is at fault rather than its input: it panicked, or proved bounds contradict each
    /// other.
    pub fn is_defect(&self) -> bool {
        match self {
            Self::BoundsExcludeValue | Self::Defect(_) => true,
            Self::Field(error) | Self::Tetrahedra(TetrahedraError::Field(error)) => error.is_contradiction(),
            Self::Layer(_)
            | Self::Scene(_)
            | Self::Route(_)
            | Self::Outline(_)
            | Self::Tetrahedra(_)
            | Self::NoMap
            | Self::ZeroCapacitance
            | Self::NoGrid => false,
        }
    }
}

/// Serialised as its message.
impl Serialize for StepFailure {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// The surface of the finite-element layer crosses itself in a loop too large to be cut out.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error(
    "the surface of the layer crosses itself at x1 = {x1:.2e} m, x2 = {x2:.2e} m: its finite elements are too coarse there, \
     so that the field around it is not solved"
)]
pub struct SurfaceCrossesItself {
    /// The coordinate x1 of the crossing, m.
    pub x1: f64,
    /// The coordinate x2 of the crossing, m.
    pub x2: f64,
}

/// The reason that a scene cannot be solved on tetrahedra.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TetrahedraError {
    /// Two balls, or a ball and the shell around it, have no gap between them.
    #[error("the conductors `{first}` and `{second}` touch or cross")]
    Touching {
        /// The name of one conductor.
        first: String,
        /// The name of the other conductor.
        second: String,
    },
    /// A conductor has no face in the mesh.
    #[error(
        "the conductor `{conductor}` has no surface in the space that is solved: it lies in another conductor or outside \
         the walls"
    )]
    NoSurface {
        /// The name of the conductor.
        conductor: String,
    },
    /// The scene cannot be meshed.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The scene cannot be meshed in layers.
    #[error(transparent)]
    Layered(#[from] LayeredError),
    /// A first, small mesh cannot be solved.
    #[error(transparent)]
    Field(#[from] SolveError),
}

/// The message of a panic, which is a defect of the program.
pub fn panic_message(defect: &(dyn Any + Send)) -> &str {
    let message = defect.downcast_ref::<String>().map(String::as_str);
    message.or_else(|| defect.downcast_ref::<&str>().copied()).unwrap_or("no message")
}

/// The reason that a step ended early.
#[derive(Debug)]
pub enum Stop {
    /// The run was stopped on request.
    Cancelled,
    /// The step cannot be solved, for this reason.
    Failed(Box<StepFailure>),
}

impl<E: Into<StepFailure>> From<E> for Stop {
    fn from(error: E) -> Self {
        Self::Failed(Box::new(error.into()))
    }
}

impl From<SolveError> for Stop {
    fn from(error: SolveError) -> Self {
        match error {
            SolveError::Cancelled => Self::Cancelled,
            error => Self::Failed(Box::new(StepFailure::Field(error))),
        }
    }
}
