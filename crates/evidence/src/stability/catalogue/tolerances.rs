//! Tolerances from 0.5 to values that double precision cannot reach, with bounds and without.

use super::super::Entry;
use super::super::claim::{Claim, Truth, terminals};
use super::super::text::{Scene, Solve, estimated, to};
use super::super::truths::{CUBE, CUBE_IN_CUBE, CUBE_IN_CUBE_ERROR, FOUR_PI_EPS0};
use elastocap_electrostatics::VACUUM_PERMITTIVITY;

const SUBJECT: &str = "tolerance 0.5 to 1e-12";

fn boxed(name: String, solve: Solve) -> Entry {
    let case = Scene::new().cube("cube", [0.0; 3], 1.0).grounded([-1.0; 3], [1.0; 3], solve);
    Entry::new(SUBJECT, name, [case], |out| {
        let truth = Truth::value(CUBE_IN_CUBE * VACUUM_PERMITTIVITY, CUBE_IN_CUBE_ERROR);
        Ok(vec![Claim::capacitance("capacitance", terminals(out, 0)?, truth)])
    })
}

fn isolated(name: String, solve: Solve) -> Entry {
    let case = Scene::new().cube("cube", [0.0; 3], 1.0).open(solve);
    Entry::new(SUBJECT, name, [case], |out| {
        let truth = Truth::value(CUBE * FOUR_PI_EPS0, 1e-13);
        Ok(vec![Claim::capacitance("capacitance", terminals(out, 0)?, truth)])
    })
}

pub(super) fn entries() -> Vec<Entry> {
    let mut entries = Vec::new();
    for tolerance in [0.5, 1e-4, 1e-8, 1e-12] {
        entries.push(boxed(format!("cube in a box, {tolerance:e}"), to(tolerance)));
    }
    for tolerance in [0.5, 1e-3, 1e-5, 1e-7] {
        entries.push(isolated(format!("isolated cube, {tolerance:e}"), to(tolerance)));
    }
    for tolerance in [0.5, 1e-2, 1e-3, 1e-5] {
        entries.push(boxed(format!("cube in a box, {tolerance:e}, no bounds"), estimated(tolerance)));
        entries.push(isolated(format!("isolated cube, {tolerance:e}, no bounds"), estimated(tolerance)));
    }
    for entry in &mut entries {
        entry.quick = ["0.5", "5e-1", "1e-3", "1e-4"].iter().any(|t| entry.name.contains(t));
    }
    entries
}
