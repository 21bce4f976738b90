//! The faces through which flux can pass, and spanning trees along which a remaining divergence is carried to
//! where flux can leave.

use super::reference::corners_of_face;
use crate::error::FluxError;
use elastocap_geometry::meshing::tets::{FaceRole, TetMesh, determinant};
use rayon::prelude::*;
use std::cmp::Ordering;
use std::collections::{BTreeMap, BinaryHeap};

/// Marks a missing passage, tetrahedron or conductor.
pub(super) const NONE: u32 = u32::MAX;

/// The energy, in open space, of a flux through one face.
#[derive(Debug, Clone)]
pub(super) struct Beyond {
    /// Index of the face's passage.
    pub(super) passage: u32,
    /// Positions of the corners relative to the centre of the mesh, m, corners ascending.
    pub(super) corners: [[f64; 3]; 3],
    /// 1 / (permittivity x 2 area x distance of the face's plane from the centre), m^-3.
    pub(super) weight: f64,
}

/// The passages of a mesh: faces through which flux can pass. A face of a conductor is a separate passage for
/// each of its sides.
#[derive(Debug)]
pub(super) struct Passages {
    /// Corners of each tetrahedron, ascending: the two sides of a face then agree on its coordinates.
    pub(super) corners: Vec<[u32; 4]>,
    /// Position of each of these corners in the tetrahedron of the mesh.
    pub(super) original: Vec<[u8; 4]>,
    /// Passage of the face opposite each corner, or [`NONE`].
    pub(super) of_tet: Vec<[u32; 4]>,
    /// Tetrahedra that share a passage; the flux counts as going out of the first. The second is [`NONE`]
    /// where flux can leave the mesh.
    pub(super) tets: Vec<[u32; 2]>,
    /// Conductor on which each passage ends, or [`NONE`].
    pub(super) conductor: Vec<u32>,
    /// Approximate energy of a unit flux through each passage in its adjacent tetrahedra: height over area
    /// and permittivity, 1/m.
    pub(super) cost: Vec<f64>,
    /// Per passage the index in `open`, or [`NONE`].
    pub(super) to_open: Vec<u32>,
    /// Faces to open space.
    pub(super) open: Vec<Beyond>,
    /// Number of conductors, up to the last one with a face in the mesh.
    pub(super) conductors: usize,
}

impl Passages {
    /// Finds the passages of a mesh.
    ///
    /// # Errors
    ///
    /// [`FluxError::OpenFace`] if a face to open space has tetrahedra on both sides, or does not see the
    /// centre from inside.
    pub(super) fn new(mesh: &TetMesh, permittivity: &[f64]) -> Result<Passages, FluxError> {
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
        let mut passages = Passages {
            of_tet: vec![[NONE; 4]; corners.len()],
            corners,
            original,
            tets: Vec::new(),
            conductor: Vec::new(),
            cost: Vec::new(),
            to_open: Vec::new(),
            open: Vec::new(),
            conductors: 0,
        };
        for group in sides.chunk_by(|a, b| a.0 == b.0) {
            let role = roles.get(&group[0].0);
            match (role, group) {
                (None, [_]) => {}
                (None, [a, b]) => passages.add(&[(a.1, a.2), (b.1, b.2)], NONE),
                (None, _) => return Err(FluxError::NotConforming { face: group[0].0 }),
                (Some(FaceRole::Open { permittivity }), [side]) => {
                    passages.add_open(mesh, side, permittivity[0])?;
                    passages.add(&[(side.1, side.2)], NONE);
                }
                (Some(FaceRole::Open { .. }), _) => return Err(FluxError::OpenFace { face: group[0].0 }),
                (Some(FaceRole::Grounded), _) => {
                    group.iter().for_each(|side| passages.add(&[(side.1, side.2)], NONE));
                }
                (Some(&FaceRole::Conductor(c)), _) => {
                    passages.conductors = passages.conductors.max(c as usize + 1);
                    group.iter().for_each(|side| passages.add(&[(side.1, side.2)], c));
                }
            }
        }
        passages.cost = passages
            .tets
            .par_iter()
            .enumerate()
            .map(|(p, _)| passages.cost_of(mesh, permittivity, p))
            .collect();
        passages.to_open = vec![NONE; passages.tets.len()];
        for (k, beyond) in passages.open.iter().enumerate() {
            passages.to_open[beyond.passage as usize] = k as u32;
        }
        Ok(passages)
    }

    /// The cost of a passage: see the field `cost`.
    fn cost_of(&self, mesh: &TetMesh, permittivity: &[f64], passage: usize) -> f64 {
        let adjacent = self.tets[passage].into_iter().filter(|&t| t != NONE);
        let costs = adjacent.map(|t| {
            let t = t as usize;
            let face = self.of_tet[t].iter().position(|&p| p as usize == passage).unwrap_or(0);
            let [a, b, c] = corners_of_face(face).map(|k| mesh.points[self.corners[t][k] as usize]);
            let [u, v] = [b, c].map(|q| [0, 1, 2].map(|k| q[k] - a[k]));
            let square = |x: [f64; 3]| x.iter().map(|x| x * x).sum::<f64>();
            let across: f64 = u.iter().zip(v).map(|(u, v)| u * v).sum();
            // Four times the area squared.
            let area = (square(u) * square(v) - across * across).max(f64::MIN_POSITIVE);
            mesh.determinant(t).abs() / (area * permittivity[mesh.regions[t] as usize])
        });
        costs.sum()
    }

    /// Adds the passage between these sides, each a tetrahedron and the number of its face.
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

    /// Adds to `open` the next passage, a face to open space that is given by its corners, its tetrahedron
    /// and the corner opposite to it there.
    fn add_open(
        &mut self,
        mesh: &TetMesh,
        &(face, tet, opposite): &([u32; 3], u32, u8),
        permittivity: f64,
    ) -> Result<(), FluxError> {
        let from_center = |p: u32| [0, 1, 2].map(|a| mesh.points[p as usize][a] - mesh.center[a]);
        let corners = face.map(from_center);
        let inner = from_center(self.corners[tet as usize][opposite as usize]);
        let inside = determinant(inner, corners[0], corners[1], corners[2]);
        // 2 area x distance of the face's plane from the centre, positive where the centre is on the inner
        // side.
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

/// Trees that span tetrahedra. Each grows from a passage out of the mesh, where there is one.
#[derive(Debug, Default)]
pub(super) struct Forest {
    /// Tetrahedra, each after the one through which it is reached.
    pub(super) order: Vec<u32>,
    /// Per tetrahedron the face towards the root, 4 for a root without a passage out of the mesh.
    pub(super) parent: Vec<u8>,
    /// Number of tetrahedra, the first in `order`, that are connected to a passage out of the mesh.
    pub(super) drained: usize,
    /// The next steps, while trees grow.
    heap: BinaryHeap<Step>,
}

/// The rule by which trees grow.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Growth {
    /// Through the cheapest passage (Prim): a passage outside the trees costs no less than any on the path
    /// around it within them. Elimination along such trees is stable however flat the tetrahedra are.
    Cheapest,
    /// To the tetrahedron with the cheapest path out (Dijkstra).
    Nearest,
}

/// A tetrahedron that can be reached, and the cost of reaching it; the greatest step is the cheapest.
#[derive(Debug, PartialEq)]
struct Step {
    /// By [`Growth`], that of the passage or of the whole path out of the mesh.
    cost: f64,
    /// The tetrahedron that can be reached.
    tet: u32,
    /// The face of the tetrahedron through which it is reached; 4 for a root without a passage out of the
    /// mesh.
    face: u8,
}

impl Eq for Step {}

impl Ord for Step {
    fn cmp(&self, other: &Self) -> Ordering {
        let rank = other.cost.total_cmp(&self.cost);
        rank.then(other.tet.cmp(&self.tet)).then(other.face.cmp(&self.face))
    }
}

impl PartialOrd for Step {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Forest {
    /// Grows trees over tetrahedra with passages `of_tet` that are shared as in `tets`, with `cost` per
    /// passage.
    pub(super) fn grow(
        &mut self,
        of_tet: &[[u32; 4]],
        tets: &[[u32; 2]],
        cost: impl Fn(u32) -> f64,
        growth: Growth,
    ) {
        const UNSEEN: u8 = u8::MAX;
        self.order.clear();
        self.parent.clear();
        self.parent.resize(of_tet.len(), UNSEEN);
        self.heap.clear();
        for (t, passages) in of_tet.iter().enumerate() {
            for (face, &p) in passages.iter().enumerate() {
                if p != NONE && tets[p as usize][1] == NONE {
                    self.heap.push(Step { cost: cost(p), tet: t as u32, face: face as u8 });
                }
            }
        }
        let mut next_root = 0;
        self.drained = of_tet.len();
        loop {
            while let Some(step) = self.heap.pop() {
                let t = step.tet as usize;
                if self.parent[t] != UNSEEN {
                    continue;
                }
                self.parent[t] = step.face;
                self.order.push(step.tet);
                let so_far = if growth == Growth::Nearest { step.cost } else { 0.0 };
                for &p in of_tet[t].iter().filter(|&&p| p != NONE) {
                    let [a, b] = tets[p as usize];
                    let other = if a == step.tet { b } else { a };
                    if other != NONE && self.parent[other as usize] == UNSEEN {
                        let face = of_tet[other as usize].iter().position(|&q| q == p);
                        let face = face.map_or(4, |f| f as u8);
                        self.heap.push(Step { cost: so_far + cost(p), tet: other, face });
                    }
                }
            }
            let Some(root) = (next_root..of_tet.len()).find(|&t| self.parent[t] == UNSEEN) else {
                break;
            };
            next_root = root + 1;
            self.drained = self.drained.min(self.order.len());
            self.heap.push(Step { cost: 0.0, tet: root as u32, face: 4 });
        }
    }
}
