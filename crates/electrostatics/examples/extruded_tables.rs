//! The solver for extruded scenes on fixed meshes: iterations and time over bending, order, number of fingers
//! and contrast.
//!
//!     cargo run --release -p elastocap-electrostatics --example extruded_tables
//!     cargo run --release -p elastocap-electrostatics --example extruded_tables -- large     (to some ten million unknowns)

use elastocap_electrostatics::{ResolutionLevel, Settings, SolveError, Target, solve_extruded};
use elastocap_geometry::scene::{Body, Box3, Scene, Wall};
use elastocap_geometry::shapes::Shape;
use std::f64::consts::PI;
use std::time::Instant;

/// A bar along x3 whose middle line is bent as half a wave of a cosine, `sag` down in the middle of the
/// scene.
fn bar(from: f64, to: f64, sag: f64) -> Shape {
    const STEPS: u32 = 12;
    let at = |k: u32| from + (to - from) * f64::from(k) / f64::from(STEPS);
    let middle = |x: f64| 225.0 - sag * (0.5 * PI * x / 1000.0).cos();
    let below = (0..=STEPS).map(|k| [at(k), middle(at(k)) - 10.0]);
    let above = (0..=STEPS).rev().map(|k| [at(k), middle(at(k)) + 10.0]);
    let outline = if sag == 0.0 {
        vec![[from, 215.0], [to, 215.0], [to, 235.0], [from, 235.0]]
    } else {
        below.chain(above).collect()
    };
    Shape::Extrusion { axis: 2, from: -250.0, to: 250.0, outline, arcs: Vec::new() }
}

/// Bars along x3 in a layer under air, of two conductors in turns.
fn fingers(count: usize, sag: f64, contrast: f64) -> Scene {
    let pitch = 650.0 / count as f64;
    let gap = pitch / 6.5;
    let place = |k: usize| -325.0 + pitch * k as f64 + 0.5 * gap;
    let conductor = |first: usize| {
        let parts = (first..count).step_by(2).map(|k| bar(place(k), place(k) + pitch - gap, sag));
        Body { parts: parts.collect(), ..Body::conductor(["left", "right"][first], bar(0.0, 1.0, 0.0)) }
    };
    let layer = Box3 { min: [-1325.0, 0.0, -1250.0], max: [1325.0, 450.0, 1250.0] };
    Scene {
        bodies: vec![conductor(0), conductor(1), Body::dielectric("layer", Shape::Box(layer), contrast)],
        background_permittivity: 1.0,
        domain: Box3 { min: [-1325.0, 0.0, -1250.0], max: [1325.0, 1450.0, 1250.0] },
        walls: [[Wall::Insulated; 2]; 3],
    }
}

fn row(what: &str, scene: &Scene, order: usize, levels: usize) -> Result<(), SolveError> {
    let begin = Instant::now();
    let settings = Settings {
        resolution: Some(ResolutionLevel { order, levels }),
        target: Target::TwoTerminal,
        ..Settings::default()
    };
    let found = solve_extruded(scene, &settings)?.solution;
    let seconds = begin.elapsed().as_secs_f64();
    let spread = found.two_terminal.map_or(f64::NAN, |c| c.spread_over_value());
    println!(
        "| {what} | {order}, {levels} | {} | {} | {spread:.1e} | {seconds:.2} s | {:.1} us |",
        found.unknowns,
        found.iterations,
        1e6 * seconds / found.unknowns as f64
    );
    Ok(())
}

fn main() -> Result<(), SolveError> {
    println!("| scene | order, layers | unknowns | iterations | spread | time | time per unknown |");
    println!("|---|---|---|---|---|---|---|");
    for order in 2..=8 {
        row("two bars", &fingers(2, 0.0, 2.8), order, order - 1)?;
    }
    for sag in [20.0, 50.0, 100.0, 150.0] {
        row(&format!("bent by {sag} um"), &fingers(2, sag, 2.8), 4, 2)?;
    }
    for exponent in [-6, -3, -1, 1, 3, 6] {
        row(&format!("contrast 1e{exponent}"), &fingers(2, 50.0, 10.0_f64.powi(exponent)), 4, 2)?;
    }
    for count in [2, 4, 8, 16, 32, 64, 100] {
        row(&format!("{count} bars"), &fingers(count, 0.0, 2.8), 3, 2)?;
    }
    if std::env::args().nth(1).is_some_and(|a| a == "large") {
        row("two bars", &fingers(2, 50.0, 2.8), 7, 6)?;
        row("two bars", &fingers(2, 50.0, 2.8), 8, 7)?;
    }
    Ok(())
}
