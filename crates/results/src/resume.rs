//! The record that a stopped run leaves beside its files, from which another run resumes.

use std::fmt::{self, Write as _};
use std::hash::{DefaultHasher, Hasher as _};
use std::io;
use std::path::{Path, PathBuf};

use elastocap_case::Case;
use elastocap_coupling::finished::FinishedStep;
use elastocap_coupling::outcome::StepResult;
use elastocap_coupling::plan::Options;
use serde::{Deserialize, Serialize};

use crate::checked_files::{fault, read_bounded};
use crate::output_files::{RESUME, is_result_name};
use crate::{FieldFiles, FileGroup, Wanted};

/// The reason why a run cannot resume an earlier one.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ResumeError {
    /// There is no stopped run.
    #[error("there is no stopped run to go on from: `{}` cannot be read ({source}); leave out --resume to begin", file.display())]
    Nothing {
        /// The file that the record should be in.
        file: PathBuf,
        /// The error that the system reports.
        source: io::Error,
    },
    /// The file is not a record of this program.
    #[error("`{}` is damaged: {fault}; leave out --resume to begin anew", file.display())]
    Damaged {
        /// The file.
        file: PathBuf,
        /// The position of the error and its kind.
        fault: String,
    },
    /// The stopped run was a different one.
    #[error("the run in `{}` was stopped with another {what}: its steps are not those of this run; leave out --resume to begin anew", folder.display())]
    Differs {
        /// The folder of the stopped run.
        folder: PathBuf,
        /// The part that differs, in words.
        what: &'static str,
    },
}

/// A stopped run: its inputs, and the steps that it finished.
#[derive(Debug, Serialize, Deserialize)]
struct Stopped {
    version: String,
    /// The [`fingerprint`] of the case, with the bodies and meshes from other files.
    case: u64,
    /// Whether the run was without `--no-prune`.
    prune: bool,
    /// Whether the run was without `--no-fields`.
    fields: bool,
    /// The names of the [`FileGroup`]s that the run wrote.
    files: Vec<String>,
    steps: Vec<KeptStep>,
}

/// A finished step in the record.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct KeptStep {
    /// The result of the step.
    found: FinishedStep,
    /// The name of the file with the step's field, if it was written.
    field: Option<String>,
}

/// The finished steps of a stopped run.
#[derive(Debug)]
pub struct Resume {
    folder: PathBuf,
    steps: Vec<KeptStep>,
}

impl Resume {
    /// Reads the record that a run of this case left in `folder` when it was stopped.
    ///
    /// # Errors
    /// [`ResumeError`] if there is no record, or if it is that of a different run.
    pub fn read(folder: &Path, case: &Case, options: &Options, wanted: &Wanted) -> Result<Self, ResumeError> {
        let file = folder.join(RESUME);
        let text = match read_bounded(&file) {
            Ok(text) => text,
            Err(error) => return Err(ResumeError::Nothing { file, source: error.into() }),
        };
        let stopped: Stopped = match serde_json::from_slice(&text) {
            Ok(stopped) => stopped,
            Err(error) => return Err(ResumeError::Damaged { file, fault: fault(&error) }),
        };
        // A manipulated record must not have other files copied into the results.
        let names = stopped.steps.iter().filter_map(|step| step.field.as_deref());
        if !names.into_iter().all(is_result_name) {
            return Err(ResumeError::Damaged {
                file,
                fault: "it names a file that no run writes".to_owned(),
            });
        }
        let checks = [
            (stopped.version == env!("CARGO_PKG_VERSION"), "version of elastocap"),
            (stopped.case == fingerprint(case), "case"),
            (stopped.prune == options.prune, "choice of --no-prune"),
            (stopped.fields == options.fields, "choice of --no-fields"),
            // A step without its field file would have to be solved again for it.
            (stopped.files == wanted.names(), "choice of --only, --no-fields or --no-scene"),
        ];
        match checks.into_iter().find(|(is_same, _)| !is_same) {
            Some((_, what)) => Err(ResumeError::Differs { folder: folder.to_owned(), what }),
            None => Ok(Self { folder: folder.to_owned(), steps: stopped.steps }),
        }
    }

    /// The number of steps that need not be solved again.
    pub fn steps(&self) -> usize {
        self.steps.len()
    }

    /// The result of a step, the folder of the stopped run, and the file with the step's field.
    pub(crate) fn step(&self, index: usize) -> Option<(FinishedStep, &Path, Option<PathBuf>)> {
        let step = self.steps.iter().find(|step| step.found.index == index)?;
        let field = step.field.as_ref().map(|name| self.folder.join(name));
        Some((step.found.clone(), &self.folder, field))
    }
}

/// The text of [`RESUME`]. It leaves out steps that are as quickly solved as read, and those that cannot be
/// written down.
///
/// # Errors
/// An error of serialization, which is not expected.
pub(crate) fn document(
    case: &Case,
    options: &Options,
    wanted: &Wanted,
    steps: &[StepResult],
    fields: &FieldFiles,
) -> serde_json::Result<String> {
    let saved = |step: &StepResult| {
        let field = fields.name(step.index).map(str::to_owned);
        let is_whole = field.is_some() || !wanted.has(FileGroup::Fields);
        FinishedStep::of(step).filter(|_| is_whole).map(|found| KeptStep { found, field })
    };
    let stopped = Stopped {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        case: fingerprint(case),
        prune: options.prune,
        fields: options.fields,
        files: wanted.names(),
        steps: steps.iter().filter_map(saved).collect(),
    };
    serde_json::to_string(&stopped)
}

/// A hash that distinguishes cases. The file name of the case and the measured points do not enter it.
fn fingerprint(case: &Case) -> u64 {
    struct Text(DefaultHasher);
    impl fmt::Write for Text {
        fn write_str(&mut self, text: &str) -> fmt::Result {
            self.0.write(text.as_bytes());
            Ok(())
        }
    }
    let mut text = Text(DefaultHasher::new());
    // Debug output has all digits of every number. Writing to a hasher does not fail.
    let _ = write!(text, "{:?}", Case { source: PathBuf::new(), measured_points: None, ..case.clone() });
    text.0.finish()
}
