//! A file that appears all at once, or not at all.

use std::fs::Permissions;
use std::io::{self, Write as _};
use std::path::Path;

/// Writes a file under another name beside it, and gives it its name when it is whole and on the disk.
///
/// # Errors
/// [`io::ErrorKind::AlreadyExists`] if it is there already and `overwrite` is not set; else what the system says. What was there before is
/// there as it was.
pub fn write_file(file: &Path, bytes: &[u8], overwrite: bool) -> io::Result<()> {
    if file.is_dir() {
        return Err(io::ErrorKind::IsADirectory.into());
    }
    let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut builder = tempfile::Builder::new();
    builder.prefix(".elastocap-");
    #[cfg(unix)]
    let permissions = {
        use std::os::unix::fs::PermissionsExt as _;
        // As for any new file: the system takes away what the user's mask says.
        Permissions::from_mode(0o666)
    };
    #[cfg(unix)]
    builder.permissions(permissions);
    let mut whole = builder.tempfile_in(folder)?;
    whole.write_all(bytes)?;
    whole.as_file().sync_all()?;
    let placed = if overwrite { whole.persist(file) } else { whole.persist_noclobber(file) };
    placed.map(drop).map_err(|error| error.error)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn a_file_that_is_there_stays_unless_it_may_be_replaced() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("model.lib");
        write_file(&file, b"one", false).expect("a new file");
        let refused = write_file(&file, b"two", false).expect_err("it is there");
        assert_eq!(refused.kind(), io::ErrorKind::AlreadyExists);
        assert_eq!(fs::read(&file).expect("the file"), b"one");
        write_file(&file, b"two", true).expect("it may be replaced");
        assert_eq!(fs::read(&file).expect("the file"), b"two");
        assert!(write_file(folder.path(), b"three", true).is_err(), "a folder is no file");
        assert_eq!(fs::read_dir(folder.path()).expect("the folder").count(), 1, "nothing is left beside it");
    }
}
