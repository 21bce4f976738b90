//! Continuous potentials of order 1, 2 or 3 on a mesh of tetrahedra: the numbering of the functions, and
//! which are prescribed.

use super::reference::{EDGES, FACES, lattice};
use crate::error::PotentialError;
use elastocap_geometry::meshing::tets::{FaceRole, TetMesh};
use elastocap_linalg::sparse::SparseMatrix;
use rayon::prelude::*;

/// The wall or conductor that prescribes the coefficient of a function, if any does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Held {
    /// Nothing: it is an unknown.
    Free,
    /// A grounded wall.
    Ground,
    /// The conductor with this index.
    Conductor(u32),
}

/// Lagrange functions of order p: coefficients are values at the lattice points of the tetrahedra.
///
/// Their numbers begin with the points of the mesh in order; then follow the inner points of the edges
/// (ascending by their ends; p - 1 each, from the lower end on), then one per face with p = 3 (ascending by
/// corners).
#[derive(Debug, Clone)]
pub(crate) struct Space {
    order: usize,
    /// The number of points of the mesh.
    points: usize,
    /// The ends of each edge, ascending; empty for order 1.
    edges: Vec<[u32; 2]>,
    /// The corners of each face, ascending; empty below order 3.
    faces: Vec<[u32; 3]>,
    /// See [`Space::dofs`].
    dofs: Vec<u32>,
    /// See [`Space::held`].
    held: Vec<Held>,
    /// See [`Space::unknown`].
    unknown: Vec<u32>,
    unknowns: usize,
}

/// Marks a function that is no unknown in [`Space::unknown`].
pub(super) const NONE: u32 = u32::MAX;

impl Space {
    /// The space of order `order`, 1 to 3, on a mesh.
    ///
    /// # Errors
    /// If the order is not 1 to 3, if a boundary face has a corner that the mesh lacks or, beyond order 1, an
    /// edge that no tetrahedron has, if a function is held by two conductors or by a conductor and the
    /// ground, or if the mesh is too large for 32-bit numbers.
    pub(crate) fn new(mesh: &TetMesh, order: usize) -> Result<Self, PotentialError> {
        if !(1..=3).contains(&order) {
            return Err(PotentialError::Order(order));
        }
        let points = mesh.points.len();
        let mut edges = if order > 1 { distinct(&mesh.tets, EDGES) } else { Vec::new() };
        let mut faces = if order > 2 { distinct(&mesh.tets, FACES) } else { Vec::new() };
        edges.shrink_to_fit();
        faces.shrink_to_fit();
        let per_tet = lattice(order, 4).len();
        let functions = points + (order - 1) * edges.len() + faces.len();
        if functions.max(mesh.tets.len() * per_tet) >= NONE as usize {
            return Err(PotentialError::TooLarge);
        }
        let mut space = Self {
            order,
            points,
            edges,
            faces,
            dofs: Vec::new(),
            held: vec![Held::Free; functions],
            unknown: Vec::new(),
            unknowns: 0,
        };
        let index = Index { edges: starts(&space.edges, points), faces: starts(&space.faces, points) };
        let mut dofs = vec![0_u32; mesh.tets.len() * per_tet];
        dofs.par_chunks_mut(per_tet).zip(&mesh.tets).with_min_len(1024).try_for_each(|(dofs, tet)| {
            space.number(&index, tet, &EDGES, &FACES, dofs).ok_or(PotentialError::Face)
        })?;
        space.dofs = dofs;
        let mut held = std::mem::take(&mut space.held);
        for face in &mesh.boundary {
            let holder = match face.role {
                FaceRole::Conductor(c) => Held::Conductor(c),
                FaceRole::Grounded => Held::Ground,
                FaceRole::Open { .. } => continue,
            };
            for dof in space.of_face(&index, face.face)? {
                let current = &mut held[dof as usize];
                if *current != Held::Free && *current != holder {
                    return Err(PotentialError::HeldTwice(face.face));
                }
                *current = holder;
            }
        }
        space.unknown = held
            .iter()
            .map(|h| {
                let number = if *h == Held::Free { space.unknowns as u32 } else { NONE };
                space.unknowns += usize::from(*h == Held::Free);
                number
            })
            .collect();
        space.held = held;
        Ok(space)
    }

    /// Order p of the functions.
    pub(crate) fn order(&self) -> usize {
        self.order
    }

    /// Number of functions, held ones included.
    pub(crate) fn functions(&self) -> usize {
        self.held.len()
    }

    /// Number of functions that are not prescribed.
    pub(crate) fn unknowns(&self) -> usize {
        self.unknowns
    }

    /// The wall or conductor, if any, that prescribes the coefficient of each function.
    pub(crate) fn held(&self) -> &[Held] {
        &self.held
    }

    /// Number of each function among the unknowns, `u32::MAX` if it is held.
    pub(super) fn unknown(&self) -> &[u32] {
        &self.unknown
    }

    /// Functions of all tetrahedra, 4, 10 or 20 each for order 1, 2 or 3: corners, edges (01, 02, 03, 12, 13,
    /// 23; p - 1 each, from the first corner to the second), with p = 3 faces (012, 013, 023, 123).
    pub(crate) fn dofs(&self) -> &[u32] {
        &self.dofs
    }

    /// The points of the mesh, with weights, whose weighted mean is the place of function `dof`. The same
    /// mean of the values at these points is the value of a potential of order 1 at that place.
    pub(crate) fn linear(&self, dof: usize) -> Vec<(u32, f64)> {
        let inner = self.order - 1;
        if dof < self.points {
            return vec![(dof as u32, 1.0)];
        }
        let on_edges = dof - self.points;
        if on_edges < inner * self.edges.len() {
            let [a, b] = self.edges[on_edges / inner];
            let share = (on_edges % inner + 1) as f64 / self.order as f64;
            return vec![(a, 1.0 - share), (b, share)];
        }
        self.faces[on_edges - inner * self.edges.len()].map(|p| (p, 1.0 / 3.0)).to_vec()
    }

    /// The map from the unknowns of the potentials of order 1 on the same mesh, in the space `linear`, to the
    /// unknowns of this space, which are the values at their places.
    pub(super) fn prolongation(&self, linear: &Self) -> SparseMatrix {
        let free: Vec<usize> = (0..self.functions()).filter(|&d| self.unknown[d] != NONE).collect();
        SparseMatrix::build(free.len(), linear.unknowns, |i, terms| {
            for (point, weight) in self.linear(free[i]) {
                let unknown = linear.unknown[point as usize];
                if unknown != NONE {
                    terms.push((unknown, weight));
                }
            }
        })
    }

    /// Functions on a face with ascending corners, as [`lattice`] orders them, for each of `faces`.
    pub(super) fn of_faces(&self, faces: &[[u32; 3]]) -> Result<Vec<Vec<u32>>, PotentialError> {
        let index =
            Index { edges: starts(&self.edges, self.points), faces: starts(&self.faces, self.points) };
        faces.iter().map(|face| self.of_face(&index, *face)).collect()
    }

    /// Functions on a face, as [`Space::of_faces`] gives them.
    fn of_face(&self, index: &Index, mut face: [u32; 3]) -> Result<Vec<u32>, PotentialError> {
        face.sort_unstable();
        let mut dofs = vec![0; lattice(self.order, 3).len()];
        self.number(index, &face, &[EDGES[0], EDGES[1], EDGES[3]], &FACES[..1], &mut dofs)
            .ok_or(PotentialError::Face)?;
        Ok(dofs)
    }

    /// Writes the functions of a tetrahedron or a face; `None` if the mesh lacks an edge or a face of it.
    fn number(
        &self,
        index: &Index,
        corners: &[u32],
        edges: &[[usize; 2]],
        faces: &[[usize; 3]],
        dofs: &mut [u32],
    ) -> Option<()> {
        for (dof, &corner) in dofs.iter_mut().zip(corners) {
            if corner as usize >= self.points {
                return None;
            }
            *dof = corner;
        }
        let (mut next, inner) = (corners.len(), self.order - 1);
        if inner > 0 {
            for [a, b] in edges.iter().map(|e| e.map(|k| corners[k])) {
                let edge = find(&self.edges, &index.edges, [a.min(b), a.max(b)])?;
                let first = (self.points + edge * inner) as u32;
                for step in 0..inner as u32 {
                    dofs[next] = first + if a < b { step } else { inner as u32 - 1 - step };
                    next += 1;
                }
            }
        }
        if self.order == 3 {
            for face in faces {
                let mut face = face.map(|k| corners[k]);
                face.sort_unstable();
                let face = find(&self.faces, &index.faces, face)?;
                dofs[next] = (self.points + inner * self.edges.len() + face) as u32;
                next += 1;
            }
        }
        Some(())
    }
}

/// For each point, where the edges and the faces of which it is the lowest corner begin in their lists; and
/// the lengths of the lists.
struct Index {
    /// Where the edges begin.
    edges: Vec<u32>,
    /// Where the faces begin.
    faces: Vec<u32>,
}

/// All edges or faces of the tetrahedra, once each, ascending.
fn distinct<const N: usize, const M: usize>(tets: &[[u32; 4]], parts: [[usize; N]; M]) -> Vec<[u32; N]> {
    let mut distinct: Vec<[u32; N]> = tets
        .par_iter()
        .with_min_len(1024)
        .flat_map_iter(|tet| {
            parts.into_iter().map(move |part| {
                let mut part = part.map(|k| tet[k]);
                part.sort_unstable();
                part
            })
        })
        .collect();
    distinct.par_sort_unstable();
    distinct.dedup();
    distinct
}

/// Where the parts with each lowest corner begin among `parts`, which ascend.
fn starts<const N: usize>(parts: &[[u32; N]], points: usize) -> Vec<u32> {
    let mut starts = vec![0_u32; points + 1];
    for part in parts {
        starts[part[0] as usize + 1] += 1;
    }
    for k in 0..points {
        starts[k + 1] += starts[k];
    }
    starts
}

/// The number of a part among `parts`, with what [`starts`] gives for them.
fn find<const N: usize>(parts: &[[u32; N]], starts: &[u32], part: [u32; N]) -> Option<usize> {
    let first = part[0] as usize;
    let (from, to) = (starts[first] as usize, starts[first + 1] as usize);
    parts[from..to].binary_search(&part).ok().map(|k| from + k)
}
