//! Errors of sweeps.

use std::io;
use std::path::PathBuf;

use elastocap_case::{CaseError, OverrideError};

use crate::shard::Shard;

/// The reason why the record of a case is not used; the case is then solved again.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordError {
    /// The file cannot be read.
    #[error("its file cannot be read: {0}")]
    Read(io::Error),
    /// The file does not have the form of a record.
    #[error("its file is cut off or damaged")]
    Damaged,
    /// The file belongs to another sweep.
    #[error("its file belongs to another sweep")]
    OtherSweep,
    /// The checksum is not that of the record.
    #[error("its file has been changed: the checksum differs")]
    Changed,
    /// The record is that of another case or of other values.
    #[error("its file holds another case")]
    OtherCase,
}

/// The reason why a sweep cannot begin, resume or be gathered.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SweepError {
    /// The case file is invalid.
    #[error(transparent)]
    Case(#[from] CaseError),
    /// A key cannot be set.
    #[error("case {case}: {source}")]
    Override {
        /// The case.
        case: usize,
        /// The reason.
        source: OverrideError,
    },
    /// Every case is invalid, most likely because of a wrong key or unit.
    #[error("none of the {count} cases is valid; of case 0 it is said:\n{first}")]
    NoneValid {
        /// The number of cases.
        count: usize,
        /// The error of the first case.
        first: CaseError,
    },
    /// The folder holds another sweep.
    #[error(
        "`{}` holds another sweep: it has been made with {}; name another folder with -o, or solve everything anew with --overwrite",
        folder.display(),
        differences.join(", ")
    )]
    Foreign {
        /// The folder.
        folder: PathBuf,
        /// The parts that differ, in words.
        differences: Vec<String>,
    },
    /// The folder holds another part of the sweep.
    #[error(
        "`{}` holds shard {found} of this sweep and not {asked}; name a folder for each shard with -o",
        folder.display()
    )]
    OtherShard {
        /// The folder.
        folder: PathBuf,
        /// The shard that it holds.
        found: Shard,
        /// The requested shard.
        asked: Shard,
    },
    /// The folder has files of other origin that would be replaced.
    #[error(
        "`{}` is not from a sweep of elastocap, or its {manifest} is gone, and would be replaced: move it away, or name another folder \
         with -o",
        file.display(),
        manifest = crate::files::MANIFEST
    )]
    NotOurs {
        /// The file.
        file: PathBuf,
    },
    /// A link, or a file, stands where the folder of the records should be.
    #[error("`{}` is not a folder itself but a link or a file: move it away, or name another folder with -o", file.display())]
    NoFolder {
        /// The link or file in its place.
        file: PathBuf,
    },
    /// Another process works in the folder.
    #[error("another process works in `{}`; wait for it, or name another folder with -o", folder.display())]
    Busy {
        /// The folder.
        folder: PathBuf,
    },
    /// The folder holds no readable sweep.
    #[error("`{}` holds no sweep of this version: {why}; name another folder, or move its files away", folder.display())]
    NoSweep {
        /// The folder.
        folder: PathBuf,
        /// The missing or damaged part, in words.
        why: String,
    },
    /// A file cannot be written.
    #[error("cannot write `{}`: {source}; what is finished is kept, and the same command goes on from there", file.display())]
    Write {
        /// The file.
        file: PathBuf,
        /// The error that the system reports.
        source: io::Error,
    },
    /// A file cannot be read.
    #[error("cannot read `{}`: {source}", file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// The error that the system reports.
        source: io::Error,
    },
    /// The folders hold shards of different sweeps.
    #[error(
        "`{}` and `{}` are not shards of the same sweep: the second has been made with {}; gather shards of one sweep only",
        first.display(),
        second.display(),
        differences.join(", ")
    )]
    ShardsDiffer {
        /// A folder.
        first: PathBuf,
        /// A folder that holds another sweep.
        second: PathBuf,
        /// The parts that differ, in words.
        differences: Vec<String>,
    },
    /// Two folders hold the same shard.
    #[error("`{}` and `{}` are both shard {shard}; name each shard once", first.display(), second.display())]
    ShardTwice {
        /// A folder.
        first: PathBuf,
        /// Another folder.
        second: PathBuf,
        /// The shard that both hold.
        shard: Shard,
    },
    /// Not all shards are among the folders.
    #[error("{} missing: {} of {of}; run them, and name all folders", if missing.len() == 1 { "a shard is" } else { "shards are" }, listed(missing))]
    ShardsMissing {
        /// The missing shards, counted from 1.
        missing: Vec<usize>,
        /// The number of shards.
        of: usize,
    },
    /// A shard is not finished.
    #[error(
        "shard {shard} in `{}` has no result for {missing} of its {count} cases (the first is case {first}); run it again with the same \
         command, and it goes on",
        folder.display()
    )]
    ShardUnfinished {
        /// The folder of the shard.
        folder: PathBuf,
        /// The shard.
        shard: Shard,
        /// The number of cases without a result.
        missing: usize,
        /// The number of cases of the shard.
        count: usize,
        /// The first case without a result.
        first: usize,
    },
    /// Threads cannot be started.
    #[error("cannot start a thread: {0}")]
    Thread(String),
}

impl SweepError {
    /// Whether the error is in the arguments or in the files that they name; otherwise it is in the system.
    pub fn is_bad_input(&self) -> bool {
        match self {
            Self::Case(_)
            | Self::Override { .. }
            | Self::NoneValid { .. }
            | Self::Foreign { .. }
            | Self::OtherShard { .. }
            | Self::NotOurs { .. }
            | Self::NoFolder { .. }
            | Self::Busy { .. }
            | Self::NoSweep { .. }
            | Self::ShardsDiffer { .. }
            | Self::ShardTwice { .. }
            | Self::ShardsMissing { .. }
            | Self::ShardUnfinished { .. } => true,
            Self::Write { .. } | Self::Read { .. } | Self::Thread(_) => false,
        }
    }
}

/// A list of at most ten numbers, and the number of further ones.
fn listed(numbers: &[usize]) -> String {
    let shown: Vec<String> = numbers.iter().take(10).map(usize::to_string).collect();
    let more = numbers.len() - shown.len();
    let rest = if more > 0 { format!(" and {more} more") } else { String::new() };
    shown.join(", ") + &rest
}
