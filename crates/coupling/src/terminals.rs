//! What a case measures: what its fields are solved for, and the capacitance that its curve shows.

use elastocap_case::{Case, Measurement};
use elastocap_electrostatics::{Bounded, Solution, Target};

/// What the fields of a case are solved for. A scene without load that does not say what it measures is read as its matrix, which two
/// conductors in open space have three numbers of.
pub fn target(case: &Case) -> Target {
    let is_static = case.measured.is_none() && case.load.is_none() && case.electrodes.is_none();
    match case.measurement() {
        Measurement::TwoTerminal(_) | Measurement::Own(_) if is_static => Target::Matrix,
        Measurement::TwoTerminal(_) if case.driven_terminals().len() == 2 => Target::TwoTerminal,
        Measurement::TwoTerminal(rows) => Target::Pair(rows),
        Measurement::Mutual(rows) => Target::Mutual(rows),
        Measurement::Own(row) => Target::Own(row),
        Measurement::Matrix(_) => Target::Matrix,
    }
}

/// The capacitance, F, that a curve shows of a solution: what is measured, or of a matrix the mutual capacitance of the first two
/// terminals. `None` if the solution has none.
pub fn shown(measurement: Measurement, solution: &Solution) -> Option<Bounded> {
    match measurement {
        Measurement::TwoTerminal(_) => solution.measured.or(solution.two_terminal),
        Measurement::Mutual([i, j]) => solution.maxwell.get(i)?.get(j).map(Bounded::negative),
        Measurement::Own(i) => solution.maxwell.get(i)?.get(i).copied(),
        Measurement::Matrix(_) => solution.maxwell.first()?.get(1).map(Bounded::negative),
    }
}

/// What [`shown`] shows, as the label of an axis, and what it is of where there is more than one; `terminals` are the names of the driven
/// ones.
pub fn in_words(measurement: Measurement, terminals: &[String]) -> (&'static str, Option<String>) {
    let name = |k: usize| terminals.get(k).map_or("?", String::as_str);
    let both = |i, j| Some(format!("{} and {}", name(i), name(j)));
    match measurement {
        Measurement::TwoTerminal(_) => ("two-terminal capacitance", None),
        Measurement::Mutual([i, j]) => ("mutual capacitance", both(i, j)),
        Measurement::Own(i) => ("capacitance against ground", Some(name(i).to_owned())),
        Measurement::Matrix(_) => ("mutual capacitance", both(0, 1)),
    }
}

/// The kind of a measurement as a word, and the names of the terminals that it is of.
pub fn named(measurement: Measurement, terminals: &[String]) -> (&'static str, Vec<&str>) {
    let of = |rows: &[usize]| rows.iter().filter_map(|row| terminals.get(*row)).map(String::as_str).collect();
    match measurement {
        Measurement::TwoTerminal(rows) => ("two_terminal", of(&rows)),
        Measurement::Mutual(rows) => ("mutual", of(&rows)),
        Measurement::Own(row) => ("own", of(&[row])),
        Measurement::Matrix(count) => ("matrix", of(&(0..count).collect::<Vec<_>>())),
    }
}
