//! The deformed layer against formulas, benchmarks and physics.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops by panicking")]

mod closed_form;
mod solid;
