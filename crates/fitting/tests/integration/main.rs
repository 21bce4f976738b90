//! Tests of fits and searches on cases with known answers.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops by panicking")]

mod coverage;
mod fits;
mod support;
