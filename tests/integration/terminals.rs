//! Terminals and measurements from the case file to the tables.

use crate::support::{Sandbox, Table, acceptance};
use serde_json::Value;

fn guarded(tolerance: &str, solver: &str) -> String {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("cases/guarded-plate.toml");
    let text = std::fs::read_to_string(path).expect("the guarded plate");
    text.replace("relative_tolerance = 1e-2", &format!("relative_tolerance = {tolerance}\n{solver}"))
}

/// The file without its terminals and its measurement.
fn without_terminals(text: &str) -> String {
    let (before, rest) = text.split_once("[[terminal]]").expect("terminals");
    let (_, after) = rest.split_once("[surroundings]").expect("surroundings");
    format!("{before}[surroundings]{after}")
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is not a number"))
}

/// The value and bounds of one line of capacitance.csv.
fn entry(table: &Table, quantity: &str, row: &str, column: &str) -> [f64; 3] {
    let texts = ["quantity", "row", "column"].map(|name| table.texts(name));
    let is_wanted = |k: usize| texts[0][k] == quantity && texts[1][k] == row && texts[2][k] == column;
    let k =
        (0..texts[0].len()).find(|k| is_wanted(*k)).unwrap_or_else(|| panic!("{quantity} {row} {column}"));
    ["value_f", "lower_f", "upper_f"].map(|name| table.numbers(name)[k])
}

fn meet(one: [f64; 3], other: [f64; 3]) -> bool {
    one[1] <= other[2] && other[1] <= one[2]
}

#[test]
fn a_guarded_plate_has_the_mutual_capacitance_of_the_bodies_by_themselves() {
    let sandbox = Sandbox::new();
    sandbox.run(&sandbox.case("guarded.toml", &guarded("3e-2", "")), &["--no-fields"]).exits_with(0);
    let json = sandbox.json("out/result.json");
    assert_eq!(json["conductors"], serde_json::json!(["sense", "drive"]));
    assert_eq!(
        json["measurement"],
        serde_json::json!({ "kind": "mutual", "terminals": ["drive", "sense"], "shown": ["drive", "sense"] })
    );
    assert_eq!(json["terminals"][2]["potential"], "ground");
    let measured =
        ["capacitance_f", "capacitance_lower_f", "capacitance_upper_f"].map(|key| number(&json[key]));
    assert!(measured[2] - measured[1] <= 3e-2 * measured[0] && json["two_terminal_capacitance_f"].is_null());
    // An earlier computation, to 7e-4, gave 290.19 fF.
    assert!(measured[1] < 290.19e-15 && 290.19e-15 < measured[2], "{measured:?}");
    let table = sandbox.table("out/capacitance.csv");
    assert_eq!(entry(&table, "mutual", "sense", "drive"), measured);
    assert_eq!(table.texts("step"), ["0"; 5]);

    let apart = without_terminals(&guarded("1e-1", ""));
    sandbox.run(&sandbox.case("apart.toml", &apart), &["--no-fields"]).exits_with(0);
    let apart = sandbox.table("out/capacitance.csv");
    for (row, column) in [("sense", "sense"), ("sense", "drive"), ("drive", "drive")] {
        let [joined, separate] = [&table, &apart].map(|table| entry(table, "maxwell", row, column));
        assert!(meet(joined, separate), "{row} {column}: {joined:?} {separate:?}");
    }

    let on_tetrahedra = guarded("2e-1", "solver = \"tetrahedra\"");
    sandbox.run(&sandbox.case("tetrahedra.toml", &on_tetrahedra), &["--no-fields"]).exits_with(0);
    let found = entry(&sandbox.table("out/capacitance.csv"), "mutual", "sense", "drive");
    assert!(meet(found, measured), "{found:?} {measured:?}");
}

#[test]
fn check_says_what_is_joined_and_what_is_measured() {
    let sandbox = Sandbox::new();
    let case = sandbox.case("guarded.toml", &guarded("3e-1", ""));
    let output = sandbox.elastocap(&["check", case.to_str().expect("UTF-8")]).exits_with(0).stdout;
    assert!(output.contains("`quiet`: `guard` and `shield` on one wire, at potential zero"), "{output}");
    assert!(output.contains("the mutual capacitance of `drive` and `sense`"), "{output}");
}

/// The pair of the paper at two loads, with a plate above and what else is given.
fn with_plate(further: &str) -> String {
    let text = std::fs::read_to_string(acceptance("in-plane-pair.toml")).expect("the acceptance files");
    let text = text.replace("[0.0, 0.05, 0.1, 0.2, 0.3, 0.4]", "[0.0, 0.1]").replace("1e-3", "3e-2");
    format!(
        "{text}\n[[conductor]]\nname = \"plate\"\n\
         box = {{ min = [\"-1 mm\", \"600 um\", \"-1 mm\"], max = [\"1 mm\", \"700 um\", \"1 mm\"] }}\n{further}"
    )
}

#[test]
fn an_electrode_on_one_wire_with_a_plate_is_the_sum_of_both_at_every_load() {
    let sandbox = Sandbox::new();
    sandbox.run(&sandbox.case("apart.toml", &with_plate("")), &["--no-fields"]).exits_with(0);
    let apart = sandbox.json("out/result.json");
    let wired = "[[terminal]]\nname = \"right\"\nconductors = [\"electrode-right\", \"plate\"]\n\
                 [measure]\ncapacitance = [\"right\", \"electrode-left\"]\n";
    sandbox.run(&sandbox.case("wired.toml", &with_plate(wired)), &["--no-fields"]).exits_with(0);
    let joined = sandbox.json("out/result.json");
    assert_eq!(joined["conductors"], serde_json::json!(["electrode-left", "right"]));
    for step in 0..2 {
        let of_step = |key: &str| &apart["steps"][step][key];
        let mutual = |key: &str, k: usize| -number(&of_step(key)[0][k]);
        let [most, least] =
            ["maxwell_matrix_lower_f", "maxwell_matrix_upper_f"].map(|key| mutual(key, 1) + mutual(key, 2));
        let found = &joined["steps"][step];
        let [lower, upper] = ["capacitance_lower_f", "capacitance_upper_f"].map(|key| number(&found[key]));
        assert!(lower <= most && least <= upper, "step {step}: [{lower:e}, {upper:e}] [{least:e}, {most:e}]");
        assert!(found["status"].as_str().is_some_and(|status| status.starts_with("ok")), "{found}");
    }
    let table = sandbox.table("out/capacitance.csv");
    // Four entries and one mutual capacitance for each load.
    assert_eq!(table.texts("step"), ["0", "0", "0", "0", "0", "1", "1", "1", "1", "1"]);
    assert_eq!(sandbox.table("out/curve.csv").texts("two_terminal_capacitance_f"), ["", ""]);
}

#[test]
fn a_curve_of_three_terminals_shows_their_first_mutual_capacitance() {
    let sandbox = Sandbox::new();
    let text = with_plate(
        "[[conductor]]\nname = \"second\"\n\
         box = { min = [\"-1 mm\", \"800 um\", \"-1 mm\"], max = [\"1 mm\", \"900 um\", \"1 mm\"] }\n\
         [[conductor]]\nname = \"third\"\n\
         box = { min = [\"-1 mm\", \"1000 um\", \"-1 mm\"], max = [\"1 mm\", \"1050 um\", \"1 mm\"] }\n",
    );
    let (before, rest) = text.split_once("[electrodes.in_plane_pair]").expect("electrodes");
    let (_, after) = rest.split_once("[mechanics").expect("mechanics");
    sandbox
        .run(&sandbox.case("three.toml", &format!("{before}[mechanics{after}")), &["--no-fields"])
        .exits_with(0);
    let json = sandbox.json("out/result.json");
    assert_eq!(json["measurement"]["kind"], "matrix");
    let curve = sandbox.table("out/curve.csv").numbers("capacitance_f");
    for (step, shown) in curve.into_iter().enumerate() {
        assert_eq!(shown, -number(&json["steps"][step]["maxwell_matrix_f"][0][1]));
    }
}

/// Two of three pads under a grounded plate that rides on the layer, each against ground.
const TWO_PADS: &str = r#"format = 1
[layer]
thickness = "0.5 mm"
relative_permittivity = 2.8
[layer.material.neo_hookean]
shear_modulus = "100 kPa"
[electrodes.array]
on = "substrate"
pads = [1, 3]
size = ["2 mm", "2 mm"]
pitch = ["3 mm", "3 mm"]
thickness = "35 um"
[electrodes.array.common_plate]
on = "layer-top"
thickness = "50 um"
[[terminal]]
name = "plate"
conductors = ["pad-plate"]
potential = "ground"
[measure]
capacitance = [["pad-1-1"], ["pad-1-2"]]
[mechanics.closed_form]
contact_half_length = "3 mm"
contact_width = "9 mm"
shear_length = "3 mm"
[load]
compression = [0.0, 0.1]
[surroundings]
boundary = "open"
[electrostatics]
relative_tolerance = 5e-2
"#;

#[test]
fn each_of_several_measured_capacitances_has_its_change_in_the_tables_and_the_report() {
    let sandbox = Sandbox::new();
    let case = sandbox.case("pads.toml", TWO_PADS);
    let output = sandbox.elastocap(&["check", case.to_str().expect("UTF-8")]).exits_with(0).stdout;
    let measured =
        "the capacitance of `pad-1-1` against ground and the capacitance of `pad-1-2` against ground";
    assert!(output.contains(measured), "{output}");
    sandbox.run(&case, &["--no-fields"]).exits_with(0);
    let json = sandbox.json("out/result.json");
    // No field is solved for the third pad.
    assert_eq!(json["conductors"], serde_json::json!(["pad-1-1", "pad-1-2"]));
    assert_eq!(json["measurement"]["shown"], serde_json::json!(["pad-1-1"]));
    let table = sandbox.table("out/capacitance.csv");
    let curve = sandbox.table("out/curve.csv").numbers("capacitance_f");
    let texts = ["step", "row", "column", "change_f", "change_lower_f", "change_upper_f"]
        .map(|name| table.texts(name));
    let number = |column: usize, line: usize| texts[column][line].parse::<f64>().expect("a number");
    let mut diagonal = 0;
    for line in 0..texts[0].len() {
        if texts[1][line] != texts[2][line] {
            continue;
        }
        diagonal += 1;
        let [change, lower, upper] = [3, 4, 5].map(|column| number(column, line));
        if texts[0][line] == "0" {
            assert_eq!([change, lower, upper], [0.0; 3]);
            continue;
        }
        // The plate comes nearer to both pads.
        assert!(0.0 < lower && lower < change && change < upper, "{lower:e} {change:e} {upper:e}");
        if texts[1][line] == "pad-1-1" {
            assert_eq!(change, curve[1] - curve[0]);
        }
    }
    assert_eq!(diagonal, 4);
    let report = sandbox.read("out/report.html");
    assert!(report.contains("Each measured capacitance") && report.contains("each-chart"));
}
