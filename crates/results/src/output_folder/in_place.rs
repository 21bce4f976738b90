//! Puts files in place one by one, where the folder cannot be replaced as a whole: it is a mount point, the
//! current folder of a process, or contains folders of the user.
//!
//! The complete new files are first in a folder [`COMMIT`], with a plan of the moves. From then on a process
//! that ends in between leaves a folder without `result.json`, and the next run completes it by the plan. If
//! the system reports an error, the moves are undone.

use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::Path;

use elastocap_files::is_plain_name;
use serde::{Deserialize, Serialize};

use super::disk::{remove_files, sync_file, sync_files, sync_folder};
use super::staging::Staging;
use crate::checked_files::read_bounded;
use crate::output_files::INDEX;

/// The folder, inside the output folder, from which files go to their places.
pub(super) const COMMIT: &str = ".elastocap-commit";
/// The folder for replaced or removed files, inside that folder.
const OLD: &str = "old";
/// The file with the plan, inside that folder.
const PLAN: &str = ".plan";

/// The moves to be made.
#[derive(Debug, Serialize, Deserialize)]
struct Plan {
    /// The files that leave the folder: those of an earlier run, and replaced ones.
    remove: BTreeSet<String>,
    /// The new files.
    place: BTreeSet<String>,
}

/// The failure to put files in place.
#[derive(Debug)]
pub(super) struct NotPlaced {
    /// The error that the system reports.
    pub(super) source: io::Error,
    /// Whether all moves were undone.
    pub(super) undone: bool,
}

impl From<io::Error> for NotPlaced {
    fn from(source: io::Error) -> Self {
        Self { source, undone: true }
    }
}

/// Moves the files `names` from `staging` to `target`, and removes the files `remove` from there.
pub(super) fn place(
    staging: &Path,
    target: &Path,
    remove: &BTreeSet<String>,
    names: &BTreeSet<String>,
) -> Result<(), NotPlaced> {
    let exists = |name: &&String| target.join(name.as_str()).symlink_metadata().is_ok();
    let plan =
        Plan { remove: names.iter().chain(remove).filter(exists).cloned().collect(), place: names.clone() };
    let text = serde_json::to_vec(&plan).map_err(io::Error::from)?;
    fs::write(staging.join(PLAN), text)?;
    sync_file(&staging.join(PLAN))?;
    sync_folder(staging)?;
    let commit = target.join(COMMIT);
    match fs::rename(staging, &commit) {
        Err(error) if error.kind() == io::ErrorKind::CrossesDevices => {
            copy_across(staging, target, names, &commit)?;
        }
        result => result?,
    }
    carry_out(&commit, target, &plan).map_err(|source| {
        let undone = undo(&commit, target, &plan).is_ok();
        NotPlaced { source, undone }
    })?;
    tidy_up(&commit, target);
    Ok(())
}

/// Moves the files of `staging` to `commit` by copying, for a `staging` on another disk.
fn copy_across(staging: &Path, target: &Path, names: &BTreeSet<String>, commit: &Path) -> io::Result<()> {
    let copies = Staging::inside(target, &[], &mut |_| ())?;
    let copy = || {
        let names: Vec<&str> = names.iter().map(String::as_str).chain([PLAN]).collect();
        for name in &names {
            fs::copy(staging.join(name), copies.path.join(name))?;
        }
        let files: Vec<_> = names.iter().map(|name| copies.path.join(name)).collect();
        sync_files(&files).map_err(|(_, error)| error)?;
        sync_folder(&copies.path)?;
        fs::rename(&copies.path, commit)
    };
    let copied = copy();
    match copied {
        Ok(()) => remove_files(staging),
        Err(_) => remove_files(&copies.path),
    }
    copied
}

/// Completes the moves of a process that ended before it had made them all. `false` if `left` is not a folder
/// of such moves.
pub(super) fn complete(left: &Path, target: &Path) -> io::Result<bool> {
    if left.file_name().is_none_or(|name| name != COMMIT) {
        return Ok(false);
    }
    let text = match read_bounded(&left.join(PLAN)) {
        Ok(text) => text,
        // The plan is removed last before the folder, so without it all files are in place.
        Err(error) if error.is_missing() => {
            tidy_up(left, target);
            return Ok(true);
        }
        Err(error) => return Err(error.into()),
    };
    let plan: Plan = serde_json::from_slice(&text)?;
    // A plan from elsewhere must not move files of other folders.
    if !plan.remove.iter().chain(&plan.place).all(|name| is_plain_name(name)) {
        return Err(io::Error::new(io::ErrorKind::InvalidData, "its plan names files elsewhere"));
    }
    carry_out(left, target, &plan)?;
    tidy_up(left, target);
    Ok(true)
}

/// Carries out a plan from any state: a file that is not in the folder any more is already in place.
fn carry_out(commit: &Path, target: &Path, plan: &Plan) -> io::Result<()> {
    let old = commit.join(OLD);
    match fs::create_dir(&old) {
        Err(error) if error.kind() != io::ErrorKind::AlreadyExists => return Err(error),
        _ => {}
    }
    let waits = |name: &String| commit.join(name).symlink_metadata().is_ok();
    // The index leaves first and comes last: a folder without it holds no result.
    let is_other = |name: &&String| *name != INDEX;
    let mut leaving: Vec<&String> = plan.remove.iter().collect();
    leaving.sort_by_key(is_other);
    for name in leaving {
        let path = target.join(name);
        if (waits(name) || !plan.place.contains(name)) && path.symlink_metadata().is_ok() {
            fs::rename(path, old.join(name))?;
        }
    }
    sync_folder(target)?;
    let mut coming: Vec<&String> = plan.place.iter().filter(|name| waits(name)).collect();
    coming.sort_by_key(|name| !is_other(name));
    for name in coming {
        fs::rename(commit.join(name), target.join(name))?;
    }
    sync_folder(target)
}

/// Undoes all moves.
fn undo(commit: &Path, target: &Path, plan: &Plan) -> io::Result<()> {
    let old = commit.join(OLD);
    let is_other = |name: &&String| *name != INDEX;
    let mut placed: Vec<&String> =
        plan.place.iter().filter(|name| commit.join(name).symlink_metadata().is_err()).collect();
    placed.sort_by_key(is_other);
    for name in placed {
        fs::rename(target.join(name), commit.join(name))?;
    }
    let mut gone: Vec<&String> =
        plan.remove.iter().filter(|name| old.join(name).symlink_metadata().is_ok()).collect();
    gone.sort_by_key(|name| !is_other(name));
    for name in gone {
        fs::rename(old.join(name), target.join(name))?;
    }
    let _ = fs::remove_dir(&old);
    remove_files(commit);
    Ok(())
}

/// Removes the remaining files when all new files are in place.
fn tidy_up(commit: &Path, target: &Path) {
    remove_files(&commit.join(OLD));
    remove_files(commit);
    let _ = sync_folder(target);
}
