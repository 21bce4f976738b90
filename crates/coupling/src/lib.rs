//! From a case file to a C(F) curve: the case reader, the plan, the co-simulation of mechanics and
//! electrostatics, and the results on disk.
//!
//! The way of the data: [`case::load`] -> [`plan::Plan`] -> for each load step [`scene_of::scene_of`] and a field solve,
//! by [`run::run`] -> [`curve::Outcome`] -> [`results::save`]. Every arrow gives a plain value; a step that fails is part
//! of the outcome, and only what cannot be written is an error.

pub mod accuracy;
mod bent;
pub mod case;
pub mod curve;
pub mod deform;
pub mod figures;
mod flat_faces;
pub mod plan;
pub mod plot;
pub mod results;
pub mod run;
pub mod scene_of;
mod shaped;
pub mod stability;
mod step;
pub mod terminals;
