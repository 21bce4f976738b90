//! Checks that the acceptance files give the values of expected.json, within their stated errors.

use crate::support::{Sandbox, acceptance};
use elastocap_electrostatics::VACUUM_PERMITTIVITY;
use serde_json::Value;

/// The files of a scene without load.
const FILES_WITHOUT_LOAD: [&str; 7] = [
    "capacitance.csv",
    "fields.pvd",
    "report.html",
    "result.json",
    "scene.glb",
    "section_000.svg",
    "step_000.vtu",
];

fn expected() -> Value {
    let text = std::fs::read_to_string(acceptance("expected.json")).expect("expected.json");
    serde_json::from_str(&text).expect("expected.json is JSON")
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is not a number"))
}

#[track_caller]
fn assert_close(found: f64, wanted: f64, tolerance: f64, what: &str) {
    let scale = if wanted == 0.0 { 1.0 } else { wanted.abs() };
    assert!((found - wanted).abs() <= tolerance * scale, "{what}: {found:e} instead of {wanted:e}");
}

/// Checks that the value has its stated accuracy, and that its bounds hold the truth up to the error of the
/// truth.
#[track_caller]
fn assert_bounded(found: [f64; 3], error: f64, wanted: f64, slack: f64, tolerance: f64, what: &str) {
    let [value, lower, upper] = found;
    assert_close(value, wanted, error + slack, &format!("{what}: the error claimed is too small"));
    assert!(upper - lower <= tolerance * value.abs(), "{what}: the spread is {:e}", (upper - lower) / value);
    let slack = slack * wanted.abs();
    assert!(
        lower <= wanted + slack && wanted - slack <= upper,
        "{what}: {wanted:e} not in [{lower:e}, {upper:e}]"
    );
}

#[test]
fn the_in_plane_pair_gives_the_expected_curve_and_every_file() {
    let sandbox = Sandbox::new();
    let expected = &expected()["in-plane-pair.toml"];
    sandbox.run(&acceptance("in-plane-pair.toml"), &[]).exits_with(0);
    let table = sandbox.table("out/curve.csv");
    let status = table.texts("status");
    assert_eq!((status.len(), status[0]), (6, "ok"));
    assert!(status[1..].iter().all(|status| *status == "ok: but for the model of the layer"), "{status:?}");
    let compressions: Vec<f64> =
        expected["compression"].as_array().expect("a list").iter().map(number).collect();
    assert_eq!(table.numbers("compression"), compressions);
    for column in ["force_n", "gap_m", "electrode_height_m", "electrode_thickness_m", "parallel_plate_f"] {
        let tolerance = number(&expected[column]["tolerance"]);
        for (step, found) in table.numbers(column).into_iter().enumerate() {
            let wanted = number(&expected[column]["value"][step]);
            assert_close(found, wanted, tolerance, &format!("{column} of step {step}"));
        }
    }
    let capacitance = &expected["two_terminal_capacitance_f"];
    let columns = ["two_terminal_capacitance_f", "capacitance_lower_f", "capacitance_upper_f"];
    let columns = columns.map(|column| table.numbers(column));
    let errors = table.numbers("relative_error_estimate");
    for step in 0..6 {
        let wanted = number(&capacitance["value"][step]);
        let found = columns.each_ref().map(|column| column[step]);
        let slack = number(&capacitance["tolerance"]);
        assert_bounded(found, errors[step], wanted, slack, 1e-3, &format!("step {step}"));
    }
    let mut files: Vec<String> = [
        "capacitance.csv",
        "curve.csv",
        "curve.svg",
        "fields.pvd",
        "report.html",
        "result.json",
        "scene.glb",
    ]
    .map(Into::into)
    .into();
    files.extend([0, 5].map(|step| format!("section_{step:03}.svg")));
    files.extend((0..6).map(|step| format!("step_{step:03}.vtu")));
    assert_eq!(sandbox.names("out"), files);
    let json = sandbox.json("out/result.json");
    assert_eq!(json["files"], serde_json::json!(files));
    assert_eq!(json["status"], "complete");
    for (step, value) in columns[0].iter().enumerate() {
        assert_eq!(number(&json["steps"][step]["two_terminal_capacitance_f"]), *value);
        // No flux leaves the pair, so that the two are equal but for rounding.
        let mutual = -number(&json["steps"][step]["maxwell_matrix_f"][0][1]);
        assert!((mutual / value - 1.0).abs() < 1e-11, "{mutual:e} {value:e}");
    }
}

#[test]
fn loading_by_force_finds_the_compression_that_carries_it() {
    let sandbox = Sandbox::new();
    sandbox.run(&acceptance("in-plane-pair-by-force.toml"), &[]).exits_with(0);
    let table = sandbox.table("out/curve.csv");
    for (found, wanted) in table.numbers("force_n").into_iter().zip([0.0, 0.01, 0.05, 0.1, 0.3]) {
        assert_close(found, wanted, 1e-12, "force");
    }
    // Between the steps of in-plane-pair.toml whose forces enclose it.
    let compressions = table.numbers("compression");
    for (found, [low, high]) in
        compressions[1..].iter().zip([[0.0, 0.05], [0.1, 0.2], [0.2, 0.3], [0.3, 0.4]])
    {
        assert!(low < *found && *found < high, "{found}");
    }
    assert!(table.numbers("two_terminal_capacitance_f").is_sorted_by(|a, b| a > b));
}

#[test]
fn purely_electrostatic_scenes_give_the_expected_maxwell_matrices() {
    for (name, tolerance) in [("isolated-cube.toml", 1e-4), ("cube-in-cube.toml", 1e-5)] {
        let sandbox = Sandbox::new();
        let expected = &expected()[name]["maxwell_matrix_f"];
        sandbox.run(&acceptance(name), &[]).exits_with(0);
        let json = sandbox.json("out/result.json");
        let at = |key: &str| number(&json[key][0][0]);
        let found = [at("maxwell_matrix_f"), at("maxwell_matrix_lower_f"), at("maxwell_matrix_upper_f")];
        let slack = number(&expected["tolerance"]);
        let error = number(&json["relative_error_estimate"]);
        assert_bounded(found, error, number(&expected["value"][0][0]), slack, tolerance, name);
        assert_eq!(json["two_terminal_capacitance_f"], json["maxwell_matrix_f"][0][0], "against ground");
        assert_eq!(sandbox.names("out"), FILES_WITHOUT_LOAD);
        let table = sandbox.table("out/capacitance.csv");
        assert_eq!(table.texts("quantity"), ["maxwell", "two_terminal"]);
        assert_eq!(table.numbers("value_f")[0], found[0]);
        assert_eq!(table.texts("column")[1], "ground");
    }
}

/// The share of the capacitance that the warning about faceting states.
fn flat_faces(json: &Value) -> f64 {
    let warnings = json["steps"][0]["warnings"].as_array().expect("warnings");
    let share =
        warnings.iter().filter_map(Value::as_str).find_map(|w| w.split_once("a relative error of about "));
    share
        .map_or(0.0, |(_, rest)| rest.split_whitespace().next().expect("a number").parse().expect("a number"))
}

#[test]
fn scenes_of_round_and_imported_bodies_give_the_expected_maxwell_matrices() {
    for (name, loosened, solver) in [
        ("two-spheres.toml", "5e-3", ""),
        ("layered-spheres.toml", "2e-3", ""),
        // The cube is recognised as a box.
        ("imported-cube-in-cube.toml", "5e-3", ""),
        ("imported-cube-in-cube.toml", "5e-3", "solver = \"tetrahedra\"\n"),
    ] {
        let sandbox = Sandbox::new();
        let wanted = &expected()[name]["maxwell_matrix_f"];
        let text = std::fs::read_to_string(acceptance(name)).expect("the acceptance files");
        let tolerance: f64 = loosened.parse().expect("a number");
        // The tolerance of the file would take longer than a test should.
        let text: String = text
            .lines()
            .map(|line| {
                let known = line.starts_with("relative_tolerance");
                if known { format!("relative_tolerance = {loosened}\n{solver}") } else { format!("{line}\n") }
            })
            .collect();
        std::fs::copy(acceptance("cube.obj"), sandbox.path("cube.obj")).expect("a copy");
        sandbox.run(&sandbox.case(name, &text), &[]).exits_with(0);
        let json = sandbox.json("out/result.json");
        let flat = flat_faces(&json);
        let rows = wanted["value"].as_array().expect("a matrix");
        let diagonal = |k: usize| number(&rows[k][k]);
        for i in 0..rows.len() {
            for j in 0..rows.len() {
                let wanted = number(&rows[i][j]);
                let [value, lower, upper] =
                    ["maxwell_matrix_f", "maxwell_matrix_lower_f", "maxwell_matrix_upper_f"]
                        .map(|key| number(&json[key][i][j]));
                let slack = flat * (diagonal(i) * diagonal(j)).sqrt();
                assert!(
                    lower <= wanted + slack && wanted - slack <= upper && lower <= value && value <= upper,
                    "{name}, {i} {j}: {wanted:e} not in [{lower:e}, {upper:e}] with {slack:e}"
                );
                assert!(upper - lower <= tolerance * value.abs(), "{name}: {lower:e} {upper:e}");
            }
        }
        assert_eq!(sandbox.names("out"), FILES_WITHOUT_LOAD);
    }
}

#[test]
fn bounds_of_a_planar_pattern_at_two_tolerances_overlap_and_shrink() {
    let text = std::fs::read_to_string(acceptance("rounded-pattern.toml")).expect("the acceptance files");
    let [coarse, fine] = ["0.3", "0.1"].map(|tolerance| {
        let sandbox = Sandbox::new();
        let text = text.replace("1e-2", tolerance);
        sandbox.run(&sandbox.case("pattern.toml", &text), &[]).exits_with(0);
        let json = sandbox.json("out/result.json");
        [[0, 0], [0, 1], [1, 1]].map(|[i, j]| {
            ["maxwell_matrix_lower_f", "maxwell_matrix_upper_f"].map(|key| number(&json[key][i][j]))
        })
    });
    for (coarse, fine) in coarse.into_iter().zip(fine) {
        assert!(coarse[0] <= fine[1] && fine[0] <= coarse[1], "{coarse:?} {fine:?}");
        assert!(fine[1] - fine[0] < coarse[1] - coarse[0], "{coarse:?} {fine:?}");
    }
}

#[test]
fn two_equal_combs_of_ten_fingers_each_have_a_matrix_that_is_the_same_seen_from_either() {
    let cases = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("cases");
    let text = std::fs::read_to_string(cases.join("comb.toml")).expect("the comb");
    let sandbox = Sandbox::new();
    sandbox.run(&sandbox.case("comb.toml", &text.replace("1e-1", "0.4")), &[]).exits_with(0);
    let json = sandbox.json("out/result.json");
    let bounds = |i: usize, j: usize| {
        ["maxwell_matrix_lower_f", "maxwell_matrix_upper_f"].map(|key| number(&json[key][i][j]))
    };
    let (one, other, mutual) = (bounds(0, 0), bounds(1, 1), bounds(0, 1));
    assert!(one[0] <= other[1] && other[0] <= one[1], "{one:?} {other:?}");
    // An earlier computation, to 2 %, gave 374.9 and -341.8 fF.
    assert!(one[0] < 374.9e-15 && 374.9e-15 < one[1], "{one:?}");
    assert!(mutual[0] < -341.8e-15 && -341.8e-15 < mutual[1] && mutual[1] < 0.0, "{mutual:?}");
}

#[test]
fn boxes_as_tetrahedra_agree_with_the_solver_for_boxes() {
    let floating = std::fs::read_to_string(acceptance("floating-plate.toml")).expect("the acceptance files");
    let cube = std::fs::read_to_string(acceptance("cube-in-cube.toml")).expect("the acceptance files");
    for text in [floating, cube] {
        let [boxes, tetrahedra] = ["boxes", "tetrahedra"].map(|solver| {
            let sandbox = Sandbox::new();
            let lines = text.lines().filter(|l| !l.starts_with("relative_tolerance"));
            let text: String = lines.map(|l| format!("{l}\n")).collect();
            assert!(text.contains("[electrostatics]"));
            let settings = format!("[electrostatics]\nrelative_tolerance = 2e-2\nsolver = \"{solver}\"");
            let text = text.replace("[electrostatics]", &settings);
            sandbox.run(&sandbox.case("case.toml", &text), &[]).exits_with(0);
            let json = sandbox.json("out/result.json");
            ["maxwell_matrix_lower_f", "maxwell_matrix_upper_f"].map(|key| number(&json[key][0][0]))
        });
        assert!(boxes[0] <= tetrahedra[1] && tetrahedra[0] <= boxes[1], "{boxes:?} {tetrahedra:?}");
        assert_ne!(boxes, tetrahedra);
    }
}

#[test]
fn two_plates_give_the_expected_two_terminal_capacitance() {
    let sandbox = Sandbox::new();
    let expected = &expected()["square-plates.toml"]["two_terminal_capacitance_f"];
    sandbox.run(&acceptance("square-plates.toml"), &[]).exits_with(0);
    let json = sandbox.json("out/result.json");
    assert_eq!(json["conductors"], serde_json::json!(["lower", "upper"]));
    let quantities = sandbox.table("out/capacitance.csv");
    let [value, lower, upper, error] = ["value_f", "lower_f", "upper_f", "relative_error_estimate"]
        .map(|column| *quantities.numbers(column).last().expect("six lines"));
    assert_eq!(number(&json["two_terminal_capacitance_f"]), value);
    let (wanted, slack) = (number(&expected["value"]), number(&expected["tolerance"]));
    assert_bounded([value, lower, upper], error, wanted, slack, 1e-3, "two-terminal");
    // In open space the mutual capacitance is measured.
    let mutual = number(&json["capacitance_f"]);
    assert!(0.0 < mutual && mutual < lower && mutual == -number(&json["maxwell_matrix_f"][0][1]));
    assert_eq!(
        quantities.texts("quantity"),
        ["maxwell", "maxwell", "maxwell", "maxwell", "mutual", "two_terminal"]
    );
}

#[test]
fn the_stacked_pair_closes_its_gap_and_gains_capacitance() {
    let sandbox = Sandbox::new();
    let text = std::fs::read_to_string(acceptance("stacked-pair.toml")).expect("the acceptance files");
    // Two of its steps, at a larger tolerance, because open space takes its time.
    let text = text.replace("{ from = 0.0, to = 0.4, points = 9 }", "[0.0, 0.4]").replace("1e-3", "2e-2");
    sandbox.run(&sandbox.case("stacked.toml", &text), &[]).exits_with(0);
    let table = sandbox.table("out/curve.csv");
    let gaps = table.numbers("gap_m");
    assert_close(gaps[0], 200e-6, 1e-12, "gap without load");
    assert!(gaps[1] < gaps[0]);
    let capacitances = table.numbers("capacitance_f");
    assert!(capacitances[1] > capacitances[0]);
    let plates = table.numbers("parallel_plate_f")[0];
    assert_close(plates, VACUUM_PERMITTIVITY * 2.8 * 1e-6 / 200e-6, 1e-12, "parallel plates");
    assert!(table.numbers("fringe_ratio").iter().all(|ratio| *ratio > 1.0));
}

#[test]
fn a_mesh_from_gmsh_is_read_beside_its_case_file_and_solved_as_it_is() {
    let sandbox = Sandbox::new();
    let cases = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("cases");
    let text = std::fs::read_to_string(cases.join("dome-from-gmsh.toml")).expect("a case file");
    std::fs::create_dir(sandbox.path("there")).expect("a folder");
    let measured = "[measure]\ncapacitance = [\"dome\", \"electrode\"]\nkind = \"two-terminal\"\n";
    let text = format!("{}\n{measured}", text.replace("2e-2", "5e-2"));
    let case = sandbox.case("there/dome.toml", &text);
    let refused = sandbox.run(&case, &[]).exits_with(2).stderr;
    assert!(refused.contains("there/dome-from-gmsh.msh") && refused.contains("dome.toml:5:8"), "{refused}");
    assert!(sandbox.names("out").is_empty());

    std::fs::copy(cases.join("dome-from-gmsh.msh"), sandbox.path("there/dome-from-gmsh.msh"))
        .expect("a copy");
    let output = sandbox.run(&case, &[]).exits_with(0);
    assert!(output.stderr.contains("stand for a curved surface"), "{}", output.stderr);
    let json = sandbox.json("out/result.json");
    assert_eq!(json["conductors"], serde_json::json!(["dome", "electrode"]));
    let keys = ["two_terminal_capacitance_f", "capacitance_lower_f", "capacitance_upper_f"];
    // A reference value for this mesh, at a tolerance of 1e-2.
    assert_bounded(keys.map(|key| number(&json[key])), 2.5e-2, 2.0365e-13, 3.3e-3, 5e-2, "two-terminal");
    assert_eq!(sandbox.names("out"), FILES_WITHOUT_LOAD);
}

#[test]
fn the_case_files_for_users_are_valid_and_the_first_is_that_of_the_paper() {
    let sandbox = Sandbox::new();
    let cases = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("cases");
    let same = |path: &std::path::Path| std::fs::read_to_string(path).expect("a case file");
    assert_eq!(same(&cases.join("in-plane-pair.toml")), same(&acceptance("in-plane-pair.toml")));
    let mut count = 0;
    for entry in std::fs::read_dir(cases).expect("cases/").flatten() {
        let path = entry.path();
        if path.extension().is_some_and(|end| end == "toml") {
            count += 1;
            let output = sandbox.elastocap(&["check", path.to_str().expect("UTF-8")]).exits_with(0);
            assert!(output.stdout.contains("electrostatics"), "{}", output.stdout);
        }
    }
    assert!(count >= 6);
}
