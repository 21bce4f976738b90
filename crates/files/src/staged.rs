//! Files that appear as a whole, or not at all.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::hash::{BuildHasher as _, RandomState};
use std::io::{self, ErrorKind, Write as _};
use std::path::{Path, PathBuf};

/// The beginning of the hidden names.
const PREFIX: &str = ".elastocap-";

/// The ending of the hidden names.
const SUFFIX: &str = ".new";

/// A file under a hidden name beside its place: `.elastocap-`, sixteen hexadecimal digits that cannot be
/// guessed, `.new`.
///
/// [`Staged::replace_file`], [`Staged::replace`] and [`Staged::place`] give the file its name. If it is
/// dropped without that, it is removed. Files left behind by a killed process are removed by
/// [`remove_abandoned`].
#[derive(Debug)]
pub struct Staged {
    /// The path under the hidden name.
    hidden: PathBuf,
    /// The path that the file gets in the end.
    place: PathBuf,
    /// The file, locked as long as it is open, so that other processes see that it is in use.
    file: File,
    /// Whether the hidden name is gone.
    is_placed: bool,
}

impl Staged {
    /// Writes `bytes` beside `place`.
    ///
    /// # Errors
    /// The error that the system reports; then nothing is left.
    pub fn new(place: &Path, bytes: &[u8]) -> io::Result<Self> {
        let (hidden, file) = create(folder_of(place))?;
        let mut staged = Self { hidden, place: place.to_owned(), file, is_placed: false };
        staged.file.write_all(bytes)?;
        Ok(staged)
    }

    /// Waits until the bytes are on the disk.
    ///
    /// # Errors
    /// The error that the system reports.
    pub fn sync(&self) -> io::Result<()> {
        self.file.sync_all()
    }

    /// Gives the file its name, replacing a regular file, for a name that the user has chosen: `/dev/null`
    /// must not become a regular file.
    ///
    /// # Errors
    /// An error if the name is that of a folder, a device or a pipe, or of a link to one, or the error that
    /// the system reports; the earlier file is then unchanged.
    pub fn replace_file(self) -> io::Result<()> {
        match self.place.metadata() {
            Ok(existing) if existing.is_dir() => Err(ErrorKind::IsADirectory.into()),
            Ok(existing) if !existing.is_file() => {
                Err(io::Error::new(ErrorKind::InvalidInput, "it is not a regular file"))
            }
            Ok(_) | Err(_) => self.replace(),
        }
    }

    /// Gives the file its name, replacing anything but a folder. A link itself is replaced, and its target
    /// stays as it is.
    ///
    /// # Errors
    /// The error that the system reports; the earlier file is then unchanged.
    pub fn replace(mut self) -> io::Result<()> {
        fs::rename(&self.hidden, &self.place)?;
        self.is_placed = true;
        Ok(())
    }

    /// Gives the file its name, if the name is free.
    ///
    /// # Errors
    /// [`ErrorKind::AlreadyExists`] if the name is taken, by a dangling link for instance, or the error that
    /// the system reports.
    pub fn place(mut self) -> io::Result<()> {
        #[cfg(any(target_os = "linux", target_os = "macos"))]
        {
            use rustix::fs::{CWD, RenameFlags, renameat_with};
            use rustix::io::Errno;
            match renameat_with(CWD, &self.hidden, CWD, &self.place, RenameFlags::NOREPLACE) {
                Ok(()) => {
                    self.is_placed = true;
                    return Ok(());
                }
                // The file system does not support this call.
                Err(Errno::INVAL | Errno::NOSYS | Errno::NOTSUP) => {}
                Err(error) => return Err(error.into()),
            }
        }
        // A link never replaces anything; the hidden name is removed when this is dropped.
        match fs::hard_link(&self.hidden, &self.place) {
            Err(error)
                if error.kind() != ErrorKind::AlreadyExists && self.place.symlink_metadata().is_err() =>
            {
                // The file system does not support links either.
                fs::rename(&self.hidden, &self.place)?;
                self.is_placed = true;
                Ok(())
            }
            result => result,
        }
    }
}

impl Drop for Staged {
    fn drop(&mut self) {
        if !self.is_placed {
            let _ = fs::remove_file(&self.hidden);
        }
    }
}

/// Sixteen hexadecimal digits that nobody can predict: the keys of the hash come from the system.
pub fn unguessable() -> String {
    format!("{:016x}", RandomState::new().hash_one(std::process::id()))
}

/// Removes the files of [`Staged`] that killed processes left behind in a folder.
pub fn remove_abandoned(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let is_file = entry.file_type().is_ok_and(|kind| kind.is_file());
        let is_hidden = is_file && entry.file_name().to_str().is_some_and(is_hidden_name);
        // The lock is held until the file is removed.
        if let Some(_lock) = is_hidden.then(|| lock(&entry.path())).flatten() {
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// The folder that a file is in.
fn folder_of(file: &Path) -> &Path {
    file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

fn is_hidden_name(name: &str) -> bool {
    let digits = name.strip_prefix(PREFIX).and_then(|rest| rest.strip_suffix(SUFFIX));
    digits.is_some_and(|digits| digits.len() == 16 && digits.bytes().all(|b| b.is_ascii_hexdigit()))
}

/// A new file under a hidden name, locked.
fn create(folder: &Path) -> io::Result<(PathBuf, File)> {
    for _ in 0..100 {
        let hidden = folder.join(format!("{PREFIX}{}{SUFFIX}", unguessable()));
        // A name that is taken, even by a link, is not opened.
        let file = match File::create_new(&hidden) {
            Ok(file) => file,
            Err(error) if error.kind() == ErrorKind::AlreadyExists => continue,
            Err(error) => return Err(error),
        };
        // Another process may consider the file abandoned before it is locked. On file systems without locks
        // no process considers anything abandoned.
        let is_taken = matches!(file.try_lock(), Err(TryLockError::WouldBlock));
        if !is_taken && hidden.symlink_metadata().is_ok() {
            return Ok((hidden, file));
        }
    }
    Err(io::Error::new(ErrorKind::AlreadyExists, "no new name can be had there"))
}

/// Opens a file without following a link, and locks it. `None` if another process has the lock, or if that is
/// unknown.
fn lock(file: &Path) -> Option<File> {
    let opened = without_links(OpenOptions::new().read(true).write(true)).open(file).ok()?;
    opened.try_lock().ok().map(|()| opened)
}

/// Opens a lock file, and makes it if it does not exist.
///
/// # Errors
/// An error if the name is that of anything but a regular file, such as a link, or the error that the system
/// reports.
pub fn open_lock_file(path: &Path) -> io::Result<File> {
    let refused = || io::Error::new(ErrorKind::InvalidInput, "it is not a regular file");
    if path.symlink_metadata().is_ok_and(|data| !data.is_file()) {
        return Err(refused());
    }
    let file =
        without_links(OpenOptions::new().create(true).truncate(false).read(true).write(true)).open(path)?;
    if file.metadata()?.is_file() { Ok(file) } else { Err(refused()) }
}

/// Adds flags by which opening a link fails, and opening a pipe does not wait for its other end.
fn without_links(options: &mut OpenOptions) -> &mut OpenOptions {
    #[cfg(unix)]
    {
        use rustix::fs::OFlags;
        use std::os::unix::fs::OpenOptionsExt as _;
        options.custom_flags((OFlags::NOFOLLOW | OFlags::NONBLOCK).bits().cast_signed());
    }
    options
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops by panicking")]

    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        let mut names: Vec<_> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_file_that_is_there_stays_unless_it_may_be_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("model.lib");
        Staged::new(&file, b"one").unwrap().place().unwrap();
        let refused = Staged::new(&file, b"two").unwrap().place().unwrap_err();
        assert_eq!(refused.kind(), ErrorKind::AlreadyExists);
        assert_eq!(fs::read(&file).unwrap(), b"one");
        let staged = Staged::new(&file, b"two").unwrap();
        staged.sync().unwrap();
        staged.replace().unwrap();
        assert_eq!(fs::read(&file).unwrap(), b"two");
        assert!(Staged::new(folder.path(), b"three").unwrap().replace().is_err(), "a folder is no file");
        drop(Staged::new(&file, b"four").unwrap());
        assert_eq!(names(folder.path()), ["model.lib"], "nothing is left beside it");
    }

    #[cfg(unix)]
    #[test]
    fn a_link_is_replaced_and_what_it_leads_to_stays() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::write(at("precious"), "mine").unwrap();
        for target in ["precious", "nothing"] {
            std::os::unix::fs::symlink(at(target), at("out")).unwrap();
            let refused = Staged::new(&at("out"), b"new").unwrap().place().unwrap_err();
            assert_eq!(refused.kind(), ErrorKind::AlreadyExists, "{target}");
            Staged::new(&at("out"), b"new").unwrap().replace().unwrap();
            assert!(at("out").symlink_metadata().unwrap().is_file(), "{target}");
            fs::remove_file(at("out")).unwrap();
        }
        assert_eq!(fs::read(at("precious")).unwrap(), b"mine");
        std::os::unix::fs::symlink("/dev/null", at("out")).unwrap();
        assert!(Staged::new(&at("out"), b"new").unwrap().replace_file().is_err(), "nor is a device replaced");
        assert!(open_lock_file(&at("out")).is_err());
        assert_eq!(names(folder.path()), ["out", "precious"]);
    }

    #[test]
    fn what_a_killed_process_left_is_removed_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let left = format!("{PREFIX}0123456789abcdef{SUFFIX}");
        let others = [".elastocap-mine.new", ".elastocap-0123456789abcde.new", "0123456789abcdef.new"];
        for name in others.iter().chain([&left.as_str()]) {
            fs::write(at(name), "").unwrap();
        }
        let alive = Staged::new(&at("file"), b"alive").unwrap();
        remove_abandoned(folder.path());
        assert!(!at(&left).exists() && others.iter().all(|name| at(name).exists()));
        alive.place().unwrap();
        assert_eq!(fs::read(at("file")).unwrap(), b"alive");
    }

    #[test]
    fn no_two_hidden_names_are_the_same() {
        let names: std::collections::BTreeSet<String> = (0..1000).map(|_| unguessable()).collect();
        assert_eq!(names.len(), 1000);
        assert!(names.iter().all(|name| is_hidden_name(&format!("{PREFIX}{name}{SUFFIX}"))));
    }
}
