//! `sweep.csv`: a line for each case and step.

use elastocap_case::Amount;
use elastocap_coupling::outcome::Row;
use elastocap_results::csv::{number, optional, quoted};

use crate::manifest::Manifest;
use crate::record::CaseRecord;

/// The values of one key, case by case.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// The path of the key.
    pub key: String,
    /// The values as a case file has them; empty if neither the case nor the file has one.
    pub texts: Vec<String>,
    /// The values in SI units; `None` for a value that is not a number.
    pub numbers: Vec<Option<f64>>,
    /// The unit of the first value; empty for a number without a unit and for other values.
    pub unit: String,
}

impl Column {
    /// All columns of a sweep.
    pub fn all(manifest: &Manifest) -> Vec<Self> {
        let keys = manifest.keys.iter().enumerate();
        keys.map(|(k, key)| {
            let default = manifest.defaults.get(k).cloned().flatten();
            let text = |case: &Vec<Option<String>>| {
                case.get(k).cloned().flatten().or_else(|| default.clone()).unwrap_or_default()
            };
            let texts: Vec<String> = manifest.cases.iter().map(text).collect();
            let parsed: Vec<_> = texts.iter().map(|text| text.parse::<Amount>().ok()).collect();
            let unit = parsed.first().and_then(Option::as_ref).map_or("", |first| first.scale.unit.as_str());
            Self {
                key: key.clone(),
                unit: unit.to_owned(),
                numbers: parsed.iter().map(|value| value.as_ref().map(|value| value.si)).collect(),
                texts,
            }
        })
        .collect()
    }

    /// The field of a case: a number in SI units, or the text without its quotation marks.
    fn field(&self, case: usize) -> String {
        match self.numbers.get(case).copied().flatten() {
            Some(value) => number(value),
            None => {
                let text = self.texts.get(case).map_or("", String::as_str);
                let plain = text.strip_prefix('"').and_then(|text| text.strip_suffix('"')).unwrap_or(text);
                quoted(plain)
            }
        }
    }
}

/// The table of the cases of a folder, in their order: the values of the keys, the columns of curve.csv, and
/// the message of a step. A case without a record has a line with the status `not run`, a refused one a line
/// with `refused`. `records` is by case.
pub fn table(manifest: &Manifest, records: &[Option<CaseRecord>]) -> String {
    let columns = Column::all(manifest);
    let keys = columns.iter().map(|column| quoted(&column.key));
    let names = Row::COLUMNS.iter().map(|name| (*name).to_owned());
    let header: Vec<String> = ["case".to_owned()]
        .into_iter()
        .chain(keys)
        .chain(["step".to_owned()])
        .chain(names)
        .chain(["message".to_owned()])
        .collect();
    let mut out = header.join(",");
    out.push('\n');
    for case in manifest.cases_of_shard() {
        let mut start = vec![case.to_string()];
        start.extend(columns.iter().map(|column| column.field(case)));
        let without_steps = |status: &str, message: &str| {
            // The step, and all columns of curve.csv before the status.
            let empty = std::iter::repeat_n(String::new(), Row::COLUMNS.len());
            let mut line = start.clone();
            line.extend(empty);
            line.extend([quoted(status), quoted(message)]);
            line.join(",") + "\n"
        };
        match records.get(case).and_then(Option::as_ref) {
            None => out.push_str(&without_steps("not run", "")),
            Some(CaseRecord { refused: Some(why), .. }) => {
                out.push_str(&without_steps("refused", &one_line(why)));
            }
            Some(record) => {
                for (k, step) in record.steps.iter().enumerate() {
                    let mut line = start.clone();
                    line.push(k.to_string());
                    line.extend(step.numbers.iter().copied().map(optional));
                    line.push(step.unknowns.map_or_else(String::new, |n| n.to_string()));
                    line.push(quoted(&step.status));
                    line.push(quoted(&one_line(step.message.as_deref().unwrap_or(""))));
                    out.push_str(&line.join(","));
                    out.push('\n');
                }
            }
        }
    }
    out
}

/// The text without line breaks, so that a line of the table is a line of the file.
fn one_line(text: &str) -> String {
    text.lines().map(str::trim).filter(|line| !line.is_empty()).collect::<Vec<_>>().join("; ")
}
