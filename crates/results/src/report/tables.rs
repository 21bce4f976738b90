//! Tables of the steps, the matrices, the errors and the times.

use std::fmt::Write as _;

use elastocap_case::FieldSolver;
use elastocap_coupling::outcome::{Outcome, Row, StepResult};
use elastocap_coupling::plan::Kind;
use elastocap_coupling::route::{Route, SolvedShape};
use elastocap_coupling::terminals::in_words;
use elastocap_coupling::words::grouped;

use super::Report;
use super::html::{Table, column, escape};
use crate::csv::{number, optional};
use crate::pairs::{PairChange, measured_changes};
use crate::pose;
use crate::scene_files::label;
use crate::typeset::quantity;

/// The largest number of entries of all matrices together; of larger results the page shows the first and the
/// last step.
const MOST_ENTRIES: usize = 6000;

/// A value of each step.
fn of_each(outcome: &Outcome, value: fn(&Row) -> Option<f64>) -> Vec<Option<f64>> {
    outcome.steps.iter().map(|step| value(&step.row)).collect()
}

/// The load of a step in words, with the shift and tilt of the attached bodies.
pub(super) fn step_label(outcome: &Outcome, step: &StepResult) -> String {
    let load = label(step).replace(" um", " \u{b5}m");
    match pose::of_step(outcome, step) {
        Some(pose) => format!("{load}, {pose}"),
        None => load,
    }
}

/// The number and the load of each step.
fn labels(outcome: &Outcome) -> Vec<String> {
    outcome.steps.iter().map(|step| format!("{}: {}", step.index, step_label(outcome, step))).collect()
}

/// The table of the main numbers of each step.
pub(super) fn steps(outcome: &Outcome) -> String {
    let values_of = |value| of_each(outcome, value);
    let caption = match outcome.plan.kind {
        Kind::Mechanics => "Force at each step",
        Kind::Curve | Kind::Capacitance => "Capacitance at each step",
    };
    let mut table = Table::new(caption);
    table.words("step", labels(outcome));
    if outcome.plan.kind != Kind::Capacitance {
        table.quantities("distance", &values_of(|r| r.distance_m), 4, "m");
        table.quantities("force", &values_of(|r| r.force_n), 4, "N");
        table.shares("\u{b1}", &values_of(|r| r.force_error_estimate));
    }
    table.quantities("C", &values_of(|r| r.capacitance_f), 6, "F");
    table.shares("\u{b1}", &values_of(Row::total_error));
    if outcome.steps.len() > 1 {
        table.quantities("change", &values_of(|r| r.change_f), 4, "F");
        table.quantities("\u{b1}", &values_of(|r| r.change_total_error_f), 2, "F");
    }
    table.quantities("parallel plates", &values_of(|r| r.parallel_plate_f), 4, "F");
    table.quantities("ratio", &values_of(|r| r.fringe_ratio), 4, "");
    table.quantities("sensitivity", &values_of(|r| r.sensitivity_f_per_n), 3, "F/N");
    table.quantities("\u{b1}", &values_of(|r| r.sensitivity_error_f_per_n), 2, "F/N");
    table.words("status", outcome.steps.iter().map(|step| step.row.status.to_string()).collect());
    table.html()
}

/// The table of each capacitance that `[measure]` names, at each step; empty where it names only one.
pub(super) fn measured_entries(report: &Report<'_>) -> String {
    let steps = measured_changes(report.case, report.outcome);
    if steps.is_empty() {
        return String::new();
    }
    let rows: Vec<(&StepResult, &PairChange)> =
        steps.iter().flat_map(|(step, changes)| changes.iter().map(move |change| (*step, change))).collect();
    let values_of = |value: fn(&PairChange) -> f64| {
        let finite = |change: &PairChange| Some(value(change)).filter(|value| value.is_finite());
        rows.iter().map(|(_, change)| finite(change)).collect::<Vec<_>>()
    };
    let name = |change: &PairChange| {
        let (what, terminals) = in_words(change.measurement(), &report.outcome.conductors);
        format!("{what} of {}", terminals.unwrap_or_default())
    };
    let mut table = Table::new("Each measured capacitance");
    table.words("capacitance", rows.iter().map(|(_, change)| name(change)).collect());
    table.words("step", rows.iter().map(|(step, _)| step_label(report.outcome, step)).collect());
    table.quantities("C", &values_of(|change| change.values[1]), 6, "F");
    table.shares("\u{b1}", &values_of(|change| change.errors[1]));
    table.quantities("change", &values_of(PairChange::change), 4, "F");
    table.quantities("from", &values_of(|change| change.limits[0]), 4, "F");
    table.quantities("to", &values_of(|change| change.limits[1]), 4, "F");
    table.html()
}

/// The table of every column of `curve.csv` that is not empty, with all digits.
pub(super) fn whole_curve(outcome: &Outcome) -> String {
    if !outcome.has_curve() {
        return String::new();
    }
    let mut table = Table::new("All columns of curve.csv, in SI units");
    let rows: Vec<_> = outcome.steps.iter().map(|step| step.row.numbers()).collect();
    // The last two columns, unknowns and status, are no quantities and follow below.
    for (k, name) in Row::COLUMNS.iter().enumerate().take(28) {
        if rows.iter().any(|row| row[k].is_some()) {
            table.numbers(name, rows.iter().map(|row| optional(row[k])).collect());
        }
    }
    let unknowns = outcome.steps.iter().map(|s| s.row.unknowns.map_or_else(String::new, |n| n.to_string()));
    table.numbers("unknowns", unknowns.collect());
    table.words("status", outcome.steps.iter().map(|step| step.row.status.to_string()).collect());
    format!("<details><summary>All columns, with all digits</summary>\n{}</details>\n", table.html())
}

/// The Maxwell matrix of each step, with the potentials of floating conductors; `None` without any.
pub(super) fn matrices(outcome: &Outcome) -> Option<String> {
    let known: Vec<&StepResult> =
        outcome.steps.iter().filter(|step| step.maxwell.is_some() && step.same_as.is_none()).collect();
    let (first, last) = (known.first()?, known.last()?);
    let entries: usize = known.iter().map(|s| s.maxwell.iter().flatten().map(Vec::len).sum::<usize>()).sum();
    let has_all_steps = entries <= MOST_ENTRIES;
    let shown: Vec<&StepResult> = match (has_all_steps, first.index == last.index) {
        (true, _) => known,
        (false, true) => vec![first],
        (false, false) => vec![first, last],
    };
    let mut out = "<p>Charge on the conductor of the row for one volt on that of the column, all others at zero. After \u{b1} stands half \
                   the distance between the proved bounds.</p>\n"
        .to_owned();
    if !has_all_steps {
        out.push_str("<p>Only the first and the last step are shown; capacitance.csv has all of them.</p>\n");
    }
    if shown.len() > 1 {
        out.push_str("<p class=\"chooser\" hidden><label>Step <select data-steps=\"matrices\">");
        for step in &shown {
            let _ = write!(
                out,
                "<option value=\"{}\">{}</option>",
                step.index,
                escape(&step_label(outcome, step))
            );
        }
        out.push_str("</select></label></p>\n");
    }
    out.push_str("<div id=\"matrices\">\n");
    for step in shown {
        let _ = writeln!(out, "<div data-step=\"{}\">\n{}</div>", step.index, matrix(outcome, step));
    }
    out.push_str("</div>\n");
    Some(out)
}

/// The Maxwell matrix of a step, and the potentials of floating conductors.
fn matrix(outcome: &Outcome, step: &StepResult) -> String {
    let Some(entries) = &step.maxwell else { return String::new() };
    let values: Vec<Option<f64>> = entries.iter().flatten().map(|c| Some(c.value)).collect();
    let (unit, cells) = column(&values, 6, "F");
    let places = cells.first().and_then(|c| c.split_once('.')).map_or(0, |(_, places)| places.len());
    // Farads in one unit of the column.
    let in_farads = values.iter().flatten().zip(&cells).find_map(|(value, cell)| {
        let shown: f64 = cell.replace('\u{2212}', "-").parse().ok()?;
        (shown != 0.0).then(|| 10_f64.powf((value / shown).log10().round()))
    });
    let in_farads = in_farads.unwrap_or(1.0);
    let name = |k: usize| outcome.conductors.get(k).cloned().unwrap_or_else(|| k.to_string());
    let mut table =
        Table::new(&format!("Maxwell matrix in {unit}, step {}: {}", step.index, step_label(outcome, step)));
    table.words("terminal", (0..entries.len()).map(name).collect());
    for j in 0..entries.len() {
        let cell = |i: usize| {
            let half = entries[i].get(j).map_or(0.0, |c| 0.5 * (c.upper - c.lower) / in_farads);
            let value = cells.get(i * entries.len() + j).map_or("", String::as_str);
            format!("{value}\u{a0}\u{b1}\u{a0}{half:.places$}")
        };
        table.numbers(&name(j), (0..entries.len()).map(cell).collect());
    }
    let mut out = table.html();
    if !step.floating.is_empty() {
        let mut table = Table::new("Potentials of floating conductors, in V for 1 V on a terminal");
        table.words("conductor", step.floating.iter().map(|conductor| conductor.name.clone()).collect());
        for (k, driven) in outcome.conductors.iter().enumerate() {
            let in_words = |v: Option<&elastocap_electrostatics::Bounded>| {
                v.map_or_else(
                    || "\u{2013}".to_owned(),
                    |v| format!("{:.5}\u{a0}\u{b1}\u{a0}{:.5}", v.value + 0.0, 0.5 * (v.upper - v.lower)),
                )
            };
            table.numbers(
                driven,
                step.floating.iter().map(|conductor| in_words(conductor.per_volt.get(k))).collect(),
            );
        }
        let charged = step.floating.iter().any(|conductor| conductor.from_charges.value != 0.0);
        if charged {
            let cell = |conductor: &elastocap_coupling::outcome::FloatingConductor| {
                quantity(conductor.from_charges.value, 5, "V")
            };
            table.numbers("from charges", step.floating.iter().map(cell).collect());
        }
        out.push_str(&table.html());
    }
    out
}

fn route_in_words(route: Route) -> &'static str {
    match (route.shape(), route.solver()) {
        (SolvedShape::Mapped, _) => "boxes under a map",
        (_, FieldSolver::Boxes) => "boxes",
        (SolvedShape::Straight, FieldSolver::Extruded) => "extruded outlines",
        (SolvedShape::Outlines, FieldSolver::Extruded) => "bent outlines",
        (SolvedShape::Outlines, FieldSolver::Tetrahedra) => "bent outlines on tetrahedra",
        (SolvedShape::Straight, FieldSolver::Tetrahedra) => "tetrahedra",
    }
}

/// The errors of each step, and its times.
pub(super) fn errors_and_times(report: &Report<'_>) -> String {
    let outcome = report.outcome;
    let steps: Vec<&StepResult> = outcome.steps.iter().filter(|step| step.same_as.is_none()).collect();
    let values_of = |value: fn(&Row) -> Option<f64>| -> Vec<Option<f64>> {
        steps.iter().map(|s| value(&s.row)).collect()
    };
    let names: Vec<String> =
        steps.iter().map(|step| format!("{}: {}", step.index, step_label(outcome, step))).collect();
    let mut errors = Table::new("How well each step is known");
    errors.words("step", names.clone());
    if steps.iter().any(|step| step.route.is_some()) {
        let route = |step: &&StepResult| step.route.map_or("\u{2013}", route_in_words).to_owned();
        errors.words("solver", steps.iter().map(route).collect());
    }
    errors.shares(
        if outcome.plan.kind == Kind::Mechanics { "error of the force" } else { "error of C" },
        &values_of(Row::total_error),
    );
    if steps.iter().any(|step| step.row.estimated_errors() > 0.0) {
        errors.shares("from the bounds", &values_of(|r| r.relative_error_estimate));
    }
    errors.shares("from the layer's mesh", &values_of(|r| r.mechanics_error_estimate));
    errors.shares("from flat faces", &values_of(|r| r.geometry_error_estimate.filter(|e| *e != 0.0)));
    errors
        .shares("from the model of the layer", &values_of(|r| r.model_error_estimate.filter(|e| *e != 0.0)));
    let count = |n: Option<usize>| n.map_or_else(|| "\u{2013}".to_owned(), grouped);
    errors.numbers("unknowns", steps.iter().map(|s| count(s.row.unknowns)).collect());
    errors.numbers("grids", steps.iter().map(|s| count(s.solver.as_ref().map(|r| r.grids))).collect());
    errors.numbers(
        "iterations",
        steps.iter().map(|s| count(s.solver.as_ref().map(|r| r.iterations))).collect(),
    );
    let mut out = errors.html();

    let phases = phases(report, &steps);
    let used: Vec<&Phase> = phases.iter().filter(|phase| phase.seconds.iter().any(|s| *s >= 5e-5)).collect();
    out.push_str(&bars(&used, &names));
    let mut times = Table::new("Seconds by phase");
    times.words("step", names);
    let cell = |s: f64| format!("{s:.3}");
    for phase in &used {
        times.numbers(phase.name, phase.seconds.iter().map(|s| cell(*s)).collect());
    }
    times.numbers("all", steps.iter().map(|s| cell(s.seconds.total)).collect());
    out.push_str(&times.html());
    let run = report.seconds;
    let layer = match outcome.layer_meshes.last() {
        Some(mesh) => format!(
            " The finite elements of the layer took {:.2}\u{a0}s on {} meshes, the finest with {} unknowns.",
            outcome.layer_seconds,
            outcome.layer_meshes.len(),
            grouped(mesh.unknowns)
        ),
        None => String::new(),
    };
    let _ = writeln!(
        out,
        "<p>The run took {:.3}\u{a0}s on {} threads: {:.3}\u{a0}s for reading and planning, {:.3}\u{a0}s for all steps, {:.3}\u{a0}s for the other \
         files up to this one. Steps are solved side by side, so that their seconds may add up to more.{}</p>",
        run.total,
        outcome.threads,
        run.plan,
        run.solve,
        run.files,
        escape(&layer)
    );
    out
}

/// A phase, and its seconds in each step.
struct Phase {
    name: &'static str,
    seconds: Vec<f64>,
}

fn phases(report: &Report<'_>, steps: &[&StepResult]) -> Vec<Phase> {
    let phase = |name, value: &dyn Fn(&StepResult) -> f64| Phase {
        name,
        seconds: steps.iter().map(|s| value(s)).collect(),
    };
    vec![
        phase("mechanics", &|s| s.seconds.mechanics),
        phase("choosing the grid", &|s| s.seconds.electrostatics.choosing),
        phase("setting up", &|s| s.seconds.electrostatics.setup),
        phase("upper bound", &|s| s.seconds.electrostatics.primal),
        phase("lower bound", &|s| s.seconds.electrostatics.dual),
        phase("field files", &|s| report.fields.seconds(s.index)),
    ]
}

/// A bar of the seconds by phase for each step; the table below says the same in numbers.
fn bars(phases: &[&Phase], names: &[String]) -> String {
    let sum = |k: usize| phases.iter().map(|phase| phase.seconds[k]).sum::<f64>();
    let longest = (0..names.len()).map(sum).fold(0.0, f64::max);
    if longest <= 0.0 || names.len() > 40 {
        return String::new();
    }
    let mut out = "<div class=\"bars\" aria-hidden=\"true\">\n<p class=\"keys\">".to_owned();
    for (k, phase) in phases.iter().enumerate() {
        let _ = write!(out, "<span><i class=\"p{k}\"></i>{}</span>", escape(phase.name));
    }
    out.push_str("</p>\n");
    for (step, name) in names.iter().enumerate() {
        let _ = write!(out, "<div><span>{}</span><b>", escape(name));
        for (k, phase) in phases.iter().enumerate() {
            let _ = write!(
                out,
                "<i class=\"p{k}\" style=\"width:{}%\"></i>",
                number((1e4 * phase.seconds[step] / longest).round() / 1e2)
            );
        }
        out.push_str("</b></div>\n");
    }
    out.push_str("</div>\n");
    out
}
