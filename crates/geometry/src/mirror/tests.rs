use super::*;
use crate::samples::{cube, scene};
use crate::scene::Body;

fn open(shapes: Vec<Shape>) -> Scene {
    scene(Box3::SPACE, Wall::Open, shapes)
}

fn near(found: [Option<MirrorPlane>; 3], expected: [Option<f64>; 3]) {
    let same = |(a, b): (&Option<MirrorPlane>, &Option<f64>)| match (a, b) {
        (Some(a), Some(b)) => (a.at - b).abs() < 1e-12,
        (a, b) => a.is_none() && b.is_none(),
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
    // Both corners of an edge along the first axis: still symmetric about the plane normal to that axis.
    surface.points[6][2] = 0.5 + 1e-6;
    near(planes(&open(vec![Shape::Surface(surface)])), [Some(0.0), None, None]);
}

#[test]
fn two_balls_have_the_planes_that_hold_both_middles_and_equal_ones_a_plane_between_them() {
    let ball = |x: f64, radius: f64| Shape::Sphere { center: [x, 0.1, 0.2], radius };
    near(planes(&open(vec![ball(0.0, 1.0), ball(5.0, 2.0)])), [None, Some(0.1), Some(0.2)]);
    let found = planes(&open(vec![ball(0.0, 1.0), ball(5.0, 1.0)]));
    let images = |axis: usize| found[axis].as_ref().unwrap().conductors.clone();
    assert_eq!([images(0), images(1), images(2)], [vec![1, 0], vec![0, 1], vec![0, 1]]);
    near(found, [Some(2.5), Some(0.1), Some(0.2)]);
}

#[test]
fn bodies_change_places_whatever_their_shape_but_not_with_one_of_another_kind() {
    let pad = |outline: &[[f64; 2]]| Shape::Extrusion {
        axis: 1,
        from: 0.0,
        to: 1.0,
        outline: outline.to_vec(),
        arcs: Vec::new(),
    };
    let at = |x: f64| Box3 { min: [x - 0.5, 0.0, 0.0], max: [x + 0.5, 1.0, 3.0] };
    let rod = |x: f64| Shape::Cylinder { axis: 1, base: [x, 0.0, 0.0], radius: 0.5, height: 2.0 };
    let cube = |x: f64| Shape::Surface(cube([x, 0.0, 0.0], 0.5));
    let wedge = |x: f64, to: f64| pad(&[[x, 0.0], [x + to, 0.0], [x + to, 3.0]]);
    let pairs = [
        [Shape::Box(at(-3.0)), Shape::Box(at(5.0))],
        [rod(-3.0), rod(5.0)],
        [cube(-3.0), cube(5.0)],
        // The other way round, and begun at another corner.
        [wedge(-3.0, 1.0), pad(&[[4.0, 3.0], [4.0, 0.0], [5.0, 0.0]])],
        // Sheets across the axis.
        [-3.0, 5.0].map(|x| Shape::Box(Box3 { min: [x, 0.0, 0.0], max: [x, 1.0, 3.0] })),
    ];
    for pair in pairs {
        let found = planes(&open(pair.to_vec()));
        let plane = found[0].as_ref().unwrap();
        assert!((plane.at - 1.0).abs() < 1e-12 && plane.conductors == [1, 0], "{pair:?}: {plane:?}");
        assert!(!plane.keeps_conductors());
    }
    for pair in [
        // They touch.
        [Shape::Box(at(0.5)), Shape::Box(at(1.5))],
        [Shape::Box(at(-3.0)), rod(5.0)],
        [wedge(-3.0, 1.0), wedge(4.0, 1.0)],
        [wedge(-3.0, 1.0), pad(&[[4.0, 3.0], [4.5, 0.0], [5.0, 0.0]])],
    ] {
        assert_eq!(planes(&open(pair.to_vec()))[0], None, "{pair:?}");
    }
}

#[test]
fn dielectrics_change_places_where_they_are_equal_and_override_one_another_as_before() {
    let ball = |x: f64, radius: f64| Shape::Sphere { center: [x, 0.0, 0.0], radius };
    let with = |bodies: &[(f64, f64, f64)]| {
        let mut whole = open(vec![ball(0.0, 0.1)]);
        let filled = |(k, (x, radius, eps)): (usize, &(f64, f64, f64))| {
            Body::dielectric(format!("d{k}"), ball(*x, *radius), *eps)
        };
        whole.bodies.extend(bodies.iter().enumerate().map(filled));
        planes(&whole)[0].as_ref().map(|plane| plane.dielectrics.clone())
    };
    assert_eq!(with(&[(-2.0, 1.0, 3.0), (2.0, 1.0, 3.0)]), Some(vec![1, 0]));
    assert_eq!(with(&[(-2.0, 1.0, 3.0), (2.0, 1.0, 3.5)]), None);
    // Crossing bodies: the one in the middle is above one of the others and below the other.
    assert_eq!(with(&[(-1.0, 0.8, 3.0), (0.0, 0.8, 2.0), (1.0, 0.8, 3.0)]), None);
    assert_eq!(with(&[(-1.0, 0.8, 3.0), (1.0, 0.8, 3.0), (0.0, 0.8, 2.0)]), Some(vec![1, 0, 2]));
    // Apart, order has no meaning.
    assert_eq!(with(&[(-5.0, 0.8, 3.0), (0.0, 0.8, 2.0), (5.0, 0.8, 3.0)]), Some(vec![2, 1, 0]));
}

#[test]
fn parts_of_a_body_have_images_among_the_parts_of_one_other_body() {
    let ball = |x: f64| Shape::Sphere { center: [x, 0.0, 0.0], radius: 0.1 };
    let body = |name: &str, places: &[f64]| Body {
        parts: places.iter().map(|&x| ball(x)).collect(),
        ..Body::conductor(name, ball(0.0))
    };
    let with = |a: &[f64], b: &[f64]| {
        let mut whole = open(Vec::new());
        whole.bodies = vec![body("a", a), body("b", b)];
        planes(&whole)[0].as_ref().map(|plane| (plane.at, plane.conductors.clone()))
    };
    // Fingers of two combs between one another change combs.
    assert_eq!(with(&[0.0, 2.0], &[1.0, 3.0]), Some((1.5, vec![1, 0])));
    assert_eq!(with(&[0.0, 3.0], &[1.0, 2.0]), Some((1.5, vec![0, 1])));
    assert_eq!(with(&[0.0, 1.0, 4.0], &[2.0, 3.0, 5.0]), None);
}

#[test]
fn an_l_has_a_plane_across_its_axis_and_a_t_one_more() {
    let pad = |axis, outline: &[[f64; 2]]| Shape::Extrusion {
        axis,
        from: 1.0,
        to: 2.0,
        outline: outline.to_vec(),
        arcs: Vec::new(),
    };
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
    let mut whole = scene(domain, Wall::Grounded, vec![ball()]);
    near(planes(&whole), [Some(0.0), Some(0.0), None]);
    whole.walls[0][1] = Wall::Insulated;
    near(planes(&whole), [None, Some(0.0), None]);
    // A sheet through the middle, and a layer that fills one side.
    let sheet = Shape::Box(Box3 { min: [-1.0, 0.0, 2.0], max: [1.0, 0.0, 3.0] });
    near(planes(&open(vec![sheet])), [Some(0.0), None, Some(2.5)]);
    let mut whole = open(vec![ball()]);
    let mut below = Box3::SPACE;
    below.max[1] = 0.0;
    whole.bodies.push(Body::dielectric("board", Shape::Box(below), 2.0));
    near(planes(&whole), [Some(0.0), None, Some(0.0)]);
}

#[test]
fn the_part_ends_at_insulated_walls_in_the_planes() {
    let whole = open(vec![Shape::Sphere { center: [1.0, 2.0, 3.0], radius: 0.5 }]);
    let half = part(&whole, &[None, planes(&whole)[1].clone(), None]);
    assert_eq!(half.domain.min, [f64::NEG_INFINITY, 2.0, f64::NEG_INFINITY]);
    assert_eq!(half.walls[1], [Wall::Insulated, Wall::Open]);
    assert_eq!((half.walls[0], half.walls[2]), ([Wall::Open; 2], [Wall::Open; 2]));
    assert_eq!(half.bodies, whole.bodies);
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

#[test]
fn curves_have_images_among_the_curves_and_polygons_among_the_polygons() {
    use crate::drawing::{Drawn, Entry, drawn};
    let half = [[0.4, -1.0], [1.3, 0.2], [0.5, 0.9]];
    let points = half.iter().copied().chain(half.iter().rev().map(|[x, y]| [-x, *y]));
    let through: Vec<[f64; 2]> = points.collect();
    let drawing = |entries: &[Entry], by: f64, straight: bool| {
        let Drawn { outline, arcs, .. } = drawn(entries).unwrap();
        let shifted = outline.iter().map(|[x, y]| [x + by, *y]).collect();
        let moved = |arc: &crate::shapes::Arc| match arc.curve {
            Curve::Cubic(cubic) => crate::shapes::Arc {
                curve: Curve::Cubic(crate::cubic::Cubic { control: cubic.control.map(|[x, y]| [x + by, y]) }),
                sides: arc.sides.clone(),
            },
            Curve::Circle { .. } => arc.clone(),
        };
        let arcs = if straight { Vec::new() } else { arcs.iter().map(moved).collect() };
        let shape = Shape::Extrusion { axis: 1, from: 0.0, to: 0.1, outline: shifted, arcs };
        Body::conductor("pad", shape)
    };
    let closed = [Entry::Spline { through: through[1..].to_vec(), to: through[0] }];
    let scene = |bodies: Vec<Body>| Scene {
        bodies,
        background_permittivity: 1.0,
        domain: Box3::SPACE,
        walls: [[Wall::Open; 2]; 3],
    };
    let found = |bodies: Vec<Body>| planes(&scene(bodies))[0].is_some();
    assert!(found(vec![drawing(&closed, 0.0, false)]));
    assert!(found(vec![drawing(&closed, 2.0, false), drawing(&closed, -2.0, false)]));
    assert!(!found(vec![drawing(&closed, 2.0, false), drawing(&closed, -2.0, true)]));
}

#[test]
fn a_capsule_that_leans_has_only_the_plane_that_it_leans_in_unless_another_leans_the_other_way() {
    let capsule = |from: [f64; 3], to: [f64; 3]| Shape::Capsule { from, to, radius: 0.5 };
    let leans = capsule([1.0, 0.0, 0.3], [3.0, 2.0, 0.3]);
    near(planes(&open(vec![leans.clone()])), [None, None, Some(0.3)]);
    let upright = capsule([1.0, 0.0, 0.3], [1.0, 2.0, 0.3]);
    near(planes(&open(vec![upright])), [Some(1.0), Some(1.0), Some(0.3)]);
    // Its image across x1 = 0, written from its other end.
    let image = capsule([-3.0, 2.0, 0.3], [-1.0, 0.0, 0.3]);
    let found = planes(&open(vec![leans.clone(), image]));
    assert_eq!(found[0].as_ref().unwrap().conductors, [1, 0]);
    near(found, [Some(0.0), None, Some(0.3)]);
    let parallel = capsule([-3.0, 0.0, 0.3], [-1.0, 2.0, 0.3]);
    near(planes(&open(vec![leans, parallel])), [None, None, Some(0.3)]);
}
