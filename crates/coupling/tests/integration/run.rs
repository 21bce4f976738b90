//! Plans and runs, without the command line.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use elastocap_case::{Case, Load};
use elastocap_coupling::outcome::{Missed, Outcome, Row, Status, StepResult};
use elastocap_coupling::plan::{Decision, Kind, Options, Plan};
use elastocap_coupling::run::{Observer, Run, run};

const NUMBERS_ONLY: Options = Options { prune: true, fields: false, scene: false, model_error: false };

fn acceptance(name: &str) -> Case {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/acceptance").join(name);
    elastocap_case::load(&path).unwrap_or_else(|e| panic!("{e}"))
}

fn quick(steps: &[f64]) -> Case {
    let mut case = acceptance("in-plane-pair.toml");
    case.load = Some(Load::Compression(steps.to_vec()));
    case.electrostatics.as_mut().unwrap().relative_tolerance = 0.05;
    case
}

fn solve(case: &Case, plan: &Plan) -> Outcome {
    run(case, plan, &NUMBERS_ONLY, &Arc::new(AtomicBool::new(false)), &())
}

#[test]
fn a_load_that_comes_again_is_solved_once() {
    let case = quick(&[0.0, 0.2, 0.0, 0.2]);
    let plan = Plan::new(&case, &NUMBERS_ONLY);
    let sources: Vec<_> = plan.steps.iter().map(|step| step.same_as).collect();
    assert_eq!(sources, [None, None, Some(0), Some(1)]);
    let outcome = solve(&case, &plan);
    assert_eq!(outcome.steps[0].row, outcome.steps[2].row);
    assert_eq!(outcome.steps[1].row, outcome.steps[3].row);
    assert!(outcome.is_complete());
}

#[test]
fn a_cancelled_run_keeps_what_was_done() {
    let case = quick(&[0.0, 0.1, 0.2, 0.3, 0.35, 0.4]);
    let plan = Plan::new(&case, &NUMBERS_ONLY);
    let cancel = Arc::new(AtomicBool::new(false));
    struct StopAfterOne(Arc<AtomicBool>);
    impl Observer for StopAfterOne {
        fn step_done(&self, _: &StepResult) {
            self.0.store(true, Ordering::Relaxed);
        }
    }
    let outcome = run(&case, &plan, &NUMBERS_ONLY, &cancel, &StopAfterOne(Arc::clone(&cancel)));
    assert!(outcome.stopped && !outcome.is_complete());
    let rest_is_known = outcome.steps[0].row.status.is_ok();
    let mut done = 0;
    for step in &outcome.steps {
        let row = &step.row;
        match row.status {
            Status::Ok | Status::OkInModel => done += 1,
            Status::NotRun => assert_eq!(row.capacitance_f, None),
            // A step that was being solved keeps the bounds that it had, if any.
            Status::ToleranceNotReached(Missed::Field) => assert!(step.interrupted),
            // The load may be done before the state at rest, which is then what was being solved.
            Status::ToleranceNotReached(Missed::Change) => {
                assert!(!rest_is_known && row.capacitance_f.is_some());
                done += 1;
            }
            ref other => panic!("{other:?}"),
        }
    }
    assert!((1..=2).contains(&done), "{done} steps were done");
    let last = &outcome.steps[5].row;
    assert_eq!((last.compression, &last.status), (Some(0.4), &Status::NotRun));
    assert_eq!((last.gap_m, last.two_terminal_capacitance_f), (None, None));
    // The force needs no field.
    let whole = run(&case, &plan, &NUMBERS_ONLY, &Arc::new(AtomicBool::new(false)), &());
    assert_eq!(last.force_n, whole.steps[5].row.force_n);
    assert!(last.force_n.is_some_and(|force| force > 0.0));
}

#[test]
fn what_is_found_can_be_taken_from_a_run_that_goes_on() {
    let case = quick(&[0.0, 0.2]);
    let plan = Plan::new(&case, &NUMBERS_ONLY);
    let never = Arc::new(AtomicBool::new(false));
    let whole = run(&case, &plan, &NUMBERS_ONLY, &never, &());
    struct Taker<'a>(&'a Run<'a>, Mutex<Vec<Outcome>>);
    impl Observer for Taker<'_> {
        fn step_begun(&self, index: usize) {
            if index == 1 {
                self.1.lock().unwrap().push(self.0.outcome());
            }
        }
    }
    let one_by_one = Plan { at_once: 1, ..plan };
    let run = Run::new(&case, &one_by_one, &NUMBERS_ONLY, &never);
    let taker = Taker(&run, Mutex::default());
    run.solve(&taker, None);
    let taken = taker.1.into_inner().unwrap();
    let [found] = taken.as_slice() else { panic!("{}", taken.len()) };
    assert!(found.stopped && found.steps.len() == 2);
    let capacitance = |outcome: &Outcome| outcome.steps[0].row.two_terminal_capacitance_f;
    assert_eq!(capacitance(found), capacitance(&whole));
    assert_eq!(found.steps[1].row.status, Status::NotRun);
    // The force needs no field.
    assert_eq!(found.steps[1].row.force_n, whole.steps[1].row.force_n);
}

#[test]
fn a_tolerance_out_of_reach_is_marked_and_the_result_kept() {
    let mut case = quick(&[0.1]);
    case.electrostatics.as_mut().unwrap().relative_tolerance = 1e-9;
    let mut plan = Plan::new(&case, &NUMBERS_ONLY);
    // Room for the coarsest grids only.
    plan.memory_limit = 20 << 20;
    let outcome = solve(&case, &plan);
    let step = &outcome.steps[0];
    assert_eq!(step.row.status, Status::ToleranceNotReached(Missed::Field));
    assert!(step.reason.is_some());
    let error = step.row.relative_error_estimate.unwrap();
    assert!(error > 1e-9, "{error:e}");
    let (lower, upper) = (step.row.capacitance_lower_f.unwrap(), step.row.capacitance_upper_f.unwrap());
    assert!(lower <= 41.72980e-15 && 41.72980e-15 <= upper, "{lower:e} {upper:e}");
    assert!(!outcome.is_complete() && !outcome.stopped);
}

#[test]
fn the_plan_says_what_is_solved_and_what_is_not() {
    let plan = Plan::new(&acceptance("in-plane-pair.toml"), &Options::default());
    assert_eq!(plan.kind, Kind::Curve);
    let parts: Vec<_> = plan.solved.iter().map(|planned| planned.part).collect();
    assert_eq!(parts, ["mechanics", "measured", "electrostatics"]);
    assert_eq!(plan.mirrored, [true, false, true]);
    // A quarter of the scene, as a run of the last step takes it (113,881 are needed), some 0.1 GB and some
    // tenths of a second.
    assert_eq!(plan.unknowns, 118_422);
    assert!((0.5e8..2e8).contains(&(plan.memory_bytes as f64)), "{}", plan.memory_bytes);
    assert!((0.05..2.0).contains(&plan.seconds), "{}", plan.seconds);

    let plan = Plan::new(&acceptance("isolated-cube.toml"), &Options::default());
    assert_eq!(plan.kind, Kind::Capacitance);
    let parts: Vec<_> = plan.solved.iter().map(|planned| planned.part).collect();
    assert_eq!(parts, ["measured", "electrostatics"]);

    let mut case = acceptance("in-plane-pair.toml");
    case.electrodes = None;
    let plan = Plan::new(&case, &Options::default());
    assert_eq!(plan.kind, Kind::Mechanics);
    assert_eq!(plan.unknowns, 0);
    assert_eq!((plan.left_out.len(), plan.left_out[0].by), (1, Decision::Case));
}

#[test]
fn without_pruning_nothing_is_left_out_by_the_plan() {
    let mut case = quick(&[0.1, 0.1]);
    let options = Options { prune: false, ..NUMBERS_ONLY };
    let plan = Plan::new(&case, &options);
    assert!(plan.left_out.iter().all(|left| left.by != Decision::Plan));
    assert!(plan.steps.iter().all(|step| step.same_as.is_none()));
    assert!(!plan.solver_settings(&case, &options).symmetry);
    case.load = None;
    let plan = Plan::new(&case, &options);
    let parts: Vec<_> = plan.solved.iter().map(|planned| planned.part).collect();
    assert_eq!(parts, ["mechanics", "measured", "electrostatics"]);
}

#[test]
fn estimates_in_place_of_bounds_hold_the_true_error() {
    let mut case = quick(&[0.1]);
    let settings = case.electrostatics.as_mut().unwrap();
    (settings.bounds, settings.relative_tolerance) = (false, 1e-3);
    let plan = Plan::new(&case, &NUMBERS_ONLY);
    assert!(plan.left_out.iter().any(|left| left.what.contains("dual")));
    let outcome = solve(&case, &plan);
    let row = &outcome.steps[0].row;
    assert!(row.status.is_ok());
    let error = row.two_terminal_capacitance_f.unwrap() / 41.72980e-15 - 1.0;
    let estimate = row.relative_error_estimate.unwrap();
    assert!(error.abs() <= estimate + 3e-6 && estimate <= 1e-3, "{error:e} {estimate:e}");
}

/// A short layer, pressed by 5 %; what `mechanics` says goes in between.
fn short_layer(mechanics: &str) -> Case {
    let text = format!(
        "format = 1\n[layer]\nthickness = \"1 mm\"\nhalf_length = \"1.6 mm\"\n[layer.material.neo_hookean]\n\
         shear_modulus = \"100 kPa\"\nbulk_modulus = \"10 MPa\"\n{mechanics}\nend = \"free-on-substrate\"\n\
         indenter = \"whole-top\"\nwidth = \"0.8 mm\"\n[load]\ncompression = [0.05]\n"
    );
    elastocap_case::parse(&text, Path::new("short.toml")).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn between_planes_of_symmetry_the_layer_in_space_carries_the_force_of_plane_strain() {
    let force = |mechanics: &str| {
        let case = short_layer(mechanics);
        let outcome = solve(&case, &Plan::new(&case, &NUMBERS_ONLY));
        assert_eq!(outcome.steps[0].row.status, Status::Ok, "{:?}", outcome.steps[0].reason);
        let row = &outcome.steps[0].row;
        (row.force_n.unwrap(), row.relative_error_estimate.unwrap())
    };
    let (plane, plane_error) = force("[mechanics.plane_strain]\nrelative_tolerance = 5e-3");
    let (space, space_error) = force("[mechanics.solid]\nside = \"symmetric\"\nrelative_tolerance = 5e-2");
    let difference = (space / plane - 1.0).abs();
    assert!(difference <= plane_error + space_error, "{space} {space_error:e} {plane} {plane_error:e}");
    assert!(difference < 0.02, "{space} {plane}");
    // Where the sides are free the rubber has one more way out.
    let (free, _) = force("[mechanics.solid]\nrelative_tolerance = 5e-2");
    assert!(free < 0.9 * plane, "{free} {plane}");
}

#[test]
fn a_layer_in_space_that_does_not_fit_into_the_memory_is_not_begun() {
    let case = short_layer("[mechanics.solid]\nrelative_tolerance = 5e-2");
    let mut plan = Plan::new(&case, &NUMBERS_ONLY);
    plan.layer_memory_limit = 1000;
    let outcome = solve(&case, &plan);
    let Status::Failed(reason) = &outcome.steps[0].row.status else { panic!("{:?}", outcome.steps[0].row) };
    assert!(reason.to_string().contains("of memory"), "{reason}");
    assert!(!outcome.is_complete());
}

/// Stops a run as soon as its layer is pressed.
struct StopAtLayer(Arc<AtomicBool>, Mutex<Vec<usize>>);

impl Observer for StopAtLayer {
    fn preparing(&self, what: &str) {
        if what.starts_with("layer") {
            self.0.store(true, Ordering::Relaxed);
        }
    }

    fn step_done(&self, step: &StepResult) {
        assert!(!self.0.load(Ordering::Relaxed), "{}", step.index);
        self.1.lock().unwrap().push(step.index);
    }
}

#[test]
fn the_capacitance_at_rest_is_there_before_a_layer_in_space_is_pressed() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../cases/pair-under-sphere.toml");
    let mut case = elastocap_case::load(&path).unwrap_or_else(|e| panic!("{e}"));
    case.electrostatics.as_mut().unwrap().relative_tolerance = 0.05;
    let mut at_rest = case.clone();
    at_rest.load = Some(Load::Compression(vec![0.0]));
    let whole = solve(&at_rest, &Plan::new(&at_rest, &NUMBERS_ONLY));
    // The steps need not be in the order of their loads.
    case.load = Some(Load::Compression(vec![0.1, 0.0]));
    let cancel = Arc::new(AtomicBool::new(false));
    let stop = StopAtLayer(Arc::clone(&cancel), Mutex::default());
    let outcome = run(&case, &Plan::new(&case, &NUMBERS_ONLY), &NUMBERS_ONLY, &cancel, &stop);
    assert_eq!(*stop.1.lock().unwrap(), [1]);
    assert_eq!(outcome.steps[0].row.status, Status::NotRun);
    let [found, alone] = [&outcome, &whole].map(|outcome| &outcome.steps[outcome.steps.len() - 1].row);
    let bounds = |row: &Row| [row.capacitance_lower_f, row.capacitance_f, row.capacitance_upper_f];
    assert_eq!((bounds(found), found.gap_m), (bounds(alone), alone.gap_m));
    assert!(found.status == Status::Ok && found.capacitance_f.is_some() && outcome.stopped);
}
