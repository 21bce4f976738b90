//! Sweeps: many cases from one file with values changed, each solved once, and one table of all.
