//! Sweeps: many cases from one file with changed values, each solved once, and one table of all.
//!
//! The flow of data: [`Setting`]s (`key=10um..100um:10`) -> [`Design`], the values of every case ->
//! [`Sweep`], the design with the text of the case file -> [`Sweep::solve`], one case by its index ->
//! [`CaseRecord`] -> [`SweepFolder`], with a file for each record -> [`write_results`]: table, plot,
//! statistics. [`run`](fn@run) solves many cases in parallel, [`gather`] joins the folders of shards.
//!
//! A killed sweep resumes where it stopped: records are read and checked, and cases without a valid record
//! are solved. Apart from its seconds, which the table leaves out, a record does not depend on the time, the
//! place or the order of the solves.
//!
//! ```no_run
//! use std::path::Path;
//! use std::sync::{Arc, atomic::AtomicBool};
//! use elastocap_sweeps::{Design, Program, Setting, Settings, Sweep};
//!
//! let gap: Setting = "electrodes.in_plane_pair.gap=10um..100um:10".parse()?;
//! let design = Design::grid(&[gap])?;
//! let sweep = Sweep::read(Path::new("case.toml"), design, Settings::default(), Program::of_this_process()?)?;
//! let cancel = Arc::new(AtomicBool::new(false));
//! for index in 0..sweep.cases().len() {
//!     let record = sweep.solve(index, 1, &cancel);
//!     println!("{record:?}");
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod chart;
mod design;
mod distribution;
mod error;
mod files;
mod fingerprint;
mod folder;
mod gather;
mod influence;
mod manifest;
mod record;
mod results;
mod run;
mod settings;
mod shard;
mod splitting;
mod statistics;
mod sweep;
mod table;

pub use design::{CaseValues, Design, DesignError, DesignKind};
pub use distribution::{Distribution, DistributionError};
pub use error::{RecordError, SweepError};
pub use fingerprint::{Fingerprint, Program};
pub use folder::{Finished, SweepFolder};
pub use gather::gather;
pub use influence::{Influence, Share};
pub use manifest::Manifest;
pub use record::{CaseRecord, StepRecord};
pub use results::{Scatter, Summary, write_results};
pub use run::{SweepObserver, run};
pub use settings::{MAX_CASES, Setting, SettingError, Values};
pub use shard::{Shard, ShardError};
pub use statistics::{Moments, PERCENTILES, StepStatistics, statistics};
pub use sweep::{Settings, Sweep};
pub use table::{Column, table};
