//! Overrides: the text of a case file with one value changed, by the path of its key.
//!
//! The text is edited and not the case, so that whatever can be written in a file can be overridden, and validation has the last word.
//! Paths relative to the case file keep their meaning if the new text is read by [`parse`](super::parse) with the file's own path.

mod edit;
mod key_path;

use toml_edit::{DocumentMut, Value};

use super::diagnostics::shown;
use key_path::KeyPath;

/// Why a value of a case file cannot be overridden.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("cannot set `{path}`: {kind}")]
pub struct OverrideError {
    /// The path as it was given, fit for one line of a message.
    pub path: String,
    /// The error, with its cure.
    pub kind: OverrideErrorKind,
}

/// The error of an override. Each text says what would be right.
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
    /// More tables and arrays inside each other than a case file has.
    #[error("the path has more than {max} parts; no key of a case file is that deep")]
    TooDeep {
        /// The largest number of parts.
        max: usize,
    },
    /// A key where the file has an array.
    #[error("`{at}` is an array with {length} entries; say which one, such as `{at}[0]`, counted from 0")]
    IndexMissing {
        /// Where the array is.
        at: String,
        /// How many entries it has.
        length: usize,
    },
    /// The number of an entry where the file has something else than an array.
    #[error("`{at}` is {found} and has no entries; leave out the number in brackets")]
    NoArray {
        /// Where it is.
        at: String,
        /// The kind of value there, with its article.
        found: &'static str,
    },
    /// The number of an entry of an array that is not there.
    #[error("the case has no array `{0}` whose entry could be set; set the array as a whole")]
    AbsentArray(String),
    /// An entry that the array does not have.
    #[error("`{at}` has {length} entries, counted from 0; set the array as a whole to give it more")]
    NoEntry {
        /// Where the array is.
        at: String,
        /// How many entries it has.
        length: usize,
    },
    /// A key inside a plain value.
    #[error("`{at}` is {found} and not a table, so it holds no keys; set `{at}` itself")]
    NoTable {
        /// Where it is.
        at: String,
        /// The kind of value there, with its article.
        found: &'static str,
    },
    /// Nothing to set.
    #[error("the value is empty; for an empty text write `\"\"`")]
    EmptyValue,
    /// A value that begins as a text in quotes, an array or a table and goes on as none.
    #[error("the value `{value}` is not valid TOML: {why}")]
    BadValue {
        /// The value as it was given, fit for one line of a message.
        value: String,
        /// The message of the parser.
        why: String,
    },
    /// The text of the case file is not valid TOML.
    #[error("the case file is not valid TOML: {0}")]
    NotToml(String),
}

/// The text of a case file with the value at `path` replaced or added; comments and the order of keys are kept. Lines of the result end with a
/// line feed alone.
///
/// `path` is dotted, with the numbers of entries of arrays in brackets: `layer.thickness`, `conductor[0].box.min[1]`. A key with other
/// characters than `A-Z a-z 0-9 _ -` stands in quotes. Tables on the way that do not exist are made. `value` is TOML; what is not TOML is
/// taken as a text: `40 um` is the same as `"40 um"`.
///
/// Whether the key exists and the value fits is told by [`parse`](super::parse) of the result.
///
/// # Errors
/// A path that cannot be read or does not fit the tables and arrays of the file, a value that begins like TOML (`"`, `'`, `[`, `{`) and is
/// none, or a source that is not TOML.
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

/// The value at `path` as it is written in the text of a case file, without comments: `"50 um"` with its quotation marks, `1e-3`. `None` if the
/// file does not have it, or has a table or an array of tables under a header of its own there.
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

/// The files that the text of a case names, in the order of the text and each once: all texts under a key `file`. Relative ones are relative to
/// the folder of the case file. Empty where the text is not TOML.
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

/// TOML, or a text without quotation marks.
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
