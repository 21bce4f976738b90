//! `curve.csv` and `capacitance.csv`: plain numbers in SI units that read back as they were.

use elastocap_case::{Case, Measurement};
use elastocap_electrostatics::Bounded;

use elastocap_coupling::outcome::{Missed, Outcome, Row, Status, StepResult};

use crate::pairs::{PairChange, matrix_of_changes};

/// A number in the shortest form that reads back as the same number.
pub fn number(value: f64) -> String {
    let magnitude = value.abs();
    if value == 0.0 {
        "0".to_owned()
    } else if (1e-4..1e15).contains(&magnitude) {
        format!("{value}")
    } else {
        format!("{value:e}")
    }
}

/// A number, or the text of an empty cell where there is none.
pub fn optional(value: Option<f64>) -> String {
    value.map_or_else(String::new, number)
}

/// A text as one field, in quotes where it holds a separator or a quote. Spreadsheets take a field that
/// begins with `=`, `+`, `-` or `@` for a formula, in quotes or not; such a text gets an apostrophe before
/// it, which marks it as text.
pub fn quoted(text: &str) -> String {
    if text.starts_with(['=', '+', '-', '@', '\t', '\r']) {
        return format!("\"'{}\"", text.replace('"', "\"\""));
    }
    if text.contains([',', '"', '\n', '\r']) || text != text.trim() {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

/// The text of `curve.csv`: a header, and one line for each load step with the columns of [`Row`].
pub fn curve(outcome: &Outcome) -> String {
    let mut out = Row::COLUMNS.join(",");
    out.push('\n');
    for step in &outcome.steps {
        let row = &step.row;
        let mut fields: Vec<_> = row.numbers().into_iter().map(optional).collect();
        fields.push(row.unknowns.map_or_else(String::new, |n| n.to_string()));
        fields.push(quoted(&row.status.to_string()));
        out.push_str(&fields.join(","));
        out.push('\n');
    }
    out
}

/// The header of `capacitance.csv`.
const CAPACITANCE_COLUMNS: &str = "step,quantity,row,column,value_f,lower_f,upper_f,relative_error_estimate,geometry_error_estimate,\
    change_f,change_lower_f,change_upper_f,unknowns,status";

/// The text of `capacitance.csv`: for each step, one line for each entry of the Maxwell matrix, for each
/// pair's mutual capacitance, and for the two-terminal or guarded capacitance where one is measured. Each
/// line has the status of its entry, or that of the step where the step has another defect.
///
/// `row` and `column` name terminals; a two-terminal capacitance of one terminal is against `ground`.
///
/// The capacitances against ground and the mutual ones of a measured matrix have their changes against the
/// first step with a matrix, F, with limits from all known errors.
pub fn capacitance(case: &Case, outcome: &Outcome) -> String {
    let mut out = format!("{CAPACITANCE_COLUMNS}\n");
    let first = outcome.steps.iter().find(|step| step.maxwell.is_some());
    for step in &outcome.steps {
        let changes = first.map_or_else(Vec::new, |first| matrix_of_changes(case, outcome, [first, step]));
        out.push_str(&capacitances_of(&outcome.conductors, outcome.measurement, step, &changes));
    }
    out
}

/// The lines of `capacitance.csv` for one step; `changes` are those of the matrix since the first step.
fn capacitances_of(
    terminals: &[String],
    measurement: Option<Measurement>,
    step: &StepResult,
    changes: &[Vec<Option<PairChange>>],
) -> String {
    let mut out = String::new();
    let unknowns = step.row.unknowns.map_or_else(String::new, |n| n.to_string());
    let geometry = optional(step.row.geometry_error_estimate);
    let mut line =
        |quantity: &str, names: [&str; 2], c: Option<Bounded>, change: Option<PairChange>, status: &str| {
            let of_change = |value: fn(&PairChange) -> f64| optional(change.as_ref().map(value));
            let fields = [
                step.index.to_string(),
                quantity.to_owned(),
                quoted(names[0]),
                quoted(names[1]),
                optional(c.map(|c| c.value)),
                optional(c.map(|c| c.lower)),
                optional(c.map(|c| c.upper)),
                optional(c.map(|c| c.relative_error()).filter(|error| error.is_finite())),
                geometry.clone(),
                of_change(PairChange::change),
                of_change(|change| change.limits[0]),
                of_change(|change| change.limits[1]),
                unknowns.clone(),
                quoted(status),
            ];
            out.push_str(&fields.join(","));
            out.push('\n');
        };
    let entry = |i: usize, j: usize| step.maxwell.as_ref()?.get(i)?.get(j).copied();
    let change = |i: usize, j: usize| *changes.get(i)?.get(j)?;
    let step_status = step.row.status.to_string();
    let status_of = |i: usize, j: usize| {
        let entry_status = step.entry_status.as_ref().and_then(|matrix| matrix.get(i)?.get(j).copied());
        match (&step.row.status, entry_status) {
            // With these, the step is judged by its entries, each of which has a status of its own.
            (
                Status::Ok
                | Status::OkToDiagonal
                | Status::OkInModel
                | Status::ToleranceNotReached(Missed::Field | Missed::Change),
                Some(entry_status),
            ) => entry_status.to_string(),
            _ => step_status.clone(),
        }
    };
    // A single capacitance has no small entries beside it, and the change is judged apart from it.
    let single_status = match &step.row.status {
        Status::OkToDiagonal | Status::ToleranceNotReached(Missed::Change) => Status::Ok.to_string(),
        _ => step_status.clone(),
    };
    for (i, row) in terminals.iter().enumerate() {
        for (j, column) in terminals.iter().enumerate() {
            let change = if i == j { change(i, j) } else { None };
            line("maxwell", [row, column], entry(i, j), change, &status_of(i, j));
        }
    }
    for (i, row) in terminals.iter().enumerate() {
        for (j, column) in terminals.iter().enumerate().skip(i + 1) {
            line("mutual", [row, column], entry(i, j).map(|c| c.negative()), change(i, j), &status_of(i, j));
        }
    }
    let name = |k: usize| terminals.get(k).map_or("ground", String::as_str);
    let pair = match measurement {
        Some(Measurement::TwoTerminal([i, j])) => Some([name(i), name(j)]),
        Some(Measurement::Mutual([i, j])) if step.two_terminal.is_some() => Some([name(i), name(j)]),
        Some(Measurement::Own(_)) if terminals.len() == 1 => Some([name(0), "ground"]),
        Some(
            Measurement::Own(_)
            | Measurement::Mutual(_)
            | Measurement::Guarded(_)
            | Measurement::Matrix { .. },
        )
        | None => None,
    };
    if let Some(names) = pair {
        line("two_terminal", names, step.two_terminal, None, &single_status);
    }
    if let Some(Measurement::Guarded([measured, guard])) = measurement {
        line("guarded", [name(measured), name(guard)], step.measured, None, &single_status);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    use elastocap_coupling::load_steps::StepLoad;
    use elastocap_coupling::outcome::EntryStatus;
    use elastocap_coupling::plan::{Options, Plan};

    #[test]
    fn numbers_read_back_as_they_were() {
        for value in [0.0, 0.05, 43.965_9e-15, 1.0 / 3.0, -2.5e-300, 1e22, 5e-324, f64::MAX, 450e-6] {
            assert_eq!(number(value).parse::<f64>(), Ok(value), "{}", number(value));
        }
        assert_eq!(number(-0.0), "0");
        assert_eq!(number(43.965_9e-15), "4.39659e-14");
    }

    #[test]
    fn a_field_with_a_comma_or_a_quote_is_quoted() {
        assert_eq!(quoted("failed: no, \"never\""), "\"failed: no, \"\"never\"\"\"");
        assert_eq!(quoted("tolerance not reached"), "tolerance not reached");
    }

    #[test]
    fn a_name_that_a_spreadsheet_would_take_for_a_formula_is_marked_as_text() {
        assert_eq!(quoted("=HYPERLINK(\"http://x\")"), "\"'=HYPERLINK(\"\"http://x\"\")\"");
        for name in ["+1", "-plate", "@sum"] {
            assert_eq!(quoted(name), format!("\"'{name}\""));
        }
        assert_eq!(quoted("a-b=c"), "a-b=c");
    }

    /// A step with a matrix of this many conductors; no two pairs have the same entry.
    fn step(conductors: usize, measured: Option<Bounded>) -> StepResult {
        let entry = |i: usize, j: usize| {
            let value = if i == j { 100.0 } else { -((1 + i + j) as f64) };
            Bounded { value, lower: value - 0.5, upper: value + 0.25 }
        };
        let maxwell = (0..conductors).map(|i| (0..conductors).map(|j| entry(i, j)).collect()).collect();
        StepResult {
            index: 0,
            load: StepLoad::None,
            same_as: None,
            route: None,
            route_changes: Vec::new(),
            row: Row { unknowns: Some(7), ..Row::default() },
            reason: None,
            interrupted: false,
            warnings: Vec::new(),
            layer: None,
            force_check: None,
            scene: None,
            surfaces: Vec::new(),
            maxwell: Some(maxwell),
            entry_status: None,
            floating: Vec::new(),
            measured,
            two_terminal: measured,
            with_error_of_base: None,
            solver: None,
            foresight: None,
            before_change: None,
            mechanics_by_capacitance: false,
            seconds: Default::default(),
        }
    }

    /// The lines below the header, field by field.
    fn lines(names: &[&str], step: &StepResult) -> Vec<Vec<String>> {
        let names: Vec<String> = names.iter().map(|name| (*name).to_owned()).collect();
        let measurement = match (names.len(), step.measured) {
            (1, _) => Measurement::Own(0),
            (2, _) | (_, Some(_)) => Measurement::TwoTerminal([0, 1]),
            (count, None) => Measurement::Matrix { terminals: count, shown: [0, 1] },
        };
        let table =
            format!("{CAPACITANCE_COLUMNS}\n{}", capacitances_of(&names, Some(measurement), step, &[]));
        let fields = |line: &str| line.split(',').map(str::to_owned).collect::<Vec<_>>();
        let lines: Vec<_> = table.lines().map(fields).collect();
        assert!(lines.iter().all(|line| line.len() == lines[0].len()), "{table}");
        assert!(lines[1..].iter().all(|line| line[0] == "0"), "{table}");
        lines[1..].iter().map(|line| line[1..].to_vec()).collect()
    }

    #[test]
    fn a_mutual_capacitance_is_minus_its_entry_within_limits_that_have_changed_places() {
        let lines = lines(&["a", "b", "c"], &step(3, None));
        let lines_of = |quantity: &str| lines.iter().filter(|line| line[0] == quantity).collect::<Vec<_>>();
        let numbers = |line: &[String]| [3, 4, 5, 6].map(|k| line[k].parse::<f64>().unwrap());
        assert_eq!((lines_of("maxwell").len(), lines_of("mutual").len(), lines.len()), (9, 3, 12));
        let names: Vec<_> = lines_of("mutual").iter().map(|line| [line[1].as_str(), &line[2]]).collect();
        assert_eq!(names, [["a", "b"], ["a", "c"], ["b", "c"]]);
        for line in lines_of("mutual") {
            let entry = lines_of("maxwell").into_iter().find(|entry| entry[1..3] == line[1..3]).unwrap();
            let ([value, lower, upper, error], [entry, least, most, same]) = (numbers(line), numbers(entry));
            assert_eq!([value, lower, upper], [-entry, -most, -least]);
            assert!(lower < value && value < upper);
            assert!(
                error == same && error == 0.5 / value,
                "the distance to the farther limit over the value"
            );
        }
        assert!(lines.iter().all(|line| line[11] == "7" && line[12] == "not run"));
    }

    #[test]
    fn each_entry_has_a_status_of_its_own_unless_the_whole_step_has_missed_something_else() {
        let mut step = step(2, Some(Bounded { value: 2.0, lower: 1.9, upper: 2.1 }));
        let statuses =
            [EntryStatus::Ok, EntryStatus::ToDiagonal, EntryStatus::ToDiagonal, EntryStatus::NotReached];
        step.entry_status = Some(statuses.chunks(2).map(<[_]>::to_vec).collect());
        let mut statuses = |status: Status| {
            step.row.status = status;
            lines(&["a", "b"], &step).into_iter().map(|line| line[12].clone()).collect::<Vec<_>>()
        };
        let [ok, small, missed] = ["ok", "ok: small and less closely known", "tolerance not reached"];
        assert_eq!(statuses(Status::OkToDiagonal), [ok, small, small, missed, small, ok]);
        let field = Status::ToleranceNotReached(Missed::Field);
        assert_eq!(statuses(field), [ok, small, small, missed, small, missed]);
        // The capacitances themselves are known as well as asked for.
        let change = Status::ToleranceNotReached(Missed::Change);
        assert_eq!(statuses(change), [ok, small, small, missed, small, ok]);
        let geometry = "tolerance not reached: geometry";
        assert_eq!(statuses(Status::ToleranceNotReached(Missed::Geometry)), [geometry; 6]);
    }

    #[test]
    fn a_two_terminal_capacitance_is_that_of_two_conductors_or_of_one_against_ground() {
        let found = Some(Bounded { value: 2.0, lower: 1.0, upper: 3.0 });
        let last =
            |names: &[&str], two_terminal| lines(names, &step(names.len(), two_terminal)).pop().unwrap();
        assert_eq!(last(&["a"], found)[..6], ["two_terminal", "a", "ground", "2", "1", "3"]);
        assert_eq!(last(&["a", "b"], found)[..6], ["two_terminal", "a", "b", "2", "1", "3"]);
        assert_eq!(last(&["a", "b"], None)[..6], ["two_terminal", "a", "b", "", "", ""]);
        // The pair of a sensor comes first among three; three bodies by themselves have no two terminals.
        assert_eq!(last(&["a", "b", "c"], found)[..3], ["two_terminal", "a", "b"]);
        assert_eq!(last(&["a", "b", "c"], None)[0], "mutual");
    }

    #[test]
    fn a_line_of_the_curve_has_each_number_in_the_column_of_its_name() {
        let row = Row {
            compression: Some(0.5),
            distance_m: Some(24.0),
            force_n: Some(2.0),
            force_error_estimate: Some(28.0),
            force_x1_n: Some(22.0),
            force_x3_n: Some(23.0),
            top_displacement_m: Some(3.0),
            gap_m: Some(4.0),
            electrode_height_m: Some(5.0),
            electrode_thickness_m: Some(6.0),
            two_terminal_capacitance_f: Some(7.0),
            capacitance_f: Some(7.5),
            capacitance_lower_f: Some(8.0),
            capacitance_upper_f: Some(9.0),
            relative_error_estimate: Some(10.0),
            mechanics_error_estimate: Some(11.0),
            geometry_error_estimate: Some(12.0),
            model_error_estimate: Some(25.0),
            total_error_estimate: Some(26.0),
            parallel_plate_f: Some(13.0),
            fringe_ratio: Some(14.0),
            change_f: Some(16.0),
            change_lower_f: Some(17.0),
            change_upper_f: Some(18.0),
            change_relative: Some(19.0),
            change_total_error_f: Some(27.0),
            sensitivity_f_per_n: Some(20.0),
            sensitivity_error_f_per_n: Some(21.0),
            unknowns: Some(15),
            status: Status::ToleranceNotReached(Missed::Field),
        };
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/acceptance/isolated-cube.toml");
        let options = Options { prune: true, fields: false, scene: false, model_error: false };
        let plan = Plan::new(&elastocap_case::load(&path).unwrap(), &options);
        let text = curve(&Outcome {
            plan,
            warnings: Vec::new(),
            steps: vec![StepResult { row: row.clone(), ..step(1, None) }],
            conductors: vec!["a".to_owned()],
            measurement: Some(Measurement::Own(0)),
            layer_meshes: Vec::new(),
            layer_seconds: 0.0,
            stopped: false,
            solve_seconds: 0.0,
            threads: 1,
        });
        let lines: Vec<Vec<&str>> = text.lines().map(|line| line.split(',').collect()).collect();
        let [names, fields] = lines.as_slice() else { panic!("{text}") };
        assert_eq!(names.len(), fields.len());
        // result.json has the same row by the names of its fields.
        let json = serde_json::to_value(&row).unwrap();
        assert_eq!(json.as_object().unwrap().len(), names.len());
        for (name, field) in names.iter().zip(fields) {
            match json[name].as_f64() {
                Some(value) => assert_eq!(field.parse(), Ok(value), "{name}"),
                None => assert_eq!(json[name].as_str(), Some(*field), "{name}"),
            }
        }
    }
}
