//! Flat faces in place of curved surfaces.

use super::capsule::capsule;
use super::delaunay::orientation;
use super::{Point, Sizing};
use crate::meshing::tets::determinant;
use crate::outline;
use crate::scene::across;
use crate::shapes::{Shape, TriangleSurface};
use std::collections::HashMap;
use std::f64::consts::{PI, TAU};

/// Corners of a regular polygon with the area of a circle; its sides are about `side` times the radius.
fn polygon_for_circle(center: [f64; 2], radius: f64, side: f64) -> Vec<[f64; 2]> {
    let n = ((TAU / side).ceil() as usize).clamp(8, 400).next_multiple_of(4);
    let angle = TAU / n as f64;
    outline::on_circle(center, radius * (angle / angle.sin()).sqrt(), n)
}

/// A geodesic polyhedron with the volume of a ball; the sides of its triangles are about `side` times the
/// radius.
///
/// The faces of an icosahedron are divided into equal parts and projected to the sphere. Then all corners
/// move out by the same factor, 1 + O(`side`^2).
pub(super) fn geodesic(center: Point, radius: f64, side: f64) -> TriangleSurface {
    let golden_ratio = (1.0 + 5.0_f64.sqrt()) / 2.0;
    let mut corners: Vec<Point> = Vec::new();
    for k in 0..3 {
        for (s, t) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
            let mut p = [0.0; 3];
            p[(k + 1) % 3] = s;
            p[(k + 2) % 3] = t * golden_ratio;
            corners.push(p);
        }
    }
    let squared_distance = |a: Point, b: Point| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>();
    let adjacent = |i: usize, j: usize| (squared_distance(corners[i], corners[j]) - 4.0).abs() < 1e-9;
    let n = ((1.1 / side).ceil() as usize).clamp(1, 100);
    let mut out = TriangleSurface::default();
    let mut known: HashMap<Vec<(usize, usize)>, u32> = HashMap::new();
    for i in 0..12 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                if !(adjacent(i, j) && adjacent(j, k) && adjacent(i, k)) {
                    continue;
                }
                let outward = orientation([0.0; 3], corners[i], corners[j], corners[k]) > 0.0;
                let ids = if outward { [i, j, k] } else { [i, k, j] };
                // Points are identified by their weights at the corners, so that triangles share those on
                // common sides.
                let mut point = |a: usize, b: usize| {
                    let weights = [n - a - b, a, b];
                    let mut key: Vec<(usize, usize)> =
                        (0..3).filter(|&m| weights[m] > 0).map(|m| (ids[m], weights[m])).collect();
                    key.sort_unstable();
                    let mut p = [0.0; 3];
                    for &(corner, weight) in &key {
                        p = [0, 1, 2].map(|m| p[m] + weight as f64 * corners[corner][m]);
                    }
                    let length = squared_distance(p, [0.0; 3]).sqrt();
                    *known.entry(key).or_insert_with(|| {
                        out.points.push(p.map(|x| x / length));
                        out.points.len() as u32 - 1
                    })
                };
                let mut faces = Vec::new();
                for a in 0..n {
                    for b in 0..n - a {
                        faces.push([point(a, b), point(a + 1, b), point(a, b + 1)]);
                        if a + b + 1 < n {
                            faces.push([point(a + 1, b), point(a + 1, b + 1), point(a, b + 1)]);
                        }
                    }
                }
                out.faces.extend(faces);
            }
        }
    }
    let volume: f64 = out
        .faces
        .iter()
        .map(|f| {
            let [a, b, c] = f.map(|p| out.points[p as usize]);
            determinant([0.0; 3], a, b, c) / 6.0
        })
        .sum();
    let factor = radius * (4.0 / 3.0 * PI / volume).cbrt();
    for p in &mut out.points {
        *p = [0, 1, 2].map(|k| center[k] + factor * p[k]);
    }
    out
}

/// The shape as it is meshed, in one or more pieces with flat faces in place of curved ones. A
/// [`Shape::Shell`] becomes its hollow.
pub(super) fn faceted(shape: &Shape, sizing: &Sizing) -> Vec<Shape> {
    let middle = |axis: usize, base: &Point| across(axis).map(|a| base[a]);
    let extruded = |axis: usize, base: &Point, height: f64, outline: Vec<[f64; 2]>| Shape::Extrusion {
        axis,
        from: base[axis],
        to: base[axis] + height,
        outline,
        arcs: Vec::new(),
    };
    match shape {
        Shape::Sphere { center, radius } | Shape::Shell { center, radius } => {
            vec![Shape::Surface(geodesic(*center, *radius, sizing.facet))]
        }
        Shape::Capsule { from, to, radius } => {
            vec![Shape::Surface(capsule([*from, *to], *radius, sizing.facet))]
        }
        Shape::Cylinder { axis, base, radius, height } => {
            let outline = polygon_for_circle(middle(*axis, base), *radius, sizing.facet);
            vec![extruded(*axis, base, *height, outline)]
        }
        Shape::Tube { axis, base, radii, height } => {
            let [inner, outer] =
                radii.map(|radius| polygon_for_circle(middle(*axis, base), radius, sizing.facet));
            let halves = outline::halves_between(&inner, &outer);
            halves.into_iter().map(|outline| extruded(*axis, base, *height, outline)).collect()
        }
        Shape::Box(_) | Shape::Extrusion { .. } | Shape::Surface(_) | Shape::Physical(_) => {
            vec![shape.clone()]
        }
    }
}
