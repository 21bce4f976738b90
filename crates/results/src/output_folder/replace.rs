//! Replaces an output folder as a whole.

use std::collections::BTreeSet;
use std::ffi::{OsStr, OsString};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::disk::{exchange, same_file, same_owner, sync_folder};
use super::leftovers::clear;
use super::staging::Staging;

/// The largest number of the user's files in a folder that is replaced as a whole, since each of them needs a
/// link. Not tuned: a limit that ordinary cases do not reach.
const MAX_LINKS: usize = 1000;

/// Puts `staging`, which holds the files `coming`, in the place of the folder `target`, with the user's files
/// `foreign` of the old folder. Returns notes for the user, or `None` if that is not possible, with nothing
/// changed.
pub(super) fn replace(
    staging: &Staging,
    target: &Path,
    foreign: &[OsString],
    coming: &BTreeSet<String>,
) -> Option<Vec<String>> {
    let is_current = std::env::current_dir().is_ok_and(|current| current.starts_with(target));
    // A folder cannot be linked into two places.
    let has_folders =
        foreign.iter().any(|name| target.join(name).symlink_metadata().is_ok_and(|m| m.is_dir()));
    if is_current || has_folders || foreign.len() > MAX_LINKS || !same_owner(&staging.path, target) {
        return None;
    }
    let swap = staging.swap(target);
    fs::rename(&staging.path, &swap).ok()?;
    match take_over(&swap, &staging.old(target), target, foreign) {
        Ok(old) => Some(conclude(&old, target, foreign, coming)),
        Err(_) => {
            for name in foreign {
                let link = swap.join(name);
                if same_file(&link, &target.join(name)) {
                    let _ = fs::remove_file(link);
                }
            }
            // If even this fails, the next run finds a folder that was never put in place, and removes it.
            let _ = fs::rename(&swap, &staging.path);
            None
        }
    }
}

/// Links the files `foreign` into the new folder, and exchanges it with the old one. Returns the path of the
/// old one: under the name of the new folder, or `old`.
fn take_over(new: &Path, old: &Path, target: &Path, foreign: &[OsString]) -> io::Result<PathBuf> {
    for name in foreign {
        fs::hard_link(target.join(name), new.join(name))?;
    }
    fs::set_permissions(new, fs::metadata(target)?.permissions())?;
    sync_folder(new)?;
    match exchange(new, target) {
        Ok(()) => Ok(new.to_owned()),
        Err(error) if error.kind() == io::ErrorKind::Unsupported => {
            // Between the two renames there is no folder in place. A run that finds this state puts the old
            // folder back: see `leftovers::recover`.
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

/// Removes the old folder after the exchange. The user's files are linked into the new one. Returns notes for
/// the user.
fn conclude(old: &Path, target: &Path, foreign: &[OsString], coming: &BTreeSet<String>) -> Vec<String> {
    let mut notes = Vec::new();
    if let Some(parent) = target.parent()
        && let Err(error) = sync_folder(parent)
    {
        notes.push(not_on_disk(target, &error));
    }
    for name in foreign {
        // A file that differs from its link was replaced by the user while the folders were exchanged.
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

/// The warning that the system did not confirm a new name on the disk.
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
