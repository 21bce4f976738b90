//! Compares the curve between its steps, and its slope, at random steps with a dense curve of the same case.

use std::collections::BTreeMap;

use crate::support::{Sandbox, acceptance};

/// Replacements in a case file: each text, and the text in its place.
type Replaced = &'static [(&'static str, &'static str)];

/// Sensors: a name, the file, and the replacements in it.
const SENSORS: [(&str, &str, Replaced); 10] = [
    ("in-plane pair", "in-plane-pair.toml", &[]),
    ("stacked pair", "stacked-pair.toml", &[]),
    (
        "in-plane pair in a soft layer, grounded walls",
        "in-plane-pair.toml",
        &[
            ("\"682.15 Pa\"", "\"5 kPa\""),
            ("\"43931.9 Pa\"", "\"1 kPa\""),
            ("\"50 um\"", "\"25 um\""),
            ("\"225 um\"", "\"100 um\""),
            ("\"insulated\"        # outer", "\"grounded\"         # outer"),
        ],
    ),
    ("in-plane pair near the substrate", "in-plane-pair.toml", &[("\"225 um\"", "\"60 um\"")]),
    ("in-plane pair near the top", "in-plane-pair.toml", &[("\"225 um\"", "\"400 um\"")]),
    ("rigid in-plane pair", "in-plane-pair.toml", &[("\"1 MPa\"", "\"rigid\"")]),
    ("in-plane pair with a wide gap", "in-plane-pair.toml", &[("\"50 um\"", "\"150 um\"")]),
    ("stacked pair with a narrow gap", "stacked-pair.toml", &[("\"200 um\"", "\"60 um\"")]),
    (
        "stacked pair near the top",
        "stacked-pair.toml",
        &[("\"200 um\"", "\"100 um\""), ("\"225 um\"", "\"350 um\"")],
    ),
    (
        "stacked pair of short plates",
        "stacked-pair.toml",
        &[("length        = \"1 mm\"", "length        = \"300 um\"")],
    ),
];

/// The case with these compressions, between walls, which are quick to solve.
fn case((_, file, changes): (&str, &str, &[(&str, &str)]), tolerance: &str, compressions: &[f64]) -> String {
    let text = std::fs::read_to_string(acceptance(file)).expect("the acceptance files");
    let (before, rest) = text.split_once("[load]").expect("a load");
    let (_, after) = rest.split_once("[surroundings]").expect("surroundings");
    let mut text = format!("{before}[load]\ncompression = {compressions:?}\n[surroundings]{after}")
        .replace("boundary    = \"open\"", "boundary    = \"insulated\"\nside_margin = \"1 mm\"")
        .replace("thickness = \"open\"", "thickness = \"1 mm\"")
        .replace("relative_tolerance = 1e-3", &format!("relative_tolerance = {tolerance}"));
    for (from, to) in changes {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    text
}

/// Numbers between 0 and 1, the same at each run.
fn random() -> impl FnMut() -> f64 {
    let mut state = 11_u64;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// The derivative at `at` of the polynomial through points (x, y).
fn derivative(x: &[f64], y: &[f64], at: f64) -> f64 {
    let points = 0..x.len();
    let term = |i: usize| {
        let others = points.clone().filter(move |j| *j != i);
        let below: f64 = others.clone().map(|j| x[i] - x[j]).product();
        let above: f64 = others
            .clone()
            .map(|m| others.clone().filter(|j| *j != m).map(|j| at - x[j]).product::<f64>())
            .sum();
        y[i] * above / below
    };
    points.clone().map(term).sum()
}

/// A dense curve, by ascending compression.
struct Dense {
    compressions: Vec<f64>,
    forces: Vec<f64>,
    capacitances: Vec<f64>,
    /// Half of the distance between the bounds, F.
    errors: Vec<f64>,
}

impl Dense {
    fn of(sandbox: &Sandbox) -> Self {
        let table = sandbox.table("out/curve.csv");
        let [lower, upper] =
            ["capacitance_lower_f", "capacitance_upper_f"].map(|column| table.numbers(column));
        Self {
            compressions: table.numbers("compression"),
            forces: table.numbers("force_n"),
            capacitances: table.numbers("capacitance_f"),
            errors: lower.iter().zip(&upper).map(|(lower, upper)| 0.5 * (upper - lower)).collect(),
        }
    }

    /// dC/dF at a compression: both are smooth in the compression.
    fn slope(&self, at: f64) -> f64 {
        let after = self.compressions.partition_point(|x| *x < at);
        let first = after.saturating_sub(3).min(self.compressions.len() - 6);
        let window = first..first + 6;
        let [c, f] = [&self.capacitances, &self.forces]
            .map(|y| derivative(&self.compressions[window.clone()], &y[window.clone()], at));
        c / f
    }
}

/// The environment variable STEP_SETS is the number of sets of steps for each of ten sensors, with ten
/// readings each; the tables of docs/answers.md and docs/output.md are its output.
#[test]
fn force_and_slope_are_within_their_errors_at_random_steps() {
    let from_environment = std::env::var("STEP_SETS").ok().and_then(|text| text.parse::<usize>().ok());
    let (sets, sensors, tolerance, dense) = match from_environment {
        Some(sets) => (sets.max(1), SENSORS.len(), "1e-3", 60),
        None => (3, 2, "1e-2", 24),
    };
    let options = ["--no-fields", "--no-scene", "--quiet"];
    let mut random = random();
    let (mut all, mut inside, mut widths) = (0, 0, Vec::new());
    let (mut rows, mut known, mut covered, mut shares) = (0, 0, 0, Vec::new());
    println!(
        "| sensor | readings | inside | median width over force | over that of any monotonic curve | slopes | with an error | inside |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for sensor in SENSORS.into_iter().take(sensors) {
        let sandbox = Sandbox::new();
        let even: Vec<f64> =
            (0..=dense).map(|k| 0.42 * (f64::from(k) / f64::from(dense)).powf(1.5)).collect();
        sandbox.run(&sandbox.case("dense.toml", &case(sensor, tolerance, &even)), &options).exits_with(0);
        let truth = Dense::of(&sandbox);
        let before = (all, inside, rows, known, covered, widths.len());
        let mut narrower = Vec::new();
        for set in 0..sets {
            // Evenly spread, crowded at rest, and with a small first step; in random order, and with one load
            // twice.
            let power = [1.0, 4.0, 2.0][set % 3];
            let mut steps = vec![0.42];
            steps.extend((0..1 + set % 7).map(|_| 0.42 * random().powf(power)));
            if set % 3 == 2 {
                steps.push(4e-4);
            }
            steps.push(steps[steps.len() - 1]);
            steps.insert(1, 0.0);
            sandbox
                .run(&sandbox.case("steps.toml", &case(sensor, tolerance, &steps)), &options)
                .exits_with(0);
            for _ in 0..10 {
                let k = 1 + (random() * (truth.forces.len() - 2) as f64) as usize;
                // The dense curve has bounds too, and they lie around the same truth.
                let measured = format!("{:e} F +- {:e} F", truth.capacitances[k], truth.errors[k]);
                let output =
                    sandbox.elastocap(&["force", "out", "--capacitance", &measured, "--json"]).exits_with(0);
                let answer: serde_json::Value = serde_json::from_str(&output.stdout).expect("JSON");
                let number = |value: &serde_json::Value| value.as_f64().expect("a number");
                let [low, high] = ["force_lower_n", "force_upper_n"].map(|key| number(&answer[key]));
                let [least, most] = [0, 1].map(|end| number(&answer["enclosure_n"][end]));
                let force = truth.forces[k];
                all += 1;
                inside += usize::from(low <= force && force <= high);
                widths.push((high - low) / force);
                narrower.push((high - low) / (most - least));
            }
            let table = sandbox.table("out/curve.csv");
            let compressions = table.numbers("compression");
            let slopes = table.texts("sensitivity_f_per_n");
            let errors = table.texts("sensitivity_error_f_per_n");
            // Rows of one load have one slope.
            let mut of_load: BTreeMap<String, &str> = BTreeMap::new();
            for ((compression, slope), error) in compressions.iter().zip(&slopes).zip(&errors) {
                assert_eq!(of_load.entry(compression.to_string()).or_insert(slope), slope);
                rows += 1;
                // Where the errors leave the sign open and none is stated, there is no slope.
                let Ok(slope) = slope.parse::<f64>() else { continue };
                let Ok(error) = error.parse::<f64>() else { continue };
                known += 1;
                let exact = truth.slope(*compression);
                covered += usize::from((slope - exact).abs() <= error);
                shares.push(error / exact.abs());
            }
        }
        let of_sensor = &mut widths[before.5..];
        of_sensor.sort_by(f64::total_cmp);
        narrower.sort_by(f64::total_cmp);
        println!(
            "| {} | {} | {} | {:.2} | {:.2} | {} | {} | {} |",
            sensor.0,
            all - before.0,
            inside - before.1,
            of_sensor[of_sensor.len() / 2],
            narrower[narrower.len() / 2],
            rows - before.2,
            known - before.3,
            covered - before.4,
        );
    }
    widths.sort_by(f64::total_cmp);
    shares.sort_by(f64::total_cmp);
    println!(
        "readings: {inside} of {all}, median width {:.2}; slopes: {covered} of {known} with an error, of {rows}, median error {:.2}",
        widths[all / 2],
        shares[known / 2]
    );
    assert!(inside as f64 >= 0.99 * all as f64, "{inside} of {all}");
    assert!(covered as f64 >= 0.99 * known as f64, "{covered} of {known}");
}

#[test]
fn a_small_first_step_does_not_narrow_what_a_large_one_leaves_open() {
    let sandbox = Sandbox::new();
    let text = case(SENSORS[0], "1e-2", &[0.0, 5e-4, 0.4]);
    sandbox.run(&sandbox.case("case.toml", &text), &["--no-fields", "--no-scene", "--quiet"]).exits_with(0);
    let output = sandbox.elastocap(&["force", "out", "-c", "39.1492fF", "--json"]).exits_with(0);
    let answer: serde_json::Value = serde_json::from_str(&output.stdout).expect("JSON");
    let [low, high] = ["force_lower_n", "force_upper_n"].map(|key| answer[key].as_f64().expect("a number"));
    // A step solved at this force has this capacitance.
    assert!(low <= 0.0831 && 0.0831 <= high, "{answer}");
    assert!(answer["interpolation_error_f"].is_null(), "{answer}");
}

#[test]
fn the_slope_at_rest_is_within_its_error_with_repeated_and_unordered_forces_and_three_leave_its_sign_open() {
    let slopes = |name: &str| {
        let sandbox = Sandbox::new();
        let case = acceptance(&format!("found3/sensitivity-{name}-steps.toml"));
        sandbox.run(&case, &["--no-fields", "--no-scene", "--quiet"]).exits_with(0);
        sandbox.table("out/curve.csv")
    };
    // As steps of 1 and 2 mN say.
    let table = slopes("four");
    let first = |name: &str| -> f64 { table.texts(name)[0].parse().expect("a number") };
    let (slope, error) = (first("sensitivity_f_per_n"), first("sensitivity_error_f_per_n"));
    assert!((slope + 1.2293e-13).abs() <= error, "{slope:e} {error:e}");
    // The model error exceeds the change, and so the slope.
    let (changes, errors) = (table.numbers("change_f"), table.numbers("change_total_error_f"));
    let shares = changes.iter().zip(&errors).skip(1).map(|(change, error)| error / change.abs());
    let share = shares.fold(0.0, f64::max);
    assert!(
        share > 1.0 && error >= slope.abs() && error < (1.5 + 2.0 * share) * slope.abs(),
        "{error:e}, {share}"
    );
    // Three forces do not determine the stiffness of the layer at rest, so that no error would show that the
    // sign is open.
    assert_eq!(slopes("three").texts("sensitivity_f_per_n")[0], "");
}
