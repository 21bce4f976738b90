//! Reads regular files of limited size.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Read as _};
use std::path::Path;

/// The reason why a file is not read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The error that the system reports.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// The path is a folder, a pipe, a socket or a device, or a link to one.
    #[error("it is not a regular file")]
    NotRegular,
    /// The file has more bytes than the limit.
    #[error("it is larger than {} MiB", largest >> 20)]
    TooLarge {
        /// The limit, bytes.
        largest: u64,
    },
}

impl ReadError {
    /// Whether the file does not exist.
    pub fn is_missing(&self) -> bool {
        let kind = match self {
            Self::Io(error) => Some(error.kind()),
            Self::NotRegular | Self::TooLarge { .. } => None,
        };
        matches!(kind, Some(io::ErrorKind::NotFound | io::ErrorKind::NotADirectory))
    }
}

impl From<ReadError> for io::Error {
    fn from(error: ReadError) -> Self {
        match error {
            ReadError::Io(error) => error,
            ReadError::NotRegular => Self::new(io::ErrorKind::InvalidInput, error),
            ReadError::TooLarge { .. } => Self::new(io::ErrorKind::FileTooLarge, error),
        }
    }
}

/// Opens a regular file, or a link to one, for reading.
///
/// # Errors
/// [`ReadError::NotRegular`] for anything else, or the error that the system reports.
pub fn open(path: &Path) -> Result<File, ReadError> {
    // Opening a device may have an effect, so that paths known not to be regular files are left alone.
    if !path.metadata()?.is_file() {
        return Err(ReadError::NotRegular);
    }
    let mut options = OpenOptions::new();
    options.read(true);
    // Does not wait for a pipe that may have replaced the file since then.
    #[cfg(unix)]
    {
        use std::os::unix::fs::OpenOptionsExt as _;
        options.custom_flags(rustix::fs::OFlags::NONBLOCK.bits().cast_signed());
    }
    let file = options.open(path)?;
    if file.metadata()?.is_file() { Ok(file) } else { Err(ReadError::NotRegular) }
}

/// The bytes of a regular file with at most `largest` bytes.
///
/// # Errors
/// [`ReadError`] if the file is larger or not regular, or the error that the system reports.
pub fn read(path: &Path, largest: u64) -> Result<Vec<u8>, ReadError> {
    let file = open(path)?;
    let length = file.metadata()?.len();
    if length > largest {
        return Err(ReadError::TooLarge { largest });
    }
    let mut bytes = Vec::new();
    // Files such as those of /proc pretend to be empty, so that the length is not trusted.
    file.take(largest.saturating_add(1)).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > largest { Err(ReadError::TooLarge { largest }) } else { Ok(bytes) }
}

/// Copies a regular file of at most `largest` bytes to a new file.
///
/// # Errors
/// [`ReadError`], or [`io::ErrorKind::AlreadyExists`] if the new file exists already. A failed copy leaves
/// nothing behind.
pub fn copy(from: &Path, to: &Path, largest: u64) -> Result<(), ReadError> {
    let source = open(from)?;
    if source.metadata()?.len() > largest {
        return Err(ReadError::TooLarge { largest });
    }
    let copied = io::copy(&mut source.take(largest), &mut File::create_new(to)?);
    if copied.is_err() {
        let _ = fs::remove_file(to);
    }
    Ok(copied.map(drop)?)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops by panicking")]

    use super::*;

    #[test]
    fn a_file_is_read_up_to_its_limit_and_not_beyond() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a");
        fs::write(&file, "1234").unwrap();
        assert_eq!(read(&file, 4).unwrap(), b"1234");
        assert!(matches!(read(&file, 3), Err(ReadError::TooLarge { largest: 3 })));
        // A sparse file of a terabyte takes no room on the disk, but would take all of the memory.
        File::create(&file).unwrap().set_len(1 << 40).unwrap();
        assert!(matches!(read(&file, 1 << 20), Err(ReadError::TooLarge { .. })));
        assert!(matches!(copy(&file, &folder.path().join("b"), 1 << 20), Err(ReadError::TooLarge { .. })));
        assert!(read(&folder.path().join("none"), 4).unwrap_err().is_missing());
        assert!(matches!(read(folder.path(), 4), Err(ReadError::NotRegular)));
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_pipe_and_a_link_to_a_device_are_refused_and_a_link_to_a_file_is_not() {
        use rustix::fs::{CWD, FileType, Mode, mknodat};

        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        mknodat(CWD, at("pipe"), FileType::Fifo, Mode::RUSR | Mode::WUSR, 0).unwrap();
        std::os::unix::fs::symlink("/dev/zero", at("endless")).unwrap();
        fs::write(at("file"), "1").unwrap();
        std::os::unix::fs::symlink(at("file"), at("link")).unwrap();
        assert!(matches!(read(&at("pipe"), 4), Err(ReadError::NotRegular)));
        assert!(matches!(read(&at("endless"), 4), Err(ReadError::NotRegular)));
        assert_eq!(read(&at("link"), 4).unwrap(), b"1");
    }
}
