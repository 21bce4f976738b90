//! One tetrahedron: the energies of its fluxes, and the flux of the discrete potential in it.

use super::faces::{Beyond, Passages};
use super::reference::{EDGES, PAIRS, Reference};
use elastocap_geometry::meshing::tets::TetMesh;
use elastocap_linalg::vector::{cross, dot};

/// The energy matrices of one tetrahedron. The loops (see [`super::reference`]) are condensed out: they
/// follow from the other functions by minimal energy.
#[derive(Debug, Default)]
pub(super) struct Element {
    /// Jacobian by columns: edges from the first corner.
    jacobian: [[f64; 3]; 3],
    /// Determinant of the Jacobian.
    determinant: f64,
    /// Energies of all functions, `size x size`.
    pub(super) mass: Vec<f64>,
    /// Energies of face moments and sources with the loops condensed out, a square table.
    pub(super) energy: Vec<f64>,
    /// Coefficients of the loops (rows) that minimise the energy, for each unit face moment or source
    /// (columns).
    pub(super) follow: Vec<f64>,
}

impl Element {
    /// Computes the matrices of tetrahedron `t` of a mesh, with the relative permittivity `eps`.
    pub(super) fn load(
        &mut self,
        mesh: &TetMesh,
        passages: &Passages,
        reference: &Reference,
        t: usize,
        eps: f64,
    ) {
        let corners = passages.corners[t].map(|p| mesh.points[p as usize]);
        self.jacobian = [1, 2, 3].map(|k| [0, 1, 2].map(|a| corners[k][a] - corners[0][a]));
        let [u, v, w] = self.jacobian;
        self.determinant = dot(u, cross(v, w));
        let scale = 1.0 / (eps * self.determinant.abs());
        let metric = PAIRS.map(|[a, b]| scale * dot(self.jacobian[a], self.jacobian[b]));
        let size = reference.size();
        self.mass.clear();
        self.mass.resize(size * size, 0.0);
        for (factor, table) in metric.iter().zip(&reference.mass) {
            for (m, r) in self.mass.iter_mut().zip(table) {
                *m += factor * r;
            }
        }
        self.condense(reference);
    }

    /// Computes `energy` and `follow` from `mass`.
    fn condense(&mut self, reference: &Reference) {
        let (size, loops) = (reference.size(), reference.loops);
        let retained = size - loops;
        self.energy.clear();
        for i in 0..retained {
            self.energy.extend_from_slice(&self.mass[i * size..i * size + retained]);
        }
        self.follow.clear();
        if loops == 0 {
            return;
        }
        let block = [0, 1, 2].map(|i| [0, 1, 2].map(|j| self.mass[(retained + i) * size + retained + j]));
        let adjugate = [cross(block[1], block[2]), cross(block[2], block[0]), cross(block[0], block[1])];
        let det = dot(block[0], adjugate[0]);
        self.follow.resize(loops * retained, 0.0);
        for l in 0..loops {
            for m in 0..loops {
                // The block is symmetric, so that its adjugate needs no transposing.
                let share = -adjugate[l][m] / det;
                for k in 0..retained {
                    self.follow[l * retained + k] += share * self.mass[(retained + m) * size + k];
                }
            }
        }
        for i in 0..retained {
            for l in 0..loops {
                let share = self.mass[i * size + retained + l];
                for k in 0..retained {
                    self.energy[i * retained + k] += share * self.follow[l * retained + k];
                }
            }
        }
    }

    /// The flux -eps grad u, carried to the unit tetrahedron: `3 nodes` values. `gradients` are in the order
    /// of the nodes in the mesh, and `original` is that of [`Passages`].
    pub(super) fn carry(&self, eps: f64, original: [u8; 4], gradients: &[[f64; 3]], carried: &mut Vec<f64>) {
        let [u, v, w] = self.jacobian;
        let factor = -eps * self.determinant.signum();
        // |det| J^-1 by rows.
        let inverse = [cross(v, w), cross(w, u), cross(u, v)];
        carried.clear();
        for n in 0..gradients.len() {
            let node = match n {
                _ if gradients.len() == 1 => 0,
                0..4 => original[n] as usize,
                _ => {
                    let [a, b] = EDGES[n - 4].map(|k| original[k] as usize);
                    let edge = [a.min(b), a.max(b)];
                    4 + EDGES.iter().position(|&e| e == edge).unwrap_or(0)
                }
            };
            carried.extend(inverse.map(|row| factor * dot(row, gradients[node])));
        }
    }
}

/// y = A x for a table stored by rows.
pub(super) fn times(table: &[f64], x: &[f64], y: &mut Vec<f64>) {
    y.clear();
    y.extend(table.chunks_exact(x.len()).map(|row| row.iter().zip(x).map(|(a, b)| a * b).sum::<f64>()));
}

impl Beyond {
    /// Energy beyond a face to open space as a form of its moments, `on_face x on_face`.
    ///
    /// A flux that continues along rays decays with the square of the distance: through a face with normal
    /// flux q at X from the centre, in a plane at distance d, its energy is that of q^2 |X|^2 / (d eps) over
    /// the face.
    pub(super) fn energy(&self, reference: &Reference) -> Vec<f64> {
        let mut energy = vec![0.0; reference.on_face * reference.on_face];
        for ([a, b], table) in PAIRS.iter().zip(&reference.face_mass) {
            let factor = self.weight * dot(self.corners[*a], self.corners[*b]);
            for (e, r) in energy.iter_mut().zip(table) {
                *e += factor * r;
            }
        }
        energy
    }
}
