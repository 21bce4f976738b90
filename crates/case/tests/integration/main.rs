//! Tests of case files: valid ones, invalid ones, and the messages.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops by panicking")]

mod acceptance;
mod auto;
mod bad_files;
mod foam;
mod forms;
mod helps;
mod measurement;
mod never_panics;
mod outlines;
mod recognised;
mod rules;
mod schema;
mod terminals;
