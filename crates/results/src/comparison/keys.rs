//! The keys of case files by their paths, and those that differ between several.

use std::collections::BTreeMap;

use toml::de::{DeTable, DeValue};

/// A key of which the cases have different values.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DifferentKey {
    /// With dots between tables, as `electrodes.in_plane_pair.gap`; `[0]` for entries of arrays.
    pub path: String,
    /// As the files have it; `None` where a file does not have it.
    pub values: Vec<Option<String>>,
}

/// The values of a case file by their paths; `None` if it is no TOML.
pub(super) fn keys(text: &str) -> Option<BTreeMap<String, String>> {
    let document = DeTable::parse(text).ok()?;
    let mut all = BTreeMap::new();
    add_table(document.get_ref(), "", &mut all);
    Some(all)
}

fn add_table(table: &DeTable<'_>, path: &str, all: &mut BTreeMap<String, String>) {
    for (key, value) in table.iter() {
        let key = key.get_ref();
        let path = if path.is_empty() { key.to_string() } else { format!("{path}.{key}") };
        add(value.get_ref(), path, all);
    }
}

fn add(value: &DeValue<'_>, path: String, all: &mut BTreeMap<String, String>) {
    match value {
        DeValue::Table(table) => add_table(table, &path, all),
        // An array of numbers or texts is one value; one of tables is as many as there are.
        DeValue::Array(entries) if entries.iter().any(|own| matches!(own.get_ref(), DeValue::Table(_))) => {
            for (k, entry) in entries.iter().enumerate() {
                add(entry.get_ref(), format!("{path}[{k}]"), all);
            }
        }
        other => {
            all.insert(path, shown(other));
        }
    }
}

fn shown(value: &DeValue<'_>) -> String {
    match value {
        DeValue::String(text) => text.to_string(),
        DeValue::Integer(number) => number.as_str().to_owned(),
        DeValue::Float(number) => number.as_str().to_owned(),
        DeValue::Boolean(value) => value.to_string(),
        DeValue::Datetime(value) => value.to_string(),
        DeValue::Array(entries) => {
            let entries: Vec<String> = entries.iter().map(|own| shown(own.get_ref())).collect();
            format!("[{}]", entries.join(", "))
        }
        // Inside of arrays of arrays only.
        DeValue::Table(_) => "{ .. }".to_owned(),
    }
}

/// The keys whose values are not the same in all of them, in the order of their paths.
pub(super) fn different(cases: &[BTreeMap<String, String>]) -> Vec<DifferentKey> {
    let mut paths: Vec<&String> = cases.iter().flat_map(BTreeMap::keys).collect();
    paths.sort();
    paths.dedup();
    let all = paths.into_iter().map(|path| DifferentKey {
        path: path.clone(),
        values: cases.iter().map(|own| own.get(path).cloned()).collect(),
    });
    all.filter(|key| key.values.windows(2).any(|pair| pair[0] != pair[1])).collect()
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
