//! Parities of potentials about mirror planes, on meshes of tetrahedra.

use crate::parity::Parity;
use elastocap_geometry::meshing::tets::{BoundaryFace, FaceRole, TetMesh};
use elastocap_geometry::scene::{MirrorPlane, Potential};
use std::borrow::Cow;
use std::collections::HashSet;

/// The parities of the part that a mesh stands for. `potentials` are those of the conductors of the whole
/// scene.
pub(super) fn parities(
    mesh: &TetMesh,
    planes: &[Option<MirrorPlane>; 3],
    potentials: &[Potential],
) -> Vec<Parity> {
    let mut present = vec![false; potentials.len()];
    let grounded: Vec<bool> = potentials.iter().map(|potential| *potential == Potential::Grounded).collect();
    let mut enclosed = true;
    for face in &mesh.boundary {
        match face.role {
            FaceRole::Conductor(c) => present.get_mut(c as usize).into_iter().for_each(|p| *p = true),
            FaceRole::Grounded | FaceRole::Open { .. } => enclosed = false,
        }
    }
    Parity::all(planes, &present, &grounded, enclosed)
}

/// The mesh of the part with the boundary conditions of one parity. Conductors are numbered by right-hand
/// sides.
pub(super) fn mesh_of<'m>(parity: &Parity, mesh: &'m TetMesh) -> Cow<'m, TetMesh> {
    let is_numbered_alike = parity.side.iter().enumerate().all(|(c, side)| *side == Some(c as u32));
    if is_numbered_alike && parity.grounded == [None; 3] {
        return Cow::Borrowed(mesh);
    }
    let mut out = mesh.clone();
    for face in &mut out.boundary {
        if let FaceRole::Conductor(c) = face.role
            && let Some(side) = parity.side.get(c as usize)
        {
            face.role = side.map_or(FaceRole::Grounded, FaceRole::Conductor);
        }
    }
    for (axis, at) in parity.grounded.iter().enumerate() {
        if let Some(at) = at {
            out.boundary.extend(faces_in_plane(mesh, axis, *at));
        }
    }
    Cow::Owned(out)
}

/// Distances to a mirror plane below this, relative to the extent of the mesh, are rounding. Not tuned: it
/// only has to lie above rounding errors and below distances that matter.
const ROUNDING: f64 = 1e-11;

/// Faces in a plane that ends the mesh, grounded, without those that have a role.
fn faces_in_plane(mesh: &TetMesh, axis: usize, at: f64) -> Vec<BoundaryFace> {
    let sorted = |mut face: [u32; 3]| {
        face.sort_unstable();
        face
    };
    let extent = mesh.points.iter().map(|p| (p[axis] - at).abs()).fold(0.0, f64::max);
    let in_plane = |face: &[u32; 3]| {
        face.iter().all(|&p| (mesh.points[p as usize][axis] - at).abs() <= ROUNDING * extent)
    };
    let taken: HashSet<[u32; 3]> = mesh.boundary.iter().map(|f| sorted(f.face)).filter(in_plane).collect();
    let faces = mesh.tets.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, b, d], [a, c, d], [b, c, d]]);
    let free = faces.filter(|face| in_plane(face) && !taken.contains(&sorted(*face)));
    free.map(|face| BoundaryFace { face, role: FaceRole::Grounded }).collect()
}
