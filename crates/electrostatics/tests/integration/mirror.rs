//! Solves of one part of a mirror-symmetric scene that stand for the whole.

use std::error::Error;
use std::f64::consts::PI;

use elastocap_electrostatics::{
    Bounded, MeshScene, Solution, SolveError, TetrahedraSettings, VACUUM_PERMITTIVITY, solve_mesh,
};
use elastocap_geometry::meshing::tets::{Sizing, mesh};
use elastocap_geometry::mirror::{part, planes};
use elastocap_geometry::scene::{Body, Box3, MirrorPlane, Potential, Role, Scene, Wall};
use elastocap_geometry::shapes::{Shape, TriangleSurface};

fn ball(x: f64, radius: f64) -> Shape {
    Shape::Sphere { center: [x, 0.0, 0.0], radius }
}

fn scene(shapes: Vec<(Shape, Option<f64>)>, wall: Wall) -> Scene {
    let named = |(k, (shape, charge))| Body {
        role: Role::Conductor { potential: Potential::of_charge(charge) },
        ..Body::conductor(format!("c{k}"), shape)
    };
    Scene {
        bodies: (0..).zip(shapes).map(named).collect(),
        background_permittivity: 1.0,
        domain: if wall == Wall::Open { Box3::SPACE } else { Box3 { min: [-1.0; 3], max: [1.0; 3] } },
        walls: [[wall; 2]; 3],
    }
}

fn cube() -> TriangleSurface {
    let points = (0..8).map(|k| [0, 1, 2].map(|a| if k >> a & 1 == 0 { -0.5 } else { 0.5 })).collect();
    let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let faces = quads.iter().flat_map(|q: &[u32; 4]| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect();
    TriangleSurface { points, faces }
}

fn solved(
    scene: &Scene,
    planes: &[Option<MirrorPlane>; 3],
    facet: f64,
    tolerance: f64,
) -> Result<Solution, Box<dyn Error>> {
    let mesh = mesh(&part(scene, planes), &Sizing { facet, ..Sizing::default() })?.mesh;
    let permittivity = scene.permittivities();
    let potentials = scene.potentials();
    let shapes = MeshScene { permittivity: &permittivity, potentials: &potentials, planes };
    let settings = TetrahedraSettings { relative_tolerance: tolerance, ..TetrahedraSettings::default() };
    let found = solve_mesh(mesh, shapes, &settings)?.solution;
    assert!(found.reached && found.mirrored == planes.each_ref().map(Option::is_some));
    Ok(found)
}

/// Solves the part and the whole: the bounds of every number overlap.
fn compared(
    scene: &Scene,
    expected: usize,
    facet: f64,
    tolerance: f64,
) -> Result<[Solution; 2], Box<dyn Error>> {
    let found = planes(scene);
    assert_eq!(found.iter().flatten().count(), expected);
    let whole = &[None, None, None];
    let solutions = [solved(scene, &found, facet, tolerance)?, solved(scene, whole, facet, tolerance)?];
    let overlap = |a: &Bounded, b: &Bounded| {
        assert!(a.lower <= b.upper && b.lower <= a.upper, "{a:?} {b:?}");
    };
    for (a, b) in solutions[0].maxwell.iter().flatten().zip(solutions[1].maxwell.iter().flatten()) {
        overlap(a, b);
    }
    for (a, b) in solutions[0].two_terminal.iter().zip(&solutions[1].two_terminal) {
        overlap(a, b);
    }
    for (a, b) in solutions[0].floating.iter().zip(&solutions[1].floating) {
        assert_eq!(a.conductor, b.conductor);
        overlap(&a.from_charges, &b.from_charges);
        a.per_driven.iter().zip(&b.per_driven).for_each(|(a, b)| overlap(a, b));
    }
    println!("{} of {} unknowns", solutions[0].unknowns, solutions[1].unknowns);
    Ok(solutions)
}

#[test]
fn an_eighth_of_a_cube_of_triangles_in_a_cube_bounds_the_known_capacitance() {
    let scene = scene(vec![(Shape::Surface(cube()), None)], Wall::Grounded);
    let [part, whole] = compared(&scene, 3, 0.3, 4e-3).unwrap();
    let known = 19.127134997 * VACUUM_PERMITTIVITY;
    let c = part.maxwell[0][0];
    assert!(c.lower <= known && known <= c.upper, "{c:?} {known}");
    assert!(4 * part.unknowns < whole.unknowns, "{} {}", part.unknowns, whole.unknowns);
}

#[test]
fn a_quarter_of_two_balls_in_open_space_has_their_matrix() {
    let scene = scene(vec![(ball(0.0, 0.01), None), (ball(0.05, 0.02), None)], Wall::Open);
    let [part, _] = compared(&scene, 2, 0.25, 3e-2).unwrap();
    let known = [[0.01105933977598848, -0.004444944336055013], [-0.004444944336055013, 0.02185361967309565]];
    for (found, known) in part.maxwell.iter().flatten().zip(known.as_flattened()) {
        let known = 4.0 * PI * VACUUM_PERMITTIVITY * known;
        // The bounds are those of bodies with flat faces; the faceting error is allowed for.
        let facets = 5e-3 * known.abs();
        assert!(found.lower - facets <= known && known <= found.upper + facets, "{found:?} {known}");
    }
}

#[test]
fn an_eighth_of_layered_balls_has_the_capacitance_of_capacitors_in_series() {
    let shell = Shape::Shell { center: [0.0; 3], radius: 0.9 };
    let mut scene = scene(vec![(ball(0.0, 0.3), None), (shell, None)], Wall::Grounded);
    scene.bodies.push(Body::dielectric("inside", ball(0.0, 0.6), 4.0));
    let [part, _] = compared(&scene, 3, 0.25, 2e-2).unwrap();
    let series = 4.0 * PI * VACUUM_PERMITTIVITY / ((1.0 / 0.3 - 1.0 / 0.6) / 4.0 + (1.0 / 0.6 - 1.0 / 0.9));
    let c = part.two_terminal.unwrap();
    assert!(c.lower < 1.005 * series && 0.995 * series < c.upper, "{c:?} {series}");
}

#[test]
fn a_floating_ball_has_the_potential_that_its_whole_charge_makes() {
    let shapes = vec![(ball(-0.4, 0.3), None), (ball(0.4, 0.3), Some(2e-12))];
    let [part, whole] = compared(&scene(shapes, Wall::Grounded), 3, 0.4, 3e-2).unwrap();
    let [a, b] = [part, whole].map(|s| s.floating[0].from_charges);
    assert!((a.value / b.value - 1.0).abs() < 1e-2, "{a:?} {b:?}");
}

#[test]
fn half_an_l_and_a_scene_without_a_plane_agree_with_the_whole() {
    let outline = [[0.0, 0.0], [0.6, 0.0], [0.6, 0.2], [0.2, 0.2], [0.2, 0.6], [0.0, 0.6]];
    let outline: Vec<[f64; 2]> = outline.iter().map(|p| p.map(|x| x - 0.3)).collect();
    let pad = |from: f64| Shape::Extrusion {
        axis: 1,
        from,
        to: from + 0.2,
        outline: outline.clone(),
        arcs: Vec::new(),
    };
    let one = Shape::Sphere { center: [0.2, 0.0, 0.2], radius: 0.2 };
    compared(&scene(vec![(pad(-0.1), None), (one.clone(), None)], Wall::Grounded), 1, 0.4, 3e-2).unwrap();
    // With the pad higher up there is no mirror plane, and both are solves of the whole.
    let [a, b] = compared(&scene(vec![(pad(0.0), None), (one, None)], Wall::Grounded), 0, 0.4, 5e-2).unwrap();
    assert_eq!(a.maxwell[0][0], b.maxwell[0][0]);
    assert_eq!(a.mirrored, [false; 3]);
}

#[test]
fn two_equal_balls_that_change_places_have_the_matrix_of_the_whole_and_the_known_one() {
    let pair = scene(vec![(ball(0.0, 0.01), None), (ball(0.03, 0.01), None)], Wall::Open);
    let [part, whole] = compared(&pair, 3, 0.25, 3e-2).unwrap();
    // Images: 4 pi eps0 a sinh(mu) times sums of 1 / sinh((2n - 1) mu) and 1 / sinh(2n mu), cosh(mu) = 1.5.
    let mu = 1.5_f64.acosh();
    let sum = |first: f64| (0..60).map(|n| 1.0 / ((first + 2.0 * f64::from(n)) * mu).sinh()).sum::<f64>();
    let scale = 4.0 * PI * VACUUM_PERMITTIVITY * 0.01 * mu.sinh();
    let known = [scale * sum(1.0), -scale * sum(2.0)];
    for (k, found) in part.maxwell.iter().flatten().enumerate() {
        let known = known[usize::from(k == 1 || k == 2)];
        let facets = 5e-3 * known.abs();
        assert!(found.lower - facets <= known && known <= found.upper + facets, "{k}: {found:?} {known}");
    }
    assert!(2 * part.unknowns < whole.unknowns, "{} {}", part.unknowns, whole.unknowns);
}

#[test]
fn a_pair_between_insulated_walls_is_one_state_on_one_half() {
    let pair = scene(vec![(ball(-0.45, 0.3), None), (ball(0.45, 0.3), None)], Wall::Insulated);
    let [part, _] = compared(&pair, 3, 0.3, 3e-2).unwrap();
    let [diagonal, between] = [part.maxwell[0][0], part.maxwell[0][1]];
    assert!((diagonal.lower + between.upper).abs() < 1e-9 * diagonal.value, "{diagonal:?} {between:?}");
    let pair = part.two_terminal.unwrap();
    assert!((pair.value / diagonal.value - 1.0).abs() < 1e-9);
}

#[test]
fn four_pads_around_a_middle_one_that_floats_are_solved_on_an_eighth() {
    let pad =
        |x: f64, z: f64| Shape::Box(Box3 { min: [x - 0.2, -0.05, z - 0.2], max: [x + 0.2, 0.05, z + 0.2] });
    let mut shapes: Vec<_> =
        [[-0.6, -0.6], [0.6, -0.6], [-0.6, 0.6], [0.6, 0.6]].map(|[x, z]| (pad(x, z), None)).to_vec();
    shapes.push((pad(0.0, 0.0), Some(1e-12)));
    let mut pads = scene(shapes, Wall::Grounded);
    // Two bodies of one permittivity that change places, above one that stays and reaches into them.
    let bead = |x: f64| Shape::Box(Box3 { min: [x - 0.1, 0.2, -0.5], max: [x + 0.1, 0.4, 0.5] });
    for (name, x) in [("left", -0.6), ("right", 0.6)] {
        pads.bodies.push(Body::dielectric(name, bead(x), 5.0));
    }
    let layer = Box3 { min: [-1.0, 0.1, -1.0], max: [1.0, 0.3, 1.0] };
    pads.bodies.push(Body::dielectric("layer", Shape::Box(layer), 2.0));
    let [part, whole] = compared(&pads, 2, 0.4, 1e-1).unwrap();
    assert_eq!(part.mirrored, [true, false, true]);
    assert!(3 * part.unknowns < whole.unknowns, "{} {}", part.unknowns, whole.unknowns);
}

#[test]
fn a_mirror_plane_that_does_not_know_every_conductor_is_refused() {
    let scene = scene(vec![(ball(-0.5, 0.2), None), (ball(0.5, 0.2), None)], Wall::Insulated);
    let whole = mesh(&scene, &Sizing { facet: 0.3, ..Sizing::default() }).unwrap().mesh;
    for conductors in [vec![0], vec![1, 2]] {
        let plane = MirrorPlane { at: 0.0, conductors, dielectrics: Vec::new() };
        let shapes = MeshScene {
            permittivity: &[1.0],
            potentials: &[Potential::Driven; 2],
            planes: &[Some(plane), None, None],
        };
        let found = solve_mesh(whole.clone(), shapes, &TetrahedraSettings::default());
        assert_eq!(found.err(), Some(SolveError::MirrorPlane { axis: 0, conductors: 2 }));
    }
}
