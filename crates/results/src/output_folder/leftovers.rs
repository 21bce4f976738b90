//! Recovery from folders that killed runs left behind.

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};

use super::disk::{lock, number, remove_files, same_file};
use super::in_place;
use super::staging::{OLD, STAGING, SWAP, prefix_beside};
use crate::output_files::is_result_name;

/// Completes or removes the leftovers of killed runs beside and in `place`. Returns notes for the user.
pub(super) fn recover(place: &Path) -> Vec<String> {
    let mut notes = Vec::new();
    for left in abandoned(place, OsStr::new(STAGING)) {
        match in_place::complete(&left, place) {
            Ok(true) => notes.push(format!(
                "an earlier run was ended while it put its files in place in `{}`; that is completed now",
                place.display()
            )),
            Ok(false) => remove_files(&left),
            Err(error) => notes.push(format!(
                "an earlier run was ended while it put its files in place in `{}`, and that cannot be completed: {error}; \
                 the rest of its files is in `{}`",
                place.display(),
                left.display()
            )),
        }
    }
    let (Some(parent), Some(name)) = (place.parent(), place.file_name()) else { return notes };
    for left in abandoned(parent, &prefix_beside(name)) {
        match stage_of(&left) {
            Stage::New => remove_files(&left),
            Stage::Old if !place.exists() && fs::rename(&left, place).is_ok() => notes.push(format!(
                "an earlier run was ended while it put its files in place in `{}`; the result before it is there again",
                place.display()
            )),
            Stage::Old => notes.extend(clear(&left, place)),
        }
    }
    notes
}

/// The content of a folder that a killed run left beside an output folder.
enum Stage {
    /// Files that were never put in place, and links to files in place.
    New,
    /// The earlier result.
    Old,
}

fn stage_of(left: &Path) -> Stage {
    let name = left.file_name().map(OsStr::to_string_lossy).unwrap_or_default();
    match name.rsplit_once(SWAP) {
        Some((_, number_of_new)) if number_of_new.parse().ok() != number(left) => Stage::Old,
        None if name.ends_with(OLD) => Stage::Old,
        Some(_) | None => Stage::New,
    }
}

/// The folders in `parent` whose names begin with `prefix` and which no running process has locked.
fn abandoned(parent: &Path, prefix: &OsStr) -> Vec<PathBuf> {
    let entries = fs::read_dir(parent).into_iter().flatten().flatten();
    let ours = entries.filter(|entry| {
        entry.file_name().as_encoded_bytes().starts_with(prefix.as_encoded_bytes())
            && entry.file_type().is_ok_and(|kind| kind.is_dir())
    });
    ours.map(|entry| entry.path()).filter(|path| lock(path).is_some()).collect()
}

/// Removes a folder that is not an output folder any more, or never became one: the files of a run in it, and
/// those that `place` has too. A user's file that came in while the folders were exchanged goes to `place`.
/// Returns a note if something is left.
pub(super) fn clear(left: &Path, place: &Path) -> Option<String> {
    for entry in fs::read_dir(left).into_iter().flatten().flatten() {
        let (name, path) = (entry.file_name(), entry.path());
        let counterpart = place.join(&name);
        let is_result = name.to_str().is_some_and(is_result_name);
        if is_result || same_file(&path, &counterpart) {
            let _ = fs::remove_file(path);
        } else if counterpart.symlink_metadata().is_err() && place.exists() {
            let _ = fs::rename(path, counterpart);
        }
    }
    let removed = fs::remove_dir(left).is_ok() || !left.exists();
    (!removed).then(|| format!("`{}` is left over and can be removed; look into it first", left.display()))
}
