//! Surfaces with needle triangles that meet at small angles.

use super::{area, check, cube, scene, volume};
use crate::meshing::tets::mesher::{Sizing, mesh};
use crate::meshing::tets::{FaceRole, determinant};
use crate::scene::Wall;
use crate::shapes::{Shape, TriangleSurface};
use elastocap_linalg::vector::{length, normal};
use std::f64::consts::PI;

/// A star of thin teeth between a point above its middle and one below: inner corners at `inner` of the outer
/// radius, up to `warp` off the plane, so that no two triangles lie in one.
fn star(teeth: u32, inner: f64, height: f64, warp: f64) -> TriangleSurface {
    let corner = |k: u32| {
        let (sin, cos) = (PI * f64::from(k) / f64::from(teeth)).sin_cos();
        if k.is_multiple_of(2) {
            [cos, sin, 0.0]
        } else {
            [inner * cos, inner * sin, warp * (f64::from(k / 2 % 3) - 1.0)]
        }
    };
    let mut points = vec![[0.05, 0.0, height], [-0.05, 0.1, -height]];
    points.extend((0..2 * teeth).map(corner));
    let triangles = |k: u32| {
        let (a, b) = (2 + k, 2 + (k + 1) % (2 * teeth));
        [[0, a, b], [1, b, a]]
    };
    TriangleSurface { points, faces: (0..2 * teeth).flat_map(triangles).collect() }
}

#[test]
fn stars_of_needle_triangles_are_met_exactly() {
    for (teeth, inner, height, warp) in [
        (16, 0.3, 0.05, 0.02),
        (16, 0.3, 0.3, 0.02),
        (16, 0.6, 0.05, 0.02),
        (16, 0.9, 0.05, 0.02),
        (40, 0.9, 0.05, 0.02),
    ] {
        let surface = star(teeth, inner, height, warp);
        let corners = |f: &[u32; 3]| f.map(|p| surface.points[p as usize]);
        let solid: f64 = surface
            .faces
            .iter()
            .map(|f| {
                let [a, b, c] = corners(f);
                determinant([0.0; 3], a, b, c) / 6.0
            })
            .sum();
        let faces: f64 = surface.faces.iter().map(|f| 0.5 * length(normal(corners(f)))).sum();
        let out = mesh(&scene(cube(2.0), Wall::Grounded, vec![Shape::Surface(surface)]), &Sizing::default());
        let out = out.unwrap_or_else(|e| panic!("{teeth} teeth, {inner}, {height}: {e}"));
        check(&out);
        let error = volume(&out.mesh, None) - 64.0 + solid;
        assert!(error.abs() < 1e-10, "{teeth} teeth, {inner}, {height}: {error}");
        let metal = area(&out.mesh, |r| r == FaceRole::Conductor(0));
        assert!((metal / faces - 1.0).abs() < 1e-10, "{teeth} teeth, {inner}, {height}: {metal} of {faces}");
    }
}
