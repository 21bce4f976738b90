//! The options of every subcommand.

use clap::Args;

/// The options of every subcommand.
#[derive(Debug, Clone, Args)]
pub(crate) struct Common {
    /// Number of threads; all cores by default. Results do not depend on it
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(crate) threads: Option<u16>,
    /// Print only warnings and errors
    #[arg(long, short, global = true)]
    pub(crate) quiet: bool,
}
