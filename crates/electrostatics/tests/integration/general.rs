//! Any shape: bounds on tetrahedra against known capacitances and against the solver for boxes.

use std::f64::consts::PI;

use elastocap_electrostatics::{
    MeshScene, MeshSolution, Settings, Shortfall, SolveError, TetrahedraSettings, VACUUM_PERMITTIVITY,
    forecast_mesh, solve, solve_mesh,
};
use elastocap_geometry::meshing::tets::{LayeredSizing, Sizing, TetMesh, layered, mesh};
use elastocap_geometry::scene::{Body, Box3, Potential, Scene, Wall};
use elastocap_geometry::shapes::Shape;

fn ball(x: f64, radius: f64) -> Shape {
    Shape::Sphere { center: [x, 0.0, 0.0], radius }
}

fn conductor(name: &str, shape: Shape) -> Body {
    Body::conductor(name, shape)
}

fn scene(bodies: Vec<Body>, wall: Wall, side: f64) -> Scene {
    let domain = if wall == Wall::Open { Box3::SPACE } else { Box3 { min: [-side; 3], max: [side; 3] } };
    Scene { bodies, background_permittivity: 1.0, domain, walls: [[wall; 2]; 3] }
}

fn solved(
    mesh: TetMesh,
    permittivity: &[f64],
    conductors: usize,
    tolerance: f64,
) -> Result<MeshSolution, SolveError> {
    let potentials = vec![Potential::Driven; conductors];
    let shapes = MeshScene { permittivity, potentials: &potentials, planes: &[None, None, None] };
    let settings = TetrahedraSettings { relative_tolerance: tolerance, ..TetrahedraSettings::default() };
    let start = std::time::Instant::now();
    let found = solve_mesh(mesh, shapes, &settings)?;
    println!(
        "{} tetrahedra, {} unknowns, {} meshes, {:.2} s {:?}",
        found.mesh.tets.len(),
        found.solution.unknowns,
        found.solution.grids,
        start.elapsed().as_secs_f64(),
        found.solution.seconds
    );
    for row in &found.solution.maxwell {
        println!("{:?}", row.iter().map(|b| [b.lower, b.value, b.upper]).collect::<Vec<_>>());
    }
    assert!(found.solution.reached, "{:?}", found.solution.shortfall);
    Ok(found)
}

#[test]
fn a_cube_in_a_cube_lies_between_bounds_that_meet_the_tolerance() {
    let cube = Shape::Box(Box3 { min: [-0.5; 3], max: [0.5; 3] });
    let scene = scene(vec![conductor("inner", cube)], Wall::Grounded, 1.0);
    let mesh = layered(&scene, &LayeredSizing::default()).unwrap().unwrap();
    let c = solved(mesh, &[1.0], 1, 3e-3).unwrap().solution.maxwell[0][0];
    let known = 19.127134997 * VACUUM_PERMITTIVITY;
    assert!(c.lower <= known && known <= c.upper);
    // Effectivity: the spread is that of the bounds, the error at least that of the nearer one.
    assert!((c.upper - c.lower) < 4.0 * (c.upper - known));
}

#[test]
fn two_spheres_in_open_space_have_the_matrix_of_the_image_series() {
    let scene =
        scene(vec![conductor("a", ball(0.0, 0.01)), conductor("b", ball(0.05, 0.02))], Wall::Open, 0.0);
    let mesh = mesh(&scene, &Sizing { facet: 0.15, ..Sizing::default() }).unwrap().mesh;
    let found = solved(mesh, &[1.0], 2, 2e-2).unwrap();
    let known = [[0.01105933977598848, -0.004444944336055013], [-0.004444944336055013, 0.02185361967309565]];
    for i in 0..2 {
        for j in 0..2 {
            let c = found.solution.maxwell[i][j];
            let known = 4.0 * PI * VACUUM_PERMITTIVITY * known[i][j];
            // The bounds are those of bodies with flat faces; the faceting error is allowed for.
            let facets = 2e-3 * known.abs();
            assert!(c.lower - facets <= known && known <= c.upper + facets, "{i} {j}: {c:?} {known}");
        }
    }
}

#[test]
fn layered_spheres_have_the_capacitance_of_capacitors_in_series() {
    let mut scene = scene(
        vec![
            conductor("inner", ball(0.0, 1e-3)),
            conductor("outer", Shape::Shell { center: [0.0; 3], radius: 2e-3 }),
        ],
        Wall::Grounded,
        3e-3,
    );
    scene.background_permittivity = 2.0;
    scene.bodies.push(Body::dielectric("inside", ball(0.0, 1.5e-3), 4.0));
    let mesh = mesh(&scene, &Sizing { facet: 0.15, ..Sizing::default() }).unwrap().mesh;
    let found = solved(mesh, &[2.0, 4.0], 2, 1e-2).unwrap();
    let series = 4.0 * PI * VACUUM_PERMITTIVITY
        / ((1.0 / 1e-3 - 1.0 / 1.5e-3) / 4.0 + (1.0 / 1.5e-3 - 1.0 / 2e-3) / 2.0);
    let c = found.solution.two_terminal.unwrap();
    let facets = 2e-3 * series;
    assert!(c.lower - facets <= series && series <= c.upper + facets, "{c:?} {series}");
}

#[test]
fn what_a_cube_in_a_cube_takes_is_forecast_within_a_factor_of_two() {
    let cube = Shape::Box(Box3 { min: [-0.5; 3], max: [0.5; 3] });
    let scene = scene(vec![conductor("inner", cube)], Wall::Grounded, 1.0);
    let mesh = mesh(&scene, &Sizing::default()).unwrap().mesh;
    let shapes =
        MeshScene { permittivity: &[1.0], potentials: &[Potential::Driven], planes: &[None, None, None] };
    let settings = TetrahedraSettings { relative_tolerance: 2e-3, ..TetrahedraSettings::default() };
    let forecast = forecast_mesh(mesh.clone(), shapes, &settings).unwrap();
    let found = solve_mesh(mesh, shapes, &settings).unwrap();
    let ratio = forecast.unknowns as f64 / found.solution.unknowns as f64;
    assert!((0.5..2.0).contains(&ratio), "{} forecast, {} taken", forecast.unknowns, found.solution.unknowns);
    assert!(forecast.memory_bytes > 1000 * forecast.unknowns as u64 && forecast.seconds > 0.0);
    // No mesh exceeds the memory limit; the forecast adds a quarter of it, and the memory of the program
    // itself.
    let little = TetrahedraSettings { relative_tolerance: 1e-6, memory_limit: 500_000_000, ..settings };
    let mesh = self::mesh(&scene, &Sizing::default()).unwrap().mesh;
    let forecast = forecast_mesh(mesh, shapes, &little).unwrap();
    assert!(forecast.memory_bytes <= 625_000_000 + (36 << 20));
}

#[test]
fn a_ball_that_floats_in_a_driven_shell_ends_with_a_capacitance_that_may_be_zero() {
    let scene = scene(
        vec![
            conductor("ball", ball(0.0, 1e-3)),
            conductor("shell", Shape::Shell { center: [0.0; 3], radius: 2e-3 }),
        ],
        Wall::Grounded,
        3e-3,
    );
    let mesh = mesh(&scene, &Sizing::default()).unwrap().mesh;
    let shapes = MeshScene {
        permittivity: &[1.0],
        potentials: &[Potential::Floating { charge: 0.0 }, Potential::Driven],
        planes: &[None, None, None],
    };
    let settings = TetrahedraSettings { relative_tolerance: 1e-2, ..TetrahedraSettings::default() };
    let found = solve_mesh(mesh, shapes, &settings).unwrap().solution;
    let c = found.maxwell[0][0];
    let alone = 4.0 * PI * VACUUM_PERMITTIVITY * 2e-3;
    assert!(c.lower <= 0.0 && 0.0 <= c.upper && c.upper < 1.2e-2 * alone, "{c:?}");
    assert!(!found.reached && found.unknowns < 200_000, "{} unknowns", found.unknowns);
    assert!(matches!(found.shortfall, Some(Shortfall::MayBeZero { .. })));
}

#[test]
fn plates_by_tetrahedra_and_by_boxes_agree_within_their_bounds() {
    let regions =
        [(-0.1, -0.05), (0.05, 0.1)].map(|(a, b)| Box3 { min: [-0.5, a, -0.5], max: [0.5, b, 0.5] });
    let conductors = regions.map(|r| conductor(if r.min[1] < 0.0 { "low" } else { "high" }, Shape::Box(r)));
    let shaped = scene(conductors.to_vec(), Wall::Grounded, 1.0);
    let bodies = shaped.bodies.iter().zip(regions);
    let bodies = bodies.map(|(body, region)| Body::conductor(&body.name, Shape::Box(region))).collect();
    let boxes = Scene { bodies, ..shaped.clone() };
    let by_boxes = solve(&boxes, &Settings { relative_tolerance: 1e-3, ..Settings::default() }).unwrap();
    let mesh = layered(&shaped, &LayeredSizing::default()).unwrap().unwrap();
    let by_tets = solved(mesh, &[1.0], 2, 2e-2).unwrap().solution;
    for i in 0..2 {
        for j in 0..2 {
            let (a, b) = (by_boxes.maxwell[i][j], by_tets.maxwell[i][j]);
            assert!(a.lower <= b.upper && b.lower <= a.upper, "{i} {j}: {a:?} {b:?}");
        }
    }
}
