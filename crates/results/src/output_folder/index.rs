//! The index files of a folder, which list the files that elastocap wrote.

use std::collections::BTreeSet;
use std::io;
use std::path::Path;

use serde::Deserialize;

use crate::checked_files::read_bounded;
use crate::output_files::{INDEX, MESH_INDEX, is_result_name};

/// The contents of a folder as its index files list them.
#[derive(Debug, Default)]
pub(super) struct Known {
    /// Files that a run or `mesh` wrote.
    pub(super) files: BTreeSet<String>,
    /// Whether the folder holds the result of a run.
    pub(super) run: bool,
    /// Whether all steps of that run have their results.
    pub(super) complete: bool,
}

impl Known {
    /// Reads the index files of `folder`; without one, nothing is known.
    ///
    /// # Errors
    /// If an index cannot be read.
    pub(super) fn of(folder: &Path) -> io::Result<Self> {
        let mut known = Self::default();
        for index in [INDEX, MESH_INDEX] {
            let Some(document) = read_index(&folder.join(index))? else { continue };
            known.files.extend(document.files.into_iter().filter(|name| is_result_name(name)));
            known.files.insert(index.to_owned());
            if index == INDEX {
                known.run = true;
                known.complete = document.status.as_deref() == Some("complete");
            }
        }
        Ok(known)
    }
}

/// The parts of an index that are used here.
#[derive(Debug, Deserialize)]
struct Document {
    /// The version of elastocap, which no other program writes.
    #[expect(dead_code, reason = "a file without it is not from elastocap")]
    versions: Versions,
    status: Option<String>,
    #[serde(default)]
    files: Vec<String>,
}

#[derive(Debug, Deserialize)]
struct Versions {
    #[expect(dead_code, reason = "a file without it is not from elastocap")]
    elastocap: String,
}

/// The content of an index, if the file exists and elastocap wrote it.
fn read_index(file: &Path) -> io::Result<Option<Document>> {
    if file.is_dir() {
        return Ok(None);
    }
    match read_bounded(file) {
        Ok(bytes) => Ok(serde_json::from_slice(&bytes).ok()),
        Err(error) if error.is_missing() => Ok(None),
        Err(error) => {
            let error = io::Error::from(error);
            Err(io::Error::new(error.kind(), format!("`{}` in it cannot be read ({error})", name_of(file))))
        }
    }
}

fn name_of(file: &Path) -> String {
    file.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn a_list_in_result_json_names_no_file_that_a_run_does_not_write() {
        let place = tempfile::tempdir().unwrap();
        let list = r#"["curve.csv", "layer_012.vtu", "profile_0.csv", "../curve.csv", "mine.txt", "step_.vtu", "step_1a.vtu"]"#;
        let text = format!(r#"{{"versions": {{"elastocap": "0"}}, "status": "complete", "files": {list}}}"#);
        fs::write(place.path().join(INDEX), text).unwrap();
        let known = Known::of(place.path()).unwrap();
        let expected = ["curve.csv", "layer_012.vtu", "profile_0.csv", INDEX];
        assert_eq!(known.files, expected.map(str::to_owned).into());
        assert!(known.run && known.complete);
        fs::write(place.path().join(INDEX), r#"{"files": ["curve.csv"]}"#).unwrap();
        assert!(Known::of(place.path()).unwrap().files.is_empty(), "another program's result.json");
    }
}
