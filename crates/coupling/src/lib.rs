//! From a valid case to a C(F) curve: the plan, and the co-simulation of mechanics and electrostatics. Nothing is written here.
//!
//! The way of the data: [`elastocap_case::load`] -> [`plan::Plan`] -> for each load step [`scene::scene_of`] and a field solve,
//! by [`run::run`] -> [`outcome::Outcome`]. Every arrow gives a plain value; a step that fails is part of the outcome.

pub mod deform;
mod faceting_error;
mod layer_outlines;
pub mod outcome;
pub mod plan;
pub mod run;
pub mod scene;
pub mod step;
pub mod terminals;
mod tetrahedra;
pub mod view;
