//! Electrodes at the faces of the layer, bodies that touch, planes that nearly coincide.

use super::super::Entry;
use super::super::claim::{Claim, Truth, known, row, terminals};
use super::super::text::{INSULATED, Scene, Sensor, medium, to};
use elastocap_electrostatics::VACUUM_PERMITTIVITY;

const SURFACE: &str = "electrodes at the layer's surface";
const PLANES: &str = "touching and nearly coinciding planes";

/// An insulated face is a mirror: electrodes at the face have half the capacitance of electrodes twice as
/// thick in the middle of a layer twice as thick.
fn mirrored(top: bool) -> Entry {
    let sensor = Sensor { above: INSULATED.to_owned(), ..Sensor::default() };
    let half = 0.5 * sensor.thickness;
    let flush = Sensor { height: if top { sensor.layer - half } else { half }, ..sensor.clone() };
    let double = Sensor {
        layer: 2.0 * sensor.layer,
        thickness: 2.0 * sensor.thickness,
        height: sensor.layer,
        ..sensor
    };
    let name = if top { "at the top, a mirror" } else { "at the bottom, a mirror" };
    Entry::new(SURFACE, name, [flush.text(), double.text()], |out| {
        let truth = Truth::proved(terminals(out, 1)?, 0.5);
        Ok(vec![Claim::capacitance("capacitance", terminals(out, 0)?, truth)])
    })
    .quick()
}

/// Under load the electrode stays at its face.
fn stays(top: bool, open: bool) -> Entry {
    let mut sensor = Sensor::default();
    let half = 0.5 * sensor.thickness;
    sensor.height = if top { sensor.layer - half } else { half };
    if open {
        (sensor.boundary, sensor.margin) = ("open", None);
        (sensor.below, sensor.above) = (medium(4.5, 1.6e-3), medium(1.0, f64::INFINITY));
    }
    let face = if top { sensor.layer * 0.7 } else { 0.0 };
    let side = if top { "top" } else { "bottom" };
    let name = format!("at the {side}, pressed to 0.3{}", if open { ", open" } else { "" });
    Entry::new(SURFACE, name, [sensor.compressed(0.3).text()], move |out| {
        let found = row(out, 0, 0)?;
        let (mid, thickness) =
            (known(found.electrode_height_m, "height")?, known(found.electrode_thickness_m, "thickness")?);
        let edge = if top { mid + 0.5 * thickness } else { mid - 0.5 * thickness };
        let near = Truth::between(face - 1e-18, face + 1e-18);
        Ok(vec![
            Claim::capacitance("capacitance", terminals(out, 0)?, Truth::at_least(0.0)),
            Claim::formula("outer face", "m", edge, 0.0, near),
        ])
    })
}

/// Electrodes through the whole layer touch both faces.
fn through() -> Entry {
    let default = Sensor::default();
    let sensor = Sensor {
        thickness: default.layer,
        modulus: None,
        above: INSULATED.to_owned(),
        margin: Some(1e-9),
        ..default
    };
    let plates = 2.8 * VACUUM_PERMITTIVITY * sensor.layer * sensor.width / sensor.gap;
    Entry::new(SURFACE, "at both: plates, exactly", [sensor.text()], move |out| {
        // The walls are a nanometre off the ends of the plates: there is only the field between them.
        let truth = Truth::between(plates, plates * (1.0 + 1e-3));
        Ok(vec![Claim::capacitance("capacitance", terminals(out, 0)?, truth)])
    })
    .quick()
}

/// Two cubes whose faces are off a common plane by a small share of their side.
fn near_planes(offset: f64) -> Entry {
    let cubes = |offset: f64| {
        let scene = Scene::new().conductor("left", [0.0; 3], [1.0; 3]);
        let scene = scene.conductor("right", [1.5, offset, 0.0], [2.5, 1.0 + offset, 1.0]);
        scene.grounded([-1.0; 3], [3.5, 2.0, 2.0], to(1e-3))
    };
    Entry::new(PLANES, format!("faces {offset:e} off a plane"), [cubes(offset), cubes(0.0)], move |out| {
        let flush = terminals(out, 1)?;
        let change = 10.0 * offset;
        let truth = Truth::between(flush.lower * (1.0 - change), flush.upper * (1.0 + change));
        Ok(vec![Claim::capacitance("capacitance", terminals(out, 0)?, truth)])
    })
}

/// Layered plates with a void between the layers.
fn void(thickness: f64) -> Entry {
    let (low, high) = (0.5, 0.5 + thickness);
    let scene = Scene::new().sheet("lower", 0.0, [0.0; 2], [1.0; 2]).sheet("upper", 1.0, [0.0; 2], [1.0; 2]);
    let case = scene.slab(2, 2.0, 0.0, low).slab(2, 3.0, high, 1.0).insulated([0.0; 3], [1.0; 3], to(1e-6));
    let truth = VACUUM_PERMITTIVITY / (low / 2.0 + (high - low) + (1.0 - high) / 3.0);
    Entry::new(PLANES, format!("void of {thickness:e} between slabs"), [case], move |out| {
        Ok(vec![Claim::capacitance("capacitance", terminals(out, 0)?, Truth::value(truth, 1e-14))])
    })
}

/// A dielectric box flush with a conductor on five planes, with the permittivity of its surroundings: it has
/// no effect.
fn invisible() -> Entry {
    let cube = || Scene::new().cube("cube", [0.0; 3], 1.0);
    let cases = [
        cube().dielectric(1.0, [0.5, -0.5, -0.5], [0.75, 0.5, 0.5]).grounded([-1.0; 3], [1.0; 3], to(1e-4)),
        cube().grounded([-1.0; 3], [1.0; 3], to(1e-4)),
    ];
    Entry::new(PLANES, "block of vacuum against a cube", cases, |out| {
        let truth = Truth::proved(terminals(out, 1)?, 1.0);
        Ok(vec![Claim::capacitance("capacitance", terminals(out, 0)?, truth)])
    })
    .quick()
}

/// A cube at a tiny distance above a grounded plane.
fn hair(gap: f64) -> Entry {
    let scene = Scene::new().conductor("cube", [0.0, gap, 0.0], [1.0, 1.0 + gap, 1.0]);
    let case = scene.grounded([-1.0, 0.0, -1.0], [2.0; 3], to(1e-3));
    Entry::new(PLANES, format!("cube {gap:e} above ground"), [case], move |out| {
        let truth = Truth::between(VACUUM_PERMITTIVITY / gap, VACUUM_PERMITTIVITY * (1.0 / gap + 60.0));
        Ok(vec![Claim::capacitance("capacitance", terminals(out, 0)?, truth)])
    })
}

pub(super) fn entries() -> Vec<Entry> {
    vec![
        mirrored(true),
        mirrored(false),
        stays(true, false).quick(),
        stays(false, false).quick(),
        stays(true, true),
        stays(false, true),
        through(),
        near_planes(1e-15),
        near_planes(1e-12),
        near_planes(1e-9),
        near_planes(1e-6),
        void(1e-12).quick(),
        void(1e-9).quick(),
        void(1e-6).quick(),
        invisible(),
        hair(1e-9),
        hair(1e-6).quick(),
    ]
}
