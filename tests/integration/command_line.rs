//! Tests of the output, the files and the exit status of the subcommands.

use crate::support::{STEPS, Sandbox, acceptance, quick_pair};

#[test]
fn json_is_all_that_stands_on_stdout_when_asked_for() {
    let sandbox = Sandbox::new();
    let case = sandbox.case("pair.toml", &quick_pair(STEPS, "compression = [0.0, 0.0]"));
    let output = sandbox.run(&case, &["--json"]).exits_with(0);
    let json: serde_json::Value = serde_json::from_str(&output.stdout).expect("JSON and nothing else");
    assert_eq!(json, sandbox.json("out/result.json"));
    assert_eq!(output.stderr, "");
    assert_eq!(json["steps"].as_array().map(Vec::len), Some(2));
}

#[test]
fn quiet_says_nothing_when_all_is_well() {
    let sandbox = Sandbox::new();
    // Nothing presses, so that no model error arises.
    let case = sandbox.case("pair.toml", &quick_pair(STEPS, "compression = [0.0]"));
    let output = sandbox.run(&case, &["--quiet"]).exits_with(0);
    assert_eq!((output.stdout.as_str(), output.stderr.as_str()), ("", ""));
}

#[test]
fn a_closed_form_that_is_far_from_a_punch_says_by_how_much() {
    let sandbox = Sandbox::new();
    let case = sandbox.case("pair.toml", &quick_pair(STEPS, "compression = [0.1, 0.3]"));
    let output = sandbox.run(&case, &["--quiet"]).exits_with(0);
    assert!(output.stderr.contains("differs by -45 % to -5 %"), "{}", output.stderr);
    let checked = sandbox.elastocap(&["check", case.to_str().expect("UTF-8")]).exits_with(0);
    assert!((checked.stdout + &checked.stderr).contains("differs by -45 % to -5 %"));
    // F / (mu H w) = 2.8936 and 9.0138 by finite elements (docs/mechanics.md), mu H w = 20.0763 mN.
    let json = sandbox.json("out/result.json");
    for (step, expected) in [(0, 58.09e-3), (1, 180.96e-3)] {
        let check = &json["steps"][step]["closed_form_check"];
        let force = check["punch_force_n"].as_f64().expect("a number");
        assert!((force / expected - 1.0).abs() < 0.01, "{check}");
        let closed_form = json["steps"][step]["force_n"].as_f64().expect("a number");
        let difference = check["relative_difference"].as_f64().expect("a number");
        assert!((difference - (closed_form / force - 1.0)).abs() < 1e-12, "{check}");
    }
}

#[test]
fn results_go_to_a_folder_named_after_the_case_by_default() {
    let sandbox = Sandbox::new();
    sandbox.case("pair.toml", &quick_pair(STEPS, "compression = [0.2]"));
    sandbox.elastocap(&["run", "pair.toml"]).exits_with(0);
    assert!(sandbox.names("results/pair").contains(&"curve.csv".to_owned()));
}

#[test]
fn a_step_that_fails_is_marked_with_its_reason_and_the_others_are_kept() {
    let sandbox = Sandbox::new();
    // Rigid plates of 100 um, 50 um apart, in 450 um: they meet.
    let text = std::fs::read_to_string(acceptance("stacked-pair.toml")).expect("the acceptance files");
    let text = text
        .replace("{ from = 0.0, to = 0.4, points = 9 }", "[0.0, 0.6, 0.1]")
        .replace("\"200 um\"         # between", "\"50 um\" # between")
        .replace("\"10 um\"", "\"100 um\"")
        .replace("1e-3", "0.1");
    let case = sandbox.case("closing.toml", &text);
    let output = sandbox.run(&case, &[]).exits_with(3);
    assert!(output.stderr.contains("step 1 failed"), "{}", output.stderr);
    let table = sandbox.table("out/curve.csv");
    let status = table.texts("status");
    assert!(status[0] == "ok" && status[2].starts_with("ok"), "{status:?}");
    assert!(status[1].starts_with("failed: "), "{}", status[1]);
    assert!(status[1].contains("closes") || status[1].contains("leave"), "{}", status[1]);
    // The known values of the failed step.
    let forces = table.numbers("force_n");
    for (force, expected) in forces.iter().zip([0.0, 268.119_162_317_577, 5.198_357_086_752_7]) {
        assert!((force - expected).abs() <= 1e-12 * expected, "{forces:?}");
    }
    assert_eq!(table.texts("two_terminal_capacitance_f")[1], "");
    let json = sandbox.json("out/result.json");
    assert_eq!(json["status"], "incomplete");
    assert_eq!(sandbox.names("out").iter().filter(|name| name.ends_with(".vtu")).count(), 2);
    let output = sandbox.elastocap(&["check", case.to_str().expect("UTF-8")]).exits_with(3);
    assert!(output.stdout.contains("step 1 will fail"), "{}", output.stdout);
}

#[test]
fn a_force_that_the_layer_cannot_carry_fails_its_step_alone() {
    let sandbox = Sandbox::new();
    let case = sandbox.case("pair.toml", &quick_pair(STEPS, "force = [\"0.01 N\", \"1 MN\"]"));
    sandbox.run(&case, &[]).exits_with(3);
    let table = sandbox.table("out/curve.csv");
    assert!(table.texts("status")[0].starts_with("ok"), "{:?}", table.texts("status"));
    assert!(table.texts("status")[1].contains("reaches only"), "{:?}", table.texts("status"));
    assert_eq!(table.texts("force_n")[1], "1000000");
    assert_eq!(table.texts("compression")[1], "");
}

#[test]
fn a_compression_beyond_the_largest_force_gets_a_capacitance_and_no_force() {
    let sandbox = Sandbox::new();
    let case = sandbox.case("pair.toml", &quick_pair(STEPS, "compression = [0.1, 0.97]"));
    let output = sandbox.run(&case, &[]).exits_with(3);
    assert!(output.stderr.contains("step 1 got no force"), "{}", output.stderr);
    let table = sandbox.table("out/curve.csv");
    let status = table.texts("status");
    assert_eq!(status, ["ok: but for the model of the layer", "no force: beyond the limit of eq. (50)"]);
    assert_eq!(table.texts("force_n")[1], "");
    // An earlier computation, to 2.3e-4, gave this value.
    let [lower, upper] =
        ["capacitance_lower_f", "capacitance_upper_f"].map(|column| table.numbers(column)[1]);
    let found = 3.869_7e-15;
    assert!(lower < found && found < upper && upper - lower < 0.05 * found, "{lower:e} {upper:e}");
    let json = sandbox.json("out/result.json");
    assert_eq!(json["status"], "incomplete");
    assert!(
        json["steps"][1]["reason"]
            .as_str()
            .is_some_and(|w| w.contains("equation (50) of the paper (Large deformation mechanics")),
        "{json:#}"
    );
}

#[test]
fn without_pruning_the_numbers_are_the_same() {
    let sandbox = Sandbox::new();
    let case = sandbox.case("pair.toml", &quick_pair(STEPS, "compression = [0.2, 0.0, 0.2]"));
    sandbox.run(&case, &[]).exits_with(0);
    let pruned = sandbox.table("out/curve.csv");
    let left_out = sandbox.json("out/result.json")["plan"]["left_out"].to_string();
    assert!(left_out.contains("mirror images") && left_out.contains("same load"), "{left_out}");
    sandbox.run(&case, &["--no-prune"]).exits_with(0);
    let whole = sandbox.table("out/curve.csv");
    assert_eq!(sandbox.json("out/result.json")["plan"]["left_out"], serde_json::json!([]));
    for column in ["force_n", "gap_m", "parallel_plate_f"] {
        assert_eq!(pruned.texts(column), whole.texts(column));
    }
    for column in ["two_terminal_capacitance_f", "capacitance_lower_f", "capacitance_upper_f"] {
        for (a, b) in pruned.numbers(column).into_iter().zip(whole.numbers(column)) {
            assert!((a / b - 1.0).abs() < 1e-10, "{column}: {a:e} and {b:e}");
        }
    }
    assert_eq!(pruned.texts("status"), whole.texts("status"));
    assert_eq!(pruned.texts("two_terminal_capacitance_f")[0], pruned.texts("two_terminal_capacitance_f")[2]);
}

#[test]
fn a_layer_without_conductors_gives_force_against_compression() {
    let sandbox = Sandbox::new();
    let text = "format = 1\n\
        [layer]\nthickness = \"450 um\"\n\
        [layer.material.mooney_rivlin]\nc10 = \"682.15 Pa\"\nc01 = \"43931.9 Pa\"\n\
        [mechanics.closed_form]\ncontact_half_length = \"500 um\"\ncontact_width = \"500 um\"\nshear_length = \"500 um\"\n\
        [load]\ncompression = [0.0, 0.2]\n";
    let case = sandbox.case("layer.toml", text);
    sandbox.run(&case, &[]).exits_with(0);
    assert_eq!(sandbox.names("out"), ["curve.csv", "curve.svg", "report.html", "result.json", "scene.glb"]);
    let table = sandbox.table("out/curve.csv");
    let force = table.numbers("force_n");
    assert_eq!(force[0], 0.0);
    assert!((force[1] / 0.083_099_489_87 - 1.0).abs() < 1e-9, "{force:?}");
    assert_eq!(table.texts("two_terminal_capacitance_f"), ["", ""]);
    let output = sandbox.elastocap(&["check", case.to_str().expect("UTF-8")]).exits_with(0);
    assert!(output.stdout.contains("electrostatics: there are no electrodes"), "{}", output.stdout);
}

#[test]
fn a_pair_without_load_gives_its_capacitance_and_a_curve_of_one_point() {
    let sandbox = Sandbox::new();
    let text = quick_pair(&format!("[load]\n{STEPS}\n"), "");
    let case = sandbox.case("pair.toml", &text);
    sandbox.run(&case, &[]).exits_with(0);
    assert_eq!(
        sandbox.names("out"),
        [
            "capacitance.csv",
            "curve.csv",
            "fields.pvd",
            "report.html",
            "result.json",
            "scene.glb",
            "section_000.svg",
            "step_000.vtu"
        ]
    );
    let json = sandbox.json("out/result.json");
    assert_eq!(json["two_terminal_capacitance_f"], json["steps"][0]["two_terminal_capacitance_f"]);
    // The pair as it is without load, and the formula for plates: see the acceptance cases.
    let ratio = json["fringe_ratio"].as_f64().expect("a number");
    assert!((ratio / (43.965_9 / 4.958_345) - 1.0).abs() < 0.025, "{ratio}");
    assert!(json["plan"]["left_out"].to_string().contains("there is no load"));
}

#[test]
fn a_grounded_finger_takes_capacitance_from_the_pair() {
    let sandbox = Sandbox::new();
    let finger = "[[conductor]]\nname = \"finger\"\n\
        box = { min = [\"-1 mm\", \"460 um\", \"-1 mm\"], max = [\"1 mm\", \"600 um\", \"1 mm\"] }\n";
    let plain = quick_pair(STEPS, "compression = [0.1]");
    sandbox.run(&sandbox.case("plain.toml", &plain), &[]).exits_with(0);
    let alone = sandbox.table("out/curve.csv").numbers("two_terminal_capacitance_f")[0];
    let case = sandbox.case("finger.toml", &format!("{plain}\n{finger}"));
    sandbox.run(&case, &[]).exits_with(0);
    let json = sandbox.json("out/result.json");
    assert_eq!(json["conductors"][2], "finger");
    let step = &json["steps"][0];
    // Without a ground the pair has one capacitance; beside the grounded finger its mutual one is measured.
    let measured = step["capacitance_f"].as_f64().expect("a number");
    let mutual = -step["maxwell_matrix_f"][0][1].as_f64().expect("a number");
    assert!(measured == mutual && mutual < alone, "{measured:e} {mutual:e} {alone:e}");
    assert_eq!(step["status"], "ok: but for the model of the layer");
}

#[test]
fn fields_and_scene_are_left_out_when_not_wanted_and_old_ones_are_removed() {
    let sandbox = Sandbox::new();
    let three = sandbox.case("pair.toml", &quick_pair(STEPS, "compression = [0.0, 0.1, 0.2]"));
    sandbox.run(&three, &[]).exits_with(0);
    sandbox.case("out/notes.txt", "a note of the user");
    assert_eq!(sandbox.names("out").len(), 13);
    sandbox.run(&three, &["--no-fields", "--no-scene"]).exits_with(0);
    assert_eq!(
        sandbox.names("out"),
        ["capacitance.csv", "curve.csv", "curve.svg", "notes.txt", "report.html", "result.json"]
    );
    let left_out = sandbox.json("out/result.json")["plan"]["left_out"].to_string();
    assert!(left_out.contains("scene.glb") && left_out.contains("fields"), "{left_out}");
}

#[test]
fn mesh_writes_the_bodies_and_their_grid_and_nothing_else() {
    let sandbox = Sandbox::new();
    let case = acceptance("stacked-pair.toml");
    sandbox.elastocap(&["mesh", case.to_str().expect("UTF-8"), "-o", "out"]).exits_with(0);
    let mut names = ["fields.pvd", "mesh.json", "scene.glb"].map(str::to_owned).to_vec();
    names.extend((0..9).map(|step| format!("step_{step:03}.vtu")));
    assert_eq!(sandbox.names("out"), names);
}

#[test]
fn check_prints_the_plan_and_writes_nothing() {
    let sandbox = Sandbox::new();
    let case = acceptance("in-plane-pair.toml");
    let case = case.to_str().expect("UTF-8");
    let output = sandbox.elastocap(&["check", case]).exits_with(0);
    for words in [
        "6 load steps",
        "quarter",
        "unknowns",
        "memory",
        "time",
        "mirror images along x1 and x3",
        "Symmetry cuts the unknowns from ",
    ] {
        assert!(output.stdout.contains(words), "`{words}` is not in: {}", output.stdout);
    }
    let output = sandbox.elastocap(&["check", case, "--json"]).exits_with(0);
    let plan: serde_json::Value = serde_json::from_str(&output.stdout).expect("JSON and nothing else");
    assert_eq!(plan["mirrored"], serde_json::json!([true, false, true]));
    assert!(plan["left_out"][0]["saved_unknowns"].as_u64().is_some_and(|n| n > 0));
    assert_eq!(sandbox.names("."), Vec::<String>::new());
}

#[test]
fn check_tells_once_for_all_steps_why_a_run_will_fail() {
    let sandbox = Sandbox::new();
    let case = acceptance("found/electrode-longer-than-layer.toml");
    let path = case.to_str().expect("UTF-8");
    let reason = "the electrodes reach to 1.000e6 m from the middle along x1";
    // No step can be solved.
    let check = sandbox.elastocap(&["check", path]).exits_with(2);
    let line = format!("2 steps, from step 0 on, will fail: {reason}");
    assert_eq!(check.stdout.matches("will fail").count(), 1, "{}", check.stdout);
    assert!(check.stdout.contains(&line), "`{line}` is not in: {}", check.stdout);
    assert!(!check.stdout.contains("meshes of"), "an empty list of meshes: {}", check.stdout);
    assert!(check.stdout.contains("`half_length` in [layer]"), "no cure: {}", check.stdout);
    sandbox.run(&case, &["--no-fields", "--no-scene"]).exits_with(3);
    for status in sandbox.table("out/curve.csv").texts("status") {
        assert!(status.starts_with(&format!("failed: {reason}")), "{status}");
    }
    sandbox.elastocap(&["check", path, "--quiet"]).exits_with(2);
}

#[test]
fn the_schema_is_printed_and_a_reader_that_goes_away_is_no_failure() {
    let sandbox = Sandbox::new();
    let output = sandbox.elastocap(&["schema"]).exits_with(0);
    let schema: serde_json::Value = serde_json::from_str(&output.stdout).expect("JSON");
    assert!(schema["properties"]["layer"].is_object());
    let mut child = sandbox
        .command(&["schema"])
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .expect("the binary starts");
    drop(child.stdout.take());
    let output = child.wait_with_output().expect("it ends");
    crate::support::Finished::from(output).exits_with(0);
}
