//! `report.html`: the results of a run as one page that opens from disk and asks the network for nothing.
//!
//! Everything is in the HTML as tables and text. The page's scripts draw the charts and the 3D view from the
//! data at its end, so that a reader without them loses pictures and no number. What comes from a case
//! (titles, names, paths) goes through `html::escape`, or through `html::json_in_script` where a script reads
//! it.
//!
//! | file | what is in it |
//! |---|---|
//! | `html` | escaping, numbers as people read them, tables |
//! | `answer` | the head of the page: what came out, in a sentence and in figures |
//! | `charts` | the data of the charts |
//! | `tables` | the tables of steps, matrices, errors and times |
//! | `sections` | pictures of sections through the field |
//! | `scene` | the bodies for the 3D view |
//! | `about` | plan, case, files, and how to repeat the run |
//! | `shell` | the page around all that: style, scripts, library |
//! | `compare` | several results side by side |

mod about;
mod answer;
mod charts;
mod compare;
pub(crate) mod html;
mod scene;
mod sections;
mod shell;
mod tables;

use elastocap_case::{Case, MeasuredLoad};
use elastocap_coupling::outcome::Outcome;
use elastocap_coupling::plan::Kind;
use elastocap_coupling::reason::Reason;
use elastocap_coupling::view::cut_off;
use serde_json::{Value, json};

use crate::measured::{ComparedPoint, Comparison};
use crate::scene_files::Shown;
use crate::{FieldFiles, RunSeconds};
use charts::PageChart;
use html::escape;
use shell::{Page, Part};

pub use compare::{WordTable, comparison_page};

/// A capacitance that was measured under a force, to be drawn over the curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredPoint {
    /// The force, N.
    pub force_n: f64,
    /// The capacitance, F.
    pub capacitance_f: f64,
    /// The standard deviation of the capacitance, F; `None` where it is not known.
    pub deviation_f: Option<f64>,
}

impl MeasuredPoint {
    /// The points of a comparison as they are drawn over a curve of the force; none where they were measured
    /// over something else.
    pub(crate) fn under_force(comparison: &Comparison) -> Vec<Self> {
        let points = comparison.points.iter().filter(|_| comparison.load == MeasuredLoad::Force.name());
        let point = |p: &ComparedPoint| Self {
            force_n: p.load,
            capacitance_f: p.capacitance_f,
            deviation_f: p.deviation_f,
        };
        points.map(point).collect()
    }
}

/// The content of the page.
pub(crate) struct Report<'a> {
    pub(crate) case: &'a Case,
    pub(crate) outcome: &'a Outcome,
    pub(crate) fields: &'a FieldFiles,
    /// Warnings that came up while files were written, and those that concern the whole run.
    pub(crate) warnings: &'a [String],
    pub(crate) seconds: RunSeconds,
    /// Names of the files beside the page.
    pub(crate) files: &'a [String],
    /// The bodies for the 3D view.
    pub(crate) shown: &'a Shown,
    /// The text of the case file, where the caller has it.
    pub(crate) case_text: Option<&'a str>,
    /// The command that repeats the run, where there was one.
    pub(crate) command: Option<&'a str>,
    /// The measured points to be drawn over the curve.
    pub(crate) measured: &'a [MeasuredPoint],
}

impl Report<'_> {
    /// The page as HTML.
    pub(crate) fn html(&self) -> String {
        let charts = charts::charts(self.case, self.outcome, self.measured);
        let mut scene = scene::scene(self.shown);
        if let Some(labels) = scene.as_mut().and_then(|scene| scene.description["labels"].as_array_mut())
            && labels.len() == self.outcome.steps.len()
        {
            let of_steps =
                self.outcome.steps.iter().map(|step| tables::step_label(self.outcome, step).into());
            *labels = of_steps.collect();
        }
        if let Some(scene) = &mut scene
            && let Some(note) = self.cut_off(&scene.description["bodies"])
        {
            scene.description["notes"] = json!([note]);
        }
        let mut page = Page::new(&self.case.title);
        page.lead(answer::answer(self));
        if let Some(warnings) = self.warning_list() {
            page.section("warnings", "Warnings", &warnings);
        }
        self.add_curve(&mut page, &charts);
        if let Some(sections) = sections::sections(self) {
            page.section("field", "Field and deformed layer", &sections);
        }
        if let Some(scene) = &scene {
            page.section("view", "Sensor in three dimensions", &sections::view(scene));
        }
        if let Some(matrices) = tables::matrices(self.outcome) {
            page.section("matrix", "Maxwell matrix", &matrices);
        }
        page.section("errors", "Errors and time", &tables::errors_and_times(self));
        page.section("plan", "Plan", &about::plan(&self.outcome.plan));
        if let Some(text) = self.case_text {
            page.section("case", "Case file", &about::case_text(self.case, text));
        }
        page.section("repeat", "Files, and how to repeat the run", &about::repeat(self));
        let data = json!({
            "charts": charts::data(&charts),
            "scene": scene.as_ref().map(|scene| &scene.description),
        });
        let mut parts = vec![Part::Charts];
        if let Some(scene) = &scene {
            parts.push(Part::Scene(&scene.bytes));
        }
        page.finish(&data, &parts)
    }

    /// Says which of the bodies of the 3D view go on beyond what is shown of them.
    fn cut_off(&self, bodies: &Value) -> Option<String> {
        let mut names = cut_off(self.outcome.steps.iter().find_map(|step| step.scene.as_ref())?);
        names.retain(|name| bodies.as_array().into_iter().flatten().any(|body| body["name"] == **name));
        let go = if names.len() == 1 { "goes" } else { "go" };
        (!names.is_empty()).then(|| format!("Shown in part: {}, which {go} on.", names.join(", ")))
    }

    /// The warnings of the run and of its steps as an HTML list, each text once; `None` without any.
    fn warning_list(&self) -> Option<String> {
        let of_run = self.outcome.plan.warnings.iter().chain(self.warnings).cloned();
        let of_steps = self.outcome.steps.iter().filter(|step| step.same_as.is_none()).flat_map(|step| {
            let warnings = step.warnings.iter().map(String::as_str).chain(self.fields.warning(step.index));
            let reason =
                (!step.row.status.is_ok()).then(|| format!("{}{}", step.row.status, because(&step.reason)));
            let changes = step.route_changes.iter().map(ToString::to_string);
            let warnings = warnings.map(str::to_owned).chain(changes).chain(reason);
            warnings.map(|text| format!("Step {}: {text}", step.index)).collect::<Vec<_>>()
        });
        let mut warnings: Vec<String> = Vec::new();
        for text in of_run.chain(of_steps) {
            if !warnings.contains(&text) {
                warnings.push(text);
            }
        }
        if warnings.is_empty() {
            return None;
        }
        let items: String = warnings.iter().map(|text| format!("<li>{}</li>\n", escape(text))).collect();
        Some(format!("<ul class=\"warnings\">\n{items}</ul>\n"))
    }

    /// The charts of the curve with the table of its steps, and those of the sensitivity and the approach.
    fn add_curve(&self, page: &mut Page, charts: &[PageChart]) {
        let figures = |ids: &[&str]| -> String {
            charts.iter().filter(|chart| ids.contains(&chart.id)).map(figure).collect()
        };
        if self.outcome.plan.kind == Kind::Capacitance {
            page.section("capacitance", "Capacitance", &tables::steps(self.outcome));
            return;
        }
        let heading = match self.outcome.plan.kind {
            Kind::Mechanics => "Force against compression",
            Kind::Curve | Kind::Capacitance => "Capacitance under load",
        };
        let body = format!(
            "<div class=\"charts\">{}</div>\n{}{}{}",
            figures(&["curve-chart", "change-chart", "each-chart"]),
            tables::steps(self.outcome),
            tables::measured_entries(self),
            tables::whole_curve(self.outcome)
        );
        page.section("curve", heading, &body);
        for (id, heading, chart) in [
            ("sensitivity", "Sensitivity", "sensitivity-chart"),
            ("approach", "Before contact", "approach-chart"),
        ] {
            let drawn = figures(&[chart]);
            if !drawn.is_empty() {
                page.section(id, heading, &format!("<div class=\"charts\">{drawn}</div>\n"));
            }
        }
    }
}

/// A reason in words, after a status.
fn because(reason: &Option<Reason>) -> String {
    reason.as_ref().map_or_else(String::new, |reason| format!(": {reason}"))
}

/// The place of a chart, which the page's script fills.
fn figure(chart: &PageChart) -> String {
    let label = format!("{} against {}", chart.chart.y.label, chart.chart.x.label);
    format!(
        "<figure><div class=\"chart\" id=\"{}\" role=\"group\" tabindex=\"0\" aria-label=\"Chart: {}. The arrow keys go from point to point; \
         the table has the numbers.\"></div><figcaption>{}</figcaption></figure>\n",
        chart.id,
        escape(&label),
        escape(chart.caption)
    )
}

#[cfg(test)]
mod tests;
