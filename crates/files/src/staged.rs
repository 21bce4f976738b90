//! A file that appears as a whole, or not at all.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::hash::{BuildHasher as _, RandomState};
use std::io::{self, ErrorKind, Write as _};
use std::path::{Path, PathBuf};

/// How the hidden names begin.
const PREFIX: &str = ".elastocap-";

/// How the hidden names end.
const SUFFIX: &str = ".new";

/// A file under a hidden name beside its place: `.elastocap-`, sixteen hexadecimal digits that cannot be guessed, `.new`.
///
/// [`Staged::replace_file`], [`Staged::replace`] and [`Staged::place`] give the file its name. Dropped without that, it is removed. What a killed process
/// leaves behind is removed by [`remove_abandoned`].
#[derive(Debug)]
pub struct Staged {
    hidden: PathBuf,
    place: PathBuf,
    /// Locked as long as it is open: other processes see that the file is in use.
    file: File,
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

    /// Gives the file its name, in place of a file that has it, for a name that the user has chosen: `/dev/null` must not become a file.
    ///
    /// # Errors
    /// A folder, a device or a pipe has the name, or a link to one, or what the system says; then what was there is there.
    pub fn replace_file(self) -> io::Result<()> {
        match self.place.metadata() {
            Ok(there) if there.is_dir() => Err(ErrorKind::IsADirectory.into()),
            Ok(there) if !there.is_file() => {
                Err(io::Error::new(ErrorKind::InvalidInput, "it is not a regular file"))
            }
            Ok(_) | Err(_) => self.replace(),
        }
    }

    /// Gives the file its name, in place of whatever has it but a folder. A link is replaced itself, and what it leads to stays as it is.
    ///
    /// # Errors
    /// The error that the system reports; then what was there is there.
    pub fn replace(mut self) -> io::Result<()> {
        fs::rename(&self.hidden, &self.place)?;
        self.is_placed = true;
        Ok(())
    }

    /// Gives the file its name, if nothing has it.
    ///
    /// # Errors
    /// [`ErrorKind::AlreadyExists`] if something has it, a link that leads nowhere for instance, or what the system says.
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
                // The file system knows no such thing.
                Err(Errno::INVAL | Errno::NOSYS | Errno::NOTSUP) => {}
                Err(error) => return Err(error.into()),
            }
        }
        // A link never replaces anything; the hidden name goes when this is dropped.
        match fs::hard_link(&self.hidden, &self.place) {
            Err(error)
                if error.kind() != ErrorKind::AlreadyExists && self.place.symlink_metadata().is_err() =>
            {
                // Nor does the file system know links.
                fs::rename(&self.hidden, &self.place)?;
                self.is_placed = true;
                Ok(())
            }
            linked => linked,
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

/// Sixteen hexadecimal digits that nobody can foresee: the keys of the hash come from the system.
pub fn unguessable() -> String {
    format!("{:016x}", RandomState::new().hash_one(std::process::id()))
}

/// Removes the files of [`Staged`] in a folder that processes left behind that were killed.
pub fn remove_abandoned(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let is_file = entry.file_type().is_ok_and(|kind| kind.is_file());
        let is_hidden = is_file && entry.file_name().to_str().is_some_and(is_hidden_name);
        // Kept until the file is removed.
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
        // Whatever has the name, a link too, it is not opened.
        let file = match File::create_new(&hidden) {
            Ok(file) => file,
            Err(error) if error.kind() == ErrorKind::AlreadyExists => continue,
            Err(error) => return Err(error),
        };
        // Another process may take it for abandoned before it is locked. File systems without locks are taken as they are: nobody
        // finds anything abandoned there.
        let is_taken = matches!(file.try_lock(), Err(TryLockError::WouldBlock));
        if !is_taken && hidden.symlink_metadata().is_ok() {
            return Ok((hidden, file));
        }
    }
    Err(io::Error::new(ErrorKind::AlreadyExists, "no new name can be had there"))
}

/// Opens a file without following a link, and locks it. `None` if another process has the lock, or if there is no telling.
fn lock(file: &Path) -> Option<File> {
    let opened = without_links(OpenOptions::new().read(true).write(true)).open(file).ok()?;
    opened.try_lock().ok().map(|()| opened)
}

/// Opens a file that processes lock, and makes it if it is not there.
///
/// # Errors
/// Anything but a regular file has the name, a link for instance, or what the system says.
pub fn open_lock_file(path: &Path) -> io::Result<File> {
    let refused = || io::Error::new(ErrorKind::InvalidInput, "it is not a regular file");
    if path.symlink_metadata().is_ok_and(|there| !there.is_file()) {
        return Err(refused());
    }
    let file =
        without_links(OpenOptions::new().create(true).truncate(false).read(true).write(true)).open(path)?;
    if file.metadata()?.is_file() { Ok(file) } else { Err(refused()) }
}

/// Neither a link that has come in place of a file nor a pipe is opened.
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
