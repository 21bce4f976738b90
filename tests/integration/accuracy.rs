//! Tests of the files and refusals of `elastocap accuracy`.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use crate::support::Sandbox;

const MECHANICS: &str = r#"
format = 1
[layer]
thickness = "450 um"
[layer.material.neo_hookean]
shear_modulus = "90 kPa"
[mechanics.closed_form]
contact_half_length = "500 um"
contact_width       = "500 um"
shear_length        = "500 um"
[load]
compression = [0.0, 0.1]
"#;

fn pair() -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("cases/in-plane-pair.toml");
    path.to_string_lossy().into_owned()
}

type Row = BTreeMap<String, String>;

fn number(row: &Row, column: &str) -> f64 {
    row[column].parse().unwrap_or_else(|_| panic!("{column}: {row:?}"))
}

#[test]
fn a_quick_study_of_the_pair_writes_intervals_that_overlap_and_compares_its_own_choice() {
    let sandbox = Sandbox::new();
    // The files of a run stay.
    std::fs::create_dir(sandbox.path("out")).expect("a folder");
    std::fs::write(sandbox.path("out/curve.csv"), "of a run").expect("a file");
    std::fs::write(
        sandbox.path("out/result.json"),
        r#"{"versions": {"elastocap": "0"}, "files": ["curve.csv", "result.json"]}"#,
    )
    .expect("a file");
    let output = sandbox.elastocap(&["accuracy", &pair(), "--quick", "-o", "out"]).exits_with(0);
    assert!(output.stdout.contains("which all overlap"), "{}", output.stdout);
    assert!(output.stdout.contains("own choice within 1.5 times"), "{}", output.stdout);
    assert_eq!(sandbox.names("out"), ["accuracy.csv", "accuracy.svg", "curve.csv", "result.json"]);
    assert_eq!(sandbox.read("out/curve.csv"), "of a run");

    let table = sandbox.table("out/accuracy.csv");
    let rows = |kind: &str, choice: &str| {
        let chosen = table.0.iter().filter(|row| row["kind"] == kind && row["choice"] == choice);
        chosen.cloned().collect::<Vec<_>>()
    };
    // A quick study leaves out what would take too long on a busy machine, and says so in the row.
    let solved = |choice: &str| rows("bounds", choice).into_iter().filter(|row| !row["lower_f"].is_empty());
    let bounds: Vec<_> = solved("table").chain(solved("own")).collect();
    assert!(bounds.len() >= 6, "{} proved intervals", bounds.len());
    let lower = bounds.iter().map(|row| number(row, "lower_f")).fold(0.0, f64::max);
    let upper = bounds.iter().map(|row| number(row, "upper_f")).fold(f64::INFINITY, f64::min);
    assert!(lower <= upper, "{lower:e} above {upper:e}");
    // The pair without load: see the acceptance cases.
    assert!((lower..=upper).contains(&43.965_9e-15), "{lower:e} to {upper:e}");
    for row in &bounds {
        let allowed = number(row, "certified_error") + 2.0 * number(row, "reference_half_width");
        assert!(number(row, "true_error") <= allowed, "{row:?}");
    }
    let orders: BTreeSet<_> = bounds.iter().map(|row| &row["order"]).collect();
    let levels: BTreeSet<_> = bounds.iter().map(|row| &row["levels"]).collect();
    assert!(orders.len() > 1 && levels.len() > 1, "{orders:?} {levels:?}");
    for choice in &solved("own").filter(|row| number(row, "tolerance") >= 1e-3).collect::<Vec<_>>() {
        assert!(number(choice, "spread_or_estimate") <= number(choice, "tolerance"), "{choice:?}");
        let table = rows("bounds", "table");
        let meets =
            table.iter().filter(|row| number(row, "spread_or_estimate") <= number(choice, "tolerance"));
        let best = meets.map(|row| number(row, "seconds")).fold(f64::INFINITY, f64::min);
        let ratio = number(choice, "seconds") / best;
        assert!((number(choice, "time_over_best") / ratio - 1.0).abs() < 1e-9, "{choice:?}");
    }
    let plates = rows("parallel_plates", "");
    assert!((number(&plates[0], "true_error") - 0.887).abs() < 0.001, "{plates:?}");
}

#[test]
fn a_case_without_conductors_is_refused() {
    let sandbox = Sandbox::new();
    let case = sandbox.case("layer.toml", MECHANICS);
    let case = case.to_str().expect("UTF-8");
    let output = sandbox.elastocap(&["accuracy", case, "-o", "out"]).exits_with(2);
    assert!(output.stderr.contains("no electrodes and no conductors"), "{}", output.stderr);
    assert!(!sandbox.path("out").exists());
}

#[test]
fn a_step_that_the_case_does_not_have_is_refused() {
    let sandbox = Sandbox::new();
    let output = sandbox.elastocap(&["accuracy", &pair(), "--step", "6", "-o", "out"]).exits_with(2);
    assert!(output.stderr.contains("no step 6: the steps of this case are 0 to 5"), "{}", output.stderr);
    assert!(!sandbox.path("out").exists());
}

#[test]
fn electrodes_that_the_load_bends_are_refused_and_not_studied_as_boxes() {
    let sandbox = Sandbox::new();
    let case = Path::new(env!("CARGO_MANIFEST_DIR")).join("cases/punched-pair.toml");
    let case = case.to_string_lossy();
    let output = sandbox.elastocap(&["accuracy", &case, "--step", "1", "--quick", "-o", "out"]).exits_with(2);
    for words in [
        "the study is of the box solver",
        "step 1",
        "the extruded solver, with the outlines of the bent electrodes",
    ] {
        assert!(output.stderr.contains(words), "`{words}` is not in: {}", output.stderr);
    }
    assert_eq!(sandbox.names("out"), Vec::<String>::new());
}
