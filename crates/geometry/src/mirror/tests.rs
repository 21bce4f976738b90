use super::*;
use crate::samples::{cube, scene};
use crate::scene::Body;

fn open(shapes: Vec<Shape>) -> Scene {
    scene(Box3::SPACE, Wall::Open, shapes)
}

fn near(found: [Option<f64>; 3], expected: [Option<f64>; 3]) {
    let same = |(a, b): (&Option<f64>, &Option<f64>)| match (a, b) {
        (Some(a), Some(b)) => (a - b).abs() < 1e-12,
        (a, b) => a == b,
    };
    assert!(found.iter().zip(&expected).all(same), "{found:?}, not {expected:?}");
}

#[test]
fn a_cube_of_triangles_has_three_planes_whatever_its_diagonals() {
    let center = [0.1, -0.7, 1e3];
    near(planes(&open(vec![Shape::Surface(cube(center, 0.3))])), center.map(Some));
}

#[test]
fn a_cube_with_one_corner_moved_has_no_plane_through_that_corner() {
    let mut surface = cube([0.0; 3], 0.5);
    surface.points[7][2] = 0.5 + 1e-6;
    near(planes(&open(vec![Shape::Surface(surface.clone())])), [None; 3]);
    // Both corners of an edge along the first axis: still its own image about the plane across that.
    surface.points[6][2] = 0.5 + 1e-6;
    near(planes(&open(vec![Shape::Surface(surface)])), [Some(0.0), None, None]);
}

#[test]
fn two_balls_have_the_planes_that_hold_both_middles() {
    let a = Shape::Sphere { center: [0.0, 0.1, 0.2], radius: 1.0 };
    let b = Shape::Sphere { center: [5.0, 0.1, 0.2], radius: 1.0 };
    // Equal balls change places about a plane between them: that is another symmetry.
    near(planes(&open(vec![a, b])), [None, Some(0.1), Some(0.2)]);
}

#[test]
fn an_l_has_a_plane_across_its_axis_and_a_t_one_more() {
    let pad =
        |axis, outline: &[[f64; 2]]| Shape::Extrusion { axis, from: 1.0, to: 2.0, outline: outline.to_vec() };
    let l = [[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [1.0, 1.0], [1.0, 3.0], [0.0, 3.0]];
    let t = [[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [2.0, 1.0], [2.0, 3.0], [1.0, 3.0], [1.0, 1.0], [0.0, 1.0]];
    let halfway = Some(1.5);
    for (axis, of_l, of_t) in [
        (0, [halfway, None, None], [halfway, halfway, None]),
        (1, [None, halfway, None], [halfway, halfway, None]),
        (2, [None, None, halfway], [halfway, None, halfway]),
    ] {
        near(planes(&open(vec![pad(axis, &l)])), of_l);
        near(planes(&open(vec![pad(axis, &t)])), of_t);
    }
}

#[test]
fn walls_sheets_and_layers_take_planes_away() {
    let ball = || Shape::Sphere { center: [0.0; 3], radius: 0.5 };
    let domain = Box3 { min: [-1.0, -1.0, -1.0], max: [1.0, 1.0, 2.0] };
    let mut all = scene(domain, Wall::Grounded, vec![ball()]);
    near(planes(&all), [Some(0.0), Some(0.0), None]);
    all.walls[0][1] = Wall::Insulated;
    near(planes(&all), [None, Some(0.0), None]);
    // A sheet through the middle, and a layer that fills one side.
    let sheet = Shape::Box(Box3 { min: [-1.0, 0.0, 2.0], max: [1.0, 0.0, 3.0] });
    near(planes(&open(vec![sheet])), [Some(0.0), None, Some(2.5)]);
    let mut all = open(vec![ball()]);
    let mut below = Box3::SPACE;
    below.max[1] = 0.0;
    all.bodies.push(Body::dielectric("board", Shape::Box(below), 2.0));
    near(planes(&all), [Some(0.0), None, Some(0.0)]);
}

#[test]
fn the_part_ends_at_insulated_walls_in_the_planes() {
    let all = open(vec![Shape::Sphere { center: [1.0, 2.0, 3.0], radius: 0.5 }]);
    let half = part(&all, [None, Some(2.0), None]);
    assert_eq!(half.domain.min, [f64::NEG_INFINITY, 2.0, f64::NEG_INFINITY]);
    assert_eq!(half.walls[1], [Wall::Insulated, Wall::Open]);
    assert_eq!((half.walls[0], half.walls[2]), ([Wall::Open; 2], [Wall::Open; 2]));
    assert_eq!(half.bodies, all.bodies);
}

#[test]
fn a_cylinder_has_planes_through_its_axis_and_through_its_middle() {
    for axis in 0..3 {
        let base = [0.3, -0.2, 0.5];
        let mut expected = base.map(Some);
        expected[axis] = Some(base[axis] + 2.0);
        near(planes(&open(vec![Shape::Cylinder { axis, base, radius: 0.25, height: 4.0 }])), expected);
    }
}
