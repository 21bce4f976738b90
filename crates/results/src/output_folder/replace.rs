//! A folder that is replaced as a whole.

use std::collections::BTreeSet;
use std::ffi::{OsStr, OsString};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::disk::{exchange, same_file, same_owner, sync_folder};
use super::leftovers::clear;
use super::staging::Staging;

/// With more files of the user in it, a folder is not replaced as a whole: each of them takes a link.
const MAX_LINKS: usize = 1000;

/// Puts `staging`, which holds the files `coming`, in the place of the folder `target`, with the files `kept` of it. Returns what the user should know, or `None` where
/// that cannot be done, with nothing changed.
pub(super) fn replace(
    staging: &Staging,
    target: &Path,
    kept: &[OsString],
    coming: &BTreeSet<String>,
) -> Option<Vec<String>> {
    let inside = std::env::current_dir().is_ok_and(|current| current.starts_with(target));
    // A folder cannot be in two places, even for a moment.
    let folders = kept.iter().any(|name| target.join(name).symlink_metadata().is_ok_and(|m| m.is_dir()));
    if inside || folders || kept.len() > MAX_LINKS || !same_owner(&staging.path, target) {
        return None;
    }
    let swap = staging.swap(target);
    fs::rename(&staging.path, &swap).ok()?;
    match take_over(&swap, &staging.old(target), target, kept) {
        Ok(old) => Some(conclude(&old, target, kept, coming)),
        Err(_) => {
            for name in kept {
                let link = swap.join(name);
                if same_file(&link, &target.join(name)) {
                    let _ = fs::remove_file(link);
                }
            }
            // Where even this fails, nothing will be found to be put in place, and the next run removes it.
            let _ = fs::rename(&swap, &staging.path);
            None
        }
    }
}

/// Links the files `kept` into the new folder, and lets it change places with the old one. Returns where that is: under the
/// name of the new one, or under that of `old`.
fn take_over(new: &Path, old: &Path, target: &Path, kept: &[OsString]) -> io::Result<PathBuf> {
    for name in kept {
        fs::hard_link(target.join(name), new.join(name))?;
    }
    fs::set_permissions(new, fs::metadata(target)?.permissions())?;
    sync_folder(new)?;
    match exchange(new, target) {
        Ok(()) => Ok(new.to_owned()),
        Err(error) if error.kind() == io::ErrorKind::Unsupported => {
            // For a moment the result has no place; who finds it so finds the old one beside it, as the next run does.
            fs::rename(target, old)?;
            if let Err(error) = fs::rename(new, target) {
                fs::rename(old, target)?;
                return Err(error);
            }
            Ok(old.to_owned())
        }
        Err(error) => Err(error),
    }
}

/// Removes the old folder, from which everything of the user's is in the new one.
fn conclude(old: &Path, target: &Path, kept: &[OsString], coming: &BTreeSet<String>) -> Vec<String> {
    let mut notes = Vec::new();
    if let Some(parent) = target.parent()
        && let Err(error) = sync_folder(parent)
    {
        notes.push(not_on_disk(target, &error));
    }
    for name in kept {
        // Replaced by its owner while the folders changed places.
        let (link, file) = (target.join(name), old.join(name));
        if !same_file(&link, &file) && file.symlink_metadata().is_ok() {
            let _ = fs::rename(file, link);
        }
    }
    for name in coming {
        let _ = fs::remove_file(old.join(name));
    }
    notes.extend(clear(old, target));
    notes
}

/// The warning that the system does not confirm that a new name is on the disk.
pub(super) fn not_on_disk(folder: &Path, error: &io::Error) -> String {
    format!(
        "the new files are in place in `{}`, but the system does not confirm that they would survive a power failure: {error}",
        folder.display()
    )
}

/// The names in a folder that are neither in `leaving` nor in `coming`, nor temporary.
pub(super) fn others(
    folder: &Path,
    leaving: &BTreeSet<String>,
    coming: &BTreeSet<String>,
) -> io::Result<Vec<OsString>> {
    let mut others = Vec::new();
    let among = |set: &BTreeSet<String>, name: &OsStr| name.to_str().is_some_and(|name| set.contains(name));
    for entry in fs::read_dir(folder)? {
        let name = entry?.file_name();
        if !among(leaving, &name) && !among(coming, &name) && !super::staging::is_temporary(&name) {
            others.push(name);
        }
    }
    Ok(others)
}
