//! How bounds and errors fall with the number of unknowns as tetrahedra are refined, on one eighth of a cube
//! in a cube.
//!
//!     cargo run --release -p elastocap-electrostatics --example tets_rate -- 2 1e-4

use elastocap_electrostatics::{MeshScene, TetrahedraSettings, VACUUM_PERMITTIVITY, solve_mesh};
use elastocap_geometry::meshing::tets::{Sizing, mesh};
use elastocap_geometry::mirror::{part, planes};
use elastocap_geometry::scene::{Body, Box3, Potential, Scene, Wall};
use elastocap_geometry::shapes::Shape;

/// Capacitance of a unit cube in the middle of a grounded cube of side 2, over eps_0 a: as in
/// benches/peers/measured.md.
const KNOWN: f64 = 19.127134997;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // 1. The order, and the last of the tolerances, each a third of the one before.
    let mut given = std::env::args().skip(1);
    let order = given.next().map_or(Ok(2), |a| a.parse())?;
    let least: f64 = given.next().map_or(Ok(3e-4), |a| a.parse())?;
    let cube = |a: f64| Box3 { min: [-a; 3], max: [a; 3] };
    let conductor = Body::conductor("inner", Shape::Box(cube(0.5)));
    let whole = Scene {
        bodies: vec![conductor],
        background_permittivity: 1.0,
        domain: cube(1.0),
        walls: [[Wall::Grounded; 2]; 3],
    };
    let planes = planes(&whole);
    println!(
        "unknowns  meshes  spread     error of upper, lower, middle        spread/error  rate   seconds"
    );
    let (mut tolerance, mut before) = (0.1, None);
    while tolerance >= 0.99 * least {
        // 2. Solve to this tolerance, from the initial mesh.
        let first = mesh(&part(&whole, &planes), &Sizing::default())?.mesh;
        let shapes = MeshScene { permittivity: &[1.0], potentials: &[Potential::Driven], planes: &planes };
        let settings =
            TetrahedraSettings { relative_tolerance: tolerance, order, ..TetrahedraSettings::default() };
        let start = std::time::Instant::now();
        let found = solve_mesh(first, shapes, &settings)?.solution;
        let seconds = start.elapsed().as_secs_f64();
        // 3. Compare with the known value and with the row before.
        let c = found.maxwell[0][0];
        let [upper, lower, middle] =
            [c.upper, c.lower, c.value].map(|c| c / (VACUUM_PERMITTIVITY * KNOWN) - 1.0);
        let spread = (c.upper - c.lower) / c.value;
        let rate = before.map_or(String::new(), |(unknowns, old): (usize, f64)| {
            format!("{:.2}", (spread / old).ln() / (found.unknowns as f64 / unknowns as f64).ln())
        });
        println!(
            "{:8}  {:6}  {spread:.2e}  {upper:9.2e} {lower:9.2e} {middle:9.2e}   {:12.2}  {rate:>5}  {seconds:7.2}",
            found.unknowns,
            found.grids,
            spread / upper.abs().max(lower.abs()),
        );
        before = Some((found.unknowns, spread));
        tolerance /= 3.0;
    }
    Ok(())
}
