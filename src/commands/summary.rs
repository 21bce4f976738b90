//! The summary that a run prints: one line for each step, and the folder of the files.

use elastocap_case::{Case, Measurement, Pose};
use elastocap_coupling::outcome::{Outcome, Row, Status, StepResult};
use elastocap_coupling::plan::{Kind, MEASURED};
use elastocap_coupling::terminals::{in_words, named};
use elastocap_results::Saved;
use elastocap_results::measured::{Comparison, compare};
use elastocap_results::pairs::{first_and_most_loaded, largest_certain, pair_changes};

use crate::units::{grouped, prefixed, seconds};

/// The largest number of lines of a table: more do not help on a screen.
const MAX_LINES: usize = 60;

/// The summary of a run whose files are `saved`.
pub(crate) fn summary(case: &Case, outcome: &Outcome, saved: &Saved) -> String {
    let lines = match outcome.plan.kind {
        Kind::Capacitance => capacitances(outcome),
        Kind::Curve | Kind::Mechanics => {
            let change = case.electrostatics.is_some_and(|settings| settings.change_tolerance.is_some());
            curve(outcome, change)
        }
    };
    let mut out = format!("{}\n\n{}", case.title, table(lines));
    // The measured capacitance is stated unless it is that of the pair, which everybody expects.
    if outcome.plan.kind == Kind::Curve && !case.electrodes_are_measured() {
        let measured = outcome.plan.solved.iter().filter(|planned| planned.part == MEASURED);
        measured.for_each(|planned| out.push_str(&format!("\n  measures: {}\n", planned.what)));
    }
    if outcome.plan.kind == Kind::Curve {
        out.push_str(&pairs(case, outcome));
    }
    if let Some(mesh) = outcome.layer_meshes.last() {
        let (count, unknowns) = (outcome.layer_meshes.len(), grouped(mesh.unknowns));
        let time = seconds(outcome.layer_seconds);
        let indenter = outcome.plan.layer.as_ref().map_or("its indenter", |layer| layer.indenter);
        out.push_str(&format!(
            "\n  layer under {indenter}: {count} meshes, {unknowns} unknowns on the last one, {time}\n"
        ));
    }
    if outcome.plan.kind == Kind::Curve && outcome.steps.iter().any(|s| !s.floating.is_empty()) {
        out.push_str("\n  the potentials of the floating conductors are in result.json\n");
    }
    if let Some(Ok(comparison)) = compare(case, outcome) {
        out.push_str(&measured(&comparison));
    }
    let names: Vec<_> =
        saved.files.iter().filter_map(|f| f.file_name()).map(|f| f.to_string_lossy().into_owned()).collect();
    let fields = names.iter().filter(|name| name.ends_with(".vtu")).count();
    let mut list: Vec<&str> =
        names.iter().map(String::as_str).filter(|name| !name.ends_with(".vtu")).collect();
    let number = format!("{fields} .vtu");
    if fields > 0 {
        list.push(&number);
    }
    out.push_str(&format!("\n{}: {}\n", saved.folder.display(), list.join(", ")));
    out
}

/// The entry of a matrix with the largest certain change; empty without a measured matrix, and without two
/// loads.
fn pairs(case: &Case, outcome: &Outcome) -> String {
    let ends = first_and_most_loaded(outcome).filter(|[first, last]| first.index != last.index);
    let changes = ends.map_or_else(Vec::new, |ends| pair_changes(case, outcome, ends));
    if changes.is_empty() {
        return String::new();
    }
    let Some(pair) = largest_certain(&changes) else {
        return "\n  of no capacitance is it known whether it falls or rises\n".to_owned();
    };
    let (what, terminals) = in_words(pair.measurement(), &outcome.conductors);
    let [lower, upper] = pair.limits.map(|limit| prefixed(limit, 4, "F"));
    format!(
        "\n  largest certain change: {what} of {}, by {lower} to {upper}\n",
        terminals.unwrap_or_default()
    )
}

/// The measured points beside the curve, in words.
fn measured(comparison: &Comparison) -> String {
    let (within, compared) = (comparison.within_error, comparison.compared());
    let beyond = match comparison.beyond_curve {
        0 => String::new(),
        count => format!("; the curve does not reach {count} more"),
    };
    let (Some(rms), Some(most), Some(share)) =
        (comparison.rms_residual_f, comparison.max_residual_f, comparison.fraction_within_error)
    else {
        return format!("\n  measured: the curve reaches none of the {} points\n", comparison.points.len());
    };
    format!(
        "\n  measured: {within} of {compared} points ({:.0} %) are within the error{beyond}\n  residuals: {} root mean square, {} the largest\n",
        100.0 * share,
        prefixed(rms, 3, "F"),
        prefixed(most, 3, "F"),
    )
}

/// The lines as right-aligned columns; of very many lines the middle ones are left out.
pub(super) fn table(lines: Vec<Vec<String>>) -> String {
    let columns = lines.iter().map(Vec::len).max().unwrap_or(0);
    let width = |k: usize| lines.iter().filter_map(|l| l.get(k)).map(|cell| cell.chars().count()).max();
    let widths: Vec<_> = (0..columns).map(|k| width(k).unwrap_or(0)).collect();
    let mut out = String::new();
    let (total, mut skipped) = (lines.len(), 0);
    for (index, line) in lines.iter().enumerate() {
        if total > MAX_LINES && index > MAX_LINES / 2 && index + MAX_LINES / 2 < total {
            skipped += 1;
            continue;
        }
        if skipped > 0 {
            out.push_str(&format!("  ... {skipped} more\n"));
            skipped = 0;
        }
        let cells: Vec<_> = line.iter().zip(&widths).map(|(cell, width)| format!("{cell:>width$}")).collect();
        out.push_str(&format!("  {}\n", cells.join("   ").trim_end()));
    }
    out
}

fn heads(names: &[&str]) -> Vec<String> {
    names.iter().map(|name| (*name).to_owned()).collect()
}

fn quantity(value: Option<f64>, digits: usize, unit: &str) -> String {
    value.map_or_else(|| "-".to_owned(), |value| prefixed(value, digits, unit))
}

/// The error of a change over the change. `None` if its limits include zero, which no relative error
/// describes.
fn change_error(first: &Row, row: &Row) -> Option<f64> {
    let [lower, upper] = row.change_limits(first)?;
    let change = row.change_f?;
    Some((upper - change).max(change - lower) / change.abs()).filter(|error| *error < 1.0)
}

/// A relative error: `2.9e-4`.
fn error(value: Option<f64>) -> String {
    value.map_or_else(|| "-".to_owned(), |error| format!("{:.1e}", error))
}

/// The status of a step in few words.
fn remark(step: &StepResult) -> String {
    match &step.row.status {
        Status::Ok => "ok".to_owned(),
        Status::Failed(_) => "failed".to_owned(),
        Status::BeyondForceLimit => "no force".to_owned(),
        Status::OkInModel => "ok, but for the model".to_owned(),
        Status::OkToDiagonal => "ok, small mutual capacitances less closely".to_owned(),
        status => status.to_string(),
    }
}

/// The displacement of the attached bodies at a step, in addition to that by the load.
fn pose(outcome: &Outcome, step: &StepResult) -> Pose {
    outcome.plan.steps.get(step.index).map(|planned| planned.pose).unwrap_or_default()
}

/// A column of shifts or tilts: its name, the quantity, and the text of a cell.
struct MoveColumn {
    name: &'static str,
    value: fn(&Pose) -> f64,
    text: fn(&Pose) -> String,
}

/// The columns of those shifts and tilts that are nonzero at one step or more.
fn moves(outcome: &Outcome) -> Vec<MoveColumn> {
    let column = |name, value, text| MoveColumn { name, value, text };
    let mut columns = vec![
        column("shift x1", |pose| pose.shift[0], |pose| prefixed(pose.shift[0], 3, "m")),
        column("shift x3", |pose| pose.shift[1], |pose| prefixed(pose.shift[1], 3, "m")),
        column("tilt about x3", |pose| pose.tilt[0], |pose| degrees(pose.tilt[0])),
        column("tilt about x1", |pose| pose.tilt[1], |pose| degrees(pose.tilt[1])),
    ];
    columns.retain(|column| outcome.steps.iter().any(|step| (column.value)(&pose(outcome, step)) != 0.0));
    columns
}

/// An angle: `0.2 deg`.
fn degrees(angle: f64) -> String {
    format!("{} deg", (1e4 * angle.to_degrees()).round() / 1e4)
}

/// One line for each load step; `change` adds the change against the first one.
fn curve(outcome: &Outcome, change: bool) -> Vec<Vec<String>> {
    let electric = outcome.plan.kind == Kind::Curve;
    let plates = outcome.steps.iter().any(|s| s.row.parallel_plate_f.is_some());
    let moves = moves(outcome);
    let mut head = vec!["U/H"];
    head.extend(moves.iter().map(|column| column.name));
    head.push("force");
    let approaches = outcome.steps.iter().any(|s| s.row.is_before_contact());
    if approaches {
        head.insert(0, "distance");
    }
    let has_force = outcome.steps.iter().any(|step| step.row.force_n.is_some());
    if has_force {
        head.push("+- relative");
    }
    if electric {
        head.extend(["C", "+- relative"]);
    }
    if change {
        head.extend(["change", "+- relative"]);
    }
    if plates {
        head.extend(["parallel plates", "ratio"]);
    }
    head.extend(["time", "status"]);
    let mut lines = vec![heads(&head)];
    for step in &outcome.steps {
        let row = &step.row;
        let mut line = vec![row.compression.map_or_else(|| "-".to_owned(), |c| format!("{c:.4}"))];
        line.extend(moves.iter().map(|column| (column.text)(&pose(outcome, step))));
        line.push(quantity(row.force_n, 4, "N"));
        if approaches {
            let distance = row.distance_m.filter(|_| row.is_before_contact());
            line.insert(0, distance.map_or_else(|| "contact".to_owned(), |d| prefixed(d, 4, "m")));
        }
        if has_force {
            line.push(error(row.force_error_estimate));
        }
        if electric {
            line.push(quantity(row.capacitance_f, 6, "F"));
            line.push(error(row.total_error()));
        }
        if change {
            line.push(quantity(row.change_f, 4, "F"));
            line.push(error(outcome.steps.first().and_then(|first| change_error(&first.row, row))));
        }
        if plates {
            line.push(quantity(row.parallel_plate_f, 4, "F"));
            line.push(row.fringe_ratio.map_or_else(|| "-".to_owned(), |r| format!("{r:.3}")));
        }
        line.push(if step.same_as.is_some() { "-".to_owned() } else { seconds(step.seconds.total) });
        line.push(remark(step));
        lines.push(line);
    }
    lines
}

/// The lines of a scene without load: matrix, floating conductors, and the measured capacitance.
fn capacitances(outcome: &Outcome) -> Vec<Vec<String>> {
    let mut lines = vec![heads(&["", "C", "+- relative"])];
    let Some(step) = outcome.steps.first() else { return lines };
    let with_estimates = |bounds: f64| error(Some(bounds + step.row.estimated_errors()));
    for (i, row) in step.maxwell.iter().flatten().enumerate() {
        for (j, c) in row.iter().enumerate().skip(i) {
            let name = |k: usize| outcome.conductors.get(k).map_or("?", String::as_str);
            lines.push(vec![
                format!("Maxwell {} / {}", name(i), name(j)),
                prefixed(c.value, 6, "F"),
                with_estimates(c.relative_error()),
            ]);
        }
    }
    for float in &step.floating {
        let per_volt = outcome.conductors.iter().zip(&float.per_volt);
        for (driven, v) in per_volt {
            lines.push(vec![
                format!("potential {} / {driven}", float.name),
                format!("{:.6} V/V", v.value),
                with_estimates(v.relative_error()),
            ]);
        }
        let v = &float.from_charges;
        if v.value != 0.0 {
            let name = format!("potential {} from charges", float.name);
            lines.push(vec![name, prefixed(v.value, 6, "V"), with_estimates(v.relative_error())]);
        }
    }
    let row = &step.row;
    if let (Some(value), Some(measurement)) = (row.capacitance_f, outcome.measurement) {
        let name = match named(measurement, &outcome.conductors) {
            ("mutual", of) => format!("mutual {}", of.join(" / ")),
            ("own", of) if outcome.conductors.len() > 1 => format!("{} against ground", of.join("")),
            ("guarded", of) => of.join(" guarded by "),
            _ => "two-terminal".to_owned(),
        };
        lines.push(vec![name, prefixed(value, 6, "F"), error(row.total_error())]);
        if let (Some(two_terminal), Measurement::Mutual(_)) = (&step.two_terminal, measurement) {
            lines.push(vec![
                "two-terminal".to_owned(),
                prefixed(two_terminal.value, 6, "F"),
                with_estimates(two_terminal.relative_error()),
            ]);
        }
    }
    if row.parallel_plate_f.is_some() {
        let value = quantity(row.parallel_plate_f, 6, "F");
        lines.push(vec!["parallel plates".to_owned(), value, String::new()]);
    }
    lines.push(vec!["status".to_owned(), remark(step), format!("in {}", seconds(step.seconds.total))]);
    lines
}
