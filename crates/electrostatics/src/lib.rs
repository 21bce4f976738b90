//! Electrostatic fields of conductors among dielectrics: Maxwell capacitance matrices with proved bounds.
//!
//! This crate solves Laplace's equation, div(eps grad u) = 0, around the conductors of a
//! [`Scene`](elastocap_geometry::scene::Scene). There are three solvers:
//!
//! * [`solve()`], the **box solver**, takes scenes of axis-aligned boxes and sheets. It chooses a
//!   tensor-product grid that is graded towards edges, with polynomials of high order, and uses the mirror
//!   symmetry of the scene.
//! * [`solve_extruded()`], the **solver for extruded scenes**, takes outlines that are pulled along one axis.
//!   It combines a graded mesh of triangles in the plan with a graded line along the axis, both with
//!   polynomials of high order.
//! * [`solve_mesh()`], the **solver on tetrahedra**, takes a mesh of bodies of any shape and refines it
//!   adaptively. The potentials are of order 1, 2 or 3.
//!
//! [`forecast()`], [`forecast_extruded()`] and [`forecast_mesh()`] estimate the memory and the time of a
//! solve from small grids or meshes. [`Potentials`] solves on one mesh as it is, without a lower bound.
//!
//! # What is proved
//!
//! All solvers compute a continuous potential and a flux without divergence. By Dirichlet's principle the
//! energy of the potential bounds the Maxwell matrix from above, by Thomson's principle that of the flux
//! bounds it from below (as quadratic forms). Neither bound depends on the convergence of the linear solver,
//! and open space is included without truncation: potential and flux continue to infinity along rays, or by
//! zero in extruded scenes that are closed across one axis and open along another. The bounds of entries, of
//! the two-terminal capacitance and of the potentials of floating conductors follow from these two matrices.
//! Rounding is not enclosed by interval arithmetic; it is estimated from above and counted, and bounds that
//! cross nevertheless are [`SolveError::Contradiction`]. Where a linear solver ends far from its goal there
//! are no bounds at all: [`SolveError::NotConverged`]. With [`Settings::bounds`] switched off, the box solver
//! skips the flux and the limits are estimates.
//!
//! # Units
//!
//! SI: lengths in m, capacitances in F, potentials in V, charges in C. Permittivities are relative, to
//! [`VACUUM_PERMITTIVITY`].
//!
//! # Example
//!
//! A cube of side 1 m in the middle of a grounded cube of side 2 m has the capacitance 19.127134997 m times
//! eps_0:
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
//! * The box solver takes neither rotated boxes nor other shapes. Its tensor-product grids refine whole
//!   slabs, so that scenes with many distinct planes become expensive.
//! * On tetrahedra, the bounds hold for the bodies as meshed, with flat faces; the faceting error of curved
//!   bodies is not in them. The field is not sampled for export there ([`Solution::field`] is `None`).
//! * Two conductors at different potentials must not touch.

mod bounded;
mod boxes;
mod consistency;
mod error;
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
mod vacuum;

pub use bounded::Bounded;
pub use boxes::forecast::{Effort, forecast, symmetries};
pub use boxes::scene_map::{MapAxis, Rounded, SceneMap};
pub use boxes::solve::{solve, solve_mapped, solve_superposed};
pub use boxes::solve_base::{Additions, solve_base};
pub use boxes::superposed::Base;
pub use error::{FluxError, NotReached, PotentialError, SolveError};
pub use extruded::search::ExtrudedSolution;
pub use extruded::solve::{extrusion_axis, forecast_extruded, has_few_edges, is_extruded, solve_extruded};
pub use shortfall::Shortfall;
pub use solution::{
    CellBody, Discretisation, Field, FieldSection, FloatingPotential, Forecast, Foresight, PhaseSeconds,
    ResolutionLevel, Settings, Solution,
};
pub use target::{SHARE_OF_DIAGONAL, Target};
pub use tets::adaptive::solve_mesh;
pub use tets::forecast::{forecast_mesh, forecast_without_mesh};
pub use tets::mesh_scene::{MeshScene, MeshSolution};
pub use tets::potentials::{PotentialProblem, PotentialSettings, Potentials};
pub use tets::settings::TetrahedraSettings;
pub use vacuum::VACUUM_PERMITTIVITY;
