//! Tests on curves that are known as formulas, so that the true force of any capacitance is known too.

use super::*;

/// Numbers between 0 and 1, the same at each run.
fn random(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// A formula for capacitance over force, or force over compression.
type Formula = fn(f64) -> f64;

/// Plates whose gap closes under a hardening spring, a decreasing fringing field, and a ball: its force grows
/// with the power 3/2 of the displacement, so that the curve begins vertically.
const SENSORS: [(&str, Formula); 3] = [
    ("closing plates", |force| 1.0 / (1.0 - 0.5 * force / (1.0 + force))),
    ("fringing pair", |force| 4.0 - force.sqrt().atan()),
    ("ball", |force| 1.0 + 0.3 * force.powf(2.0 / 3.0)),
];

/// Steps at which the curve is known to `spread`; the reported value lies anywhere between the bounds.
fn steps(formula: Formula, count: usize, spread: f64, random: &mut impl FnMut() -> f64) -> Vec<CurveStep> {
    (0..count)
        .map(|index| {
            // Denser at small forces, as steps of equal compression are.
            let force = 3.0 * (index as f64 / (count - 1) as f64).powf(1.5);
            let capacitance = formula(force);
            let lower = capacitance - spread * random();
            let upper = capacitance + spread * random();
            CurveStep {
                index,
                force,
                force_error: 0.0,
                capacitance: 0.5 * (lower + upper),
                lower,
                upper,
                estimated: 0.0,
            }
        })
        .collect()
}

#[test]
fn the_true_force_lies_in_the_interval_for_random_values_of_three_formulas() {
    let mut random = random(1);
    for (name, formula) in SENSORS {
        for (count, spread) in [(4, 1e-9), (7, 1e-9), (13, 1e-9), (7, 1e-3), (25, 1e-4)] {
            let curve = ForceCurve::new(steps(formula, count, spread, &mut random)).expect(name);
            let mut answered = 0;
            for k in 0..100 {
                let force = 3.0 * random();
                let error = [0.0, 1e-4, 1e-2][k % 3];
                let value = formula(force) + error * (2.0 * random() - 1.0);
                let answer = match curve.force(MeasuredCapacitance { value, error }) {
                    Ok(answer) => answer,
                    Err(NoForce::BeyondLast(_)) => continue,
                    Err(other) => panic!("{name}: {other}"),
                };
                answered += 1;
                let ForceAnswer { force_lower_n: low, force_upper_n: high, enclosure_n, .. } = answer;
                assert!(low <= force && force <= high, "{name}, {count} steps: {force} is not in {answer:?}");
                assert!(enclosure_n[0] <= low && high <= enclosure_n[1], "{name}: {answer:?}");
                assert!(low <= answer.force_n && answer.force_n <= high, "{name}: {answer:?}");
                for [part_low, part_high] in [answer.from_measurement_n, answer.from_curve_n] {
                    assert!(part_low <= part_high, "{name}: {answer:?}");
                }
            }
            assert!(answered > 85, "{name}: {answered}");
        }
    }
}

#[test]
fn more_steps_and_smaller_errors_make_the_interval_smaller() {
    let mut random = random(2);
    let (name, formula) = SENSORS[1];
    let mut width = |count, error| {
        let curve = ForceCurve::new(steps(formula, count, 1e-12, &mut random)).expect(name);
        let answer = curve.force(MeasuredCapacitance { value: formula(1.0), error }).expect(name);
        answer.force_upper_n - answer.force_lower_n
    };
    let [coarse, fine, noisy] = [width(6, 0.0), width(24, 0.0), width(24, 1e-2)];
    assert!(fine < 0.1 * coarse && coarse < 0.5, "{coarse} {fine}");
    // dC/dF is -1/4 at a force of 1.
    assert!((noisy / 0.08 - 1.0).abs() < 0.05, "{noisy}");
}

#[test]
fn an_error_of_the_steps_forces_widens_the_interval_by_as_much() {
    let mut random = random(3);
    let (name, formula) = SENSORS[0];
    let mut steps = steps(formula, 9, 1e-12, &mut random);
    let measured = MeasuredCapacitance { value: formula(1.0), error: 0.0 };
    let exact = ForceCurve::new(steps.clone()).expect(name).force(measured).expect(name);
    steps.iter_mut().for_each(|step| step.force_error = 0.02);
    let wide = ForceCurve::new(steps).expect(name).force(measured).expect(name);
    assert!((exact.force_lower_n - wide.force_lower_n - 0.02).abs() < 1e-12, "{exact:?} {wide:?}");
    assert!((wide.force_upper_n - exact.force_upper_n - 0.02).abs() < 1e-12, "{exact:?} {wide:?}");
    assert_eq!(exact.from_measurement_n, wide.from_measurement_n);
}

fn step(index: usize, force: f64, capacitance: f64) -> CurveStep {
    CurveStep {
        index,
        force,
        force_error: 0.0,
        capacitance,
        lower: capacitance - 0.01,
        upper: capacitance + 0.01,
        estimated: 0.0,
    }
}

#[test]
fn two_steps_give_what_holds_for_every_monotone_curve_and_no_more() {
    let curve = ForceCurve::new(vec![step(0, 0.0, 1.0), step(1, 2.0, 3.0)]).expect("a curve");
    let answer = curve.force(MeasuredCapacitance { value: 2.0, error: 0.1 }).expect("a force");
    assert_eq!([answer.force_lower_n, answer.force_upper_n], [0.0, 2.0]);
    assert_eq!((answer.force_n, answer.interpolation_error_f), (1.0, None));
}

#[test]
fn a_curve_that_turns_is_refused_where_it_turns() {
    let turning = |values: [f64; 4]| {
        let steps = values.iter().enumerate().map(|(k, c)| step(k, k as f64, *c)).collect();
        ForceCurve::new(steps).expect_err("a curve that turns").to_string()
    };
    for (values, words) in [
        ([1.0, 2.0, 3.0, 2.5], "grows up to step 2 (2 N) and then falls"),
        ([3.0, 2.0, 1.0, 1.5], "falls up to step 2 (2 N) and then grows"),
        ([1.0, 0.5, 2.0, 3.0], "falls up to step 1 (1 N) and then grows"),
        ([3.0, 3.5, 2.0, 1.0], "grows up to step 1 (1 N) and then falls"),
    ] {
        let message = turning(values);
        assert!(message.contains(words), "{message}");
    }
}

#[test]
fn steps_that_are_no_curve_are_refused() {
    let refused = |steps: Vec<CurveStep>| ForceCurve::new(steps).expect_err("no curve");
    assert_eq!(refused(vec![]), CurveError::TooFewSteps(0));
    assert_eq!(refused(vec![step(0, 1.0, 1.0), step(1, 1.0, 1.0)]), CurveError::TooFewSteps(1));
    assert_eq!(refused(vec![step(0, 0.0, 1.0), step(1, 1.0, 1.005)]), CurveError::Flat);
    assert_eq!(refused(vec![step(0, 0.0, 1.0), step(1, f64::NAN, 2.0)]), CurveError::Damaged(1));
    assert_eq!(refused(vec![step(0, 0.0, 1.0), step(4, -1.0, 2.0)]), CurveError::Damaged(4));
}

#[test]
fn a_value_beside_the_curve_is_refused_and_one_at_no_load_is_not() {
    let curve = |first: f64| {
        ForceCurve::new(vec![step(0, first, 3.0), step(1, 1.5, 2.0), step(2, 2.0, 1.0)]).expect("a curve")
    };
    let from_zero = |value, error| curve(0.0).force(MeasuredCapacitance { value, error });
    assert!(matches!(from_zero(3.2, 0.1), Err(NoForce::Outside { .. })));
    assert!(matches!(from_zero(0.8, 0.1), Err(NoForce::Outside { .. })));
    assert_eq!(from_zero(1.05, 0.1), Err(NoForce::BeyondLast(2.0)));
    let at_rest = from_zero(3.05, 0.1).expect("a force");
    assert_eq!((at_rest.force_n, at_rest.force_lower_n), (0.0, 0.0));
    assert!(at_rest.force_upper_n > 0.0);
    let pressed = |value| curve(0.5).force(MeasuredCapacitance { value, error: 0.1 });
    assert_eq!(pressed(2.95), Err(NoForce::BelowFirst(0.5)));
    assert!(pressed(2.5).is_ok());
}
