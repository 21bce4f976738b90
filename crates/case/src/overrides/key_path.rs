//! Parses paths of keys: `electrodes.in_plane_pair.gap`, `conductor[0].box.min[1]`, `"my key".x`.

use std::fmt;

use super::OverrideErrorKind;

/// One part of a path.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Part {
    /// A key of a table.
    Key(String),
    /// An entry of an array, counted from 0.
    Entry(usize),
}

/// The parts of a path, outermost first: at least one, and the first is a key.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct KeyPath(pub(super) Vec<Part>);

/// The largest number of parts: more than any key of a case file has, and few enough for recursive parsers.
const MAX_PARTS: usize = 32;

impl KeyPath {
    /// Parses a path such as `conductor[0].box.min[1]`.
    pub(super) fn parse(text: &str) -> Result<Self, OverrideErrorKind> {
        let mut rest = text.trim();
        if rest.is_empty() {
            return Err(OverrideErrorKind::EmptyPath);
        }
        let mut parts = Vec::new();
        loop {
            let (key, after) = read_key(rest.trim_start())?;
            parts.push(Part::Key(key));
            rest = after.trim_start();
            while let Some(inside) = rest.strip_prefix('[') {
                let (number, after) =
                    inside.split_once(']').ok_or_else(|| OverrideErrorKind::BadIndex(rest.to_owned()))?;
                let index = number.trim().parse().ok().filter(|_| !number.contains('+'));
                parts.push(Part::Entry(
                    index.ok_or_else(|| OverrideErrorKind::BadIndex(format!("[{number}]")))?,
                ));
                rest = after.trim_start();
            }
            if parts.len() > MAX_PARTS {
                return Err(OverrideErrorKind::TooDeep { max: MAX_PARTS });
            }
            match rest.chars().next() {
                None => return Ok(Self(parts)),
                Some('.') => rest = &rest[1..],
                Some(other) => return Err(OverrideErrorKind::BadCharacter(other)),
            }
        }
    }
}

/// The key at the beginning of the text, and the rest.
fn read_key(text: &str) -> Result<(String, &str), OverrideErrorKind> {
    if text.starts_with(['"', '\'']) {
        return read_quoted_key(text);
    }
    let end = text.find(|c: char| !is_bare(c)).unwrap_or(text.len());
    let (key, rest) = text.split_at(end);
    match (key, rest.chars().next()) {
        ("", None | Some('.')) => Err(OverrideErrorKind::EmptyKey),
        ("", Some('[')) => Err(OverrideErrorKind::EmptyKey),
        ("", Some(other)) => Err(OverrideErrorKind::BadCharacter(other)),
        _ => Ok((key.to_owned(), rest)),
    }
}

/// The quoted key at the beginning of the text, as in TOML: backslashes escape in double quotation marks, and
/// are literal in single ones.
fn read_quoted_key(text: &str) -> Result<(String, &str), OverrideErrorKind> {
    let quote = text.chars().next().unwrap_or('"');
    let mut escaped = false;
    let end = text.char_indices().skip(1).find(|&(_, c)| {
        let closes = c == quote && !escaped;
        escaped = quote == '"' && c == '\\' && !escaped;
        closes
    });
    let (end, _) = end.ok_or(OverrideErrorKind::OpenQuote)?;
    let (quoted, rest) = text.split_at(end + 1);
    match toml_edit::Key::parse(quoted).ok().as_deref() {
        Some([key]) => Ok((key.get().to_owned(), rest)),
        _ => Err(OverrideErrorKind::OpenQuote),
    }
}

/// Whether a key with this character may stand without quotation marks.
fn is_bare(c: char) -> bool {
    c.is_ascii_alphanumeric() || c == '_' || c == '-'
}

impl fmt::Display for KeyPath {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write_parts(&self.0, f)
    }
}

/// The text of the parts of a path.
pub(super) fn written(parts: &[Part]) -> String {
    KeyPath(parts.to_vec()).to_string()
}

/// Writes the parts of a path, with quotation marks where a key needs them.
fn write_parts(parts: &[Part], f: &mut fmt::Formatter<'_>) -> fmt::Result {
    for (k, part) in parts.iter().enumerate() {
        match part {
            Part::Key(key) => {
                let dot = if k == 0 { "" } else { "." };
                if !key.is_empty() && key.chars().all(is_bare) {
                    write!(f, "{dot}{key}")?;
                } else {
                    write!(f, "{dot}\"{}\"", key.escape_debug())?;
                }
            }
            Part::Entry(index) => write!(f, "[{index}]")?,
        }
    }
    Ok(())
}
