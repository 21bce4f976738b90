//! Where files wait until they are put in place, and what runs left behind that were killed.

use std::ffi::{OsStr, OsString};
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use super::disk::{lock, number, remove_files, same_file};
use super::in_place;
use super::index::is_result_name;
use super::unfinished::Unfinished;

/// How the names of staging folders begin inside the output folder; beside it, a dot and the name of the output folder come first.
const STAGING: &str = ".elastocap-";

/// What is added to the name of a staging folder, for the earlier result while it has no place.
const OLD: &str = ".old";

/// What is added while it changes places with the output folder, before its number on the disk: whoever finds a folder of that
/// name sees by its number whether it is the new one still or the old one already.
const SWAP: &str = ".swap-";

/// What is added before it is removed by a process that is about to end.
pub(super) const GIVEN_UP: &str = ".given-up";

/// Is told what will have to be removed before a folder for files is made.
pub(super) type Announce<'a> = dyn FnMut(&Unfinished) + 'a;

/// A hidden folder for files, which is this process's as long as it lives.
#[derive(Debug)]
pub(super) struct Staging {
    pub(super) path: PathBuf,
    /// It, and folders made for it, as what must be removed if the process is broken off.
    pub(super) unfinished: Unfinished,
    /// What sets its name apart from others of this kind.
    mark: String,
    /// Tells other processes that it is in use.
    _lock: Option<File>,
}

impl Staging {
    /// Beside `place`, on the same disk. It is announced before it is made, with the folders that were `created` for it.
    pub(super) fn beside(place: &Path, created: &[PathBuf], announce: &mut Announce<'_>) -> io::Result<Self> {
        let (Some(parent), Some(name)) = (place.parent(), place.file_name()) else {
            return Err(io::ErrorKind::NotFound.into());
        };
        Self::create(parent, &prefix_beside(name), created, announce)
    }

    /// Inside `place`. It is announced before it is made, with the folders that were `created` for it.
    pub(super) fn inside(place: &Path, created: &[PathBuf], announce: &mut Announce<'_>) -> io::Result<Self> {
        Self::create(place, OsStr::new(STAGING), created, announce)
    }

    fn create(
        parent: &Path,
        prefix: &OsStr,
        created: &[PathBuf],
        announce: &mut Announce<'_>,
    ) -> io::Result<Self> {
        for _ in 0..100 {
            let mark = elastocap_files::unguessable();
            let mut name = prefix.to_owned();
            name.push(&mark);
            let path = parent.join(name);
            // That of another process, which may live: it must not be announced as our own.
            if path.symlink_metadata().is_ok() {
                continue;
            }
            let unfinished = Unfinished::new(&path, created)?;
            announce(&unfinished);
            match fs::create_dir(&path) {
                Ok(()) => {}
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => continue,
                Err(error) => return Err(error),
            }
            let lock = lock(&path);
            // Another process may have taken it for abandoned before it was locked.
            if path.exists() {
                return Ok(Self { path, unfinished, mark, _lock: lock });
            }
        }
        Err(io::Error::new(io::ErrorKind::AlreadyExists, "too many unfinished runs left their files there"))
    }

    /// Where the earlier result of `target` waits where two folders cannot change places at once.
    pub(super) fn old(&self, target: &Path) -> PathBuf {
        self.beside_target(target, OLD)
    }

    /// The name of this folder while it changes places with `target`.
    pub(super) fn swap(&self, target: &Path) -> PathBuf {
        self.beside_target(target, &format!("{SWAP}{}", number(&self.path).unwrap_or_default()))
    }

    /// A name by which the next process that opens `target` finds it.
    fn beside_target(&self, target: &Path, ending: &str) -> PathBuf {
        let mut name = prefix_beside(target.file_name().unwrap_or_default());
        name.push(&self.mark);
        name.push(ending);
        target.with_file_name(name)
    }
}

fn prefix_beside(name: &OsStr) -> OsString {
    let mut prefix = OsString::from(".");
    prefix.push(name);
    prefix.push(STAGING);
    prefix
}

/// Whether an entry of an output folder is there only while files are put in place.
pub(super) fn is_temporary(name: &OsStr) -> bool {
    name.as_encoded_bytes().starts_with(STAGING.as_bytes())
}

/// Completes or removes what killed runs left at `place`. Returns what the user should know.
pub(super) fn recover(place: &Path) -> Vec<String> {
    let mut notes = Vec::new();
    for left in abandoned(place, OsStr::new(STAGING)) {
        match in_place::complete(&left, place) {
            Ok(true) => notes.push(format!(
                "an earlier run was ended while it put its files in place in `{}`; that is completed now",
                place.display()
            )),
            Ok(false) => remove_files(&left),
            Err(error) => notes.push(format!(
                "an earlier run was ended while it put its files in place in `{}`, and that cannot be completed: {error}; \
                 the rest of its files is in `{}`",
                place.display(),
                left.display()
            )),
        }
    }
    let (Some(parent), Some(name)) = (place.parent(), place.file_name()) else { return notes };
    for left in abandoned(parent, &prefix_beside(name)) {
        match stage_of(&left) {
            Stage::New => remove_files(&left),
            Stage::Old if !place.exists() && fs::rename(&left, place).is_ok() => notes.push(format!(
                "an earlier run was ended while it put its files in place in `{}`; the result before it is there again",
                place.display()
            )),
            Stage::Old => notes.extend(clear(&left, place)),
        }
    }
    notes
}

/// What a folder beside an output folder holds.
enum Stage {
    /// Files that were never put in place, and links to some that are in place.
    New,
    /// What was in place before.
    Old,
}

fn stage_of(left: &Path) -> Stage {
    let name = left.file_name().map(OsStr::to_string_lossy).unwrap_or_default();
    match name.rsplit_once(SWAP) {
        Some((_, of_new)) if of_new.parse().ok() != number(left) => Stage::Old,
        None if name.ends_with(OLD) => Stage::Old,
        Some(_) | None => Stage::New,
    }
}

/// Folders in `parent` whose names begin like this and whose process has ended.
fn abandoned(parent: &Path, prefix: &OsStr) -> Vec<PathBuf> {
    let entries = fs::read_dir(parent).into_iter().flatten().flatten();
    let ours = entries.filter(|entry| {
        entry.file_name().as_encoded_bytes().starts_with(prefix.as_encoded_bytes())
            && entry.file_type().is_ok_and(|kind| kind.is_dir())
    });
    ours.map(|entry| entry.path()).filter(|path| lock(path).is_some()).collect()
}

/// Removes a folder that is not an output folder any more, or never became one: the files of a run in it, and those that `place`
/// has too. A file that came in while the folders changed places goes to `place`. Returns what is left, if anything.
pub(super) fn clear(left: &Path, place: &Path) -> Option<String> {
    for entry in fs::read_dir(left).into_iter().flatten().flatten() {
        let (name, path) = (entry.file_name(), entry.path());
        let there = place.join(&name);
        let ours = name.to_str().is_some_and(is_result_name);
        if ours || same_file(&path, &there) {
            let _ = fs::remove_file(path);
        } else if there.symlink_metadata().is_err() && place.exists() {
            let _ = fs::rename(path, there);
        }
    }
    let removed = fs::remove_dir(left).is_ok() || !left.exists();
    (!removed).then(|| format!("`{}` is left over and can be removed; look into it first", left.display()))
}
