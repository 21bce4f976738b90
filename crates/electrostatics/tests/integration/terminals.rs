//! Joined and grounded conductors against the matrix of the separate conductors, by each solver.

use elastocap_electrostatics::{
    Bounded, MeshScene, Settings, Solution, Target, TetrahedraSettings, solve, solve_extruded, solve_mesh,
};
use elastocap_geometry::meshing::tets::{Sizing, mesh};
use elastocap_geometry::scene::{Body, Box3, Potential, Role, Scene, Wall};
use elastocap_geometry::shapes::Shape;

/// Four blocks on one plane, not alike, of which the first and the third are mirror images of each other.
fn blocks() -> Vec<Body> {
    let block = |name: &str, x: f64, size: f64| {
        Body::conductor(name, Shape::Box(Box3 { min: [x, 0.0, -size], max: [x + 0.4, 0.2, size] }))
    };
    vec![block("a", -1.2, 0.5), block("b", -0.2, 0.3), block("c", 0.8, 0.5), {
        Body::conductor("d", Shape::Box(Box3 { min: [-1.0, 0.5, -0.4], max: [1.0, 0.6, 0.4] }))
    }]
}

fn in_walls(bodies: Vec<Body>, wall: Wall) -> Scene {
    let domain = Box3 { min: [-2.0, -1.0, -1.5], max: [2.0, 1.5, 1.5] };
    Scene { bodies, background_permittivity: 1.0, domain, walls: [[wall; 2]; 3] }
}

fn grounded(body: &Body) -> Body {
    Body { role: Role::Conductor { potential: Potential::Grounded }, ..body.clone() }
}

fn joined(first: &Body, second: &Body) -> Body {
    let parts = [first.parts.as_slice(), second.parts.as_slice()].concat();
    Body { name: "joined".to_owned(), parts, ..first.clone() }
}

type Solver = fn(&Scene, Target, f64) -> Solution;

fn by_boxes(scene: &Scene, target: Target, relative_tolerance: f64) -> Solution {
    solve(scene, &Settings { target, relative_tolerance, ..Settings::default() }).unwrap()
}

fn by_outlines(scene: &Scene, target: Target, relative_tolerance: f64) -> Solution {
    let settings = Settings { target, relative_tolerance, ..Settings::default() };
    solve_extruded(scene, &settings).unwrap().solution
}

fn on_tetrahedra(scene: &Scene, target: Target, relative_tolerance: f64) -> Solution {
    let mesh = mesh(scene, &Sizing::default()).unwrap().mesh;
    let shapes = MeshScene {
        permittivity: &scene.permittivities(),
        potentials: &scene.potentials(),
        planes: &[None, None, None],
    };
    let settings = TetrahedraSettings { target, relative_tolerance, ..TetrahedraSettings::default() };
    solve_mesh(mesh, shapes, &settings).unwrap().solution
}

const SOLVERS: [(&str, Solver, f64); 3] =
    [("boxes", by_boxes, 5e-3), ("outlines", by_outlines, 3e-2), ("tetrahedra", on_tetrahedra, 1e-1)];

#[track_caller]
fn assert_meet(one: Bounded, lower: f64, upper: f64, what: &str) {
    assert!(one.lower <= upper && lower <= one.upper, "{what}: {one:?} apart from [{lower:e}, {upper:e}]");
}

#[test]
fn conductors_on_one_wire_have_the_sums_of_their_rows_and_columns() {
    let blocks = blocks();
    let [a, b, c, d] = [0, 1, 2, 3].map(|k| &blocks[k]);
    let wired = in_walls(vec![joined(a, b), c.clone(), d.clone()], Wall::Grounded);
    for (name, solver, tolerance) in SOLVERS {
        let apart = solver(&in_walls(blocks.clone(), Wall::Grounded), Target::Matrix, tolerance).maxwell;
        let together = solver(&wired, Target::Matrix, tolerance).maxwell;
        assert_eq!(together.len(), 3);
        let members: [&[usize]; 3] = [&[0, 1], &[2], &[3]];
        for i in 0..3 {
            for j in 0..3 {
                let sum = |pick: fn(&Bounded) -> f64| -> f64 {
                    members[i].iter().flat_map(|k| members[j].iter().map(|l| pick(&apart[*k][*l]))).sum()
                };
                let (lower, upper) = (sum(|c| c.lower), sum(|c| c.upper));
                assert_meet(together[i][j], lower, upper, &format!("{name}, {i} {j}"));
                assert!(upper - lower < 0.5 * sum(|c| c.value).abs(), "{name}: the test says nothing");
            }
        }
    }
}

#[test]
fn a_grounded_conductor_is_one_whose_row_is_left_out_whether_or_not_its_mirror_image_is() {
    let blocks = blocks();
    for wall in [Wall::Grounded, Wall::Insulated] {
        for (name, solver, tolerance) in SOLVERS {
            let whole = solver(&in_walls(blocks.clone(), wall), Target::Matrix, tolerance).maxwell;
            for gone in [1, 2] {
                let mut bodies = blocks.clone();
                bodies[gone] = grounded(&blocks[gone]);
                let found = solver(&in_walls(bodies.clone(), wall), Target::Matrix, tolerance).maxwell;
                let left: Vec<usize> = (0..4).filter(|k| *k != gone).collect();
                assert_eq!(found.len(), 3);
                for i in 0..3 {
                    for j in 0..3 {
                        let entry = whole[left[i]][left[j]];
                        let what = format!("{name}, without {gone}, {i} {j}");
                        assert_meet(found[i][j], entry.lower, entry.upper, &what);
                        let scale = (found[i][i].value * found[j][j].value).sqrt();
                        assert!(found[i][j].upper - found[i][j].lower < tolerance * scale, "{what}");
                    }
                }
            }
        }
    }
}

#[test]
fn a_grounded_conductor_draws_what_infinity_cannot_where_the_scene_is_open_between_insulated_walls() {
    let opened = |bodies: Vec<Body>| {
        let mut scene = in_walls(bodies, Wall::Insulated);
        (scene.domain.min[1], scene.domain.max[1]) = (f64::NEG_INFINITY, f64::INFINITY);
        scene.walls[1] = [Wall::Open; 2];
        scene
    };
    let blocks = blocks();
    let with_ground = opened(vec![blocks[0].clone(), grounded(&blocks[3]), blocks[1].clone()]);
    let without = opened(vec![blocks[0].clone(), blocks[3].clone(), blocks[1].clone()]);
    for (name, solver, tolerance) in &SOLVERS[..2] {
        let whole = solver(&without, Target::Matrix, *tolerance).maxwell;
        let found = solver(&with_ground, Target::Matrix, *tolerance).maxwell;
        for (i, k) in [0, 2].into_iter().enumerate() {
            for (j, l) in [0, 2].into_iter().enumerate() {
                let entry = whole[k][l];
                assert_meet(found[i][j], entry.lower, entry.upper, &format!("{name}, {i} {j}"));
            }
        }
    }
}

#[test]
fn what_is_measured_reaches_the_tolerance_and_is_what_the_matrix_says() {
    let scene = in_walls(blocks(), Wall::Grounded);
    let truth = by_boxes(&scene, Target::Matrix, 1e-3).maxwell;
    for (name, solver, tolerance) in SOLVERS {
        for (target, [i, j]) in [(Target::Mutual([3, 0]), [0, 3]), (Target::Own(1), [1, 1])] {
            let solution = solver(&scene, target, tolerance);
            let measured = solution.measured.unwrap();
            assert!(solution.reached && measured.spread_over_value() <= tolerance, "{name}: {solution:?}");
            let exact = if i == j { truth[i][j] } else { truth[i][j].negative() };
            assert_meet(measured, exact.lower, exact.upper, &format!("{name} {target:?}"));
        }
        let pair = solver(&scene, Target::Pair([0, 3]), tolerance);
        let measured = pair.measured.unwrap();
        assert!(pair.reached && measured.spread_over_value() <= tolerance, "{name}");
        // Mutual capacitance in parallel with both to everything else in series.
        let m = -truth[0][3].value;
        let (p, q) = (truth[0][0].value - m, truth[3][3].value - m);
        let exact = m + p * q / (p + q);
        assert_meet(measured, exact * (1.0 - 2e-4), exact * (1.0 + 2e-4), &format!("{name}, pair"));
    }
}
