//! `--watch`: the work is done again each time a case file, or a file that it names, has changed.
//!
//! The files are looked at a few times a second. That takes no thread and no service of the system, and finds changes on network
//! drives and of files that an editor replaces by new ones.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use super::STDIN;
use super::stop::Stop;
use crate::{Exit, output};

/// Time between two looks at the files.
const INTERVAL: Duration = Duration::from_millis(100);

/// The state of a file as seen from outside: when it was written, and its length. `None` where it cannot be found out.
type Stamp = Option<(SystemTime, u64)>;

/// Files, and what was seen of each.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Seen(Vec<(PathBuf, Stamp)>);

impl Seen {
    fn of(files: Vec<PathBuf>) -> Self {
        let stamp = |file: &Path| {
            let data = fs::metadata(file).ok()?;
            Some((data.modified().ok()?, data.len()))
        };
        Self(files.into_iter().map(|file| (file.clone(), stamp(&file))).collect())
    }

    fn again(&self) -> Self {
        Self::of(self.0.iter().map(|(file, _)| file.clone()).collect())
    }
}

/// Does `work`, and does it again after each change, until a signal comes.
pub(super) fn watch(case: &Path, quiet: bool, stop: &Stop, mut work: impl FnMut() -> Exit) -> Exit {
    if case.as_os_str() == STDIN {
        output::error("--watch needs a case file: the standard input does not change");
        return Exit::BadInput;
    }
    stop.install();
    let mut named = Vec::new();
    loop {
        // Looked at before the work reads them: what changes meanwhile is not missed.
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

/// The case file and those that it names: where it cannot be read as TOML, those that it `named` before.
fn files(case: &Path, named: Vec<PathBuf>) -> Vec<PathBuf> {
    let imported = elastocap_case::read_source(case).map(|text| elastocap_case::imported_files(&text, case));
    match imported {
        Ok(imported) if !imported.is_empty() => [vec![case.to_owned()], imported].concat(),
        _ if !named.is_empty() => named,
        _ => vec![case.to_owned()],
    }
}

/// Whether a file has changed, and then kept still for one look, so that it is not read half-written; `false` after a signal.
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

/// The names of the files, all of them where they are few.
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
        let both = [case.clone(), folder.path().join("dome.msh")];
        assert_eq!(files(&case, Vec::new()), both);
        fs::write(&case, "[mesh\nfile = \"dome.msh\"").unwrap();
        assert_eq!(files(&case, both.to_vec()), both);
    }

    #[test]
    fn a_file_that_comes_or_grows_or_goes_has_changed() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a");
        let missing = Seen::of(vec![file.clone()]);
        fs::write(&file, "1").unwrap();
        let there = missing.again();
        assert_ne!(missing, there);
        assert_eq!(there, there.again());
        fs::write(&file, "12").unwrap();
        assert_ne!(there, there.again());
        fs::remove_file(&file).unwrap();
        assert_eq!(there.again(), missing);
    }
}
