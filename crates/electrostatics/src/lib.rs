//! Electrostatic fields of conductors among dielectrics: Maxwell capacitance matrices with proved bounds.
//!
//! This crate solves Laplace's equation, div(eps grad u) = 0, around the conductors of a
//! [`Scene`](elastocap_geometry::scene::Scene). There are two solvers:
//!
//! * [`solve()`], the **box solver**, takes scenes of axis-aligned boxes and sheets. It chooses a tensor-product grid that is graded
//!   towards edges, with polynomials of high order, and uses the mirror symmetry of the scene.
//! * [`solve_mesh()`], the **solver on tetrahedra**, takes a mesh of bodies of any shape and refines it adaptively. The potentials
//!   are of order 1, 2 or 3.
//!
//! [`forecast()`] and [`forecast_mesh()`] estimate the memory and the time of a solve from small grids or meshes. [`Potentials`]
//! solves on one mesh as it is, without a lower bound.
//!
//! # What is proved
//!
//! Both solvers compute a continuous potential and a flux without divergence. By Dirichlet's principle the energy of the potential
//! bounds the Maxwell matrix from above, by Thomson's principle that of the flux bounds it from below (as quadratic forms). Neither
//! bound depends on the convergence of the linear solver, and open space is included without truncation: potential and flux continue
//! to infinity along rays. The bounds of entries, of the two-terminal capacitance and of the potentials of floating conductors follow
//! from these two matrices. Rounding is not enclosed by interval arithmetic; it is estimated from above and counted, and bounds that
//! cross nevertheless are [`SolveError::Contradiction`]. Where a linear solver ends far from its goal there are no bounds at all:
//! [`SolveError::NotConverged`].
//! With [`Settings::bounds`] switched off, the box solver skips the flux and the limits are estimates.
//!
//! # Units
//!
//! SI: lengths in m, capacitances in F, potentials in V, charges in C. Permittivities are relative, to [`VACUUM_PERMITTIVITY`].
//!
//! # Example
//!
//! A cube of side 1 m in the middle of a grounded cube of side 2 m has the capacitance 19.127134997 m times eps_0:
//!
//! ```
//! use elastocap_electrostatics::{Settings, VACUUM_PERMITTIVITY, solve};
//! use elastocap_geometry::scene::{Body, Box3, Scene, Wall};
//! use elastocap_geometry::shapes::Shape;
//!
//! let cube = |half: f64| Box3 { min: [-half; 3], max: [half; 3] };
//! let scene = Scene {
//!     bodies: vec![Body::conductor("inner", Shape::Box(cube(0.5)))],
//!     background_permittivity: 1.0,
//!     domain: cube(1.0),
//!     walls: [[Wall::Grounded; 2]; 3],
//! };
//! let settings = Settings { relative_tolerance: 1e-2, ..Settings::default() };
//! let solution = solve(&scene, &settings)?;
//! let c = solution.maxwell[0][0];
//! let exact = 19.127134997 * VACUUM_PERMITTIVITY;
//! assert!(solution.reached);
//! assert!(c.lower <= exact && exact <= c.upper);
//! assert!(c.upper - c.lower <= 1e-2 * c.value);
//! # Ok::<(), elastocap_electrostatics::SolveError>(())
//! ```
//!
//! # Current limits
//!
//! * Permittivities are isotropic and constant within a body.
//! * The box solver takes neither rotated boxes nor other shapes. Its tensor-product grids refine whole slabs, so that scenes with
//!   many distinct planes become expensive.
//! * On tetrahedra, the bounds hold for the bodies as meshed, with flat faces; the faceting error of curved bodies is not in them.
//!   The field is not sampled for export there ([`Solution::field`] is `None`).
//! * Two conductors at different potentials must not touch.

mod bounded;
mod boxes;
mod consistency;
mod extruded;
mod far;
mod floating;
mod matrix;
mod parity;
mod projection;
mod shortfall;
mod solution;
mod target;
mod tets;

pub use bounded::Bounded;
pub use boxes::forecast::{Effort, forecast, symmetries};
pub use boxes::mapped::map::{MapAxis, Rounded, SceneMap};
pub use boxes::solve::{solve, solve_mapped, solve_superposed};
pub use boxes::superposed::{Additions, Base, solve_base};
pub use extruded::search::ExtrudedSolution;
pub use extruded::solve::{extrusion_axis, forecast_extruded, has_few_edges, is_extruded, solve_extruded};
pub use shortfall::Shortfall;
pub use solution::{
    CellBody, Discretisation, Field, FieldSection, FloatingPotential, Forecast, Foresight, PhaseSeconds,
    ResolutionLevel, Settings, Solution,
};
pub use target::{SHARE_OF_DIAGONAL, Target};
pub use tets::adaptive::solve_mesh;
pub use tets::flux::FluxError;
pub use tets::forecast::{forecast_mesh, forecast_without_mesh};
pub use tets::mesh_scene::{MeshScene, MeshSolution};
pub use tets::potentials::{NotReached, PotentialError, PotentialProblem, PotentialSettings, Potentials};
pub use tets::settings::TetrahedraSettings;

/// Permittivity of vacuum, eps_0, F/m (CODATA 2018): the only definition of it in the project.
pub const VACUUM_PERMITTIVITY: f64 = 8.854_187_812_8e-12;

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
        /// Its name.
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
        /// Bytes it would take, about.
        bytes: u64,
        /// Bytes that may be taken.
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
    /// A scene was to be solved as a base and what a body changes there, and differs from the base by more.
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
        /// 0 to 2.
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
    Potentials(tets::potentials::PotentialError),
    /// The linear solver ended too far from the potentials on a mesh for useful bounds.
    #[error(transparent)]
    NotReached(#[from] tets::potentials::NotReached),
    /// The fluxes on a mesh could not be made.
    #[error(transparent)]
    Flux(#[from] tets::flux::FluxError),
}

impl SolveError {
    /// Whether proved bounds contradict each other, which no input excuses.
    pub fn is_contradiction(&self) -> bool {
        matches!(self, Self::Contradiction(_))
    }

    /// Whether nothing is wrong with the scene but that this solver cannot take it: another one may.
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

impl From<tets::potentials::PotentialError> for SolveError {
    fn from(error: tets::potentials::PotentialError) -> Self {
        if error == tets::potentials::PotentialError::Cancelled {
            Self::Cancelled
        } else {
            Self::Potentials(error)
        }
    }
}
