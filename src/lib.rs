//! Computes the capacitance of soft touch and pressure sensors under load, with proved bounds.
//!
//! This crate is the library behind the `elastocap` command. A case describes an elastomer layer, the
//! electrodes in it, the surroundings and the load. The library deforms the layer, moves the electrodes,
//! solves Laplace's equation in 3D around them, and returns the capacitance of each load step with a proved
//! lower and upper bound. Solving writes no file: matrices, fields and meshes are values in memory.
//!
//! # Example
//!
//! A unit cube in the middle of a grounded cube twice its size, to one per cent. Its capacitance is known:
//! 169.35524558 pF. The observer takes the field of each step as soon as it is solved.
//!
//! ```
//! use std::ops::ControlFlow;
//! use std::sync::{Arc, Mutex};
//!
//! use elastocap::coupling::outcome::StepResult;
//! use elastocap::coupling::plan::{Options, Plan};
//! use elastocap::coupling::run::{Observer, run};
//! use elastocap::coupling::step::StepField;
//!
//! const CASE: &str = r#"
//!     format = 1
//!
//!     [[conductor]]
//!     name = "inner"
//!     box  = { min = ["-0.5 m", "-0.5 m", "-0.5 m"], max = ["0.5 m", "0.5 m", "0.5 m"] }
//!
//!     [surroundings]
//!     boundary = "grounded"
//!     walls    = { min = ["-1 m", "-1 m", "-1 m"], max = ["1 m", "1 m", "1 m"] }
//!
//!     [electrostatics]
//!     relative_tolerance = 1e-2
//! "#;
//!
//! /// Keeps the largest field strength of each step, V/m, with one volt on the cube.
//! #[derive(Default)]
//! struct Strongest(Mutex<Vec<f64>>);
//!
//! impl Observer for Strongest {
//!     fn field_solved(&self, _step: &StepResult, field: StepField) -> ControlFlow<()> {
//!         if let (StepField::Grid(field), Ok(mut all)) = (field, self.0.lock()) {
//!             let strength = field.electric_field.iter().flatten().map(|e| e[0].hypot(e[1]).hypot(e[2]));
//!             all.push(strength.fold(0.0, f64::max));
//!         }
//!         ControlFlow::Continue(())
//!     }
//! }
//!
//! let case = elastocap::case::parse(CASE, "cube-in-cube.toml".as_ref())?;
//! let options = Options::default();
//! let plan = Plan::new(&case, &options);
//! let strongest = Strongest::default();
//! let outcome = run(&case, &plan, &options, &Arc::default(), &strongest);
//!
//! // The only entry of the Maxwell matrix, in farads, with its bounds. The scene has no load: there is one step.
//! let maxwell = outcome.steps[0].maxwell.as_ref().ok_or("the step was not solved")?;
//! let c = &maxwell[0][0];
//! let known = 169.355_245_58e-12;
//! assert!((c.value / known - 1.0).abs() < 5e-3);
//! assert!(c.lower <= known && known <= c.upper);
//! assert!(c.upper - c.lower <= 1e-2 * c.value);
//!
//! // Between the cubes the mean field is 1 V over 0.5 m; at the edges of the inner one it is larger.
//! let strongest = strongest.0.into_inner()?;
//! assert_eq!(strongest.len(), 1);
//! assert!(strongest[0] > 2.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A case file is read by [`case::load`], and [`results::save`] writes the files of a run.
//!
//! # Map
//!
//! | crate | content |
//! |---|---|
//! | [`case`] | case files: keys, units, validation, messages, JSON Schema; text in, a valid [`case::Case`] in SI units out |
//! | [`geometry`] | scenes of bodies, mirror planes, import (OBJ, Gmsh), meshes, export (glTF, VTK) |
//! | [`mechanics`] | the deformed layer: a closed form, and finite elements in plane strain and in three dimensions |
//! | [`electrostatics`] | Laplace's equation by three solvers (boxes, outlines pulled along an axis, tetrahedra): Maxwell matrices with bounds, floating conductors |
//! | [`coupling`] | from a case to the capacitances of its load steps: the plan, the run, the outcome |
//! | [`results`] | the files of a run: tables, plots, scenes, fields; all of them or none |
//! | [`circuits`] | models of a solved sensor for circuit and system simulators |
//! | [`fitting`] | parameters of a case from measured points, and the best parameters within limits |
//! | `evidence` | the evidence for the solvers: accuracy against run time, extreme cases, the figures of the paper (feature `evidence`) |
//!
//! Below them, `elastocap-linalg` has the linear algebra and `elastocap-fem` the reference elements that the
//! solvers share, `elastocap-materials` has the laws of rubbers, and `elastocap-files` reads and writes
//! files. Dependencies point one way: linalg, fem, geometry, then mechanics, electrostatics and case, then
//! coupling, results and evidence. Mechanics and electrostatics do not know each other. `ARCHITECTURE.md` has
//! the same map file by file.
//!
//! # Features
//!
//! `command`, on by default, builds the `elastocap` command and with it `evidence`. A program that needs only
//! the library turns both off with `default-features = false`.
//!
//! # Conventions
//!
//! All numbers are in SI units. x1 is in the plane of the layer, x2 points up from the substrate, x3 runs
//! along the width. Three capacitances are kept apart: the *Maxwell matrix* (Q = C V), the *mutual
//! capacitance* (minus an off-diagonal entry of it) and the *two-terminal capacitance* (charge over voltage
//! with equal and opposite charges). The same case gives the same numbers at any number of threads.
//!
//! # Limits
//!
//! - Dielectrics are linear and lossless, and conductors may not touch.
//! - The bounds are theorems for the scene as it was solved, up to rounding. On tetrahedra round bodies have
//!   flat faces, and the bounds do not include the faceting error; an estimate of it comes with the result.
//! - The closed form of the layer is for a long, incompressible, bonded layer in plane strain under a wide,
//!   smooth probe, and has a largest force. An estimate of its error comes with the result.
//! - Finite-element layers have an error estimate, not bounds.
//! - Electrodes that the load bends are outlines pulled along x3 in plane strain, and boxes under a map in
//!   three dimensions; where no such map exists the step fails.
//! - Bodies stay where they are while the layer is pressed, unless they are attached to the layer or the
//!   indenter.

pub use elastocap_case as case;
pub use elastocap_circuits as circuits;
pub use elastocap_coupling as coupling;
pub use elastocap_electrostatics as electrostatics;
#[cfg(feature = "evidence")]
pub use elastocap_evidence as evidence;
pub use elastocap_fitting as fitting;
pub use elastocap_geometry as geometry;
pub use elastocap_mechanics as mechanics;
pub use elastocap_results as results;
