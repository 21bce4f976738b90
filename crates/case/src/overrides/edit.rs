//! Edits a TOML document in place, keeping its comments and its order.

use toml_edit::{ArrayOfTables, DocumentMut, InlineTable, Item, Table, Value};

use super::OverrideErrorKind;
use super::key_path::{KeyPath, Part, written};

/// The target of a part of a path. Tables and arrays come in two forms each, under headers and inline.
enum Place<'a> {
    /// A table under a header, or one made by dotted keys.
    Table(&'a mut Table),
    /// An array of tables under headers.
    Tables(&'a mut ArrayOfTables),
    /// A value, which may be an inline table or array.
    Value(&'a mut Value),
}

/// Sets the value at the end of a path.
pub(super) fn set(document: &mut DocumentMut, path: &KeyPath, value: Value) -> Result<(), OverrideErrorKind> {
    let Some((last, before)) = path.0.split_last() else { return Err(OverrideErrorKind::EmptyPath) };
    let mut place = Place::Table(document.as_table_mut());
    for (k, part) in before.iter().enumerate() {
        let reached = &path.0[..k];
        place = match part {
            Part::Key(key) => match path.0.get(k + 1) {
                Some(Part::Entry(_)) if !place.has(key) => {
                    place.check_holds_keys(reached)?;
                    return Err(OverrideErrorKind::AbsentArray(written(&path.0[..=k])));
                }
                _ => place.into_key(key, reached)?,
            },
            Part::Entry(index) => place.into_entry(*index, reached)?,
        };
    }
    match last {
        Part::Key(key) => place.set_key(key, value, before),
        Part::Entry(index) => place.into_entry(*index, before)?.replace(value),
    }
}

/// The value at the end of a path, if there is one.
pub(super) fn get<'a>(document: &'a DocumentMut, path: &KeyPath) -> Option<&'a Value> {
    let mut item: &Item = document.as_item();
    let mut value: Option<&Value> = None;
    let mut table: Option<&Table> = None;
    for part in &path.0 {
        match (part, value, table) {
            (Part::Key(key), Some(inside), _) => value = Some(inside.as_inline_table()?.get(key)?),
            (Part::Entry(index), Some(inside), _) => value = Some(inside.as_array()?.get(*index)?),
            (Part::Key(key), None, Some(inside)) => item = inside.get(key)?,
            (Part::Key(key), None, None) => item = item.as_table()?.get(key)?,
            (Part::Entry(index), None, _) => {
                table = Some(item.as_array_of_tables()?.get(*index)?);
                continue;
            }
        }
        table = None;
        if value.is_none() {
            value = item.as_value();
        }
    }
    if table.is_some() { None } else { value }
}

/// Collects all texts under a key `file`, each once.
pub(super) fn files(item: &Item, found: &mut Vec<String>) {
    match item {
        Item::None => {}
        Item::Table(table) => {
            table.iter().for_each(|(key, inside)| {
                note_file(key, inside.as_str(), found);
                files(inside, found);
            });
        }
        Item::ArrayOfTables(tables) => {
            tables.iter().flat_map(|table| table.iter()).for_each(|(key, inside)| {
                note_file(key, inside.as_str(), found);
                files(inside, found);
            });
        }
        Item::Value(value) => files_of_value(value, found),
    }
}

/// Collects all texts under a key `file` in a value, each once.
fn files_of_value(value: &Value, found: &mut Vec<String>) {
    match value {
        Value::InlineTable(table) => table.iter().for_each(|(key, inside)| {
            note_file(key, inside.as_str(), found);
            files_of_value(inside, found);
        }),
        Value::Array(array) => array.iter().for_each(|inside| files_of_value(inside, found)),
        Value::String(_) | Value::Integer(_) | Value::Float(_) | Value::Boolean(_) | Value::Datetime(_) => {}
    }
}

/// Adds the text if its key is `file` and it is not there yet.
fn note_file(key: &str, text: Option<&str>, found: &mut Vec<String>) {
    if let ("file", Some(text)) = (key, text)
        && !found.iter().any(|known| known == text)
    {
        found.push(text.to_owned());
    }
}

impl<'a> Place<'a> {
    /// The place of an item, if it has content.
    fn of_item(item: &'a mut Item) -> Option<Self> {
        match item {
            Item::Table(table) => Some(Self::Table(table)),
            Item::ArrayOfTables(tables) => Some(Self::Tables(tables)),
            Item::Value(value) => Some(Self::Value(value)),
            Item::None => None,
        }
    }

    /// Whether this is a table with the key.
    fn has(&self, key: &str) -> bool {
        match self {
            Self::Table(table) => table.contains_key(key),
            Self::Value(Value::InlineTable(table)) => table.contains_key(key),
            Self::Tables(_) | Self::Value(_) => false,
        }
    }

    /// Checks that this is a table.
    fn check_holds_keys(&self, reached: &[Part]) -> Result<(), OverrideErrorKind> {
        match self {
            Self::Table(_) | Self::Value(Value::InlineTable(_)) => Ok(()),
            Self::Tables(tables) => {
                Err(OverrideErrorKind::IndexMissing { at: written(reached), length: tables.len() })
            }
            Self::Value(Value::Array(array)) => {
                Err(OverrideErrorKind::IndexMissing { at: written(reached), length: array.len() })
            }
            Self::Value(value) => {
                Err(OverrideErrorKind::NoTable { at: written(reached), found: kind(value) })
            }
        }
    }

    /// The place under a key; a missing table is made.
    fn into_key(self, key: &str, reached: &[Part]) -> Result<Self, OverrideErrorKind> {
        self.check_holds_keys(reached)?;
        let place = match self {
            Self::Table(table) => {
                // A table between dotted keys continues with dotted keys; one below a header gets a header as
                // soon as it holds a value.
                let mut new = Table::new();
                new.set_implicit(true);
                new.set_dotted(table.is_dotted());
                Self::of_item(table.entry(key).or_insert(Item::Table(new)))
            }
            Self::Value(Value::InlineTable(table)) => {
                if !table.contains_key(key) {
                    insert_inline(table, key, Value::InlineTable(InlineTable::new()));
                }
                table.get_mut(key).map(Self::Value)
            }
            Self::Tables(_) | Self::Value(_) => None,
        };
        place.ok_or_else(|| OverrideErrorKind::NoTable { at: written(reached), found: "empty" })
    }

    /// The place of an entry of an array.
    fn into_entry(self, index: usize, reached: &[Part]) -> Result<Self, OverrideErrorKind> {
        let at = || written(reached);
        match self {
            Self::Tables(tables) => {
                let length = tables.len();
                let entry = tables.get_mut(index).map(Self::Table);
                entry.ok_or_else(|| OverrideErrorKind::NoEntry { at: at(), length })
            }
            Self::Value(Value::Array(array)) => {
                let length = array.len();
                let entry = array.get_mut(index).map(Self::Value);
                entry.ok_or_else(|| OverrideErrorKind::NoEntry { at: at(), length })
            }
            Self::Table(_) => Err(OverrideErrorKind::NoArray { at: at(), found: "a table" }),
            Self::Value(value) => Err(OverrideErrorKind::NoArray { at: at(), found: kind(value) }),
        }
    }

    /// Sets a key of a table; a missing key is added.
    fn set_key(self, key: &str, value: Value, reached: &[Part]) -> Result<(), OverrideErrorKind> {
        self.check_holds_keys(reached)?;
        match self {
            Self::Table(table) => match table.get_mut(key) {
                Some(Item::Value(old)) => replace_value(old, value),
                // The value replaces a table under a header; it then stands among the keys.
                _ => {
                    table.insert(key, Item::Value(value));
                }
            },
            Self::Value(Value::InlineTable(table)) => match table.get_mut(key) {
                Some(old) => replace_value(old, value),
                None => insert_inline(table, key, value),
            },
            Self::Tables(_) | Self::Value(_) => {}
        }
        Ok(())
    }

    /// Replaces the value of an entry of an array.
    fn replace(self, value: Value) -> Result<(), OverrideErrorKind> {
        match self {
            Self::Value(old) => replace_value(old, value),
            Self::Table(old) => match value {
                Value::InlineTable(new) => {
                    let decor = old.decor().clone();
                    let position = old.position();
                    *old = new.into_table();
                    *old.decor_mut() = decor;
                    old.set_position(position);
                }
                other => {
                    return Err(OverrideErrorKind::BadValue {
                        value: super::shown(other.to_string().trim()),
                        why: "this entry is a table; write one, such as `{ name = \"a\" }`".to_owned(),
                    });
                }
            },
            // Entries of an array of tables are not arrays.
            Self::Tables(_) => {}
        }
        Ok(())
    }
}

/// Replaces a value, keeping its place and the comment that follows it.
fn replace_value(old: &mut Value, mut new: Value) {
    *new.decor_mut() = old.decor().clone();
    *old = new;
}

/// Adds a key at the end of an inline table, before the space in front of its closing brace.
fn insert_inline(table: &mut InlineTable, key: &str, mut value: Value) {
    let last = table.iter().last().map(|(key, _)| key.to_owned());
    if let Some(last) = last.and_then(|key| table.get_mut(&key)) {
        let suffix = last.decor().suffix().and_then(|raw| raw.as_str()).unwrap_or("").to_owned();
        if !suffix.is_empty() && suffix.chars().all(|c| c == ' ' || c == '\t') {
            last.decor_mut().set_suffix("");
            value.decor_mut().set_prefix(" ");
            value.decor_mut().set_suffix(suffix);
        }
    }
    table.insert(key, value);
}

/// The kind of a value, with its article.
fn kind(value: &Value) -> &'static str {
    match value {
        Value::String(_) => "a text",
        Value::Integer(_) => "an integer",
        Value::Float(_) => "a number",
        Value::Boolean(_) => "a boolean",
        Value::Datetime(_) => "a date",
        Value::Array(_) => "an array",
        Value::InlineTable(_) => "a table",
    }
}
