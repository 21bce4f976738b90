//! Conductors that are a hundred to ten thousand times as wide as thick, on tetrahedra.

use std::f64::consts::PI;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use elastocap_coupling::outcome::{Outcome, Status};
use elastocap_coupling::plan::{Options, Plan};
use elastocap_coupling::run::run;
use elastocap_electrostatics::{Bounded, VACUUM_PERMITTIVITY};

fn solved(text: &str) -> Outcome {
    let case = elastocap_case::parse(text, Path::new("test.toml")).unwrap_or_else(|e| panic!("{e}"));
    let options = Options { prune: true, fields: false, scene: false, model_error: false };
    let mut plan = Plan::new(&case, &options);
    plan.forecast(&case, &options);
    run(&case, &plan, &options, &Arc::new(AtomicBool::new(false)), &())
}

/// One of the files in tests/acceptance/found.
fn found(name: &str) -> Outcome {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/acceptance/found").join(name);
    solved(&std::fs::read_to_string(path).unwrap())
}

/// The two-terminal capacitance of a case of one step that meets its tolerance, F.
#[track_caller]
fn two_terminal(outcome: &Outcome) -> Bounded {
    let step = &outcome.steps[0];
    assert_eq!(step.row.status, Status::Ok, "{:?}", step.reason);
    let forecast = outcome.plan.unknowns as f64 / step.row.unknowns.unwrap() as f64;
    assert!(forecast > 0.4 && forecast < 2.5, "{} of {}", outcome.plan.unknowns, step.row.unknowns.unwrap());
    step.measured.unwrap()
}

#[test]
fn a_disc_of_a_hundredth_of_its_radius_is_known_to_a_hundredth() {
    let c = two_terminal(&found("thin-disc.toml"));
    let sheet = 8.0 * VACUUM_PERMITTIVITY * 5e-3;
    // Measured in another way to 1e-3: 358.29 fF.
    assert!(sheet < c.lower && c.lower < 358.5e-15 && c.upper > 358.1e-15, "{c:?}");
    assert!(c.upper - c.lower < 1e-2 * c.value);
}

#[test]
fn two_plates_with_arms_and_a_gap_of_a_thirtieth_are_known_to_a_twentieth() {
    let c = two_terminal(&found("mems-plates.toml"));
    let between_plates = VACUUM_PERMITTIVITY * 300e-6 * 300e-6 / 10e-6;
    assert!(c.lower > between_plates && c.upper < 1.25 * between_plates, "{c:?}");
    assert!(c.upper - c.lower < 5e-2 * c.value);
}

#[test]
fn a_plain_box_of_a_ten_thousandth_of_its_width_is_known_to_a_hundredth_on_tetrahedra() {
    let text = r#"
format = 1
title = "a thin plate"
[[conductor]]
name = "plate"
box = { min = ["0 mm", "0 mm", "0 mm"], max = ["10 mm", "1 um", "10 mm"] }
[surroundings]
boundary = "open"
[electrostatics]
relative_tolerance = 1e-2
solver = "tetrahedra"
"#;
    let c = two_terminal(&solved(text));
    let sheet = 0.366_789_2 * 4.0 * PI * VACUUM_PERMITTIVITY * 1e-2;
    assert!(c.lower < 1.002 * sheet && c.upper > sheet && c.upper - c.lower < 1e-2 * c.value, "{c:?}");
}
