//! The measurement of a case: the target of its field solves, and the capacitance that its curve shows.

use elastocap_case::{Case, Measurement};
use elastocap_electrostatics::{Bounded, Solution, Target};

/// The target of the field solves: the measured capacitance, or the whole matrix for a scene without load
/// that names no measurement.
pub fn target(case: &Case) -> Target {
    let is_static = case.measured.is_none() && case.load.is_none() && case.electrodes.is_none();
    match case.measurement() {
        Measurement::TwoTerminal(_) | Measurement::Mutual(_) | Measurement::Own(_) if is_static => {
            Target::Matrix
        }
        Measurement::TwoTerminal(_) if case.driven_terminals().len() == 2 => Target::TwoTerminal,
        Measurement::TwoTerminal(rows) => Target::Pair(rows),
        Measurement::Mutual(rows) => Target::Mutual(rows),
        Measurement::Own(row) => Target::Own(row),
        Measurement::Guarded(rows) => Target::Guarded(rows),
        Measurement::Matrix { .. } => Target::Matrix,
    }
}

/// The capacitance, F, of a solution that a curve shows: the measured one, or the entry of a matrix that the
/// measurement names. `None` if the solution has no such value.
pub fn shown(measurement: Measurement, solution: &Solution) -> Option<Bounded> {
    let entry = |[i, j]: [usize; 2]| {
        let entry = solution.maxwell.get(i)?.get(j)?;
        Some(if i == j { *entry } else { entry.negative() })
    };
    match measurement {
        Measurement::TwoTerminal(_) => solution.measured.or(solution.two_terminal),
        Measurement::Guarded(_) => solution.measured,
        Measurement::Own(i) => entry([i; 2]),
        Measurement::Mutual(shown) | Measurement::Matrix { shown, .. } => entry(shown),
    }
}

/// The name of the capacitance that [`shown`] gives, as the label of an axis, and the terminals that it
/// belongs to where there may be others; `terminals` are the names of the driven ones.
pub fn in_words(measurement: Measurement, terminals: &[String]) -> (&'static str, Option<String>) {
    let name = |k: usize| terminals.get(k).map_or("?", String::as_str);
    match measurement {
        Measurement::TwoTerminal(_) => ("two-terminal capacitance", None),
        Measurement::Guarded([row, _]) => ("capacitance against ground", Some(name(row).to_owned())),
        Measurement::Own(row) => ("capacitance against ground", Some(name(row).to_owned())),
        Measurement::Matrix { shown: [i, j], .. } if i == j => {
            ("capacitance against ground", Some(name(i).to_owned()))
        }
        Measurement::Mutual([i, j]) | Measurement::Matrix { shown: [i, j], .. } => {
            ("mutual capacitance", Some(format!("{} and {}", name(i), name(j))))
        }
    }
}

/// The kind of a measurement as a word, and the names of its terminals.
pub fn named(measurement: Measurement, terminals: &[String]) -> (&'static str, Vec<&str>) {
    let names =
        |rows: &[usize]| rows.iter().filter_map(|row| terminals.get(*row)).map(String::as_str).collect();
    match measurement {
        Measurement::TwoTerminal(rows) => ("two_terminal", names(&rows)),
        Measurement::Mutual(rows) => ("mutual", names(&rows)),
        Measurement::Own(row) => ("own", names(&[row])),
        Measurement::Guarded(rows) => ("guarded", names(&rows)),
        Measurement::Matrix { terminals: count, .. } => ("matrix", names(&(0..count).collect::<Vec<_>>())),
    }
}

/// The names of the terminals of the capacitance that [`shown`] gives: one where it is against ground.
pub fn shown_terminals(measurement: Measurement, terminals: &[String]) -> Vec<&str> {
    let names =
        |rows: &[usize]| rows.iter().filter_map(|row| terminals.get(*row)).map(String::as_str).collect();
    match measurement {
        Measurement::Own(row) | Measurement::Guarded([row, _]) => names(&[row]),
        Measurement::Matrix { shown: [i, j], .. } if i == j => names(&[i]),
        Measurement::TwoTerminal(rows)
        | Measurement::Mutual(rows)
        | Measurement::Matrix { shown: rows, .. } => names(&rows),
    }
}
