//! Tables of a model: the curves at many forces as CSV, or as JSON together with the coefficients of their
//! cubics.

use elastocap_results::csv::{number, optional, quoted};
use serde::Serialize;

use crate::model::{Branch, Model};

/// The largest number of equal parts between two steps.
pub const MOST_POINTS: usize = 10_000;

/// The forces of a table, N: the steps, and `points` - 1 evenly spaced ones between any two of them.
fn mesh(model: &Model, points: usize) -> Vec<f64> {
    let points = points.clamp(1, MOST_POINTS);
    let inner = model.forces.windows(2).flat_map(|pair| {
        let [a, b] = [pair[0], pair[1]];
        (0..points).map(move |k| a + (b - a) * k as f64 / points as f64)
    });
    inner.chain(model.forces.last().copied()).collect()
}

/// A line of a table: the curve of one capacitor at one force.
#[derive(Debug, Serialize)]
struct Line {
    force_n: f64,
    capacitance_f: f64,
    capacitance_lower_f: f64,
    capacitance_upper_f: f64,
    derivative_f_per_n: f64,
    interpolation_error_estimate_f: Option<f64>,
}

/// The lines of a table for one capacitor.
fn lines(branch: &Branch, forces: &[f64]) -> Vec<Line> {
    let errors = branch.curve.interpolation_errors();
    let steps = branch.curve.forces();
    let line_at = |force: &f64| {
        let at = |band| branch.curve.at(*force, band);
        let k = steps.partition_point(|step| step <= force).saturating_sub(1).min(errors.len() - 1);
        let is_step = steps.contains(force);
        Line {
            force_n: *force,
            capacitance_f: at(0.0).capacitance,
            capacitance_lower_f: at(-1.0).capacitance,
            capacitance_upper_f: at(1.0).capacitance,
            derivative_f_per_n: at(0.0).derivative,
            interpolation_error_estimate_f: if is_step { Some(0.0) } else { errors[k] },
        }
    };
    forces.iter().map(line_at).collect()
}

/// The table as CSV, with one line for each capacitor and force; see [`json`] for `points`.
pub fn csv(model: &Model, points: usize) -> String {
    let mut out = "from,to,force_n,capacitance_f,capacitance_lower_f,capacitance_upper_f,derivative_f_per_n,\
                   interpolation_error_estimate_f\n"
        .to_owned();
    let forces = mesh(model, points);
    for branch in &model.branches {
        let [from, to] = model.ends(branch).map(quoted);
        for line in lines(branch, &forces) {
            let numbers = [
                line.force_n,
                line.capacitance_f,
                line.capacitance_lower_f,
                line.capacitance_upper_f,
                line.derivative_f_per_n,
            ];
            let numbers: Vec<String> = numbers.into_iter().map(number).collect();
            let error = optional(line.interpolation_error_estimate_f);
            out.push_str(&format!("{from},{to},{},{error}\n", numbers.join(",")));
        }
    }
    out
}

#[derive(Serialize)]
struct Document<'a> {
    title: &'a str,
    case: &'a str,
    elastocap: &'a str,
    quantity: &'a str,
    bounds: &'static str,
    notes: &'a [String],
    /// The forces of the steps, N.
    forces_n: &'a [f64],
    formula: &'static str,
    capacitors: Vec<Capacitor<'a>>,
}

#[derive(Serialize)]
struct Capacitor<'a> {
    from: &'a str,
    to: &'a str,
    /// The four coefficients of the lower bound in each interval, F.
    lower_f: Vec<[f64; 4]>,
    /// The four coefficients of the value in each interval, F.
    value_f: Vec<[f64; 4]>,
    /// The four coefficients of the upper bound in each interval, F.
    upper_f: Vec<[f64; 4]>,
    table: Vec<Line>,
}

/// The table as JSON, with the coefficients of the cubics. `points` is the number of equal parts that the
/// interval from one step to the next is divided into, at most [`MOST_POINTS`].
///
/// # Errors
/// An error of serialization, which is not expected.
pub fn json(model: &Model, points: usize) -> serde_json::Result<String> {
    let forces = mesh(model, points);
    let capacitor = |branch| {
        let [from, to] = model.ends(branch);
        let coefficients = |which: usize| branch.curve.pieces().iter().map(|piece| piece[which]).collect();
        Capacitor {
            from,
            to,
            lower_f: coefficients(0),
            value_f: coefficients(1),
            upper_f: coefficients(2),
            table: lines(branch, &forces),
        }
    };
    let document = Document {
        title: &model.title,
        case: &model.case,
        elastocap: env!("CARGO_PKG_VERSION"),
        quantity: &model.quantity,
        bounds: if model.is_proved { "proved" } else { "estimated" },
        notes: &model.notes,
        forces_n: &model.forces,
        formula: "C = P0 (1-t)^3 + 3 P1 t (1-t)^2 + 3 P2 t^2 (1-t) + P3 t^3 with t from 0 to 1 between neighbouring forces",
        capacitors: model.branches.iter().map(capacitor).collect(),
    };
    let mut text = serde_json::to_string_pretty(&document)?;
    text.push('\n');
    Ok(text)
}
