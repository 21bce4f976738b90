//! Measures how often 95 % intervals contain the truth.

use elastocap_case::Correction;
use elastocap_fitting::fit::fit_with;

use crate::support::{curves, free, normal, pair, points, with_noise};

/// The environment variable FIT_TRIALS sets the number of fits; docs/fits.md has the output for 100.
#[test]
fn intervals_of_95_percent_hold_the_truth_in_about_95_of_100_trials() {
    let from_environment = std::env::var("FIT_TRIALS").ok().and_then(|text| text.parse::<usize>().ok());
    let trials = from_environment.unwrap_or(20).max(1);
    let text = pair("1e-3");
    let shared = curves(&text);
    // The truth has a step between any two of the fitted curve, so that interpolation errors are tested as
    // well.
    let truth = Correction { offset: 4e-3, parasitic: 12e-15, gain: 1.0 };
    let values = [
        ("layer.material.neo_hookean.shear_modulus", "\"60 kPa\"".to_owned()),
        ("load.compression", "{ from = 0.0, to = 0.4, points = 17 }".to_owned()),
    ];
    let exact = points(&shared, &values, (0..24).map(|k| 0.01 * f64::from(k)), truth);
    let parameters = free(
        &text,
        &["layer.material.neo_hookean.shear_modulus=10kPa..1MPa", "parasitic", "offset=-20mN..20mN"],
        &exact,
    );
    let true_values = [60e3, truth.parasitic, truth.offset];
    let mut random = normal(11);
    let mut held = [0; 3];
    for _ in 0..trials {
        let noisy = with_noise(&exact, 0.1e-15, &mut random);
        let found = fit_with(&shared, &parameters, &noisy).unwrap();
        assert!(found.converged, "{:?}", found.findings);
        for (k, parameter) in found.parameters.iter().enumerate() {
            let [low, high] = parameter.interval_95.unwrap();
            held[k] += usize::from(low <= true_values[k] && true_values[k] <= high);
        }
    }
    println!("| parameter | intervals that hold the truth, of {trials} |");
    println!("|---|---|");
    for (parameter, held) in parameters.iter().zip(held) {
        println!("| {} | {held} |", parameter.name);
        let share = held as f64 / trials as f64;
        assert!(share >= if trials >= 100 { 0.9 } else { 0.8 }, "{}: {share}", parameter.name);
        assert!(trials < 100 || share <= 0.99, "{}: {share}", parameter.name);
    }
    let effort = shared.effort();
    assert!(effort.curves_solved <= 2 && effort.curves_shared > trials, "{effort:?}");
}
