//! The change against the first load step, and the sensitivity.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use elastocap_case::{Case, FieldSolver, Load};
use elastocap_coupling::finished::FinishedStep;
use elastocap_coupling::outcome::{Missed, Outcome, Row, Status};
use elastocap_coupling::plan::{Options, Plan};
use elastocap_coupling::run::{Observer, run};

const NUMBERS_ONLY: Options = Options { prune: true, fields: false, scene: false, model_error: false };

/// The paper's pair at these compressions, each capacitance to 5 %, and the change to `change_tolerance`.
fn pair(steps: &[f64], change_tolerance: Option<f64>) -> Case {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/acceptance/in-plane-pair.toml");
    let mut case = elastocap_case::load(&path).unwrap_or_else(|e| panic!("{e}"));
    case.load = Some(Load::Compression(steps.to_vec()));
    let settings = case.electrostatics.as_mut().unwrap();
    (settings.relative_tolerance, settings.change_tolerance) = (0.05, change_tolerance);
    case
}

fn solve(case: &Case) -> Outcome {
    run(case, &Plan::new(case, &NUMBERS_ONLY), &NUMBERS_ONLY, &Arc::new(AtomicBool::new(false)), &())
}

fn bounds(row: &Row) -> [f64; 2] {
    [row.change_lower_f.unwrap(), row.change_upper_f.unwrap()]
}

#[test]
fn a_change_of_a_thousandth_is_proved_to_a_hundredth_of_itself() {
    let case = pair(&[0.0, 5e-4, 0.1], Some(1e-2));
    let outcome = solve(&case);
    assert!(outcome.is_complete(), "{:?}", outcome.steps.iter().map(|s| &s.reason).collect::<Vec<_>>());
    // By itself, and by the other solver, whose meshes and elements are different.
    let by = |solver: FieldSolver, tolerance: f64| {
        let mut case = pair(&[0.0, 5e-4, 0.1], None);
        let settings = case.electrostatics.as_mut().unwrap();
        (settings.solver, settings.relative_tolerance) = (Some(solver), tolerance);
        solve(&case)
    };
    let references = [by(FieldSolver::Boxes, 1e-6), by(FieldSolver::Extruded, 3e-4)];
    for (step, reference) in outcome.steps.iter().skip(1).flat_map(|s| references.iter().map(move |r| (s, r)))
    {
        let ([lower, upper], change) = (bounds(&step.row), step.row.change_f.unwrap());
        assert!(lower <= change && change <= upper && upper - lower <= 1e-2 * change.abs(), "{:?}", step.row);
        let [least, most] = bounds(&reference.steps[step.index].row);
        assert!(lower <= most && least <= upper, "[{lower:e}, {upper:e}] and [{least:e}, {most:e}]");
    }
    let exact = references[0].steps[1].row.change_f.unwrap();
    let [lower, upper] = bounds(&outcome.steps[1].row);
    assert!(lower <= exact && exact <= upper, "{exact:e} not in [{lower:e}, {upper:e}]");
    let relative = outcome.steps[1].row.change_relative.unwrap();
    assert!((-2e-3..-2e-4).contains(&relative), "{relative:e}");
}

#[test]
fn what_is_not_asked_for_is_as_well_known_as_the_bounds_say_and_the_first_load_changes_nothing() {
    let outcome = solve(&pair(&[0.0, 0.2, 0.0, 0.4], None));
    let first = &outcome.steps[0].row;
    for step in &outcome.steps {
        let row = &step.row;
        let [lower, upper] = bounds(row);
        if row.compression == Some(0.0) {
            assert_eq!([lower, row.change_f.unwrap(), upper], [0.0; 3]);
            continue;
        }
        let widest = [
            row.capacitance_lower_f.unwrap() - first.capacitance_upper_f.unwrap(),
            row.capacitance_upper_f.unwrap() - first.capacitance_lower_f.unwrap(),
        ];
        for (found, expected) in [lower, upper].into_iter().zip(widest) {
            assert!((found - expected).abs() < 1e-12 * first.capacitance_f.unwrap());
        }
        let change = row.capacitance_f.unwrap() / first.capacitance_f.unwrap() - 1.0;
        assert!((row.change_relative.unwrap() - change).abs() < 1e-12);
        // Pressed, the pair loses capacitance.
        assert!(row.sensitivity_f_per_n.unwrap() < 0.0 && row.sensitivity_error_f_per_n.unwrap() > 0.0);
    }
}

/// Two plates over a layer with the permittivity of air, whose surface sinks.
const AIR: &str = r#"
format = 1
[layer]
thickness = "1 mm"
relative_permittivity = 1.0
[layer.material.neo_hookean]
shear_modulus = "90 kPa"
[mechanics.closed_form]
contact_half_length = "5 mm"
contact_width = "5 mm"
shear_length = "5 mm"
[load]
compression = [0.0, 0.3]
[[conductor]]
name = "left"
box = { min = ["-0.7 mm", "1.2 mm", "-0.5 mm"], max = ["-0.1 mm", "1.3 mm", "0.5 mm"] }
[[conductor]]
name = "right"
box = { min = ["0.1 mm", "1.2 mm", "-0.5 mm"], max = ["0.7 mm", "1.3 mm", "0.5 mm"] }
[measure]
capacitance = ["left", "right"]
kind = "two-terminal"
[surroundings]
boundary = "open"
below = { relative_permittivity = 1.0, thickness = "open" }
above = { relative_permittivity = 1.0, thickness = "open" }
[electrostatics]
relative_tolerance = 1e-2
change_tolerance = 1e-2
"#;

#[test]
fn an_object_with_the_permittivity_of_air_is_known_to_change_nothing() {
    let case = elastocap_case::parse(AIR, Path::new("air.toml")).unwrap_or_else(|e| panic!("{e}"));
    let outcome = solve(&case);
    let first = outcome.steps[0].row.capacitance_f.unwrap();
    assert!(outcome.is_complete(), "{:?}", outcome.steps.iter().map(|s| &s.reason).collect::<Vec<_>>());
    for step in &outcome.steps[1..] {
        let [lower, upper] = bounds(&step.row);
        assert!(lower <= 0.0 && 0.0 <= upper, "[{lower:e}, {upper:e}]");
        assert!(lower < upper && upper - lower <= 1e-6 * first, "[{lower:e}, {upper:e}] of {first:e}");
    }
}

#[test]
fn a_change_that_is_out_of_reach_is_marked_and_what_is_known_kept() {
    let case = pair(&[0.0, 5e-4], Some(1e-4));
    let mut plan = Plan::new(&case, &NUMBERS_ONLY);
    // For two steps together.
    plan.memory_limit = 40 << 20;
    let outcome = run(&case, &plan, &NUMBERS_ONLY, &Arc::new(AtomicBool::new(false)), &());
    let [first, second] = outcome.steps.as_slice() else { panic!("{outcome:?}") };
    assert_eq!((&first.row.status, first.reason.as_ref()), (&Status::Ok, None));
    assert_eq!(second.row.status, Status::ToleranceNotReached(Missed::Change));
    assert!(
        second.reason.as_ref().is_some_and(|reason| reason.to_string().contains("change")),
        "{:?}",
        second.reason
    );
    let error = second.row.relative_error_estimate.unwrap();
    assert!(error <= 0.025, "the capacitance itself: {error:e}");
    assert!(!outcome.is_complete() && !outcome.stopped);
}

#[test]
fn the_plan_says_that_steps_are_solved_again_and_where_that_helps_little() {
    let parts = |case: &Case| {
        let plan = Plan::new(case, &NUMBERS_ONLY);
        let has_part = plan.solved.iter().any(|planned| planned.part == "change");
        (has_part, plan.warnings.iter().any(|text| text.contains("`change_tolerance`")))
    };
    let mut case = pair(&[0.0, 0.1], None);
    assert_eq!(parts(&case), (false, false));
    case = pair(&[0.0, 0.1], Some(1e-2));
    assert_eq!(parts(&case), (true, false));
    case.electrostatics.as_mut().unwrap().solver = Some(FieldSolver::Tetrahedra);
    assert_eq!(parts(&case), (true, true));
}

/// Stops a run where steps are solved again, and gives another one what that had found.
struct StopBeforeChange {
    cancel: Option<Arc<AtomicBool>>,
    found: Vec<FinishedStep>,
}

impl Observer for StopBeforeChange {
    fn preparing(&self, what: &str) {
        if let Some(cancel) = self.cancel.as_ref().filter(|_| what.contains("change")) {
            cancel.store(true, Ordering::Relaxed);
        }
    }

    fn finished_before(&self, index: usize) -> Option<FinishedStep> {
        self.found.iter().find(|found| found.index == index).cloned()
    }
}

#[test]
fn a_run_that_goes_on_from_one_that_was_stopped_finds_the_same_change() {
    let case = pair(&[0.0, 0.01, 0.02], Some(1e-2));
    let plan = Plan::new(&case, &NUMBERS_ONLY);
    let whole = solve(&case);
    assert!(whole.is_complete());
    let rows = |outcome: &Outcome| outcome.steps.iter().map(|step| step.row.clone()).collect::<Vec<_>>();
    let finished = |outcome: &Outcome| outcome.steps.iter().filter_map(FinishedStep::of).collect::<Vec<_>>();

    let cancel = Arc::new(AtomicBool::new(false));
    let stopping = StopBeforeChange { cancel: Some(Arc::clone(&cancel)), found: Vec::new() };
    let stopped = run(&case, &plan, &NUMBERS_ONLY, &cancel, &stopping);
    assert!(stopped.stopped && !stopped.is_complete());
    assert_eq!(stopped.steps[1].row.status, Status::ToleranceNotReached(Missed::Change));
    // What a run keeps is the same before and after steps were solved again.
    for found in [finished(&stopped), finished(&whole)] {
        assert_eq!(found.len(), 3);
        let resumed = StopBeforeChange { cancel: None, found };
        let outcome = run(&case, &plan, &NUMBERS_ONLY, &Arc::new(AtomicBool::new(false)), &resumed);
        assert_eq!(rows(&outcome), rows(&whole));
    }
}
