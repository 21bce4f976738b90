//! Bodies whose surfaces cross: what each region is left with.

use super::volume;
use crate::meshing::tets::mesher::{MeshError, Sizing, mesh};
use crate::meshing::tets::tests::mesh_checks::conforming;
use crate::samples::{cube, scene};
use crate::scene::{Body, Box3, Scene, Wall};
use crate::shapes::Shape;
use std::f64::consts::PI;

fn between(half: f64, metal: Vec<Shape>, filled: Vec<Shape>) -> Scene {
    let mut out = scene(Box3 { min: [-half; 3], max: [half; 3] }, Wall::Insulated, metal);
    for (k, shape) in filled.into_iter().enumerate() {
        out.bodies.push(Body::dielectric(format!("d{k}"), shape, 2.0 + k as f64));
    }
    out
}

fn ball(center: [f64; 3], radius: f64) -> Shape {
    Shape::Sphere { center, radius }
}

fn rod(axis: usize, base: [f64; 3], radius: f64, height: f64) -> Shape {
    Shape::Cylinder { axis, base, radius, height }
}

/// Volumes of the regions: the surroundings, then each dielectric.
fn volumes(scene: &Scene, facet: f64) -> Vec<f64> {
    let out = mesh(scene, &Sizing { facet, ..Sizing::default() }).unwrap();
    conforming(&out.mesh);
    assert!(out.refined);
    (0..=scene.dielectrics().count() as u32).map(|r| volume(&out.mesh, Some(r))).collect()
}

fn near(found: &[f64], known: &[f64], relative: f64) {
    assert_eq!(found.len(), known.len());
    for (k, (f, v)) in found.iter().zip(known).enumerate() {
        assert!((f - v).abs() <= relative * v, "region {k}: {f} is not {v}: {found:?} {known:?}");
    }
}

/// A cap of a ball of radius `r`, this high.
fn cap(r: f64, h: f64) -> f64 {
    PI * h * h * (3.0 * r - h) / 3.0
}

fn whole(r: f64) -> f64 {
    4.0 / 3.0 * PI * r.powi(3)
}

#[test]
fn of_two_balls_that_overlap_the_later_has_the_lens() {
    let (a, b) = (ball([0.0; 3], 1.0), ball([1.1, 0.05, -0.02], 0.8));
    let d = (1.1_f64.powi(2) + 0.05_f64.powi(2) + 0.02_f64.powi(2)).sqrt();
    let at = (d * d + 1.0 - 0.64) / (2.0 * d);
    let lens = cap(1.0, 1.0 - at) + cap(0.8, 0.8 - (d - at));
    for (shapes, known) in
        [([a.clone(), b.clone()], [whole(1.0) - lens, whole(0.8)]), ([b, a], [whole(0.8) - lens, whole(1.0)])]
    {
        let found = volumes(&between(3.0, vec![], shapes.to_vec()), 0.2);
        near(&found[1..], &known, 2e-3);
        assert!((found.iter().sum::<f64>() - 216.0).abs() < 1e-9);
    }
}

#[test]
fn a_conducting_ball_takes_its_part_of_a_dielectric_ball() {
    for center in [[0.5, 0.0, 0.0], [0.5, 0.013, 0.021]] {
        let scene = between(3.0, vec![ball(center, 0.6)], vec![ball([0.0; 3], 1.0)]);
        let d = center.iter().map(|x| x * x).sum::<f64>().sqrt();
        let at = (d * d + 1.0 - 0.36) / (2.0 * d);
        let lens = cap(1.0, 1.0 - at) + cap(0.6, 0.6 - (d - at));
        let found = volumes(&scene, 0.2);
        near(&found, &[216.0 - whole(1.0) - whole(0.6) + lens, whole(1.0) - lens], 2e-3);
    }
}

#[test]
fn a_small_box_in_a_ball_and_half_out_of_it() {
    let block = Shape::Box(Box3 { min: [-0.3, -0.3, 0.0], max: [0.3, 0.3, 2.0] });
    // The part of the box above the ball of radius 1, by Simpson's rule.
    let n = 200;
    let x = |k: usize| -0.3 + 0.6 * k as f64 / n as f64;
    let weight = |k: usize| if k == 0 || k == n { 1.0 } else { [2.0, 4.0][k % 2] } * 0.2 / n as f64;
    let inside: f64 = (0..=n)
        .flat_map(|i| (0..=n).map(move |j| (i, j)))
        .map(|(i, j)| weight(i) * weight(j) * (1.0 - x(i).powi(2) - x(j).powi(2)).sqrt())
        .sum();
    let found = volumes(&between(3.0, vec![], vec![ball([0.0; 3], 1.0), block.clone()]), 0.2);
    near(&found[1..], &[whole(1.0) - inside, 0.72], 3e-3);
    let found = volumes(&between(3.0, vec![block], vec![ball([0.0; 3], 1.0)]), 0.2);
    near(&found, &[216.0 - whole(1.0) - 0.72 + inside, whole(1.0) - inside], 3e-3);
}

#[test]
fn a_rod_through_a_ball_is_drilled_or_drills() {
    let (r, a) = (0.4_f64, 1.0_f64);
    // The volume that a rod through the middle removes from a ball: 4/3 pi (a^3 - (a^2 - r^2)^(3/2)).
    let core = 4.0 / 3.0 * PI * (a.powi(3) - (a * a - r * r).powf(1.5));
    let long = PI * r * r * 3.0;
    for (axis, base) in [(0, [-1.5, 0.0, 0.0]), (2, [0.0, 0.0, -1.5])] {
        let through = rod(axis, base, r, 3.0);
        let found = volumes(&between(3.0, vec![], vec![ball([0.0; 3], a), through.clone()]), 0.2);
        near(&found[1..], &[whole(a) - core, long], 4e-3);
        let found = volumes(&between(3.0, vec![], vec![through.clone(), ball([0.0; 3], a)]), 0.2);
        near(&found[1..], &[long - core, whole(a)], 4e-3);
        let found = volumes(&between(3.0, vec![through], vec![ball([0.0; 3], a)]), 0.2);
        near(&found[1..], &[whole(a) - core], 4e-3);
    }
}

#[test]
fn crossing_rods_share_what_two_cylinders_have_in_common() {
    let (a, b) = (rod(0, [-1.0, 0.0, 0.0], 0.5, 2.0), rod(2, [0.0, 0.0, -1.0], 0.5, 2.0));
    // Of the same radius: Steinmetz' 16/3 r^3.
    let common = 16.0 / 3.0 * 0.125;
    let found = volumes(&between(3.0, vec![], vec![a.clone(), b.clone()]), 0.2);
    near(&found[1..], &[PI * 0.5 - common, PI * 0.5], 5e-3);
    let found = volumes(&between(3.0, vec![a], vec![b]), 0.2);
    near(&found[1..], &[PI * 0.5 - common], 5e-3);
}

#[test]
fn rods_of_one_radius_stand_on_one_another_and_in_one_another() {
    let (low, high) = (rod(1, [0.0, -1.0, 0.0], 0.5, 1.0), rod(1, [0.0, 0.0, 0.0], 0.5, 1.0));
    let disc = PI * 0.25;
    let found = volumes(&between(3.0, vec![], vec![low.clone(), high.clone()]), 0.2);
    near(&found, &[216.0 - 2.0 * disc, disc, disc], 1e-9);
    // Half of it in the other.
    let middle = rod(1, [0.0, -0.5, 0.0], 0.5, 1.0);
    let found = volumes(&between(3.0, vec![], vec![low.clone(), middle.clone()]), 0.2);
    near(&found[1..], &[0.5 * disc, disc], 1e-9);
    let found = volumes(&between(3.0, vec![low], vec![middle]), 0.2);
    near(&found, &[216.0 - 1.5 * disc, 0.5 * disc], 1e-9);
    // A coating that ends with its core, and one that the core sticks out of.
    let core = rod(1, [0.0, -1.0, 0.0], 0.3, 1.0);
    let coat = rod(1, [0.0, -1.0, 0.0], 0.5, 1.0);
    let found = volumes(&between(3.0, vec![core], vec![coat.clone()]), 0.2);
    near(&found, &[216.0 - disc, PI * 0.16], 1e-9);
    let core = rod(1, [0.0, -1.5, 0.0], 0.3, 2.0);
    let found = volumes(&between(3.0, vec![core], vec![coat]), 0.2);
    near(&found, &[216.0 - disc - PI * 0.09, PI * 0.16], 1e-9);
}

#[test]
fn imported_cubes_cross_what_they_like() {
    let mut turned = cube([0.0; 3], 0.5);
    let (s, c) = 0.4_f64.sin_cos();
    for p in &mut turned.points {
        *p = [c * p[0] - s * p[1], s * p[0] + c * p[1], p[2]];
        *p = [p[0], c * p[1] - s * p[2] + 0.1, s * p[1] + c * p[2]];
    }
    let straight = Shape::Surface(cube([0.5, 0.5, 0.5], 0.5));
    let found = volumes(&between(3.0, vec![], vec![straight, Shape::Surface(turned.clone())]), 0.3);
    assert!((found[2] - 1.0).abs() < 1e-9 && (found.iter().sum::<f64>() - 216.0).abs() < 1e-9, "{found:?}");
    assert!(found[1] > 0.5 && found[1] < 0.9, "{found:?}");
    let shifted = cube([0.25, 0.0, 0.5], 0.5);
    let cubes = vec![Shape::Surface(cube([0.0; 3], 0.5)), Shape::Surface(shifted)];
    near(&volumes(&between(3.0, vec![], cubes), 0.3)[1..], &[0.625, 1.0], 1e-9);
    let found = volumes(&between(3.0, vec![ball([0.0, 0.1, 0.0], 0.4)], vec![Shape::Surface(turned)]), 0.3);
    assert!((found.iter().sum::<f64>() - 216.0 + whole(0.4)).abs() < 1e-9, "{found:?}");
}

#[test]
fn a_face_may_lie_on_part_of_another() {
    let slab = Shape::Box(Box3 { min: [-1.0, -0.5, -1.0], max: [1.0, 0.0, 1.0] });
    let outline = vec![[0.3, 0.2], [1.7, 0.5], [1.1, 1.9]];
    let area = 0.5 * (1.4 * 1.7 - 0.3 * 0.8);
    let wedge = Shape::Extrusion { axis: 1, from: 0.0, to: 0.4, outline, arcs: Vec::new() };
    let disc = rod(1, [-0.9, 0.0, 0.2], 0.5, 0.3);
    let found = volumes(&between(3.0, vec![disc], vec![slab, wedge]), 0.3);
    near(&found[1..], &[2.0, 0.4 * area], 1e-9);
    assert!((found.iter().sum::<f64>() - 216.0 + 0.3 * PI * 0.25).abs() < 1e-9);
}

#[test]
fn walls_cut_bodies_that_cross() {
    let domain = Box3 { min: [0.0, 0.0, -3.0], max: [3.0; 3] };
    let mut scene = between(3.0, vec![ball([0.0, 0.0, 0.4], 0.6)], vec![ball([0.0; 3], 1.0)]);
    scene.domain = domain;
    let at = (0.16 + 1.0 - 0.36) / 0.8;
    let lens = cap(1.0, 1.0 - at) + cap(0.6, 0.6 - (0.4 - at));
    near(&volumes(&scene, 0.2)[1..], &[0.25 * (whole(1.0) - lens)], 4e-3);
}

#[test]
fn conductors_may_neither_cross_nor_touch() {
    let crossing = |a: Shape, b: Shape| mesh(&between(3.0, vec![a, b], vec![]), &Sizing::default());
    for (a, b) in [
        (ball([0.0; 3], 0.5), rod(0, [0.2, 0.0, 0.0], 0.2, 1.0)),
        (rod(0, [0.0; 3], 0.5, 1.0), rod(0, [1.0, 0.1, 0.0], 0.2, 1.0)),
        (Shape::Surface(cube([0.0; 3], 0.5)), Shape::Surface(cube([1.0, 0.2, 0.3], 0.5))),
    ] {
        let found = crossing(a, b);
        let Err(MeshError::Crossing { first, second, .. }) = &found else { panic!("{found:?}") };
        assert_eq!([&first[..], &second[..]], ["c0", "c1"]);
    }
}

#[test]
fn a_block_takes_half_of_a_rod_whose_axis_lies_in_its_side_and_corners_of_the_rod_with_it() {
    let walls = Box3 { min: [-1.125, 0.0, -0.675], max: [1.125, 4.95, 0.675] };
    let block = Shape::Box(Box3 { min: [-0.9, 0.9, -0.45], max: [0.9, 2.9, 0.45] });
    let mut scene = scene(walls, Wall::Grounded, vec![block]);
    scene.bodies.push(Body::dielectric("rod", rod(1, [0.9, 0.585, 0.0], 0.225, 0.45), 2.0));
    // A quarter of the rod is above the lower face of the block, of which half is within the block.
    let left = PI * 0.225_f64.powi(2) * (0.45 - 0.135 / 2.0);
    let whole = 2.25 * 4.95 * 1.35 - 1.8 * 2.0 * 0.9;
    for facet in [0.3, 0.27, 0.243, 0.15] {
        // The parts outside the wall are cut off.
        near(&volumes(&scene, facet), &[whole - left, left], 2e-3);
    }
}
