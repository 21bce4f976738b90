//! Dielectrics whose permittivities differ by up to 1e6.

use super::super::Entry;
use super::super::claim::{Claim, Truth, terminals};
use super::super::text::{GROUNDED, INSULATED, Scene, Sensor, medium, to};
use super::super::truths::{CUBE, CUBE_IN_CUBE, CUBE_IN_CUBE_ERROR, FOUR_PI_EPS0};
use elastocap_electrostatics::VACUUM_PERMITTIVITY;

const SUBJECT: &str = "permittivity 1e-6 to 1e6";
const UNIT: ([f64; 3], [f64; 3]) = ([0.0; 3], [1.0; 3]);

fn plates() -> Scene {
    Scene::new().sheet("lower", 0.0, [0.0; 2], [1.0; 2]).sheet("upper", 1.0, [0.0; 2], [1.0; 2])
}

fn thick_plates() -> Scene {
    Scene::new().conductor("lower", [0.0; 3], [1.0, 0.2, 1.0]).conductor("upper", [0.0, 0.8, 0.0], [1.0; 3])
}

fn exactly(name: String, case: String, truth: f64) -> Entry {
    Entry::new(SUBJECT, name, [case], move |out| {
        Ok(vec![Claim::capacitance("capacitance", terminals(out, 0)?, Truth::value(truth, 1e-14))])
    })
    .quick()
}

fn series(ratio: f64) -> Entry {
    let scene = plates().slab(2, 1.0, 0.0, 0.5).slab(2, ratio, 0.5, 1.0);
    let case = scene.insulated(UNIT.0, UNIT.1, to(1e-6));
    exactly(format!("layers in series, 1 : {ratio:e}"), case, VACUUM_PERMITTIVITY / (0.5 + 0.5 / ratio))
}

fn series_of_boxes(ratio: f64) -> Entry {
    let scene = thick_plates().slab(2, 1.0, 0.2, 0.5).slab(2, ratio, 0.5, 0.8);
    let case = scene.insulated(UNIT.0, UNIT.1, to(1e-6));
    exactly(format!("series between boxes, 1 : {ratio:e}"), case, VACUUM_PERMITTIVITY / (0.3 + 0.3 / ratio))
}

fn parallel(ratio: f64) -> Entry {
    let scene = thick_plates().slab(1, 1.0, 0.0, 0.5).slab(1, ratio, 0.5, 1.0);
    let case = scene.insulated(UNIT.0, UNIT.1, to(1e-6));
    exactly(
        format!("slabs side by side, 1 : {ratio:e}"),
        case,
        VACUUM_PERMITTIVITY / 0.6 * 0.5 * (1.0 + ratio),
    )
}

/// A film between two planes, whose thickness is known only up to rounding.
fn film(thickness: f64, permittivity: f64) -> Entry {
    let (low, high) = (0.5, 0.5 + thickness);
    let case = plates().slab(2, permittivity, low, high).insulated(UNIT.0, UNIT.1, to(1e-6));
    let thickness = high - low;
    let truth = VACUUM_PERMITTIVITY / (1.0 - thickness + thickness / permittivity);
    exactly(format!("film of {permittivity:e}, {thickness:.0e} thick"), case, truth)
}

/// All of space filled: every capacitance scales with the permittivity.
fn filled(permittivity: f64) -> Entry {
    let cube = || Scene::new().cube("cube", [0.0; 3], 1.0);
    let cases = [
        cube().grounded_in(permittivity, [-1.0; 3], [1.0; 3], to(1e-5)),
        cube().open_in(permittivity, to(1e-3)),
    ];
    Entry::new(SUBJECT, format!("all of space at {permittivity:e}"), cases, move |out| {
        let (boxed, open) =
            (permittivity * CUBE_IN_CUBE * VACUUM_PERMITTIVITY, permittivity * CUBE * FOUR_PI_EPS0);
        Ok(vec![
            Claim::capacitance("in a box", terminals(out, 0)?, Truth::value(boxed, CUBE_IN_CUBE_ERROR)),
            Claim::capacitance("open", terminals(out, 1)?, Truth::value(open, 1e-12)),
        ])
    })
    .quick()
}

/// A sheet in the plane between two media: the field is that of one medium, so the mean permittivity counts.
fn sheet_between(ratio: f64) -> Entry {
    let sheet = || Scene::new().sheet("sheet", 0.0, [-0.5; 2], [0.5; 2]);
    let (min, max) = ([-1.0; 3], [1.0; 3]);
    let cases =
        [sheet().slab(2, ratio, 0.0, 1.0).grounded(min, max, to(1e-3)), sheet().grounded(min, max, to(1e-3))];
    Entry::new(SUBJECT, format!("sheet on the face of a slab of {ratio:e}"), cases, move |out| {
        let truth = Truth::proved(terminals(out, 1)?, 0.5 * (1.0 + ratio));
        Ok(vec![Claim::capacitance("capacitance", terminals(out, 0)?, truth)])
    })
}

/// A sheet on a thick slab in open space: its capacitance is less than on a half-space, and more than without
/// the slab.
fn sheet_on_slab(ratio: f64) -> Entry {
    let sheet = || Scene::new().sheet("sheet", 0.0, [-0.5; 2], [0.5; 2]);
    let cases = [sheet().slab(2, ratio, -10.0, 0.0).open(to(1e-2)), sheet().open(to(1e-3))];
    Entry::new(SUBJECT, format!("sheet on an endless slab of {ratio:e}, open"), cases, move |out| {
        let alone = terminals(out, 1)?;
        let truth = Truth::between(alone.lower, 0.5 * (1.0 + ratio) * alone.upper);
        Ok(vec![Claim::capacitance("capacitance", terminals(out, 0)?, truth)])
    })
}

/// A cube in a jacket that is nearly a conductor, or nearly a void: two boxes without a jacket give limits.
fn jacket(ratio: f64) -> Entry {
    let cube = |side| Scene::new().cube("cube", [0.0; 3], side);
    let jacketed = cube(1.0).dielectric(ratio, [-0.75; 3], [0.75; 3]);
    let cases = [
        jacketed.grounded([-1.0; 3], [1.0; 3], to(1e-3)),
        cube(1.5).grounded([-1.0; 3], [1.0; 3], to(1e-3)),
        cube(1.0).grounded([-0.75; 3], [0.75; 3], to(1e-3)),
    ];
    Entry::new(SUBJECT, format!("cube in a jacket of {ratio:e}"), cases, move |out| {
        let (outer, inner) = (terminals(out, 1)?, terminals(out, 2)?);
        // The series capacitance is short of that of the better conductor by about the ratio; a factor of 100
        // is more than enough.
        let (limit, short) = if ratio > 1.0 {
            (Truth::proved(outer, 1.0), 1.0 / ratio)
        } else {
            (Truth::proved(inner, ratio), ratio)
        };
        let truth = Truth::between(limit.low * (1.0 - 100.0 * short), limit.high);
        Ok(vec![Claim::capacitance("capacitance", terminals(out, 0)?, truth)])
    })
}

/// A block against one side of a cube: it increases the capacitance.
fn beside(ratio: f64, open: bool) -> Entry {
    let cube = |ratio: f64| {
        let scene = Scene::new().cube("cube", [0.5; 3], 1.0);
        let scene = scene.dielectric(ratio, [1.0, 0.0, 0.0], [1.5, 1.0, 1.0]);
        if open { scene.open(to(1e-2)) } else { scene.grounded([-1.0; 3], [2.5; 3], to(1e-2)) }
    };
    let where_it_is = if open { "open" } else { "in a box" };
    let name = format!("cube beside a block of {ratio:e}, {where_it_is}");
    Entry::new(SUBJECT, name, [cube(ratio), cube(1.0)], move |out| {
        let plain = terminals(out, 1)?;
        let truth = if ratio > 1.0 { Truth::at_least(plain.lower) } else { Truth::at_most(plain.upper) };
        Ok(vec![Claim::capacitance("capacitance", terminals(out, 0)?, truth)])
    })
}

/// The medium above the sensor: the capacitance grows with its permittivity.
fn cover(open: bool) -> Entry {
    let with = |above: String| {
        let sensor = Sensor { above, ..Sensor::default() };
        if open {
            let below = medium(4.5, 1.6e-3);
            Sensor { boundary: "open", margin: None, below, ..sensor }.text()
        } else {
            sensor.text()
        }
    };
    let cases = [
        with(INSULATED.to_owned()),
        with(medium(1e-6, 1e-3)),
        with(medium(1.0, 1e-3)),
        with(medium(1e6, 1e-3)),
        with(GROUNDED.to_owned()),
    ];
    let name = if open { "cover of 1e-6, 1, 1e6 in open space" } else { "cover of 1e-6, 1, 1e6" };
    Entry::new(SUBJECT, name, cases, |out| {
        let mut claims = Vec::new();
        for (less, more) in [(0, 1), (1, 2), (2, 3)] {
            let truth = Truth::at_least(terminals(out, less)?.lower);
            claims.push(Claim::capacitance("grows with the cover's", terminals(out, more)?, truth));
        }
        // A grounded plane has more effect than any dielectric.
        let truth = Truth::at_most(terminals(out, 4)?.upper);
        claims.push(Claim::capacitance("less than grounded", terminals(out, 3)?, truth));
        Ok(claims)
    })
}

pub(super) fn entries() -> Vec<Entry> {
    let mut entries = Vec::new();
    entries.extend([1e-6, 1e-3, 1e3, 1e6].map(series));
    entries.extend([1e-6, 1e6].map(series_of_boxes));
    entries.extend([1e-6, 1e6].map(parallel));
    entries.extend([film(1e-6, 1e-6), film(1e-9, 1e-6), film(1e-6, 1e6)]);
    entries.extend([1e-6, 1e6].map(filled));
    entries.extend([1e-6, 1e6].map(sheet_between));
    entries.extend([10.0, 1e6].map(sheet_on_slab));
    entries.extend([1e-6, 1e6].map(jacket));
    entries.extend([beside(1e-6, false), beside(1e6, false), beside(1e-6, true), beside(1e6, true)]);
    entries.extend([cover(false), cover(true)]);
    entries
}
