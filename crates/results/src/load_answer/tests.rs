use super::table::LoadStep;
use super::*;

/// Four capacitances at a force and two shifts, F: their sum depends on the force, their differences on the
/// shifts.
fn capacitances([force, x1, x3]: [f64; 3]) -> [f64; 4] {
    let sum = 4e-12 * (1.0 + 0.1 * force + 0.02 * force * force);
    let [along, across] = [x1, x3].map(|x| 3e-9 * x * (1.0 + 0.2 * force));
    [sum - along - across, sum - along + across, sum + along - across, sum + along + across]
}

fn step(load: [f64; 3], spread: f64) -> LoadStep {
    let c = capacitances(load);
    let matrix =
        |by: f64| (0..4).map(|i| (0..4).map(|j| if i == j { c[i] + by } else { -1e-13 }).collect()).collect();
    LoadStep {
        load: [load[0], load[1], load[2], 0.0, 0.0],
        sideways: Some([2e3 * load[1], 2e3 * load[2]]),
        maxwell: [matrix(-spread), matrix(0.0), matrix(spread)],
    }
}

fn table(spread: f64) -> LoadTable {
    let mut steps = Vec::new();
    for force in [0.0, 0.5, 1.0, 1.5, 2.0] {
        for x1 in [-1e-4, 0.0, 1e-4] {
            for x3 in [-1e-4, 0.0, 1e-4] {
                steps.push(step([force, x1, x3], spread));
            }
        }
    }
    let terminals = ["a", "b", "c", "d"].map(str::to_owned).to_vec();
    LoadTable { title: "quadrants".into(), terminals, steps }
}

fn measured(values: [f64; 4], error: f64) -> Vec<MeasuredEntry> {
    let entry = |(terminal, value)| MeasuredEntry {
        terminal,
        other: None,
        capacitance: MeasuredCapacitance { value, error },
    };
    values.into_iter().enumerate().map(entry).collect()
}

#[test]
fn exact_capacitances_tell_force_shift_and_shear() {
    let load = [1.3, -4e-5, 7e-5];
    let answer = table(0.0).load(&measured(capacitances(load), 1e-18)).unwrap();
    let names: Vec<_> = answer.quantities.iter().map(|quantity| quantity.name).collect();
    assert_eq!(names, ["force", "shift along x1", "shift along x3", "force along x1", "force along x3"]);
    let expected = [load[0], load[1], load[2], 2e3 * load[1], 2e3 * load[2]];
    for (found, expected) in answer.quantities.iter().zip(expected) {
        assert!((found.value / expected - 1.0).abs() < 1e-5, "{found:?} {expected}");
    }
    assert_eq!(answer.to_spare, 1);
}

#[test]
fn the_deviation_is_that_of_answers_to_measurements_with_noise() {
    let (table, load, error) = (table(0.0), [0.8, 3e-5, -2e-5], 1e-15);
    let mut state = 3_u64;
    let mut random = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let exact = table.load(&measured(capacitances(load), error)).unwrap();
    let mut sums = [0.0; 3];
    const COUNT: usize = 200;
    for _ in 0..COUNT {
        let noisy = capacitances(load).map(|c| c + error * (2.0 * random() - 1.0));
        let answer = table.load(&measured(noisy, error)).unwrap();
        for (k, sum) in sums.iter_mut().enumerate() {
            *sum += (answer.quantities[k].value - load[k]).powi(2) / COUNT as f64;
        }
    }
    for (k, sum) in sums.iter().enumerate() {
        let ratio = sum.sqrt() / exact.quantities[k].deviation;
        assert!((0.85..1.15).contains(&ratio), "{k}: {ratio}");
    }
    // The two shifts come from different differences.
    let [variance, covariance] = [exact.covariance[1][1], exact.covariance[1][2]];
    assert!(covariance.abs() < 0.05 * variance);
}

#[test]
fn wide_bounds_make_the_deviation_wide() {
    let [narrow, wide] = [0.0, 2e-14].map(|spread| {
        table(spread).load(&measured(capacitances([1.0, 0.0, 0.0]), 1e-15)).unwrap().quantities[0].deviation
    });
    assert!((wide / narrow - (1.0_f64 + 400.0).sqrt()).abs() < 0.1 * wide / narrow, "{narrow} {wide}");
}

#[test]
fn what_does_not_tell_a_load_is_refused() {
    let whole = table(0.0);
    let ask = |values: [f64; 4]| whole.load(&measured(values, 1e-15));
    let far = ask(capacitances([3.5, 0.0, 0.0]));
    assert!(matches!(far, Err(NoLoad::Outside { name: "force", .. })), "{far:?}");
    let mut wrong = capacitances([1.0, 5e-5, 0.0]);
    wrong[0] *= 1.1;
    assert!(matches!(ask(wrong), Err(NoLoad::NoFit(_))), "{:?}", ask(wrong));
    let two = measured(capacitances([1.0, 0.0, 0.0]), 1e-15)[..2].to_vec();
    assert!(matches!(whole.load(&two), Err(NoLoad::TooFewMeasured { measured: 2, unknown: 3, .. })));
    let few = LoadTable { steps: whole.steps[..4].to_vec(), ..whole.clone() };
    let at_rest = measured(capacitances([0.0, 0.0, 0.0]), 1e-15);
    assert!(
        matches!(few.load(&at_rest), Err(NoLoad::TooFewSteps { steps: 4, .. })),
        "{:?}",
        few.load(&at_rest)
    );
    let one = LoadTable { steps: whole.steps[..1].to_vec(), ..whole.clone() };
    assert_eq!(one.load(&at_rest), Err(NoLoad::OneLoad));
    // The sum of all capacitances does not depend on the shifts.
    let same: Vec<MeasuredEntry> = (0..3).map(|_| at_rest[0].clone()).collect();
    assert!(matches!(whole.load(&same), Err(NoLoad::NotDetermined(_))), "{:?}", whole.load(&same));
}
