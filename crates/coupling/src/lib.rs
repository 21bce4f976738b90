//! From a case file to a C(F) curve: the case reader, the plan, the co-simulation of mechanics and
//! electrostatics, and the results on disk.

pub mod case;
pub mod plot;
