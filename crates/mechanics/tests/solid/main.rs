//! The finite-element solver against solutions it does not know.

mod cook;
mod layer;
mod patch;
