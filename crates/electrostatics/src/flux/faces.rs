//! Through which faces flux can go, and trees that carry what is left over to where flux can leave.

use super::FluxError;
use super::reference::corners_of_face;
use elastocap_geometry::tets::{FaceRole, TetMesh, determinant};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// No passage, no tetrahedron, no conductor.
pub(super) const NONE: u32 = u32::MAX;

/// What a face to open space adds to the energy of a flux through it.
#[derive(Debug, Clone)]
pub(super) struct Beyond {
    /// Its passage.
    pub(super) passage: u32,
    /// Corners less the centre, ascending corners.
    pub(super) corners: [[f64; 3]; 3],
    /// 1 / (permittivity x 2 area x distance of the face's plane from the centre), m^-3.
    pub(super) weight: f64,
}

/// The passages of a mesh: faces through which flux can go. A face with a conductor on it is one for each of its sides.
#[derive(Debug)]
pub(super) struct Passages {
    /// Corners of each tetrahedron, ascending: the two sides of a face then agree on its coordinates.
    pub(super) corners: Vec<[u32; 4]>,
    /// Where each of them stands in the tetrahedron of the mesh.
    pub(super) original: Vec<[u8; 4]>,
    /// Passage of the face opposite each corner, or [`NONE`].
    pub(super) of_tet: Vec<[u32; 4]>,
    /// Tetrahedra that share a passage; the flux counts as going out of the first. The second is [`NONE`] where flux can
    /// leave the mesh.
    pub(super) tets: Vec<[u32; 2]>,
    /// Conductor on which each passage ends, or [`NONE`].
    pub(super) conductor: Vec<u32>,
    /// Per passage the index in `open`, or [`NONE`].
    pub(super) to_open: Vec<u32>,
    /// Faces to open space.
    pub(super) open: Vec<Beyond>,
    /// Conductors of the mesh.
    pub(super) conductors: usize,
}

impl Passages {
    /// Finds the passages of a mesh.
    ///
    /// # Errors
    ///
    /// [`FluxError::OpenFace`] if a face to open space has tetrahedra on both sides, or does not see the centre from inside.
    pub(super) fn new(mesh: &TetMesh) -> Result<Passages, FluxError> {
        let sorted: Vec<([u32; 4], [u8; 4])> = mesh
            .tets
            .par_iter()
            .map(|tet| {
                let mut order = [0_u8, 1, 2, 3];
                order.sort_unstable_by_key(|&k| tet[k as usize]);
                (order.map(|k| tet[k as usize]), order)
            })
            .collect();
        let (corners, original): (Vec<_>, Vec<_>) = sorted.into_iter().unzip();
        let mut sides: Vec<([u32; 3], u32, u8)> = corners
            .par_iter()
            .enumerate()
            .flat_map_iter(|(t, tet)| {
                (0..4).map(move |i| (corners_of_face(i).map(|k| tet[k]), t as u32, i as u8))
            })
            .collect();
        sides.par_sort_unstable();
        let mut roles = BTreeMap::new();
        for boundary in &mesh.boundary {
            let mut face = boundary.face;
            face.sort_unstable();
            roles.insert(face, boundary.role);
        }
        let mut found = Passages {
            of_tet: vec![[NONE; 4]; corners.len()],
            corners,
            original,
            tets: Vec::new(),
            conductor: Vec::new(),
            to_open: Vec::new(),
            open: Vec::new(),
            conductors: 0,
        };
        for group in sides.chunk_by(|a, b| a.0 == b.0) {
            let role = roles.get(&group[0].0);
            match (role, group) {
                (None, [_]) => {}
                (None, [a, b]) => found.add(&[(a.1, a.2), (b.1, b.2)], NONE),
                (None, _) => return Err(FluxError::NotConforming { face: group[0].0 }),
                (Some(FaceRole::Open { permittivity }), [side]) => {
                    found.add_open(mesh, side, permittivity[0])?;
                    found.add(&[(side.1, side.2)], NONE);
                }
                (Some(FaceRole::Open { .. }), _) => return Err(FluxError::OpenFace { face: group[0].0 }),
                (Some(FaceRole::Grounded), _) => {
                    group.iter().for_each(|side| found.add(&[(side.1, side.2)], NONE));
                }
                (Some(&FaceRole::Conductor(c)), _) => {
                    found.conductors = found.conductors.max(c as usize + 1);
                    group.iter().for_each(|side| found.add(&[(side.1, side.2)], c));
                }
            }
        }
        found.to_open = vec![NONE; found.tets.len()];
        for (k, beyond) in found.open.iter().enumerate() {
            found.to_open[beyond.passage as usize] = k as u32;
        }
        Ok(found)
    }

    fn add(&mut self, sides: &[(u32, u8)], conductor: u32) {
        let passage = self.tets.len() as u32;
        let mut tets = [NONE; 2];
        for (k, &(tet, face)) in sides.iter().enumerate() {
            tets[k] = tet;
            self.of_tet[tet as usize][face as usize] = passage;
        }
        self.tets.push(tets);
        self.conductor.push(conductor);
    }

    fn add_open(
        &mut self,
        mesh: &TetMesh,
        &(face, tet, opposite): &([u32; 3], u32, u8),
        permittivity: f64,
    ) -> Result<(), FluxError> {
        let place = |p: u32| [0, 1, 2].map(|a| mesh.points[p as usize][a] - mesh.center[a]);
        let corners = face.map(place);
        let inner = place(self.corners[tet as usize][opposite as usize]);
        let inside = determinant(inner, corners[0], corners[1], corners[2]);
        // 2 area x distance of the face's plane from the centre, positive where the centre is on the inner side.
        let cone = determinant([0.0; 3], corners[0], corners[1], corners[2]) * inside.signum();
        if !(cone > 0.0 && permittivity > 0.0) {
            return Err(FluxError::OpenFace { face });
        }
        self.open.push(Beyond {
            passage: self.tets.len() as u32,
            corners,
            weight: 1.0 / (permittivity * cone),
        });
        Ok(())
    }

    /// +1 if flux through the passage counts as going out of the tetrahedron, else -1.
    pub(super) fn sign(&self, passage: u32, tet: usize) -> f64 {
        if self.tets[passage as usize][0] as usize == tet { 1.0 } else { -1.0 }
    }
}

/// Trees that span tetrahedra; each grows from a passage that leads out, where there is one.
#[derive(Debug, Default)]
pub(super) struct Forest {
    /// Tetrahedra, each after the one through which it is reached.
    pub(super) order: Vec<u32>,
    /// Per tetrahedron the face towards the root, 4 for a root without a way out.
    pub(super) parent: Vec<u8>,
    /// Those at the front of `order` that have a way out.
    pub(super) drained: usize,
}

impl Forest {
    /// Grows trees, nearest tetrahedra first, over tetrahedra with passages `of_tet` that are shared as in `tets`.
    pub(super) fn grow(&mut self, of_tet: &[[u32; 4]], tets: &[[u32; 2]]) {
        const UNSEEN: u8 = u8::MAX;
        self.order.clear();
        self.parent.clear();
        self.parent.resize(of_tet.len(), UNSEEN);
        for (t, passages) in of_tet.iter().enumerate() {
            let out = passages.iter().position(|&p| p != NONE && tets[p as usize][1] == NONE);
            if let Some(face) = out {
                self.parent[t] = face as u8;
                self.order.push(t as u32);
            }
        }
        let mut done = 0;
        let mut next_root = 0;
        self.drained = of_tet.len();
        loop {
            while done < self.order.len() {
                let t = self.order[done];
                done += 1;
                for &p in of_tet[t as usize].iter().filter(|&&p| p != NONE) {
                    let [a, b] = tets[p as usize];
                    let other = if a == t { b } else { a };
                    if other != NONE && self.parent[other as usize] == UNSEEN {
                        let face = of_tet[other as usize].iter().position(|&q| q == p);
                        self.parent[other as usize] = face.map_or(4, |f| f as u8);
                        self.order.push(other);
                    }
                }
            }
            let Some(root) = (next_root..of_tet.len()).find(|&t| self.parent[t] == UNSEEN) else {
                break;
            };
            next_root = root + 1;
            self.drained = self.drained.min(done);
            self.parent[root] = 4;
            self.order.push(root as u32);
        }
    }
}
