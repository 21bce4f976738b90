//! Conductors that are much less thick than they are wide.

use super::*;
use crate::scene::Scene;

/// A conductor in open space.
fn alone(shape: Shape) -> Scene {
    let walls = [[Wall::Open; 2]; 3];
    Scene {
        bodies: vec![Body::conductor("metal", shape)],
        background_permittivity: 1.0,
        domain: Box3::SPACE,
        walls,
    }
}

fn plate(thickness: f64) -> Shape {
    Shape::Box(Box3 { min: [-1.0, 0.0, -0.6], max: [1.0, thickness, 0.6] })
}

fn disc(thickness: f64) -> Shape {
    Shape::Cylinder { axis: 1, base: [0.0; 3], radius: 1.0, height: thickness }
}

fn cross(thickness: f64) -> Shape {
    let arm = [[1.0, -0.3], [1.0, 0.3], [0.3, 0.3]];
    let turned = |[x, y]: [f64; 2], times: usize| (0..times).fold([x, y], |[x, y], _| [-y, x]);
    let outline = (0..4).flat_map(|times| arm.map(|p| turned(p, times))).collect();
    Shape::Extrusion { axis: 1, from: 0.0, to: thickness, outline, arcs: Vec::new() }
}

/// The largest angle of a triangle, degrees.
fn largest_angle(mesh: &TetMesh, face: [u32; 3]) -> f64 {
    let p = face.map(|p| mesh.points[p as usize]);
    let angle = |k: usize| {
        let [a, b, c] = [p[k], p[(k + 1) % 3], p[(k + 2) % 3]];
        let [u, v] = [b, c].map(|q| [0, 1, 2].map(|x| q[x] - a[x]));
        let product = |u: [f64; 3], v: [f64; 3]| u.iter().zip(v).map(|(u, v)| u * v).sum::<f64>();
        (product(u, v) / (product(u, u) * product(v, v)).sqrt()).acos().to_degrees()
    };
    (0..3).map(angle).fold(0.0, f64::max)
}

#[test]
fn most_triangles_on_the_sides_of_thin_metal_have_no_angle_above_ninety_degrees() {
    for ratio in [1e-3, 1e-4] {
        for shape in [plate(ratio), disc(ratio), cross(ratio)] {
            let sizing = Sizing { thin_edge: 0.04, growth: 0.4, ..Sizing::default() };
            let found = mesh(&alone(shape), &sizing).unwrap();
            let mesh = &found.mesh;
            assert!(found.refined && mesh.points.len() < 12_000, "{}", mesh.points.len());
            let side = |f: &&BoundaryFace| {
                let heights = f.face.map(|p| mesh.points[p as usize][1]);
                let inside = heights.iter().all(|y| (0.0..=ratio).contains(y));
                inside && matches!(f.role, FaceRole::Conductor(_)) && heights.iter().any(|y| *y != heights[0])
            };
            let sides: Vec<_> = mesh.boundary.iter().filter(side).collect();
            // Refinement divides some edges on one side only.
            let obtuse = sides.iter().filter(|f| largest_angle(mesh, f.face) > 90.001).count();
            assert!(
                sides.len() > 60 && obtuse < sides.len() / 2,
                "{ratio}: {obtuse} of {}, {} points",
                sides.len(),
                mesh.points.len()
            );
        }
    }
}

#[test]
fn metal_that_is_not_thin_is_meshed_as_without_points_along_its_edges() {
    let scene = alone(plate(0.2));
    let fine = Sizing { thin_edge: 0.02, ..Sizing::default() };
    assert_eq!(fine.points_along_thin_edges(&scene), None);
    assert_eq!(mesh(&scene, &fine), mesh(&scene, &Sizing::default()));
}

#[test]
fn the_number_of_points_along_thin_edges_is_predicted_within_a_factor_of_two() {
    for (shape, expected) in [(plate(1e-3), 2.0 * 6.4), (disc(1e-3), 4.0 * PI)] {
        let sizing = Sizing { thin_edge: 0.01, ..Sizing::default() };
        let width = if matches!(shape, Shape::Box(_)) { 1.2 } else { 2.0 };
        let found = sizing.points_along_thin_edges(&alone(shape)).unwrap() / (expected / (0.01 * width));
        assert!(found > 0.5 && found < 2.0, "{found}");
    }
}
