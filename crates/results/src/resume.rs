//! The record that a stopped run keeps beside its files, so that another run goes on from there.

use std::fmt::{self, Write as _};
use std::hash::{DefaultHasher, Hasher as _};
use std::io;
use std::path::{Path, PathBuf};

use elastocap_case::Case;
use elastocap_coupling::finished::FinishedStep;
use elastocap_coupling::outcome::StepResult;
use elastocap_coupling::plan::Options;
use serde::{Deserialize, Serialize};

use crate::output_folder::{RESUME, is_result_name};
use crate::own_files::{fault, read_own};
use crate::{FieldFiles, FileGroup, Wanted};

/// Why a run cannot go on from an earlier one.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ResumeError {
    /// There is nothing to go on from.
    #[error("there is no stopped run to go on from: `{}` cannot be read ({source}); leave out --resume to begin", file.display())]
    Nothing {
        /// The file that should say what was found.
        file: PathBuf,
        /// The error that the system reports.
        source: io::Error,
    },
    /// The file is not one of this program.
    #[error("`{}` is damaged: {fault}; leave out --resume to begin anew", file.display())]
    Damaged {
        /// The file.
        file: PathBuf,
        /// Where, and how.
        fault: String,
    },
    /// The stopped run was another one.
    #[error("the run in `{}` was stopped with another {what}: its steps are not those of this run; leave out --resume to begin anew", folder.display())]
    Differs {
        /// Where it is.
        folder: PathBuf,
        /// The part that is different, in words.
        what: &'static str,
    },
}

/// A stopped run: what it was, and the steps that it finished.
#[derive(Debug, Serialize, Deserialize)]
struct Stopped {
    version: String,
    /// The [`fingerprint`] of the case as it was read, bodies and meshes from other files included.
    case: u64,
    prune: bool,
    fields: bool,
    /// The words of `--only`.
    files: Vec<String>,
    steps: Vec<KeptStep>,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
struct KeptStep {
    found: FinishedStep,
    field: Option<String>,
}

/// The finished steps of a stopped run.
#[derive(Debug)]
pub struct Resume {
    folder: PathBuf,
    steps: Vec<KeptStep>,
}

impl Resume {
    /// Reads what a run of this case left in `folder` when it was stopped.
    ///
    /// # Errors
    /// [`ResumeError`] where there is nothing, or where it was not this run.
    pub fn read(folder: &Path, case: &Case, options: &Options, wanted: &Wanted) -> Result<Self, ResumeError> {
        let file = folder.join(RESUME);
        let text = match read_own(&file) {
            Ok(text) => text,
            Err(error) => return Err(ResumeError::Nothing { file, source: error.into() }),
        };
        let stopped: Stopped = match serde_json::from_slice(&text) {
            Ok(stopped) => stopped,
            Err(error) => return Err(ResumeError::Damaged { file, fault: fault(&error) }),
        };
        // A changed file must not have others copied into the results.
        let names = stopped.steps.iter().filter_map(|step| step.field.as_deref());
        if !names.into_iter().all(is_result_name) {
            return Err(ResumeError::Damaged {
                file,
                fault: "it names a file that no run writes".to_owned(),
            });
        }
        let same = [
            (stopped.version == env!("CARGO_PKG_VERSION"), "version of elastocap"),
            (stopped.case == fingerprint(case), "case"),
            (stopped.prune == options.prune, "choice of --no-prune"),
            (stopped.fields == options.fields, "choice of --no-fields"),
            // Without the file of its field, a step would have to be solved again for it.
            (stopped.files == wanted.names(), "choice of --only, --no-fields or --no-scene"),
        ];
        match same.into_iter().find(|(same, _)| !same) {
            Some((_, what)) => Err(ResumeError::Differs { folder: folder.to_owned(), what }),
            None => Ok(Self { folder: folder.to_owned(), steps: stopped.steps }),
        }
    }

    /// How many steps need not be solved again.
    pub fn steps(&self) -> usize {
        self.steps.len()
    }

    /// A step as it was found, the folder of the stopped run, and the file with the step's field.
    pub(crate) fn step(&self, index: usize) -> Option<(FinishedStep, &Path, Option<PathBuf>)> {
        let step = self.steps.iter().find(|step| step.found.index == index)?;
        let field = step.field.as_ref().map(|name| self.folder.join(name));
        Some((step.found.clone(), &self.folder, field))
    }
}

/// The text of [`RESUME`]. Steps are left out that are solved again as quickly as they are read, or cannot be written down.
///
/// # Errors
/// None that is known.
pub(crate) fn document(
    case: &Case,
    options: &Options,
    wanted: &Wanted,
    steps: &[StepResult],
    fields: &FieldFiles,
) -> serde_json::Result<String> {
    let kept = |step: &StepResult| {
        let field = fields.name(step.index).map(str::to_owned);
        let whole = field.is_some() || !wanted.has(FileGroup::Fields);
        FinishedStep::of(step).filter(|_| whole).map(|found| KeptStep { found, field })
    };
    let stopped = Stopped {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        case: fingerprint(case),
        prune: options.prune,
        fields: options.fields,
        files: wanted.names(),
        steps: steps.iter().filter_map(kept).collect(),
    };
    serde_json::to_string(&stopped)
}

/// A number that another case does not have. The name of the file is not part of it.
fn fingerprint(case: &Case) -> u64 {
    struct Text(DefaultHasher);
    impl fmt::Write for Text {
        fn write_str(&mut self, text: &str) -> fmt::Result {
            self.0.write(text.as_bytes());
            Ok(())
        }
    }
    let mut text = Text(DefaultHasher::new());
    // Every number is written with all its digits. Writing to a hasher does not fail.
    let _ = write!(text, "{:?}", Case { source: PathBuf::new(), measured_points: None, ..case.clone() });
    text.0.finish()
}
