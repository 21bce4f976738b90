//! The exit statuses of the process.

use std::process::ExitCode;

/// The end of the process, which determines its exit status.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Exit {
    /// Success.
    Done,
    /// A failure through no fault of the input: results cannot be written, for instance.
    Failure,
    /// An unusable case file or argument; nothing was written.
    BadInput,
    /// Finished, but a step failed, missed its tolerance or was not run; the results are kept and marked.
    Incomplete,
}

impl Exit {
    /// The worse of two: a failure, then bad input, then something incomplete.
    pub(crate) fn or_worse(self, other: Self) -> Self {
        let badness = |exit| match exit {
            Self::Done => 0,
            Self::Incomplete => 1,
            Self::BadInput => 2,
            Self::Failure => 3,
        };
        if badness(other) > badness(self) { other } else { self }
    }

    /// The exit status of the process.
    pub(crate) fn status(self) -> u8 {
        match self {
            Self::Done => 0,
            Self::Failure => 1,
            Self::BadInput => 2,
            Self::Incomplete => 3,
        }
    }
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit.status())
    }
}
