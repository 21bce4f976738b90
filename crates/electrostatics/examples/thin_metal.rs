//! Thin plates and discs in open space: meshes, iterations and time as they become thinner, on one eighth of
//! each.
//!
//!     cargo run --release -p elastocap-electrostatics --example thin_metal -- 1e-3
//!     cargo run --release -p elastocap-electrostatics --example thin_metal -- 1e-3 plain      (without points along the edges)

use elastocap_electrostatics::{MeshScene, TetrahedraSettings, VACUUM_PERMITTIVITY, solve_mesh};
use elastocap_geometry::meshing::tets::{Sizing, mesh};
use elastocap_geometry::mirror::{part, planes};
use elastocap_geometry::scene::{Body, Box3, Potential, Scene, Wall};
use elastocap_geometry::shapes::Shape;
use std::f64::consts::PI;
use std::time::Instant;

/// Capacitances of a square sheet of side 1 m and of a round one of radius 1 m, over 4 pi eps_0, which those
/// of plates tend to.
const SQUARE: f64 = 0.366_789_2;
const ROUND: f64 = 2.0 / PI;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // 1. The tolerance, and whether edges get their points before the mesh is refined.
    let given: Vec<String> = std::env::args().skip(1).collect();
    let tolerance: f64 = given.first().map_or(Ok(1e-3), |a| a.parse())?;
    let plain = given.get(1).is_some_and(|a| a == "plain");
    println!(
        "| body | thickness / width | unknowns | meshes | iterations | lower / sheet | upper / sheet | spread | time |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    for thickness in [1e-1, 1e-2, 1e-3, 1e-4] {
        let half = [0.5, 0.5 * thickness, 0.5];
        let square = Shape::Box(Box3 { min: half.map(|x| -x), max: half });
        let round =
            Shape::Cylinder { axis: 1, base: [0.0, -thickness, 0.0], radius: 1.0, height: 2.0 * thickness };
        for (name, shape, sheet) in [("square", square, SQUARE), ("disc", round, ROUND)] {
            // 2. One eighth of the body, meshed as coupling does it.
            let whole = Scene {
                bodies: vec![Body::conductor(name, shape)],
                background_permittivity: 1.0,
                domain: Box3::SPACE,
                walls: [[Wall::Open; 2]; 3],
            };
            let planes = planes(&whole);
            let facet = (4.0 * tolerance).sqrt().clamp(0.02, 0.3);
            let usual = Sizing { facet, far: 40.0, ..Sizing::default() };
            let sizing =
                if plain { usual } else { Sizing { thin_edge: 4.0 * tolerance, growth: 0.3, ..usual } };
            let start = Instant::now();
            let first = mesh(&part(&whole, &planes), &sizing)?.mesh;
            let shapes =
                MeshScene { permittivity: &[1.0], potentials: &[Potential::Driven], planes: &planes };
            let settings =
                TetrahedraSettings { relative_tolerance: tolerance, ..TetrahedraSettings::default() };
            let found = solve_mesh(first, shapes, &settings)?.solution;
            // 3. The bounds over the capacitance of a sheet.
            let c = found.maxwell[0][0];
            let sheet = 4.0 * PI * VACUUM_PERMITTIVITY * sheet;
            println!(
                "| {name} | {thickness:.0e} | {} | {} | {:.0} | {:.5} | {:.5} | {:.1e}{} | {:.1} s |",
                found.unknowns,
                found.grids,
                found.iterations as f64 / found.grids as f64,
                c.lower / sheet,
                c.upper / sheet,
                (c.upper - c.lower) / c.value,
                if found.reached { "" } else { ", not reached" },
                start.elapsed().as_secs_f64()
            );
        }
    }
    Ok(())
}
