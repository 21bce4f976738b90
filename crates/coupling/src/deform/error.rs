//! Why a layer cannot be deformed as a case asks.

use elastocap_mechanics::MechanicsError;
use elastocap_mechanics::solid::model::ModelError;
use elastocap_mechanics::solid::newton::Stopped;
use elastocap_mechanics::solid::press::PressError;

/// Why a load step has no deformed layer. All values are SI.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DeformError {
    /// The closed form refuses the load.
    #[error(transparent)]
    ClosedForm(#[from] MechanicsError),
    /// The finite elements of the layer cannot be set up: no step has a deformed layer.
    #[error(transparent)]
    Setup(#[from] LayerSetupError),
    /// The finite elements have no mesh, or too large a one.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The finite elements did not get to the load.
    #[error(transparent)]
    Press(#[from] PressError),
    /// The shear length of the closed form is not known at the load.
    #[error(transparent)]
    ShearLength(#[from] ShearLengthError),
    /// The step is none of those that were solved.
    #[error("the step has no equilibrium")]
    NotSolved,
}

/// Why the finite elements of a case's layer cannot be set up.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LayerSetupError {
    /// The case lacks what they need; the case reader refuses such a file.
    #[error("the case has no {0}")]
    Missing(&'static str),
    /// A combination for which the finite elements have no contact condition.
    #[error("a punch with rounded corners that is held or that the layer sticks to is not supported")]
    RoundedAndBonded,
    /// The coarsest mesh has too many elements already.
    #[error("{0}; make [layer] and what presses it more alike in size")]
    TooManyElements(Box<ModelError>),
    /// A patch ends where the layer ends.
    #[error("{0}")]
    NoRoom(Box<ModelError>),
    /// The layer is so long that rounding takes its first elements for none.
    #[error(
        "the layer is {ratio:.0e} times as long as it is thick, and its finite elements are meant for {limit:.0e} at most; make \
         `half_length` in [layer] or `width` smaller"
    )]
    TooLong {
        /// Half its length or width over its thickness.
        ratio: f64,
        /// The largest such ratio.
        limit: f64,
    },
    /// In plane strain the electrodes end too near to the end of the layer.
    #[error(
        "the electrodes reach into the last thickness of the layer, or the outer half of a short one; make `half_length` in [layer] larger"
    )]
    ElectrodesNearEnd,
    /// In space the electrodes end too near to an edge of the layer.
    #[error(
        "the electrodes reach to {reach:.3e} m from the middle along x{}, and the elements beyond {room:.3e} m belong to the \
         layer's edge; make {key} larger",
        axis + 1
    )]
    ElectrodesNearEdge {
        /// Where they end, m from the middle.
        reach: f64,
        /// How far they may reach, m.
        room: f64,
        /// Along which axis, counted from 0.
        axis: usize,
        /// The key of the case file to make larger.
        key: &'static str,
    },
}

/// Largest half-length of a layer over its thickness.
const LONGEST: f64 = 1e5;

impl LayerSetupError {
    /// Refuses a layer whose longest half extent is too long for its thickness; a length that is not a number, too.
    pub(super) fn check_length(half_length: f64, thickness: f64) -> Result<(), Self> {
        let ratio = half_length / thickness;
        if ratio <= LONGEST { Ok(()) } else { Err(Self::TooLong { ratio, limit: LONGEST }) }
    }

    pub(super) fn too_large(error: ModelError) -> Self {
        Self::TooManyElements(Box::new(error))
    }
}

/// Why the shear length, L of equation (45) of the paper, is not known at a load.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ShearLengthError {
    /// The case has no closed-form layer.
    #[error("the case has no closed-form layer")]
    NoClosedForm,
    /// The layer's material is known to finite elements only.
    #[error("the layer's material has no closed form")]
    Material,
    /// The force is larger than at the last compression at which L was found.
    #[error(
        "the shear length is known up to a compression of {compression} only, where the force is {force:.4e} N{}",
        reason(stopped)
    )]
    Force {
        /// The last U/H.
        compression: f64,
        /// The force there, N.
        force: f64,
        /// Why the finite elements got no further.
        stopped: Option<Box<Stopped>>,
    },
    /// The finite elements did not get to the compression.
    #[error(
        "no shear length at a compression of {compression}: the finite elements got to {reached} only{}",
        reason(stopped)
    )]
    Compression {
        /// U/H of the step.
        compression: f64,
        /// The last U/H.
        reached: f64,
        /// Why they got no further.
        stopped: Option<Box<Stopped>>,
    },
}

fn reason(stopped: &Option<Box<Stopped>>) -> String {
    stopped.as_ref().map_or_else(String::new, |stopped| format!(": {stopped}"))
}
