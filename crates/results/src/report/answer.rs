//! The head of the page: the result in a sentence, and the main figures.

use elastocap_case::Measurement;
use elastocap_coupling::outcome::{Outcome, Row, Status, StepResult};
use elastocap_coupling::plan::Kind;
use elastocap_coupling::terminals::in_words;
use elastocap_coupling::words::seconds;

use super::Report;
use super::html::escape;
use crate::pairs::{first_and_most_loaded, largest_certain, pair_changes};
use crate::typeset::{percent, quantity};

/// A number at the head of the page: its name, its value in words, and a remark below it.
struct Figure {
    name: String,
    value: String,
    remark: String,
}

fn figure(name: &str, value: String, remark: impl Into<String>) -> Figure {
    Figure { name: name.to_owned(), value, remark: remark.into() }
}

/// Status, sentence and figures as HTML.
pub(super) fn answer(report: &Report<'_>) -> String {
    let outcome = report.outcome;
    let (sentences, mut figures) = match outcome.plan.kind {
        Kind::Curve => of_curve(report),
        Kind::Capacitance => of_scene(report),
        Kind::Mechanics => of_layer(outcome),
    };
    figures.push(figure(
        "Run time",
        seconds(report.seconds.total).replace(' ', "\u{a0}"),
        format!("{} threads", outcome.threads),
    ));
    let in_model = outcome.steps.iter().any(|step| step.row.status == Status::OkInModel);
    let (class, word) = match (outcome.is_complete(), outcome.stopped) {
        (true, _) if in_model => (
            "fair",
            "Complete in its model of the layer, which is off by more than the tolerance: see the errors of each step.",
        ),
        (true, _) => ("good", "Complete: every step met its tolerance."),
        (false, true) => ("bad", "Stopped before all steps were done."),
        (false, false) => ("bad", "Incomplete: a step failed or missed its tolerance."),
    };
    let mut out =
        format!("<p class=\"status {class}\">{word}</p>\n<p class=\"lead\">{}</p>\n", escape(&sentences));
    out.push_str("<dl class=\"figures\">\n");
    for Figure { name, value, remark } in figures {
        out.push_str(&format!(
            "<div><dt>{}</dt><dd><strong>{}</strong><span>{}</span></dd></div>\n",
            escape(&name),
            escape(&value),
            escape(&remark)
        ));
    }
    out.push_str("</dl>\n");
    out
}

/// The error of the capacitance in a row and the kind of its bounds, such as "± 0.03 %, proved"; empty where
/// the error is not known.
fn error_of(row: &Row, kind: &str) -> String {
    let kind = if row.estimated_errors() > 0.0 { "with estimated errors" } else { kind };
    row.total_error().map_or_else(String::new, |e| format!("\u{b1}\u{a0}{}, {kind}", percent(e)))
}

/// A change over the first capacitance, in words with "it" as the subject: a direction only where the limits
/// of the change agree on one, and the limits themselves.
fn change_in_words(change: f64, limits: Option<[f64; 2]>) -> String {
    let Some([lower, upper]) = limits else { return format!("its change is {}", signed(change)) };
    if change == 0.0 && lower == upper {
        return "it does not change".to_owned();
    }
    if lower <= 0.0 && upper >= 0.0 {
        return format!(
            "its change lies between {} and {}, so that it is not known whether it falls or rises",
            signed(lower),
            signed(upper)
        );
    }
    let (verb, [least, most]) =
        if upper < 0.0 { ("falls", [-upper, -lower]) } else { ("rises", [lower, upper]) };
    let share = |share: f64| signed(share).replace('+', "");
    format!("it {verb} by {}, between {} and {}", percent(change.abs()), share(least), share(most))
}

/// The load of a row in words: the force, or else the compression.
fn load_of(row: &Row) -> String {
    match (row.force_n, row.compression) {
        (Some(force), _) => quantity(force, 4, "N"),
        (None, Some(compression)) => format!("U/H = {compression}"),
        (None, None) => "the load".to_owned(),
    }
}

/// Whether the bounds are proved or estimated, as a word.
fn kind_of_bounds(report: &Report<'_>) -> &'static str {
    match report.case.electrostatics {
        Some(settings) if !settings.bounds => "estimated",
        Some(_) | None => "proved",
    }
}

/// The terminals of the capacitance in the rows.
fn of_rows(outcome: &Outcome) -> String {
    let words = outcome.measurement.and_then(|measurement| in_words(measurement, &outcome.conductors).1);
    words.unwrap_or_else(|| "what is measured".to_owned())
}

/// The capacitance in the rows, in words.
fn what_is_measured(outcome: &Outcome) -> String {
    let Some(measurement) = outcome.measurement else { return "capacitance".to_owned() };
    match in_words(measurement, &outcome.conductors) {
        (what, None) => what.to_owned(),
        (what, Some(terminals)) => format!("{what} of {terminals}"),
    }
}

/// A capacitance at the first step and under the largest load.
struct Ends {
    /// The name of the capacitance in words.
    name: String,
    /// The capacitance at both steps, F.
    values: [f64; 2],
    /// The errors of both values, in words.
    errors: [String; 2],
    /// The limits of the change, F.
    limits: Option<[f64; 2]>,
    /// Whether the rows of the run have this capacitance.
    is_of_rows: bool,
}

/// The capacitance that the head of the page is about: the measured one, and of a matrix the entry with the
/// largest certain change. The second value is a remark about the other entries, if there is one.
fn subject(report: &Report<'_>, steps: [&StepResult; 2]) -> (Ends, Option<String>) {
    let outcome = report.outcome;
    let kind = kind_of_bounds(report);
    let changes = pair_changes(report.case, outcome, steps);
    if let Some(pair) = largest_certain(&changes) {
        let (what, terminals) = in_words(pair.measurement(), &outcome.conductors);
        let estimated = steps.iter().any(|step| step.row.estimated_errors() > 0.0);
        let kind = if estimated { "with estimated errors" } else { kind };
        let ends = Ends {
            name: format!("{what} of {}", terminals.unwrap_or_default()),
            values: pair.values,
            errors: pair.errors.map(|error| format!("\u{b1}\u{a0}{}, {kind}", percent(error))),
            limits: Some(pair.limits),
            is_of_rows: matches!(outcome.measurement, Some(Measurement::Matrix { shown, .. }) if shown == pair.terminals),
        };
        let remark = (changes.len() > 1).then(|| {
            format!(" Of all {} capacitances, this one has the largest certain change.", changes.len())
        });
        return (ends, remark);
    }
    let rows = steps.map(|step| &step.row);
    let ends = Ends {
        name: what_is_measured(outcome),
        values: rows.map(|row| row.capacitance_f.unwrap_or(f64::NAN)),
        errors: rows.map(|row| error_of(row, kind)),
        limits: rows[1].change_limits(rows[0]),
        is_of_rows: true,
    };
    let remark = (changes.len() > 1 && steps[0].index != steps[1].index).then(|| {
        format!(" Of none of the {} capacitances is it known whether it falls or rises.", changes.len())
    });
    (ends, remark)
}

/// The change with its limits; the limits alone where these leave the sign open.
fn change_figure(change: f64, value: f64, limits: Option<[f64; 2]>) -> Figure {
    let relative = |change: f64| signed(change / value.abs());
    match limits {
        Some([lower, upper]) if lower <= 0.0 && upper >= 0.0 && lower != upper => figure(
            "Change",
            format!("{} to +{}", quantity(lower, 3, "F"), quantity(upper, 3, "F")),
            format!("{} to {}: its sign is not known", relative(lower), relative(upper)),
        ),
        Some([lower, upper]) => figure(
            "Change",
            quantity(change, 4, "F"),
            format!("{}, from {} to {}", relative(change), relative(lower), relative(upper)),
        ),
        None => figure("Change", quantity(change, 4, "F"), relative(change)),
    }
}

/// The sentences and the figures of a run with a curve of the capacitance.
fn of_curve(report: &Report<'_>) -> (String, Vec<Figure>) {
    let outcome = report.outcome;
    let kind = kind_of_bounds(report);
    let solved: Vec<&StepResult> = outcome.steps.iter().filter(|s| s.row.capacitance_f.is_some()).collect();
    let Some([first, last]) = first_and_most_loaded(outcome) else {
        return (format!("No step has a {}.", what_is_measured(outcome)), Vec::new());
    };
    let (ends, remark) = subject(report, [first, last]);
    let [c0, c1] = ends.values;
    let [error0, error1] = ends.errors;
    let start = match (first.row.is_before_contact(), first.row.compression) {
        (true, _) => format!("at a distance of {}", quantity(first.row.distance_m.unwrap_or(0.0), 3, "m")),
        (false, Some(0.0)) => "at rest".to_owned(),
        (false, _) => format!("under {}", load_of(&first.row)),
    };
    let mut sentence = format!("The {} is {} {start}", ends.name, quantity(c0, 5, "F"));
    let mut figures =
        vec![figure(if start == "at rest" { "At rest" } else { "First step" }, quantity(c0, 5, "F"), error0)];
    if first.index != last.index {
        let change = c1 - c0;
        sentence.push_str(&format!(
            " and {} under {}: {}.",
            quantity(c1, 5, "F"),
            load_of(&last.row),
            change_in_words(
                change / c0.abs(),
                ends.limits.map(|limits| limits.map(|limit| limit / c0.abs()))
            )
        ));
        figures.push(figure(&format!("Under {}", load_of(&last.row)), quantity(c1, 5, "F"), error1));
        let change = last.row.change_f.filter(|_| ends.is_of_rows).unwrap_or(change);
        figures.push(change_figure(change, c0, ends.limits));
    } else {
        sentence.push('.');
    }
    sentence.push_str(&remark.unwrap_or_default());
    if !ends.is_of_rows {
        sentence.push_str(&format!(" The curve and its table are of {}.", of_rows(outcome)));
        return (sentence, figures);
    }
    let worst = solved.iter().filter_map(|s| s.row.relative_error_estimate).fold(0.0, f64::max);
    sentence.push_str(&match kind {
        "proved" => format!(" Proved bounds lie within \u{b1}\u{a0}{} of every value.", percent(worst)),
        _ => format!(" The error of every value is estimated to be at most {}.", percent(worst)),
    });
    if solved.iter().any(|s| s.row.estimated_errors() > 0.0) {
        let worst = solved.iter().filter_map(|s| s.row.total_error()).fold(0.0, f64::max);
        sentence.push_str(&format!(
            " With the estimated errors of the layer's mesh, of flat faces and of the model of the layer it is \u{b1}\u{a0}{}.",
            percent(worst)
        ));
    }
    let ratios: Vec<f64> = solved.iter().filter_map(|s| s.row.fringe_ratio).collect();
    if let (Some(low), Some(high)) =
        (ratios.iter().copied().reduce(f64::min), ratios.iter().copied().reduce(f64::max))
    {
        sentence.push_str(&format!(
            " It is {} that of parallel plates.",
            match format!("{low:.3}") == format!("{high:.3}") {
                true => format!("{low:.3} times"),
                false => format!("{} to {} times", three(low), three(high)),
            }
        ));
        let plates = first.row.parallel_plate_f.map(|c| quantity(c, 4, "F")).unwrap_or_default();
        figures.push(figure(
            "Parallel plates",
            plates,
            format!("at the first step; C is {} times that", three(ratios[0])),
        ));
    }
    figures.extend(sensitivity(outcome));
    (sentence, figures)
}

/// The first sensitivity whose sign is certain, or the size of the first one.
fn sensitivity(outcome: &Outcome) -> Option<Figure> {
    let known = || {
        let slope_and_error = |row: &Row| Some((row.sensitivity_f_per_n?, row.sensitivity_error_f_per_n));
        outcome.steps.iter().filter_map(move |step| Some((&step.row, slope_and_error(&step.row)?)))
    };
    let is_signed = |(slope, error): &(f64, Option<f64>)| error.is_none_or(|error| error < slope.abs());
    let (row, (slope, error)) = known().find(|(_, found)| is_signed(found)).or_else(|| known().next())?;
    let at = format!("at {}", load_of(row));
    Some(match error {
        Some(error) if error >= slope.abs() => {
            let [least, most] = [slope - error, slope + error].map(|end| quantity(end, 2, "F/N"));
            let remark = format!("{at}, so that its sign is not known");
            figure("Sensitivity", format!("{least} to {most}"), remark)
        }
        Some(error) => {
            let remark = format!("\u{b1}\u{a0}{}, {at}", quantity(error, 2, "F/N"));
            figure("Sensitivity", quantity(slope, 3, "F/N"), remark)
        }
        None => {
            figure("Sensitivity", quantity(slope, 3, "F/N"), format!("{at}, with an error that is not known"))
        }
    })
}

/// The value with three significant digits.
fn three(value: f64) -> String {
    let places = (2 - value.abs().max(1e-9).log10().floor() as i32).clamp(0, 6) as usize;
    format!("{value:.places$}")
}

/// A share in percent with its sign.
fn signed(share: f64) -> String {
    let sign = if share < 0.0 { "\u{2212}" } else { "+" };
    let places = (2 - (100.0 * share.abs()).max(1e-9).log10().floor() as i32).clamp(0, 9) as usize;
    format!("{sign}{:.places$}\u{a0}%", 100.0 * share.abs())
}

/// The sentences and the figures of a scene without load.
fn of_scene(report: &Report<'_>) -> (String, Vec<Figure>) {
    let outcome = report.outcome;
    let what = what_is_measured(outcome);
    let row = outcome.steps.first().map(|step| &step.row);
    let Some((row, value)) = row.and_then(|row| Some((row, row.capacitance_f?))) else {
        return (format!("The {what} is not known."), Vec::new());
    };
    let kind = kind_of_bounds(report);
    let mut sentence = format!("The {what} is {}.", quantity(value, 6, "F"));
    if let (Some(lower), Some(upper)) = (row.capacitance_lower_f, row.capacitance_upper_f) {
        let estimated = row.estimated_errors() * value.abs();
        let between =
            format!("{} and {}", quantity(lower - estimated, 6, "F"), quantity(upper + estimated, 6, "F"));
        sentence.push_str(&match kind {
            "proved" if estimated == 0.0 => format!(" It is proved to lie between {between}."),
            "proved" => {
                format!(" By proved bounds and the estimated error of flat faces it lies between {between}.")
            }
            _ => format!(" It is estimated to lie between {between}."),
        });
    }
    let mut figures = vec![figure("Capacitance", quantity(value, 5, "F"), error_of(row, kind))];
    if let Some(plates) = row.parallel_plate_f {
        let ratio = row.fringe_ratio.map_or_else(String::new, |r| format!("C is {} times that", three(r)));
        figures.push(figure("Parallel plates", quantity(plates, 4, "F"), ratio));
    }
    figures.push(figure(
        "Terminals",
        outcome.conductors.len().to_string(),
        if outcome.conductors.len() > 4 { String::new() } else { outcome.conductors.join(", ") },
    ));
    (sentence, figures)
}

/// The sentence and the figure of a run of mechanics alone.
fn of_layer(outcome: &Outcome) -> (String, Vec<Figure>) {
    let known =
        outcome.steps.iter().filter_map(|step| Some((step, step.row.force_n?, step.row.compression?)));
    let Some((step, force, compression)) = known.max_by(|a, b| a.2.total_cmp(&b.2)) else {
        return ("No step has a force.".to_owned(), Vec::new());
    };
    let sentence = format!("The layer takes {} at U/H = {compression:.4}.", quantity(force, 4, "N"));
    let error = step
        .row
        .relative_error_estimate
        .map_or_else(String::new, |e| format!("\u{b1}\u{a0}{}, estimated", percent(e)));
    (sentence, vec![figure(&format!("Force at U/H = {compression:.3}"), quantity(force, 4, "N"), error)])
}

#[cfg(test)]
mod tests {
    use super::change_in_words;

    #[test]
    fn a_change_has_a_direction_only_where_its_limits_leave_no_other() {
        let words =
            |change, limits| change_in_words(change, limits).replace('\u{a0}', " ").replace('\u{2212}', "-");
        assert_eq!(words(-0.104, Some([-0.106, -0.102])), "it falls by 10 %, between 10.2 % and 10.6 %");
        assert_eq!(words(0.02, Some([0.01, 0.03])), "it rises by 2.0 %, between 1.00 % and 3.00 %");
        assert_eq!(
            words(-0.0067, Some([-0.029, 0.016])),
            "its change lies between -2.90 % and +1.60 %, so that it is not known whether it falls or rises"
        );
        assert_eq!(words(0.0, Some([0.0, 0.0])), "it does not change");
        assert_eq!(words(0.01, None), "its change is +1.00 %");
    }
}
