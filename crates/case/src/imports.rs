//! Which files a case file names.

use std::path::{Path, PathBuf};

use toml::de::{DeTable, DeValue};

/// The files that the text of a case names under a key `file` (surfaces, meshes), in the order of the text and each once; relative
/// paths are taken from the folder of `origin`. It does not matter whether the files are there or the case is valid, so that a caller
/// can wait for them to change. Text that is not TOML names none.
pub fn imported_files(text: &str, origin: &Path) -> Vec<PathBuf> {
    let folder = origin.parent().unwrap_or(Path::new(""));
    let mut files = Vec::new();
    if let Ok(document) = DeTable::parse(text) {
        collect_table(document.get_ref(), folder, &mut files);
    }
    files
}

fn collect_table(table: &DeTable<'_>, folder: &Path, files: &mut Vec<PathBuf>) {
    for (key, value) in table {
        match value.get_ref() {
            DeValue::String(name) if key.get_ref() == "file" => {
                let path = folder.join(name.as_ref());
                if !files.contains(&path) {
                    files.push(path);
                }
            }
            value => collect(value, folder, files),
        }
    }
}

fn collect(value: &DeValue<'_>, folder: &Path, files: &mut Vec<PathBuf>) {
    match value {
        DeValue::Table(table) => collect_table(table, folder, files),
        DeValue::Array(entries) => entries.iter().for_each(|entry| collect(entry.get_ref(), folder, files)),
        DeValue::String(_)
        | DeValue::Integer(_)
        | DeValue::Float(_)
        | DeValue::Boolean(_)
        | DeValue::Datetime(_) => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_found_in_tables_and_arrays_and_each_once() {
        let text = r#"
            title = "file"
            [mesh]
            file = "dome.msh"
            [[conductor]]
            surface = { file = "/abs/a.obj", unit = "mm" }
            [[conductor]]
            surface = { file = "dome.msh" }
            [[dielectric]]
            anything = [[{ file = "b.obj" }]]
        "#;
        let mut files = imported_files(text, Path::new("sub/case.toml"));
        files.sort();
        assert_eq!(files, ["/abs/a.obj", "sub/b.obj", "sub/dome.msh"].map(PathBuf::from));
        assert_eq!(imported_files(text, Path::new("<stdin>")).len(), 3);
        assert!(imported_files("not [ toml", Path::new("case.toml")).is_empty());
    }
}
