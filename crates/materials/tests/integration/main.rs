//! Energies, stresses and tangents of every law, in the plane and in space.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops by panicking")]

mod every_law;
mod hyperfoam;
mod limits;
mod plane;
mod space;
mod stress_table;
mod third_stress;
