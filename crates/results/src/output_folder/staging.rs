//! Hidden folders where files wait until they are put in place.

use std::ffi::{OsStr, OsString};
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use super::disk::{lock, number};
use super::unfinished::Unfinished;

/// The beginning of the names of staging folders inside the output folder; beside it, a dot and the name of
/// the output folder come first.
pub(super) const STAGING: &str = ".elastocap-";

/// The ending added to the name of a staging folder, for an earlier result on its way out.
pub(super) const OLD: &str = ".old";

/// The ending added while a staging folder changes places with the output folder. The inode number of the new
/// folder follows it, by which the next process tells whether the folder under that name is still the new one
/// or already the old one.
pub(super) const SWAP: &str = ".swap-";

/// A callback that gets what will have to be removed, before a staging folder is made.
pub(super) type Announce<'a> = dyn FnMut(&Unfinished) + 'a;

/// A hidden folder for files, locked by this process as long as it lives.
#[derive(Debug)]
pub(super) struct Staging {
    /// The path of the folder.
    pub(super) path: PathBuf,
    /// The staging folder, and folders made for it, which must be removed if the process is interrupted.
    pub(super) unfinished: Unfinished,
    /// The random part of the name, which distinguishes staging folders.
    mark: String,
    /// The lock by which other processes see that the folder is in use.
    _lock: Option<File>,
}

impl Staging {
    /// Makes a staging folder beside `place`. It is announced before that, with the folders that were
    /// `created` for it.
    pub(super) fn beside(place: &Path, created: &[PathBuf], announce: &mut Announce<'_>) -> io::Result<Self> {
        let (Some(parent), Some(name)) = (place.parent(), place.file_name()) else {
            return Err(io::ErrorKind::NotFound.into());
        };
        Self::create(parent, &prefix_beside(name), created, announce)
    }

    /// Makes a staging folder inside `place`. It is announced before that, with the folders that were
    /// `created` for it.
    pub(super) fn inside(place: &Path, created: &[PathBuf], announce: &mut Announce<'_>) -> io::Result<Self> {
        Self::create(place, OsStr::new(STAGING), created, announce)
    }

    /// Makes and locks a folder in `parent` whose name begins with `prefix`.
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
            // The folder of another process, perhaps a live one, must not be announced as that of this
            // process.
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
            // Another process may have removed the folder as abandoned before it was locked.
            if path.exists() {
                return Ok(Self { path, unfinished, mark, _lock: lock });
            }
        }
        Err(io::Error::new(io::ErrorKind::AlreadyExists, "too many unfinished runs left their files there"))
    }

    /// The path for the earlier result of `target`, where two folders cannot be exchanged at once.
    pub(super) fn old(&self, target: &Path) -> PathBuf {
        self.beside_target(target, OLD)
    }

    /// The name of this folder while it changes places with `target`.
    pub(super) fn swap(&self, target: &Path) -> PathBuf {
        self.beside_target(target, &format!("{SWAP}{}", number(&self.path).unwrap_or_default()))
    }

    /// A path beside `target` by which the next process that opens `target` finds the folder.
    fn beside_target(&self, target: &Path, ending: &str) -> PathBuf {
        let mut name = prefix_beside(target.file_name().unwrap_or_default());
        name.push(&self.mark);
        name.push(ending);
        target.with_file_name(name)
    }
}

/// The beginning of the names of staging folders beside an output folder of this name.
pub(super) fn prefix_beside(name: &OsStr) -> OsString {
    let mut prefix = OsString::from(".");
    prefix.push(name);
    prefix.push(STAGING);
    prefix
}

/// Whether an entry of an output folder exists only while files are put in place.
pub(super) fn is_temporary(name: &OsStr) -> bool {
    name.as_encoded_bytes().starts_with(STAGING.as_bytes())
}
