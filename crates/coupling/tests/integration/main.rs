//! From a case to its outcome, without the command line and without files.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops by panicking")]

mod capsule;
mod change;
mod common;
mod contacts;
mod draft;
mod foam;
mod imported_mesh;
mod in_layer;
mod in_the_way;
mod indenter;
mod layer;
mod measured;
mod model_error;
mod route;
mod run;
mod scene;
mod skin;
mod surface;
mod thin_metal;
