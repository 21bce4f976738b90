//! The names of the files in the folder of a sweep that are not of one case.

/// The file that says which sweep a folder holds.
pub(crate) const MANIFEST: &str = "manifest.json";

/// The table of all cases.
pub(crate) const TABLE: &str = "sweep.csv";
/// The chart.
pub(crate) const PLOT: &str = "sweep.svg";
/// The summary of the sweep.
pub(crate) const SUMMARY: &str = "sweep.json";
/// How results scatter.
pub(crate) const STATISTICS: &str = "statistics.csv";

/// All files that are written at the end.
pub(crate) const RESULTS: &[&str] = &[TABLE, PLOT, SUMMARY, STATISTICS];
