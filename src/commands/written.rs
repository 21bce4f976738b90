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

/// Writes all files beside their places first, and then moves them there. If one cannot be written, none is.
pub(super) fn write_all<B: AsRef<[u8]>>(files: &[(&Path, B)], overwrite: bool) -> Result<(), Exit> {
    let mut staged = Vec::new();
    for (file, bytes) in files {
        remove_abandoned(file.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new(".")));
        match stage(file, bytes.as_ref()) {
            Ok(whole) => staged.push((whole, *file)),
            Err(error) => return Err(failed(file, &error)),
        }
    }
    let mut placed: Vec<&Path> = Vec::new();
    for (whole, file) in staged {
        if let Err(error) = if overwrite { whole.replace_file() } else { whole.place() } {
            // Files that are new, and that nobody has seen yet.
            placed.iter().filter(|_| !overwrite).for_each(|file| drop(fs::remove_file(file)));
            return Err(failed(file, &error));
        }
        placed.push(file);
    }
    Ok(())
}

fn stage(file: &Path, bytes: &[u8]) -> io::Result<Staged> {
    let whole = Staged::new(file, bytes)?;
    whole.sync()?;
    Ok(whole)
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
