//! The charts of a run: capacitance or force under load, and the approach before contact.
//!
//! `curve.svg` has two charts against the load: the change of the capacitance with its error, and below it
//! the capacitance itself, beside that of parallel plates. In a case without conductors it has the force
//! against the compression instead. `approach.svg` has the two charts of the capacitance against the distance
//! of the indenter, before contact.

use crate::measured::{self, Comparison, load_axis};
use crate::pairs::{PairChange, measured_changes};
use crate::plot::{Axis, Chart, Panels, Scale, Series, Style};
use crate::pose::{ByPose, Place, by_pose};
use elastocap_case::{Case, MeasuredLoad, MeasuredPoints};
use elastocap_coupling::outcome::{Outcome, Row, StepResult};
use elastocap_coupling::plan::{HELD_PATCH, Kind};
use elastocap_coupling::terminals::in_words;

fn axis(label: &str, unit: &str) -> Axis {
    Axis { label: label.into(), unit: unit.into(), scale: Scale::Linear }
}

/// The value, or NaN, which the plot leaves out.
fn known(value: Option<f64>) -> f64 {
    value.unwrap_or(f64::NAN)
}

/// The figure `curve.svg`; `None` for a scene without load, and where the indenter touches the layer at no
/// step.
pub fn figure(title: &str, outcome: &Outcome) -> Option<Panels> {
    figure_with_points(title, outcome, None)
}

/// The figure of a curve with measured points drawn over the capacitance and their residuals below it, if
/// there are any; `None` as for [`figure`].
pub fn figure_with_points(
    title: &str,
    outcome: &Outcome,
    measured: Option<(&MeasuredPoints, &Comparison)>,
) -> Option<Panels> {
    let held = !outcome.layer_meshes.is_empty()
        && outcome.plan.layer.as_ref().is_some_and(|layer| layer.indenter == HELD_PATCH);
    let title = if held { format!("{title} (under {HELD_PATCH})") } else { title.to_owned() };
    match outcome.plan.kind {
        Kind::Capacitance => None,
        Kind::Mechanics => Some(Panels { title, main: force(outcome), second: None, third: None }),
        Kind::Curve => {
            if let Some((points, comparison)) = measured {
                let (x, places) = (load_axis(points.load), places_on(outcome, points.load));
                let mut curve = capacitance(outcome, &x, &places);
                // Beside parallel plates, which may be ten times less, residuals would not be seen.
                curve.series.retain(|series| series.style != Style::DashedLine);
                let change = change(outcome, &x, &places);
                return Some(measured::panels(title, curve, points.load, comparison, change));
            }
            let (x, loads) = load(outcome);
            let places = loads.into_iter().enumerate();
            let touched: Vec<Place> =
                places.filter(|(k, _)| !outcome.steps[*k].row.is_before_contact()).collect();
            (!touched.is_empty()).then(|| panels(title, outcome, &x, &touched))
        }
    }
}

/// The figure `approach.svg`; `None` unless at least two steps are before contact.
pub fn approach(title: &str, outcome: &Outcome) -> Option<Panels> {
    let steps = outcome.steps.iter().enumerate().filter(|(_, step)| step.row.is_before_contact());
    let distances: Vec<Place> = steps.map(|(k, step)| (k, known(step.row.distance_m))).collect();
    let label = "distance of the indenter from the layer";
    let x = Axis { label: label.to_owned(), unit: "m".to_owned(), scale: Scale::Logarithmic };
    (distances.len() >= 2 && outcome.plan.kind == Kind::Curve)
        .then(|| panels(title.to_owned(), outcome, &x, &distances))
}

/// The steps in contact, each at its load of the kind that the measured points have.
fn places_on(outcome: &Outcome, load: MeasuredLoad) -> Vec<Place> {
    let on_axis = |row: &Row| match load {
        MeasuredLoad::Force => row.force_n,
        MeasuredLoad::Displacement => row.top_displacement_m,
        MeasuredLoad::Compression => row.compression,
    };
    let steps = outcome.steps.iter().enumerate().filter(|(_, step)| !step.row.is_before_contact());
    steps.map(|(k, step)| (k, known(on_axis(&step.row)))).collect()
}

/// The change above the capacitance itself, against the places of some steps on an axis.
fn panels(title: String, outcome: &Outcome, x: &Axis, places: &[Place]) -> Panels {
    let whole = capacitance(outcome, x, places);
    match change(outcome, x, places) {
        Some(change) => Panels { title, main: change, second: Some(whole), third: None },
        None => Panels { title, main: whole, second: None, third: None },
    }
}

/// The force against the compression; forces by finite elements have their errors as a band.
fn force(outcome: &Outcome) -> Chart {
    let rows = || outcome.steps.iter().map(|step| &step.row);
    let by_finite_elements = !outcome.layer_meshes.is_empty();
    let band = |r: &Row| {
        let (force, error) = (known(r.force_n), known(r.relative_error_estimate));
        (force * (1.0 - error), force * (1.0 + error))
    };
    let name = if by_finite_elements { "finite elements, and their error" } else { "closed form" };
    Chart {
        title: String::new(),
        x: axis("compression U/H", ""),
        y: axis("force", "N"),
        series: vec![Series {
            name: name.to_owned(),
            points: rows().map(|r| (known(r.compression), known(r.force_n))).collect(),
            band: by_finite_elements.then(|| rows().map(band).collect()),
            style: Style::LineAndMarkers,
        }],
    }
}

/// The change of each capacitance that `[measure]` names since the first step, %, against the load; `None` if
/// it names only one, and with fewer than two steps.
pub(crate) fn measured_changes_chart(case: &Case, outcome: &Outcome) -> Option<Chart> {
    let steps = measured_changes(case, outcome);
    let (x, loads) = load(outcome);
    // Steps that are shifted or tilted in addition are shown in the table only.
    let curve = by_pose(outcome, &loads.into_iter().enumerate().collect::<Vec<_>>()).curve;
    let place = |step: &StepResult| curve.iter().find(|(k, _)| *k == step.index).map(|(_, x)| *x);
    let of_entry = |k: usize| {
        let changes = || steps.iter().filter_map(|(step, changes)| Some((place(step)?, changes.get(k)?)));
        let percent = |change: &PairChange, farads: f64| 100.0 * farads / change.values[0].abs();
        let (_, first) = changes().next()?;
        let (what, terminals) = in_words(first.measurement(), &outcome.conductors);
        Some(Series {
            name: format!("{what} of {}", terminals.unwrap_or_default()),
            points: changes().map(|(x, change)| (x, percent(change, change.change()))).collect(),
            band: Some(
                changes()
                    .map(|(_, change)| (percent(change, change.limits[0]), percent(change, change.limits[1])))
                    .collect(),
            ),
            style: Style::LineAndMarkers,
        })
    };
    (steps.len() > 1).then(|| Chart {
        title: String::new(),
        x,
        y: axis("change of each capacitance", "%"),
        series: (0..case.measured_entries().len()).filter_map(of_entry).collect(),
    })
}

/// The axis and the values that the capacitance is drawn against: the force, or the compression where a step
/// with a capacitance has no force.
fn load(outcome: &Outcome) -> (Axis, Vec<f64>) {
    let rows = || outcome.steps.iter().map(|step| &step.row);
    let without_force =
        rows().any(|r| r.force_n.is_none() && r.capacitance_f.is_some() && r.compression.is_some());
    if without_force {
        (axis("compression U/H", ""), rows().map(|r| known(r.compression)).collect())
    } else {
        (axis("force", "N"), rows().map(|r| known(r.force_n)).collect())
    }
}

/// The words for the limits of the bands: the bounds, and the estimated errors where there are any.
fn limits(outcome: &Outcome) -> &'static str {
    match outcome.steps.iter().any(|step| step.row.estimated_errors() > 0.0) {
        true => "its bounds with all estimated errors",
        false => "its bounds",
    }
}

/// The ends of a band, which the plot leaves out where they are not known.
fn ends(limits: Option<[f64; 2]>) -> (f64, f64) {
    limits.map_or((f64::NAN, f64::NAN), |[lower, upper]| (lower, upper))
}

/// The change since the first step, %; `None` where there are no two steps to compare.
fn change(outcome: &Outcome, x: &Axis, places: &[Place]) -> Option<Chart> {
    let first_row = &outcome.steps.first()?.row;
    let first_capacitance = first_row.capacitance_f?;
    let rows = || places.iter().map(|(k, _)| &outcome.steps[*k].row);
    if rows().filter(|row| row.change_f.is_some()).count() < 2 {
        return None;
    }
    let percent = |change: f64| 100.0 * change / first_capacitance;
    let value = |row: &Row| percent(known(row.change_f));
    let bounds = |row: &Row| ends(row.change_limits(first_row).map(|limits| limits.map(percent)));
    let name = format!("change since the first step, and {}", limits(outcome));
    Some(Chart {
        title: String::new(),
        x: x.clone(),
        y: axis("change of the capacitance", "%"),
        series: series(&name, outcome, places, value, bounds),
    })
}

/// A line with its bounds through the steps that differ in the load alone, and markers with bars for those
/// that are shifted or tilted, which no line may join.
fn series(
    name: &str,
    outcome: &Outcome,
    places: &[Place],
    value: impl Fn(&Row) -> f64,
    bounds: impl Fn(&Row) -> (f64, f64),
) -> Vec<Series> {
    let of_steps = |name: String, places: &[Place], style| {
        let rows = || places.iter().map(|(k, x)| (*x, &outcome.steps[*k].row));
        Series {
            name,
            points: rows().map(|(x, row)| (x, value(row))).collect(),
            band: Some(rows().map(|(_, row)| bounds(row)).collect()),
            style,
        }
    };
    let ByPose { curve, beside } = by_pose(outcome, places);
    let curve = of_steps(name.to_owned(), &curve, Style::LineAndMarkers);
    let beside = beside.into_iter().map(|(name, places)| of_steps(name, &places, Style::Markers));
    std::iter::once(curve).chain(beside).collect()
}

/// The capacitance with its bounds, and that of parallel plates where it is known.
fn capacitance(outcome: &Outcome, x: &Axis, places: &[Place]) -> Chart {
    let value = |row: &Row| known(row.capacitance_f);
    let bounds = |row: &Row| ends(row.capacitance_limits());
    let words = outcome.measurement.map(|measurement| in_words(measurement, &outcome.conductors));
    let (label, terminals) = words.unwrap_or_default();
    let terminals = terminals.map_or_else(String::new, |names| format!("{names}, "));
    let name = format!("{terminals}with the fringing field, and {}", limits(outcome));
    let mut series = series(&name, outcome, places, value, bounds);
    let curve = by_pose(outcome, places).curve;
    let plates: Vec<(f64, f64)> =
        curve.iter().map(|(k, x)| (*x, known(outcome.steps[*k].row.parallel_plate_f))).collect();
    if plates.iter().any(|(_, value)| value.is_finite()) {
        let name = "parallel plates".to_owned();
        series.insert(1, Series { name, points: plates, band: None, style: Style::DashedLine });
    }
    Chart { title: String::new(), x: x.clone(), y: axis(label, "F"), series }
}

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::sync::Arc;
    use std::sync::atomic::AtomicBool;

    use elastocap_coupling::plan::{Options, Plan};
    use elastocap_coupling::run::run;

    use super::*;

    fn pressed() -> Outcome {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../cases/in-plane-pair.toml");
        let case = elastocap_case::load(&path).unwrap();
        let options = Options { prune: true, fields: false, scene: false, model_error: false };
        let plan = Plan::new(&case, &options);
        run(&case, &plan, &options, &Arc::new(AtomicBool::new(false)), &())
    }

    #[test]
    fn the_change_is_nothing_at_first_and_lies_within_bounds_that_every_pair_of_capacitances_meets() {
        let mut outcome = pressed();
        let panels = figure("a pair", &outcome).unwrap();
        let drawn = &panels.main.series[0];
        let band = drawn.band.as_ref().unwrap();
        assert_eq!((drawn.points[0].1, band[0]), (0.0, (0.0, 0.0)));
        let rows: Vec<_> = outcome.steps.iter().map(|step| &step.row).collect();
        let ends = |r: &Row| [r.capacitance_lower_f.unwrap(), r.capacitance_upper_f.unwrap()];
        let value = rows[0].capacitance_f.unwrap();
        for ((row, point), (lower, upper)) in rows.iter().zip(&drawn.points).zip(band).skip(1) {
            assert!(*lower < point.1 && point.1 < *upper);
            for first in ends(rows[0]) {
                for now in ends(row) {
                    let between = 100.0 * (now - first) / value;
                    assert!(lower - 1e-10 < between && between < upper + 1e-10);
                }
            }
        }
        assert_eq!((panels.main.y.unit.as_str(), panels.main.series.len()), ("%", 1));
        assert_eq!(panels.second.as_ref().unwrap().series.len(), 2);
        let last = 100.0 * outcome.steps[5].row.change_relative.unwrap();
        assert!((panels.main.series[0].points[5].1 - last).abs() < 1e-12);
        // Beyond the largest force of the formula a step has a capacitance and no force: the axis is the
        // compression.
        outcome.steps[5].row.force_n = None;
        let panels = figure("a pair", &outcome).unwrap();
        assert_eq!(
            (panels.main.x.label.as_str(), panels.main.series[0].points[5].0),
            ("compression U/H", 0.4)
        );
        // One step alone has not changed.
        outcome.steps.truncate(1);
        let panels = figure("a pair", &outcome).unwrap();
        assert!(panels.second.is_none() && panels.main.y.unit == "F");
    }

    #[test]
    fn the_bands_include_the_estimated_errors_of_the_model() {
        let outcome = pressed();
        let panels = figure("a pair", &outcome).unwrap();
        let whole = &panels.second.as_ref().unwrap().series[0];
        let change = &panels.main.series[0];
        assert!(change.name.ends_with("its bounds with all estimated errors"), "{}", change.name);
        let first = outcome.steps[0].row.capacitance_f.unwrap();
        for (k, step) in outcome.steps.iter().enumerate().skip(1) {
            let row = &step.row;
            let model = row.model_error_estimate.unwrap() * row.capacitance_f.unwrap();
            assert!(model > 0.0);
            let (lower, upper) = whole.band.as_ref().unwrap()[k];
            assert!(upper >= row.capacitance_upper_f.unwrap() + 0.999 * model, "{k}: {upper:e}");
            assert!(lower <= row.capacitance_lower_f.unwrap() - 0.999 * model, "{k}: {lower:e}");
            let (lower, upper) = change.band.as_ref().unwrap()[k];
            let stated = 100.0 * row.change_total_error_f.unwrap() / first;
            let farthest = (upper - change.points[k].1).max(change.points[k].1 - lower);
            assert!((farthest / stated - 1.0).abs() < 1e-9, "{k}: {farthest} {stated}");
        }
    }

    #[test]
    fn without_contact_there_is_a_curve_against_the_distance_alone() {
        let mut outcome = pressed();
        for (k, step) in outcome.steps.iter_mut().enumerate() {
            step.row.distance_m = Some(1e-3 / (k + 1) as f64);
        }
        assert!(figure("a pair", &outcome).is_none());
        assert_eq!(approach("a pair", &outcome).unwrap().main.series[0].points.len(), outcome.steps.len());
    }

    #[test]
    fn steps_that_are_shifted_or_tilted_are_points_beside_the_line() {
        let mut outcome = pressed();
        outcome.plan.steps[3].pose.shift = [1e-4, 0.0];
        outcome.plan.steps[4].pose.tilt = [0.0, 0.2_f64.to_radians()];
        let panels = figure("a pair", &outcome).unwrap();
        let force = |k: usize| outcome.steps[k].row.force_n.unwrap();
        let xs = |series: &Series| series.points.iter().map(|point| point.0).collect::<Vec<f64>>();
        let whole = panels.second.as_ref().unwrap();
        assert_eq!(whole.series[1].style, Style::DashedLine);
        for (chart, beside) in [(&panels.main, 1), (whole, 2)] {
            assert_eq!(chart.series.len(), beside + 2);
            for joined in &chart.series[..beside] {
                assert_eq!(xs(joined), [0, 1, 2, 5].map(force));
            }
            for (marked, name, k) in [
                (&chart.series[beside], "shift 100\u{a0}\u{b5}m along x1", 3),
                (&chart.series[beside + 1], "tilt 0.2\u{b0} about x1", 4),
            ] {
                assert_eq!((marked.name.as_str(), marked.style), (name, Style::Markers));
                assert_eq!(xs(marked), [force(k)]);
                assert!(marked.band.as_ref().is_some_and(|band| band.len() == 1));
            }
        }
        let row = &outcome.steps[3].row;
        assert_eq!(whole.series[2].points[0].1, row.capacitance_f.unwrap());
        // Many poses share one entry of the legend.
        for (k, step) in outcome.plan.steps.iter_mut().enumerate().skip(2) {
            step.pose = elastocap_case::Pose { shift: [k as f64 * 1e-5, 0.0], ..Default::default() };
        }
        let panels = figure("a pair", &outcome).unwrap();
        let names: Vec<&str> = panels.main.series.iter().map(|series| series.name.as_str()).collect();
        assert_eq!(names[1..], ["shifted or tilted"]);
        assert_eq!(xs(&panels.main.series[1]), [2, 3, 4, 5].map(force));
        // A curve at one shift is a curve.
        for step in &mut outcome.plan.steps {
            step.pose.shift = [1e-5, 0.0];
        }
        assert_eq!(figure("a pair", &outcome).unwrap().main.series.len(), 1);
    }
}
