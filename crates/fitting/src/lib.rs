//! Fits parameters of a case to measured data, and optimises its keys.
//!
//! The flow of data: the text of a case with `[measurement]` and the names of free parameters ->
//! [`parameter::Parameter`]s -> [`curves::Curves`], which computes the curve for any of their values and
//! remembers it -> [`fit::fit`], least squares -> [`fit::Fit`] with intervals, correlations and findings, by
//! `uncertainty` and `findings`. [`optimise::optimise`] evaluates [`objective::Quantity`] instead of
//! residuals.
//!
//! Derivatives by keys of the case are differences of curves; those by offset, parasitic capacitance and gain
//! are exact.

pub mod curves;
mod findings;
pub mod fit;
pub mod objective;
pub mod optimise;
pub mod parameter;
pub mod picture;
mod residuals;
mod uncertainty;
