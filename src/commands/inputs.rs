//! The cases of a command: their files, and the folder of each.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use elastocap_case::Case;
use elastocap_files::result_name;

use super::STDIN;
use crate::exit::Exit;
use crate::output;

/// A case to be solved.
#[derive(Debug)]
pub(super) struct Input {
    /// The file, as the user named it.
    pub(super) path: PathBuf,
    /// The folder for its results.
    pub(super) folder: PathBuf,
    pub(super) case: Case,
    /// The text that the case was read from.
    pub(super) text: String,
}

/// The reason why a list of cases cannot be used.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
pub(super) enum InputError {
    /// Two cases would be written to one folder.
    #[error(
        "`{}` and `{}` would both be written to `{}`: rename one, or run them one by one with -o",
        first.display(), second.display(), folder.display()
    )]
    SameFolder { first: PathBuf, second: PathBuf, folder: PathBuf },
    /// The standard input, which can be read only once, is given twice.
    #[error("`-`, the standard input, can be given once only")]
    StdinTwice,
}

/// The name of the folder for the results of a case, from the name of its file, or `stdin`.
pub(super) fn folder_name(case: &Path) -> String {
    match case.as_os_str() == STDIN {
        true => "stdin".to_owned(),
        false => result_name(case),
    }
}

/// The folder for the results of each case: that of a single case is `requested`, those of several are in it,
/// or in `results/`.
pub(super) fn folders(cases: &[PathBuf], requested: Option<&Path>) -> Result<Vec<PathBuf>, InputError> {
    if let [case] = cases {
        return Ok(vec![super::output_folder(requested, case)]);
    }
    check_stdin(cases)?;
    let parent = requested.unwrap_or(Path::new("results"));
    let mut taken: HashMap<PathBuf, &PathBuf> = HashMap::new();
    let mut folders = Vec::with_capacity(cases.len());
    for case in cases {
        let folder = parent.join(folder_name(case));
        // Names that differ in case alone are equal on some file systems.
        let key = if cfg!(any(windows, target_os = "macos")) {
            PathBuf::from(folder.to_string_lossy().to_lowercase())
        } else {
            folder.clone()
        };
        if let Some(first) = taken.insert(key, case) {
            return Err(InputError::SameFolder { first: first.clone(), second: case.clone(), folder });
        }
        folders.push(folder);
    }
    Ok(folders)
}

/// Checks that the standard input is given only once.
pub(super) fn check_stdin(cases: &[PathBuf]) -> Result<(), InputError> {
    match cases.iter().filter(|case| case.as_os_str() == STDIN).count() {
        0 | 1 => Ok(()),
        _ => Err(InputError::StdinTwice),
    }
}

/// Loads all cases, and reports all errors in them before it returns. A case that cannot be read because of a
/// defect of the program is left out, and the `Exit` beside the cases tells whether there is one.
pub(super) fn load_all(cases: &[PathBuf], requested: Option<&Path>) -> Result<(Vec<Input>, Exit), Exit> {
    let folders = folders(cases, requested).map_err(|error| {
        output::error(&error.to_string());
        Exit::BadInput
    })?;
    // Every case is loaded before the first error ends the command.
    let loaded: Vec<_> =
        cases.iter().map(|path| super::catching_defects(path, || super::load_with_text(path))).collect();
    let (mut inputs, mut worst) = (Vec::with_capacity(cases.len()), Exit::Done);
    for ((path, folder), loaded) in cases.iter().zip(folders).zip(loaded) {
        match loaded {
            Ok(loaded) => {
                let (text, case) = loaded?;
                inputs.push(Input { path: path.clone(), folder, case, text });
            }
            Err(defect) => worst = worst.or_worse(defect),
        }
    }
    Ok((inputs, worst))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn paths(names: &[&str]) -> Vec<PathBuf> {
        names.iter().map(PathBuf::from).collect()
    }

    #[test]
    fn a_single_case_goes_to_the_folder_and_several_into_it() {
        let out = Some(Path::new("out"));
        assert_eq!(folders(&paths(&["a/x.toml"]), out), Ok(paths(&["out"])));
        assert_eq!(folders(&paths(&["a/x.toml"]), None), Ok(paths(&["results/x"])));
        assert_eq!(folders(&paths(&["-"]), None), Ok(paths(&["results/stdin"])));
        assert_eq!(folders(&paths(&["a/x.toml", "-"]), out), Ok(paths(&["out/x", "out/stdin"])));
        assert_eq!(folders(&paths(&["x.toml", "y"]), None), Ok(paths(&["results/x", "results/y"])));
    }

    #[test]
    fn two_cases_never_share_a_folder() {
        let message = folders(&paths(&["a/x.toml", "b/x.toml"]), None).map_err(|error| error.to_string());
        let message = message.err().unwrap_or_default();
        assert!(
            message.contains("`a/x.toml` and `b/x.toml` would both be written to `results/x`"),
            "{message}"
        );
        assert!(folders(&paths(&["x.toml", "x.toml"]), Some(Path::new("out"))).is_err());
        assert!(folders(&paths(&["...toml", "..toml"]), None).is_err());
        assert!(folders(&paths(&["stdin.toml", "-"]), None).is_err());
        assert_eq!(folders(&paths(&["-", "-"]), None), Err(InputError::StdinTwice));
    }
}
