//! Walls from a nanometre to a kilometre off the electrodes: insulated ones give less capacitance than open
//! space, grounded ones more.

use super::super::Entry;
use super::super::claim::{Claim, Truth, terminals};
use super::super::text::{GROUNDED, Sensor, medium};

const SUBJECT: &str = "side margins 1 nm to 1 km";

fn open() -> Sensor {
    Sensor { boundary: "open", margin: None, above: medium(1.0, f64::INFINITY), ..Sensor::default() }
        .compressed(0.2)
}

fn walled(boundary: &'static str, margin: f64) -> Sensor {
    Sensor { boundary, margin: Some(margin), ..Sensor::default() }.compressed(0.2)
}

fn ordered(margin: f64) -> Entry {
    let cases = [walled("insulated", margin).text(), open().text(), walled("grounded", margin).text()];
    Entry::new(SUBJECT, format!("{margin:e} m: insulated, open, grounded"), cases, |out| {
        let (insulated, open, grounded) = (terminals(out, 0)?, terminals(out, 1)?, terminals(out, 2)?);
        Ok(vec![
            Claim::capacitance("less than open", insulated, Truth::at_most(open.upper)),
            Claim::capacitance("more than open", grounded, Truth::at_least(open.lower)),
            Claim::capacitance("open", open, Truth::between(insulated.lower, grounded.upper)),
        ])
    })
}

/// Distant walls on all sides approximate open space: their effect falls with the cube of the distance.
fn converges(boundary: &'static str, distance: f64) -> Entry {
    let far = Sensor { above: medium(1.0, distance), ..walled(boundary, distance) };
    Entry::new(
        SUBJECT,
        format!("{boundary}, {distance:e} m on all sides"),
        [far.text(), open().text()],
        move |out| {
            let open = terminals(out, 1)?;
            // The sensor is 0.7 mm across.
            let change = (2e-3 / distance).powi(3);
            let truth = Truth::between(open.lower * (1.0 - change), open.upper * (1.0 + change));
            Ok(vec![Claim::capacitance("capacitance", terminals(out, 0)?, truth)])
        },
    )
}

/// A grounded plane below as well, so that both electrodes have large capacitances to ground.
fn all_grounded() -> Entry {
    let with = |below: &str| {
        Sensor { below: below.to_owned(), above: GROUNDED.to_owned(), ..walled("grounded", 1e-6) }.text()
    };
    Entry::new(SUBJECT, "grounded all around, 1e-6 m", [with(GROUNDED), with("\"insulated\"")], |out| {
        let truth = Truth::at_least(terminals(out, 1)?.lower);
        Ok(vec![Claim::capacitance("more than with five walls", terminals(out, 0)?, truth)])
    })
}

pub(super) fn entries() -> Vec<Entry> {
    let mut entries: Vec<_> = [1e-9, 1e-6, 1e-4, 1e-2, 1.0, 1e3].map(ordered).into();
    entries.extend([converges("insulated", 0.1), converges("grounded", 0.1), converges("insulated", 10.0)]);
    entries.push(all_grounded().quick());
    entries
}
