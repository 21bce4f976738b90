//! Faces, edges and measures of shape of a tetrahedron.

use super::determinant;
use elastocap_linalg::vector::{dot, length, minus, normal};

/// Corners of the face opposite each corner; with that corner they make a positive determinant.
pub(super) const FACES: [[usize; 3]; 4] = [[1, 3, 2], [0, 2, 3], [0, 3, 1], [0, 1, 2]];
/// The pairs of corners that are the edges.
pub(super) const EDGES: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];

/// The roundness of a tetrahedron: 1 for a regular one, 0 for a flat one, negative for one turned inside out:
/// sqrt(2) times the determinant over the third power of the root mean square of the edges.
pub(super) fn roundness(corners: [[f64; 3]; 4]) -> f64 {
    let [a, b, c, d] = corners;
    let squares: f64 = EDGES.iter().map(|&[i, j]| length(minus(corners[i], corners[j])).powi(2)).sum();
    determinant(a, b, c, d) * 2.0_f64.sqrt() / (squares / 6.0).powf(1.5)
}

/// The difference between 180 degrees and the largest angle between two faces, rad: 1.91 for a regular
/// tetrahedron, not positive for one without volume or turned inside out. Thin tetrahedra whose angles are
/// good count as good.
pub(super) fn angle_below_flat(corners: [[f64; 3]; 4]) -> f64 {
    let [a, b, c, d] = corners;
    let six_volumes = determinant(a, b, c, d);
    if six_volumes <= 0.0 {
        return six_volumes;
    }
    let normals = FACES.map(|f| normal(f.map(|k| corners[k])));
    // The faces opposite two corners meet at the edge of the two others.
    let from_flat = |[i, j]: [usize; 2], [k, l]: [usize; 2]| {
        (six_volumes * length(minus(corners[l], corners[k]))).atan2(dot(normals[i], normals[j]))
    };
    let pairs = EDGES.iter().zip(EDGES.iter().rev());
    pairs.fold(f64::INFINITY, |least, (&edge, &opposite)| least.min(from_flat(edge, opposite)))
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
    /// The measure of a tetrahedron with these corners: larger is better, negative is turned inside out.
    pub(super) fn of(self, corners: [[f64; 3]; 4]) -> f64 {
        match self {
            Self::Roundness => roundness(corners),
            Self::AngleBelowFlat => angle_below_flat(corners),
        }
    }
}
