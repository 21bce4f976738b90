//! The files that a case file names.

use std::path::{Path, PathBuf};

use super::overrides::files_of;

/// The files that the text of a case names under a key `file` (surfaces, meshes, measured points), in the
/// order of the text and each once; relative paths are taken from the folder of `origin`. Neither need the
/// files exist nor the case be valid, so that a caller can wait for changes. Text that is not TOML names
/// none.
pub fn imported_files(text: &str, origin: &Path) -> Vec<PathBuf> {
    let folder = origin.parent().unwrap_or(Path::new(""));
    files_of(text).into_iter().map(|name| folder.join(name)).collect()
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
        let files = imported_files(text, Path::new("sub/case.toml"));
        assert_eq!(files, ["sub/dome.msh", "/abs/a.obj", "sub/b.obj"].map(PathBuf::from));
        assert_eq!(imported_files(text, Path::new("<stdin>")).len(), 3);
        assert!(imported_files("not [ toml", Path::new("case.toml")).is_empty());
    }
}
