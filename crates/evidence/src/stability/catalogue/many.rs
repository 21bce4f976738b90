//! Many conductors: combs, stacks, cubes without symmetry.

use elastocap_electrostatics::Bounded;

use super::super::Entry;
use super::super::claim::{Claim, Claims, Truth, maxwell};
use super::super::text::{Scene, to};
use elastocap_coupling::outcome::Outcome;
use elastocap_electrostatics::VACUUM_PERMITTIVITY;

const SUBJECT: &str = "many conductors";

/// The laws that hold for every Maxwell matrix: reciprocity, no positive entry off the diagonal, no negative
/// sum of a row.
fn laws(out: &[Outcome], count: usize) -> Claims {
    let at = |i: usize, j: usize| maxwell(out, 0, i, j);
    let mut claims = vec![Claim::capacitance("C11", at(0, 0)?, Truth::at_least(0.0))];
    for i in 0..count {
        let mut sum = Bounded { value: 0.0, lower: 0.0, upper: 0.0 };
        for j in 0..count {
            let entry = at(i, j)?;
            sum.value += entry.value;
            sum.lower += entry.lower;
            sum.upper += entry.upper;
            if j > i {
                claims.push(Claim::capacitance(
                    format!("C{i},{j} = C{j},{i}"),
                    entry,
                    Truth::proved(at(j, i)?, 1.0),
                ));
                claims.push(Claim::capacitance(format!("C{i},{j} < 0"), entry, Truth::at_most(0.0)));
            }
        }
        claims.push(Claim::capacitance(format!("sum of row {i}"), sum, Truth::at_least(0.0)));
    }
    Ok(claims)
}

/// An entry with the claims of [`laws`], and with `mirror` the claims that conductors have the same
/// capacitances as their mirror images, which are numbered from the other end.
fn lawful(name: String, case: String, count: usize, mirror: bool) -> Entry {
    Entry::new(SUBJECT, name, [case], move |out| {
        let mut claims = laws(out, count)?;
        if mirror {
            for i in 0..count / 2 {
                let image = maxwell(out, 0, count - 1 - i, count - 1 - i)?;
                let truth = Truth::proved(image, 1.0);
                claims.push(Claim::capacitance(
                    format!("C{i},{i} and its image"),
                    maxwell(out, 0, i, i)?,
                    truth,
                ));
            }
        }
        Ok(claims)
    })
}

fn comb(fingers: usize, sheets: bool, tolerance: f64) -> Entry {
    let mut scene = Scene::new();
    for finger in 0..fingers {
        let (name, x) = (format!("finger {finger}"), 2e-4 * finger as f64);
        scene = if sheets {
            scene.sheet(&name, 0.0, [x, 0.0], [x + 1e-4, 1e-3])
        } else {
            scene.conductor(&name, [x, 0.0, 0.0], [x + 1e-4, 2e-5, 1e-3])
        };
    }
    let end = 2e-4 * fingers as f64 - 1e-4;
    let case = scene.grounded([-1e-3; 3], [end + 1e-3, 1e-3, 2e-3], to(tolerance));
    let shape = if sheets { "sheets" } else { "boxes" };
    lawful(format!("comb of {fingers} {shape}, {tolerance:e}"), case, fingers, true)
}

/// Plates across an insulated box: each has capacitances to its neighbours only.
fn stack(plates: usize) -> Entry {
    // Gaps of 1, 2, 3, ... units.
    let parts = plates * (plates - 1) / 2;
    let gap = move |k: usize| (k + 1) as f64 / parts as f64;
    let (mut scene, mut at) = (Scene::new(), 0.0);
    for plate in 0..plates {
        let height = if plate + 1 == plates { 1.0 } else { at };
        scene = scene.sheet(&format!("plate {plate}"), height, [0.0; 2], [1.0; 2]);
        at += gap(plate);
    }
    let case = scene.insulated([0.0; 3], [1.0; 3], to(1e-3));
    Entry::new(SUBJECT, format!("stack of {plates} plates, exactly"), [case], move |out| {
        let between = |k: usize| VACUUM_PERMITTIVITY / gap(k);
        let mut claims = Vec::new();
        for i in 0..plates {
            let to_neighbours =
                if i > 0 { between(i - 1) } else { 0.0 } + if i + 1 < plates { between(i) } else { 0.0 };
            claims.push(Claim::capacitance(
                format!("C{i},{i}"),
                maxwell(out, 0, i, i)?,
                Truth::value(to_neighbours, 1e-12),
            ));
            for j in i + 1..plates {
                let truth = if j == i + 1 { -between(i) } else { 0.0 };
                // Zero means negligible beside the largest entries.
                let slack = 1e-12 * between(0);
                let truth = Truth::between(truth - slack, truth + slack);
                claims.push(Claim::capacitance(format!("C{i},{j}"), maxwell(out, 0, i, j)?, truth));
            }
        }
        Ok(claims)
    })
}

/// Cubes of different sizes at places that have nothing in common, in a box or in open space.
fn scattered(count: usize, open: bool, tolerance: f64) -> Entry {
    let mut scene = Scene::new();
    for k in 0..count {
        // Irrational steps: no two planes coincide.
        let noise = |step: f64| 0.2 * ((k + 1) as f64 * step).fract();
        let corner = [(k & 1) as f64, (k >> 1 & 1) as f64, (k >> 2 & 1) as f64];
        let low = [corner[0] + noise(0.618), corner[1] + noise(0.414), corner[2] + noise(0.732)];
        let side = 0.4 + noise(0.236);
        scene = scene.conductor(&format!("cube {k}"), low, low.map(|x| x + side));
    }
    let case =
        if open { scene.open(to(tolerance)) } else { scene.grounded([-1.0; 3], [3.0; 3], to(tolerance)) };
    let place = if open { "open" } else { "in a box" };
    lawful(format!("{count} cubes without symmetry, {place}, {tolerance:e}"), case, count, false)
}

pub(super) fn entries() -> Vec<Entry> {
    vec![
        stack(8).quick(),
        stack(20),
        comb(4, true, 5e-2).quick(),
        comb(20, true, 0.5),
        comb(20, true, 1e-2),
        comb(20, false, 1e-2),
        scattered(3, false, 0.1),
        scattered(8, false, 1e-2),
        scattered(8, true, 1e-2),
    ]
}
