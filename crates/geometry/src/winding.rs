//! Tests whether a point is inside a surface, by the generalised winding number.

use crate::triangle_surface::TriangleSurface;
use elastocap_linalg::vector::{dot, length, minus};

/// The winding number of a surface around a point: 1 inside a surface whose triangles face outward, 0
/// outside. It is the sum of the solid angles of the triangles over 4 pi (van Oosterom and Strackee 1983;
/// Jacobson, Kavan and Sorkine-Hornung 2013), and undefined on the surface itself.
pub fn winding_number(surface: &TriangleSurface, point: [f64; 3]) -> f64 {
    of_faces(&surface.points, surface.faces.iter(), point)
}

/// Whether the surface, whose triangles must face outward, encloses the point.
pub fn contains(surface: &TriangleSurface, point: [f64; 3]) -> bool {
    let beyond = |a: usize| {
        surface.points.iter().all(|p| p[a] < point[a]) || surface.points.iter().all(|p| p[a] > point[a])
    };
    !(0..3).any(beyond) && winding_number(surface, point) > 0.5
}

/// The share of some faces of a surface in its winding number around a point.
pub(crate) fn of_faces<'a>(
    points: &[[f64; 3]],
    faces: impl Iterator<Item = &'a [u32; 3]>,
    point: [f64; 3],
) -> f64 {
    faces.map(|f| solid_angle(f.map(|p| points[p as usize]), point)).sum::<f64>()
        / (4.0 * std::f64::consts::PI)
}

/// The solid angle of a triangle seen from a point, positive if the triangle faces away from it.
fn solid_angle(corners: [[f64; 3]; 3], point: [f64; 3]) -> f64 {
    let [u, v, w] = corners.map(|c| minus(c, point));
    let triple = crate::meshing::tets::determinant([0.0; 3], u, v, w);
    let [lu, lv, lw] = [u, v, w].map(length);
    2.0 * triple.atan2(lu * lv * lw + dot(u, v) * lw + dot(v, w) * lu + dot(w, u) * lv)
}
