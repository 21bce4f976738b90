//! Tetrahedra with angles near 180 degrees, which spoil the lower bound.

use super::check;
use crate::meshing::tets::determinant;
use crate::meshing::tets::mesher::boundary_recovery::MeshInProgress;
use crate::meshing::tets::mesher::delaunay::Insertion;
use crate::meshing::tets::mesher::piecewise_linear_complex::PiecewiseLinearComplex;
use crate::meshing::tets::mesher::{Sizing, mesh};
use crate::meshing::tets::tetrahedron::angle_below_flat;
use crate::scene::{Body, Box3, Scene, Wall};
use crate::shapes::{Shape, TriangleSurface};
use std::f64::consts::PI;

/// A torus of five sides, m, with the coordinates of a file with six digits: the two triangles of each flat
/// side meet at an angle near 180 degrees that is as good as random.
fn torus_from_a_file(around: u32, radius: f64) -> TriangleSurface {
    const SIDES: u32 = 5;
    let rounded = |x: f64| 1e-3 * ((x * 1e6).round() / 1e6);
    let corner = |k: u32| {
        let (sin, cos) = (2.0 * PI * f64::from(k / SIDES) / f64::from(around)).sin_cos();
        let (high, out) = (2.0 * PI * f64::from(k % SIDES) / f64::from(SIDES)).sin_cos();
        let out = 1.0 + radius * out;
        [out * cos, out * sin, radius * high].map(rounded)
    };
    let sides = |k: u32| {
        let at = |i: u32, j: u32| i % around * SIDES + j % SIDES;
        let (i, j) = (k / SIDES, k % SIDES);
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        [[a, b, c], [a, c, d]]
    };
    let count = SIDES * around;
    TriangleSurface { points: (0..count).map(corner).collect(), faces: (0..count).flat_map(sides).collect() }
}

#[test]
fn triangles_that_lie_in_one_plane_but_for_rounding_leave_no_flat_tetrahedra() {
    for (around, radius) in [(5, 0.5), (6, 0.4), (5, 0.3)] {
        let torus = Shape::Surface(torus_from_a_file(around, radius));
        let scene = Scene {
            bodies: vec![Body::conductor("torus", torus)],
            background_permittivity: 1.0,
            domain: Box3::SPACE,
            walls: [[Wall::Open; 2]; 3],
        };
        let out = mesh(&scene, &Sizing::default()).unwrap();
        check(&out);
        assert!(out.quality.largest_angle < 178.0, "{around}, {radius}: {:?}", out.quality);
    }
}

#[test]
fn a_flip_removes_a_flat_tetrahedron_without_a_further_point() {
    let mut work =
        MeshInProgress::new(PiecewiseLinearComplex::default(), [-1.0; 3], [1.0; 3], None, usize::MAX)
            .unwrap();
    let flat = [[0.3, 0.0, 1e-4], [-0.3, 0.0, 1e-4], [0.0, 0.3, -1e-4], [0.0, -0.3, -1e-4]];
    for at in flat.into_iter().chain([[0.0, 0.0, 0.5], [0.0, 0.0, -0.5]]) {
        let hint = work.mesh.tet_at(work.mesh.points.len() as u32 - 1);
        work.mesh.insert(&Insertion::free(at, hint)).unwrap();
    }
    let alive = |work: &MeshInProgress| -> Vec<u32> {
        (0..work.mesh.tets.len() as u32).filter(|&t| work.mesh.alive(t)).collect()
    };
    let is_flat = |work: &MeshInProgress, t: u32| angle_below_flat(work.mesh.corners(t)) < 0.01;
    let found: Vec<u32> = alive(&work).into_iter().filter(|&t| is_flat(&work, t)).collect();
    assert_eq!(found.len(), 1);
    assert!(work.flip_flat(found[0], 1.5));
    let mut volume = 0.0;
    for t in alive(&work) {
        let [a, b, c, d] = work.mesh.corners(t);
        volume += determinant(a, b, c, d) / 6.0;
        assert!(!is_flat(&work, t));
        for i in 0..4 {
            let Some(n) = work.mesh.neighbour(t, i) else { continue };
            assert!(work.mesh.alive(n) && (0..4).any(|j| work.mesh.neighbour(n, j) == Some(t)));
            assert!(work.mesh.face(t, i).iter().all(|p| work.mesh.tets[n as usize].contains(p)));
        }
    }
    assert!((volume - 8.0).abs() < 1e-12, "{volume}");
}
