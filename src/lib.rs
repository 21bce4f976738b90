//! What capacitance does a soft touch or pressure sensor show under a force, and how far may the number be trusted?
//!
//! This crate is the way in for programs; people use the `elastocap` command. A case file becomes a curve in three steps:
//!
//! ```no_run
//! use elastocap::coupling::{case, plan, run};
//! use std::sync::Arc;
//!
//! let case = case::load("cases/in-plane-pair.toml".as_ref())?;
//! let options = plan::Options::default();
//! let plan = plan::Plan::new(&case, &options);
//! let outcome = run::run(&case, &plan, &options, &Arc::default(), &());
//! for step in &outcome.steps {
//!     println!("{:?} N: {:?} F", step.row.force_n, step.row.two_terminal_capacitance_f);
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub use elastocap_case as case;
pub use elastocap_coupling as coupling;
pub use elastocap_electrostatics as electrostatics;
pub use elastocap_evidence as evidence;
pub use elastocap_geometry as geometry;
pub use elastocap_mechanics as mechanics;
pub use elastocap_results as results;
