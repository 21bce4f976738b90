//! Results side by side: what differs in the cases, in the capacitances with their bounds, and in time.

mod keys;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use elastocap_case::Pose;
use serde::Deserialize;
use serde_json::{Value, json};

use crate::force_answer::{CurveFileError, read_document};
use crate::plot::{Axis, Chart, Scale, Series, Style};
use crate::pose;

pub use keys::DifferentKey;

/// The parts of one result that are compared.
#[derive(Debug, Clone, PartialEq)]
pub struct OneResult {
    /// The path of the result as the caller named it.
    pub path: PathBuf,
    /// The title of the case.
    pub title: String,
    /// "complete", "incomplete" or "stopped".
    pub status: String,
    /// The kind of capacitance that is measured, in words; `None` without conductors.
    pub measured: Option<String>,
    /// Whether the bounds are proved.
    pub proved: bool,
    /// Wall-clock seconds of the run.
    pub seconds: f64,
    /// The number of threads that worked on the run.
    pub threads: usize,
    /// The version of elastocap that made the result.
    pub version: String,
    /// Largest number of unknowns of a step.
    pub unknowns: Option<u64>,
    steps: Vec<Step>,
    /// The keys of the case file with their values; `None` where the result does not have its text.
    keys: Option<BTreeMap<String, String>>,
}

/// A step of several results: the same load in each of them.
#[derive(Debug, Clone, PartialEq)]
pub struct ComparedStep {
    /// The load in words.
    pub label: String,
    /// The values of each result at the step; `None` where it has no such step.
    pub values: Vec<Option<StepValue>>,
}

/// The values of a result at a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepValue {
    /// The force, N.
    pub force_n: Option<f64>,
    /// The capacitance, its lower and its upper bound, F; `None` where it is not known.
    pub capacitance: Option<[f64; 3]>,
    /// Wall-clock seconds of the step.
    pub seconds: f64,
}

/// A capacitance against that of the first result.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Difference {
    /// The capacitance less that of the first result, F.
    pub value: f64,
    /// The least and the greatest difference within the bounds of both capacitances, F.
    pub range: [f64; 2],
    /// The difference over the absolute capacitance of the first result.
    pub relative: f64,
}

impl Difference {
    /// Whether the bounds of the two capacitances overlap, so that both may be the same number.
    pub fn agrees(&self) -> bool {
        self.range[0] <= 0.0 && 0.0 <= self.range[1]
    }

    /// The least difference of the two capacitances, by size, F; zero where they agree.
    pub fn at_least(&self) -> f64 {
        if self.agrees() { 0.0 } else { self.range[0].abs().min(self.range[1].abs()) }
    }
}

impl ComparedStep {
    /// The difference of the result with this number from the first; `None` where one of the two capacitances
    /// is not known.
    pub fn difference(&self, result: usize) -> Option<Difference> {
        let capacitance =
            |k: usize| self.values.get(k).copied().flatten().and_then(|value| value.capacitance);
        let ([a, a_lower, a_upper], [b, b_lower, b_upper]) = (capacitance(0)?, capacitance(result)?);
        Some(Difference {
            value: b - a,
            range: [b_lower - a_upper, b_upper - a_lower],
            relative: (b - a) / a.abs(),
        })
    }
}

/// Several results side by side.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// The compared results, in the order of the caller.
    pub results: Vec<OneResult>,
    /// The keys that differ between the case files; `None` where a result does not have the text of its case.
    pub keys: Option<Vec<DifferentKey>>,
    /// The loads of the first result in its order, then those that only others have.
    pub steps: Vec<ComparedStep>,
}

/// The parts of `result.json` that are compared.
#[derive(Deserialize)]
struct Document {
    title: String,
    status: String,
    case_text: Option<String>,
    measurement: Option<Measured>,
    bounds: Option<String>,
    steps: Vec<Step>,
    #[serde(default)]
    plan: Plan,
    seconds: RunSeconds,
    threads: usize,
    versions: Versions,
}

#[derive(Deserialize)]
struct Measured {
    kind: String,
    terminals: Vec<String>,
    #[serde(default)]
    shown: Vec<String>,
}

#[derive(Default, Deserialize)]
struct Plan {
    steps: Vec<PlannedStep>,
}

#[derive(Deserialize)]
struct PlannedStep {
    load: Value,
    pose: Option<PlannedPose>,
}

#[derive(Deserialize)]
struct PlannedPose {
    distance_m: f64,
    shift_m: [f64; 2],
    tilt_rad: [f64; 2],
}

#[derive(Deserialize)]
struct RunSeconds {
    total: f64,
}

#[derive(Deserialize)]
struct Versions {
    elastocap: String,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
struct Step {
    compression: Option<f64>,
    distance_m: Option<f64>,
    force_n: Option<f64>,
    capacitance_f: Option<f64>,
    capacitance_lower_f: Option<f64>,
    capacitance_upper_f: Option<f64>,
    mechanics_error_estimate: Option<f64>,
    geometry_error_estimate: Option<f64>,
    unknowns: Option<u64>,
    seconds: StepSeconds,
    /// The load and the pose that the case asks for, as a key that pairs steps; filled in from the plan.
    #[serde(skip)]
    load: String,
    /// Displacement of the attached bodies in addition to that by the load; filled in from the plan.
    #[serde(skip)]
    pose: Pose,
}

#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
struct StepSeconds {
    total: f64,
}

impl Step {
    /// The load in words.
    fn label(&self) -> String {
        let distance = self.distance_m.filter(|d| *d > 0.0).map(|d| format!("{:.6} mm away", 1e3 * d));
        let compression = self.compression.map(|c| format!("U/H = {}", (1e4 * c).round() / 1e4));
        let load = distance.or(compression).unwrap_or_else(|| "unloaded".to_owned());
        match pose::in_plain_words(&self.pose) {
            Some(pose) => format!("{load}, {pose}"),
            None => load,
        }
    }

    /// The capacitance with limits that hold for the sensor: the bounds of the field, widened by the
    /// estimated errors of the layer's mesh and by the faceting error.
    fn value(&self) -> StepValue {
        let capacitance = self.capacitance_f.zip(self.capacitance_lower_f).zip(self.capacitance_upper_f);
        let estimates =
            self.mechanics_error_estimate.unwrap_or(0.0) + self.geometry_error_estimate.unwrap_or(0.0);
        let widened = |((value, lower), upper): ((f64, f64), f64)| {
            let margin = estimates * value.abs();
            [value, lower - margin, upper + margin]
        };
        StepValue {
            force_n: self.force_n,
            capacitance: capacitance.map(widened),
            seconds: self.seconds.total,
        }
    }
}

fn read(path: &Path) -> Result<OneResult, CurveFileError> {
    let document: Document = read_document(path)?;
    let mut steps = document.steps;
    for (step, planned) in steps.iter_mut().zip(&document.plan.steps) {
        let pose = planned.pose.as_ref();
        step.pose = pose.map_or_else(Pose::default, |planned| Pose {
            distance: planned.distance_m,
            shift: planned.shift_m,
            tilt: planned.tilt_rad,
        });
        step.load = format!("{} {:?}", planned.load, step.pose);
    }
    // Results of older versions have no `shown`.
    let shown = |measurement: &Measured| {
        if measurement.shown.is_empty() { measurement.terminals.clone() } else { measurement.shown.clone() }
    };
    let measured = document.measurement.map(|measurement| {
        match (measurement.kind.as_str(), shown(&measurement).as_slice()) {
            ("two_terminal", _) => {
                format!("two-terminal capacitance of {}", measurement.terminals.join(" and "))
            }
            (_, [one]) => format!("capacitance of {one} against ground"),
            (_, shown) => format!("mutual capacitance of {}", shown.join(" and ")),
        }
    });
    Ok(OneResult {
        path: path.to_owned(),
        title: document.title,
        status: document.status,
        measured,
        proved: document.bounds.as_deref() == Some("proved"),
        seconds: document.seconds.total,
        threads: document.threads,
        version: document.versions.elastocap,
        unknowns: steps.iter().filter_map(|step| step.unknowns).max(),
        keys: document.case_text.as_deref().and_then(keys::keys),
        steps,
    })
}

/// Reads results, each from its folder or from the `result.json` in it, and lays them side by side.
///
/// # Errors
/// [`CurveFileError`] where one cannot be read.
pub fn compare(paths: &[PathBuf]) -> Result<Comparison, CurveFileError> {
    let results = paths.iter().map(|path| read(path)).collect::<Result<Vec<_>, _>>()?;
    let known: Option<Vec<_>> = results.iter().map(|result| result.keys.clone()).collect();
    Ok(Comparison {
        keys: known.map(|cases| keys::different(&cases)),
        steps: side_by_side(&results),
        results,
    })
}

/// Pairs the steps of the same load; where a load occurs several times, its occurrences are paired in order.
fn side_by_side(results: &[OneResult]) -> Vec<ComparedStep> {
    let mut places: BTreeMap<(String, usize), usize> = BTreeMap::new();
    let mut steps: Vec<ComparedStep> = Vec::new();
    for (k, result) in results.iter().enumerate() {
        let mut seen: BTreeMap<&str, usize> = BTreeMap::new();
        for step in &result.steps {
            let count = seen.entry(&step.load).or_insert(0);
            let place = *places.entry((step.load.clone(), *count)).or_insert_with(|| {
                steps.push(ComparedStep { label: step.label(), values: vec![None; results.len()] });
                steps.len() - 1
            });
            *count += 1;
            if let Some(value) = steps.get_mut(place).and_then(|step| step.values.get_mut(k)) {
                *value = Some(step.value());
            }
        }
    }
    steps
}

impl Comparison {
    /// A letter for each result: A, B, C.
    pub fn letter(&self, result: usize) -> String {
        let letter = char::from(b'A' + (result % 26) as u8);
        if result < 26 { letter.to_string() } else { format!("{letter}{}", result / 26) }
    }

    /// Whether a result has another kind of capacitance than the first.
    pub fn measured_differently(&self) -> bool {
        self.results.iter().any(|result| result.measured != self.results[0].measured)
    }

    /// The comparison as JSON; docs/report.md describes it.
    pub fn json(&self) -> Value {
        let results: Vec<Value> = self
            .results
            .iter()
            .map(|result| {
                json!({
                    "result": result.path.display().to_string(), "title": result.title,
                    "status": result.status, "measured": result.measured,
                    "bounds": if result.proved { "proved" } else { "estimated" }, "seconds": result.seconds,
                    "threads": result.threads,
                    "unknowns": result.unknowns, "version": result.version,
                })
            })
            .collect();
        let keys = self.keys.as_ref().map(|keys| {
            keys.iter().map(|key| json!({ "key": key.path, "values": key.values })).collect::<Vec<_>>()
        });
        let steps: Vec<Value> = self.steps.iter().map(|step| self.step_json(step)).collect();
        json!({ "results": results, "case_keys": keys, "steps": steps })
    }

    fn step_json(&self, step: &ComparedStep) -> Value {
        let value = |value: &Option<StepValue>| {
            value.map(|value| {
                let c = value.capacitance;
                json!({
                    "force_n": value.force_n, "capacitance_f": c.map(|c| c[0]),
                    "capacitance_lower_f": c.map(|c| c[1]),
                    "capacitance_upper_f": c.map(|c| c[2]), "seconds": value.seconds,
                })
            })
        };
        let against = |k: usize| {
            step.difference(k).map(|difference| {
                json!({
                    "difference_f": difference.value, "difference_lower_f": difference.range[0],
                    "difference_upper_f": difference.range[1],
                    "relative": difference.relative, "agrees": difference.agrees(),
                })
            })
        };
        json!({
            "load": step.label,
            "values": step.values.iter().map(value).collect::<Vec<_>>(),
            "against_first": (1..self.results.len()).map(against).collect::<Vec<_>>(),
        })
    }

    /// The curves of all results in one chart. Steps that are shifted or tilted are left out beside others
    /// that are not. `None` where no result has two steps with a force and a capacitance.
    pub fn chart(&self) -> Option<Chart> {
        let series = |(k, result): (usize, &OneResult)| {
            let pressed = result.steps.iter().filter(|step| step.distance_m.is_none_or(|d| d == 0.0));
            let pressed: Vec<&Step> = pressed.collect();
            let poses: Vec<Pose> = pressed.iter().map(|step| step.pose).collect();
            let curve: Vec<(f64, [f64; 3])> = (pressed.iter().zip(pose::on_curve(&poses)))
                .filter(|(_, on_curve)| *on_curve)
                .filter_map(|(step, _)| Some((step.force_n?, step.value().capacitance?)))
                .collect();
            (curve.len() > 1).then(|| Series {
                name: match self.results.iter().filter(|other| other.title == result.title).count() {
                    1 => format!("{}: {}", self.letter(k), result.title),
                    _ => format!("{}: {}", self.letter(k), result.path.display()),
                },
                points: curve.iter().map(|(force, c)| (*force, c[0])).collect(),
                band: Some(curve.iter().map(|(_, c)| (c[1], c[2])).collect()),
                style: Style::LineAndMarkers,
            })
        };
        let series: Vec<Series> = self.results.iter().enumerate().filter_map(series).collect();
        let axis =
            |label: &str, unit: &str| Axis { label: label.into(), unit: unit.into(), scale: Scale::Linear };
        (!series.is_empty()).then(|| Chart {
            title: String::new(),
            x: axis("force", "N"),
            y: axis("capacitance", "F"),
            series,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_agree_where_their_bounds_overlap_and_differ_by_the_gap_between_these() {
        let value = |c: [f64; 3]| Some(StepValue { force_n: None, capacitance: Some(c), seconds: 0.0 });
        let step = |a, b| ComparedStep { label: String::new(), values: vec![value(a), value(b)] };
        let difference = step([10.0, 9.0, 11.0], [12.0, 10.5, 12.5]).difference(1).unwrap();
        assert!(difference.agrees() && difference.at_least() == 0.0 && difference.range == [-0.5, 3.5]);
        let difference = step([10.0, 9.0, 11.0], [13.0, 12.0, 14.0]).difference(1).unwrap();
        assert!(
            !difference.agrees() && difference.at_least() == 1.0 && (difference.relative - 0.3).abs() < 1e-15
        );
        let difference = step([10.0, 9.0, 11.0], [7.0, 6.0, 8.0]).difference(1).unwrap();
        assert!(!difference.agrees() && difference.at_least() == 1.0 && difference.value == -3.0);
        assert_eq!(step([1.0; 3], [1.0; 3]).difference(2), None);
    }

    fn step(force: f64, pose: Pose) -> Step {
        Step {
            compression: Some(0.1 * force),
            distance_m: None,
            force_n: Some(force),
            capacitance_f: Some(1.0 + force),
            capacitance_lower_f: Some(0.9 + force),
            capacitance_upper_f: Some(1.1 + force),
            mechanics_error_estimate: None,
            geometry_error_estimate: None,
            unknowns: None,
            seconds: StepSeconds { total: 0.0 },
            load: format!("{force} {pose:?}"),
            pose,
        }
    }

    #[test]
    fn estimates_for_the_layer_and_for_flat_faces_widen_the_limits() {
        let mut step = step(1.0, Pose::default());
        (step.mechanics_error_estimate, step.geometry_error_estimate) = (Some(0.1), Some(0.05));
        let [value, lower, upper] = step.value().capacitance.unwrap();
        assert!(value == 2.0 && (lower - 1.6).abs() < 1e-12 && (upper - 2.4).abs() < 1e-12);
    }

    #[test]
    fn shifted_steps_are_named_and_are_not_in_the_curve() {
        let shifted = Pose { shift: [1e-4, 0.0], ..Pose::default() };
        let result = OneResult {
            path: "a".into(),
            title: "a pair".to_owned(),
            status: "complete".to_owned(),
            measured: None,
            proved: true,
            seconds: 0.0,
            threads: 1,
            version: String::new(),
            unknowns: None,
            steps: vec![step(0.0, Pose::default()), step(1.0, shifted), step(2.0, Pose::default())],
            keys: None,
        };
        let results = vec![result];
        let comparison = Comparison { steps: side_by_side(&results), results, keys: None };
        let labels: Vec<&str> = comparison.steps.iter().map(|step| step.label.as_str()).collect();
        assert_eq!(labels, ["U/H = 0", "U/H = 0.1, shift 100 um along x1", "U/H = 0.2"]);
        assert_eq!(comparison.chart().unwrap().series[0].points, [(0.0, 1.0), (2.0, 3.0)]);
    }
}
