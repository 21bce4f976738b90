//! Which files of a folder are elastocap's own.

use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::Path;

use serde_json::Value;

use crate::report::REPORT;
use crate::resume::RESUME;

/// The file that says what the results folder of a run holds.
pub(crate) const INDEX: &str = "result.json";

/// The file that says what `elastocap mesh` has written.
pub(crate) const MESH_INDEX: &str = "mesh.json";

/// What is known of a folder from the files that list its contents.
#[derive(Debug, Default)]
pub(super) struct Known {
    /// Files that a run or `mesh` wrote.
    pub(super) files: BTreeSet<String>,
    /// Whether they are the result of a run.
    pub(super) run: bool,
    /// Whether all steps of that run have their results.
    pub(super) complete: bool,
}

impl Known {
    /// Reads what `folder` says of itself; nothing is known where it says nothing.
    ///
    /// # Errors
    /// When it says something that cannot be read.
    pub(super) fn of(folder: &Path) -> io::Result<Self> {
        let mut known = Self::default();
        for index in [INDEX, MESH_INDEX] {
            let Some(document) = own_document(&folder.join(index))? else { continue };
            let list = document.get("files").and_then(Value::as_array);
            let names = list.into_iter().flatten().filter_map(Value::as_str);
            known.files.extend(names.filter(|name| is_result_name(name)).map(str::to_owned));
            known.files.insert(index.to_owned());
            if index == INDEX {
                known.run = true;
                known.complete = document.get("status").and_then(Value::as_str) == Some("complete");
            }
        }
        Ok(known)
    }
}

/// The content of an index, if it is there and elastocap wrote it.
fn own_document(file: &Path) -> io::Result<Option<Value>> {
    let bytes = match fs::read(file) {
        Ok(bytes) => bytes,
        Err(error) if matches!(error.kind(), io::ErrorKind::NotFound | io::ErrorKind::IsADirectory) => {
            return Ok(None);
        }
        Err(error) => return Err(error),
    };
    let document = serde_json::from_slice(&bytes).ok();
    Ok(document.filter(|document: &Value| document.pointer("/versions/elastocap").is_some()))
}

/// Whether a run or `mesh` gives files this name. No other file is ever removed, whatever a list says.
pub(crate) fn is_result_name(name: &str) -> bool {
    const FILES: [&str; 12] = [
        "approach.svg",
        "capacitance.csv",
        "curve.csv",
        "curve.svg",
        "fields.pvd",
        "layer.pvd",
        "mechanics.csv",
        REPORT,
        "scene.glb",
        INDEX,
        MESH_INDEX,
        RESUME,
    ];
    const NUMBERED: [(&str, &str); 4] =
        [("step_", ".vtu"), ("section_", ".svg"), ("layer_", ".vtu"), ("profile_", ".csv")];
    let numbered = |(before, after): &(&str, &str)| {
        let number = name.strip_prefix(before).and_then(|rest| rest.strip_suffix(after));
        number.is_some_and(|n| !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit()))
    };
    FILES.contains(&name) || NUMBERED.iter().any(numbered)
}

#[cfg(test)]
mod tests {
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
