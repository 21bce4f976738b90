//! Tests of measured points over a curve, of `elastocap fit` and of `elastocap optimise`.

use crate::support::Sandbox;

/// The case of the documentation at a large tolerance, with points of its curve for 70 kPa and a parasitic
/// capacitance of 3 fF.
fn with_points(sandbox: &Sandbox) -> String {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/cases/fits/pair.toml");
    let text = std::fs::read_to_string(path).expect("the case");
    let text = text.replace("relative_tolerance = 1e-3", "relative_tolerance = 0.02");
    let (unmeasured, _) = text.split_once("[measurement]").expect("measured points");
    let truth = unmeasured.replace("90 kPa", "70 kPa");
    let case = sandbox.case("truth.toml", &truth);
    sandbox.run(&case, &["--no-fields", "--no-scene", "--quiet"]).exits_with(0);
    let table = sandbox.table("out/curve.csv");
    let mut points = "force_mn,capacitance_ff\n".to_owned();
    // Without the last step: a fitted curve that ends a little earlier still reaches all points.
    let steps = table.numbers("force_n").len() - 1;
    let pairs = table.numbers("force_n").into_iter().zip(table.numbers("capacitance_f"));
    for (k, (force, c)) in pairs.take(steps).enumerate() {
        // Noise that the fit has to average over.
        let noise = if k % 2 == 0 { 0.02 } else { -0.02 };
        points.push_str(&format!("{},{}\n", 1e3 * force, 1e15 * c + 3.0 + noise));
    }
    sandbox.case("pair.csv", &points);
    std::fs::remove_dir_all(sandbox.path("out")).expect("the results");
    sandbox.case("pair.toml", &text);
    text
}

#[test]
fn a_fit_finds_what_made_the_points_and_a_run_of_the_fitted_case_explains_them() {
    let sandbox = Sandbox::new();
    with_points(&sandbox);
    // Before the fit the curve misses the points.
    let run =
        sandbox.elastocap(&["run", "pair.toml", "-o", "before", "--no-fields", "--no-scene"]).exits_with(0);
    assert!(run.stdout.contains("measured: ") && run.stdout.contains("within the error"), "{}", run.stdout);
    let before = sandbox.json("before/result.json");
    let rms = before["measured_points"]["rms_residual_f"].as_f64().expect("residuals");
    assert!(rms > 2e-15, "{rms}");
    let svg = sandbox.read("before/curve.svg");
    assert!(svg.contains("measured, pair.csv") && svg.contains("measured less computed"));

    let fit = [
        "fit",
        "pair.toml",
        "--free",
        "layer.material.neo_hookean.shear_modulus=10kPa..1MPa",
        "--free",
        "parasitic",
        "-o",
        "fitted.toml",
    ];
    let output = sandbox.elastocap(&fit).exits_with(0);
    assert!(
        output.stdout.contains("95 % interval") && output.stdout.contains("correlations"),
        "{}",
        output.stdout
    );
    let refused = sandbox.elastocap(&fit).exits_with(2);
    assert!(refused.stderr.contains("is there already"), "{}", refused.stderr);
    let json = sandbox.elastocap(&[&fit[..6], &["--json"]].concat()).exits_with(0);
    let found: serde_json::Value = serde_json::from_str(&json.stdout).expect("JSON");
    let parameter = |k: usize| &found["fit"]["parameters"][k];
    let [low, high] = [0, 1].map(|k| parameter(0)["interval_95"][k].as_f64().expect("an interval"));
    assert!(low < 70e3 && 70e3 < high && high - low < 10e3, "{low} {high}");
    assert!((parameter(1)["value"].as_f64().expect("a value") - 3e-15).abs() < 0.2e-15);
    assert!(found["fit"]["effort"]["curves_shared"].as_u64().expect("a number") > 3);

    let fitted = sandbox.read("fitted.toml");
    assert!(fitted.contains("# a first guess") && fitted.contains("parasitic = "), "{fitted}");
    assert!(sandbox.read("fitted.svg").contains("where the fit began"));
    sandbox
        .elastocap(&["run", "fitted.toml", "-o", "after", "--no-fields", "--no-scene", "--quiet"])
        .exits_with(0);
    let after = sandbox.json("after/result.json");
    assert_eq!(after["measured_points"]["fraction_within_error"], 1.0);
    assert!(after["measured_points"]["rms_residual_f"].as_f64().expect("residuals") < 0.1e-15);
}

#[test]
fn what_cannot_be_fitted_is_refused_before_anything_is_solved() {
    let sandbox = Sandbox::new();
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/cases/fits/pair.toml");
    let text = std::fs::read_to_string(path).expect("the case");
    sandbox.case("pair.toml", &text);
    let missing = sandbox.elastocap(&["check", "pair.toml"]).exits_with(2);
    assert!(
        missing.stderr.contains("cannot use the measured points") && missing.stderr.contains("pair.toml"),
        "{}",
        missing.stderr
    );
    sandbox.case("pair.csv", "force_mn,capacitance_ff\n0,44\n10,forty\n");
    let broken = sandbox.elastocap(&["check", "pair.toml"]).exits_with(2);
    assert!(broken.stderr.contains("pair.csv:3: \"forty\""), "{}", broken.stderr);
    sandbox.case("pair.csv", "force_mn,capacitance_ff\n0,44\n10,43\n20,42\n");
    sandbox.elastocap(&["check", "pair.toml", "--quiet"]).exits_with(0);
    for (free, words) in [
        ("layer.thicknes=1mm..2mm", "thickness"),
        ("layer.thickness=1kPa..2kPa", "a length"),
        ("layer.half_length", "no number at"),
        ("nothing", "no number at"),
    ] {
        let output = sandbox.elastocap(&["fit", "pair.toml", "--free", free]).exits_with(2);
        assert!(output.stderr.contains(words), "{free}: {}", output.stderr);
    }
    let unmeasured = text.split("[measurement]").next().expect("a case");
    sandbox.case("bare.toml", unmeasured);
    let output = sandbox.elastocap(&["fit", "bare.toml", "--free", "parasitic"]).exits_with(2);
    assert!(output.stderr.contains("[measurement]"), "{}", output.stderr);
}

#[test]
fn an_optimum_keeps_its_limits_and_is_written_as_a_case() {
    let sandbox = Sandbox::new();
    let text = with_points(&sandbox);
    let unmeasured = text.split("[measurement]").next().expect("a case").to_owned();
    sandbox.case("pair.toml", &unmeasured);
    // C0 falls with the gap, so that the largest gap within the limit is the optimum.
    let search = [
        "optimise",
        "pair.toml",
        "--vary",
        "electrodes.in_plane_pair.gap=30um..200um",
        "--minimise",
        "C at 0.05 N",
        "--subject",
        "C0 > 40fF",
        "--json",
    ];
    let output = sandbox.elastocap(&[&search[..], &["-o", "best.toml"]].concat()).exits_with(0);
    let found: serde_json::Value = serde_json::from_str(&output.stdout).expect("JSON");
    let c0 = found["best_limited"][0].as_f64().expect("C0");
    assert!((40e-15..40.8e-15).contains(&c0), "{c0}");
    assert!(sandbox.read("best.toml").contains("gap           = \""), "{}", sandbox.read("best.toml"));
    for (changed, words) in [
        (["--subject", "C0 > 1 mN"], "a force"),
        (["--subject", "C0 = 1 pF"], "no < or >"),
        (["--subject", "C at 0.2 > 1 fF"], "all compressions"),
    ] {
        let refused = sandbox.elastocap(&[&search[..6], &changed].concat()).exits_with(2);
        assert!(refused.stderr.contains(words), "{}", refused.stderr);
    }
    let open = ["optimise", "pair.toml", "--vary", "electrodes.in_plane_pair.gap", "--maximise", "C0"];
    let refused = sandbox.elastocap(&open).exits_with(2);
    assert!(refused.stderr.contains("needs a range"), "{}", refused.stderr);
}
