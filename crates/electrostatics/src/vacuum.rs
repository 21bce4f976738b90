//! The permittivity of vacuum.

/// Permittivity of vacuum, eps_0, F/m (CODATA 2018): the only definition of it in the project.
pub const VACUUM_PERMITTIVITY: f64 = 8.854_187_812_8e-12;
