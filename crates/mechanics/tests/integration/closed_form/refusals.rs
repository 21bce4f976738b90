//! What is refused, and that the message says what and what to do.

use elastocap_mechanics::{
    ClosedFormSettings, ElectrodePose, ElectrodeStiffness, LayerMap, LayerState, MechanicsError,
    MooneyRivlin, compression_for_force, force_limit,
};

use super::support::{PAPER, equal_lengths};

/// The message of a refusal; fails if there was none.
#[track_caller]
fn refusal<T: std::fmt::Debug>(result: Result<T, MechanicsError>) -> String {
    result.unwrap_err().to_string()
}

#[track_caller]
fn assert_mentions(message: &str, parts: &[&str]) {
    for part in parts {
        assert!(message.contains(part), "\"{message}\" does not mention \"{part}\"");
    }
}

#[test]
fn a_compression_outside_zero_to_one_is_refused() {
    for compression in [1.0, 1.5, -1e-300, f64::NAN, f64::INFINITY] {
        let message = refusal(LayerState::new(1.0, PAPER, compression, equal_lengths(1.0)));
        assert_mentions(&message, &["compression U/H", &compression.to_string(), "0.2 for 20 %"]);
    }
    let largest = 1.0 - f64::EPSILON / 2.0;
    let layer = LayerState::new(1.0, PAPER, largest, equal_lengths(0.1)).unwrap();
    assert!(
        layer.force().is_finite() && layer.stress().cauchy([0.1, 0.5, 0.0]).iter().all(|s| s.is_finite())
    );
}

#[test]
fn lengths_and_moduli_that_are_not_positive_are_refused() {
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let good = equal_lengths(1.0);
        let state = |h, material, settings| refusal(LayerState::new(h, material, 0.1, settings));
        assert_mentions(&state(bad, PAPER, good), &["thickness of the layer", "positive", " m,"]);
        assert_mentions(&refusal(LayerMap::new(bad, 0.1)), &["thickness of the layer"]);
        let neo_hookean = MooneyRivlin::neo_hookean(bad);
        assert_mentions(&state(1.0, neo_hookean, good), &["shear modulus of the layer", " Pa,"]);
        let mooney_rivlin = MooneyRivlin { c10: 1.0, c01: bad - 1.0 };
        assert_mentions(&state(1.0, mooney_rivlin, good), &["2 (c10 + c01)"]);
        let contact = ClosedFormSettings { contact_half_length: bad, ..good };
        assert_mentions(&state(1.0, PAPER, contact), &["contact half-length"]);
        let width = ClosedFormSettings { contact_width: bad, ..good };
        assert_mentions(&state(1.0, PAPER, width), &["contact width"]);
        let shear = ClosedFormSettings { shear_length: bad, ..good };
        assert_mentions(&state(1.0, PAPER, shear), &["shear length"]);
        let map = LayerMap::new(1.0, 0.1).unwrap();
        let electrode = ElectrodePose::new(&map, 1.0, 0.5, ElectrodeStiffness::ShearModulus(bad));
        assert_mentions(&refusal(electrode), &["shear modulus of the electrode"]);
    }
}

#[test]
fn a_force_that_is_negative_or_not_a_number_is_refused() {
    for force in [-1e-300, f64::NEG_INFINITY, f64::INFINITY, f64::NAN] {
        let message = refusal(compression_for_force(1.0, PAPER, equal_lengths(1.0), force));
        assert_mentions(&message, &["force", &force.to_string(), "compression counts as positive"]);
    }
}

#[test]
fn a_force_beyond_the_model_is_refused_with_the_largest_it_has() {
    let limit = force_limit(1.0, PAPER, equal_lengths(1.0)).unwrap();
    let message = refusal(LayerState::under_force(1.0, PAPER, 1e12, equal_lengths(1.0)));
    assert_mentions(&message, &[&limit.force.to_string(), &limit.compression.to_string(), "lower the force"]);
}

#[test]
fn a_contact_too_long_for_its_shear_length_is_refused() {
    // The force starts as 3/2 + a^2/2 - b^2/6 with a = 1: the border is at b = sqrt(12).
    let settings =
        |b: f64| ClosedFormSettings { contact_half_length: b, contact_width: 1.0, shear_length: 1.0 };
    // Just inside it the force is nearly none, and its curvature is large beside it. With n^2 = 3 U + 3 U^2 +
    // ... in (45) and (50), and H = 1, the force goes as c0 n^2 + c1 n^4 and so as U (1 + k U), k = 1 + 3 c1
    // / c0.
    let b = 3.46_f64;
    let c0 = 2.0 - b * b / 6.0;
    let c1 = 0.35 + 5.0 / 12.0 - 7.0 / 36.0 * b * b;
    let expected = |u: f64| u * (1.0 + (1.0 + 3.0 * c1 / c0) * u);
    let [one, ten] = [1e-9, 1e-8].map(|u| LayerState::new(1.0, PAPER, u, settings(b)).unwrap().force());
    let far_inside = LayerState::new(1.0, PAPER, 1e-9, settings(1.0)).unwrap().force();
    // The parts of the force cancel but for c0, 1/420 of them: that is the rounding. The next power of U is
    // below it.
    let found = ten / one - expected(1e-8) / expected(1e-9);
    assert!(
        found.abs() < 1e-11 && 0.0 < one && one < 0.02 * far_inside,
        "{found:e} {one:e} {ten:e} {far_inside:e}"
    );
    let message = refusal(LayerState::new(1.0, PAPER, 0.1, settings(3.47)));
    assert_mentions(&message, &["contact half-length of 3.47 m", "make the shear length at least"]);
    refusal(force_limit(1.0, PAPER, settings(3.47)));
}

#[test]
fn an_electrode_outside_the_layer_is_refused() {
    let map = LayerMap::new(1.0, 0.1).unwrap();
    for height in [-1e-9, 1.001, f64::NAN] {
        let message = refusal(ElectrodePose::new(&map, 1.0, height, ElectrodeStiffness::Rigid));
        assert_mentions(&message, &["mid-plane", &height.to_string(), "between 0 and the thickness"]);
    }
}
