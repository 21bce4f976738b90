//! Fits and searches on cases whose answers are known.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops by panicking")]

mod coverage;
mod fits;
mod support;
