//! Time, iterations and memory of the solver on tetrahedra as the mesh of a cube in a cube grows.
//!
//!     cargo run --release -p elastocap-electrostatics --example tets_scaling -- 2 16 32 48

use elastocap_electrostatics::{PotentialProblem, PotentialSettings, Potentials};
use elastocap_geometry::meshing::tets::of_boxes;
use elastocap_geometry::scene::{Body, Box3, Scene, Wall};
use elastocap_geometry::shapes::Shape;
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // 1. The order, and cells along an edge of the outer cube: a multiple of four.
    let given = std::env::args().skip(1).map(|a| a.parse()).collect::<Result<Vec<usize>, _>>()?;
    let (order, sizes) = match given.split_first() {
        Some((order, sizes)) if !sizes.is_empty() => (*order, sizes.to_vec()),
        _ => (2, vec![16, 32, 48]),
    };
    let cube = |a: f64| Box3 { min: [-a; 3], max: [a; 3] };
    let scene = Scene {
        bodies: vec![Body::conductor("inner", Shape::Box(cube(0.5)))],
        background_permittivity: 1.0,
        domain: cube(1.0),
        walls: [[Wall::Grounded; 2]; 3],
    };
    println!("unknowns  iterations  seconds  relative error of C");
    for n in sizes {
        // 2. The mesh, and the potential.
        let line: Vec<f64> = (0..=n).map(|k| 2.0 * k as f64 / n as f64 - 1.0).collect();
        let mesh = of_boxes(&scene, &[line.clone(), line.clone(), line]);
        let problem = PotentialProblem { mesh: &mesh, permittivity: &[1.0], conductors: 1 };
        let begin = Instant::now();
        let solved = Potentials::solve(problem, PotentialSettings { order, share: 1e-7, cancel: None })?;
        let seconds = begin.elapsed().as_secs_f64();
        // 3. Compare with the known value.
        let error = solved.energies[(0, 0)] / 19.127134997 - 1.0;
        println!("{:8}  {:10}  {seconds:7.2}  {error:.3e}", solved.unknowns, solved.iterations);
    }
    Ok(())
}
