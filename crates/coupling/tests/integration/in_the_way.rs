//! Bodies near a layer whose surface, or whose indenter, a map bends: what the plan says of a step is what a
//! run says.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use elastocap_coupling::outcome::{Outcome, Status};
use elastocap_coupling::plan::Plan;
use elastocap_coupling::run::run;

use crate::common::{NUMBERS_ONLY, parse, solve};

const PAIR: &str = r#"[electrodes.in_plane_pair]
gap = "60 um"
length = "200 um"
thickness = "40 um"
width = "300 um"
height = "150 um"
shear_modulus = "100 kPa"
"#;

const BODIES: &str = r#"[[conductor]]
name = "left"
attached = "layer"
box = { min = ["-230 um", "130 um", "-150 um"], max = ["-30 um", "170 um", "150 um"] }
[[conductor]]
name = "right"
attached = "layer"
box = { min = ["30 um", "130 um", "-150 um"], max = ["230 um", "170 um", "150 um"] }
"#;

const PADS: &str = r#"[[conductor]]
name = "left"
box = { min = ["-230 um", "-20 um", "-150 um"], max = ["-30 um", "0 um", "150 um"] }
[[conductor]]
name = "right"
box = { min = ["30 um", "-20 um", "-150 um"], max = ["230 um", "0 um", "150 um"] }
"#;

const BONDED: [&str; 2] = ["plane_strain", "flat_punch = { half_width = \"300 um\", contact = \"bonded\" }"];
const CYLINDER: [&str; 2] = ["plane_strain", "cylinder = { radius = \"600 um\" }"];
const BALL: [&str; 2] = ["solid", "sphere = { radius = \"800 um\" }"];
const WHOLE_TOP: [&str; 2] = ["plane_strain", ""];

const OPEN: &str = "boundary = \"open\"\nabove = { relative_permittivity = 1.0, thickness = \"open\" }";
const WALLS: &str = "boundary = \"grounded\"\nside_margin = \"800 um\"\n\
     above = { relative_permittivity = 1.0, thickness = \"3 mm\", then = \"grounded\" }";

const PRESSED: &str = "compression = [0.12]";
const APPROACH: &str = "approach = [\"50 um\"]\ncompression = []";
const METAL: &str = "[indenter]\nrole = \"grounded\"\n";

/// A layer of 400 um with conductors in it, and a plate with these ends along x1 and x2, um.
fn case(
    electrodes: &str,
    [[left, right], [low, high]]: [[f64; 2]; 2],
    [model, indenter]: [&str; 2],
    [walls, load, role]: [&str; 3],
) -> String {
    let indenter = if indenter.is_empty() { "\"whole-top\"".to_owned() } else { format!("{{ {indenter} }}") };
    let space = if model == "solid" { "side = \"free\"\n" } else { "" };
    format!(
        r#"format = 1
[layer]
thickness = "400 um"
half_length = "2 mm"
relative_permittivity = 2.8
[layer.material.neo_hookean]
shear_modulus = "100 kPa"
bulk_modulus = "1 MPa"
{electrodes}
[[conductor]]
name = "plate"
box = {{ min = ["{left} um", "{low} um", "-100 um"], max = ["{right} um", "{high} um", "100 um"] }}
[mechanics.{model}]
end = "free"
{space}width = "2 mm"
relative_tolerance = 0.2
indenter = {indenter}
{role}[load]
{load}
[surroundings]
{walls}
below = {{ relative_permittivity = 4.4, thickness = "500 um" }}
[electrostatics]
relative_tolerance = 0.5
"#
    )
}

/// The failure of the last step that the plan forecasts, the one that it considers possible, and the one of a
/// run.
fn failures(text: &str) -> (String, String, String) {
    let case = parse(text);
    let plan = Plan::new(&case, &NUMBERS_ONLY);
    let step = plan.steps.last().unwrap();
    let [forecast, doubt] = [&step.failure, &step.doubt]
        .map(|failure| failure.as_ref().map_or_else(String::new, ToString::to_string));
    let Outcome { steps, .. } = run(&case, &plan, &NUMBERS_ONLY, &Arc::new(AtomicBool::new(false)), &());
    let found = match &steps.last().unwrap().row.status {
        Status::Failed(failure) => failure.to_string(),
        _ => String::new(),
    };
    (forecast, doubt, found)
}

const ABOVE: [[f64; 2]; 2] = [[-100.0, 100.0], [520.0, 560.0]];
const NEAR: [[f64; 2]; 2] = [[-100.0, 100.0], [430.0, 460.0]];
const BESIDE: [[f64; 2]; 2] = [[900.0, 1000.0], [430.0, 470.0]];
const FAR_BESIDE: [[f64; 2]; 2] = [[6000.0, 6200.0], [430.0, 470.0]];
const AT_THE_WALL: [[f64; 2]; 2] = [[-100.0, 100.0], [3300.0, 3390.0]];

#[test]
fn what_is_in_the_way_of_a_map_is_foretold() {
    for (electrodes, plate, indenter, rest) in [
        (BODIES, NEAR, WHOLE_TOP, [OPEN, PRESSED, ""]),
        (BODIES, BESIDE, WHOLE_TOP, [WALLS, PRESSED, ""]),
        (BODIES, BESIDE, WHOLE_TOP, [OPEN, "force = [\"20 mN\"]", ""]),
        (BODIES, NEAR, BONDED, [WALLS, PRESSED, ""]),
        (BODIES, BESIDE, BONDED, [OPEN, PRESSED, ""]),
        (BODIES, [[700.0, 800.0], [600.0, 650.0]], BALL, [OPEN, APPROACH, METAL]),
        (PAIR, [[700.0, 800.0], [600.0, 650.0]], CYLINDER, [OPEN, APPROACH, METAL]),
    ] {
        let text = case(electrodes, plate, indenter, rest);
        let (forecast, doubt, found) = failures(&text);
        assert!(forecast.contains("`plate` lies in the way of the indenter"), "{text}: {forecast} {doubt}");
        assert_eq!((&forecast, ""), (&found, doubt.as_str()), "{text}");
    }
    let (forecast, _, found) = failures(&case(BODIES, AT_THE_WALL, WHOLE_TOP, [WALLS, PRESSED, ""]));
    assert!(forecast.contains("the wall above the layer, which moves with it, reaches it"), "{forecast}");
    assert_eq!(forecast, found);
}

#[test]
fn a_step_that_only_the_deformed_layer_tells_of_is_said_to_be_in_doubt() {
    let text = case(BODIES, [[1500.0, 1700.0], NEAR[1]], BONDED, [OPEN, PRESSED, ""]);
    let (forecast, doubt, _) = failures(&text);
    assert!(forecast.is_empty() && doubt.contains("`plate` lies in the way of the indenter"), "{forecast}");
    let mut plan = Plan::new(&parse(&text), &NUMBERS_ONLY);
    plan.warnings.retain(|warning| warning.contains("may fail, as the deformed layer will show: `plate`"));
    assert_eq!(plan.warnings.len(), 1);
}

#[test]
fn plates_above_or_far_beside_the_layer_are_not_in_the_way() {
    for (plate, indenter, walls) in
        [(ABOVE, WHOLE_TOP, WALLS), (ABOVE, BONDED, OPEN), (FAR_BESIDE, BONDED, OPEN)]
    {
        let text = case(BODIES, plate, indenter, [walls, PRESSED, ""]);
        assert_eq!(failures(&text), Default::default(), "{text}");
    }
}

#[test]
fn a_plate_that_is_tilted_on_a_flat_top_is_not_in_its_own_way() {
    for load in ["compression", "force"] {
        let [rest, pressed] = if load == "force" { ["\"0 N\"", "\"20 mN\""] } else { ["0.0", "0.02"] };
        let steps = format!(
            "steps = [{{ {load} = {rest} }}, {{ {load} = {pressed}, tilt = [\"0.2 deg\", \"0 deg\"] }}]"
        );
        let top = [[-100.0, 100.0], [400.0, 430.0]];
        let text = case(PADS, top, WHOLE_TOP, [OPEN, &steps, ""])
            .replace("name = \"plate\"", "name = \"plate\"\nattached = \"layer-top\"");
        assert_eq!(failures(&text), Default::default(), "{text}");
    }
}

/// Under a plate over the whole top of a layer with fixed ends, all heights in it shrink by the same ratio,
/// so that the deformed scene is known without finite elements.
#[test]
fn plates_above_a_flat_top_give_the_capacitance_of_the_scene_with_a_thinner_layer() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../tests/acceptance/found3/fixed-plates-above-a-flat-top.toml");
    let pressed = std::fs::read_to_string(path).unwrap();
    let mut thinner = pressed.clone();
    for (from, to) in [
        ("thickness = \"0.0626 mm\"", "thickness = \"0.056653 mm\""),
        ("\"0.0474508 mm\"", "\"0.042942974 mm\""),
        ("\"0.0537108 mm\"", "\"0.048608274 mm\""),
        ("compression = 0.095", "compression = 0.0"),
    ] {
        assert!(thinner.contains(from), "{from}");
        thinner = thinner.replace(from, to);
    }
    let bounds = |text: &str| {
        let outcome = solve(text);
        let row = &outcome.steps[0].row;
        let besides =
            row.geometry_error_estimate.unwrap_or(0.0) + row.mechanics_error_estimate.unwrap_or(0.0);
        let [low, high] = [row.capacitance_lower_f, row.capacitance_upper_f].map(Option::unwrap);
        assert!(besides < 1e-2, "{besides}");
        [low * (1.0 - besides), high * (1.0 + besides)]
    };
    let ([a, b], [c, d]) = (bounds(&pressed), bounds(&thinner));
    assert!(a <= d && c <= b, "{a:e} to {b:e}, {c:e} to {d:e}");
}
