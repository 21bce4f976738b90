//! Outlines with splines in the solver for extruded scenes: against exact values, polygons, mirror images and
//! itself.

use elastocap_electrostatics::{
    Bounded, ResolutionLevel, Settings, Solution, Target, VACUUM_PERMITTIVITY, solve_extruded,
};
use elastocap_geometry::drawing::{Drawn, Entry, drawn};
use elastocap_geometry::scene::{Body, Box3, Scene, Wall};
use elastocap_geometry::shapes::{Curve, Shape};
use std::f64::consts::TAU;

fn settings(relative_tolerance: f64, target: Target) -> Settings {
    Settings { relative_tolerance, target, ..Settings::default() }
}

fn solved(scene: &Scene, relative_tolerance: f64, target: Target) -> Solution {
    solve_extruded(scene, &settings(relative_tolerance, target)).unwrap().solution
}

/// A scene between insulated walls.
fn in_walls(bodies: Vec<Body>, low: [f64; 3], high: [f64; 3]) -> Scene {
    let domain = Box3 { min: low, max: high };
    Scene { bodies, background_permittivity: 1.0, domain, walls: [[Wall::Insulated; 2]; 3] }
}

fn open(bodies: Vec<Body>) -> Scene {
    Scene { bodies, background_permittivity: 1.0, domain: Box3::SPACE, walls: [[Wall::Open; 2]; 3] }
}

/// An outline along x2 from its entries.
fn drawing(entries: &[Entry], [from, to]: [f64; 2]) -> Shape {
    let Drawn { outline, arcs, .. } = drawn(entries).unwrap();
    Shape::Extrusion { axis: 1, from, to, outline, arcs }
}

/// A closed spline through points.
fn closed(points: &[[f64; 2]]) -> Vec<Entry> {
    let (to, through) = points.split_first().unwrap();
    vec![Entry::Spline { through: through.to_vec(), to: *to }]
}

/// A pad with an edge that curves in and out.
fn pad() -> Vec<[f64; 2]> {
    vec![[-1.0, -0.6], [0.1, -0.8], [1.1, -0.5], [0.8, 0.2], [1.2, 0.8], [0.0, 0.6], [-0.9, 0.9], [-1.2, 0.1]]
}

/// Half the integral of x dy - y dx along an outline: its area, exactly.
fn area(shape: &Shape) -> f64 {
    let Shape::Extrusion { outline, arcs, .. } = shape else { panic!("{shape:?}") };
    let cross = |p: [f64; 2], q: [f64; 2]| p[0] * q[1] - p[1] * q[0];
    let (mut sum, mut k) = (0.0, 0);
    while k < outline.len() {
        if let Some(arc) = arcs.iter().find(|arc| arc.sides.start == k) {
            let Curve::Cubic(cubic) = arc.curve else { panic!("{arc:?}") };
            let [a, b, c, d] = cubic.control;
            let near = 2.0 * cross(a, b) + cross(b, c) + 2.0 * cross(c, d);
            sum += 0.15 * (near + cross(a, c) + cross(b, d) + cross(a, d) / 3.0);
            k = arc.sides.end;
        } else {
            sum += 0.5 * cross(outline[k], outline[(k + 1) % outline.len()]);
            k += 1;
        }
    }
    sum.abs()
}

fn overlap(a: Bounded, b: Bounded) -> bool {
    a.lower <= b.upper && b.lower <= a.upper
}

#[test]
fn a_plate_capacitor_with_a_dielectric_between_splines_has_exactly_the_area_of_that() {
    // The field is uniform in each dielectric. The island has a closed spline, or straight sides too, or is
    // cut by the straight edge of another dielectric.
    let beside = vec![
        Entry::Corner([-1.0, -1.0]),
        Entry::Corner([0.7, -1.0]),
        Entry::Spline { through: vec![[1.1, -0.2], [0.2, 0.3], [0.9, 1.1]], to: [-1.0, 0.9] },
    ];
    for (entries, cut) in [(closed(&pad()), None), (beside.clone(), None), (beside, Some(0.137))] {
        let shape = drawing(&entries, [0.1, 0.4]);
        let island_area = area(&shape);
        let mut bodies = vec![
            Body::conductor("lower", Shape::Box(Box3 { min: [-1.5, 0.0, -1.5], max: [1.5, 0.1, 1.5] })),
            Body::conductor("upper", Shape::Box(Box3 { min: [-1.5, 0.4, -1.5], max: [1.5, 0.5, 1.5] })),
            Body::dielectric("island", shape, 5.0),
        ];
        if let Some(x) = cut {
            // A slab in the layer of the island, of the permittivity outside, whose edge crosses both curves.
            bodies.insert(
                2,
                Body::dielectric(
                    "slab",
                    Shape::Box(Box3 { min: [x, 0.1, -1.5], max: [1.5, 0.4, 1.5] }),
                    1.0 + 1e-9,
                ),
            );
        }
        let scene = in_walls(bodies, [-1.5, 0.0, -1.5], [1.5, 0.5, 1.5]);
        let c = solved(&scene, 1e-6, Target::TwoTerminal).two_terminal.unwrap();
        let exact = VACUUM_PERMITTIVITY * (9.0 + 4.0 * island_area) / 0.3;
        let slack = if cut.is_some() { 1e-9 * exact } else { 0.0 };
        assert!(c.lower - slack <= exact && exact <= c.upper + slack, "{c:?} {exact:e}");
        assert!(c.spread_over_value() < 2e-8, "{:e}", c.spread_over_value());
    }
}

#[test]
fn a_circle_drawn_as_a_spline_has_the_capacitance_of_the_circle_the_better_the_more_points_it_has() {
    let exact = TAU * VACUUM_PERMITTIVITY / 2.0_f64.ln();
    let mut before = f64::INFINITY;
    for n in [6, 12, 24] {
        let place = |k: u32| {
            let angle = TAU * f64::from(k) / f64::from(n) + 0.1;
            [angle.cos(), angle.sin()]
        };
        let points: Vec<[f64; 2]> = (0..n).map(place).collect();
        let inner = Body::conductor("inner", drawing(&closed(&points), [0.0, 1.0]));
        let outer = Shape::Tube { axis: 1, base: [0.0; 3], radii: [2.0, 2.5], height: 1.0 };
        let scene =
            in_walls(vec![inner, Body::conductor("outer", outer)], [-3.0, 0.0, -3.0], [3.0, 1.0, 3.0]);
        let c = solved(&scene, 1e-7, Target::TwoTerminal).two_terminal.unwrap();
        assert!(c.spread_over_value() <= 1e-7, "{n}: {:e}", c.spread_over_value());
        let differs = (c.value / exact - 1.0).abs();
        assert!(differs < before / 10.0, "{n}: {differs:e}");
        before = differs;
    }
    assert!(before < 3e-5, "{before:e}");
}

/// In a grounded box.
fn in_box(pad: Shape) -> Scene {
    let walls = [[Wall::Grounded; 2]; 3];
    Scene { walls, ..in_walls(vec![Body::conductor("pad", pad)], [-1.6, 0.0, -1.4], [1.6, 0.6, 1.4]) }
}

fn on_mesh(scene: &Scene, order: usize, levels: usize) -> Bounded {
    let resolution = Some(ResolutionLevel { order, levels });
    let fixed = Settings { resolution, ..settings(1e-2, Target::Matrix) };
    solve_extruded(scene, &fixed).unwrap().solution.maxwell[0][0]
}

#[test]
fn the_bounds_of_a_pad_between_splines_contain_each_others_values_at_every_degree() {
    let scene = in_box(drawing(&closed(&pad()), [0.2, 0.3]));
    let found: Vec<Bounded> = (2..=6).map(|order| on_mesh(&scene, order, (order - 1).min(2))).collect();
    for pair in found.windows(2) {
        assert!(pair[1].spread_over_value() < pair[0].spread_over_value(), "{found:?}");
    }
    let best = found[4].value;
    assert!(found.iter().all(|c| c.lower < best && best < c.upper), "{found:?}");
    assert!(found[4].spread_over_value() < 5e-3, "{:e}", found[4].spread_over_value());
}

#[test]
fn a_mirrored_and_a_turned_spline_have_the_same_capacitance_as_a_fine_polygon_has() {
    let points_of_pad = pad();
    let with = |pad: Shape| on_mesh(&in_box(pad), 4, 2);
    let curved = with(drawing(&closed(&points_of_pad), [0.2, 0.3]));
    let mirrored: Vec<[f64; 2]> = points_of_pad.iter().map(|[x, z]| [-x, *z]).collect();
    // From another point, the other way round.
    let turned: Vec<[f64; 2]> = points_of_pad.iter().map(|[x, z]| [-x, -z]).rev().collect();
    for points in [mirrored, turned] {
        let other = with(drawing(&closed(&points), [0.2, 0.3]));
        assert!(overlap(curved, other), "{curved:?} {other:?}");
        assert!((other.value / curved.value - 1.0).abs() < 5e-4, "{curved:?} {other:?}");
    }
    let Shape::Extrusion { axis, from, to, outline, .. } = drawing(&closed(&points_of_pad), [0.2, 0.3])
    else {
        panic!()
    };
    let polygon = on_mesh(&in_box(Shape::Extrusion { axis, from, to, outline, arcs: Vec::new() }), 3, 1);
    assert!(overlap(curved, polygon), "{curved:?} {polygon:?}");
    assert!((polygon.value / curved.value - 1.0).abs() < 1e-2, "{curved:?} {polygon:?}");
}

#[test]
fn a_scene_with_splines_that_is_its_own_mirror_image_is_divided_where_it_is() {
    // About x1 = 0, between the points of the spline and through some of them; about a diagonal, once it is
    // turned.
    let half = [[0.3, -0.9], [1.2, -0.7], [0.8, 0.1], [1.1, 0.8]];
    let outline = |last: &[[f64; 2]]| -> Vec<[f64; 2]> {
        let left = half.iter().rev().map(|[x, z]| [-x, *z]);
        half.iter().copied().chain(last.iter().copied()).chain(left).collect()
    };
    let on_diagonal = |points: Vec<[f64; 2]>| -> Vec<[f64; 2]> {
        points.iter().map(|[x, z]| [x, z].map(|y| 0.5_f64.sqrt() * y)).map(|[x, z]| [x + z, z - x]).collect()
    };
    for points in [outline(&[]), outline(&[[0.0, 0.6]]), on_diagonal(outline(&[[0.0, 0.6]]))] {
        let above = Body::conductor("above", drawing(&closed(&points), [0.0, 0.1]));
        let below = Body::conductor("below", drawing(&closed(&points), [-0.3, -0.2]));
        let scene = open(vec![above, below]);
        let level = Some(ResolutionLevel { order: 3, levels: 1 });
        let [with, without] = [true, false].map(|symmetry| {
            let fixed = Settings { symmetry, resolution: level, ..settings(1e-3, Target::Matrix) };
            solve_extruded(&scene, &fixed).unwrap().solution
        });
        assert_eq!(with.mirrored.iter().filter(|m| **m).count(), 2);
        for (a, b) in with.maxwell.iter().flatten().zip(without.maxwell.iter().flatten()) {
            assert!(overlap(*a, *b), "{a:?} {b:?}");
            assert!((a.value - b.value).abs() < 0.3 * (a.upper - a.lower), "{a:?} {b:?}");
        }
    }
}
