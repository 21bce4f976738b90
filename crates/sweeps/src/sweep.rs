//! A sweep: a design with the text of the case file, and each of its cases solved by its index.

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use elastocap_case::{Case, CaseError, OverrideError, files_of, read_source, value_at, with_value};
use elastocap_coupling::failure::panic_message;
use elastocap_coupling::plan::{Options, Plan};
use elastocap_coupling::run::run_sharing;
use elastocap_coupling::shared_fields::SharedFields;

use crate::design::{CaseValues, Design};
use crate::error::SweepError;
use crate::fingerprint::{Fingerprint, Program, digest_of_values, sha256, sha256_of_file};
use crate::record::CaseRecord;

/// The settings that the numbers depend on, in addition to the cases.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Settings {
    /// Whether unneeded parts of a scene are left out: see [`Options::prune`].
    pub prune: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self { prune: true }
    }
}

impl Settings {
    fn options(self) -> Options {
        // Neither fields nor scenes are needed, since there are no pictures.
        Options { prune: self.prune, fields: false, scene: false, model_error: false }
    }
}

/// The reason why a case of a sweep is not solved.
#[derive(Debug, thiserror::Error)]
enum RefusedCase {
    /// A key that cannot be set.
    #[error(transparent)]
    Override(#[from] OverrideError),
    /// The case with its values is not valid.
    #[error("{}", in_one_line(.0))]
    Invalid(#[from] CaseError),
}

/// All errors of a case in one line, each with its remedy.
fn in_one_line(error: &CaseError) -> String {
    let messages = error.diagnostics().iter().map(|d| match &d.help {
        Some(help) => format!("{}; {help}", d.message),
        None => d.message.clone(),
    });
    messages.collect::<Vec<_>>().join("; ")
}

/// The cases of a sweep, ready to be solved in any order.
#[derive(Debug, Clone)]
pub struct Sweep {
    /// The case file.
    origin: PathBuf,
    /// The text of the case file.
    source: String,
    /// The title of the case.
    title: String,
    design: Design,
    settings: Settings,
    fingerprint: Fingerprint,
    /// The value of each key in the case file.
    defaults: Vec<Option<String>>,
    /// Fields shared between cases.
    shared: Arc<SharedFields>,
}

impl Sweep {
    /// Reads the case file, and checks that the keys can be set and that there is a valid case.
    ///
    /// # Errors
    /// An unreadable or invalid case file, a key that cannot be set, or no valid case at all.
    pub fn read(
        case_file: &Path,
        design: Design,
        settings: Settings,
        program: Program,
    ) -> Result<Self, SweepError> {
        let source = read_source(case_file)?;
        Self::new(case_file, source, design, settings, program)
    }

    /// Checks that the keys can be set in the text of a case and that there is a valid case. `origin` stands
    /// for the file of the text, in messages and for the paths in the case.
    ///
    /// # Errors
    /// As for [`Sweep::read`].
    pub fn new(
        origin: &Path,
        source: String,
        design: Design,
        settings: Settings,
        program: Program,
    ) -> Result<Self, SweepError> {
        let title = elastocap_case::parse(&source, origin)?.title;
        let not_set = |source| SweepError::Override { case: 0, source };
        let defaults = design.keys().iter().map(|key| value_at(&source, key).map_err(not_set));
        let defaults = defaults.collect::<Result<_, _>>()?;
        let without_files = Fingerprint {
            version: program.version,
            build: program.build,
            case: sha256(source.as_bytes()),
            files: BTreeMap::new(),
            values: digest_of_values(design.keys(), design.cases()),
            settings: sha256(format!("{settings:?}").as_bytes()),
        };
        let origin = origin.to_owned();
        let shared = Arc::default();
        let mut sweep =
            Self { origin, source, title, design, settings, fingerprint: without_files, defaults, shared };
        sweep.fingerprint.files = sweep.check()?;
        Ok(sweep)
    }

    /// Checks that all keys can be set and that some case is valid; returns the files that the cases name,
    /// each with its SHA-256.
    fn check(&self) -> Result<BTreeMap<String, String>, SweepError> {
        let mut files = BTreeMap::new();
        let mut first = None;
        let mut valid = false;
        for case in 0..self.cases().len() {
            let text = self.text(case).map_err(|source| SweepError::Override { case, source })?;
            for name in files_of(&text) {
                files.entry(name).or_insert_with_key(|name| {
                    let file = self.origin.parent().unwrap_or(Path::new("")).join(name);
                    sha256_of_file(&file).unwrap_or_else(|_| "missing".to_owned())
                });
            }
            if !valid {
                match elastocap_case::parse(&text, &self.origin) {
                    Ok(_) => valid = true,
                    Err(error) => _ = first.get_or_insert(error),
                }
            }
        }
        match first {
            Some(first) if !valid => Err(SweepError::NoneValid { count: self.cases().len(), first }),
            _ => Ok(files),
        }
    }

    /// The text of a case: the text of the file with the values of the case.
    ///
    /// # Errors
    /// A key that cannot be set.
    pub fn text(&self, index: usize) -> Result<String, OverrideError> {
        let values = self.cases().get(index).map_or(&[][..], Vec::as_slice);
        let mut text = self.source.clone();
        for (key, value) in self.design.keys().iter().zip(values) {
            if let Some(value) = value {
                text = with_value(&text, key, value)?;
            }
        }
        Ok(text)
    }

    /// Solves one case; `at_once` is the number of cases solved at the same time in this process, which share
    /// its memory. `None` if the solve was cancelled. Errors are part of the record.
    pub fn solve(&self, index: usize, at_once: usize, cancel: &Arc<AtomicBool>) -> Option<CaseRecord> {
        let values = self.cases().get(index)?.clone();
        // A panic in one case must not end the others.
        let solve = AssertUnwindSafe(|| self.solve_case(index, &values, at_once, cancel));
        catch_unwind(solve).unwrap_or_else(|defect| {
            let message = panic_message(&*defect);
            Some(CaseRecord::refused(index, values.clone(), format!("a defect of elastocap: {message}")))
        })
    }

    fn solve_case(
        &self,
        index: usize,
        values: &CaseValues,
        at_once: usize,
        cancel: &Arc<AtomicBool>,
    ) -> Option<CaseRecord> {
        let start = Instant::now();
        let case = match self.case(index) {
            Ok(case) => case,
            Err(why) => return Some(CaseRecord::refused(index, values.clone(), why.to_string())),
        };
        let options = self.settings.options();
        let mut plan = Plan::new(&case, &options);
        let at_once = at_once.max(1) as u64;
        plan.memory_limit /= at_once;
        plan.layer_memory_limit /= at_once;
        let outcome = run_sharing(&case, &plan, &options, cancel, &(), &self.shared);
        let seconds = start.elapsed().as_secs_f64();
        (!outcome.stopped).then(|| CaseRecord::of_outcome(index, values.clone(), &outcome, seconds))
    }

    fn case(&self, index: usize) -> Result<Case, RefusedCase> {
        Ok(elastocap_case::parse(&self.text(index)?, &self.origin)?)
    }

    /// The case file.
    pub fn origin(&self) -> &Path {
        &self.origin
    }

    /// The text of the case file.
    pub fn source(&self) -> &str {
        &self.source
    }

    /// The title of the case.
    pub fn title(&self) -> &str {
        &self.title
    }

    /// The design: keys and values.
    pub fn design(&self) -> &Design {
        &self.design
    }

    /// The values of each case, by its index.
    pub fn cases(&self) -> &[CaseValues] {
        self.design.cases()
    }

    /// The number of fields that were not solved because another case of this process had the same field.
    pub fn fields_spared(&self) -> usize {
        self.shared.spared()
    }

    /// The inputs that the results depend on.
    pub fn fingerprint(&self) -> &Fingerprint {
        &self.fingerprint
    }

    /// The value of each key as it is written in the case file; `None` where the file has none.
    pub fn defaults(&self) -> &[Option<String>] {
        &self.defaults
    }
}
