//! Errors of the deformation of a layer.

use elastocap_mechanics::MechanicsError;
use elastocap_mechanics::solid::model::ModelError;
use elastocap_mechanics::solid::newton::Stopped;
use elastocap_mechanics::solid::press::PressError;

/// The reason that a load step has no deformed layer. All values are SI.
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
    /// The finite elements did not reach the load.
    #[error(transparent)]
    Press(#[from] PressError),
    /// The shear length of the closed form is not known at the load.
    #[error(transparent)]
    ShearLength(#[from] ShearLengthError),
    /// The step is not among the solved ones.
    #[error("the step has no equilibrium")]
    NotSolved,
}

/// The reason that the finite elements of a case's layer cannot be set up.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LayerSetupError {
    /// The case lacks a required item; the case reader refuses such a file.
    #[error("the case has no {0}")]
    Missing(&'static str),
    /// Even the coarsest mesh has too many elements.
    #[error("{0}; make [layer] and what presses it more alike in size")]
    TooManyElements(Box<ModelError>),
    /// A patch ends where the layer ends.
    #[error("{0}")]
    NoRoom(Box<ModelError>),
    /// The layer is so long that its first elements vanish by rounding.
    #[error(
        "the layer is {ratio:.0e} times as long as it is thick, and its finite elements are meant for {limit:.0e} at most; make \
         `half_length` in [layer] or `width` smaller"
    )]
    TooLong {
        /// Half the length or width of the layer over its thickness.
        ratio: f64,
        /// The largest such ratio.
        limit: f64,
    },
    /// In plane strain the electrodes extend too close to the end of the layer.
    #[error(
        "the electrodes reach into the last thickness of the layer, or the outer half of a short one; make `half_length` in [layer] larger"
    )]
    ElectrodesNearEnd,
    /// In three dimensions the electrodes extend too close to an edge of the layer.
    #[error(
        "the electrodes reach to {reach:.3e} m from the middle along x{}, and the elements beyond {room:.3e} m belong to the \
         layer's edge; make {key} larger",
        axis + 1
    )]
    ElectrodesNearEdge {
        /// The largest distance of the electrodes from the middle, m.
        reach: f64,
        /// The largest allowed distance, m.
        room: f64,
        /// The axis, counted from 0.
        axis: usize,
        /// The key of the case file to make larger.
        key: &'static str,
    },
}

/// Largest half-length of a layer over its thickness. Not tuned: a limit that ordinary cases do not reach.
const MAX_LENGTH: f64 = 1e5;

impl LayerSetupError {
    /// Refuses a layer whose larger half extent is too long for its thickness, or is not a number.
    pub(super) fn check_length(half_length: f64, thickness: f64) -> Result<(), Self> {
        let ratio = half_length / thickness;
        if ratio <= MAX_LENGTH { Ok(()) } else { Err(Self::TooLong { ratio, limit: MAX_LENGTH }) }
    }

    pub(super) fn too_large(error: ModelError) -> Self {
        Self::TooManyElements(Box::new(error))
    }
}

/// The reason that the shear length, L of equation (45) of the paper, is not known at a load.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ShearLengthError {
    /// The case has no closed-form layer.
    #[error("the case has no closed-form layer")]
    NoClosedForm,
    /// The layer's material has no closed form.
    #[error("the layer's material has no closed form")]
    Material,
    /// The force is larger than at the largest compression with a known L.
    #[error(
        "the shear length is known up to a compression of {compression} only, where the force is {force:.4e} N{}",
        reason(stopped)
    )]
    Force {
        /// The largest U/H with a known L.
        compression: f64,
        /// The force at this compression, N.
        force: f64,
        /// The reason that the finite elements stopped.
        stopped: Option<Box<Stopped>>,
    },
    /// The finite elements did not reach the compression.
    #[error(
        "no shear length at a compression of {compression}: the finite elements got to {reached} only{}",
        reason(stopped)
    )]
    Compression {
        /// U/H of the step.
        compression: f64,
        /// The largest U/H with a known L.
        reached: f64,
        /// The reason that the finite elements stopped.
        stopped: Option<Box<Stopped>>,
    },
}

fn reason(stopped: &Option<Box<Stopped>>) -> String {
    stopped.as_ref().map_or_else(String::new, |stopped| format!(": {stopped}"))
}
