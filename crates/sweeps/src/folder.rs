//! The folder of a sweep: a manifest, and a file for each finished case.
//!
//! | file | what is in it |
//! |---|---|
//! | `manifest.json` | the inputs of the results, the text of the case file, keys and values of all cases |
//! | `cases/000042.jsonl` | the record of case 42 in the first line; in the second its SHA-256 and that of the sweep |
//! | `.lock` | the lock of the process that works in the folder |
//!
//! Each file is written under another name and then renamed: a killed process leaves it whole or not at all.
//! Records are not synced one by one, since the checksum reveals a record that the disk has lost, which is
//! then solved again. The folder may come from others, so that only regular files are read, and `cases` must
//! be a folder itself and not a link.

use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

use elastocap_files::{Staged, open_lock_file, remove_abandoned};
use serde::{Deserialize, Serialize};

use crate::error::{RecordError, SweepError};
use crate::files::{MANIFEST, RESULTS};
use crate::fingerprint::sha256;
use crate::manifest::Manifest;
use crate::record::CaseRecord;

const CASES: &str = "cases";
const LOCK: &str = ".lock";
/// The largest record that is read, bytes.
const LARGEST_RECORD: u64 = 64 << 20;

/// The second line of a record.
#[derive(Debug, Serialize, Deserialize)]
struct Seal {
    /// The digest of the sweep.
    sweep: String,
    /// SHA-256 of the first line, without its end.
    sha256: String,
}

/// The finished cases of a sweep.
#[derive(Debug, Default)]
pub struct Finished {
    /// The valid records, by case.
    pub records: Vec<Option<CaseRecord>>,
    /// Cases whose file is not used, with the reason.
    pub damaged: Vec<(usize, RecordError)>,
}

/// The folder of a sweep, while this process works in it.
#[derive(Debug)]
pub struct SweepFolder {
    path: PathBuf,
    manifest: Manifest,
    /// Whether all cases are solved anew, replacing the sweep in the folder.
    replaces: bool,
    /// The lock file, open as long as the process works in the folder.
    _lock: Option<File>,
}

impl SweepFolder {
    /// Opens the folder of a sweep, and makes it if it does not exist. With `overwrite` the files of another
    /// sweep stay until those of this one replace them.
    ///
    /// # Errors
    /// A folder that holds another sweep, another shard or other files, that another process works in, or
    /// that is not writable.
    pub fn open(path: &Path, manifest: Manifest, overwrite: bool) -> Result<Self, SweepError> {
        let folder = || path.to_owned();
        let write = |file: PathBuf| move |source| SweepError::Write { file, source };
        let found = Manifest::read(path)?;
        if let Some(found) = &found
            && !overwrite
        {
            if found.digest != manifest.digest {
                let differences = manifest.fingerprint.differences(&found.fingerprint);
                return Err(SweepError::Foreign { folder: folder(), differences });
            }
            if found.shard != manifest.shard {
                return Err(SweepError::OtherShard {
                    folder: folder(),
                    found: found.shard,
                    asked: manifest.shard,
                });
            }
        }
        if found.is_none() {
            // A process killed at its very start leaves an empty folder for cases.
            let has_cases = fs::read_dir(path.join(CASES)).is_ok_and(|mut entries| entries.next().is_some());
            let foreign = RESULTS.iter().find(|name| path.join(name).exists());
            if let Some(name) = has_cases.then_some(&CASES).or(foreign) {
                return Err(SweepError::NotOurs { file: path.join(name) });
            }
        }
        let cases = path.join(CASES);
        // Through a link, files would be written and removed in a folder that the user did not name.
        if cases.symlink_metadata().is_ok_and(|data| !data.is_dir()) {
            return Err(SweepError::NoFolder { file: cases });
        }
        fs::create_dir_all(&cases).map_err(write(cases.clone()))?;
        let lock = lock(path)?;
        remove_abandoned(path);
        remove_abandoned(&cases);
        let opened = Self { path: folder(), manifest, replaces: overwrite, _lock: lock };
        if found.as_ref() != Some(&opened.manifest) {
            let text = serde_json::to_vec_pretty(&opened.manifest).map_err(io::Error::from);
            let file = path.join(MANIFEST);
            let text = text.map_err(write(file))?;
            opened.write(MANIFEST, &text)?;
        }
        Ok(opened)
    }

    /// Removes the rest of another sweep once the files of this one are in place: tables that are not among
    /// `files`, and with `--overwrite` records of cases that are not in `records`.
    pub(crate) fn remove_others(
        &self,
        files: &[String],
        records: &[Option<CaseRecord>],
    ) -> Result<(), SweepError> {
        let stale = RESULTS.iter().filter(|name| !files.iter().any(|file| file == *name));
        let mut others: Vec<PathBuf> = stale.map(|name| self.path.join(name)).collect();
        if self.replaces {
            let entries = fs::read_dir(self.path.join(CASES)).into_iter().flatten().flatten();
            let is_other = |name: &str| {
                let case = name.strip_suffix(".jsonl").and_then(|case| case.parse::<usize>().ok());
                case.is_some_and(|case| records.get(case).is_none_or(Option::is_none))
            };
            let is_other = |entry: &fs::DirEntry| entry.file_name().to_str().is_some_and(is_other);
            others.extend(entries.filter(is_other).map(|entry| entry.path()));
        }
        for file in others {
            match fs::remove_file(&file) {
                Err(source) if source.kind() != io::ErrorKind::NotFound => {
                    return Err(SweepError::Write { file, source });
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// The path of the folder.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The manifest of the sweep in the folder.
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// Reads and checks all records; none counts if the sweep is to be replaced.
    pub fn finished(&self) -> Finished {
        if self.replaces {
            return Finished { records: vec![None; self.manifest.cases.len()], damaged: Vec::new() };
        }
        finished(&self.path, &self.manifest)
    }

    /// Writes the record of a case.
    ///
    /// # Errors
    /// [`SweepError`] if the record cannot be written; an earlier one is then still there.
    pub fn save(&self, record: &CaseRecord) -> Result<(), SweepError> {
        let name = format!("{CASES}/{}", file_name(record.case));
        let failed = |error: serde_json::Error| SweepError::Write {
            file: self.path.join(&name),
            source: error.into(),
        };
        let line = serde_json::to_string(record).map_err(failed)?;
        let seal = Seal { sweep: self.manifest.digest.clone(), sha256: sha256(line.as_bytes()) };
        let seal = serde_json::to_string(&seal).map_err(failed)?;
        self.write(&name, format!("{line}\n{seal}\n").as_bytes())
    }

    /// Writes a file of the folder, as a whole.
    pub(crate) fn write(&self, name: &str, bytes: &[u8]) -> Result<(), SweepError> {
        let file = self.path.join(name);
        let failed = |source| SweepError::Write { file: file.clone(), source };
        Staged::new(&file, bytes).and_then(Staged::replace).map_err(failed)
    }
}

fn file_name(case: usize) -> String {
    format!("{case:06}.jsonl")
}

/// Reads and checks the records of a folder.
pub(crate) fn finished(folder: &Path, manifest: &Manifest) -> Finished {
    let mut found = Finished { records: vec![None; manifest.cases.len()], damaged: Vec::new() };
    for case in manifest.cases_of_shard() {
        match read_record(folder, manifest, case) {
            Ok(record) => {
                if let Some(place) = found.records.get_mut(case) {
                    *place = record;
                }
            }
            Err(why) => found.damaged.push((case, why)),
        }
    }
    found
}

/// The record of a case; `None` if there is none.
fn read_record(folder: &Path, manifest: &Manifest, case: usize) -> Result<Option<CaseRecord>, RecordError> {
    let text = match elastocap_files::read(&folder.join(CASES).join(file_name(case)), LARGEST_RECORD) {
        Ok(bytes) => String::from_utf8(bytes).map_err(|_| RecordError::Damaged)?,
        Err(error) if error.is_missing() => return Ok(None),
        Err(error) => return Err(RecordError::Read(error.into())),
    };
    let lines = text.strip_suffix('\n').and_then(|text| text.split_once('\n'));
    let (line, seal) = lines.ok_or(RecordError::Damaged)?;
    let seal: Seal = serde_json::from_str(seal).map_err(|_| RecordError::Damaged)?;
    if seal.sweep != manifest.digest {
        return Err(RecordError::OtherSweep);
    }
    if seal.sha256 != sha256(line.as_bytes()) {
        return Err(RecordError::Changed);
    }
    let record: CaseRecord = serde_json::from_str(line).map_err(|_| RecordError::Damaged)?;
    match record.case == case && manifest.cases.get(case) == Some(&record.values) {
        true => Ok(Some(record)),
        false => Err(RecordError::OtherCase),
    }
}

/// Locks a folder; `None` if the file system has no locks.
fn lock(folder: &Path) -> Result<Option<File>, SweepError> {
    let file = folder.join(LOCK);
    let opened = open_lock_file(&file).map_err(|source| SweepError::Write { file, source })?;
    match opened.try_lock() {
        Ok(()) => Ok(Some(opened)),
        Err(TryLockError::WouldBlock) => Err(SweepError::Busy { folder: folder.to_owned() }),
        Err(TryLockError::Error(_)) => Ok(None),
    }
}
