//! The mesh of a symmetric domain from the mesh of one half.

use super::{BoundaryFace, FaceRole, TetMesh};
use crate::scene::MirrorPlane;

/// A mesh with its mirror image.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Reflected {
    /// The mesh of both halves: the given half comes first, unchanged, then its image in the same order.
    pub mesh: TetMesh,
    /// For each point of the whole, the point of the half that it is or that it is the image of.
    pub source: Vec<u32>,
}

impl TetMesh {
    /// The mesh with its mirror image in the plane normal to `axis`. Points in the plane are shared by both
    /// halves; faces in it keep their roles, and conductors and dielectrics that change places about the
    /// plane do so.
    pub fn reflected(&self, axis: usize, plane: &MirrorPlane) -> Reflected {
        let at = plane.at;
        let mut mesh = self.clone();
        let mut source: Vec<u32> = (0..self.points.len() as u32).collect();
        let image: Vec<u32> = (0..self.points.len())
            .map(|k| {
                let mut p = self.points[k];
                if p[axis] == at {
                    return k as u32;
                }
                p[axis] = 2.0 * at - p[axis];
                mesh.points.push(p);
                source.push(k as u32);
                mesh.points.len() as u32 - 1
            })
            .collect();
        mesh.tets.extend(self.tets.iter().map(|t| {
            let [a, b, c, d] = t.map(|p| image[p as usize]);
            [a, b, d, c]
        }));
        // The background comes before the dielectrics.
        let dielectric = |region: u32| plane.dielectrics.get((region as usize).checked_sub(1)?);
        let filled = |&region: &u32| dielectric(region).map_or(region, |&image| image as u32 + 1);
        mesh.regions.extend(self.regions.iter().map(filled));
        let image_of = |role: FaceRole| match role {
            FaceRole::Conductor(k) => {
                FaceRole::Conductor(plane.conductors.get(k as usize).map_or(k, |&image| image as u32))
            }
            FaceRole::Grounded | FaceRole::Open { .. } => role,
        };
        mesh.boundary.extend(self.boundary.iter().filter_map(|f| {
            let face = f.face.map(|p| image[p as usize]);
            (face != f.face).then_some(BoundaryFace { face, role: image_of(f.role) })
        }));
        Reflected { mesh, source }
    }
}
