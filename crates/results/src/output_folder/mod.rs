//! An output folder whose files appear all at once, or not at all.
//!
//! Files are staged in a hidden folder beside the output folder, `.NAME.elastocap-` and digits that cannot be
//! guessed, and synced there. Then the two folders change places, in one step of the file system. Files of
//! the user in the old folder are linked into the new one beforehand. What a killed process leaves behind is
//! removed or completed by the next one that opens the folder.
//!
//! | module | what is in it |
//! |---|---|
//! | `index` | which files of a folder elastocap wrote |
//! | `staging` | where files wait |
//! | `leftovers` | what killed runs left behind |
//! | `replace` | the folder replaced as a whole |
//! | `in_place` | files put in place one by one, where the folder cannot be replaced |
//! | `unfinished` | what is removed when the process is interrupted |
//! | `disk` | calls to the file system |

mod disk;
mod error;
mod in_place;
mod index;
mod leftovers;
mod replace;
mod staging;
mod unfinished;

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use crate::checked_files::copy_bounded;
use crate::output_files::{INDEX, is_result_name};
use disk::{remove_files, same_disk, sync_files, sync_folder, writable};
use index::Known;
use leftovers::recover;
use replace::{not_on_disk, others, replace};
use staging::{Announce, Staging, is_temporary};

pub use error::OutputError;
pub use unfinished::Unfinished;

/// An output folder that gets its files all at once.
///
/// Files are staged in a hidden folder beside it, and [`OutputFolder::commit`] puts them in place. Dropped
/// without that, it leaves what was there before.
#[derive(Debug)]
pub struct OutputFolder {
    /// The path as the user gave it.
    given: PathBuf,
    /// The path with links resolved.
    place: PathBuf,
    /// Folders above it that did not exist before, innermost first.
    created: Vec<PathBuf>,
    staging: Staging,
    /// The names of the staged files.
    staged: Mutex<BTreeSet<String>>,
    /// The warnings that came up when the folder was opened.
    warnings: Vec<String>,
}

/// The end of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Finish {
    /// Every step has a result.
    Complete,
    /// The run went through all steps, and some failed or missed their tolerance.
    Incomplete,
    /// The run was stopped before it had gone through all steps.
    Stopped,
}

/// Files that are in place.
#[derive(Debug, Clone, PartialEq)]
pub struct Placed {
    /// The folder they are in.
    pub folder: PathBuf,
    /// The files, sorted.
    pub files: Vec<PathBuf>,
    /// Warnings for the user.
    pub warnings: Vec<String>,
}

/// Which files of the folder stay there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Keep {
    /// Files that no run and no `mesh` wrote.
    Foreign,
    /// All files that no new one of the same name replaces.
    Others,
}

impl OutputFolder {
    /// Makes the folders above the output folder and a staging folder. Leftovers of a killed process are
    /// completed or removed.
    ///
    /// # Errors
    /// [`OutputError::Folder`] if a folder cannot be made or written to.
    pub fn open(folder: &Path) -> Result<Self, OutputError> {
        Self::open_announced(folder, |_| ())
    }

    /// Opens the folder as [`OutputFolder::open`] does, for a caller that must [give the files
    /// up](Unfinished::give_up) when the process is interrupted. Before the staging folder is made,
    /// `announce` gets what would then have to be removed. The folders above it exist by then, with nothing
    /// in them.
    ///
    /// # Errors
    /// [`OutputError::Folder`] if a folder cannot be made or written to.
    pub fn open_announced(folder: &Path, mut announce: impl FnMut(&Unfinished)) -> Result<Self, OutputError> {
        let above = folder.ancestors().skip(usize::from(folder.file_name().is_some()));
        let missing = above.take_while(|path| !path.as_os_str().is_empty() && !path.exists());
        let created: Vec<PathBuf> = missing.map(Path::to_owned).collect();
        match Self::prepare(folder, &created, &mut announce) {
            Ok((place, staging, warnings)) => {
                let (given, staged) = (folder.to_owned(), Mutex::default());
                Ok(Self { given, place, created, staging, staged, warnings })
            }
            Err(source) => {
                remove_empty(&created);
                Err(OutputError::Folder { folder: folder.to_owned(), source })
            }
        }
    }

    /// Makes the folders above the output folder and the staging folder. Returns the path of the output
    /// folder with links resolved, the staging folder, and warnings for the user.
    fn prepare(
        folder: &Path,
        created: &[PathBuf],
        announce: &mut Announce<'_>,
    ) -> io::Result<(PathBuf, Staging, Vec<String>)> {
        let place = resolve(folder)?;
        let mut warnings = recover(&place);
        warnings.extend([true, false].into_iter().flat_map(|beside| recover(&partial_of(&place, beside))));
        if !place.exists() {
            return Ok((place.clone(), Staging::beside(&place, created, announce)?, warnings));
        }
        writable(&place)?;
        let beside = place
            .parent()
            .filter(|parent| same_disk(parent, &place))
            .map(|_| Staging::beside(&place, created, announce));
        let staging = match beside {
            Some(Ok(staging)) => staging,
            Some(Err(_)) | None => Staging::inside(&place, created, announce)?,
        };
        Ok((place, staging, warnings))
    }

    /// The path of the folder as the user gave it.
    pub fn path(&self) -> &Path {
        &self.given
    }

    /// The warnings that came up when the folder was opened.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// The folders that have to be removed if the process is interrupted before the files are in place.
    pub fn unfinished(&self) -> &Unfinished {
        &self.staging.unfinished
    }

    /// Checks that a run would replace no file of others, neither in the folder nor in that for unfinished
    /// runs.
    ///
    /// # Errors
    /// [`OutputError::Foreign`] names the first such file. [`OutputError::Folder`] if a folder cannot be
    /// read.
    pub fn holds_nothing_foreign(&self) -> Result<(), OutputError> {
        for folder in [self.place.clone(), self.partial()] {
            let known = self.known(&folder)?;
            for entry in fs::read_dir(&folder).into_iter().flatten().flatten() {
                let name = entry.file_name();
                let is_unaffected = |name: &str| !is_result_name(name) || known.files.contains(name);
                if !name.to_str().is_none_or(is_unaffected) {
                    return Err(OutputError::Foreign { file: self.shown(&folder).join(name) });
                }
            }
        }
        Ok(())
    }

    /// Checks that the folder does not hold the result of a run, which only another run may replace.
    ///
    /// # Errors
    /// [`OutputError::HoldsRun`] if it does. [`OutputError::Folder`] if the folder cannot be read.
    pub fn holds_no_run(&self) -> Result<(), OutputError> {
        match self.known(&self.place)?.run {
            true => Err(OutputError::HoldsRun { folder: self.given.clone() }),
            false => Ok(()),
        }
    }

    /// The contents of a folder as its index files list them.
    fn known(&self, folder: &Path) -> Result<Known, OutputError> {
        Known::of(folder).map_err(|source| OutputError::Folder { folder: self.shown(folder), source })
    }

    /// Writes a file that will be put in place.
    ///
    /// # Errors
    /// [`OutputError::File`], when the disk is full for instance.
    pub fn stage(&self, name: &str, bytes: &[u8]) -> Result<(), OutputError> {
        self.note(name, fs::write(self.staging.path.join(name), bytes))
    }

    /// Makes `name` a copy of an already staged file.
    ///
    /// # Errors
    /// [`OutputError::File`].
    pub fn stage_copy(&self, original: &str, name: &str) -> Result<(), OutputError> {
        let staging = &self.staging.path;
        self.note(name, fs::copy(staging.join(original), staging.join(name)).map(drop))
    }

    /// Makes `name` a copy of a file outside of the staging folder.
    ///
    /// # Errors
    /// [`OutputError::File`].
    pub(crate) fn stage_from(&self, file: &Path, name: &str) -> Result<(), OutputError> {
        self.note(name, copy_bounded(file, &self.staging.path.join(name)).map_err(io::Error::from))
    }

    /// Counts `name` among the staged files if it could be written.
    fn note(&self, name: &str, written: io::Result<()>) -> Result<(), OutputError> {
        written.map_err(|source| OutputError::File { file: self.given.join(name), source })?;
        self.staged.lock().unwrap_or_else(PoisonError::into_inner).insert(name.to_owned());
        Ok(())
    }

    /// Names of the staged files, sorted.
    pub fn staged(&self) -> Vec<String> {
        self.staged.lock().unwrap_or_else(PoisonError::into_inner).iter().cloned().collect()
    }

    /// Puts all staged files in place, and removes those of an earlier run or `mesh` that its index lists.
    ///
    /// # Errors
    /// [`OutputError`]; then all earlier files are in place.
    pub fn commit(&self) -> Result<Placed, OutputError> {
        let place = self.place.clone();
        self.put(&place, Keep::Foreign)
    }

    /// Puts all staged files in place, and leaves the other files there, since they are still valid.
    ///
    /// # Errors
    /// [`OutputError`]; then all earlier files are in place.
    pub fn commit_beside(&self) -> Result<Placed, OutputError> {
        let place = self.place.clone();
        self.put(&place, Keep::Others)
    }

    /// Puts the result of a run in place. A stopped run goes to [`OutputFolder::partial`], and so does a run
    /// with failed steps if the folder has a complete result. A result in the folder itself removes an
    /// unfinished one beside it.
    ///
    /// # Errors
    /// [`OutputError`]; then all earlier files are in place.
    pub fn commit_run(&self, finish: Finish) -> Result<Placed, OutputError> {
        let partial = self.partial();
        let complete_before = self.known(&self.place)?.complete;
        let aside = match finish {
            Finish::Complete => false,
            Finish::Incomplete => complete_before,
            Finish::Stopped => true,
        };
        if !aside {
            let placed = self.commit()?;
            remove_result(&partial);
            return Ok(placed);
        }
        let (shown, given) = (self.shown(&partial), self.given.display().to_string());
        let mut placed = self.put(&partial, Keep::Foreign)?;
        let note = if complete_before {
            format!("`{given}` keeps the complete result of an earlier run, and ")
        } else {
            String::new()
        };
        placed.warnings.push(format!("{note}what this run has found is in `{}`", shown.display()));
        Ok(placed)
    }

    /// The folder for results that must not replace a complete one: beside the output folder, with `.partial`
    /// after its name; or inside it, where no files can be made beside it on the same disk.
    pub fn partial(&self) -> PathBuf {
        let beside = match self.place.parent() {
            Some(parent) => {
                !self.place.exists() || same_disk(parent, &self.place) && writable(parent).is_ok()
            }
            None => false,
        };
        partial_of(&self.place, beside)
    }

    /// The path of a folder as the user would write it, where that path leads to the folder.
    fn shown(&self, folder: &Path) -> PathBuf {
        let name = |path: &Path| path.file_name().map(OsStr::to_owned);
        if folder == self.place {
            return self.given.clone();
        }
        match (name(folder), folder.parent() == self.place.parent()) {
            (Some(name), true) if self.given.file_name() == self.place.file_name() => {
                self.given.with_file_name(name)
            }
            (Some(name), false) if folder.parent() == Some(&self.place) => self.given.join(name),
            _ => folder.to_owned(),
        }
    }

    /// Syncs the staged files and puts them in place in `target`.
    fn put(&self, target: &Path, keep: Keep) -> Result<Placed, OutputError> {
        let shown = self.shown(target);
        let coming: BTreeSet<String> = self.staged().into_iter().collect();
        let files: Vec<PathBuf> = coming.iter().map(|name| self.staging.path.join(name)).collect();
        sync_files(&files).map_err(|(file, source)| {
            let file = file.file_name().map(|name| shown.join(name)).unwrap_or_default();
            OutputError::File { file, source }
        })?;
        let notes = self.move_to(target, &shown, keep, &coming)?;
        let files = coming.iter().map(|name| shown.join(name)).collect();
        let warnings = [self.warnings.as_slice(), &notes].concat();
        Ok(Placed { folder: shown, files, warnings })
    }

    /// Moves the staged files `coming` to `target`. Returns notes for the user.
    fn move_to(
        &self,
        target: &Path,
        shown: &Path,
        keep: Keep,
        coming: &BTreeSet<String>,
    ) -> Result<Vec<String>, OutputError> {
        let failed = |source| OutputError::Place { folder: shown.to_owned(), source };
        let staging = &self.staging.path;
        if target.symlink_metadata().is_err() {
            sync_folder(staging).map_err(failed)?;
            fs::rename(staging, target).map_err(failed)?;
            let synced = target.parent().map_or(Ok(()), sync_folder);
            return Ok(synced.err().map(|error| not_on_disk(shown, &error)).into_iter().collect());
        }
        if let Some(name) = coming.iter().find(|name| target.join(name.as_str()).is_dir()) {
            let text = format!("there is a folder of the name `{name}`");
            return Err(failed(io::Error::new(io::ErrorKind::IsADirectory, text)));
        }
        let leaving = match keep {
            Keep::Foreign => Known::of(target).map_err(failed)?.files,
            Keep::Others => BTreeSet::new(),
        };
        let kept = others(target, &leaving, coming).map_err(failed)?;
        if staging.parent() == target.parent()
            && let Some(notes) = replace(&self.staging, target, &kept, coming)
        {
            return Ok(notes);
        }
        in_place::place(staging, target, &leaving, coming).map(|()| Vec::new()).map_err(|error| {
            let (folder, source) = (shown.to_owned(), error.source);
            match error.undone {
                true => OutputError::Place { folder, source },
                false => OutputError::HalfPlaced { rest: folder.join(in_place::COMMIT), folder, source },
            }
        })
    }
}

impl Drop for OutputFolder {
    fn drop(&mut self) {
        // After a commit there is nothing left to remove.
        remove_files(&self.staging.path);
        remove_empty(&self.created);
    }
}

/// The path of the folder with links resolved. Missing folders above it are made.
fn resolve(folder: &Path) -> io::Result<PathBuf> {
    if folder.exists() {
        let place = fs::canonicalize(folder)?;
        return if place.is_dir() { Ok(place) } else { Err(io::ErrorKind::NotADirectory.into()) };
    }
    if folder.symlink_metadata().is_ok() {
        return Err(io::Error::new(io::ErrorKind::NotFound, "it is a link to what does not exist"));
    }
    let Some(name) = folder.file_name() else {
        fs::create_dir_all(folder)?;
        return fs::canonicalize(folder);
    };
    let parent = folder.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    fs::create_dir_all(parent)?;
    Ok(fs::canonicalize(parent)?.join(name))
}

/// The folder for unfinished results, `beside` the output folder or inside it.
fn partial_of(place: &Path, beside: bool) -> PathBuf {
    match place.file_name().filter(|_| beside) {
        Some(name) => {
            let mut name = name.to_owned();
            name.push(".partial");
            place.with_file_name(name)
        }
        None => place.join("partial"),
    }
}

/// Removes the result of a run, and the folder if nothing else is in it.
fn remove_result(folder: &Path) {
    // Unreadable folders stay.
    let mut names: Vec<String> =
        Known::of(folder).map(|known| known.files).unwrap_or_default().into_iter().collect();
    // The index goes last: as long as it is there, it tells that elastocap wrote the files.
    names.sort_by_key(|name| name == INDEX);
    for name in names {
        let _ = fs::remove_file(folder.join(name));
    }
    for entry in fs::read_dir(folder).into_iter().flatten().flatten().filter(|e| is_temporary(&e.file_name()))
    {
        remove_files(&entry.path());
    }
    let _ = fs::remove_dir(folder);
}

/// Removes those of the folders that are empty.
fn remove_empty(folders: &[PathBuf]) {
    for folder in folders {
        // Fails, as it should, if something else is in the folder by now.
        let _ = fs::remove_dir(folder);
    }
}
