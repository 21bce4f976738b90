//! Files that a command writes where its user says: whole, or not at all.

use std::fs;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use crate::{Exit, output};

/// Refuses files that are there already, unless they may be replaced.
pub(super) fn check_free(files: &[&Path], overwrite: bool) -> Result<(), Exit> {
    if overwrite {
        return Ok(());
    }
    for file in files {
        if file.symlink_metadata().is_ok() {
            output::error(&format!(
                "`{}` is there already and would be replaced: name another file, or add --overwrite",
                file.display()
            ));
            return Err(Exit::BadInput);
        }
    }
    Ok(())
}

/// Writes all files beside their places first, and then moves them there. Where one cannot be written, none is.
pub(super) fn write_all(files: &[(&Path, String)]) -> Result<(), Exit> {
    let mut staged: Vec<(PathBuf, &Path)> = Vec::new();
    let mut failed = None;
    for (file, text) in files {
        let beside = beside(file);
        match stage(&beside, text) {
            Ok(()) => staged.push((beside, file)),
            Err(error) => {
                let _ = fs::remove_file(&beside);
                failed = Some((file, error));
                break;
            }
        }
    }
    if failed.is_none() {
        for (beside, file) in &staged {
            if let Err(error) = fs::rename(beside, file) {
                output::error(&format!("cannot write `{}`: {error}; name another file", file.display()));
                staged.iter().for_each(|(beside, _)| drop(fs::remove_file(beside)));
                return Err(Exit::Failure);
            }
        }
        return Ok(());
    }
    staged.iter().for_each(|(beside, _)| drop(fs::remove_file(beside)));
    if let Some((file, error)) = failed {
        output::error(&format!("cannot write `{}`: {error}; name another file", file.display()));
    }
    Err(Exit::Failure)
}

fn stage(file: &Path, text: &str) -> io::Result<()> {
    let mut open = fs::File::create(file)?;
    open.write_all(text.as_bytes())?;
    open.sync_all()
}

/// A hidden name in the same folder, so that moving it is one step.
fn beside(file: &Path) -> PathBuf {
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    file.with_file_name(format!(".{name}.{}.partial", std::process::id()))
}
