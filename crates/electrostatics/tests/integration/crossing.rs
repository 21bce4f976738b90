//! Bodies whose surfaces cross: known capacitances, and the solver for boxes.

use std::f64::consts::PI;

use elastocap_electrostatics::{
    Bounded, MeshScene, Settings, TetrahedraSettings, VACUUM_PERMITTIVITY, solve, solve_mesh,
};
use elastocap_geometry::meshing::tets::{Sizing, mesh};
use elastocap_geometry::scene::{Body, Box3, Scene, Wall};
use elastocap_geometry::shapes::Shape;

fn ball(center: [f64; 3], radius: f64) -> Shape {
    Shape::Sphere { center, radius }
}

fn scene(metal: Vec<Shape>, filled: Vec<(Shape, f64)>) -> Scene {
    let conductors = metal.into_iter().enumerate().map(|(k, shape)| Body::conductor(format!("c{k}"), shape));
    let dielectrics = filled.into_iter().enumerate();
    let dielectrics = dielectrics.map(|(k, (shape, eps))| Body::dielectric(format!("d{k}"), shape, eps));
    Scene {
        bodies: conductors.chain(dielectrics).collect(),
        background_permittivity: 1.0,
        domain: Box3::SPACE,
        walls: [[Wall::Open; 2]; 3],
    }
}

fn matrix(scene: &Scene, facet: f64, tolerance: f64) -> Result<Vec<Vec<Bounded>>, String> {
    let meshed = mesh(scene, &Sizing { facet, ..Sizing::default() }).map_err(|e| e.to_string())?;
    let permittivity = scene.permittivities();
    let potentials = scene.potentials();
    let shapes =
        MeshScene { permittivity: &permittivity, potentials: &potentials, planes: &[None, None, None] };
    let settings = TetrahedraSettings { relative_tolerance: tolerance, ..TetrahedraSettings::default() };
    let found = solve_mesh(meshed.mesh, shapes, &settings).map_err(|e| e.to_string())?;
    assert!(found.solution.reached, "{:?}", found.solution.shortfall);
    Ok(found.solution.maxwell)
}

#[test]
fn a_ball_half_in_a_dielectric_is_two_half_capacitors_whatever_the_dielectric_ends_with() {
    // The field is radial in both halves; the dielectric ends somewhere in the outer conductor.
    let known = 4.0 * PI * VACUUM_PERMITTIVITY * 0.5 * (1.0 + 3.0) / (1.0 / 1e-3 - 1.0 / 2e-3);
    let block = Box3 { min: [-2.2e-3, -3e-3, -2.3e-3], max: [2.6e-3, 0.0, 2.4e-3] };
    for lower in [
        Shape::Cylinder { axis: 1, base: [0.2e-3, -2.6e-3, 0.1e-3], radius: 2.9e-3, height: 2.6e-3 },
        Shape::Box(block),
    ] {
        let shell = Shape::Shell { center: [0.0; 3], radius: 2e-3 };
        let scene = scene(vec![ball([0.0; 3], 1e-3), shell], vec![(lower, 3.0)]);
        let c = matrix(&scene, 0.15, 1e-2).unwrap()[0][0];
        // 0.05 facet^2 is the estimated faceting error.
        let facets = 2e-3 * known;
        assert!(c.lower - facets < known && known < c.upper + facets, "{c:?} {known:e}");
    }
}

#[test]
fn dielectrics_that_overlap_but_differ_from_nothing_change_nothing() {
    let metal = || vec![ball([0.0; 3], 0.01), ball([0.05, 0.0, 0.0], 0.02)];
    let air =
        [ball([0.01, 0.0, 0.0], 0.012), ball([0.025, 0.003, 0.0], 0.014), ball([0.03, 0.0, 0.002], 0.009)];
    let filled = matrix(&scene(metal(), air.map(|shape| (shape, 1.0)).to_vec()), 0.2, 2e-2).unwrap();
    let empty = [[1.2305175e-12, -0.4945668e-12], [-0.4945668e-12, 2.4315431e-12]];
    for i in 0..2 {
        for j in 0..2 {
            let (c, known) = (filled[i][j], empty[i][j]);
            let facets = 3e-3 * f64::abs(known);
            assert!(c.lower - facets < known && known < c.upper + facets, "{i} {j} {c:?}");
        }
    }
}

#[test]
fn of_dielectrics_that_overlap_the_later_wins_as_it_does_in_the_solver_for_boxes() {
    let cube = |low: [f64; 3], high: [f64; 3]| Box3 { min: low, max: high };
    let one = (cube([-1.0; 3], [0.5; 3]), 2.0);
    let other = (cube([-0.5; 3], [1.0; 3]), 8.0);
    let mut values = Vec::new();
    for order in [[one, other], [other, one]] {
        let metal = Body::conductor("c", Shape::Box(cube([-0.2; 3], [0.2, 0.7, 0.2])));
        let filled =
            order.iter().map(|&(region, eps)| Body::dielectric(format!("{eps}"), Shape::Box(region), eps));
        let boxes = Scene {
            bodies: std::iter::once(metal).chain(filled).collect(),
            background_permittivity: 1.0,
            domain: cube([-2.0; 3], [2.0; 3]),
            walls: [[Wall::Grounded; 2]; 3],
        };
        let settings = Settings { relative_tolerance: 1e-2, ..Settings::default() };
        let known = solve(&boxes, &settings).unwrap().maxwell[0][0];
        let found = matrix(&boxes, 0.3, 3e-2).unwrap()[0][0];
        assert!(known.lower < found.upper && found.lower < known.upper, "{known:?} {found:?}");
        values.push(found);
    }
    assert!(values[0].lower > values[1].upper, "{values:?}");
}
