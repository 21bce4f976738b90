//! The indenter as part of the field, flat and round, from far away to contact.

use elastocap_coupling::outcome::{Outcome, Row};
use elastocap_coupling::plan::Plan;
use elastocap_coupling::route::Route;

use crate::common::{NUMBERS_ONLY, layer, parse, solve};

fn bounds(row: &Row) -> [f64; 2] {
    [row.capacitance_lower_f.unwrap(), row.capacitance_upper_f.unwrap()]
}

/// Whether two results agree: their bounds overlap, widened by the relative error `besides`.
fn agree(one: &Row, other: &Row, besides: f64) -> bool {
    let ([a, b], [c, d]) = (bounds(one), bounds(other));
    let slack = besides * b;
    a <= d + slack && c <= b + slack
}

/// A pair of traces on a board under a layer.
fn pair(rest: &str, tolerance: f64) -> String {
    let traces = r#"[[conductor]]
name = "left"
box = { min = ["-500 um", "-20 um", "-600 um"], max = ["-100 um", "0 um", "600 um"] }
[[conductor]]
name = "right"
box = { min = ["100 um", "-20 um", "-600 um"], max = ["500 um", "0 um", "600 um"] }"#;
    layer(traces, &format!("{rest}\n[measure]\ncapacitance = [\"left\", \"right\"]"), tolerance)
}

const PLATE: &str = "[mechanics.closed_form]\ncontact_half_length = \"700 um\"\ncontact_width = \"1 mm\"\nshear_length = \"700 um\"\n";

fn plate(rest: &str, tolerance: f64) -> String {
    pair(&format!("{PLATE}{rest}"), tolerance)
}

fn cylinder(rest: &str, tolerance: f64) -> String {
    let mechanics = "[mechanics.plane_strain]\nend = \"free-on-substrate\"\nwidth = \"1.5 mm\"\nrelative_tolerance = 0.3\n\
                     indenter = { cylinder = { radius = \"1 mm\" } }\n";
    pair(&format!("{mechanics}{rest}"), tolerance)
}

#[test]
fn a_plate_that_comes_near_and_presses_is_the_plate_that_is_written_as_a_body() {
    let load = "[load]\napproach = [\"1 mm\", \"100 um\"]\ncompression = [0.0, 0.1]\n";
    let approach =
        solve(&plate(&format!("[indenter]\nrole = \"grounded\"\nheight = \"200 um\"\n{load}"), 1e-3));
    let distances: Vec<_> = approach.steps.iter().map(|step| step.row.distance_m).collect();
    assert_eq!(distances, [Some(1e-3), Some(1e-4), Some(0.0), Some(0.0)]);
    for (step, low) in approach.steps.iter().zip([1400.0, 500.0, 400.0, 360.0]) {
        assert_eq!(step.route, Some(Route::BOXES));
        // A scene without load, with a layer of the same thickness.
        let by_hand = format!(
            "[[conductor]]\nname = \"plate\"\nbox = {{ min = [\"-700 um\", \"{low} um\", \"-500 um\"], \
             max = [\"700 um\", \"{} um\", \"500 um\"] }}\n[[terminal]]\nname = \"ground\"\nconductors = [\"plate\"]\n\
             potential = \"ground\"\n",
            low + 200.0
        );
        let mut text = pair(&by_hand, 1e-3);
        if low < 400.0 {
            text = text.replace("thickness = \"400 um\"", &format!("thickness = \"{low} um\""));
        }
        let other = solve(&text);
        assert!(agree(&step.row, &other.steps[0].row, 0.0), "{low}: {:?} {:?}", step.row, other.steps[0].row);
    }
    let values: Vec<f64> = approach.steps.iter().map(|step| step.row.capacitance_f.unwrap()).collect();
    assert!(values.windows(2).all(|pair| pair[1] < 0.995 * pair[0]), "{values:?}");
}

#[test]
fn an_approach_without_contact_has_the_steps_of_one_that_goes_on_to_it() {
    let load = |loads: &str| {
        format!(
            "[indenter]\nrole = \"grounded\"\nheight = \"200 um\"\n\
             [load]\napproach = [\"1 mm\", \"100 um\"]\n{loads}\n"
        )
    };
    let touching = solve(&plate(&load("compression = [0.0]"), 1e-3));
    for no_loads in ["compression = []", "force = []"] {
        let before = solve(&plate(&load(no_loads), 1e-3));
        assert_eq!(before.steps.len(), 2);
        for (step, same) in before.steps.iter().zip(&touching.steps) {
            assert_eq!((step.row.distance_m, bounds(&step.row)), (same.row.distance_m, bounds(&same.row)));
        }
    }
}

#[test]
fn an_indenter_that_is_absent_or_nearly_air_leaves_the_field_as_it_is() {
    let load = "[load]\ncompression = [0.0, 0.1]\n";
    let without = solve(&plate(load, 1e-3));
    let absent = solve(&plate(&format!("[indenter]\nrole = \"absent\"\n{load}"), 1e-3));
    let air =
        format!("[indenter]\nrole = {{ relative_permittivity = 1.00000001 }}\nheight = \"200 um\"\n{load}");
    let of_air = solve(&plate(&air, 1e-3));
    for ((one, other), air) in without.steps.iter().zip(&absent.steps).zip(&of_air.steps) {
        assert_eq!(bounds(&one.row), bounds(&other.row));
        assert!(agree(&one.row, &air.row, 0.0));
    }
}

#[test]
fn a_round_indenter_that_is_nearly_air_changes_nothing_but_by_how_its_surface_is_bent() {
    let load = "[load]\napproach = [\"100 um\"]\ncompression = [0.0, 0.1]\n";
    let without = solve(&cylinder("[load]\ncompression = [0.0, 0.1]\n", 3e-3));
    let air = solve(&cylinder(
        &format!("[indenter]\nrole = {{ relative_permittivity = 1.00000001 }}\n{load}"),
        1e-2,
    ));
    for (step, index) in air.steps.iter().zip([0, 0, 1]) {
        assert_eq!(step.route, Some(Route::MAPPED_BOXES));
        let other = &without.steps[index].row;
        let besides =
            step.row.geometry_error_estimate.unwrap() + other.geometry_error_estimate.unwrap_or(0.0);
        assert!(agree(&step.row, other, besides), "{:?} {other:?}", step.row);
    }
}

/// A ball that approaches the paper's pair without contact.
const FAR_BALL: &str = r#"format = 1
[layer]
thickness = "450 um"
half_length = "3 mm"
relative_permittivity = 2.8
[layer.material.mooney_rivlin]
c10 = "682.15 Pa"
c01 = "43931.9 Pa"
[electrodes.in_plane_pair]
gap = "50 um"
length = "300 um"
thickness = "20 um"
width = "500 um"
height = "225 um"
shear_modulus = "1 MPa"
[mechanics.solid]
end = "free-on-substrate"
width = "4 mm"
relative_tolerance = 5e-2
indenter = { sphere = { radius = "2 mm" } }
[indenter]
role = "grounded"
[load]
approach = ["12 mm", "8 mm"]
compression = []
[surroundings]
boundary = "open"
below = { relative_permittivity = 4.4, thickness = "1.6 mm" }
above = { relative_permittivity = 1.0, thickness = "open" }
[measure]
capacitance = ["electrode-left", "electrode-right"]
[electrostatics]
relative_tolerance = 2e-2
change_tolerance = 1e-1
"#;

#[test]
fn a_far_ball_changes_the_pair_by_what_two_separate_solves_give() {
    let found = solve(FAR_BALL);
    let row = &found.steps[1].row;
    let [lower, upper] = [row.change_lower_f.unwrap(), row.change_upper_f.unwrap()];
    println!("{lower:e} {upper:e}, {:?} unknowns", row.unknowns);
    assert!(upper - lower <= 1e-1 * row.change_f.unwrap().abs());
    // Reference: a grid of 6.3 million unknowns under the map for each of the two steps, without a common
    // base.
    let [least, most] = [-46.87e-18, -46.48e-18];
    assert!(lower <= most && least <= upper, "{lower:e} {upper:e}");
    assert!(lower >= 1.05 * least && upper <= 0.95 * most, "{lower:e} {upper:e}");
    // The effect of the ball takes a small share of these unknowns.
    assert!(row.unknowns.unwrap() < 600_000, "{:?}", row.unknowns);
}

#[test]
fn an_indenter_of_air_that_comes_near_changes_nothing_at_all() {
    let ball = "[mechanics.solid]\nend = \"free-on-substrate\"\nwidth = \"3 mm\"\nrelative_tolerance = 0.5\n\
                indenter = { sphere = { radius = \"500 um\" } }\n[load]\napproach = [\"5 mm\", \"200 um\", \"10 um\"]\n\
                compression = [0.0]\n";
    let text_of = |permittivity: f64| {
        let indenter = format!("{ball}[indenter]\nrole = {{ relative_permittivity = {permittivity} }}\n");
        pair(&indenter, 3e-2).replace("[electrostatics]", "[electrostatics]\nchange_tolerance = 1e-2")
    };
    // The same ball as a body attached to the indenter.
    let taken = format!(
        "{ball}[[dielectric]]\nname = \"ball\"\nrelative_permittivity = 1.0\nattached = \"indenter\"\n\
         sphere = {{ center = [\"0 um\", \"950 um\", \"0 um\"], radius = \"500 um\" }}\n"
    );
    let taken = pair(&taken, 3e-2).replace("[electrostatics]", "[electrostatics]\nchange_tolerance = 1e-2");
    for text in [text_of(1.0), taken] {
        let found = solve(&text);
        let distances: Vec<_> = found.steps.iter().map(|step| step.row.distance_m).collect();
        assert_eq!(distances, [Some(5e-3), Some(2e-4), Some(1e-5), Some(0.0)]);
        for step in &found.steps {
            assert_eq!(step.route, Some(Route::BOXES));
            let change = [step.row.change_f, step.row.change_lower_f, step.row.change_upper_f];
            assert_eq!(change, [Some(0.0); 3]);
        }
        assert!(found.steps.iter().skip(1).all(|step| step.same_as == Some(0)));
    }
    // With another permittivity, no two steps are equal.
    let plan = Plan::new(&parse(&text_of(1.5)), &NUMBERS_ONLY);
    assert!(plan.steps.iter().all(|step| step.same_as.is_none()));
}

#[test]
fn a_body_of_air_in_air_is_left_out_whatever_its_shape_and_one_that_reaches_into_the_layer_is_not() {
    let ball = |height: f64, permittivity: f64| {
        format!(
            "[[dielectric]]\nname = \"ball\"\nrelative_permittivity = {permittivity}\n\
             sphere = {{ center = [\"0 um\", \"{height} um\", \"0 um\"], radius = \"500 um\" }}\n"
        )
    };
    let alone = solve(&pair("", 1e-3));
    let beside = solve(&pair(&ball(950.0, 1.0), 1e-3));
    assert_eq!(beside.steps[0].route, Some(Route::BOXES));
    assert_eq!(bounds(&beside.steps[0].row), bounds(&alone.steps[0].row));
    let left_out = |text: &str| {
        let plan = Plan::new(&parse(text), &NUMBERS_ONLY);
        plan.left_out.iter().any(|left| left.what == "`ball`")
    };
    assert!(left_out(&pair(&ball(950.0, 1.0), 1e-3)));
    assert!(!left_out(&pair(&ball(850.0, 1.0), 1e-3)) && !left_out(&pair(&ball(950.0, 1.1), 1e-3)));
}

#[test]
fn a_cylinder_takes_capacitance_away_the_nearer_it_comes_and_goes_over_into_contact() {
    let distances =
        ["2 mm", "500 um", "200 um", "50 um", "10 um", "2 um"].map(|d| format!("\"{d}\"")).join(", ");
    let load = format!(
        "[indenter]\nrole = \"grounded\"\n[load]\napproach = [{distances}]\ncompression = [0.0, 0.05]\n"
    );
    let outcome = solve(&cylinder(&load, 1e-2));
    let rows: Vec<&Row> = outcome.steps.iter().map(|step| &step.row).collect();
    for pair in rows.windows(2) {
        assert!(bounds(pair[1])[0] < bounds(pair[0])[1], "{pair:?}");
    }
    let value = |k: usize| rows[k].capacitance_f.unwrap();
    assert!(value(3) < 0.97 * value(0) && value(7) < 0.99 * value(6));
    let besides = rows[6].geometry_error_estimate.unwrap();
    assert!(agree(rows[5], rows[6], besides + 2e-2), "2 um away and in contact: {:?} {:?}", rows[5], rows[6]);
}

#[test]
fn a_wide_cylinder_is_that_of_its_outline_and_is_followed_into_contact() {
    let wide = "[mechanics.plane_strain]\nend = \"free-on-substrate\"\nwidth = \"1.5 mm\"\nrelative_tolerance = 0.3\n\
                indenter = { cylinder = { radius = \"8 mm\" } }\n[indenter]\nrole = \"grounded\"\n\
                [load]\napproach = [\"1 mm\", \"100 um\"]\ncompression = [0.05]\n";
    let approach = solve(&pair(wide, 1e-1));
    let by_hand = "[[conductor]]\nname = \"cylinder\"\ncylinder = { axis = \"x3\", base = [\"0 um\", \"8500 um\", \"-750 um\"], \
                   radius = \"8 mm\", height = \"1500 um\" }\n[[terminal]]\nname = \"ground\"\nconductors = [\"cylinder\"]\n\
                   potential = \"ground\"\n";
    let other = solve(&pair(by_hand, 1e-1));
    assert_eq!(other.steps[0].route, Some(Route::EXTRUDED));
    assert!(
        agree(&approach.steps[1].row, &other.steps[0].row, 0.0),
        "{:?} {:?}",
        approach.steps[1].row,
        other.steps[0].row
    );
    let values: Vec<f64> = approach.steps.iter().map(|step| step.row.capacitance_f.unwrap()).collect();
    assert!(values.windows(2).all(|pair| pair[1] < pair[0]), "{values:?}");
}

#[test]
fn a_sphere_over_the_layer_is_the_sphere_on_tetrahedra() {
    let sphere = "[mechanics.solid]\nend = \"free-on-substrate\"\nwidth = \"3 mm\"\nrelative_tolerance = 0.5\n\
                  indenter = { sphere = { radius = \"500 um\" } }\n[indenter]\nrole = \"grounded\"\n\
                  [load]\napproach = [\"200 um\"]\ncompression = [0.0]\n";
    let mapped = solve(&pair(sphere, 1e-2));
    let by_hand = "[[conductor]]\nname = \"ball\"\nsphere = { center = [\"0 um\", \"1100 um\", \"0 um\"], radius = \"500 um\" }\n\
                   [[terminal]]\nname = \"ground\"\nconductors = [\"ball\"]\npotential = \"ground\"\n";
    let other = solve(&pair(by_hand, 2e-2));
    assert_eq!(other.steps[0].route, Some(Route::TETRAHEDRA));
    let besides = other.steps[0].row.geometry_error_estimate.unwrap()
        + mapped.steps[0].row.geometry_error_estimate.unwrap();
    assert!(
        agree(&mapped.steps[0].row, &other.steps[0].row, besides),
        "{:?} {:?}",
        mapped.steps[0].row,
        other.steps[0].row
    );
    // The ball matters.
    let alone = solve(&pair("", 1e-3));
    assert!(!agree(&mapped.steps[0].row, &alone.steps[0].row, besides));
}

#[test]
fn a_punch_beside_the_middle_is_the_mirror_image_of_one_on_the_other_side() {
    let at = |position: &str, force: &str| {
        solve(&pair(
            &format!(
                "[mechanics.plane_strain]\nend = \"free-on-substrate\"\nwidth = \"1.5 mm\"\nrelative_tolerance = 0.5\n\
                 indenter = {{ flat_punch = {{ half_width = \"400 um\", corner_radius = \"60 um\", contact = \"smooth\", \
                 position = \"{position}\" }} }}\n[indenter]\nrole = \"grounded\"\nheight = \"500 um\"\n[load]\n{force}\n"
            ),
            2e-2,
        ))
    };
    let load = "compression = [0.0, 0.12]";
    let [left, right] = [at("-300 um", load), at("300 um", load)];
    for (left, right) in left.steps.iter().zip(&right.steps) {
        let besides = 2.0 * left.row.geometry_error_estimate.unwrap();
        assert!(agree(&left.row, &right.row, besides), "{:?} {:?}", left.row, right.row);
    }
    let value = |outcome: &Outcome, k: usize| outcome.steps[k].row.capacitance_f.unwrap();
    assert!(value(&left, 1) < value(&left, 0), "pressed, it is nearer");
}

#[test]
fn a_punch_of_metal_that_touches_the_layer_is_that_of_its_outline() {
    let touching = "[mechanics.plane_strain]\nend = \"free-on-substrate\"\nwidth = \"1.5 mm\"\nrelative_tolerance = 0.5\n\
                    indenter = { flat_punch = { half_width = \"400 um\", corner_radius = \"60 um\", contact = \"smooth\" } }\n\
                    [indenter]\nrole = \"grounded\"\nheight = \"500 um\"\n[load]\ncompression = [0.0]\n";
    let mapped = solve(&pair(touching, 1e-2));
    assert_eq!(mapped.steps[0].route, Some(Route::MAPPED_BOXES));
    // The round edges begin where the gap is 2 um wide.
    let outline = "[[\"-355.36 um\", \"400 um\"], [\"355.36 um\", \"400 um\"], [\"355.36 um\", \"402 um\"], \
                   { through = [\"382.4264 um\", \"417.5736 um\"], to = [\"400 um\", \"460 um\"] }, [\"400 um\", \"900 um\"], \
                   [\"-400 um\", \"900 um\"], [\"-400 um\", \"460 um\"], \
                   { through = [\"-382.4264 um\", \"417.5736 um\"], to = [\"-355.36 um\", \"402 um\"] }]";
    let by_hand = format!(
        "[[conductor]]\nname = \"punch\"\nextrusion = {{ axis = \"x3\", from = \"-750 um\", to = \"750 um\", outline = {outline} }}\n\
         [[terminal]]\nname = \"ground\"\nconductors = [\"punch\"]\npotential = \"ground\"\n"
    );
    let other = solve(&pair(&by_hand, 1e-2));
    assert_eq!(other.steps[0].route, Some(Route::EXTRUDED));
    let (one, other) = (&mapped.steps[0].row, &other.steps[0].row);
    let besides = one.geometry_error_estimate.unwrap();
    assert!(besides < 1e-3, "the layer touches metal, and no film: {besides:e}");
    assert!(agree(one, other, besides), "{one:?} {other:?}");
}

#[test]
fn a_far_ball_of_some_permittivity_changes_it_by_what_sharper_bounds_give() {
    let text = FAR_BALL.replace("role = \"grounded\"", "role = { relative_permittivity = 50.0 }");
    let text =
        text.replace("\"8 mm\"", "\"6 mm\"").replace("change_tolerance = 1e-1", "change_tolerance = 5e-1");
    let found = solve(&text);
    let row = &found.steps[1].row;
    let [lower, upper] = [row.change_lower_f.unwrap(), row.change_upper_f.unwrap()];
    println!("{lower:e} {upper:e}, {:?} unknowns", row.unknowns);
    // Known to 1e-2 of the change, which is 1.5e-4 of C and less than the spread of the bounds of C.
    let [least, most] = [-4.941e-18, -4.907e-18];
    assert!(lower <= most && least <= upper && upper < 0.0, "{lower:e} {upper:e}");
    // Without a base it needs millions of unknowns.
    assert!(row.unknowns.unwrap() < 300_000);
}
