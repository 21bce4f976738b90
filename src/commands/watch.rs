//! `--watch`: repeats the work each time a case file, or a file that it names, has changed.
//!
//! The files are checked a few times a second. That takes no thread and no service of the system, and also
//! detects changes on network drives and files that an editor replaces.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use super::STDIN;
use super::stop::Stop;
use crate::exit::Exit;
use crate::output;

/// The time between two checks of the files.
const INTERVAL: Duration = Duration::from_millis(100);

/// The modification time and the length of a file. `None` if they are unknown.
type Stamp = Option<(SystemTime, u64)>;

/// Files, with the state of each when it was last checked.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Seen(Vec<(PathBuf, Stamp)>);

impl Seen {
    /// The state of these files now.
    fn of(files: Vec<PathBuf>) -> Self {
        let stamp = |file: &Path| {
            let data = fs::metadata(file).ok()?;
            Some((data.modified().ok()?, data.len()))
        };
        Self(files.into_iter().map(|file| (file.clone(), stamp(&file))).collect())
    }

    /// The state of the same files now.
    fn again(&self) -> Self {
        Self::of(self.0.iter().map(|(file, _)| file.clone()).collect())
    }
}

/// Does `work`, and repeats it after each change, until a signal comes.
pub(super) fn watch(case: &Path, quiet: bool, stop: &Stop, mut work: impl FnMut() -> Exit) -> Exit {
    if case.as_os_str() == STDIN {
        output::error("--watch needs a case file: the standard input does not change");
        return Exit::BadInput;
    }
    stop.install();
    let mut named = Vec::new();
    loop {
        // The state is taken before the work reads the files, so that changes meanwhile are not missed.
        named = files(case, named);
        let seen = Seen::of(named.clone());
        let exit = work();
        if stop.is_asked() {
            return exit;
        }
        if !quiet {
            output::message(&format!("waiting for a change of {}; Ctrl-C ends", listed(&named)));
        }
        if !wait_for_change(seen, stop) {
            return Exit::Done;
        }
    }
}

/// The case file and the files that it names. If it names none, perhaps because it is not valid TOML at the
/// moment, these are the files `named` before.
fn files(case: &Path, named: Vec<PathBuf>) -> Vec<PathBuf> {
    let imported = elastocap_case::read_source(case).map(|text| elastocap_case::imported_files(&text, case));
    match imported {
        Ok(imported) if !imported.is_empty() => [vec![case.to_owned()], imported].concat(),
        _ if !named.is_empty() => named,
        _ => vec![case.to_owned()],
    }
}

/// Waits until a file has changed and then stays unchanged for one check, so that it is not read
/// half-written; `false` after a signal.
fn wait_for_change(before: Seen, stop: &Stop) -> bool {
    let mut last = before.clone();
    loop {
        std::thread::sleep(INTERVAL);
        if stop.is_asked() {
            return false;
        }
        let now = last.again();
        if now != before && now == last {
            return true;
        }
        last = now;
    }
}

/// The names of the files, shortened if they are many.
fn listed(files: &[PathBuf]) -> String {
    const SHOWN: usize = 3;
    let names: Vec<_> = files.iter().take(SHOWN).map(|file| format!("`{}`", file.display())).collect();
    match files.len() - names.len() {
        0 => names.join(", "),
        more => format!("{} and {more} more", names.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops by panicking")]

    use super::*;

    #[test]
    fn the_files_that_a_case_names_are_watched_also_while_it_is_broken() {
        let folder = tempfile::tempdir().unwrap();
        let case = folder.path().join("case.toml");
        assert_eq!(files(&case, Vec::new()), vec![case.clone()], "it need not be there");
        fs::write(&case, "[mesh]\nfile = \"dome.msh\"").unwrap();
        let files_of_case = [case.clone(), folder.path().join("dome.msh")];
        assert_eq!(files(&case, Vec::new()), files_of_case);
        fs::write(&case, "[mesh\nfile = \"dome.msh\"").unwrap();
        assert_eq!(files(&case, files_of_case.to_vec()), files_of_case);
    }

    #[test]
    fn a_file_that_comes_or_grows_or_goes_has_changed() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a");
        let missing = Seen::of(vec![file.clone()]);
        fs::write(&file, "1").unwrap();
        let present = missing.again();
        assert_ne!(missing, present);
        assert_eq!(present, present.again());
        fs::write(&file, "12").unwrap();
        assert_ne!(present, present.again());
        fs::remove_file(&file).unwrap();
        assert_eq!(present.again(), missing);
    }
}
