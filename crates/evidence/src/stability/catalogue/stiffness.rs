//! Electrodes from almost liquid to rigid.

use super::super::Entry;
use super::super::claim::{Claim, Truth, known, row, terminals};
use super::super::text::{MODULUS, Sensor};
use super::super::truths::{Layer, thinning};

const SUBJECT: &str = "mu_e/mu 1 to 1e8";
const COMPRESSION: f64 = 0.5;

fn sensor(ratio: f64) -> Sensor {
    let modulus = ratio.is_finite().then_some(ratio * MODULUS);
    Sensor { modulus, ..Sensor::default() }.compressed(COMPRESSION)
}

/// The load on the electrodes, f^2 - f^-2 with the stretch f of the layer at their height.
fn load() -> f64 {
    let sensor = Sensor::default();
    let f = Layer::new(COMPRESSION).stretch(sensor.height / sensor.layer);
    f * f - 1.0 / (f * f)
}

/// Electrodes that the load thins: their thickness, and the capacitance, which differs from that of rigid
/// electrodes by less than the thinning allows.
fn thinned(ratio: f64) -> Entry {
    let cases = [sensor(ratio).text(), sensor(f64::INFINITY).text()];
    Entry::new(SUBJECT, format!("{ratio:e}"), cases, move |out| {
        let found = known(row(out, 0, 0)?.electrode_thickness_m, "thickness")?;
        let stretch = thinning(load() / ratio);
        let truth = Truth::value(Sensor::default().thickness * stretch, 1e-11);
        let (soft, rigid) = (terminals(out, 0)?, terminals(out, 1)?);
        // Thinner and longer by as much: the capacitance changes by less than both together.
        let change = 2.0 * (1.0 / stretch - 1.0) + 1e-12;
        Ok(vec![
            Claim::formula("thickness", "m", found, 1e-12, truth),
            Claim::capacitance(
                "capacitance against rigid",
                soft,
                Truth::between(rigid.lower * (1.0 - change), rigid.upper * (1.0 + change)),
            ),
            Claim::formula(
                "change from rigid",
                "",
                soft.value / rigid.value,
                change,
                Truth::value(1.0, 1e-3),
            ),
        ])
    })
    .quick()
}

pub(super) fn entries() -> Vec<Entry> {
    let rigid = Entry::new(SUBJECT, "rigid", [sensor(f64::INFINITY).text()], |out| {
        let found = known(row(out, 0, 0)?.electrode_thickness_m, "thickness")?;
        let truth = Truth::value(Sensor::default().thickness, 0.0);
        Ok(vec![Claim::formula("thickness", "m", found, 0.0, truth)])
    });
    let softer = Entry::new(SUBJECT, "1e-8, liquid", [sensor(1e-8).text()], |out| {
        // t/T tends to (mu_e / mu / (f^2 - f^-2))^(1/2) where the electrode is much softer than the layer.
        let found = known(row(out, 0, 0)?.electrode_thickness_m, "thickness")?;
        let limit = Sensor::default().thickness * (1e-8 / load()).sqrt();
        Ok(vec![Claim::formula("thickness", "m", found, 1e-12, Truth::value(limit, 1e-7))])
    });
    let equal = Entry::new(SUBJECT, "1: thins as the layer, t = T / f", [sensor(1.0).text()], |out| {
        let found = row(out, 0, 0)?;
        let (thickness, gap) = (known(found.electrode_thickness_m, "thickness")?, known(found.gap_m, "gap")?);
        let before = Sensor::default();
        let truth = Truth::value(before.thickness * before.gap / gap, 1e-12);
        Ok(vec![Claim::formula("thickness", "m", thickness, 1e-12, truth)])
    });
    vec![equal.quick(), thinned(1.0), thinned(1e3), thinned(1e8), rigid.quick(), softer]
}
