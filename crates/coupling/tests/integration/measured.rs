//! Which capacitance a case measures: of a guarded terminal, of several at once, and by default.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use elastocap_case::parse;
use elastocap_coupling::outcome::Outcome;
use elastocap_coupling::plan::{Options, Plan};
use elastocap_coupling::run::run;

/// Sheets across a box with insulated sides, so that the field between neighbours is even: the bottom is at
/// 0, the sense plate at 2 mm and the hand at 5 mm, all of 10 mm x 10 mm. `guard` says what the plate at the
/// bottom is.
fn plates(guard: &str, end: &str) -> Outcome {
    let sheet = |name: &str, at: &str| {
        format!(
            "[[conductor]]\nname = \"{name}\"\nsheet = {{ normal = \"x2\", at = \"{at}\", min = [\"0 mm\", \"0 mm\"], max = [\"10 mm\", \"10 mm\"] }}\n"
        )
    };
    let text = format!(
        "format = 1\n{}{}{}[[terminal]]\nname = \"ground\"\npotential = \"ground\"\nconductors = [\"hand\"]\n{guard}
[surroundings]\nboundary = \"insulated\"\nwalls = {{ min = [\"0 mm\", \"-1 mm\", \"0 mm\"], max = [\"10 mm\", \"6 mm\", \"10 mm\"] }}\n{end}",
        sheet("guard", "0 mm"),
        sheet("sense", "2 mm"),
        sheet("hand", "5 mm")
    );
    let case = parse(&text, Path::new("test.toml")).unwrap_or_else(|error| panic!("{}", error.render(false)));
    let options = Options::default();
    let plan = Plan::new(&case, &options);
    run(&case, &plan, &options, &Arc::new(AtomicBool::new(false)), &())
}

/// The capacitance of two neighbouring plates, F.
fn between(distance_mm: f64) -> f64 {
    8.854_187_812_8e-12 * 1e-4 / (distance_mm * 1e-3)
}

fn shown(outcome: &Outcome) -> f64 {
    let row = &outcome.steps[0].row;
    let [value, lower, upper] =
        [row.capacitance_f, row.capacitance_lower_f, row.capacitance_upper_f].map(Option::unwrap);
    assert!(lower <= value && value <= upper, "{row:?}");
    value
}

fn assert_close(value: f64, exact: f64) {
    assert!((value / exact - 1.0).abs() < 1e-6, "{value:e} is not {exact:e}");
}

#[test]
fn a_driven_guard_takes_its_share_of_the_field_out_of_what_is_measured() {
    let driven = "[[terminal]]\nname = \"shield\"\nconductors = [\"guard\"]\npotential = \"driven\"\nfollows = \"sense\"\n";
    // The sense plate sees the hand alone; against a grounded guard it sees that too.
    assert_close(shown(&plates(driven, "")), between(3.0));
    let grounded = "[[terminal]]\nname = \"shield\"\nconductors = [\"guard\"]\npotential = \"ground\"\n";
    assert_close(shown(&plates(grounded, "")), between(3.0) + between(2.0));
}

#[test]
fn two_terminals_beside_a_ground_have_a_mutual_capacitance_unless_the_other_one_is_named() {
    // The hand is not seen from the guard, whose charge is the mutual capacitance. With equal and opposite
    // charges it is the same here.
    assert_close(shown(&plates("", "")), between(2.0));
    let named = "[measure]\ncapacitance = [\"sense\", \"guard\"]\nkind = \"two-terminal\"\n";
    assert_close(shown(&plates("", named)), between(2.0));
    let against_ground = "[measure]\ncapacitance = [\"guard\"]\n";
    assert_close(shown(&plates("", against_ground)), between(2.0));
}

#[test]
fn of_several_capacitances_each_is_in_the_matrix_and_the_first_is_shown() {
    let several = "[measure]\ncapacitance = [[\"sense\"], [\"guard\", \"sense\"]]\n";
    let outcome = plates("", several);
    assert_close(shown(&outcome), between(2.0) + between(3.0));
    let matrix = outcome.steps[0].maxwell.as_ref().unwrap();
    assert_eq!(outcome.conductors, ["guard", "sense"]);
    assert_close(-matrix[0][1].value, between(2.0));
}
