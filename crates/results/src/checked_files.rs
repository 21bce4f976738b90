//! Reads files that elastocap wrote earlier, but that may have been changed since, or come from elsewhere.

use std::path::Path;

use elastocap_files::ReadError;

/// The largest size of a file that is read as a whole, bytes.
const LARGEST_FILE: u64 = 512 << 20;

/// The largest size of a file that is copied, such as the field of a step, bytes.
const LARGEST_COPY: u64 = 64 << 30;

/// The bytes of a regular file of at most 512 MiB.
///
/// # Errors
/// [`ReadError`] if the file is missing, larger, not regular, or unreadable.
pub fn read_bounded(file: &Path) -> Result<Vec<u8>, ReadError> {
    elastocap_files::read(file, LARGEST_FILE)
}

/// Copies a regular file of at most 64 GiB to a new file.
pub(crate) fn copy_bounded(from: &Path, to: &Path) -> Result<(), ReadError> {
    elastocap_files::copy(from, to, LARGEST_COPY)
}

/// The position of an error in JSON, and its kind. The text itself is left out: the file may be one that was
/// named by mistake.
pub fn fault(error: &serde_json::Error) -> String {
    use serde_json::error::Category;
    let place = format!("line {}, column {}", error.line(), error.column());
    match error.classify() {
        Category::Syntax => format!("{place}: not valid JSON"),
        Category::Data => format!("{place}: JSON of another form"),
        Category::Eof => "its text ends early".to_owned(),
        Category::Io => "it cannot be read".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_says_where_it_is_and_shows_nothing_of_the_text() {
        let fault_in = |text: &str| serde_json::from_str::<Vec<u32>>(text).map_err(|error| fault(&error));
        assert_eq!(fault_in("\"secret\""), Err("line 1, column 8: JSON of another form".to_owned()));
        assert_eq!(fault_in("[1,\nsecret"), Err("line 2, column 1: not valid JSON".to_owned()));
        assert_eq!(fault_in("[1"), Err("its text ends early".to_owned()));
    }
}
