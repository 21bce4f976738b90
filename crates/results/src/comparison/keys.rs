//! The keys of case files by their paths, and the keys whose values differ.

use std::collections::BTreeMap;

use toml::de::{DeTable, DeValue};

/// A key that has different values in the cases.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DifferentKey {
    /// The path, with dots between tables, as `electrodes.in_plane_pair.gap`; `[0]` for entries of arrays.
    pub path: String,
    /// The value in each file as it is written there; `None` where a file does not have the key.
    pub values: Vec<Option<String>>,
}

/// The values of a case file by their paths; `None` if it is not TOML.
pub(super) fn keys(text: &str) -> Option<BTreeMap<String, String>> {
    let document = DeTable::parse(text).ok()?;
    let mut values = BTreeMap::new();
    add_table(document.get_ref(), "", &mut values);
    Some(values)
}

fn add_table(table: &DeTable<'_>, path: &str, values: &mut BTreeMap<String, String>) {
    for (key, value) in table.iter() {
        let key = key.get_ref();
        let path = if path.is_empty() { key.to_string() } else { format!("{path}.{key}") };
        add(value.get_ref(), path, values);
    }
}

fn add(value: &DeValue<'_>, path: String, values: &mut BTreeMap<String, String>) {
    match value {
        DeValue::Table(table) => add_table(table, &path, values),
        // An array of numbers or texts is one value; an array of tables has as many values as tables have
        // keys.
        DeValue::Array(entries)
            if entries.iter().any(|entry| matches!(entry.get_ref(), DeValue::Table(_))) =>
        {
            for (k, entry) in entries.iter().enumerate() {
                add(entry.get_ref(), format!("{path}[{k}]"), values);
            }
        }
        other => {
            values.insert(path, shown(other));
        }
    }
}

/// The value as text: strings without quotes, numbers as they are written in the file.
fn shown(value: &DeValue<'_>) -> String {
    match value {
        DeValue::String(text) => text.to_string(),
        DeValue::Integer(number) => number.as_str().to_owned(),
        DeValue::Float(number) => number.as_str().to_owned(),
        DeValue::Boolean(value) => value.to_string(),
        DeValue::Datetime(value) => value.to_string(),
        DeValue::Array(entries) => {
            let entries: Vec<String> = entries.iter().map(|entry| shown(entry.get_ref())).collect();
            format!("[{}]", entries.join(", "))
        }
        // Only a table inside an array of arrays gets here.
        DeValue::Table(_) => "{ .. }".to_owned(),
    }
}

/// The keys whose values differ between the cases, in the order of their paths.
pub(super) fn different(cases: &[BTreeMap<String, String>]) -> Vec<DifferentKey> {
    let mut paths: Vec<&String> = cases.iter().flat_map(BTreeMap::keys).collect();
    paths.sort();
    paths.dedup();
    let keys = paths.into_iter().map(|path| DifferentKey {
        path: path.clone(),
        values: cases.iter().map(|values| values.get(path).cloned()).collect(),
    });
    keys.filter(|key| key.values.windows(2).any(|pair| pair[0] != pair[1])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_that_differ_are_found_by_their_paths_and_comments_and_order_do_not_matter() {
        let a =
            keys("# one\ntitle = \"a\"\n[layer]\nthickness = \"1 mm\"\nnumber = 1\n[[body]]\nx = [1, 2]\n")
                .unwrap();
        let b = keys("[layer]\nnumber = 1\nthickness = \"2 mm\" # two\n[[body]]\nx = [1, 3]\n").unwrap();
        let found = different(&[a, b]);
        let expected = [
            ("body[0].x", Some("[1, 2]"), Some("[1, 3]")),
            ("layer.thickness", Some("1 mm"), Some("2 mm")),
            ("title", Some("a"), None),
        ];
        assert_eq!(found.len(), 3);
        for (key, (path, first, second)) in found.iter().zip(expected) {
            assert_eq!(key.path, path);
            assert_eq!(key.values, [first, second].map(|v| v.map(str::to_owned)));
        }
        assert!(keys("no TOML").is_none());
    }
}
