//! How far the program may be trusted: what an error costs, what becomes of extreme cases, and the figures of the paper.
//!
//! These are clients of [`elastocap_coupling`], like any other program.

pub mod accuracy;
pub mod figures;
pub mod stability;
