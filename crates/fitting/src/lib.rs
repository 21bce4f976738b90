//! Parameters of a case from measured data, and from what is wished for.
//!
//! The way of the data: the text of a case with `[measurement]` and the names of what is free -> [`parameter::Parameter`]s ->
//! [`curves::Curves`], which gives the computed curve for any values of them and remembers it -> [`fit::fit`], least squares ->
//! [`fit::Fit`] with intervals, correlations and words, by `uncertainty`. [`optimise::optimise`] asks the same curves for
//! [`objective::Quantity`] in place of residuals.
//!
//! Derivatives by keys of the case are differences of curves; those by offset, parasitic capacitance and gain are exact.

pub mod curves;
mod findings;
pub mod fit;
pub mod objective;
pub mod optimise;
pub mod parameter;
pub mod picture;
mod residuals;
mod uncertainty;
