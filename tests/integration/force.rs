//! Compares `elastocap force` with capacitances computed directly at random forces.

use crate::support::{STEPS, Sandbox, acceptance, quick_pair};

/// Three sensors: their case files, and the largest drawn force in N, which is below that of the last step of
/// their curves.
const SENSORS: [(&str, f64); 3] =
    [("in-plane-pair.toml", 0.25), ("stacked-pair.toml", 40.0), ("pair-in-soft-layer", 0.033)];

/// The case without its loads.
fn unloaded(name: &str) -> String {
    let file = if name == "pair-in-soft-layer" { "in-plane-pair.toml" } else { name };
    let text = std::fs::read_to_string(acceptance(file)).expect("the acceptance files");
    let (before, rest) = text.split_once("[load]").expect("a load");
    let (_, after) = rest.split_once("[surroundings]").expect("surroundings");
    let text = format!("{before}[surroundings]{after}");
    if name != "pair-in-soft-layer" {
        return text;
    }
    // Another elastomer and permittivity, electrodes that are closer together, longer and lower, and grounded
    // walls.
    let mut text = text;
    for (from, to) in [
        ("c10 = \"682.15 Pa\"", "c10 = \"5 kPa\""),
        ("c01 = \"43931.9 Pa\"", "c01 = \"1 kPa\""),
        ("relative_permittivity = 2.8", "relative_permittivity = 4.0"),
        ("gap           = \"50 um\"", "gap           = \"25 um\""),
        ("height        = \"225 um\"", "height        = \"100 um\""),
        ("\"1 MPa\"", "\"rigid\""),
        ("boundary    = \"insulated\"", "boundary    = \"grounded\""),
    ] {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    text
}

/// Numbers between 0 and 1, the same at each run.
fn random() -> impl FnMut() -> f64 {
    let mut state = 7_u64;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// The environment variable FORCE_VALUES is the number of forces for each sensor; docs/answers.md has the
/// table of 100.
#[test]
fn the_true_force_lies_in_the_interval_of_a_measured_capacitance() {
    let from_environment = std::env::var("FORCE_VALUES").ok().and_then(|text| text.parse::<usize>().ok());
    let values = from_environment.unwrap_or(6).max(1);
    let mut random = random();
    println!("| sensor | values | true force in the interval | in the enclosure | median width over force |");
    println!("|---|---|---|---|---|");
    for (name, largest) in SENSORS {
        let sandbox = Sandbox::new();
        let text = unloaded(name);
        let curve = format!("{text}\n[load]\ncompression = {{ from = 0.0, to = 0.4, points = 9 }}\n");
        let options = ["--no-fields", "--no-scene", "--quiet"];
        sandbox.run(&sandbox.case("curve.toml", &curve), &options).exits_with(0);
        std::fs::rename(sandbox.path("out"), sandbox.path("curve")).expect("the curve is kept");
        // Equal numbers of small and of large forces.
        let forces: Vec<f64> = (0..values).map(|_| largest * random().powi(2)).collect();
        let listed: Vec<String> = forces.iter().map(|force| format!("\"{force:e} N\"")).collect();
        let direct = format!("{text}\n[load]\nforce = [{}]\n", listed.join(", "));
        sandbox.run(&sandbox.case("direct.toml", &direct), &options).exits_with(0);
        let table = sandbox.table("out/curve.csv");
        let [lower, upper] = ["capacitance_lower_f", "capacitance_upper_f"].map(|key| table.numbers(key));
        let (mut inside, mut enclosed, mut widths) = (0, 0, Vec::new());
        for (k, force) in forces.iter().enumerate() {
            let true_value = 0.5 * (lower[k] + upper[k]);
            // The direct value has bounds, too. A third of the measurements has no further error.
            let noise = [0.0, 1e-3, 1e-2][k % 3] * true_value;
            let measured = true_value + noise * (2.0 * random() - 1.0);
            let error = noise + 0.5 * (upper[k] - lower[k]);
            let argument = format!("{measured:e} F +- {error:e} F");
            let output =
                sandbox.elastocap(&["force", "curve", "--capacitance", &argument, "--json"]).exits_with(0);
            let answer: serde_json::Value = serde_json::from_str(&output.stdout).expect("JSON");
            let number = |value: &serde_json::Value| value.as_f64().expect("a number");
            let [low, high] = ["force_lower_n", "force_upper_n"].map(|key| number(&answer[key]));
            let [least, most] = [0, 1].map(|end| number(&answer["enclosure_n"][end]));
            inside += usize::from(low <= *force && *force <= high);
            enclosed += usize::from(least <= *force && *force <= most);
            widths.push((high - low) / force);
        }
        widths.sort_by(f64::total_cmp);
        println!("| {name} | {values} | {inside} | {enclosed} | {:.3} |", widths[values / 2]);
        assert_eq!([inside, enclosed], [values; 2], "{name}");
    }
}

#[test]
fn a_force_is_printed_with_its_limits_and_what_they_come_from() {
    let sandbox = Sandbox::new();
    sandbox.run(&sandbox.case("pair.toml", &quick_pair(STEPS, STEPS)), &["--no-fields"]).exits_with(0);
    let ask = |result: &str, capacitance: &str, status| {
        sandbox.elastocap(&["force", result, "--capacitance", capacitance]).exits_with(status)
    };
    let output = ask("out", "41.2fF+-0.05fF", 0);
    for words in
        ["41.200 fF +- 50 aF", "with all errors", "of the measurement", "of the curve", "interpolation"]
    {
        assert!(output.stdout.contains(words), "{words}: {}", output.stdout);
    }
    assert!(output.stderr.contains("those of the model of the layer"), "{}", output.stderr);
    assert_eq!(ask("out/result.json", "41.2 fF \u{b1} 0.05 fF", 0).stdout, output.stdout);
    for (result, capacitance, words) in [
        ("out", "90fF+-0.05fF", "no force on the curve gives 90.000 fF"),
        ("out", "32.6fF+-1fF", "add a step with a larger load"),
        ("out", "41.2", "has no unit"),
        ("out", "41.2mN", "is a force"),
        ("out/curve.csv", "41.2fF", "is not the result.json of a run"),
        ("nowhere", "41.2fF", "name the output folder of a run"),
    ] {
        let output = ask(result, capacitance, 2);
        assert!(output.stderr.contains(words), "{words}: {}", output.stderr);
        assert_eq!(output.stdout, "");
    }
}

#[test]
fn results_without_one_monotonic_curve_are_refused() {
    let sandbox = Sandbox::new();
    let cube = acceptance("cube-in-cube.toml");
    sandbox.run(&cube, &["--no-fields"]).exits_with(0);
    let output = sandbox.elastocap(&["force", "out", "--capacitance", "169pF"]).exits_with(2);
    assert!(output.stderr.contains("has no forces"), "{}", output.stderr);
    let step = |index: usize, force: f64, c: f64| {
        serde_json::json!({ "index": index, "force_n": force, "capacitance_f": c,
                            "capacitance_lower_f": c - 1e-17, "capacitance_upper_f": c + 1e-17 })
    };
    let mut result = serde_json::json!({
        "title": "made by hand", "status": "complete", "bounds": "proved",
        "measurement": { "kind": "mutual", "terminals": ["a", "b"] },
        "steps": [step(0, 0.0, 1e-15), step(1, 1.0, 2e-15), step(2, 2.0, 1.5e-15)],
    });
    let file = sandbox.case("turning.json", &result.to_string());
    let ask = || {
        let file = file.to_str().expect("UTF-8");
        sandbox.elastocap(&["force", file, "--capacitance", "1.2fF"]).exits_with(2).stderr
    };
    assert!(ask().contains("grows up to step 1 (1 N) and then falls"), "{}", ask());
    // Steps that differ in a shift are no curve of the force.
    result["plan"] = serde_json::json!({ "steps": [{}, { "pose": { "shift_m": [1e-4, 0.0] } }, {}] });
    sandbox.case("turning.json", &result.to_string());
    assert!(ask().contains("also shift or tilt what is attached"), "{}", ask());
    result["measurement"]["kind"] = "matrix".into();
    sandbox.case("turning.json", &result.to_string());
    assert!(ask().contains("name it in `[measure]`"), "{}", ask());
}

#[test]
fn stated_errors_of_force_and_mechanics_widen_the_interval() {
    let sandbox = Sandbox::new();
    let answer = |mechanics: f64, layer: f64| {
        let steps: Vec<_> = (0..6)
            .map(|k| {
                let force = f64::from(k);
                let c = (1.0 + 0.1 * force) * 1e-15;
                serde_json::json!({ "index": k, "force_n": force, "capacitance_f": c,
                                    "capacitance_lower_f": c, "capacitance_upper_f": c,
                                    "mechanics_error_estimate": mechanics,
                                    "layer": { "relative_error_estimate": layer } })
            })
            .collect();
        let result = serde_json::json!({
            "title": "made by hand", "status": "complete", "bounds": "proved", "steps": steps,
            "measurement": { "kind": "mutual", "terminals": ["a", "b"] },
        });
        sandbox.case("result.json", &result.to_string());
        let output =
            sandbox.elastocap(&["force", "result.json", "--capacitance", "1.25fF", "--json"]).exits_with(0);
        let answer: serde_json::Value = serde_json::from_str(&output.stdout).expect("JSON");
        ["force_lower_n", "force_upper_n"].map(|key| answer[key].as_f64().expect("a number"))
    };
    let near = |found: [f64; 2], expected: [f64; 2]| {
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 2e-3), "{found:?} {expected:?}");
    };
    near(answer(0.0, 0.0), [2.5, 2.5]);
    // One per cent of the larger neighbour, which is at 3 N.
    near(answer(0.0, 0.01), [2.47, 2.53]);
    // C (1 +- 0.01) with C = 1 + 0.1 F.
    near(answer(0.01, 0.0), [(1.25 / 1.01 - 1.0) * 10.0, (1.25 / 0.99 - 1.0) * 10.0]);
}

/// Four pads under a plate that rides on the layer, with these steps.
fn quadrants(steps: &[String]) -> String {
    let text = std::fs::read_to_string(
        std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("cases/quadrants.toml"),
    );
    let text = text.expect("the case");
    let (before, rest) = text.split_once("[load]").expect("a load");
    let (_, after) = rest.split_once("[surroundings]").expect("surroundings");
    format!("{before}[load]\nsteps = [{}]\n[surroundings]{after}", steps.join(", "))
        .replace("relative_tolerance = 1e-2", "relative_tolerance = 5e-2")
}

/// The environment variable LOAD_VALUES is the number of loads; docs/answers.md has the numbers of 100.
#[test]
fn four_quadrants_tell_force_and_shift_within_their_stated_deviations() {
    let from_environment = std::env::var("LOAD_VALUES").ok().and_then(|text| text.parse::<usize>().ok());
    let count = from_environment.unwrap_or(6).max(1);
    let sandbox = Sandbox::new();
    let step = |compression: f64, [x1, x3]: [f64; 2]| {
        format!("{{ compression = {compression}, shift = [\"{x1} um\", \"{x3} um\"] }}")
    };
    let mut steps = Vec::new();
    for compression in [0.05, 0.1, 0.15, 0.2] {
        for shift in [[0.0, 0.0], [-100.0, -100.0], [-100.0, 100.0], [100.0, -100.0], [100.0, 100.0]] {
            steps.push(step(compression, shift));
        }
    }
    let options = ["--no-fields", "--no-scene", "--quiet"];
    sandbox.run(&sandbox.case("table.toml", &quadrants(&steps)), &options).exits_with(0);
    std::fs::rename(sandbox.path("out"), sandbox.path("table")).expect("the table is kept");
    // The true loads.
    let mut random = random();
    let mut within = |low: f64, high: f64| low + (high - low) * random();
    let loads: Vec<(f64, [f64; 2])> =
        (0..count).map(|_| (within(0.05, 0.2), [within(-100.0, 100.0), within(-100.0, 100.0)])).collect();
    let direct: Vec<String> = loads.iter().map(|(compression, shift)| step(*compression, *shift)).collect();
    sandbox.run(&sandbox.case("direct.toml", &quadrants(&direct)), &options).exits_with(0);
    let result: serde_json::Value = serde_json::from_str(&sandbox.read("out/result.json")).expect("JSON");
    let pads = ["pad-1-1", "pad-1-2", "pad-2-1", "pad-2-2"];
    let number = |value: &serde_json::Value| value.as_f64().expect("a number");
    let (mut beyond, mut squares) = (0, [0.0; 3]);
    for (k, (_, shift)) in loads.iter().enumerate() {
        let found = &result["steps"][k];
        let noise = [0.0, 1e-3][k % 2];
        let mut arguments: Vec<String> = ["force", "table", "--json"].map(str::to_owned).to_vec();
        for (i, pad) in pads.iter().enumerate() {
            let diagonal = |key: &str| number(&found[key][i][i]);
            let value = diagonal("maxwell_matrix_f");
            let measured = value * (1.0 + noise * within(-1.0, 1.0));
            let error = noise * value
                + 0.5 * (diagonal("maxwell_matrix_upper_f") - diagonal("maxwell_matrix_lower_f"));
            arguments.extend(["-c".to_owned(), format!("{pad}={measured:e} F +- {error:e} F")]);
        }
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        let output = sandbox.elastocap(&arguments).exits_with(0);
        let answer: serde_json::Value = serde_json::from_str(&output.stdout).expect("JSON");
        let truth = [number(&found["force_n"]), 1e-6 * shift[0], 1e-6 * shift[1]];
        for (k, truth) in truth.into_iter().enumerate() {
            let quantity = &answer["load"][k];
            let off = (number(&quantity["value"]) - truth) / number(&quantity["standard_deviation"]);
            squares[k] += off * off / count as f64;
            beyond += usize::from(off.abs() > 3.0);
        }
        // The horizontal force belongs to the shift.
        let sideways = &answer["load"][3];
        assert_eq!(sideways["name"], "force along x1");
        let off = number(&sideways["value"]) - number(&found["force_x1_n"]);
        assert!(off.abs() <= 4.0 * number(&sideways["standard_deviation"]), "{answer} {found}");
    }
    println!(
        "{count} loads: {beyond} of {} beyond three deviations; mean squares over variance {squares:.2?}",
        3 * count
    );
    assert_eq!(beyond, 0);
}

#[test]
fn several_capacitances_without_names_or_with_unknown_ones_are_refused() {
    let sandbox = Sandbox::new();
    let matrix = |by: f64| serde_json::json!([[2e-12 + by, -1e-13], [-1e-13, 2e-12 - by]]);
    let step = |index: usize| {
        let by = 1e-14 * index as f64;
        serde_json::json!({ "index": index, "force_n": index, "maxwell_matrix_f": matrix(by),
                            "maxwell_matrix_lower_f": matrix(by), "maxwell_matrix_upper_f": matrix(by) })
    };
    let result = serde_json::json!({
        "title": "made by hand", "status": "complete", "conductors": ["a", "b/c"],
        "steps": (0..4).map(step).collect::<Vec<_>>(),
    });
    let file = sandbox.case("result.json", &result.to_string());
    let file = file.to_str().expect("UTF-8");
    let ask = |capacitances: &[&str], status| {
        let named = capacitances.iter().flat_map(|capacitance| ["--capacitance", capacitance]);
        sandbox.elastocap(&["force", file].into_iter().chain(named).collect::<Vec<_>>()).exits_with(status)
    };
    let output = ask(&["a=2.012pF+-1fF", "b/c=1.988pF+-1fF"], 0);
    assert!(output.stdout.contains("force  1.200 N +- "), "{}", output.stdout);
    assert!(ask(&["a=2.012pF+-1fF", "a/b/c=100fF+-1fF"], 0).stdout.contains("force  1.200 N"));
    for (capacitances, words) in [
        (&["2.012pF", "1.988pF"][..], "each needs the name of its terminal, such as a="),
        (&["a=2.012pF", "d=1.9pF"], "no terminal `d`; it has \"a\", \"b/c\""),
        (&["a/a=2.012pF"], "names one terminal twice"),
        (&["a=2.5pF"], "the force would be 50.00 N, and the steps of the result reach from 0 N to 3.000 N"),
        (&["a=2.012pF+-1fF", "b/c=2.012pF+-1fF"], "no load of the result has these capacitances together"),
        (&["a=2.012"], "has no unit"),
    ] {
        let output = ask(capacitances, 2);
        assert!(output.stderr.contains(words), "{words}: {}", output.stderr);
        assert_eq!(output.stdout, "");
    }
}
