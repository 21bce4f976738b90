//! The surface of a layer that the load has bent is that of the field, in open space as within walls, or the step says what that leaves.

use std::path::Path;
use std::sync::Arc;

use elastocap_case::{Case, FieldSolver, Indenter, Mechanics};
use elastocap_coupling::outcome::{Missed, Outcome, Status, StepResult};
use elastocap_coupling::plan::Plan;
use elastocap_coupling::route::Route;
use elastocap_coupling::run::run;
use elastocap_electrostatics::Bounded;

use crate::common::{NUMBERS_ONLY, parse};

fn text(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/acceptance/found3").join(name);
    std::fs::read_to_string(path).unwrap()
}

/// The electrodes 40 um below the surface, under a punch, pressed by a tenth and known to 2 %.
fn near_surface(surroundings: &str) -> Case {
    let text = text("open-punch-near-surface.toml")
        .replace("compression = [0.0, 0.1]", "compression = [0.1]")
        .replace("relative_tolerance = 2e-3", "relative_tolerance = 2e-2")
        .replace("boundary = \"open\"", surroundings);
    parse(&text)
}

fn solve(case: &Case) -> Outcome {
    run(case, &Plan::new(case, &NUMBERS_ONLY), &NUMBERS_ONLY, &Arc::default(), &())
}

fn only(outcome: Outcome) -> StepResult {
    let [step] = <[StepResult; 1]>::try_from(outcome.steps).unwrap();
    step
}

fn overlap(one: Bounded, other: Bounded) -> bool {
    one.lower <= other.upper && other.lower <= one.upper
}

const OPEN: &str = "boundary = \"open\"";
const FAR_WALLS: &str = "boundary = \"insulated\"\nside_margin = \"8 mm\"\nbelow = { relative_permittivity = 1.0, \
                         thickness = \"8 mm\" }\nabove = { relative_permittivity = 1.0, thickness = \"8 mm\" }";

#[test]
fn a_punch_in_open_space_bends_the_surface_as_within_walls_that_are_far_away() {
    let open = only(solve(&near_surface(OPEN)));
    assert_eq!((&open.row.status, open.route), (&Status::Ok, Some(Route::Outlines)), "{:?}", open.reason);
    let found = open.measured.unwrap();
    let walled = only(solve(&near_surface(FAR_WALLS))).measured.unwrap();
    assert!(overlap(found, walled), "{found:?} {walled:?}");
    // Under a flat surface it would be 36.9 fF.
    assert!((found.value - 38.05e-15).abs() < 0.15e-15, "{found:?}");
    let error = open.row.geometry_error_estimate.unwrap();
    assert!(0.0 < error && error < 2e-2, "{error:e}");
}

#[test]
fn boxes_and_tetrahedra_have_the_same_punch_in_open_space() {
    let mut case = near_surface(OPEN);
    let outlines = only(solve(&case)).measured.unwrap();
    let field = case.electrostatics.as_mut().unwrap();
    field.solver = Some(FieldSolver::Boxes);
    let boxes = only(solve(&case));
    assert_eq!(boxes.row.status, Status::ToleranceNotReached(Missed::Field));
    let bounds = boxes.measured.unwrap();
    assert!(bounds.lower <= outlines.upper && outlines.lower <= bounds.upper, "{bounds:?} {outlines:?}");
    assert!(bounds.lower <= outlines.lower && outlines.upper <= bounds.upper, "{bounds:?} {outlines:?}");
    let reason = boxes.reason.unwrap().to_string();
    assert!(reason.contains("the least and the greatest height"), "{reason}");
    let field = case.electrostatics.as_mut().unwrap();
    (field.solver, field.relative_tolerance) = (Some(FieldSolver::Tetrahedra), 0.3);
    let tetrahedra = only(solve(&case));
    assert_eq!((&tetrahedra.row.status, tetrahedra.route), (&Status::Ok, Some(Route::OutlinesOnTetrahedra)));
    assert!(overlap(tetrahedra.measured.unwrap(), outlines), "{:?} {outlines:?}", tetrahedra.measured);
}

#[test]
fn a_surface_that_is_still_bent_at_the_end_of_its_layer_or_under_a_wall_is_not_ok() {
    let mut case = near_surface(OPEN);
    // So near to the end that the surface is up there.
    case.layer.as_mut().unwrap().half_length = Some(900e-6);
    case.electrostatics.as_mut().unwrap().relative_tolerance = 1e-2;
    let short = only(solve(&case));
    assert_eq!(short.row.status, Status::ToleranceNotReached(Missed::Geometry), "{:?}", short.reason);
    assert!(short.reason.as_ref().unwrap().to_string().contains("make `half_length` larger"), "{:?}", short.reason);
    let walls = FAR_WALLS
        .replace("above = { relative_permittivity = 1.0, thickness = \"8 mm\" }", "above = \"insulated\"");
    let under = only(solve(&near_surface(&walls)));
    assert_eq!(under.row.status, Status::ToleranceNotReached(Missed::Geometry), "{:?}", under.reason);
    assert!(under.reason.as_ref().unwrap().to_string().contains("the wall that lies on it"), "{:?}", under.reason);
    // A plate over the whole top leaves it a plane.
    let mut plate = near_surface(&walls);
    if let Some(Mechanics::PlaneStrain(model)) = &mut plate.mechanics {
        model.indenter = Indenter::WholeTop;
    }
    assert_eq!(only(solve(&plate)).row.status, Status::Ok);
}

#[test]
fn walls_nearer_than_the_end_of_a_plate_end_the_map_of_what_moves_with_the_layer() {
    let outcome = solve(&parse(&text("map-not-continuous.toml")));
    let [rest, pressed] = &outcome.steps[..] else { panic!("{:?}", outcome.steps.len()) };
    assert_eq!((&rest.row.status, &pressed.row.status), (&Status::Ok, &Status::Ok), "{:?}", pressed.reason);
    assert_eq!(pressed.route, Some(Route::MappedBoxes));
}
