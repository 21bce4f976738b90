//! Geometric predicates: the position of a point relative to a plane or a sphere.
//!
//! The signs of [`orientation`] and [`in_sphere`] are exact (Shewchuk's adaptive predicates, Discrete Comput.
//! Geom. 18, 1997, in the crate `robust`); the centres of circles and spheres are rounded.

use crate::meshing::tets::mesher::Point;
use elastocap_linalg::vector::{cross, dot, minus};

/// A point in the form that `robust` takes.
fn coord(p: Point) -> robust::Coord3D<f64> {
    robust::Coord3D { x: p[0], y: p[1], z: p[2] }
}

/// A number with exactly the sign of det(b - a, c - a, d - a): positive for a positive tetrahedron a, b, c,
/// d.
pub(crate) fn orientation(a: Point, b: Point, c: Point, d: Point) -> f64 {
    -robust::orient3d(coord(a), coord(b), coord(c), coord(d))
}

/// Whether a point lies inside, not on, the sphere through the corners of a positive tetrahedron. Exact.
pub(super) fn in_sphere(corners: [Point; 4], p: Point) -> bool {
    let [a, b, c, d] = corners.map(coord);
    robust::insphere(a, b, c, d, coord(p)) < 0.0
}

/// The centre of the circle through three points; `None` if they lie on a line.
pub(crate) fn circumcenter([a, b, c]: [Point; 3]) -> Option<Point> {
    let [u, v] = [b, c].map(|q| minus(q, a));
    let (uu, vv, uv) = (dot(u, u), dot(v, v), dot(u, v));
    let det = 2.0 * (uu * vv - uv * uv);
    let (s, t) = (vv * (uu - uv) / det, uu * (vv - uv) / det);
    (s.is_finite() && t.is_finite()).then(|| [0, 1, 2].map(|k| a[k] + s * u[k] + t * v[k]))
}

/// The centre of the sphere through four points; not finite if they lie in a plane.
pub(crate) fn circumsphere_center([a, b, c, d]: [Point; 4]) -> Point {
    let [u, v, w] = [b, c, d].map(|q| minus(q, a));
    let (vw, wu, uv) = (cross(v, w), cross(w, u), cross(u, v));
    let scale = 0.5 / dot(u, vw);
    [0, 1, 2].map(|k| a[k] + scale * (dot(u, u) * vw[k] + dot(v, v) * wu[k] + dot(w, w) * uv[k]))
}
