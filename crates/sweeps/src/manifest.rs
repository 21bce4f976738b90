//! The manifest of a sweep, which identifies the sweep in a folder.

use std::path::Path;

use elastocap_files::ReadError;
use elastocap_results::{fault, read_bounded};
use serde::{Deserialize, Serialize};

use crate::design::{CaseValues, Design, DesignError, DesignKind};
use crate::error::SweepError;
use crate::files::MANIFEST;
use crate::fingerprint::{Fingerprint, digest_of_values, sha256};
use crate::shard::Shard;
use crate::sweep::Sweep;

/// The version of the format of manifest and records.
const FORMAT: u32 = 1;

/// The sweep, or the shard of it, in a folder.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// The version of the format: 1.
    pub format: u32,
    /// The inputs of the results.
    pub fingerprint: Fingerprint,
    /// The SHA-256 of the fingerprint.
    pub digest: String,
    /// The shard of the sweep in the folder.
    pub shard: Shard,
    /// The case file, as the user named it.
    pub case_file: String,
    /// The title of the case.
    pub title: String,
    /// The text of the case file.
    pub case_text: String,
    /// The seed, for cases drawn at random.
    pub seed: Option<u64>,
    /// The distribution of each key; empty unless cases are drawn at random.
    pub distributions: Vec<Option<String>>,
    /// The varied keys.
    pub keys: Vec<String>,
    /// The value of each key in the case file.
    pub defaults: Vec<Option<String>>,
    /// The values of each case.
    pub cases: Vec<CaseValues>,
}

impl Manifest {
    /// The manifest of a sweep.
    pub fn of(sweep: &Sweep, shard: Shard) -> Self {
        let (seed, distributions) = match sweep.design().kind() {
            DesignKind::Random { seed, distributions } => (Some(*seed), distributions.clone()),
            DesignKind::Grid | DesignKind::List => (None, Vec::new()),
        };
        Self {
            format: FORMAT,
            fingerprint: sweep.fingerprint().clone(),
            digest: sweep.fingerprint().digest(),
            shard,
            case_file: sweep.origin().display().to_string(),
            title: sweep.title().to_owned(),
            case_text: sweep.source().to_owned(),
            seed,
            distributions,
            keys: sweep.design().keys().to_vec(),
            defaults: sweep.defaults().to_vec(),
            cases: sweep.cases().to_vec(),
        }
    }

    /// Reads the manifest of a folder; `None` if there is none.
    ///
    /// # Errors
    /// A manifest that cannot be read, or has been changed, or is of another version.
    pub fn read(folder: &Path) -> Result<Option<Self>, SweepError> {
        let file = folder.join(MANIFEST);
        let damaged = |why: String| SweepError::NoSweep { folder: folder.to_owned(), why };
        let text = match read_bounded(&file) {
            Ok(text) => text,
            Err(error) if error.is_missing() => return Ok(None),
            Err(ReadError::Io(source)) => return Err(SweepError::Read { file, source }),
            Err(error) => return Err(damaged(format!("its {MANIFEST} cannot be read: {error}"))),
        };
        let manifest: Self = serde_json::from_slice(&text)
            .map_err(|error| damaged(format!("its {MANIFEST} is not that of a sweep ({})", fault(&error))))?;
        if manifest.format != FORMAT {
            return Err(damaged(format!("its {MANIFEST} has format {}, not {FORMAT}", manifest.format)));
        }
        let as_written = manifest.digest == manifest.fingerprint.digest()
            && manifest.fingerprint.case == sha256(manifest.case_text.as_bytes())
            && manifest.fingerprint.values == digest_of_values(&manifest.keys, &manifest.cases);
        if !as_written {
            return Err(damaged(format!("its {MANIFEST} has been changed")));
        }
        Ok(Some(manifest))
    }

    /// The design: keys and values of the cases.
    pub fn design(&self) -> Result<Design, DesignError> {
        let design = Design::of_cases(self.keys.clone(), self.cases.clone())?;
        Ok(match self.seed {
            Some(seed) => {
                design.with_kind(DesignKind::Random { seed, distributions: self.distributions.clone() })
            }
            None => design,
        })
    }

    /// The cases of the folder.
    pub fn cases_of_shard(&self) -> impl Iterator<Item = usize> {
        self.shard.cases(self.cases.len())
    }
}
