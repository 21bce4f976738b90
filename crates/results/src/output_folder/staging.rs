//! Where files wait until they are put in place.

use std::ffi::{OsStr, OsString};
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use super::disk::{lock, number};
use super::unfinished::Unfinished;

/// How the names of staging folders begin inside the output folder; beside it, a dot and the name of the output folder come first.
pub(super) const STAGING: &str = ".elastocap-";

/// The ending added to the name of a staging folder, for the earlier result while it has no place.
pub(super) const OLD: &str = ".old";

/// The ending added while it changes places with the output folder, before its number on the disk: whoever finds a folder of that name sees by
/// its number whether it is the new one still or the old one already.
pub(super) const SWAP: &str = ".swap-";

/// Is told what will have to be removed before a folder for files is made.
pub(super) type Announce<'a> = dyn FnMut(&Unfinished) + 'a;

/// A hidden folder for files, which is this process's as long as it lives.
#[derive(Debug)]
pub(super) struct Staging {
    pub(super) path: PathBuf,
    /// It, and folders made for it, as what must be removed if the process is broken off.
    pub(super) unfinished: Unfinished,
    /// The random part of its name, which sets it apart from others of this kind.
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

/// How the names of staging folders beside an output folder of this name begin.
pub(super) fn prefix_beside(name: &OsStr) -> OsString {
    let mut prefix = OsString::from(".");
    prefix.push(name);
    prefix.push(STAGING);
    prefix
}

/// Whether an entry of an output folder is there only while files are put in place.
pub(super) fn is_temporary(name: &OsStr) -> bool {
    name.as_encoded_bytes().starts_with(STAGING.as_bytes())
}
