//! Tests of the evidence files against formulas and audited values.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops by panicking")]

mod figures;
