//! Errors of writing results.

use std::io;
use std::path::PathBuf;

/// The reason why results cannot be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OutputError {
    /// The folder cannot be made, or is not writable.
    #[error("cannot write to the output folder `{}`: {source}; name another one with -o", folder.display())]
    Folder {
        /// The folder.
        folder: PathBuf,
        /// The error that the system reports.
        source: io::Error,
    },
    /// A file of this name exists, and elastocap did not write it.
    #[error(
        "`{}` is not from a run of elastocap, or its result.json is gone, and would be replaced: move it away, or name \
         another folder with -o",
        file.display()
    )]
    Foreign {
        /// The file.
        file: PathBuf,
    },
    /// The folder holds the result of a run, which the files of another command would replace.
    #[error("`{}` holds the result of a run, which would be replaced: name another folder with -o", folder.display())]
    HoldsRun {
        /// The folder.
        folder: PathBuf,
    },
    /// A file cannot be written.
    #[error("cannot write `{}`: {source}; nothing was changed there", file.display())]
    File {
        /// The file.
        file: PathBuf,
        /// The error that the system reports.
        source: io::Error,
    },
    /// The files are complete but cannot be put in place.
    #[error("cannot put the new files in place in `{}`: {source}; what was there before is there again", folder.display())]
    Place {
        /// The folder.
        folder: PathBuf,
        /// The error that the system reports.
        source: io::Error,
    },
    /// The files were put in place in part, and that cannot be undone.
    #[error(
        "cannot put the new files in place in `{}`: {source}; the rest of them is in `{}`, and the next run with this \
         output folder completes it",
        folder.display(),
        rest.display()
    )]
    HalfPlaced {
        /// The folder.
        folder: PathBuf,
        /// The folder with the remaining files.
        rest: PathBuf,
        /// The error that the system reports.
        source: io::Error,
    },
}
