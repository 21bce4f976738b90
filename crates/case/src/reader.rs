//! Walks the parsed TOML and turns it into the raw types, collecting every problem on the way.
//!
//! A raw type defines three things through [`FromToml`]: how it is read, how messages describe it, and its
//! JSON Schema. That keeps messages and schema consistent with the accepted values.

use std::collections::BTreeMap;
use std::ops::Range;

use serde_json::Value;
use toml::Spanned;
use toml::de::DeValue;

use super::diagnostics::{Diagnostic, KEPT, shown};
use super::units::{self, Dimension};

/// A raw type: a value to the right of `=` or a table under a header.
pub(super) trait FromToml: Sized {
    /// The expected kind of value, for messages: "a length, such as ...". Empty if messages are not to offer
    /// this alternative.
    fn expected() -> String;
    /// A valid right-hand side, for `help:` lines.
    fn sample(log: &Log<'_>) -> String;
    /// Whether the value has the TOML type that this type reads, valid or not.
    fn accepts(value: &DeValue<'_>) -> bool;
    /// The right-hand side that was probably meant by a value of the wrong TOML type; `None` if it cannot be
    /// guessed.
    fn mended(_value: &Spanned<DeValue<'_>>, _log: &Log<'_>) -> Option<String> {
        None
    }
    /// Reads the value; `None` if it is invalid, with the reason in the log.
    fn from_toml(node: Node<'_>, log: &mut Log<'_>) -> Option<Self>;
    /// The JSON Schema of valid values.
    fn schema() -> Value;
}

/// A value of the file, if it could be read, and its place.
#[derive(Debug, Clone)]
pub(super) struct Read<T> {
    /// The place in the file, in bytes.
    pub(super) span: Range<usize>,
    /// The value; `None` if it could not be read, with the reason in the log.
    pub(super) value: Option<T>,
}

impl<T> Read<T> {
    /// The value, if it could be read.
    pub(super) fn get(&self) -> Option<&T> {
        self.value.as_ref()
    }
}

impl<T: FromToml> Read<T> {
    /// Reads the value at `node`.
    pub(super) fn from_node(node: Node<'_>, log: &mut Log<'_>) -> Self {
        Self { span: node.value.span(), value: T::from_toml(node, log) }
    }
}

/// A key of a table: required if its type is [`Read`], optional if it is `Option<Read>`.
pub(super) trait Field {
    /// The type of the value.
    type Inner: FromToml;
    const REQUIRED: bool;
    /// The field for a key that is present.
    fn present(read: Read<Self::Inner>) -> Self;
    /// The field for a key that is absent; `table` is the place of the table in the file.
    fn absent(table: &Range<usize>) -> Self;
}

impl<T: FromToml> Field for Read<T> {
    type Inner = T;
    const REQUIRED: bool = true;
    fn present(read: Read<T>) -> Self {
        read
    }
    fn absent(table: &Range<usize>) -> Self {
        Self { span: table.clone(), value: None }
    }
}

impl<T: FromToml> Field for Option<Read<T>> {
    type Inner = T;
    const REQUIRED: bool = false;
    fn present(read: Read<T>) -> Self {
        Some(read)
    }
    fn absent(_: &Range<usize>) -> Self {
        None
    }
}

/// A value with the names that messages need.
#[derive(Debug, Clone, Copy)]
pub(super) struct Node<'a> {
    pub(super) value: &'a Spanned<DeValue<'a>>,
    /// The key of the value, or of the array that it is an entry of.
    pub(super) key: &'a str,
    /// Whether the value is an entry of an array.
    pub(super) entry: bool,
    /// The dotted path of the table around it; empty at the top level.
    pub(super) table: &'a str,
}

impl Node<'_> {
    /// Dotted path of this value.
    pub(super) fn path(&self) -> String {
        if self.table.is_empty() { self.key.to_owned() } else { format!("{}.{}", self.table, self.key) }
    }

    /// The name of the value in a message: "`gap` in [electrodes.in_plane_pair]".
    pub(super) fn place(&self) -> String {
        let article = if self.entry { "an entry of " } else { "" };
        let key = shown(self.key);
        match self.table {
            "" => format!("{article}`{key}`"),
            table => format!("{article}`{key}` {}", within(table)),
        }
    }

    /// The proposed value as it stands in the file: `key = value`, or the value alone for an entry of an
    /// array.
    pub(super) fn assign(&self, value: &str) -> String {
        if self.entry { format!("`{value}`") } else { format!("`{} = {value}`", self.key) }
    }

    /// The place of the value in the file.
    pub(super) fn span(&self) -> Range<usize> {
        self.value.span()
    }
}

/// The path of a table as the header has it.
pub(super) fn header(path: &str) -> String {
    match path {
        "" => "the top level".to_owned(),
        "conductor" | "dielectric" => format!("[[{path}]]"),
        _ => format!("[{}]", shown(path)),
    }
}

/// The place of a table in words: "in [layer]", or "at the top level".
pub(super) fn within(path: &str) -> String {
    if path.is_empty() { "at the top level".to_owned() } else { format!("in {}", header(path)) }
}

/// The kind of a TOML value, with its article.
pub(super) fn kind(value: &DeValue<'_>) -> &'static str {
    match value {
        DeValue::String(_) => "a text",
        DeValue::Integer(_) => "an integer",
        DeValue::Float(_) => "a number",
        DeValue::Boolean(_) => "a boolean",
        DeValue::Datetime(_) => "a date",
        DeValue::Array(_) => "an array",
        DeValue::Table(_) => "a table",
    }
}

/// The errors found so far, and the data for messages.
#[derive(Debug)]
pub(super) struct Log<'s> {
    /// The text of the file.
    source: &'s str,
    /// The first errors, at most [`KEPT`].
    diagnostics: Vec<Diagnostic>,
    /// The number of further errors.
    unshown: usize,
    /// Whether one error replaces all others.
    sole: bool,
    /// The number of times that the file uses each unit, by dimension.
    units: BTreeMap<Dimension, BTreeMap<String, usize>>,
}

impl<'s> Log<'s> {
    /// A log for a file with this text and this parsed content.
    pub(super) fn new(source: &'s str, document: &Spanned<DeValue<'_>>) -> Self {
        let mut log =
            Self { source, diagnostics: Vec::new(), unshown: 0, sole: false, units: BTreeMap::new() };
        log.learn_units(document.get_ref());
        log
    }

    /// Counts the units of the quantities in a value.
    fn learn_units(&mut self, value: &DeValue<'_>) {
        match value {
            DeValue::String(text) => {
                if let Ok(quantity) = units::parse(text) {
                    let of_dimension = self.units.entry(quantity.dimension).or_default();
                    *of_dimension.entry(quantity.unit_text.to_owned()).or_default() += 1;
                }
            }
            DeValue::Array(items) => items.iter().for_each(|item| self.learn_units(item.get_ref())),
            DeValue::Table(table) => table.values().for_each(|item| self.learn_units(item.get_ref())),
            _ => {}
        }
    }

    /// The most frequent unit of the dimension in the file, if it has any.
    pub(super) fn usual_unit(&self, dimension: Dimension) -> Option<&str> {
        let counts = self.units.get(&dimension)?;
        counts.iter().max_by_key(|(_, count)| **count).map(|(unit, _)| unit.as_str())
    }

    /// Adds an error. An electrode form stands for many conductors, each of which may repeat a mistake; it is
    /// reported once.
    pub(super) fn push(&mut self, diagnostic: Diagnostic) {
        if self.sole || self.diagnostics.iter().any(|known| known.is_same_but_for_names(&diagnostic)) {
            return;
        }
        if self.diagnostics.len() < KEPT { self.diagnostics.push(diagnostic) } else { self.unshown += 1 }
    }

    /// Adds an error that replaces all others.
    pub(super) fn push_sole(&mut self, diagnostic: Diagnostic) {
        self.diagnostics = vec![diagnostic];
        self.unshown = 0;
        self.sole = true;
    }

    pub(super) fn is_empty(&self) -> bool {
        self.diagnostics.is_empty()
    }

    /// The number of errors reported so far.
    pub(super) fn len(&self) -> usize {
        self.diagnostics.len()
    }

    /// Whether further errors are only counted.
    pub(super) fn is_full(&self) -> bool {
        self.diagnostics.len() >= KEPT
    }

    /// The last error, to be completed by the caller.
    pub(super) fn last_mut(&mut self) -> Option<&mut Diagnostic> {
        self.diagnostics.last_mut()
    }

    /// The errors, and the number of further ones.
    pub(super) fn finish(self) -> (Vec<Diagnostic>, usize) {
        (self.diagnostics, self.unshown)
    }

    /// The text of the file at a place.
    pub(super) fn text(&self, span: &Range<usize>) -> &'s str {
        self.source.get(span.clone()).unwrap_or("")
    }

    /// Whether only comments and blank lines follow a place.
    pub(super) fn ends_after(&self, at: usize) -> bool {
        self.source.get(at..).is_some_and(|rest| {
            rest.lines().all(|line| line.trim().is_empty() || line.trim_start().starts_with('#'))
        })
    }

    /// Reports a value of the wrong TOML type.
    pub(super) fn wrong_type<T: FromToml>(&mut self, node: Node<'_>) {
        let found = node.value.get_ref();
        let mut diagnostic =
            Diagnostic::at(&node.span(), format!("{}: expected {}", node.place(), T::expected()))
                .label(format!("this is {}", kind(found)));
        if let Some(value) = T::mended(node.value, self).or_else(|| Some(T::sample(self))) {
            diagnostic = diagnostic.help(format!("write {}", node.assign(&value)));
        }
        self.push(diagnostic);
    }
}

/// The candidate that `unknown` is most likely a misspelling of.
pub(super) fn nearest<'a>(unknown: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let length = unknown.chars().count();
    if length > 64 {
        return None;
    }
    let unknown = unknown.to_lowercase().replace('-', "_");
    candidates
        .into_iter()
        .map(|candidate| (strsim::osa_distance(&unknown, &candidate.replace('-', "_")), candidate))
        .filter(|(distance, candidate)| *distance <= (length.max(candidate.len()) / 3).max(1))
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, candidate)| candidate)
}

/// The items as an enumeration: "a, b or c".
pub(super) fn alternatives<S: AsRef<str>>(items: &[S], conjunction: &str) -> String {
    match items {
        [] => String::new(),
        [one] => one.as_ref().to_owned(),
        [init @ .., last] => {
            let init = init.iter().map(AsRef::as_ref).collect::<Vec<_>>().join(", ");
            format!("{init} {conjunction} {}", last.as_ref())
        }
    }
}
