//! Why a solve fails.

use std::sync::atomic::{AtomicBool, Ordering};

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

/// Why potentials on tetrahedra cannot be solved for.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum PotentialError {
    /// Orders other than 1, 2 and 3 are not implemented.
    #[error("potentials on tetrahedra are of order 1, 2 or 3, not {0}")]
    Order(usize),
    /// The functions cannot be numbered with 32 bits.
    #[error("the mesh has too many tetrahedra")]
    TooLarge,
    /// A boundary face of the mesh is not a face of any tetrahedron.
    #[error("a face of the mesh belongs to no tetrahedron")]
    Face,
    /// Two conductors, or a conductor and a grounded wall, meet at a face with these corners.
    #[error("two conductors, or a conductor and a grounded wall, meet at the face of points {0:?}")]
    HeldTwice([u32; 3]),
    /// A face on a conductor that does not exist.
    #[error("a face is on conductor {0}, which the scene does not have")]
    Conductor(u32),
    /// A region without permittivity.
    #[error("region {0} of the mesh has no permittivity")]
    Region(u32),
    /// A tetrahedron without volume.
    #[error("tetrahedron {0} has no volume")]
    Flat(usize),
    /// The centre of open space lies in the plane of a face to it.
    #[error("the face of points {0:?} to open space lies in one plane with the centre of the rays")]
    OpenFace([u32; 3]),
    /// Stopped on request: the caller has set [`crate::PotentialSettings::cancel`].
    #[error("stopped on request")]
    Cancelled,
}

/// Conjugate gradients ended short of the goal.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error(
    "the linear solver stopped after {iterations} steps with a relative error of about {left:e} in the energy"
)]
pub struct NotReached {
    /// Steps taken.
    pub iterations: usize,
    /// Estimate of the relative error of the energy.
    pub left: f64,
}

/// Why fluxes cannot be computed from a mesh, its permittivities and the gradients of a potential.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FluxError {
    /// Only orders 1, 2 and 3 are implemented.
    #[error("order {order} is not implemented; fluxes are of order 1, 2 or 3")]
    Order {
        /// The requested order.
        order: usize,
    },
    /// A list whose length does not fit the mesh.
    #[error("{what}: {found} given, {expected} needed")]
    Length {
        /// The contents of the list, in words.
        what: &'static str,
        /// How many entries were given.
        found: usize,
        /// How many entries are needed.
        expected: usize,
    },
    /// A permittivity that is not positive and finite.
    #[error("the permittivity of region {region} is {value}; it must be positive and finite")]
    Permittivity {
        /// Index of the region.
        region: usize,
        /// The permittivity.
        value: f64,
    },
    /// A tetrahedron without volume, or a gradient that is not a number.
    #[error("tetrahedron {tetrahedron} has no volume, or a gradient in it is not finite")]
    NotFinite {
        /// Index of the tetrahedron in the mesh.
        tetrahedron: usize,
    },
    /// More than two tetrahedra at a face.
    #[error("more than two tetrahedra meet at the face {face:?}")]
    NotConforming {
        /// Corners of the face.
        face: [u32; 3],
    },
    /// A face to open space must end the mesh, and see the centre of the mesh from inside.
    #[error(
        "the face {face:?} to open space does not end the mesh, or does not see the mesh's centre from inside"
    )]
    OpenFace {
        /// Corners of the face.
        face: [u32; 3],
    },
}

/// Ends a solve if a stop was requested. Solves ask after the assembly and after the iteration, since the
/// work that follows takes as long as several iterations.
pub(crate) fn stop_if_cancelled(cancel: Option<&AtomicBool>) -> Result<(), SolveError> {
    if cancel.is_some_and(|c| c.load(Ordering::Relaxed)) { Err(SolveError::Cancelled) } else { Ok(()) }
}
