//! `check` and `run` agree: the route that the plan tells is the one that a run takes.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use elastocap_case::{Case, FieldSolver, Load, Mechanics};
use elastocap_coupling::outcome::{Outcome, Status};
use elastocap_coupling::plan::{Options, Plan};
use elastocap_coupling::route::Route;
use elastocap_coupling::run::{deform, run};

const NUMBERS_ONLY: Options = Options { prune: true, fields: false, scene: false, model_error: false };

/// Wide enough that the first grid or mesh will do.
const COARSE: f64 = 0.9;

fn cases() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../cases");
    let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut cases: Vec<_> = files.filter(|path| path.extension().is_some_and(|e| e == "toml")).collect();
    cases.sort();
    cases
}

fn name_of(path: &Path) -> String {
    path.file_stem().unwrap().to_string_lossy().into_owned()
}

/// A case with all its tolerances wide.
fn coarse(path: &Path) -> Case {
    let mut case = elastocap_case::load(path).unwrap_or_else(|e| panic!("{e}"));
    if let Some(settings) = &mut case.electrostatics {
        settings.relative_tolerance = COARSE;
    }
    match &mut case.mechanics {
        Some(Mechanics::PlaneStrain(model)) => model.relative_tolerance = COARSE,
        Some(Mechanics::Solid(model)) => model.relative_tolerance = COARSE,
        Some(Mechanics::ClosedForm { .. }) | None => {}
    }
    case
}

/// The case with the first and the last of its loads; of a layer in space, which takes long, with the first
/// alone.
fn with_few_loads(case: &mut Case) {
    let in_space = matches!(case.mechanics, Some(Mechanics::Solid(_)));
    let few = |steps: &mut Vec<f64>| {
        let last = *steps.last().unwrap();
        steps.truncate(1);
        if !in_space && last != steps[0] {
            steps.push(last);
        }
    };
    match &mut case.load {
        Some(Load::Compression(steps) | Load::Force(steps)) => few(steps),
        None => {}
    }
}

fn solve(case: &Case, plan: &Plan) -> Outcome {
    run(case, plan, &NUMBERS_ONLY, &Arc::default(), &())
}

#[test]
fn every_case_takes_the_route_that_its_plan_tells_and_fails_nowhere_it_does_not() {
    let mut taken: BTreeMap<String, Vec<Option<Route>>> = BTreeMap::new();
    for path in cases() {
        let mut case = coarse(&path);
        with_few_loads(&mut case);
        let plan = Plan::new(&case, &NUMBERS_ONLY);
        let outcome = solve(&case, &plan);
        for (planned, step) in plan.steps.iter().zip(&outcome.steps) {
            let what = format!("{}, step {}", path.display(), step.index);
            assert_eq!(planned.failure, None, "{what}");
            assert!(
                !matches!(step.row.status, Status::Failed(_) | Status::NotRun),
                "{what}: {}",
                step.row.status
            );
            assert_eq!(planned.route, step.route, "{what}");
            let grid = step.solver.as_ref().map(|solver| solver.resolution.grid().is_some());
            let expected = step.route.map(|route| route.solver() != FieldSolver::Tetrahedra);
            assert_eq!(grid, expected, "{what}: solved by another solver than its route says");
        }
        taken.insert(name_of(&path), outcome.steps.iter().map(|step| step.route).collect());
    }
    let routes = |name: &str| taken[name].clone();
    assert_eq!(routes("in-plane-pair"), [Some(Route::BOXES); 2]);
    assert_eq!(routes("finger-over-pair"), [Some(Route::TETRAHEDRA); 2]);
    assert_eq!(routes("punched-pair"), [Some(Route::BOXES), Some(Route::OUTLINES)]);
    assert_eq!(routes("pair-under-sphere"), [Some(Route::BOXES)]);
    assert_eq!(routes("layer-on-substrate"), [None; 2]);
    assert_eq!(routes("dome-from-gmsh"), [Some(Route::TETRAHEDRA)]);
}

#[test]
fn loads_that_bend_electrodes_in_space_are_planned_under_a_map() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../cases/pair-under-sphere.toml");
    let plan = Plan::new(&coarse(&path), &NUMBERS_ONLY);
    let routes: Vec<_> = plan.steps.iter().map(|step| step.route).collect();
    assert_eq!(routes, [Some(Route::BOXES), Some(Route::MAPPED_BOXES)]);
}

#[test]
fn failures_known_beforehand_are_those_of_the_run() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../");
    let too_long = coarse(&folder.join("tests/acceptance/found/electrode-longer-than-layer.toml"));
    // Bent in space, and asked for on tetrahedra: no solver takes it.
    let mut no_solver = coarse(&folder.join("cases/pair-under-sphere.toml"));
    no_solver.electrostatics.as_mut().unwrap().solver = Some(elastocap_case::FieldSolver::Tetrahedra);
    let plan = Plan::new(&no_solver, &NUMBERS_ONLY);
    assert_eq!(plan.steps[0].route, Some(Route::TETRAHEDRA));
    let failure = plan.steps[1].failure.as_ref().expect("a failure").to_string();
    assert!(failure.contains("only the box solver supports"), "{failure}");

    let plan = Plan::new(&too_long, &NUMBERS_ONLY);
    assert_eq!(plan.layer, None);
    let outcome = solve(&too_long, &plan);
    for (planned, step) in plan.steps.iter().zip(&outcome.steps) {
        let Status::Failed(failure) = &step.row.status else { panic!("{}", step.row.status) };
        assert_eq!(planned.failure.as_ref(), Some(&**failure));
    }
}

#[test]
fn a_grid_of_bent_electrodes_says_that_they_are_shown_as_boxes() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../cases/punched-pair.toml");
    let mut case = coarse(&path);
    with_few_loads(&mut case);
    let steps = deform(&case, &Plan::new(&case, &NUMBERS_ONLY));
    assert!(steps[0].warnings.is_empty() && steps[0].route == Some(Route::BOXES), "{:?}", steps[0].warnings);
    assert_eq!(steps[1].route, Some(Route::OUTLINES));
    let [warning] = steps[1].warnings.as_slice() else { panic!("{:?}", steps[1].warnings) };
    assert!(warning.contains("shown as the boxes of their mean faces"), "{warning}");
    assert!(warning.contains("the extruded solver, with the outlines of the bent electrodes"), "{warning}");
}
