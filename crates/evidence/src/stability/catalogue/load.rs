//! Entries with small and extreme loads: compressions from 1e-12 to 0.97, and forces from nothing to more
//! than the layer can carry.

use elastocap_electrostatics::Bounded;

use super::super::Entry;
use super::super::claim::{Claim, ClaimError, Truth, known, row, terminals};
use super::super::text::{MODULUS, Sensor};
use super::super::truths::{Layer, force_at_first};

const COMPRESSION: &str = "compression 0 to 0.97";
const FORCE: &str = "force 0 to too much";

/// The relative error that the numbers of the closed form should have: it is exact to rounding, and its
/// conditioning at a compression of 0.95 costs two or three digits.
const FORMULA: f64 = 1e-11;

/// The scale of the force, 2 w L mu, N, and the shear length and the half-length of the contact over the
/// thickness of the layer.
fn force_scale_and_lengths(sensor: &Sensor) -> (f64, f64, f64) {
    let scale = 2.0 * sensor.contact * sensor.contact * MODULUS;
    (scale, sensor.shear_length / sensor.layer, sensor.contact / sensor.layer)
}

/// The claim that two capacitances are equal to a relative error.
fn same(what: &str, found: Bounded, expected: Bounded, relative: f64) -> Claim {
    // Both are solved on the same grid, deformed by different loads, so that their errors are nearly the
    // same.
    Claim::formula(what, "F", found.value, relative, Truth::value(expected.value, 0.0))
}

/// A compression so small that the first order suffices.
fn tiny(compression: f64, name: &str) -> Entry {
    let sensor = Sensor::default();
    let (scale, a, b) = force_scale_and_lengths(&sensor);
    let cases = [sensor.clone().compressed(compression).text(), sensor.clone().compressed(0.0).text()];
    Entry::new(COMPRESSION, name, cases, move |out| {
        let found = row(out, 0, 0)?;
        let force = known(found.force_n, "force")?;
        let gap = known(found.gap_m, "gap")?;
        let share = sensor.height / sensor.layer;
        let opened = sensor.gap * 3.0 * compression * (share - 0.5 * share * share);
        let (loaded, unloaded) = (terminals(out, 0)?, terminals(out, 1)?);
        let first = scale * force_at_first(compression, a, b);
        let next = 100.0 * compression;
        let mut claims = vec![
            Claim::formula("force", "N", force, FORMULA, Truth::value(first, next)),
            Claim::formula("gap", "m", gap, 4e-16, Truth::value(sensor.gap + opened, next * compression)),
            same("capacitance", loaded, unloaded, 10.0 * compression + 1e-13),
        ];
        if compression >= 1e-9 {
            // The derivative of C by the compression over C, at zero: -0.474 by differences of the acceptance
            // values at 0, 5 and 10 %.
            let slope = (1.0 - loaded.value / unloaded.value) / compression;
            claims.push(Claim::formula(
                "slope of the capacitance",
                "",
                slope,
                0.0,
                Truth::value(0.474, 0.05),
            ));
        }
        Ok(claims)
    })
    .quick()
}

/// A compression at which the printed formulas can be evaluated as they stand.
fn large(compression: f64, name: &str) -> Entry {
    let sensor = Sensor::default();
    let (scale, a, b) = force_scale_and_lengths(&sensor);
    Entry::new(COMPRESSION, name, [sensor.clone().compressed(compression).text()], move |out| {
        let found = row(out, 0, 0)?;
        let layer = Layer::new(compression);
        let share = sensor.height / sensor.layer;
        let claim = |what: &str, unit, value: Option<f64>, truth: f64| -> Result<Claim, ClaimError> {
            Ok(Claim::formula(what, unit, known(value, what)?, FORMULA, Truth::value(truth, FORMULA)))
        };
        let claims = vec![
            claim("force", "N", found.force_n, scale * layer.force(a, b))?,
            claim("gap", "m", found.gap_m, sensor.gap * layer.stretch(share))?,
            claim("height", "m", found.electrode_height_m, sensor.layer * layer.height(share))?,
            Claim::capacitance("capacitance", terminals(out, 0)?, Truth::at_least(0.0)),
        ];
        Ok(claims)
    })
}

/// Forces and capacitances against acceptance values that do not come from this program.
fn accepted() -> Entry {
    const KNOWN: [(f64, f64, f64); 3] = [
        (0.05, 0.014_193_743_29, 42.88609),
        (0.2, 0.083_099_489_87, 39.14879),
        (0.4, 0.343_679_075, 32.58304),
    ];
    let cases = KNOWN.map(|(compression, ..)| Sensor::default().compressed(compression).text());
    Entry::new(COMPRESSION, "pair at 0.05, 0.2, 0.4", cases, |out| {
        let mut claims = Vec::new();
        for (case, (compression, force, femtofarads)) in KNOWN.into_iter().enumerate() {
            let truth = Truth::value(femtofarads * 1e-15, 3e-6);
            let what = format!("capacitance at {compression}");
            claims.push(Claim::capacitance(what, terminals(out, case)?, truth));
            let found = known(row(out, case, 0)?.force_n, "force")?;
            claims.push(Claim::formula("force", "N", found, FORMULA, Truth::value(force, 1e-9)));
        }
        Ok(claims)
    })
    .quick()
}

/// A compression beyond that of the largest force: it has a capacitance, and no force.
fn beyond(compression: f64, long: bool) -> Entry {
    let mut sensor = Sensor::default();
    if long {
        (sensor.contact, sensor.shear_length) = (4.0 * sensor.layer, 4.0 * sensor.layer);
    }
    let name = format!("{compression}{}: no force there", if long { ", L = 4 H" } else { "" });
    let case = sensor.clone().compressed(compression).text();
    let mut entry = Entry::new(COMPRESSION, name, [case], move |out| {
        let found = row(out, 0, 0)?;
        if let Some(force) = found.force_n {
            return Err(ClaimError::Force(force));
        }
        let stretch = Layer::new(compression).stretch(sensor.height / sensor.layer);
        let gap = known(found.gap_m, "gap")?;
        Ok(vec![
            Claim::capacitance("capacitance", terminals(out, 0)?, Truth::at_least(0.0)),
            Claim::formula("gap", "m", gap, FORMULA, Truth::value(sensor.gap * stretch, FORMULA)),
        ])
    });
    entry.expect = super::super::Expect::Refusal;
    entry
}

/// A force so small that the layer is a linear spring.
fn tiny_force(force: f64, name: &str) -> Entry {
    let sensor = Sensor::default();
    let (scale, a, b) = force_scale_and_lengths(&sensor);
    let case = sensor.pressed(force).text();
    Entry::new(FORCE, name, [case], move |out| {
        let compression = known(row(out, 0, 0)?.compression, "compression")?;
        let first = force / (scale * force_at_first(1.0, a, b));
        let truth = Truth::value(first, 100.0 * first);
        Ok(vec![Claim::formula("compression", "", compression, FORMULA, truth)])
    })
    .quick()
}

pub(super) fn entries() -> Vec<Entry> {
    let unloaded = Entry::new(
        COMPRESSION,
        "0 is no load",
        [Sensor::default().compressed(0.0).text(), Sensor::default().text()],
        |out| {
            let force = known(row(out, 0, 0)?.force_n, "force")?;
            Ok(vec![
                Claim::capacitance("capacitance", terminals(out, 0)?, Truth::value(43.96589e-15, 2e-5)),
                same("without load", terminals(out, 0)?, terminals(out, 1)?, 1e-13),
                Claim::formula("force", "N", force, 0.0, Truth::value(0.0, 0.0)),
            ])
        },
    );
    let there_and_back = Entry::new(
        FORCE,
        "0.343679075 N is 0.4 (audit)",
        [Sensor::default().pressed(0.343_679_075).text()],
        |out| {
            let compression = known(row(out, 0, 0)?.compression, "compression")?;
            Ok(vec![Claim::formula("compression", "", compression, FORMULA, Truth::value(0.4, 1e-8))])
        },
    );
    vec![
        unloaded.quick(),
        tiny(1e-12, "1e-12"),
        tiny(1e-8, "1e-8"),
        accepted(),
        large(0.5, "0.5").quick(),
        large(0.9, "0.9"),
        large(0.94, "0.94"),
        beyond(0.95, false),
        beyond(0.97, false),
        beyond(0.8, true).quick(),
        tiny_force(1e-15, "1e-15 N"),
        tiny_force(1e-9, "1e-9 N"),
        there_and_back.quick(),
        Entry::refused(FORCE, "1 kN, more than there is", Sensor::default().pressed(1e3).text()),
        Entry::refused(FORCE, "1e300 N", Sensor::default().pressed(1e300).text()),
    ]
}
