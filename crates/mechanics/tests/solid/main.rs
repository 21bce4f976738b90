//! The finite-element solver against solutions it does not know.

#![allow(clippy::unwrap_used, reason = "a helper of a test may fail the test")]

mod contact;
mod cook;
mod extreme;
mod layer;
mod patch;
mod sharp;
mod shear_length;
mod space;
mod stress;
