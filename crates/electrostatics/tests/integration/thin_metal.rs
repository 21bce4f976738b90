//! Plates that are up to ten thousand times as wide as thick, on tetrahedra.

use elastocap_electrostatics::{
    MeshScene, MeshSolution, TetrahedraSettings, VACUUM_PERMITTIVITY, solve_mesh,
};
use elastocap_geometry::meshing::tets::{Sizing, mesh};
use elastocap_geometry::mirror::{part, planes};
use elastocap_geometry::scene::{Body, Box3, Potential, Scene, Wall};
use elastocap_geometry::shapes::Shape;
use std::f64::consts::PI;

/// Capacitance of a square sheet of side 1 m, over 4 pi eps_0 (Wintle, J. Electrostat. 62, 2004).
const SQUARE: f64 = 0.366_789_2;

/// Largest number of iterations of conjugate gradients on a mesh. Without points along the edges of the metal
/// it is some hundreds at 1e-3, and there is no bound at 1e-4.
const MAX_ITERATIONS: usize = 30;

/// A square plate of side 1 m in open space, one eighth of it.
fn plate(thickness: f64, tolerance: f64) -> MeshSolution {
    let half = [0.5, 0.5 * thickness, 0.5];
    let scene = Scene {
        bodies: vec![Body::conductor("plate", Shape::Box(Box3 { min: half.map(|x| -x), max: half }))],
        background_permittivity: 1.0,
        domain: Box3::SPACE,
        walls: [[Wall::Open; 2]; 3],
    };
    let planes = planes(&scene);
    assert!(planes.iter().all(Option::is_some));
    let sizing = Sizing { thin_edge: 4.0 * tolerance, growth: 0.3, far: 40.0, ..Sizing::default() };
    let first = mesh(&part(&scene, &planes), &sizing).unwrap().mesh;
    let shapes = MeshScene { permittivity: &[1.0], potentials: &[Potential::Driven], planes: &planes };
    let settings = TetrahedraSettings { relative_tolerance: tolerance, ..TetrahedraSettings::default() };
    solve_mesh(first, shapes, &settings).unwrap()
}

#[test]
fn iterations_do_not_grow_as_metal_becomes_thinner() {
    let sheet = 4.0 * PI * VACUUM_PERMITTIVITY * SQUARE;
    let mut thicker = f64::INFINITY;
    for thickness in [1e-1, 1e-2, 1e-3, 1e-4] {
        let solution = plate(thickness, 1e-2).solution;
        let c = solution.maxwell[0][0];
        let each = solution.iterations as f64 / solution.grids as f64;
        println!(
            "{thickness:e}: {:.5} to {:.5} of a sheet, {} unknowns, {} meshes, {each} iterations each",
            c.lower / sheet,
            c.upper / sheet,
            solution.unknowns,
            solution.grids
        );
        assert!(solution.reached, "{:?}", solution.shortfall);
        assert!(solution.iterations <= MAX_ITERATIONS * solution.grids && solution.unknowns < 30_000);
        // A plate has more than the sheet within it, and less than a thicker one; at the end they are the
        // same.
        assert!(c.upper > sheet && c.lower < thicker);
        thicker = c.upper;
    }
    assert!((thicker / sheet - 1.0).abs() < 1e-2);
}
