//! `sweep.svg`: the capacitance over a varied key, over the load for a family of cases, or with a band for
//! scattered values.

use std::collections::BTreeMap;

use elastocap_coupling::words::prefixed;
use elastocap_results::plot::{Axis, Chart, Scale, Series, Style};

use crate::manifest::Manifest;
use crate::record::{CaseRecord, StepRecord};
use crate::statistics::Moments;
use crate::table::Column;

/// The largest number of lines in a chart; more could not be distinguished.
const MAX_LINES: usize = 8;

/// The quantity drawn against the load: the capacitance, or the force without conductors.
struct Quantity {
    /// The column of curve.csv that holds the quantity.
    column: &'static str,
    /// The name of the quantity at its axis.
    label: &'static str,
    unit: &'static str,
}

const CAPACITANCE: Quantity = Quantity { column: "capacitance_f", label: "capacitance", unit: "F" };
const FORCE: Quantity = Quantity { column: "force_n", label: "force", unit: "N" };

/// The chart of a sweep; `None` if no case has a value to draw.
pub(crate) fn chart(manifest: &Manifest, records: &[Option<CaseRecord>]) -> Option<Chart> {
    let records: Vec<&CaseRecord> = records.iter().flatten().filter(|r| !r.steps.is_empty()).collect();
    let has = |quantity: &Quantity| {
        records.iter().any(|record| record.steps.iter().any(|step| step.number(quantity.column).is_some()))
    };
    let quantity = [CAPACITANCE, FORCE].into_iter().find(has)?;
    let columns = Column::all(manifest);
    let (x, series) = if manifest.seed.is_some() {
        band(&records, &quantity)
    } else {
        let varied: Vec<&Column> = columns.iter().filter(|column| is_varied(column)).collect();
        match most_varied(&varied) {
            Some(across) => over_a_key(across, &varied, &records, &quantity),
            None => family(&records, &quantity),
        }
    };
    let y = Axis { label: quantity.label.to_owned(), unit: quantity.unit.to_owned(), scale: Scale::Linear };
    Some(Chart { title: format!("{}: {} cases", manifest.title, manifest.cases.len()), x, y, series })
}

fn is_varied(column: &Column) -> bool {
    column.texts.windows(2).any(|two| two[0] != two[1])
}

/// The key with the largest number of different values; the first of several.
fn most_varied<'a>(columns: &[&'a Column]) -> Option<&'a Column> {
    let numbers = |column: &Column| column.numbers.iter().copied().collect::<Option<Vec<f64>>>();
    let counted = columns.iter().filter_map(|column| {
        let mut values = numbers(column)?;
        values.sort_by(f64::total_cmp);
        values.dedup();
        Some((values.len(), *column))
    });
    let counted: Vec<_> = counted.filter(|(count, _)| *count > 1).collect();
    let most = counted.iter().map(|(count, _)| *count).max()?;
    counted.into_iter().find(|(count, _)| *count == most).map(|(_, column)| column)
}

/// At most as many items as a chart has lines, evenly chosen, with the first and the last.
fn some_of<T>(items: Vec<T>) -> Vec<T> {
    let count = items.len();
    if count <= MAX_LINES {
        return items;
    }
    let wanted: Vec<usize> = (0..MAX_LINES).map(|k| k * (count - 1) / (MAX_LINES - 1)).collect();
    items.into_iter().enumerate().filter(|(k, _)| wanted.contains(k)).map(|(_, item)| item).collect()
}

/// The chart over one key: a line for each load step; or, if other keys vary too, a line for each combination
/// of their values, at the last step.
fn over_a_key(
    across: &Column,
    varied: &[&Column],
    records: &[&CaseRecord],
    quantity: &Quantity,
) -> (Axis, Vec<Series>) {
    let others: Vec<&&Column> = varied.iter().filter(|column| column.key != across.key).collect();
    let mut lines: Vec<(String, Vec<(f64, f64)>)> = Vec::new();
    for record in records {
        let x = across.numbers.get(record.case).copied().flatten().unwrap_or(f64::NAN);
        let of_others = others.iter().map(|column| {
            let text = column.texts.get(record.case).map_or("", String::as_str).trim_matches('"');
            format!("{} {text}", last_part(&column.key))
        });
        let of_others = of_others.collect::<Vec<_>>().join(", ");
        let last = record.steps.len().saturating_sub(1);
        for (k, step) in record.steps.iter().enumerate() {
            let name = match others.is_empty() {
                true => load_in_words(step, k),
                false if k == last => of_others.clone(),
                false => continue,
            };
            let point = (x, step.number(quantity.column).unwrap_or(f64::NAN));
            match lines.iter_mut().find(|(known, _)| *known == name) {
                Some((_, points)) => points.push(point),
                None => lines.push((name, vec![point])),
            }
        }
    }
    lines.iter_mut().for_each(|(_, points)| points.sort_by(|a, b| a.0.total_cmp(&b.0)));
    let values: Vec<f64> = across.numbers.iter().flatten().copied().collect();
    let (least, greatest) = values.iter().fold((f64::INFINITY, 0.0_f64), |(a, b), v| (a.min(*v), b.max(*v)));
    let scale = match least > 0.0 && greatest / least >= 30.0 {
        true => Scale::Logarithmic,
        false => Scale::Linear,
    };
    let label = match others.is_empty() {
        true => across.key.clone(),
        false => format!("{}, at the last load step", across.key),
    };
    let x = Axis { label, unit: si_unit(&across.unit), scale };
    let series = some_of(lines).into_iter().map(|(name, points)| line(name, points)).collect();
    (x, series)
}

/// The chart of the curves of cases that do not differ in a number.
fn family(records: &[&CaseRecord], quantity: &Quantity) -> (Axis, Vec<Series>) {
    let load = Load::of(records, quantity);
    let curve = |record: &&CaseRecord| {
        let point = |(k, step): (usize, &StepRecord)| {
            (load.at(step, k), step.number(quantity.column).unwrap_or(f64::NAN))
        };
        let texts = record.values.iter().flatten().map(|text| text.trim_matches('"').to_owned());
        let name = texts.collect::<Vec<_>>().join(", ");
        line(name, record.steps.iter().enumerate().map(point).collect())
    };
    (load.axis(), some_of(records.to_vec()).iter().map(curve).collect())
}

/// The chart of scattered values: the median with the band of nine cases of ten, and the extremes.
fn band(records: &[&CaseRecord], quantity: &Quantity) -> (Axis, Vec<Series>) {
    let load = Load::of(records, quantity);
    let mut by_step: BTreeMap<usize, (Vec<f64>, Vec<f64>)> = BTreeMap::new();
    for record in records {
        for (k, step) in record.steps.iter().enumerate().filter(|(_, step)| !step.failed) {
            if let Some(value) = step.number(quantity.column) {
                let (loads, values) = by_step.entry(k).or_default();
                loads.push(load.at(step, k));
                values.push(value);
            }
        }
    }
    let percentile = |values: &[f64], percent: f64| {
        let found = Moments::of(values)?.percentiles.into_iter().find(|(p, _)| *p == percent);
        found.map(|(_, value)| value)
    };
    let known = |values: &[f64], percent: f64| percentile(values, percent).unwrap_or(f64::NAN);
    let median = by_step.values().map(|(x, y)| (known(x, 50.0), known(y, 50.0))).collect();
    let middle = by_step.values().map(|(_, y)| (known(y, 5.0), known(y, 95.0))).collect();
    let extreme = |greatest: bool| {
        let end = |values: &[f64]| {
            let start = if greatest { f64::NEG_INFINITY } else { f64::INFINITY };
            values.iter().fold(start, |a, b| if greatest { a.max(*b) } else { a.min(*b) })
        };
        by_step.values().map(|(x, y)| (known(x, 50.0), end(y))).collect()
    };
    let dashed =
        |name: &str, points| Series { name: name.to_owned(), points, band: None, style: Style::DashedLine };
    let series = vec![
        Series {
            name: "median, and the band from the 5th to the 95th percentile".to_owned(),
            points: median,
            band: Some(middle),
            style: Style::LineAndMarkers,
        },
        dashed("smallest", extreme(false)),
        dashed("largest", extreme(true)),
    ];
    (load.axis(), series)
}

/// The quantity that curves are drawn over: the compression, the force or the number of the step. It is one
/// that is known at all steps; the compression is preferred if all cases have the same ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Load {
    Compression,
    Force,
    Step,
}

impl Load {
    fn of(records: &[&CaseRecord], quantity: &Quantity) -> Self {
        let is_known = |column: &str| {
            records.iter().all(|record| record.steps.iter().all(|step| step.number(column).is_some()))
        };
        let is_common = |column: &str| {
            records.windows(2).all(|two| {
                two[0].steps.iter().zip(&two[1].steps).all(|(a, b)| a.number(column) == b.number(column))
            })
        };
        if is_known("compression")
            && (is_common("compression") || quantity.column == FORCE.column || !is_known("force_n"))
        {
            Self::Compression
        } else if is_known("force_n") && quantity.column != FORCE.column {
            Self::Force
        } else {
            Self::Step
        }
    }

    fn at(self, step: &StepRecord, index: usize) -> f64 {
        match self {
            Self::Compression => step.number("compression").unwrap_or(f64::NAN),
            Self::Force => step.number("force_n").unwrap_or(f64::NAN),
            Self::Step => index as f64,
        }
    }

    fn axis(self) -> Axis {
        let (label, unit) = match self {
            Self::Compression => ("compression U/H", ""),
            Self::Force => ("force", "N"),
            Self::Step => ("load step", ""),
        };
        Axis { label: label.to_owned(), unit: unit.to_owned(), scale: Scale::Linear }
    }
}

fn line(name: String, points: Vec<(f64, f64)>) -> Series {
    Series { name, points, band: None, style: Style::LineAndMarkers }
}

/// The last part of the path of a key: `gap` for `electrodes.in_plane_pair.gap`.
fn last_part(key: &str) -> &str {
    key.rsplit('.').next().unwrap_or(key)
}

fn load_in_words(step: &StepRecord, index: usize) -> String {
    match (step.number("compression"), step.number("force_n")) {
        (Some(compression), _) => format!("U/H = {}", (compression * 1e4).round() / 1e4),
        (None, Some(force)) => format!("F = {}", prefixed(force, 4, "N")),
        (None, None) => format!("step {index}"),
    }
}

/// The SI unit that belongs to a unit: the same without its prefix, or rad for an angle; empty for compound
/// units.
fn si_unit(unit: &str) -> String {
    let known = ["Pa", "N", "V", "F", "C", "m"].into_iter().find(|symbol| unit.ends_with(symbol));
    match (unit, known) {
        ("deg" | "rad", _) => "rad".to_owned(),
        (unit, Some(known)) if !unit.contains(['/', '*', '^']) => known.to_owned(),
        _ => String::new(),
    }
}
