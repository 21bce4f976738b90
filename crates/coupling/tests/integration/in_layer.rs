//! Bodies that move with the material of the layer, compared with the same bodies as a pair, which has other
//! solvers.

use std::path::Path;

use elastocap_coupling::outcome::{Outcome, Row};
use elastocap_coupling::route::Route;

use crate::common::{layer, solve};

/// The row and the route of the last step, which is loaded.
fn loaded(outcome: &Outcome) -> (&Row, Option<Route>) {
    let step = outcome.steps.last().unwrap();
    (&step.row, step.route)
}

/// The bounds, widened by the errors of layer and map.
fn limits(row: &Row) -> [f64; 2] {
    let besides = row.geometry_error_estimate.unwrap_or(0.0) + row.mechanics_error_estimate.unwrap_or(0.0);
    [row.capacitance_lower_f.unwrap() * (1.0 - besides), row.capacitance_upper_f.unwrap() * (1.0 + besides)]
}

fn agree(one: &Row, other: &Row) -> bool {
    let ([a, b], [c, d]) = (limits(one), limits(other));
    a <= d && c <= b
}

/// A pair as soft as the layer.
const PAIR: &str = r#"[electrodes.in_plane_pair]
gap = "60 um"
length = "200 um"
thickness = "40 um"
width = "300 um"
height = "150 um"
shear_modulus = "100 kPa"
"#;

/// The same electrodes as two bodies that move with the layer.
const BODIES: &str = r#"[[conductor]]
name = "left"
attached = "layer"
box = { min = ["-230 um", "130 um", "-150 um"], max = ["-30 um", "170 um", "150 um"] }
[[conductor]]
name = "right"
attached = "layer"
box = { min = ["30 um", "130 um", "-150 um"], max = ["230 um", "170 um", "150 um"] }
"#;

const PUNCH: &str = r#"[mechanics.plane_strain]
end = "free"
width = "1 mm"
relative_tolerance = 2e-2
indenter = { flat_punch = { half_width = "300 um", corner_radius = "60 um" } }
[load]
compression = [0.0, 0.2]
"#;

const BALL: &str = r#"[mechanics.solid]
end = "free-on-substrate"
width = "2 mm"
relative_tolerance = 5e-2
indenter = { sphere = { radius = "800 um" } }
[load]
compression = [0.0, 0.1]
"#;

const WHOLE_TOP: &str = r#"[mechanics.plane_strain]
end = "free"
width = "1 mm"
relative_tolerance = 1e-1
indenter = "whole-top"
[load]
compression = [0.0, 0.05]
"#;

const CLOSED_FORM: &str = r#"[mechanics.closed_form]
contact_half_length = "2 mm"
contact_width = "1 mm"
shear_length = "1 mm"
[load]
compression = [0.0, 0.03]
"#;

#[test]
fn two_bodies_in_a_layer_under_a_punch_have_the_capacitance_of_their_outlines() {
    let bodies = solve(&layer(BODIES, PUNCH, 1e-2));
    let pair = solve(&layer(PAIR, PUNCH, 1e-2));
    let ((bodies, by_map), (pair, by_outlines)) = (loaded(&bodies), loaded(&pair));
    assert_eq!((by_map, by_outlines), (Some(Route::MAPPED_BOXES), Some(Route::OUTLINES)));
    assert!(agree(bodies, pair), "{:?} {:?}", limits(bodies), limits(pair));
    let [lower, upper] = limits(bodies);
    assert!(upper / lower < 1.02, "{bodies:?}");
}

#[test]
fn two_bodies_in_a_layer_under_its_whole_top_have_the_capacitance_of_their_outlines() {
    let bodies = solve(&layer(BODIES, WHOLE_TOP, 1e-2));
    let pair = solve(&layer(PAIR, WHOLE_TOP, 1e-2));
    let ((bodies, by_map), (pair, _)) = (loaded(&bodies), loaded(&pair));
    assert_eq!(by_map, Some(Route::MAPPED_BOXES));
    assert!(agree(bodies, pair), "{:?} {:?}", limits(bodies), limits(pair));
}

#[test]
fn two_bodies_in_a_layer_under_a_ball_have_the_capacitance_of_the_pair() {
    let bodies = solve(&layer(BODIES, BALL, 3e-2));
    let pair = solve(&layer(PAIR, BALL, 3e-2));
    let ((bodies, _), (pair, _)) = (loaded(&bodies), loaded(&pair));
    assert!(agree(bodies, pair), "{:?} {:?}", limits(bodies), limits(pair));
}

#[test]
fn a_pair_beside_a_body_that_is_not_seen_is_the_pair_alone() {
    let body = "[[dielectric]]\nname = \"patch\"\nattached = \"layer\"\nrelative_permittivity = 2.8\n\
                box = { min = [\"-100 um\", \"200 um\", \"-100 um\"], max = [\"100 um\", \"260 um\", \"100 um\"] }\n";
    let stiff = PAIR.replace("100 kPa", "2 MPa");
    let with_body = solve(&layer(&format!("{stiff}{body}"), PUNCH, 1e-2));
    let alone = solve(&layer(&stiff, PUNCH, 1e-2));
    let ((one, by_map), (other, by_outlines)) = (loaded(&with_body), loaded(&alone));
    assert_eq!((by_map, by_outlines), (Some(Route::MAPPED_BOXES), Some(Route::OUTLINES)));
    assert!(agree(one, other), "{:?} {:?}", limits(one), limits(other));
}

#[test]
fn by_the_closed_form_bodies_go_where_a_pair_as_soft_as_the_layer_goes() {
    let bodies = solve(&layer(BODIES, CLOSED_FORM, 1e-3));
    let pair = solve(&layer(PAIR, CLOSED_FORM, 1e-3));
    for (bodies, pair) in bodies.steps.iter().zip(&pair.steps) {
        assert_eq!(bodies.route, Some(Route::BOXES));
        // The pair is thinned by the stretch at its middle, and the body by the displacements of its faces;
        // both have the same mid-plane.
        let ([a, b], [c, d]) = (limits(&bodies.row), limits(&pair.row));
        assert!(a <= 1.002 * d && c <= 1.002 * b, "{:?} {:?}", [a, b], [c, d]);
    }
}

#[test]
fn a_punch_beside_the_middle_does_to_bodies_what_its_mirror_image_does_to_theirs() {
    let beside = |position: &str, sign: f64| {
        let punch = PUNCH.replace("corner_radius", &format!("position = \"{position}\", corner_radius"));
        let body = |name: &str, from: f64, to: f64| {
            let ends = if sign > 0.0 { [from, to] } else { [-to, -from] };
            format!(
                "[[conductor]]\nname = \"{name}\"\nattached = \"layer\"\nbox = {{ min = [\"{} um\", \"130 um\", \"-150 um\"], \
                 max = [\"{} um\", \"170 um\", \"150 um\"] }}\n",
                ends[0], ends[1]
            )
        };
        solve(&layer(&format!("{}{}", body("a", -230.0, -30.0), body("b", 50.0, 150.0)), &punch, 1e-2))
    };
    let (right, left) = (beside("150 um", 1.0), beside("-150 um", -1.0));
    let ((one, _), (other, _)) = (loaded(&right), loaded(&left));
    let [one, other] = [one, other].map(|row| row.capacitance_f.unwrap());
    assert!((one / other - 1.0).abs() < 2e-3, "{one} {other}");
}

#[test]
fn a_ball_in_contact_and_in_the_field_shields_bodies_in_the_layer() {
    let bodies = format!("{BODIES}[measure]\ncapacitance = [\"left\", \"right\"]\n");
    let ball = BALL.replace("[load]", "[indenter]\nrole = \"grounded\"\n[load]");
    let with_ball = solve(&layer(&bodies, &ball, 3e-2));
    let without = solve(&layer(&bodies, BALL, 3e-2));
    let ((with_ball, _), (without, _)) = (loaded(&with_ball), loaded(&without));
    assert!(with_ball.capacitance_upper_f < without.capacitance_lower_f, "{with_ball:?} {without:?}");
}

#[test]
fn a_disc_that_moves_with_the_layer_is_refused_by_its_name() {
    let disc = "[[conductor]]\nname = \"pad\"\nattached = \"layer\"\n\
                cylinder = { axis = \"x2\", base = [\"0 um\", \"100 um\", \"0 um\"], radius = \"200 um\", height = \"20 um\" }\n";
    let text =
        layer(&format!("{BODIES}{disc}").replace("130 um", "180 um").replace("170 um", "220 um"), BALL, 1e-1);
    let error = elastocap_case::parse(&text, Path::new("in-layer.toml")).unwrap_err().render(false);
    assert!(error.contains("how \"pad\" moves with the material of the layer is not known"), "{error}");
}

/// The punch with a coarse and with a fine tolerance of the force.
fn coarse_and_fine() -> [String; 2] {
    ["2e-1", "5e-3"].map(|tolerance| {
        PUNCH.replace("relative_tolerance = 2e-2", &format!("relative_tolerance = {tolerance}"))
    })
}

#[test]
fn a_layer_is_refined_for_the_capacitance_where_its_force_is_asked_for_roughly() {
    let [coarse, fine] = coarse_and_fine();
    let row = |sensor: &str, punch: &str, tolerance: f64| {
        loaded(&solve(&layer(sensor, punch, tolerance))).0.clone()
    };
    let [pair, bodies, finer] =
        [(PAIR, &coarse), (BODIES, &coarse), (BODIES, &fine)].map(|(sensor, punch)| row(sensor, punch, 4e-3));
    for (sensor, sharp) in [(PAIR, &pair), (BODIES, &bodies)] {
        let [of_rough, of_sharp] =
            [&row(sensor, &coarse, 1e-2), sharp].map(|row| row.mechanics_error_estimate.unwrap());
        assert!(of_rough <= 1e-2 && 0.0 < of_sharp && of_sharp <= 4e-3, "{of_rough} {of_sharp}");
    }
    // The grids and their errors are nearly the same, so that the capacitances differ by the errors of the
    // layer's meshes.
    let [c, of_finer] = [&bodies, &finer].map(|row| row.capacitance_f.unwrap());
    let error = bodies.mechanics_error_estimate.unwrap() + finer.mechanics_error_estimate.unwrap();
    assert!((c / of_finer - 1.0).abs() < error, "{bodies:?} {finer:?}");
}

#[test]
fn where_distances_leave_too_much_the_error_is_that_of_the_capacitance_on_coarser_meshes() {
    // In three dimensions the number of meshes is limited.
    let stiff = PAIR.replace("100 kPa", "2 MPa");
    let errors = [5e-2, 2e-3].map(|tolerance| {
        let outcome = solve(&layer(&stiff, BALL, tolerance));
        let step = outcome.steps.last().unwrap();
        (step.row.mechanics_error_estimate.unwrap(), step.mechanics_by_capacitance)
    });
    let [(of_distances, false), (of_capacitance, true)] = errors else { panic!("{errors:?}") };
    assert!(of_distances > 2e-3 && 0.0 < of_capacitance, "{errors:?}");
    assert!(of_capacitance < of_distances, "{errors:?}");
}

#[test]
fn a_change_is_known_to_its_tolerance_where_the_force_is_asked_for_roughly() {
    let [coarse, _] = coarse_and_fine();
    let outcome = solve(&format!("{}change_tolerance = 3e-2\n", layer(BODIES, &coarse, 1e-2)));
    let (row, _) = loaded(&outcome);
    assert!(row.status.is_ok(), "{row:?}");
    let (change, error) = (row.change_relative.unwrap().abs(), row.mechanics_error_estimate.unwrap());
    assert!(error < 3e-2 * change, "{change} {error}");
}
