//! Writes files at places that the user names: as a whole, or not at all.

use std::fs;
use std::io::{self, ErrorKind};
use std::path::Path;

use elastocap_files::{Staged, remove_abandoned};

use crate::exit::Exit;
use crate::output;

/// Refuses files that already exist, unless they may be replaced.
pub(super) fn check_free(files: &[&Path], overwrite: bool) -> Result<(), Exit> {
    let existing = files.iter().find(|file| !overwrite && file.symlink_metadata().is_ok());
    existing.map_or(Ok(()), |file| Err(refused(file)))
}

/// Writes all files beside their places first, and then moves them there. If one cannot be written, none is
/// moved.
pub(super) fn write_all<B: AsRef<[u8]>>(files: &[(&Path, B)], overwrite: bool) -> Result<(), Exit> {
    let mut staged = Vec::new();
    for (file, bytes) in files {
        remove_abandoned(file.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new(".")));
        match stage(file, bytes.as_ref()) {
            Ok(staged_file) => staged.push((staged_file, *file)),
            Err(error) => return Err(failed(file, &error)),
        }
    }
    let mut placed: Vec<&Path> = Vec::new();
    for (staged_file, file) in staged {
        if let Err(error) = if overwrite { staged_file.replace_file() } else { staged_file.place() } {
            // Files placed without `overwrite` are new, so that removing them loses nothing.
            placed.iter().filter(|_| !overwrite).for_each(|file| drop(fs::remove_file(file)));
            return Err(failed(file, &error));
        }
        placed.push(file);
    }
    Ok(())
}

/// Writes a file beside its place, and waits until it is on the disk.
fn stage(file: &Path, bytes: &[u8]) -> io::Result<Staged> {
    let staged_file = Staged::new(file, bytes)?;
    staged_file.sync()?;
    Ok(staged_file)
}

fn failed(file: &Path, error: &io::Error) -> Exit {
    if error.kind() == ErrorKind::AlreadyExists {
        return refused(file);
    }
    output::error(&format!("cannot write `{}`: {error}; name another file", file.display()));
    Exit::Failure
}

fn refused(file: &Path) -> Exit {
    output::error(&format!(
        "`{}` is there already and would be replaced: name another file, or add --overwrite",
        file.display()
    ));
    Exit::BadInput
}
