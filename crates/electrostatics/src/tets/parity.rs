//! Potentials that are even or odd about mirror planes, on the mesh of one part of a symmetric scene.
//!
//! Where conductors change places about a plane, a potential is the sum of one that is even about it and one that is odd. The plane
//! is an insulated wall to the first and a grounded one to the second, and energies of the two add up. What is called a parity here
//! says for each such plane which of them is meant. Planes that cut every conductor in two have even potentials only.

use crate::projection::projected;
use elastocap_geometry::meshing::tets::{BoundaryFace, FaceRole, TetMesh};
use elastocap_geometry::scene::MirrorPlane;
use elastocap_linalg::dense::product;
use faer::Mat;
use std::borrow::Cow;
use std::collections::HashSet;

/// The potentials of one parity.
#[derive(Debug, Clone)]
pub(super) struct Parity {
    /// Planes that are at zero potential, m.
    grounded: [Option<f64>; 3],
    /// For each conductor of the whole scene the right-hand side in which it has one volt; `None` if it is at zero in all of them.
    side: Vec<Option<u32>>,
    /// What of the potentials of all conductors (columns) each right-hand side (row) has.
    projection: Mat<f64>,
    /// Whether its only right-hand side is one potential everywhere, which has no field.
    constant: bool,
}

impl Parity {
    /// The parities of the part that a mesh stands for. `conductors` are those of the whole scene.
    pub(super) fn all(mesh: &TetMesh, planes: &[Option<MirrorPlane>; 3], conductors: usize) -> Vec<Self> {
        let exchanging: Vec<(usize, &MirrorPlane)> = planes
            .iter()
            .enumerate()
            .filter_map(|(axis, plane)| Some((axis, plane.as_ref().filter(|p| !p.keeps_conductors())?)))
            .collect();
        if exchanging.is_empty() {
            return vec![Self {
                grounded: [None; 3],
                side: (0..conductors as u32).map(Some).collect(),
                projection: Mat::identity(conductors, conductors),
                constant: false,
            }];
        }
        let mut present = vec![false; conductors];
        let mut enclosed = true;
        for face in &mesh.boundary {
            match face.role {
                FaceRole::Conductor(c) => present.get_mut(c as usize).into_iter().for_each(|p| *p = true),
                FaceRole::Grounded | FaceRole::Open { .. } => enclosed = false,
            }
        }
        let parity = |odd: usize| {
            let is_odd = |k: usize| odd >> k & 1 == 1;
            let of = |conductor: usize| {
                let image = |conductor: usize, k: usize| exchanging[k].1.conductors[conductor];
                let mut row = projected(conductor, conductors, exchanging.len(), odd, image);
                row.iter_mut().for_each(|x| *x /= f64::from(1_u32 << exchanging.len()));
                row
            };
            let mut rows: Vec<Vec<f64>> = Vec::new();
            let side = (0..conductors).map(|c| {
                let row = of(c);
                if !present[c] || row.iter().all(|x| *x == 0.0) {
                    return None;
                }
                let known = rows.iter().position(|other| *other == row);
                Some(known.unwrap_or_else(|| {
                    rows.push(row);
                    rows.len() - 1
                }) as u32)
            });
            let side = side.collect();
            let mut grounded = [None; 3];
            for (k, (axis, plane)) in exchanging.iter().enumerate() {
                grounded[*axis] = is_odd(k).then_some(plane.at);
            }
            let projection = Mat::from_fn(rows.len(), conductors, |i, j| rows[i][j]);
            let constant = enclosed && odd == 0 && rows.len() == 1;
            Self { grounded, side, projection, constant }
        };
        (0..1_usize << exchanging.len()).map(parity).filter(|parity| parity.sides() > 0).collect()
    }

    /// Whether its only right-hand side is one potential everywhere, which has no field.
    pub(super) fn is_constant(&self) -> bool {
        self.constant
    }

    /// Number of right-hand sides.
    pub(super) fn sides(&self) -> usize {
        self.projection.nrows()
    }

    /// What of these potentials of all conductors, V, each right-hand side has.
    pub(super) fn of(&self, potentials: &[f64]) -> impl Iterator<Item = f64> {
        (0..self.sides())
            .map(|i| potentials.iter().enumerate().map(|(j, v)| self.projection[(i, j)] * v).sum())
    }

    /// A quadratic form in the right-hand sides as one in the potentials of all conductors.
    pub(super) fn form_of_conductors(&self, form: &Mat<f64>) -> Mat<f64> {
        let half = product(form.as_ref(), self.projection.as_ref());
        product(self.projection.transpose(), half.as_ref())
    }

    /// The part's mesh with what holds on its boundary. Conductors are numbered by right-hand sides.
    pub(super) fn mesh<'m>(&self, mesh: &'m TetMesh) -> Cow<'m, TetMesh> {
        let same = self.side.iter().enumerate().all(|(c, side)| *side == Some(c as u32));
        if same && self.grounded == [None; 3] {
            return Cow::Borrowed(mesh);
        }
        let mut out = mesh.clone();
        for face in &mut out.boundary {
            if let FaceRole::Conductor(c) = face.role
                && let Some(side) = self.side.get(c as usize)
            {
                face.role = side.map_or(FaceRole::Grounded, FaceRole::Conductor);
            }
        }
        for (axis, at) in self.grounded.iter().enumerate() {
            if let Some(at) = at {
                out.boundary.extend(faces_in_plane(mesh, axis, *at));
            }
        }
        Cow::Owned(out)
    }
}

/// Distances to a mirror plane below this, relative to the extent of the mesh, are rounding.
const ROUNDING: f64 = 1e-11;

/// Faces in a plane that ends the mesh, grounded, without those that have a role.
fn faces_in_plane(mesh: &TetMesh, axis: usize, at: f64) -> Vec<BoundaryFace> {
    let sorted = |mut face: [u32; 3]| {
        face.sort_unstable();
        face
    };
    let extent = mesh.points.iter().map(|p| (p[axis] - at).abs()).fold(0.0, f64::max);
    let inside = |face: &[u32; 3]| {
        face.iter().all(|&p| (mesh.points[p as usize][axis] - at).abs() <= ROUNDING * extent)
    };
    let taken: HashSet<[u32; 3]> = mesh.boundary.iter().map(|f| sorted(f.face)).filter(inside).collect();
    let faces = mesh.tets.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, b, d], [a, c, d], [b, c, d]]);
    let free = faces.filter(|face| inside(face) && !taken.contains(&sorted(*face)));
    free.map(|face| BoundaryFace { face, role: FaceRole::Grounded }).collect()
}
