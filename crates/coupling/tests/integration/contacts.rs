//! Conductors that touch what presses, or one another, where a load or a pose brings them together.

use elastocap_coupling::plan::{Options, Plan};

use crate::common::{parse, solve};

/// A pair inside a layer of 50 um under a plate of 200 um by 100 um, 400 um high, and other bodies.
fn scene(bodies: &str, role: &str, load: &str) -> String {
    format!(
        r#"format = 1
[layer]
thickness = "50 um"
relative_permittivity = 3
[layer.material.neo_hookean]
shear_modulus = "90 kPa"
[electrodes.in_plane_pair]
gap = "10 um"
length = "100 um"
thickness = "1 um"
width = "200 um"
height = "25 um"
shear_modulus = "rigid"
{bodies}
[mechanics.closed_form]
contact_half_length = "100 um"
contact_width = "100 um"
shear_length = "100 um"
[indenter]
role = {role}
height = "400 um"
[load]
{load}
[surroundings]
boundary = "open"
[electrostatics]
relative_tolerance = 0.3
"#
    )
}

/// A box with these ends along x1, x2 and x3, um.
fn body(attached: &str, ends: [[f64; 2]; 3]) -> String {
    let [min, max] = [0, 1].map(|end| ends.map(|range| format!("\"{} um\"", range[end])).join(", "));
    format!(
        "[[conductor]]\nname = \"shield\"\nattached = \"{attached}\"\nbox = {{ min = [{min}], max = [{max}] }}\n"
    )
}

const GROUNDED: &str = "\"grounded\"";
const AT_REST: &str = "compression = [0.0]";
const GROUND: &str = "[[terminal]]\nname = \"ground\"\nconductors = [\"shield\"]\npotential = \"ground\"\n";

/// The failures of the steps of a case that its plan knows of; empty where a step has none.
fn failures(text: &str) -> Vec<String> {
    let plan = Plan::new(&parse(text), &Options::default());
    plan.steps
        .iter()
        .map(|step| step.failure.as_ref().map_or_else(String::new, ToString::to_string))
        .collect()
}

/// Whether a failure names the shield and the indenter.
fn names_both(failure: &str) -> bool {
    failure.contains("`shield` and `indenter`") && failure.contains("touch")
}

#[test]
fn a_conductor_that_touches_the_indenter_is_refused_and_both_are_named() {
    let [x, z] = [[-40.0, 60.0], [-30.0, 30.0]];
    for (role, floating) in [(GROUNDED, ""), ("\"floating\"", ""), (GROUNDED, "charge = \"0 C\"\n")] {
        for (attached, ends) in [
            // On the top under the plate, at its side, reaching into it, inside it, on it.
            ("layer-top", [x, [50.0, 60.0], z]),
            ("layer-top", [[100.0, 160.0], [60.0, 70.0], z]),
            ("layer-top", [[90.0, 160.0], [60.0, 70.0], z]),
            ("layer-top", [x, [60.0, 70.0], z]),
            ("indenter", [x, [450.0, 460.0], z]),
            ("fixed", [[90.0, 160.0], [60.0, 70.0], z]),
            ("layer", [x, [40.0, 50.0], z]),
        ] {
            let shield = body(attached, ends).replace("box =", &format!("{floating}box ="));
            let messages = failures(&scene(&shield, role, AT_REST));
            assert!(messages.iter().all(|text| names_both(text)), "{attached} {ends:?}: {messages:?}");
        }
    }
    for (attached, ends) in [
        ("layer-top", [[101.0, 160.0], [50.0, 70.0], z]),
        ("indenter", [x, [451.0, 460.0], z]),
        ("layer", [x, [40.0, 49.0], z]),
        ("layer", [[101.0, 160.0], [40.0, 50.0], z]),
    ] {
        assert_eq!(failures(&scene(&body(attached, ends), GROUNDED, AT_REST)), [""], "{attached} {ends:?}");
    }
    let dielectric =
        scene(&body("layer-top", [x, [50.0, 60.0], z]), "{ relative_permittivity = 3.5 }", AT_REST);
    assert_eq!(failures(&dielectric), [""]);
}

#[test]
fn a_load_a_distance_a_shift_or_a_tilt_may_bring_a_conductor_to_the_indenter() {
    let is_touched = |shield: &str, load: &str| {
        failures(&scene(shield, GROUNDED, load)).iter().map(|text| names_both(text)).collect::<Vec<_>>()
    };
    // What stays where it is, above the plate at rest and above one that comes near.
    let above = body("fixed", [[-40.0, 60.0], [455.0, 465.0], [-30.0, 30.0]]);
    assert_eq!(
        is_touched(&above, "approach = [\"50 um\", \"10 um\", \"1 um\"]\ncompression = [0.0, 0.2]"),
        [true, true, false, false, false]
    );
    // Beside the plate, and shifted or tilted into it.
    let beside = body("layer-top", [[110.0, 160.0], [50.0, 60.0], [-30.0, 30.0]]);
    let steps = "steps = [{ compression = 0.1 }, { compression = 0.1, shift = [\"-10 um\", \"0 um\"] }, \
                 { compression = 0.1, shift = [\"-9 um\", \"0 um\"] }]";
    assert_eq!(is_touched(&beside, steps), [false, true, false]);
    // A wall beside the plate that leans over to it.
    let upright = body("layer-top", [[110.0, 120.0], [50.0, 200.0], [-30.0, 30.0]]);
    let steps = "steps = [{ compression = 0.1, tilt = [\"5 deg\", \"0 deg\"] }]";
    assert_eq!(is_touched(&upright, steps), [true]);
}

#[test]
fn conductors_that_are_brought_together_are_refused_as_those_that_touch_at_rest() {
    let fixed = "[[conductor]]\nname = \"lid\"\nbox = { min = [\"-40 um\", \"900 um\", \"-30 um\"], max = [\"60 um\", \"950 um\", \"30 um\"] }\n";
    let moving = body("indenter", [[-40.0, 60.0], [460.0, 470.0], [-30.0, 30.0]]);
    let load = "approach = [\"500 um\", \"450 um\", \"1 um\"]\ncompression = []";
    let messages = failures(&scene(&format!("{fixed}{moving}"), "{ relative_permittivity = 3.5 }", load));
    let meet: Vec<bool> = messages.iter().map(|text| text.contains("`lid` and `shield` touch")).collect();
    assert_eq!(meet, [false, true, false], "{messages:?}");
}

#[test]
fn a_round_indenter_is_looked_at_as_it_is_and_not_as_the_box_around_it() {
    let under = |x: f64| {
        let shield = body("fixed", [[x, x + 100.0], [60.0, 70.0], [-30.0, 30.0]]);
        scene(&shield, GROUNDED, "compression = [0.0, 0.2]")
            .replace("height = \"400 um\"\n", "")
            .replace("relative_permittivity = 3\n", "relative_permittivity = 3\nhalf_length = \"2 mm\"\n")
            .replace(
                "[mechanics.closed_form]\ncontact_half_length = \"100 um\"\ncontact_width = \"100 um\"\nshear_length = \"100 um\"\n",
                "[mechanics.solid]\nwidth = \"4 mm\"\nend = \"free-on-substrate\"\nindenter = { sphere = { radius = \"500 um\" } }\n",
            )
    };
    // The ball is 10 um above the layer 99.5 um from its middle, and 20 um 140 um from it.
    assert!(failures(&under(130.0)).iter().all(|text| names_both(text)));
    let messages = failures(&under(150.0));
    assert!(!names_both(&messages[0]) && names_both(&messages[1]), "{messages:?}");
}

#[test]
fn a_grounded_conductor_may_touch_a_grounded_plate_and_is_one_with_it() {
    let shield = body("layer-top", [[-40.0, 60.0], [50.0, 60.0], [-30.0, 30.0]]);
    let implied = scene(&format!("{shield}{GROUND}"), GROUNDED, AT_REST);
    let listed = implied.replace("[\"shield\"]", "[\"shield\", \"indenter\"]");
    let without = scene("", GROUNDED, AT_REST);
    // What lies in the plate changes nothing.
    let [implied, listed, without] = [implied, listed, without].map(|text| {
        let row = solve(&text).steps[0].row.clone();
        [row.capacitance_lower_f.unwrap(), row.capacitance_upper_f.unwrap()]
    });
    assert_eq!(implied, listed);
    assert!(implied[0] <= without[1] && without[0] <= implied[1], "{implied:?} {without:?}");
    let floating = scene(&format!("{shield}{GROUND}"), "\"floating\"", AT_REST);
    assert!(names_both(&failures(&floating)[0]));
}

#[test]
fn everyday_slips_under_a_grounded_plate_are_foretold() {
    for text in [
        include_str!("../../../../tests/acceptance/found3/conductor-in-indenter-a.toml"),
        include_str!("../../../../tests/acceptance/found3/conductor-in-indenter-1e-2.toml"),
    ] {
        assert!(failures(text).iter().all(|text| names_both(text)), "{:?}", failures(text));
    }
    let tilted =
        include_str!("../../../../tests/acceptance/found3/conductor-in-indenter-contradicts-itself.toml");
    assert!(
        failures(tilted).iter().all(|text| text.contains("`b0` and `indenter`")),
        "{:?}",
        failures(tilted)
    );
}
