//! The closed form of the layer, seen from outside: against the paper, against the audited reference values,
//! against 50-digit arithmetic (mpmath), and against the laws it has to obey.

mod electrode;
mod force;
mod inverse;
mod map;
mod refusals;
mod shear;
mod stress;
mod support;
