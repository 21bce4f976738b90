//! Cases from nanometres to kilometres: capacitances scale with length, forces with its square.

use super::super::Entry;
use super::super::claim::{Claim, Truth, known, row, terminals};
use super::super::text::{Scene, Sensor, medium, to};
use super::super::truths::{CUBE_IN_CUBE, CUBE_IN_CUBE_ERROR};
use elastocap_electrostatics::VACUUM_PERMITTIVITY;

const SUBJECT: &str = "nm and km lengths";
const THIN: &str = "1 nm electrodes in a 1 mm layer";

/// The relative error of the scaling law that rounding may cause. It is not tuned.
const LAW: f64 = 1e-10;

fn cubes(scale: f64) -> Entry {
    let case = |s: f64| Scene::new().cube("cube", [0.0; 3], s).grounded([-s; 3], [s; 3], to(1e-5));
    Entry::new(SUBJECT, format!("cube of {scale:e} m"), [case(scale), case(1.0)], move |out| {
        let (found, unit) = (terminals(out, 0)?, terminals(out, 1)?);
        let truth = scale * CUBE_IN_CUBE * VACUUM_PERMITTIVITY;
        Ok(vec![
            Claim::capacitance("capacitance", found, Truth::value(truth, CUBE_IN_CUBE_ERROR)),
            Claim::formula("scales", "F", found.value, LAW, Truth::value(scale * unit.value, 0.0)),
        ])
    })
    .quick()
}

fn sensors(scale: f64) -> Entry {
    let case = |s: f64| {
        let default = Sensor::default();
        let sensor = Sensor {
            layer: s * default.layer,
            gap: s * default.gap,
            length: s * default.length,
            thickness: s * default.thickness,
            width: s * default.width,
            height: s * default.height,
            contact: s * default.contact,
            shear_length: s * default.shear_length,
            margin: default.margin.map(|margin| s * margin),
            above: medium(1.0, s * 1e-3),
            ..default
        };
        sensor.compressed(0.3).text()
    };
    Entry::new(SUBJECT, format!("sensor scaled by {scale:e}"), [case(scale), case(1.0)], move |out| {
        let (found, unit) = (terminals(out, 0)?, terminals(out, 1)?);
        let force = |case| known(row(out, case, 0)?.force_n, "force");
        let area = scale * scale;
        Ok(vec![
            Claim::formula("capacitance", "F", found.value, LAW, Truth::value(scale * unit.value, 0.0)),
            Claim::formula("lower bound", "F", found.lower, LAW, Truth::value(scale * unit.lower, 0.0)),
            Claim::formula("force", "N", force(0)?, LAW, Truth::value(area * force(1)?, 0.0)),
        ])
    })
    .quick()
}

fn shifted(by: f64) -> Entry {
    let case = |o: f64| Scene::new().cube("cube", [o; 3], 1.0).grounded([o - 1.0; 3], [o + 1.0; 3], to(1e-5));
    Entry::new(SUBJECT, format!("cube of 1 m at {by:e} m"), [case(by)], move |out| {
        let truth = Truth::value(CUBE_IN_CUBE * VACUUM_PERMITTIVITY, CUBE_IN_CUBE_ERROR);
        Ok(vec![Claim::capacitance("capacitance", terminals(out, 0)?, truth)])
    })
    .quick()
}

/// Thinner electrodes are parts of thicker ones: they have a smaller capacitance, and the last micrometre
/// hardly counts.
fn thin(stacked: bool, open: bool) -> Entry {
    let case = |thickness: f64| {
        let mut sensor =
            Sensor { stacked, layer: 1e-3, height: 0.5e-3, thickness, modulus: None, ..Sensor::default() };
        if stacked {
            (sensor.gap, sensor.length, sensor.width) = (2e-4, 1e-3, 1e-3);
        }
        if open {
            (sensor.boundary, sensor.margin, sensor.above) = ("open", None, medium(1.0, f64::INFINITY));
        }
        sensor.compressed(0.2).text()
    };
    let name = match (stacked, open) {
        (false, false) => "in-plane pair",
        (true, false) => "stacked pair",
        (false, true) => "in-plane pair, open",
        (true, true) => "stacked pair, open",
    };
    Entry::new(THIN, name, [case(1e-9), case(1e-6), case(1e-10)], |out| {
        let (found, thicker, thinner) = (terminals(out, 0)?, terminals(out, 1)?, terminals(out, 2)?);
        // The edges contribute of the order of t/a ln(a/t): 1e-4 at most with the gap of 50 um.
        let truth = Truth::between(thinner.lower, thinner.upper * (1.0 + 5e-4));
        Ok(vec![
            Claim::capacitance("against 0.1 nm", found, truth),
            Claim::capacitance("less than at 1 um", found, Truth::at_most(thicker.upper)),
        ])
    })
}

pub(super) fn entries() -> Vec<Entry> {
    let mut entries = vec![cubes(1e-9), cubes(1e-6), cubes(1e3), cubes(1e6), shifted(1e6)];
    entries.extend([1e-5, 1e-3, 1e6].map(sensors));
    entries.extend([thin(false, false), thin(true, false).quick(), thin(false, true)]);
    entries
}
