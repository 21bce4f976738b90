//! Models of a solved sensor for circuit and system simulators.
//!
//! A run gives capacitances at its load steps. A [`Model`] turns them into functions of the force: cubic
//! between the steps, monotone between neighbours, continuously differentiable, and with bounds that never
//! cross. It is a network of two-terminal capacitors, none of which is negative at any force; its Maxwell
//! matrix is therefore positive semidefinite, and the model passive at every force.
//!
//! | module | what is in it |
//! |---|---|
//! | [`model`] | the network, read from a result, and errors of making it |
//! | [`curve`] | one capacitance as a function of the force, with its bounds |
//! | [`identifiers`] | names that every simulator takes |
//! | [`spice`], [`verilog_a`], [`fmu`], [`table`](mod@table) | the formats |

pub mod curve;
mod document;
pub mod fmu;
mod header;
pub mod identifiers;
pub mod model;
pub mod spice;
pub mod table;
pub mod verilog_a;

pub use curve::BoundedCurve;
pub use model::{Branch, Content, Model, ModelError};
