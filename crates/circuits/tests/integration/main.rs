//! Tests from the text of a result to models and files.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, missing_docs)]

mod formats;
mod models;
mod refusals;
mod results;
