//! A check of what every mesh must satisfy, and the volumes and areas of meshes, for tests.

use crate::meshing::tets::{FaceRole, TetMesh};
use std::collections::BTreeMap;

/// Fails unless every tetrahedron is positive, every face belongs to one or two of them, marked faces exist
/// and are marked once, and every point is used.
///
/// A point that hangs on a face or an edge goes unnoticed here. It leaves outer faces inside the mesh, which
/// the tests that compare areas find.
pub(crate) fn conforming(mesh: &TetMesh) {
    assert_eq!(mesh.regions.len(), mesh.tets.len());
    let mut used = vec![false; mesh.points.len()];
    let mut faces: BTreeMap<[u32; 3], u32> = BTreeMap::new();
    for (t, tet) in mesh.tets.iter().enumerate() {
        assert!(mesh.determinant(t) > 0.0, "{t}: {:?}", mesh.determinant(t));
        for skip in 0..4 {
            used[tet[skip] as usize] = true;
            let mut face = [0, 1, 2].map(|k| tet[if k < skip { k } else { k + 1 }]);
            face.sort_unstable();
            *faces.entry(face).or_default() += 1;
        }
    }
    assert!(used.into_iter().all(|u| u));
    assert!(faces.values().all(|&n| n <= 2));
    let mut marked = std::collections::BTreeSet::new();
    for b in &mesh.boundary {
        let mut face = b.face;
        face.sort_unstable();
        assert!(marked.insert(face), "marked twice");
        let count = faces.get(&face).copied();
        let expected: &[u32] = if matches!(b.role, FaceRole::Conductor(_)) { &[1, 2] } else { &[1] };
        assert!(count.is_some_and(|n| expected.contains(&n)), "{:?} belongs to {count:?}", b.role);
    }
}

/// Volume of a mesh.
pub(crate) fn volume(mesh: &TetMesh) -> f64 {
    (0..mesh.tets.len()).map(|t| mesh.determinant(t) / 6.0).sum()
}

/// Area of a triangle of points of the mesh.
pub(crate) fn area(mesh: &TetMesh, face: [u32; 3]) -> f64 {
    let [a, b, c] = face.map(|p| mesh.points[p as usize]);
    let [u, v] = [b, c].map(|p| [0, 1, 2].map(|k| p[k] - a[k]));
    let cross = |i: usize, j: usize| u[i] * v[j] - u[j] * v[i];
    0.5 * (cross(0, 1).powi(2) + cross(1, 2).powi(2) + cross(2, 0).powi(2)).sqrt()
}

/// Area of the faces of each role, and of the outer faces without one (last).
pub(crate) fn areas(mesh: &TetMesh) -> Vec<(String, f64)> {
    let mut sums: BTreeMap<String, f64> = BTreeMap::new();
    let mut outer: std::collections::BTreeSet<[u32; 3]> = Default::default();
    for tet in &mesh.tets {
        for skip in 0..4 {
            let mut face = [0, 1, 2].map(|k| tet[if k < skip { k } else { k + 1 }]);
            face.sort_unstable();
            if !outer.insert(face) {
                outer.remove(&face);
            }
        }
    }
    for b in &mesh.boundary {
        let mut face = b.face;
        face.sort_unstable();
        outer.remove(&face);
        let role = match b.role {
            FaceRole::Conductor(k) => format!("conductor {k}"),
            FaceRole::Grounded => "grounded".into(),
            FaceRole::Open { .. } => "open".into(),
        };
        *sums.entry(role).or_default() += area(mesh, face);
    }
    let rest = outer.iter().map(|&face| area(mesh, face)).sum();
    sums.into_iter().chain([("~insulated".into(), rest)]).collect()
}
