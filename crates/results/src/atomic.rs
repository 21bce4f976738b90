//! Files that appear whole or not at all.

use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// A folder that gets its files all at once.
///
/// Files are staged in a hidden folder inside it, on the same disk, and [`OutputFolder::commit`] renames them into place.
/// Dropped without that, it leaves what was there before.
#[derive(Debug)]
pub struct OutputFolder {
    folder: PathBuf,
    staging: PathBuf,
    /// Folders that did not exist before, innermost first.
    created: Vec<PathBuf>,
    staged: Mutex<BTreeSet<String>>,
}

/// Why results cannot be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OutputError {
    /// The folder cannot be made or written to.
    #[error("cannot write to the output folder `{}`: {source}; name another one with -o", folder.display())]
    Folder {
        /// The folder.
        folder: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// A file cannot be written.
    #[error("cannot write `{}`: {source}; nothing was changed there", file.display())]
    File {
        /// The file.
        file: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// A file stands ready and cannot be put in its place.
    #[error("cannot put `{}` in place: {source}", file.display())]
    Place {
        /// The file.
        file: PathBuf,
        /// What the system says.
        source: io::Error,
    },
}

/// The file that says what a results folder holds; it is put in place last.
pub(crate) const INDEX: &str = "result.json";

/// How the names of staging folders begin; the process and a number follow.
const STAGING: &str = ".elastocap-";

impl OutputFolder {
    /// Makes the folder, with those above it, and a place in it to stage files.
    ///
    /// # Errors
    /// [`OutputError::Folder`] if it cannot be made or written to.
    pub fn open(folder: &Path) -> Result<Self, OutputError> {
        let created: Vec<_> = folder
            .ancestors()
            .take_while(|path| !path.as_os_str().is_empty() && !path.exists())
            .map(Path::to_owned)
            .collect();
        let mut this = Self {
            folder: folder.to_owned(),
            staging: PathBuf::new(),
            created,
            staged: Mutex::new(BTreeSet::new()),
        };
        match this.make() {
            Ok(()) => Ok(this),
            Err(source) => Err(OutputError::Folder { folder: folder.to_owned(), source }),
        }
    }

    fn make(&mut self) -> io::Result<()> {
        fs::create_dir_all(&self.folder)?;
        remove_abandoned(&self.folder);
        for attempt in 0..100 {
            let staging = self.folder.join(format!("{STAGING}{}-{attempt}", std::process::id()));
            match fs::create_dir(&staging) {
                Ok(()) => {
                    self.staging = staging;
                    return Ok(());
                }
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(error) => return Err(error),
            }
        }
        Err(io::Error::new(io::ErrorKind::AlreadyExists, "too many unfinished runs left their files there"))
    }

    /// The folder.
    pub fn path(&self) -> &Path {
        &self.folder
    }

    /// Folders that did not exist before, innermost first.
    pub fn created(&self) -> &[PathBuf] {
        &self.created
    }

    /// Where files wait until they are put in place, for whoever must remove them when the process is ended.
    pub fn staging(&self) -> &Path {
        &self.staging
    }

    /// Writes a file that [`OutputFolder::commit`] will put in place.
    ///
    /// # Errors
    /// [`OutputError::File`], when the disk is full for instance.
    pub fn stage(&self, name: &str, bytes: &[u8]) -> Result<(), OutputError> {
        self.note(name, fs::write(self.staging.join(name), bytes))
    }

    /// Makes `name` a copy of a file staged before.
    ///
    /// # Errors
    /// [`OutputError::File`].
    pub fn stage_copy(&self, of: &str, name: &str) -> Result<(), OutputError> {
        self.note(name, fs::copy(self.staging.join(of), self.staging.join(name)).map(drop))
    }

    fn note(&self, name: &str, written: io::Result<()>) -> Result<(), OutputError> {
        written.map_err(|source| OutputError::File { file: self.folder.join(name), source })?;
        self.staged.lock().unwrap_or_else(PoisonError::into_inner).insert(name.to_owned());
        Ok(())
    }

    /// Names of the staged files, sorted.
    pub fn staged(&self) -> Vec<String> {
        self.staged.lock().unwrap_or_else(PoisonError::into_inner).iter().cloned().collect()
    }

    /// Puts all staged files in place, `result.json` last, and removes files of an earlier run that this one does not
    /// have. Which those are, the earlier run's `result.json` says.
    ///
    /// # Errors
    /// [`OutputError::Place`]; files already in place stay there, each of them whole.
    pub fn commit(self) -> Result<Vec<PathBuf>, OutputError> {
        let kept = self.staged();
        let stale = files_of_earlier_run(&self.folder.join(INDEX)).into_iter().filter(|n| !kept.contains(n));
        let stale: Vec<_> = stale.map(|name| self.folder.join(name)).collect();
        let placed = self.commit_beside()?;
        for file in stale {
            // Only tidiness: a file that cannot be removed is not in the new result.json.
            let _ = fs::remove_file(file);
        }
        Ok(placed)
    }

    /// Puts all staged files in place, and leaves the others there as they are: what an earlier run wrote stays true.
    ///
    /// # Errors
    /// [`OutputError::Place`]; files already in place stay there, each of them whole.
    pub fn commit_beside(mut self) -> Result<Vec<PathBuf>, OutputError> {
        let names = self.staged();
        let place = |name: &str| self.folder.join(name);
        for name in &names {
            if place(name).is_dir() {
                let source = io::Error::new(io::ErrorKind::IsADirectory, "there is a folder of that name");
                return Err(OutputError::Place { file: place(name), source });
            }
        }
        let (index, others): (Vec<_>, Vec<_>) = names.iter().partition(|name| *name == INDEX);
        for name in others.into_iter().chain(index) {
            fs::rename(self.staging.join(name), place(name))
                .map_err(|source| OutputError::Place { file: place(name), source })?;
        }
        self.created.clear();
        Ok(names.iter().map(|name| place(name)).collect())
    }
}

impl Drop for OutputFolder {
    fn drop(&mut self) {
        if !self.staging.as_os_str().is_empty() {
            let _ = fs::remove_dir_all(&self.staging);
        }
        for folder in &self.created {
            // Fails, as it should, where something else is in it by now.
            let _ = fs::remove_dir(folder);
        }
    }
}

/// Removes what runs left there that were killed, where the system can tell that they are no more.
fn remove_abandoned(folder: &Path) {
    let processes = Path::new("/proc");
    if !processes.join("self").exists() {
        return;
    }
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let owner =
            name.to_str().and_then(|name| name.strip_prefix(STAGING)).and_then(|rest| rest.split_once('-'));
        let owner = owner.and_then(|(process, _)| process.parse::<u32>().ok());
        if owner.is_some_and(|process| !processes.join(process.to_string()).exists()) {
            let _ = fs::remove_dir_all(entry.path());
        }
    }
}

/// Names that a run of elastocap may have written, out of the list in its `result.json`.
fn files_of_earlier_run(index: &Path) -> Vec<String> {
    let Some(value) =
        fs::read(index).ok().and_then(|bytes| serde_json::from_slice::<serde_json::Value>(&bytes).ok())
    else {
        return Vec::new();
    };
    let ours = value.pointer("/versions/elastocap").is_some();
    let list = value.get("files").and_then(serde_json::Value::as_array).filter(|_| ours);
    let names = list.into_iter().flatten().filter_map(|name| name.as_str());
    names.filter(|name| is_result_name(name)).map(str::to_owned).collect()
}

fn is_result_name(name: &str) -> bool {
    let step = name.strip_prefix("step_").and_then(|rest| rest.strip_suffix(".vtu"));
    let numbered = step.is_some_and(|n| !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit()));
    numbered
        || ["curve.csv", "capacitance.csv", "curve.svg", "scene.glb", "fields.pvd", INDEX].contains(&name)
}
