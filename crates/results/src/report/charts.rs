//! The data of the page's charts; the script of the page draws them at its width.

use serde_json::{Value, json};

use super::MeasuredPoint;
use crate::figure::{approach, figure, measured_changes_chart};
use crate::plot::{Axis, Chart, Scale, Series, Style};
use elastocap_case::Case;
use elastocap_coupling::outcome::Outcome;
use elastocap_coupling::plan::Kind;

/// A chart of the page: its place, the sentence below it, and its data.
pub(super) struct PageChart {
    /// The `id` of the element that the chart is drawn into; a plain word.
    pub(super) id: &'static str,
    /// The sentence below the chart.
    pub(super) caption: &'static str,
    pub(super) chart: Chart,
}

/// The curve under load, the change beside it, the sensitivity, and the approach, as far as the run has them.
pub(super) fn charts(case: &Case, outcome: &Outcome, measured: &[MeasuredPoint]) -> Vec<PageChart> {
    let mut charts = Vec::new();
    if let Some(panels) = figure("", outcome) {
        match panels.second {
            Some(mut whole) => {
                add_measured(&mut whole, measured);
                let caption = match whole.series.iter().any(|series| series.style == Style::DashedLine) {
                    true => "Capacitance with its error as a band, beside the formula of parallel plates.",
                    false => "Capacitance with its error as a band.",
                };
                charts.push(PageChart { id: "curve-chart", caption, chart: whole });
                let caption =
                    "Change against the first step in percent of its capacitance; its error as a band.";
                charts.push(PageChart { id: "change-chart", caption, chart: panels.main });
            }
            None if outcome.plan.kind == Kind::Mechanics => {
                let caption = "Force against compression.";
                charts.push(PageChart { id: "curve-chart", caption, chart: panels.main });
            }
            None => {
                let mut main = panels.main;
                add_measured(&mut main, measured);
                let caption = "Capacitance with its error.";
                charts.push(PageChart { id: "curve-chart", caption, chart: main });
            }
        }
    }
    if let Some(chart) = measured_changes_chart(case, outcome) {
        let caption = "Change of each measured capacitance against the first step in percent of it; its error as a band.";
        charts.push(PageChart { id: "each-chart", caption, chart });
    }
    if let Some(chart) = sensitivity(outcome) {
        let caption = "Slope of the curve by differences between the steps, with its error as a band.";
        charts.push(PageChart { id: "sensitivity-chart", caption, chart });
    }
    if let Some(panels) = approach("", outcome) {
        let caption = "Capacitance before contact, against the distance of the indenter.";
        charts.push(PageChart { id: "approach-chart", caption, chart: panels.second.unwrap_or(panels.main) });
    }
    charts
}

/// Adds measured points to a chart against the force, and nothing to other charts.
fn add_measured(chart: &mut Chart, measured: &[MeasuredPoint]) {
    if measured.is_empty() || chart.x.unit != "N" {
        return;
    }
    let bar = |p: &MeasuredPoint| {
        let d = p.deviation_f.unwrap_or(0.0);
        (p.capacitance_f - d, p.capacitance_f + d)
    };
    chart.series.push(Series {
        name: "measured".to_owned(),
        points: measured.iter().map(|p| (p.force_n, p.capacitance_f)).collect(),
        band: measured.iter().any(|p| p.deviation_f.is_some()).then(|| measured.iter().map(bar).collect()),
        style: Style::Markers,
    });
}

/// The chart of dC/dF against the force; `None` with fewer than two known values.
fn sensitivity(outcome: &Outcome) -> Option<Chart> {
    let known = outcome.steps.iter().filter(|step| !step.row.is_before_contact());
    let known: Vec<_> = known
        .filter_map(|step| {
            let slope = step.row.sensitivity_f_per_n?;
            Some((step.row.force_n?, slope, step.row.sensitivity_error_f_per_n))
        })
        .collect();
    if known.len() < 2 {
        return None;
    }
    let axis =
        |label: &str, unit: &str| Axis { label: label.into(), unit: unit.into(), scale: Scale::Linear };
    let bounds = |(_, slope, error): &(f64, f64, Option<f64>)| {
        let error = error.unwrap_or(f64::NAN);
        (slope - error, slope + error)
    };
    Some(Chart {
        title: String::new(),
        x: axis("force", "N"),
        y: axis("sensitivity dC/dF", "F/N"),
        series: vec![Series {
            name: "sensitivity, and its error".to_owned(),
            points: known.iter().map(|(force, slope, _)| (*force, *slope)).collect(),
            band: Some(known.iter().map(bounds).collect()),
            style: Style::LineAndMarkers,
        }],
    })
}

/// The data of all charts, for the page's script to draw.
pub(super) fn data(charts: &[PageChart]) -> Value {
    charts.iter().map(|chart| chart_data(chart.id, &chart.chart)).collect()
}

/// The data of one chart, which is drawn into the element `id`.
pub(super) fn chart_data(id: &str, chart: &Chart) -> Value {
    let axis = |axis: &Axis| json!({ "label": axis.label, "unit": axis.unit, "log": axis.scale == Scale::Logarithmic });
    let series: Vec<Value> = chart.series.iter().map(series_data).collect();
    json!({ "id": id, "x": axis(&chart.x), "y": axis(&chart.y), "series": series })
}

fn series_data(series: &Series) -> Value {
    let style = match series.style {
        Style::LineAndMarkers | Style::Line => "line",
        Style::DashedLine => "dashed",
        Style::Markers | Style::Points { .. } | Style::Cloud { .. } => "points",
    };
    // NaN and infinities become null in JSON.
    let x: Vec<f64> = series.points.iter().map(|p| p.0).collect();
    let y: Vec<f64> = series.points.iter().map(|p| p.1).collect();
    let mut data = json!({ "name": series.name, "style": style, "x": x, "y": y });
    if let (Some(band), Some(fields)) = (&series.band, data.as_object_mut()) {
        fields.insert("lower".into(), band.iter().map(|b| b.0).collect());
        fields.insert("upper".into(), band.iter().map(|b| b.1).collect());
    }
    data
}
