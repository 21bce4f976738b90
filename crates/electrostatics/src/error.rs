//! Why a solve fails.

use crate::tets::flux::FluxError;
use crate::tets::potentials::{NotReached, PotentialError};

/// Why a solve failed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SolveError {
    /// The box solver was given a body of another shape.
    #[error(
        "`{body}` is neither a box nor a sheet, and the box solver takes no other shape; solve the scene on tetrahedra"
    )]
    NotBoxes {
        /// Name of the body.
        body: String,
    },
    /// The solver for extruded scenes was given bodies that are not outlines pulled along one axis.
    #[error("the bodies are not outlines pulled along one axis; solve the scene on tetrahedra")]
    NotExtruded,
    /// The outlines of an extruded scene have no mesh of a reasonable size.
    #[error(
        "the outlines cannot be divided into triangles: some of them are too close together or touch where they are round; solve the \
         scene on tetrahedra"
    )]
    NoPlan,
    /// A conductor of an extruded scene has a point in common with a grounded wall.
    #[error("{conductor} touches a grounded wall; keep them apart")]
    OnGround {
        /// Name of the conductor.
        conductor: String,
    },
    /// Two conductors of an extruded scene have a point in common.
    #[error("{first} and {second} touch or overlap; keep them apart")]
    Touching {
        /// Name of one conductor.
        first: String,
        /// Name of the other.
        second: String,
    },
    /// The first grid would take more memory than there is; nothing was solved.
    #[error(
        "even the coarsest grid takes about {}, more than the limit of {}: there are too many bodies for the memory, or too many \
         different faces",
        elastocap_linalg::memory::bytes_in_words(*bytes),
        elastocap_linalg::memory::bytes_in_words(*limit)
    )]
    TooLarge {
        /// Approximate memory of the grid, bytes.
        bytes: u64,
        /// The memory allowed, bytes.
        limit: u64,
    },
    /// The eigenvalue problem of a grid line failed.
    #[error(
        "an eigenvalue problem of the grid failed: its elements differ too much in size for double precision"
    )]
    Eigenvalues,
    /// The linear solver ended far from its goal, so that no bounds are given.
    #[error(
        "the iteration does not converge: sizes or permittivities are too unequal; bring the largest and the smallest permittivity, or \
         the largest and the smallest length, closer together"
    )]
    NotConverged,
    /// A scene that was to be solved as a base plus the changes by one body differs from the base by more.
    #[error("the scene differs from its base by more than a body and what is bent around it")]
    Superposition,
    /// The result contradicts itself, so that none of its numbers is reported; not expected.
    #[error(
        "the result contradicts itself, {0}: sizes or permittivities are too unequal for double precision, or there is an \
         error in elastocap; please report it with the case"
    )]
    Contradiction(String),
    /// A mirror plane does not say of every conductor of the scene which one of them is its image.
    #[error(
        "the mirror plane across axis {axis} does not have an image for each of the {conductors} conductors"
    )]
    MirrorPlane {
        /// The axis, 0 to 2.
        axis: usize,
        /// Conductors of the whole scene.
        conductors: usize,
    },
    /// A map that bends a scene of boxes turns a part of space inside out.
    #[error("the map that bends the scene turns a part of space inside out")]
    InsideOut,
    /// A map that bends a scene of boxes moves points where it ends, away from the walls of the scene.
    #[error("the map that bends the scene is not continuous where it ends")]
    TornMap,
    /// Stopped on request: the caller has set the cancel flag of the settings.
    #[error("stopped on request")]
    Cancelled,
    /// A matrix of a grid line could not be factorised.
    #[error(transparent)]
    IllConditioned(#[from] elastocap_fem::mixed::IllConditioned),
    /// The potentials on a mesh could not be solved for.
    #[error(transparent)]
    Potentials(PotentialError),
    /// The linear solver ended too far from the potentials on a mesh for useful bounds.
    #[error(transparent)]
    NotReached(#[from] NotReached),
    /// The fluxes on a mesh could not be computed.
    #[error(transparent)]
    Flux(#[from] FluxError),
}

impl SolveError {
    /// Whether proved bounds contradict each other, which is an error for any input.
    pub fn is_contradiction(&self) -> bool {
        matches!(self, Self::Contradiction(_))
    }

    /// Whether the error is a limit of this solver and not of the scene, so that another solver may succeed.
    pub fn another_solver_may_serve(&self) -> bool {
        match self {
            Self::NotBoxes { .. }
            | Self::NotExtruded
            | Self::NoPlan
            | Self::TooLarge { .. }
            | Self::Eigenvalues
            | Self::IllConditioned(_)
            | Self::NotConverged
            | Self::Potentials(_)
            | Self::NotReached(_)
            | Self::Flux(_)
            | Self::Superposition
            | Self::InsideOut
            | Self::TornMap => true,
            Self::OnGround { .. }
            | Self::Touching { .. }
            | Self::Contradiction(_)
            | Self::MirrorPlane { .. }
            | Self::Cancelled => false,
        }
    }
}

impl From<PotentialError> for SolveError {
    fn from(error: PotentialError) -> Self {
        if error == PotentialError::Cancelled { Self::Cancelled } else { Self::Potentials(error) }
    }
}
