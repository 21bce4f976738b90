//! From a valid case to a C(F) curve: the plan of a run, and the co-simulation of mechanics and
//! electrostatics. This crate writes no files.
//!
//! The data flow: [`elastocap_case::load`] -> [`plan::Plan`] -> for each load step [`scene::scene_of`], its
//! [`route::route`] and a field solve, by [`run::run`] -> [`outcome::Outcome`]. Every arrow gives a plain
//! value; a step that fails is part of the outcome.
//!
//! The modules in order; each uses only those above it.
//!
//! - [`words`], [`load_steps`], [`shared_fields`], [`settings`], [`terminals`]: small types and functions
//!   that the others share; [`memory`]: the memory that a run may use.
//! - [`deform`]: the layer under its loads.
//! - [`scene`]: the bodies of a step; [`view`]: the part of them that a viewer shows.
//! - [`route`]: the choice of the field solver for a scene, which is made nowhere else.
//! - [`failure`]: the reasons that a step has no result. `status`: the status of a step. [`reason`]: the
//!   reasons that its result is incomplete. [`route_change`]: the reasons that it was not solved on its
//!   planned route.
//! - `mapped`: boxes, and the map that deforms them into layer, electrodes and indenter.
//! - `layer_outlines`, `outline_curves`: a scene of bent bodies, with curves or polygons.
//! - `faceting_error`, `tetrahedra`: the meshing and the solve of a scene on tetrahedra.
//! - [`plan`]: the work of a run, omitted work with the reasons, and the forecast of its cost.
//! - `row`: the row of curve.csv of a step. `field_report`: the statistics of a field solve.
//! - [`finished`]: a serialized step, from which an interrupted run continues.
//! - [`outcome`]: the results of a run.
//! - `model_error`: the errors of a run that are due to the mechanical model.
//! - [`step`]: one load step. [`change`]: its change from the first step; `sensitivity`: the change per
//!   force. [`run`](mod@run): all steps; `side_by_side`: concurrent tasks; [`shortfalls`]: messages about
//!   incomplete results.

pub mod change;
mod common_base;
pub mod deform;
mod faceting_error;
pub mod failure;
mod field_report;
pub mod finished;
mod layer_outlines;
pub mod load_steps;
mod mapped;
pub mod memory;
pub mod model_error;
pub mod outcome;
mod outline_curves;
pub mod plan;
pub mod reason;
pub mod route;
pub mod route_change;
mod row;
pub mod run;
pub mod scene;
mod sensitivity;
pub mod settings;
pub mod shared_fields;
pub mod shortfalls;
mod side_by_side;
mod status;
pub mod step;
pub mod step_messages;
pub mod terminals;
mod tetrahedra;
pub mod view;
pub mod words;
