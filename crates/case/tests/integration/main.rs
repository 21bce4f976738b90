//! Case files: what is read, what is refused, and in which words.

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
