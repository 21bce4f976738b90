//! Plates at distances from 1e-5 to 1e3 of their width, and needles.

use super::super::Entry;
use super::super::claim::{Claim, Truth, terminals};
use super::super::text::{Scene, to};
use super::super::truths::{FOUR_PI_EPS0, PLATES_SIDE, PLATES_TENTH, far_cubes, near_plates, needle};
use elastocap_electrostatics::VACUUM_PERMITTIVITY;

const SUBJECT: &str = "gap/width 1e-5 to 1e3";
const SHAPE: &str = "thin and long bodies";

fn sheets(gap: f64) -> String {
    let scene = Scene::new().sheet("lower", 0.0, [0.0; 2], [1.0; 2]).sheet("upper", gap, [0.0; 2], [1.0; 2]);
    scene.open(to(1e-3))
}

/// An entry of one case with the claim that its two-terminal capacitance has these limits.
fn capacitance_entry(subject: &'static str, name: String, case: String, truth: Truth) -> Entry {
    Entry::new(subject, name, [case], move |out| {
        Ok(vec![Claim::capacitance("capacitance", terminals(out, 0)?, truth)])
    })
}

fn near(gap: f64) -> Entry {
    let [low, high] = near_plates(gap);
    capacitance_entry(SUBJECT, format!("sheets, {gap:e}"), sheets(gap), Truth::between(low, high))
}

/// Boxes have a larger capacitance than the sheets on their facing sides, and a smaller one than these sheets
/// with a cube each.
fn near_boxes(gap: f64) -> Entry {
    let scene = Scene::new().conductor("lower", [0.0; 3], [1.0, 0.1, 1.0]);
    let scene = scene.conductor("upper", [0.0, 0.1 + gap, 0.0], [1.0, 0.2 + gap, 1.0]);
    let real = (0.1 + gap) - 0.1;
    let [low, high] = near_plates(real);
    let truth = Truth::between(low.max(VACUUM_PERMITTIVITY / real), high + FOUR_PI_EPS0);
    capacitance_entry(SUBJECT, format!("boxes, {gap:e}"), scene.open(to(1e-3)), truth)
}

fn far(distance: f64) -> Entry {
    let scene = Scene::new().cube("first", [0.0; 3], 1.0).cube("second", [distance, 0.0, 0.0], 1.0);
    let (value, relative) = far_cubes(distance);
    capacitance_entry(
        SUBJECT,
        format!("cubes, {distance:e}"),
        scene.open(to(1e-3)),
        Truth::value(value, relative),
    )
}

fn long_needle(length: f64, tolerance: f64) -> Entry {
    let case = Scene::new().conductor("needle", [0.0; 3], [length, 1.0, 1.0]).open(to(tolerance));
    let [low, high] = needle(length, 1.0).map(|c| c * FOUR_PI_EPS0);
    capacitance_entry(SHAPE, format!("needle of aspect {length:e}"), case, Truth::between(low, high))
}

/// Plates 1 nm thick, 1 mm apart and wide, against sheets.
fn nanometre_plates() -> Entry {
    let scene = Scene::new().conductor("lower", [0.0, -1e-9, 0.0], [1e-3, 0.0, 1e-3]);
    let case = scene.conductor("upper", [0.0, 1e-3, 0.0], [1e-3, 1e-3 + 1e-9, 1e-3]).open(to(1e-3));
    // Thickness adds of the order of t/a ln(a/t), 1.4e-5.
    let sheets = 1e-3 * PLATES_SIDE * FOUR_PI_EPS0;
    capacitance_entry(
        SHAPE,
        "plates 1 nm thick, 1 mm wide".to_owned(),
        case,
        Truth::between(sheets, sheets * (1.0 + 1e-4)),
    )
}

/// A tiny cube in a box so large that it might be open space: walls at a distance R raise the capacitance C
/// by the factor 1 + C / (4 pi eps0 R) + ...
fn tiny_in_large(side: f64) -> Entry {
    let case = Scene::new().cube("cube", [0.0; 3], side).grounded([-1.0; 3], [1.0; 3], to(1e-3));
    let open = side * super::super::truths::CUBE * FOUR_PI_EPS0;
    let truth = Truth::between(open, open * (1.0 + 2.0 * side));
    capacitance_entry(SHAPE, format!("cube of {side:e} in a box of 2"), case, truth)
}

/// The smaller of two bodies hardly changes the larger.
fn tiny_beside_large() -> Entry {
    let scene = Scene::new().cube("large", [0.0; 3], 1.0).cube("tiny", [0.6, 0.0, 0.0], 1e-6);
    let cases = [
        scene.grounded([-1.0; 3], [1.0; 3], to(1e-2)),
        Scene::new().cube("large", [0.0; 3], 1.0).grounded([-1.0; 3], [1.0; 3], to(1e-3)),
    ];
    Entry::new(SHAPE, "cube of 1e-6 beside one of 1", cases, |out| {
        let alone = terminals(out, 1)?;
        let with = super::super::claim::maxwell(out, 0, 0, 0)?;
        let truth = Truth::between(alone.lower, alone.upper * (1.0 + 1e-5));
        Ok(vec![Claim::capacitance("of the large one", with, truth)])
    })
}

pub(super) fn entries() -> Vec<Entry> {
    let known = |gap: f64, value: f64| {
        capacitance_entry(
            SUBJECT,
            format!("sheets, {gap:e}"),
            sheets(gap),
            Truth::value(value * FOUR_PI_EPS0, 1e-11),
        )
    };
    vec![
        near(1e-5).quick(),
        near(1e-3),
        near(1e-2),
        known(0.1, PLATES_TENTH).quick(),
        known(1.0, PLATES_SIDE),
        near_boxes(1e-5),
        far(10.0),
        far(100.0),
        far(1e3),
        nanometre_plates(),
        long_needle(1e2, 1e-2).quick(),
        long_needle(1e4, 1e-2),
        tiny_in_large(1e-3),
        tiny_in_large(1e-6),
        tiny_beside_large(),
    ]
}
