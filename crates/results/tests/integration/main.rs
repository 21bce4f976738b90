//! Tests of the files written of an outcome.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops by panicking")]

mod floating;
mod folder;
mod layer;
