//! How round tetrahedra are.

use super::Point;
use super::delaunay::{EDGES, FACES, circumsphere_center};
use crate::meshing::tets::{TetMesh, determinant};
use elastocap_linalg::vector::{dot, length, minus, normal};

/// 1 for a regular tetrahedron, 0 for a flat one, negative for one turned inside out: sqrt(2) times the determinant over the
/// third power of the root mean square of the edges.
pub(super) fn roundness(corners: [Point; 4]) -> f64 {
    let [a, b, c, d] = corners;
    let squares: f64 = EDGES.iter().map(|&[i, j]| length(minus(corners[i], corners[j])).powi(2)).sum();
    determinant(a, b, c, d) * 2.0_f64.sqrt() / (squares / 6.0).powf(1.5)
}

/// How far the largest angle between two faces is from 180 degrees, rad: 1.91 for a regular tetrahedron, not positive for one without
/// volume or turned inside out. Needles with good angles count as good.
pub(super) fn angle_below_flat(corners: [Point; 4]) -> f64 {
    let [a, b, c, d] = corners;
    let six = determinant(a, b, c, d);
    if six <= 0.0 {
        return six;
    }
    let normals = FACES.map(|f| normal(f.map(|k| corners[k])));
    // The faces opposite two corners meet at the edge of the two others.
    let from_flat = |[i, j]: [usize; 2], [k, l]: [usize; 2]| {
        (six * length(minus(corners[l], corners[k]))).atan2(dot(normals[i], normals[j]))
    };
    let pairs = EDGES.iter().zip(EDGES.iter().rev());
    pairs.fold(f64::INFINITY, |least, (&own, &other)| least.min(from_flat(own, other)))
}

/// A measure of the shape of tetrahedra.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) enum Measure {
    /// See [`roundness`].
    #[default]
    Roundness,
    /// See [`angle_below_flat`].
    AngleBelowFlat,
}

impl Measure {
    /// Of a tetrahedron with these corners: larger is better, negative is turned inside out.
    pub(super) fn of(self, corners: [Point; 4]) -> f64 {
        match self {
            Self::Roundness => roundness(corners),
            Self::AngleBelowFlat => angle_below_flat(corners),
        }
    }
}

/// Shapes of the worst tetrahedra of a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quality {
    /// Smallest angle between two faces of a tetrahedron, degrees; 70.5 at best.
    pub smallest_angle: f64,
    /// Largest angle between two faces of a tetrahedron, degrees.
    pub largest_angle: f64,
    /// Largest circumradius of a tetrahedron relative to its shortest edge; 0.61 at best.
    pub radius_to_edge: f64,
}

impl Quality {
    /// The worst values of all tetrahedra of a mesh.
    pub fn of(mesh: &TetMesh) -> Self {
        let mut out = Self { smallest_angle: 180.0, largest_angle: 0.0, radius_to_edge: 0.0 };
        for tet in &mesh.tets {
            let at = tet.map(|p| mesh.points[p as usize]);
            let normals = FACES.map(|f| {
                let n = normal(f.map(|k| at[k]));
                n.map(|x| x / length(n))
            });
            for [i, j] in EDGES {
                let angle = (-dot(normals[i], normals[j])).clamp(-1.0, 1.0).acos().to_degrees();
                out.smallest_angle = out.smallest_angle.min(angle);
                out.largest_angle = out.largest_angle.max(angle);
            }
            let edge = |[i, j]: [usize; 2]| length(minus(at[i], at[j]));
            let shortest = EDGES.iter().fold(f64::INFINITY, |s, &ends| s.min(edge(ends)));
            out.radius_to_edge =
                out.radius_to_edge.max(length(minus(circumsphere_center(at), at[0])) / shortest);
        }
        out
    }
}
