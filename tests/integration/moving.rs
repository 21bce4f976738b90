//! Tests of bodies that ride on the layer, from the case file to the tables.

use crate::support::{Sandbox, Table};

/// Four pads on a board under a plate that rides on the layer.
fn quadrants(permittivity: &str, plate: &str, steps: &str, tolerance: &str) -> String {
    format!(
        "format = 1\n[layer]\nthickness = \"400 um\"\nrelative_permittivity = {permittivity}\n[layer.material.neo_hookean]\n\
         shear_modulus = \"100 kPa\"\n[electrodes.array]\non = \"substrate\"\npads = [2, 2]\nsize = [\"3 mm\", \"3 mm\"]\n\
         pitch = [\"3.4 mm\", \"3.4 mm\"]\nthickness = \"30 um\"\n{plate}[mechanics.closed_form]\n\
         contact_half_length = \"3 mm\"\ncontact_width = \"6 mm\"\nshear_length = \"3 mm\"\n{steps}\
         [surroundings]\nboundary = \"open\"\nbelow = {{ relative_permittivity = 1.0, thickness = \"1.6 mm\" }}\n\
         above = {{ relative_permittivity = 1.0, thickness = \"open\" }}\n[electrostatics]\nrelative_tolerance = {tolerance}\n"
    )
}

fn plate(keys: &str, low: &str, high: &str) -> String {
    format!(
        "[[conductor]]\nname = \"plate\"\n{keys}box = {{ min = [\"-3 mm\", \"{low}\", \"-3 mm\"], max = [\"3 mm\", \"{high}\", \"3 mm\"] }}\n"
    )
}

const RIDING: &str = "charge = \"0 C\"\nattached = \"layer-top\"\n";

/// The value and bounds of an entry of the Maxwell matrix at a step.
fn entry(table: &Table, step: usize, row: &str, column: &str) -> [f64; 3] {
    let [steps, quantities, rows, columns] =
        ["step", "quantity", "row", "column"].map(|name| table.texts(name));
    let step = step.to_string();
    let is_wanted =
        |k: usize| steps[k] == step && quantities[k] == "maxwell" && rows[k] == row && columns[k] == column;
    let k = (0..steps.len()).find(|k| is_wanted(*k)).unwrap_or_else(|| panic!("{step} {row} {column}"));
    ["value_f", "lower_f", "upper_f"].map(|name| table.numbers(name)[k])
}

#[test]
fn four_quadrants_tell_normal_force_shear_and_tilt_apart() {
    let steps = "[load]\nsteps = [{ compression = 0.0 }, { compression = 0.2 }, \
                 { compression = 0.2, shift = [\"100 um\", \"0 um\"] }, \
                 { compression = 0.2, tilt = [\"0.4 deg\", \"0 deg\"] }, \
                 { compression = 0.2, tilt = [\"0 deg\", \"0.4 deg\"] }]\n";
    let sandbox = Sandbox::new();
    let text = quadrants("2.8", &plate(RIDING, "400 um", "450 um"), steps, "5e-2");
    sandbox.run(&sandbox.case("quadrants.toml", &text), &["--no-fields", "--no-scene"]).exits_with(0);
    let table = sandbox.table("out/capacitance.csv");
    let diagonal = |step: usize, pad: &str| entry(&table, step, pad, pad)[0];
    let pads = ["pad-1-1", "pad-1-2", "pad-2-1", "pad-2-2"];
    for step in [0, 1] {
        for pad in pads {
            assert!((diagonal(step, pad) / diagonal(step, "pad-1-1") - 1.0).abs() < 1e-9, "{step} {pad}");
        }
    }
    assert!(diagonal(1, "pad-1-1") > 1.05 * diagonal(0, "pad-1-1"), "pressed");
    // Shifted towards +x1 the plate covers more of the pads there; tilted up there it is farther from them.
    for (step, more, less) in [
        (2, ["pad-2-1", "pad-2-2"], ["pad-1-1", "pad-1-2"]),
        (3, ["pad-1-1", "pad-1-2"], ["pad-2-1", "pad-2-2"]),
    ] {
        for (more, less) in more.iter().zip(less) {
            assert!(
                diagonal(step, more) > 1.005 * diagonal(step, less),
                "{step}: {} {}",
                diagonal(step, more),
                diagonal(step, less)
            );
        }
        assert!((diagonal(step, more[0]) / diagonal(step, more[1]) - 1.0).abs() < 1e-9, "{step}");
    }
    // About x1 the side towards +x3 is lowered.
    assert!(diagonal(4, "pad-1-2") > 1.005 * diagonal(4, "pad-1-1"));
    // The array is as wide as it is deep: rotated by 90 degrees, one tilt is the other.
    let [along1, along3] = [entry(&table, 3, "pad-1-1", "pad-1-1"), entry(&table, 4, "pad-1-2", "pad-1-2")];
    assert!(along1[1] < along3[2] && along3[1] < along1[2], "{along1:?} {along3:?}");
    for step in 0..5 {
        for a in pads {
            for b in pads {
                assert_eq!(entry(&table, step, a, b), entry(&table, step, b, a), "reciprocity");
            }
        }
    }
    let json = sandbox.json("out/result.json");
    let warnings = json["warnings"].to_string();
    assert!(!warnings.contains("stays where it is"), "{warnings}");
}

#[test]
fn a_plate_that_was_moved_is_the_same_as_one_that_is_written_there() {
    let steps = "[load]\nsteps = [{ compression = 0.25, shift = [\"200 um\", \"-100 um\"] }]\n";
    let sandbox = Sandbox::new();
    let text = quadrants("1.0", &plate(RIDING, "400 um", "450 um"), steps, "1e-1");
    sandbox.run(&sandbox.case("moved.toml", &text), &["--no-fields", "--no-scene"]).exits_with(0);
    let moved = sandbox.table("out/capacitance.csv");
    // A layer of air may have any thickness: only the position of the plate differs.
    let moved_plate = "[[conductor]]\nname = \"plate\"\ncharge = \"0 C\"\n\
                 box = { min = [\"-2.8 mm\", \"300 um\", \"-3.1 mm\"], max = [\"3.2 mm\", \"350 um\", \"2.9 mm\"] }\n";
    let text =
        quadrants("1.0", moved_plate, "", "1e-1").replace("thickness = \"400 um\"", "thickness = \"300 um\"");
    sandbox.run(&sandbox.case("there.toml", &text), &["--no-fields", "--no-scene"]).exits_with(0);
    let placed = sandbox.table("out/capacitance.csv");
    for (a, b) in [("pad-1-1", "pad-1-1"), ("pad-1-1", "pad-2-2"), ("pad-1-2", "pad-2-1")] {
        let [one, other] = [&moved, &placed].map(|table| entry(table, 0, a, b));
        assert!(
            (one[0] - other[0]).abs() <= 1e-6 * entry(&placed, 0, "pad-1-1", "pad-1-1")[0],
            "{one:?} {other:?}"
        );
    }
}

#[test]
fn a_tilted_plate_has_the_capacitance_of_its_outline_by_the_extruded_solver() {
    // In air, where the layer does not matter, with the plate as the only other terminal.
    let steps = "[load]\nsteps = [{ compression = 0.0, tilt = [\"3 deg\", \"0 deg\"] }]\n";
    let sandbox = Sandbox::new();
    let text = quadrants("1.0", &plate("attached = \"layer-top\"\n", "400 um", "450 um"), steps, "2e-2");
    sandbox.run(&sandbox.case("tilted.toml", &text), &["--no-fields", "--no-scene"]).exits_with(0);
    assert_eq!(sandbox.json("out/result.json")["steps"][0]["route"], "mapped_boxes");
    let under_map = sandbox.table("out/capacitance.csv");
    let (sine, cosine) = 3.0_f64.to_radians().sin_cos();
    let corner = |x: f64, y: f64| {
        format!("[\"{:.9} mm\", \"{:.9} mm\"]", cosine * x - sine * y, 0.4 + sine * x + cosine * y)
    };
    let corners = [corner(-3.0, 0.0), corner(3.0, 0.0), corner(3.0, 0.05), corner(-3.0, 0.05)].join(", ");
    let outline = format!(
        "[[conductor]]\nname = \"plate\"\nextrusion = {{ axis = \"x3\", from = \"-3 mm\", to = \"3 mm\", outline = [{corners}] }}\n"
    );
    // Without the layer, which is air as well.
    let text =
        quadrants("1.0", &outline, "", "2e-1").replace("thickness = \"400 um\"", "thickness = \"100 um\"");
    let text = text.replace("[electrostatics]\n", "[electrostatics]\nsolver = \"extruded\"\n");
    sandbox.run(&sandbox.case("outline.toml", &text), &["--no-fields", "--no-scene"]).exits_with(0);
    let outline = sandbox.table("out/capacitance.csv");
    for (a, b) in [("plate", "plate"), ("pad-1-1", "plate"), ("pad-2-1", "plate"), ("pad-2-2", "pad-2-2")] {
        let [one, other] = [&under_map, &outline].map(|table| entry(table, 0, a, b));
        assert!(one[1] <= other[2] && other[1] <= one[2], "{a} {b}: {one:?} {other:?}");
    }
    let [near, far] = ["pad-1-1", "pad-2-1"].map(|pad| -entry(&outline, 0, pad, "plate")[0]);
    assert!(near > 1.2 * far, "the tilt matters: {near:e} {far:e}");
}

#[test]
fn a_plate_that_stays_behind_is_warned_of() {
    let sandbox = Sandbox::new();
    let text = quadrants(
        "2.8",
        &plate("charge = \"0 C\"\n", "405 um", "455 um"),
        "[load]\ncompression = [0.0, 0.2]\n",
        "9e-1",
    );
    let run = sandbox.run(&sandbox.case("behind.toml", &text), &["--no-fields", "--no-scene"]);
    run.exits_with(0);
    let warnings = sandbox.json("out/result.json")["warnings"].to_string();
    assert!(warnings.contains("`plate` stays where it is while the layer's top sinks"), "{warnings}");
}

#[test]
fn a_shift_has_the_horizontal_force_of_simple_shear_and_a_tilt_has_none() {
    let steps = "[load]\nsteps = [{ compression = 0.0 }, { compression = 0.0, shift = [\"100 um\", \"-50 um\"] }, \
                 { compression = 0.2, shift = [\"-100 um\", \"0 um\"] }, \
                 { compression = 0.2, shift = [\"100 um\", \"0 um\"], tilt = [\"0.2 deg\", \"0 deg\"] }]\n";
    let sandbox = Sandbox::new();
    let text = quadrants("2.8", &plate(RIDING, "400 um", "450 um"), steps, "5e-1");
    let run = sandbox.run(&sandbox.case("shifted.toml", &text), &["--no-fields", "--no-scene"]).exits_with(0);
    let table = sandbox.table("out/curve.csv");
    // 100 kPa on 6 mm x 6 mm, 400 um thick: 0.9 N for 100 um, pressed or not, since the rubber is
    // neo-Hookean.
    let [along1, along3] = ["force_x1_n", "force_x3_n"].map(|name| table.texts(name));
    assert_eq!((along1[0], along3[0], along1[3], along3[3]), ("0", "0", "", ""));
    for (text, expected) in [(along1[1], 0.9), (along3[1], -0.45), (along1[2], -0.9)] {
        let found: f64 = text.parse().expect("a number");
        assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
    }
    assert_eq!(along3[2], "0");
    let warnings: Vec<&str> = run.stderr.lines().filter(|line| line.contains("horizontal force")).collect();
    let [line] = warnings.as_slice() else { panic!("one warning expected: {}", run.stderr) };
    assert!(line.contains("simple shear, up to U/H = 0.2000"), "{line}");
    let json = sandbox.json("out/result.json");
    assert_eq!(json["steps"][1]["force_x1_n"].as_f64().map(|f| f.to_string()), Some(along1[1].to_owned()));
    assert!(json["steps"][3]["force_x1_n"].is_null());
}
