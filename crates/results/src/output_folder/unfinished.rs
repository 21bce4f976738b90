//! Removal of the files of an interrupted run, without allocating: lack of memory may be the reason for the
//! interruption.

use std::io;
use std::path::{Path, PathBuf};

/// The ending added to the name of a folder before it is removed by a process that is about to end.
const GIVEN_UP: &str = ".given-up";

/// The folders that a process must remove before it ends early. All allocations are made in advance, by
/// `new`.
#[derive(Debug, Clone)]
pub struct Unfinished {
    /// The staging folder.
    staging: system::Name,
    /// The name of the staging folder while it is being removed.
    aside: system::Name,
    /// The folders made for the output folder, innermost first.
    created: Vec<system::Name>,
}

impl Unfinished {
    pub(super) fn new(staging: &Path, created: &[PathBuf]) -> io::Result<Self> {
        let mut aside = staging.as_os_str().to_owned();
        aside.push(GIVEN_UP);
        Ok(Self {
            staging: system::name(staging)?,
            aside: system::name(Path::new(&aside))?,
            created: created.iter().map(|folder| system::name(folder)).collect::<io::Result<_>>()?,
        })
    }

    /// Removes the staged files, from a process that is about to end, while another thread may be putting
    /// them in place: then either all of them are removed, or none. Returns whether they are given up. Files
    /// that cannot be removed are left to the next process that opens the folder.
    ///
    /// On Linux this allocates nothing.
    pub fn give_up(&self) -> bool {
        // The folder is renamed first: it must not be put in place once some of its files are gone.
        let given_up = system::rename(&self.staging, &self.aside);
        if given_up {
            system::remove_files(&self.aside);
        }
        for folder in &self.created {
            // Fails, as it should, if something else is in the folder by now.
            system::remove_empty(folder);
        }
        given_up
    }
}

/// System calls of Unix, with names converted in advance.
#[cfg(unix)]
mod system {
    use std::ffi::CString;
    use std::io;
    use std::os::unix::ffi::OsStrExt as _;
    use std::path::Path;

    pub(super) type Name = CString;

    pub(super) fn name(path: &Path) -> io::Result<Name> {
        Ok(CString::new(path.as_os_str().as_bytes())?)
    }

    pub(super) fn rename(from: &Name, to: &Name) -> bool {
        rustix::fs::rename(from.as_c_str(), to.as_c_str()).is_ok()
    }

    pub(super) fn remove_empty(folder: &Name) {
        let _ = rustix::fs::rmdir(folder.as_c_str());
    }

    /// Removes the files in a folder, and the folder; anything that cannot be removed stays. The standard
    /// library would allocate memory to read a folder.
    #[cfg(target_os = "linux")]
    pub(super) fn remove_files(folder: &Name) {
        use std::mem::MaybeUninit;

        use rustix::fs::{AtFlags, Mode, OFlags, RawDir, SeekFrom, open, seek, unlinkat};

        let Ok(opened) =
            open(folder.as_c_str(), OFlags::RDONLY | OFlags::DIRECTORY | OFlags::CLOEXEC, Mode::empty())
        else {
            return;
        };
        let mut buffer = [MaybeUninit::uninit(); 4096];
        // A file system may skip entries while others are removed, so the folder is read until it is empty.
        loop {
            let mut removed = false;
            let mut entries = RawDir::new(&opened, &mut buffer);
            while let Some(Ok(entry)) = entries.next() {
                removed |= unlinkat(&opened, entry.file_name(), AtFlags::empty()).is_ok();
            }
            if !removed || seek(&opened, SeekFrom::Start(0)).is_err() {
                break;
            }
        }
        remove_empty(folder);
    }

    #[cfg(not(target_os = "linux"))]
    pub(super) fn remove_files(folder: &Name) {
        crate::output_folder::disk::remove_files(Path::new(std::ffi::OsStr::from_bytes(folder.as_bytes())));
    }
}

/// Calls of the standard library, for other systems.
#[cfg(not(unix))]
mod system {
    use std::fs;
    use std::io;
    use std::path::{Path, PathBuf};

    pub(super) use super::super::disk::remove_files;

    pub(super) type Name = PathBuf;

    pub(super) fn name(path: &Path) -> io::Result<Name> {
        Ok(path.to_owned())
    }

    pub(super) fn rename(from: &Path, to: &Path) -> bool {
        fs::rename(from, to).is_ok()
    }

    pub(super) fn remove_empty(folder: &Path) {
        let _ = fs::remove_dir(folder);
    }
}
