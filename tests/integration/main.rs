//! Tests of the `elastocap` command as users run it.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops by panicking")]

mod acceptance_files;
mod accuracy;
mod bad_input;
mod command_line;
mod entry;
mod export;
mod figures;
mod files;
mod fit;
mod force;
mod hostile;
mod moving;
mod names;
mod new;
mod report;
mod stability;
mod stated_errors;
mod stopping;
mod support;
mod sweep;
mod terminals;
mod threads;
mod unequal_steps;
