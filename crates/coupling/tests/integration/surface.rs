//! The surface of a layer that the load has bent is that of the field, in open space as within walls, or the
//! step says what that leaves.

use std::path::Path;
use std::sync::Arc;

use elastocap_case::Case;
use elastocap_coupling::outcome::{Missed, Outcome, Status, StepResult};
use elastocap_coupling::plan::Plan;
use elastocap_coupling::route::Route;
use elastocap_coupling::run::run;

use crate::common::{NUMBERS_ONLY, parse};

/// The electrodes 40 um below the surface, under a punch, pressed by a tenth and known to 3 %.
fn near_surface(surroundings: &str) -> Case {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/acceptance/found3");
    let text = std::fs::read_to_string(folder.join("open-punch-near-surface.toml")).unwrap();
    let text = text
        .replace("compression = [0.0, 0.1]", "compression = [0.1]")
        .replace("relative_tolerance = 2e-3", "relative_tolerance = 3e-2")
        .replace("boundary = \"open\"", surroundings);
    parse(&text)
}

fn solve(case: &Case) -> StepResult {
    let outcome: Outcome = run(case, &Plan::new(case, &NUMBERS_ONLY), &NUMBERS_ONLY, &Arc::default(), &());
    let [step] = <[StepResult; 1]>::try_from(outcome.steps).unwrap();
    step
}

#[test]
fn a_punch_in_open_space_bends_the_surface_as_within_walls_that_are_far_away() {
    let open = solve(&near_surface("boundary = \"open\""));
    assert_eq!((open.row.status.is_ok(), open.route), (true, Some(Route::OUTLINES)), "{:?}", open.reason);
    // 38.058 fF with walls 8 mm away, to 3.0e-4; 36.9 fF under a surface that is flat at its height under the
    // punch.
    let found = open.two_terminal.unwrap();
    assert!(found.lower < 38.07e-15 && 38.05e-15 < found.upper, "{found:?}");
    assert!((found.value / 38.058e-15 - 1.0).abs() < 5e-3, "{found:?}");
    let error = open.row.geometry_error_estimate.unwrap();
    assert!(0.0 < error && error < 3e-2, "{error:e}");
}

#[test]
fn a_wall_that_lies_on_a_bent_surface_is_taken_as_flat_and_the_step_says_so() {
    let walls = "boundary = \"insulated\"\nside_margin = \"3 mm\"\nabove = \"insulated\"";
    let under = solve(&near_surface(walls));
    assert_eq!(under.row.status, Status::ToleranceNotReached(Missed::Geometry), "{:?}", under.reason);
    let reason = under.reason.unwrap().to_string();
    assert!(reason.contains("the wall that lies on it"), "{reason}");
}
