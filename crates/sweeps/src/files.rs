//! The names of the common files in the folder of a sweep.

/// The file that identifies the sweep in a folder.
pub(crate) const MANIFEST: &str = "manifest.json";

/// The table of all cases.
pub(crate) const TABLE: &str = "sweep.csv";
/// The chart of the sweep.
pub(crate) const PLOT: &str = "sweep.svg";
/// The summary of the sweep.
pub(crate) const SUMMARY: &str = "sweep.json";
/// The statistics of the results.
pub(crate) const STATISTICS: &str = "statistics.csv";

/// All files written at the end.
pub(crate) const RESULTS: &[&str] = &[TABLE, PLOT, SUMMARY, STATISTICS];
