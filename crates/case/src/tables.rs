//! Tables of known keys: the `table!`, `choice!` and `words!` macros generate the reader and the schema of a
//! raw type from one declaration.

use std::ops::Range;

use serde_json::{Map, Value, json};
use toml::Spanned;
use toml::de::{DeString, DeTable, DeValue};

use super::diagnostics::{Diagnostic, shown};
use super::reader::{Field, FromToml, Log, Node, Read, alternatives, header, kind, nearest, within};

/// The keys of a table.
#[derive(Debug, Clone, Copy)]
pub(super) struct TableKeys {
    /// The keys that this version reads.
    pub(super) keys: &'static [&'static str],
    /// Keys of which exactly one must be given; empty for no such rule.
    pub(super) one_of: &'static [&'static str],
    /// Keys that are part of the format but not supported by this version.
    pub(super) later: &'static [&'static str],
}

/// A table being read.
#[derive(Debug)]
pub(super) struct Entries<'a> {
    table: &'a DeTable<'a>,
    /// The place of the table in the file.
    span: Range<usize>,
    /// The dotted path of the table; empty at the top level.
    path: String,
    /// The required keys that are missing, each with a valid value.
    missing: Vec<(&'static str, String)>,
}

impl<'a> Entries<'a> {
    /// The table of the whole document.
    pub(super) fn of_document(table: &'a DeTable<'a>) -> Self {
        Self { table, span: 0..0, path: String::new(), missing: Vec::new() }
    }

    /// The table at `node`; any other value is an error.
    pub(super) fn open<T: FromToml>(node: Node<'a>, log: &mut Log<'_>) -> Option<Self> {
        let DeValue::Table(table) = node.value.get_ref() else {
            let message = format!("{}: expected {}", node.place(), T::expected());
            log.push(
                Diagnostic::at(&node.span(), message)
                    .label(format!("this is {}", kind(node.value.get_ref())))
                    .help(format!("write it as a table, under the header `{}`", header(&node.path()))),
            );
            return None;
        };
        Some(Self { table, span: node.span(), path: node.path(), missing: Vec::new() })
    }

    /// Reads one key; a missing required key is remembered for [`Entries::close`].
    pub(super) fn field<F: Field>(&mut self, key: &'static str, log: &mut Log<'_>) -> F {
        match self.table.get(key) {
            Some(value) => {
                F::present(Read::from_node(Node { value, key, entry: false, table: &self.path }, log))
            }
            None => {
                if F::REQUIRED {
                    self.missing.push((key, F::Inner::sample(log)));
                }
                F::absent(&self.span)
            }
        }
    }

    /// Reports missing and unknown keys; true if there were unknown ones.
    pub(super) fn close(self, shape: TableKeys, log: &mut Log<'_>) -> bool {
        // Known keys that unknown ones seem to stand for: they are not missing as well.
        let mut intended = Vec::new();
        let mut flawed = false;
        for (key, value) in self.table {
            if !shape.keys.contains(&key.get_ref().as_ref()) {
                flawed = true;
                if let Some(known) = self.stray_key(key, value, shape, log) {
                    intended.push(known);
                }
            }
        }
        let missing: Vec<_> = self.missing.iter().filter(|(key, _)| !intended.contains(key)).collect();
        if !missing.is_empty() {
            let names: Vec<_> = missing.iter().map(|(key, _)| format!("`{key}`")).collect();
            let lines: Vec<_> = missing.iter().map(|(key, sample)| format!("`{key} = {sample}`")).collect();
            let cut_off = !self.path.is_empty() && log.ends_after(self.span.end);
            let hint = if cut_off { " (the file ends here: is it whole?)" } else { "" };
            log.push(
                Diagnostic::at(
                    &self.span,
                    format!("{} lacks {}", header(&self.path), alternatives(&names, "and")),
                )
                .label(if missing.len() == 1 { "a key is missing here" } else { "keys are missing here" })
                .help(format!("add for example {}{hint}", alternatives(&lines, "and"))),
            );
        }
        self.check_one_of(shape, flawed, log);
        flawed
    }

    /// Reports a key that this version does not read. Returns the known key that it seems to stand for.
    fn stray_key(
        &self,
        key: &Spanned<DeString<'_>>,
        value: &Spanned<DeValue<'_>>,
        shape: TableKeys,
        log: &mut Log<'_>,
    ) -> Option<&'static str> {
        let name = key.get_ref().as_ref();
        let here = within(&self.path);
        let known: Vec<_> = shape.keys.iter().map(|key| format!("`{key}`")).collect();
        let known = alternatives(&known, "and");
        if shape.later.contains(&name) {
            let version = env!("CARGO_PKG_VERSION");
            log.push(
                Diagnostic::at(
                    &key.span(),
                    format!("`{name}` {here} is not supported by this version of elastocap ({version})"),
                )
                .label("not supported yet")
                .help(format!("this version reads {known} here")),
            );
            return None;
        }
        let diagnostic = Diagnostic::at(&key.span(), format!("unknown key `{}` {here}", shown(name)))
            .label("not a key that belongs here");
        // Keys that are given already are not candidates.
        let absent = |key: &&str| self.table.get(*key).is_none();
        let near = nearest(name, shape.keys.iter().chain(shape.later).copied().filter(absent));
        let help = match near {
            Some(near) => {
                let text = log.text(&value.span());
                let is_header = matches!(value.get_ref(), DeValue::Table(_)) && text.starts_with('[');
                if is_header || text.is_empty() || text.len() > 60 || text.contains('\n') {
                    format!("the nearest known key is `{near}`")
                } else {
                    format!("write `{near} = {text}`")
                }
            }
            None => format!("known keys here: {known}"),
        };
        log.push(diagnostic.help(help));
        near
    }

    /// Checks that exactly one of the keys in `shape.one_of` is given. That none is given is not reported if
    /// the table is `flawed`: an unknown key may stand for it.
    fn check_one_of(&self, shape: TableKeys, flawed: bool, log: &mut Log<'_>) {
        let present: Vec<_> = shape.one_of.iter().filter_map(|key| self.table.get_key_value(*key)).collect();
        let names: Vec<_> = shape.one_of.iter().map(|key| format!("`{key}`")).collect();
        let here = header(&self.path);
        match present.as_slice() {
            [] if !shape.one_of.is_empty() && !flawed => {
                let cut_off = log.ends_after(self.span.end);
                let hint = if cut_off { " (the file ends here: is it whole?)" } else { "" };
                log.push(
                    Diagnostic::at(
                        &self.span,
                        format!("{here} lacks one of {}", alternatives(&names, "and")),
                    )
                    .label("a key is missing here")
                    .help(format!("give exactly one of {}{hint}", alternatives(&names, "and"))),
                );
            }
            [(first, _), (second, _), ..] => {
                let (first, second) =
                    if first.span().start <= second.span().start { (first, second) } else { (second, first) };
                log.push(
                    Diagnostic::at(
                        &second.span(),
                        format!("{here} has both `{}` and `{}`", first.get_ref(), second.get_ref()),
                    )
                    .label("this one is too many")
                    .related(&first.span(), "beside this")
                    .help(format!("keep exactly one of {}", alternatives(&names, "and"))),
                );
            }
            _ => {}
        }
    }
}

/// The key of a field: `r#box` is the key `box`.
pub(super) const fn key(field: &'static str) -> &'static str {
    match field.as_bytes() {
        [b'r', b'#', ..] => field.split_at(2).1,
        _ => field,
    }
}

/// The lines of a doc comment joined to one text.
pub(super) fn described(lines: &[&str]) -> String {
    lines.iter().map(|line| line.trim()).collect::<Vec<_>>().join(" ")
}

/// The JSON Schema of a table, built key by key.
#[derive(Debug)]
pub(super) struct TableSchema {
    properties: Map<String, Value>,
    required: Vec<&'static str>,
}

impl TableSchema {
    /// The schema of a table without keys.
    pub(super) fn new() -> Self {
        Self { properties: Map::new(), required: Vec::new() }
    }

    /// Adds a key, with the lines of its doc comment.
    pub(super) fn property<F: Field>(&mut self, key: &'static str, doc: &[&str]) {
        let mut schema = F::Inner::schema();
        if let (Some(schema), false) = (schema.as_object_mut(), doc.is_empty()) {
            schema.insert("description".to_owned(), described(doc).into());
        }
        self.properties.insert(key.to_owned(), schema);
        if F::REQUIRED {
            self.required.push(key);
        }
    }

    /// The schema, with the lines of the table's doc comment and the keys of which exactly one must be given.
    pub(super) fn finish(self, doc: &[&str], one_of: &[&str]) -> Value {
        let mut schema = json!({
            "type": "object",
            "description": described(doc),
            "properties": self.properties,
            "additionalProperties": false,
        });
        if !self.required.is_empty() {
            schema["required"] = json!(self.required);
        }
        if !one_of.is_empty() {
            schema["oneOf"] = one_of.iter().map(|key| json!({ "required": [key] })).collect();
        }
        schema
    }
}

/// A struct whose fields are the keys of a table; doc comments become the schema's descriptions.
macro_rules! table {
    (
        $(#[doc = $doc:literal])*
        struct $Name:ident {
            $( $(#[doc = $field_doc:literal])* $field:ident: $Field:ty, )*
        }
        $( one_of: $($one_of:literal),+; )?
        $( later: $($later:literal),+; )?
    ) => {
        $(#[doc = $doc])*
        #[derive(Debug)]
        pub(crate) struct $Name {
            $( $(#[doc = $field_doc])* pub(crate) $field: $Field, )*
        }

        impl $Name {
            const SHAPE: TableKeys = TableKeys {
                keys: &[$(key(stringify!($field))),*],
                one_of: &[$($($one_of),+)?],
                later: &[$($($later),+)?],
            };

            fn from_entries(mut entries: Entries<'_>, log: &mut Log<'_>) -> (Self, bool) {
                let table = Self { $( $field: entries.field(key(stringify!($field)), log), )* };
                let flawed = entries.close(Self::SHAPE, log);
                (table, flawed)
            }
        }

        impl FromToml for $Name {
            fn expected() -> String {
                let keys = Self::SHAPE.keys.iter().map(|key| format!("`{key}`")).collect::<Vec<_>>();
                format!("a table with {}", alternatives(&keys, "and"))
            }
            fn sample(_: &Log<'_>) -> String {
                "{ ... }".to_owned()
            }
            fn accepts(value: &DeValue<'_>) -> bool {
                matches!(value, DeValue::Table(_))
            }
            fn from_toml(node: Node<'_>, log: &mut Log<'_>) -> Option<Self> {
                let entries = Entries::open::<Self>(node, log)?;
                Some(Self::from_entries(entries, log).0)
            }
            fn schema() -> Value {
                let mut schema = TableSchema::new();
                $( schema.property::<$Field>(key(stringify!($field)), &[$($field_doc),*]); )*
                schema.finish(&[$($doc),*], Self::SHAPE.one_of)
            }
        }
    };
}

/// Declares an enum whose variants are tables named by a key: `[layer.material.neo_hookean]`.
macro_rules! choice {
    (
        $(#[doc = $doc:literal])*
        enum $Name:ident { $( $key:literal => $Variant:ident($Inner:ty), )* }
        $( later: $($later:literal),+; )?
    ) => {
        $(#[doc = $doc])*
        #[derive(Debug)]
        pub(crate) enum $Name { $( $Variant($Inner), )* }

        impl $Name {
            const SHAPE: TableKeys =
                TableKeys { keys: &[$($key),*], one_of: &[$($key),*], later: &[$($($later),+)?] };
        }

        impl FromToml for $Name {
            fn expected() -> String {
                let keys = Self::SHAPE.keys.iter().map(|key| format!("`{key}`")).collect::<Vec<_>>();
                format!("a table with exactly one of {}", alternatives(&keys, "and"))
            }
            fn sample(_: &Log<'_>) -> String {
                "{ ... }".to_owned()
            }
            fn accepts(value: &DeValue<'_>) -> bool {
                matches!(value, DeValue::Table(_))
            }
            fn from_toml(node: Node<'_>, log: &mut Log<'_>) -> Option<Self> {
                let mut entries = Entries::open::<Self>(node, log)?;
                let mut found = None;
                $(
                    if let Some(read) = entries.field::<Option<Read<$Inner>>>($key, log) {
                        found = read.value.map(Self::$Variant);
                    }
                )*
                entries.close(Self::SHAPE, log);
                found
            }
            fn schema() -> Value {
                let mut schema = TableSchema::new();
                $( schema.property::<Option<Read<$Inner>>>($key, &[]); )*
                schema.finish(&[$($doc),*], Self::SHAPE.one_of)
            }
        }
    };
}

/// Declares an enum whose variants are words.
macro_rules! words {
    (
        $(#[doc = $doc:literal])*
        enum $Name:ident { $( $(#[doc = $word_doc:literal])* $word:literal => $Variant:ident, )* }
    ) => {
        $(#[doc = $doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub(crate) enum $Name { $( $(#[doc = $word_doc])* $Variant, )* }

        impl $Name {
            const WORDS: &'static [&'static str] = &[$($word),*];
        }

        impl FromToml for $Name {
            fn expected() -> String {
                let words = Self::WORDS.iter().map(|word| format!("\"{word}\"")).collect::<Vec<_>>();
                alternatives(&words, "or")
            }
            fn sample(_: &Log<'_>) -> String {
                format!("\"{}\"", Self::WORDS.first().copied().unwrap_or_default())
            }
            fn accepts(value: &DeValue<'_>) -> bool {
                value.as_str().is_some_and(|text| nearest(text, Self::WORDS.iter().copied()).is_some())
            }
            fn from_toml(node: Node<'_>, log: &mut Log<'_>) -> Option<Self> {
                match node.value.get_ref().as_str() {
                    $( Some($word) => return Some(Self::$Variant), )*
                    Some(other) => unknown_word(node, other, Self::WORDS, log),
                    None => log.wrong_type::<Self>(node),
                }
                None
            }
            fn schema() -> Value {
                json!({ "type": "string", "enum": Self::WORDS })
            }
        }
    };
}

pub(super) use {choice, table, words};

/// Reports an unknown word.
pub(super) fn unknown_word(node: Node<'_>, found: &str, words: &[&str], log: &mut Log<'_>) {
    let quoted: Vec<_> = words.iter().map(|word| format!("\"{word}\"")).collect();
    let message =
        format!("{}: expected {}, found \"{}\"", node.place(), alternatives(&quoted, "or"), shown(found));
    let diagnostic = Diagnostic::at(&node.span(), message).label("not a word that is known here");
    let near = nearest(found, words.iter().copied()).or_else(|| words.first().copied()).unwrap_or_default();
    log.push(diagnostic.help(format!("write {}", node.assign(&format!("\"{near}\"")))));
}
