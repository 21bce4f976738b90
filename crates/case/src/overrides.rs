//! Overrides one value in the text of a case file, by the path of its key.
//!
//! The override edits the text instead of the case, so that everything in a file can be overridden, and
//! validation decides. Relative paths in the case file keep their meaning if [`parse`](super::parse) gets the
//! path of the original file with the new text.

mod edit;
mod key_path;

use toml_edit::{DocumentMut, Value};

use super::diagnostics::shown;
use key_path::KeyPath;

/// The reason why a value of a case file cannot be overridden.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("cannot set `{path}`: {kind}")]
pub struct OverrideError {
    /// The given path, shortened to one line of a message.
    pub path: String,
    /// The error, with its remedy.
    pub kind: OverrideErrorKind,
}

/// The kinds of errors of an override. Each text says what would be right.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum OverrideErrorKind {
    /// The path is empty.
    #[error("the path is empty; write the key with the tables that it is in, such as `layer.thickness`")]
    EmptyPath,
    /// Two dots in a row, or one at an end.
    #[error("a key is missing before or after a dot; write for example `layer.thickness`")]
    EmptyKey,
    /// A character that cannot stand in a key without quotes.
    #[error("`{0}` cannot stand in a key; put a key with other characters than A-Z a-z 0-9 _ - in quotes")]
    BadCharacter(char),
    /// A key that begins with a quotation mark and does not end with one.
    #[error("a quotation mark is not closed; write for example `\"my key\".gap`")]
    OpenQuote,
    /// Square brackets without a number.
    #[error("`{0}` is not the number of an entry; entries are counted from 0, such as `conductor[0].name`")]
    BadIndex(String),
    /// More nested tables and arrays than a case file has.
    #[error("the path has more than {max} parts; no key of a case file is that deep")]
    TooDeep {
        /// The largest number of parts.
        max: usize,
    },
    /// A key in place of the number of an entry of an array.
    #[error("`{at}` is an array with {length} entries; say which one, such as `{at}[0]`, counted from 0")]
    IndexMissing {
        /// The path of the array.
        at: String,
        /// The number of its entries.
        length: usize,
    },
    /// The number of an entry for a value that is not an array.
    #[error("`{at}` is {found} and has no entries; leave out the number in brackets")]
    NoArray {
        /// The path of the value.
        at: String,
        /// The kind of value there, with its article.
        found: &'static str,
    },
    /// The number of an entry of an array that does not exist.
    #[error("the case has no array `{0}` whose entry could be set; set the array as a whole")]
    AbsentArray(String),
    /// An entry beyond the end of an array.
    #[error("`{at}` has {length} entries, counted from 0; set the array as a whole to give it more")]
    NoEntry {
        /// The path of the array.
        at: String,
        /// The number of its entries.
        length: usize,
    },
    /// A key below a plain value.
    #[error("`{at}` is {found} and not a table, so it holds no keys; set `{at}` itself")]
    NoTable {
        /// The path of the value.
        at: String,
        /// The kind of value there, with its article.
        found: &'static str,
    },
    /// An empty value.
    #[error("the value is empty; for an empty text write `\"\"`")]
    EmptyValue,
    /// A value that begins like a quoted text, an array or a table, but is not valid TOML.
    #[error("the value `{value}` is not valid TOML: {why}")]
    BadValue {
        /// The given value, shortened to one line of a message.
        value: String,
        /// The message of the parser.
        why: String,
    },
    /// The text of the case file is not valid TOML.
    #[error("the case file is not valid TOML: {0}")]
    NotToml(String),
}

/// The text of a case file with the value at `path` replaced or added. Comments and the order of keys are
/// kept; lines of the result end with a line feed.
///
/// `path` is dotted, with the numbers of entries of arrays in brackets: `layer.thickness`,
/// `conductor[0].box.min[1]`. A key with other characters than `A-Z a-z 0-9 _ -` stands in quotes. Missing
/// tables in the path are made. `value` is TOML; anything else is taken as a text: `40 um` is the same as
/// `"40 um"`.
///
/// Only [`parse`](super::parse) of the result checks that the key exists and the value fits.
///
/// # Errors
/// A path that cannot be read or does not fit the tables and arrays of the file, a value that begins like
/// TOML (`"`, `'`, `[`, `{`) and is not valid, or a source that is not TOML.
///
/// ```
/// let source = "[electrodes.in_plane_pair]\ngap = \"50 um\"   # face to face\n";
/// let changed = elastocap_case::with_value(source, "electrodes.in_plane_pair.gap", "40 um")?;
/// assert_eq!(changed, "[electrodes.in_plane_pair]\ngap = \"40 um\"   # face to face\n");
/// # Ok::<(), elastocap_case::OverrideError>(())
/// ```
pub fn with_value(source: &str, path: &str, value: &str) -> Result<String, OverrideError> {
    let set = || {
        let parts = KeyPath::parse(path)?;
        let value = read_value(value)?;
        let mut document = read_document(source)?;
        edit::set(&mut document, &parts, value)?;
        Ok(document.to_string())
    };
    set().map_err(|kind| OverrideError { path: shown(path), kind })
}

/// The value at `path` as the text of a case file has it, without comments: `"50 um"` with its quotation
/// marks, `1e-3`. `None` if the file does not have it, or has a table or an array of tables under a header
/// there.
///
/// # Errors
/// As for [`with_value`].
pub fn value_at(source: &str, path: &str) -> Result<Option<String>, OverrideError> {
    let get = || {
        let parts = KeyPath::parse(path)?;
        let document = read_document(source)?;
        Ok(edit::get(&document, &parts).map(|value| value.clone().decorated("", "").to_string()))
    };
    get().map_err(|kind| OverrideError { path: shown(path), kind })
}

/// The files that the text of a case names, that is all texts under a key `file`, each once and in the order
/// of the text. Relative paths are relative to the folder of the case file. Empty if the text is not TOML.
pub fn files_of(source: &str) -> Vec<String> {
    let mut found = Vec::new();
    if let Ok(document) = read_document(source) {
        edit::files(document.as_item(), &mut found);
    }
    found
}

fn read_document(source: &str) -> Result<DocumentMut, OverrideErrorKind> {
    source.parse::<DocumentMut>().map_err(|error| {
        let line = error.span().map_or(1, |span| {
            source.as_bytes().iter().take(span.start).filter(|byte| **byte == b'\n').count() + 1
        });
        OverrideErrorKind::NotToml(format!("line {line}: {}", one_line(error.message())))
    })
}

/// The value as TOML, or as a text without quotation marks.
fn read_value(text: &str) -> Result<Value, OverrideErrorKind> {
    let text = text.trim();
    if text.is_empty() {
        return Err(OverrideErrorKind::EmptyValue);
    }
    match text.parse::<Value>() {
        Ok(value) => Ok(value),
        Err(error) if text.starts_with(['"', '\'', '[', '{']) => {
            Err(OverrideErrorKind::BadValue { value: shown(text), why: one_line(error.message()) })
        }
        Err(_) => Ok(Value::from(text)),
    }
}

fn one_line(message: &str) -> String {
    message.lines().map(str::trim).collect::<Vec<_>>().join("; ")
}

#[cfg(test)]
mod tests;
