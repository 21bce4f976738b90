//! From a valid case to a C(F) curve: the plan, and the co-simulation of mechanics and electrostatics. Nothing is written here.
//!
//! The way of the data: [`elastocap_case::load`] -> [`plan::Plan`] -> for each load step [`scene::scene_of`], its
//! [`route::route`] and a field solve, by [`run::run`] -> [`outcome::Outcome`]. Every arrow gives a plain value; a step that fails
//! is part of the outcome.
//!
//! Modules in their order: each uses only those above it.
//!
//! - [`words`], [`load_steps`], [`shared_fields`], [`settings`], [`terminals`]: small values that the others share; [`memory`]: how much a run may take.
//! - [`deform`]: the layer under its loads.
//! - [`scene`]: the bodies of a step; [`view`]: what of them a viewer is shown.
//! - [`route`]: which field solver takes a scene, the only place that decides it.
//! - [`failure`]: why a step has no result. `status`: how it went. [`reason`]: why it does not have all that was asked for.
//!   [`route_change`]: why it was not solved as it was meant to be.
//! - `mapped`: boxes and the map that bends them to layer, electrodes and indenter.
//! - `layer_outlines`, `outline_curves`: a scene of what the load has bent, with curves or polygons.
//! - `faceting_error`, `tetrahedra`: a scene for the solver on tetrahedra, meshed and solved.
//! - [`plan`]: what is solved, what is left out and why, what it will take.
//! - `row`: the line of curve.csv of a step. `field_report`: what the solve of its field reports besides capacitances.
//! - [`finished`]: a step as it is written down for a run that goes on from there.
//! - [`outcome`]: what a run found.
//! - `model_error`: what the model of the layer adds to the errors of a run.
//! - [`step`]: one load step. [`change`]: what it changes against the first one, and `sensitivity` per force. [`run`](mod@run): all steps,
//!   `side_by_side`; [`shortfalls`]: what steps do not have of what was asked for, as it is told.

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
mod model_error;
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
pub mod terminals;
mod tetrahedra;
pub mod view;
pub mod words;
