//! An estimate of the faceting error from a mesh that does not say which of its faces are curved.

use elastocap_linalg::vector::{cross, dot, length, normal};
use std::collections::BTreeMap;

use elastocap_geometry::meshing::tets::{FaceRole, TetMesh};

/// Angle, rad, below which two adjacent faces count as parts of one curved surface; above, as two sides of a
/// body. It is not tuned.
const EDGE: f64 = 0.7;

/// Angle, rad, up to which two faces count as one flat surface in single precision. It is not tuned.
const FLAT: f64 = 1e-4;

/// The mean distance of a sphere of radius r from a triangle with its corners on it and sides h is h^2 / (8
/// r), and the angle between two such triangles is h / (sqrt(3) r).
const SHARE: f64 = 3.0 / 8.0;

/// An estimate of the relative error of a capacitance from flat faces of a conductor in place of curved ones,
/// the largest among the conductors: the mean distance over the radius. Zero if all conductors are
/// flat-faced. Where two curved conductors are close together, the error is larger by the radius over the
/// gap. Only conductors whose index passes `counts` are included.
pub(crate) fn curvature_error(mesh: &TetMesh, counts: impl Fn(u32) -> bool) -> f64 {
    let mut edges: BTreeMap<(u32, [u32; 2]), Vec<usize>> = BTreeMap::new();
    let mut normals = Vec::with_capacity(mesh.boundary.len());
    for (k, boundary) in mesh.boundary.iter().enumerate() {
        let corners = boundary.face.map(|p| mesh.points[p as usize]);
        normals.push(normal(corners));
        let FaceRole::Conductor(conductor) = boundary.role else { continue };
        if !counts(conductor) {
            continue;
        }
        let [a, b, c] = boundary.face;
        for [p, q] in [[a, b], [b, c], [c, a]] {
            edges.entry((conductor, [p.min(q), p.max(q)])).or_default().push(k);
        }
    }
    // For each conductor the area of its faces, and the squares of their angles weighted by the area, a third
    // for each edge.
    let mut sums: BTreeMap<u32, [f64; 2]> = BTreeMap::new();
    for ((conductor, _), faces) in &edges {
        let [area, squares] = sums.entry(*conductor).or_default();
        let shares: Vec<f64> = faces.iter().map(|&k| length(normals[k]) / 3.0).collect();
        *area += shares.iter().sum::<f64>();
        if let [one, two] = faces[..] {
            let angle = angle(normals[one], normals[two]);
            if FLAT < angle && angle < EDGE {
                *squares += shares.iter().sum::<f64>() * angle * angle;
            }
        }
    }
    let means = sums.values().map(|[area, squares]| if *area > 0.0 { squares / area } else { 0.0 });
    SHARE * means.fold(0.0, f64::max)
}

/// The angle between two planes, rad, from 0 to pi/2, independent of the orientation of the normals.
fn angle(u: [f64; 3], v: [f64; 3]) -> f64 {
    length(cross(u, v)).atan2(dot(u, v).abs())
}
