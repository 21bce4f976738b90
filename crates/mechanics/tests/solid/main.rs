//! The finite-element solver against solutions it does not know.

#![allow(clippy::unwrap_used)]

mod cook;
mod layer;
mod patch;
