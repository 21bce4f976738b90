//! The final mesh, without the inside of conductors and with the roles of its boundary faces.

use super::boundary_recovery::MeshInProgress;
use super::region::Region;
use super::{MeshError, Point, scene_surfaces};
use crate::meshing::indices::Renumbering;
use crate::meshing::tets::beyond_mesh::permittivity_beyond;
use crate::meshing::tets::tetrahedron::FACES;
use crate::meshing::tets::{BoundaryFace, FaceRole, TetMesh};
use crate::scene::{Box3, Scene, Wall};
use crate::shapes::Shape;

/// The tetrahedra outside conductors, with roles of their outer faces and of faces on sheets.
///
/// # Errors
/// [`MeshError::Torn`] where the mesh ends and there is no wall.
pub(super) fn extract(work: &MeshInProgress, scene: &Scene, domain: &Box3) -> Result<TetMesh, MeshError> {
    let from = &work.mesh;
    let mut out = TetMesh { center: center(scene, domain), ..TetMesh::default() };
    let mut numbers = Renumbering::new(from.points.len());
    for t in 0..from.tets.len() as u32 {
        let region = match from.regions[t as usize] {
            _ if !from.alive(t) => continue,
            Region::Conductor(_) => continue,
            Region::Background => 0,
            Region::Dielectric(d) => d + 1,
        };
        let tet = from.tets[t as usize]
            .map(|p| numbers.number(p as usize, || out.points.push(from.points[p as usize])));
        out.tets.push(tet);
        out.regions.push(region);
        for i in 0..4 {
            if let Some(role) = role(work, scene, domain, out.center, (t, i))? {
                let corners = FACES[i].map(|k| tet[k]);
                out.boundary.push(BoundaryFace { face: corners, role });
            }
        }
    }
    Ok(out)
}

/// The start of the rays to infinity, m: the middle of the conductors, or a point on the only wall, from
/// which the rays stay on its inner side.
fn center(scene: &Scene, domain: &Box3) -> Point {
    let bounds = scene
        .conductor_parts()
        .filter(|(_, part)| !matches!(part, Shape::Shell { .. }))
        .map(|(_, part)| scene_surfaces::bounds(part));
    let Some(around) = bounds.reduce(|all, b| all.union(&b)) else { return [0.0; 3] };
    [0, 1, 2].map(|a| match scene.walls[a].map(|w| w == Wall::Open) {
        [false, true] => domain.min[a],
        [true, false] => domain.max[a],
        _ => 0.5 * (around.min[a] + around.max[a]),
    })
}

/// The role of the face opposite corner `i` of tetrahedron `t`, if it has one. A face on a sheet has its role
/// as a face of one of the two tetrahedra only.
fn role(
    work: &MeshInProgress,
    scene: &Scene,
    domain: &Box3,
    center: Point,
    (t, i): (u32, usize),
) -> Result<Option<FaceRole>, MeshError> {
    let mesh = &work.mesh;
    let corners = mesh.face(t, i).map(|p| mesh.points[p as usize]);
    let facet = mesh.kept_face(t, i);
    let centroid = || [0, 1, 2].map(|k| corners.iter().map(|c| c[k]).sum::<f64>() / 3.0);
    let sheet = || work.complex.facets[facet? as usize].sheet(centroid()).map(FaceRole::Conductor);
    if let Some(n) = mesh.neighbour(t, i) {
        if let Some(c) = mesh.regions[n as usize].conductor() {
            return Ok(Some(FaceRole::Conductor(c)));
        }
        return Ok(if t < n { sheet() } else { None });
    }
    if let Some(role) = sheet() {
        return Ok(Some(role));
    }
    let on = |a: usize, at: f64| corners.iter().all(|p| p[a] == at);
    let wall = (0..3).find_map(|a| {
        let low = on(a, domain.min[a]).then_some(scene.walls[a][0]);
        low.or(on(a, domain.max[a]).then_some(scene.walls[a][1]))
    });
    match wall.ok_or_else(|| MeshError::Torn { at: centroid() })? {
        Wall::Insulated => Ok(None),
        Wall::Grounded => Ok(Some(FaceRole::Grounded)),
        Wall::Open => Ok(Some(FaceRole::Open { permittivity: permittivity_beyond(scene, center, corners) })),
    }
}
