//! `elastocap new`: every case file that it writes runs, and shows the purpose of its sensor.

use crate::support::{Finished, Sandbox, Table};

const NAMES: [&str; 6] = ["comb", "array", "pair", "stack", "quadrants", "finger"];

/// Writes the case file, checks it and runs it into `out`.
fn run(sandbox: &Sandbox, name: &str) -> Table {
    let output = sandbox.elastocap(&["new", name, "case.toml"]).exits_with(0);
    assert_eq!(output.stdout, "case.toml\n");
    sandbox.elastocap(&["check", "case.toml"]).exits_with(0);
    sandbox.elastocap(&["run", "case.toml", "-o", "out"]).exits_with(0);
    let table = sandbox.table("out/curve.csv");
    // Not `ok: but for the model of the layer`: the first numbers of a new user include all of their errors.
    assert!(table.texts("status").iter().all(|status| *status == "ok"), "{table:?}");
    table
}

/// The sign of the change from each step to the next; zero where the proved bounds do not determine it.
fn directions(table: &Table) -> Vec<i8> {
    let [lower, upper] = ["capacitance_lower_f", "capacitance_upper_f"].map(|name| table.numbers(name));
    (1..lower.len()).map(|k| i8::from(lower[k] > upper[k - 1]) - i8::from(upper[k] < lower[k - 1])).collect()
}

/// Checks that forces grow, and compressions with them.
fn is_pressed_more_and_more(table: &Table) {
    for name in ["force_n", "compression"] {
        let values = table.numbers(name);
        assert!(values[0] == 0.0 && values.windows(2).all(|pair| pair[1] > pair[0]), "{name}: {values:?}");
    }
}

/// An entry of the Maxwell matrix of a step, with its bounds, F.
fn entry(table: &Table, step: usize, row: &str, column: &str) -> [f64; 3] {
    let [steps, quantities, rows, columns] =
        ["step", "quantity", "row", "column"].map(|name| table.texts(name));
    let step = step.to_string();
    let is_it = |k: &usize| {
        steps[*k] == step && quantities[*k] == "maxwell" && rows[*k] == row && columns[*k] == column
    };
    let k = (0..steps.len()).find(is_it).unwrap_or_else(|| panic!("no {row}, {column} at step {step}"));
    ["value_f", "lower_f", "upper_f"].map(|name| table.numbers(name)[k])
}

#[test]
fn the_pair_of_a_new_case_falls_with_the_force() {
    let sandbox = Sandbox::new();
    let table = run(&sandbox, "pair");
    is_pressed_more_and_more(&table);
    assert_eq!(directions(&table), [-1; 3]);
    // Fringing is the signal of coplanar electrodes.
    let ratios = table.numbers("capacitance_f").into_iter().zip(table.numbers("parallel_plate_f"));
    assert!(ratios.into_iter().all(|(c, plates)| c > 5.0 * plates));
}

#[test]
fn the_stacked_plates_of_a_new_case_rise_with_the_force() {
    let sandbox = Sandbox::new();
    let table = run(&sandbox, "stack");
    is_pressed_more_and_more(&table);
    assert_eq!(directions(&table), [1; 3]);
}

#[test]
fn the_combs_of_a_new_case_lose_field_to_the_shield_that_comes_nearer() {
    let sandbox = Sandbox::new();
    let table = run(&sandbox, "comb");
    is_pressed_more_and_more(&table);
    let values = table.numbers("capacitance_f");
    assert!(values.windows(2).all(|pair| pair[1] < pair[0]), "{values:?}");
    // The terminals are the two combs; the flux to the grounded shield is in their diagonal entries, which
    // rise.
    let matrices = sandbox.table("out/capacitance.csv");
    for comb in ["comb-1", "comb-2"] {
        let [first, last] = [0, 2].map(|step| entry(&matrices, step, comb, comb));
        assert!(last[1] > first[2], "{comb}: {first:?} {last:?}");
    }
}

#[test]
fn the_pads_of_a_new_case_rise_as_the_common_plate_comes_nearer() {
    let sandbox = Sandbox::new();
    let table = run(&sandbox, "array");
    is_pressed_more_and_more(&table);
    let (mutual, compressions) = (table.numbers("capacitance_f"), table.numbers("compression"));
    // Plates alone would rise by 1 / (1 - U/H); the fringing field, and pads flush with the board, reduce
    // this.
    for step in [1, 2] {
        let (rise, plates) = (mutual[step] / mutual[0] - 1.0, 1.0 / (1.0 - compressions[step]) - 1.0);
        assert!(rise > 0.5 * plates && rise < plates, "step {step}: {rise} {plates}");
    }
    // Nothing is solved for the pads that are not measured.
    let matrix = sandbox.table("out/capacitance.csv");
    let rows = matrix.texts("row");
    assert!(rows.iter().all(|row| ["pad-2-1", "pad-plate"].contains(row)), "{rows:?}");
}

#[test]
fn the_four_quadrants_of_a_new_case_tell_shift_and_tilt() {
    let sandbox = Sandbox::new();
    let table = run(&sandbox, "quadrants");
    let forces = table.numbers("force_n");
    let expected = [0.0, 10.0, 10.0, 10.0];
    assert!(forces.iter().zip(expected).all(|(f, e)| (f - e).abs() <= 1e-6 * e), "{forces:?}");
    let matrices = sandbox.table("out/capacitance.csv");
    let diagonal = |step: usize, pad: &str| entry(&matrices, step, pad, pad)[0];
    let pads = ["pad-1-1", "pad-1-2", "pad-2-1", "pad-2-2"];
    for step in [0, 1] {
        assert!(
            pads.iter().all(|pad| (diagonal(step, pad) / diagonal(step, "pad-1-1") - 1.0).abs() < 1e-9),
            "{step}"
        );
    }
    assert!(diagonal(1, "pad-1-1") > 1.01 * diagonal(0, "pad-1-1"), "pressed");
    assert!(diagonal(2, "pad-2-1") > 1.005 * diagonal(2, "pad-1-1"), "shifted towards +x1");
    assert!(diagonal(3, "pad-1-1") > 1.005 * diagonal(3, "pad-2-1"), "lifted at +x1");
}

#[test]
fn the_finger_of_a_new_case_takes_the_field_between_the_pads() {
    let sandbox = Sandbox::new();
    let table = run(&sandbox, "finger");
    let (distances, forces) = (table.numbers("distance_m"), table.numbers("force_n"));
    assert_eq!((&distances[..4], &forces[..4]), (&[0.01, 0.002, 5e-4, 0.0][..], &[0.0; 4][..]));
    assert_eq!(distances[4..], [0.0; 2]);
    for (force, expected) in forces[4..].iter().zip([5.0, 10.0]) {
        assert!((force / expected - 1.0).abs() < 1e-6, "{forces:?}");
    }
    let values = table.numbers("capacitance_f");
    assert!(values.windows(2).all(|pair| pair[1] < pair[0]), "{values:?}");
    let matrices = sandbox.table("out/capacitance.csv");
    let [first, last] = [0, 5].map(|step| entry(&matrices, step, "pad-1-1", "pad-1-1"));
    assert!(last[1] > first[2], "the pad sees the finger come nearer: {first:?} {last:?}");
}

#[test]
fn a_new_case_goes_to_the_standard_output_unless_a_file_is_named() {
    let sandbox = Sandbox::new();
    for name in NAMES {
        let text = sandbox.elastocap(&["new", name]).exits_with(0).stdout;
        sandbox.elastocap(&["new", name, &format!("{name}.toml"), "--quiet"]).exits_with(0);
        assert_eq!(text, sandbox.read(&format!("{name}.toml")));
        // The entries of the steps are explained at their common key.
        let keys = text.lines().filter(|line| line.contains(" = ") && !line.starts_with(['#', ' ']));
        let bare: Vec<_> = keys.filter(|line| !line.contains('#')).collect();
        assert!(bare.is_empty(), "{name}: {bare:?}");
    }
    assert_eq!(sandbox.names("").len(), NAMES.len());
}

#[test]
fn a_new_case_does_not_replace_a_file_unless_it_is_told_to() {
    let sandbox = Sandbox::new();
    sandbox.case("mine.toml", "mine");
    let Finished { stderr, .. } = sandbox.elastocap(&["new", "pair", "mine.toml"]).exits_with(2);
    assert!(stderr.contains("`mine.toml` is there already") && stderr.contains("--overwrite"), "{stderr}");
    assert_eq!(sandbox.read("mine.toml"), "mine");
    sandbox.elastocap(&["new", "pair", "mine.toml", "--overwrite"]).exits_with(0);
    assert!(sandbox.read("mine.toml").contains("[electrodes.in_plane_pair]"));
    let output = sandbox.elastocap(&["new", "pair", "nowhere/mine.toml"]).exits_with(1);
    assert!(output.stderr.contains("cannot write `nowhere/mine.toml`"), "{}", output.stderr);
}

#[test]
fn a_sensor_that_does_not_exist_is_answered_with_those_that_do() {
    let sandbox = Sandbox::new();
    let output = sandbox.elastocap(&["new", "trackpad", "case.toml"]).exits_with(2);
    assert!(NAMES.iter().all(|name| output.stderr.contains(name)), "{}", output.stderr);
    assert!(sandbox.names("").is_empty());
}
