//! Capacitances against closed forms, published values and one another.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops by panicking")]

mod crossing;
mod extruded;
mod extruded_confined;
mod extruded_dielectrics;
mod extruded_upright;
mod far_faces;
mod field;
mod floating;
mod general;
mod layers_in_series;
mod mapped;
mod mirror;
mod parts;
mod random_scenes;
mod references;
mod splines;
mod superposed;
mod terminals;
mod thin_metal;
