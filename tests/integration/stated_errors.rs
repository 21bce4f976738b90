//! Checks that printed and reported errors and changes cover the true values.

use crate::support::{STEPS, Sandbox, acceptance, quick_pair};

/// The value in pF and the relative error that are printed in the line of a quantity.
fn printed(stdout: &str, name: &str) -> [f64; 2] {
    let line =
        stdout.lines().find(|line| line.trim_start().starts_with(name)).expect("a line of the quantity");
    let words: Vec<&str> = line.split_whitespace().collect();
    let [.., value, "pF", error] = words.as_slice() else { panic!("{line}") };
    [value, error].map(|word| word.parse().expect("a number"))
}

#[test]
fn the_printed_error_of_a_round_gap_covers_its_flat_faces() {
    let sandbox = Sandbox::new();
    let output = sandbox
        .run(&acceptance("found3/facets-not-in-printed-error.toml"), &["--no-fields", "--no-scene"])
        .exits_with(0);
    // 2 pi eps0 h / ln(3.1 / 3)
    let right = 3.393_279;
    let [value, error] = printed(&output.stdout, "two-terminal");
    assert!((value - right).abs() <= error * value, "{}", output.stdout);
    let row = sandbox.json("out/result.json");
    let number = |key: &str| row[key].as_f64().expect("a number");
    let sum = number("relative_error_estimate") + number("geometry_error_estimate");
    assert!((error / sum - 1.0).abs() < 0.05, "{error} {sum}");
    assert!(sandbox.read("out/report.html").contains("the estimated error of flat faces"));
}

#[test]
fn a_report_names_no_direction_of_a_change_that_its_bounds_leave_open() {
    let lead_of = |text: &str| {
        let sandbox = Sandbox::new();
        let case = sandbox.case("case.toml", text);
        sandbox.run(&case, &["--no-fields", "--no-scene", "--quiet"]).exits_with(0);
        let page = sandbox.read("out/report.html");
        let (_, rest) = page.split_once("<p class=\"lead\">").expect("a lead");
        rest.split_once("</p>").expect("its end").0.to_owned()
    };
    let lead = |loads: &str| lead_of(&quick_pair(STEPS, loads));
    let small = lead("compression = [0.0, 1e-4]");
    assert!(small.contains("it is not known whether it falls or rises"), "{small}");
    assert!(!small.contains("falls by") && !small.contains("rises by"), "{small}");
    // The model of the layer leaves the sign open: for so short a pair, three dimensions give a change of the
    // other sign.
    let large = lead("compression = [0.0, 0.4]");
    assert!(large.contains("it is not known whether it falls or rises"), "{large}");
    // Plates on both faces come closer in every model.
    let text = quick_pair(STEPS, "compression = [0.0, 0.4]");
    let (before, rest) = text.split_once("[electrodes.in_plane_pair]").expect("a pair");
    let (_, after) = rest.split_once("[mechanics").expect("mechanics");
    let plate = |name: &str, at: &str, attached: &str| {
        format!(
            "[[conductor]]\nname = \"{name}\"\n{attached}sheet = {{ normal = \"x2\", at = \"{at}\", min = [\"-0.3 mm\", \"-0.3 mm\"], \
             max = [\"0.3 mm\", \"0.3 mm\"] }}\n"
        )
    };
    let lower = plate("lower", "0 um", "");
    let upper = plate("upper", "450 um", "attached = \"layer-top\"\n");
    let plates = format!("{before}{lower}{upper}[mechanics{after}").replace(
        "below       = \"insulated\"",
        "below = { relative_permittivity = 1.0, thickness = \"1 mm\" }",
    );
    let rises = lead_of(&plates);
    assert!(rises.contains("it rises by") && rises.contains("between"), "{rises}");
}

#[test]
fn only_steps_that_are_shifted_or_tilted_have_columns_for_it() {
    let text = std::fs::read_to_string(
        std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("cases/quadrants.toml"),
    )
    .expect("the case");
    let (before, rest) = text.split_once("[load]").expect("a load");
    let (_, after) = rest.split_once("[surroundings]").expect("surroundings");
    let head = |steps: &str| {
        let sandbox = Sandbox::new();
        let text = format!("{before}[load]\nsteps = [{steps}]\n[surroundings]{after}")
            .replace("relative_tolerance = 1e-2", "relative_tolerance = 2e-1");
        let output =
            sandbox.run(&sandbox.case("case.toml", &text), &["--no-fields", "--no-scene"]).exits_with(0);
        output.stdout
    };
    let shifted = head("{ force = \"1 N\" }, { force = \"1 N\", shift = [\"-100 um\", \"0 um\"] }");
    assert!(shifted.contains("shift x1") && shifted.contains("-100 um"), "{shifted}");
    assert!(!shifted.contains("shift x3") && !shifted.contains("tilt"), "{shifted}");
    let plain = head("{ force = \"0 N\" }, { force = \"1 N\" }");
    assert!(!plain.contains("shift") && !plain.contains("tilt"), "{plain}");
}
