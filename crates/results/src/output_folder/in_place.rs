//! Files put in place one by one, where the folder cannot be replaced as a whole: it is a mount point, someone's current
//! folder, or has folders of the user in it.
//!
//! The new files are complete in a folder [`COMMIT`] first, with a plan of what goes where. From then on the way leads forward
//! only: what ends the process in between leaves a folder without `result.json`, and the next run completes it by the plan. An
//! error that the system reports is undone.

use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::Path;

use elastocap_files::is_plain_name;
use serde::{Deserialize, Serialize};

use super::disk::{remove_files, sync_file, sync_files, sync_folder};
use super::index::INDEX;
use super::staging::Staging;
use crate::own_files::read_own;

/// The folder, inside the output folder, from which files go to their places.
pub(super) const COMMIT: &str = ".elastocap-commit";
/// Where the files go that are replaced or removed, inside that folder.
const OLD: &str = "old";
/// The plan, inside that folder.
const PLAN: &str = ".plan";

#[derive(Debug, Serialize, Deserialize)]
struct Plan {
    /// Files that leave the folder: those of an earlier run, and those that are replaced.
    remove: BTreeSet<String>,
    /// Files that come.
    place: BTreeSet<String>,
}

/// Why files could not be put in place.
#[derive(Debug)]
pub(super) struct NotPlaced {
    /// The error that the system reports.
    pub(super) source: io::Error,
    /// Whether it is all as it was before.
    pub(super) undone: bool,
}

impl From<io::Error> for NotPlaced {
    fn from(source: io::Error) -> Self {
        Self { source, undone: true }
    }
}

/// Puts the files `names`, which stand in `staging`, in place in `target`, where the files `remove` go.
pub(super) fn place(
    staging: &Path,
    target: &Path,
    remove: &BTreeSet<String>,
    names: &BTreeSet<String>,
) -> Result<(), NotPlaced> {
    let there = |name: &&String| target.join(name.as_str()).symlink_metadata().is_ok();
    let plan =
        Plan { remove: names.iter().chain(remove).filter(there).cloned().collect(), place: names.clone() };
    let text = serde_json::to_vec(&plan).map_err(io::Error::from)?;
    fs::write(staging.join(PLAN), text)?;
    sync_file(&staging.join(PLAN))?;
    sync_folder(staging)?;
    let commit = target.join(COMMIT);
    match fs::rename(staging, &commit) {
        Err(error) if error.kind() == io::ErrorKind::CrossesDevices => {
            copy_across(staging, target, names, &commit)?;
        }
        moved => moved?,
    }
    carry_out(&commit, target, &plan).map_err(|source| {
        let undone = undo(&commit, target, &plan).is_ok();
        NotPlaced { source, undone }
    })?;
    tidy_up(&commit, target);
    Ok(())
}

/// Does what renaming `staging` to `commit` would do, where `staging` is on another disk: its files are copied.
fn copy_across(staging: &Path, target: &Path, names: &BTreeSet<String>, commit: &Path) -> io::Result<()> {
    let here = Staging::inside(target, &[], &mut |_| ())?;
    let copied = || {
        let names: Vec<&str> = names.iter().map(String::as_str).chain([PLAN]).collect();
        for name in &names {
            fs::copy(staging.join(name), here.path.join(name))?;
        }
        let files: Vec<_> = names.iter().map(|name| here.path.join(name)).collect();
        sync_files(&files).map_err(|(_, error)| error)?;
        sync_folder(&here.path)?;
        fs::rename(&here.path, commit)
    };
    let copied = copied();
    match copied {
        Ok(()) => remove_files(staging),
        Err(_) => remove_files(&here.path),
    }
    copied
}

/// Completes what a process began that was ended in between. `false` if `left` is not such a folder.
pub(super) fn complete(left: &Path, target: &Path) -> io::Result<bool> {
    if left.file_name().is_none_or(|name| name != COMMIT) {
        return Ok(false);
    }
    let text = match read_own(&left.join(PLAN)) {
        Ok(text) => text,
        // Without a plan it is done: the plan is removed last but for the folder.
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

/// Goes on from wherever the plan is: a file that is not in the folder any more has been put in place.
fn carry_out(commit: &Path, target: &Path, plan: &Plan) -> io::Result<()> {
    let old = commit.join(OLD);
    match fs::create_dir(&old) {
        Err(error) if error.kind() != io::ErrorKind::AlreadyExists => return Err(error),
        _ => {}
    }
    let waits = |name: &String| commit.join(name).symlink_metadata().is_ok();
    // The index goes first and comes last: a folder without it holds no result.
    let first = |name: &&String| *name != INDEX;
    let mut leaving: Vec<&String> = plan.remove.iter().collect();
    leaving.sort_by_key(first);
    for name in leaving {
        let there = target.join(name);
        if (waits(name) || !plan.place.contains(name)) && there.symlink_metadata().is_ok() {
            fs::rename(there, old.join(name))?;
        }
    }
    sync_folder(target)?;
    let mut coming: Vec<&String> = plan.place.iter().filter(|name| waits(name)).collect();
    coming.sort_by_key(|name| !first(name));
    for name in coming {
        fs::rename(commit.join(name), target.join(name))?;
    }
    sync_folder(target)
}

/// Takes everything back.
fn undo(commit: &Path, target: &Path, plan: &Plan) -> io::Result<()> {
    let old = commit.join(OLD);
    let first = |name: &&String| *name != INDEX;
    let mut placed: Vec<&String> =
        plan.place.iter().filter(|name| commit.join(name).symlink_metadata().is_err()).collect();
    placed.sort_by_key(first);
    for name in placed {
        fs::rename(target.join(name), commit.join(name))?;
    }
    let mut gone: Vec<&String> =
        plan.remove.iter().filter(|name| old.join(name).symlink_metadata().is_ok()).collect();
    gone.sort_by_key(|name| !first(name));
    for name in gone {
        fs::rename(old.join(name), target.join(name))?;
    }
    let _ = fs::remove_dir(&old);
    remove_files(commit);
    Ok(())
}

/// Removes what is left when all files are in place.
fn tidy_up(commit: &Path, target: &Path) {
    remove_files(&commit.join(OLD));
    remove_files(commit);
    let _ = sync_folder(target);
}
