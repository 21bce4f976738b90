//! Transfer of potentials from a mesh to its refinement, where they start the iterations.

use super::reference::{lattice, shape};
use super::space::Space;
use elastocap_geometry::meshing::tets::{TetMesh, determinant};

/// Potentials on the mesh before the last refinement.
#[derive(Debug, Clone)]
pub(crate) struct CoarserPotentials {
    /// The functions of the potentials.
    pub(super) space: Space,
    /// Per conductor the coefficients of its potential, V.
    pub(super) values: Vec<Vec<f64>>,
}

/// Potentials on a coarser mesh to start from.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Start<'a> {
    /// The coarser mesh.
    pub(crate) mesh: &'a TetMesh,
    /// The potentials on it, of the same order and number.
    pub(crate) potentials: &'a CoarserPotentials,
    /// For each tetrahedron of the finer mesh the one of the coarser mesh that it is a part of.
    pub(crate) origin: &'a [u32],
}

impl Start<'_> {
    /// The first `count` of the potentials at the lattice points of a finer mesh with the functions `space`,
    /// V. A point that rounding puts outside its tetrahedron does no harm: iterations may start from any
    /// potential.
    pub(super) fn values(&self, mesh: &TetMesh, space: &Space, count: usize) -> Vec<Vec<f64>> {
        let order = space.order();
        let points = lattice(order, 4);
        let functions = points.len();
        let (coarse, fine) = (self.potentials.space.dofs(), space.dofs());
        let mut values = vec![vec![0.0; space.functions()]; count];
        let mut known = vec![false; space.functions()];
        for (t, &origin) in self.origin.iter().enumerate() {
            let dofs = &fine[t * functions..(t + 1) * functions];
            if dofs.iter().all(|&d| known[d as usize]) {
                continue;
            }
            let origin = origin as usize;
            let around = &coarse[origin * functions..(origin + 1) * functions];
            let corners = mesh.tets[t].map(|p| barycentric(self.mesh, origin, mesh.points[p as usize]));
            for (&d, point) in dofs.iter().zip(&points) {
                if std::mem::replace(&mut known[d as usize], true) {
                    continue;
                }
                let in_origin = [0, 1, 2, 3]
                    .map(|k| (0..4).map(|c| f64::from(point[c]) * corners[c][k]).sum::<f64>() / order as f64);
                for (&from, &function) in around.iter().zip(&points) {
                    let weight = shape(order, function, in_origin).0;
                    for (to, old) in values.iter_mut().zip(&self.potentials.values) {
                        to[d as usize] += weight * old[from as usize];
                    }
                }
            }
        }
        values
    }
}

/// Barycentric coordinates of a point in a tetrahedron of a mesh.
fn barycentric(mesh: &TetMesh, t: usize, point: [f64; 3]) -> [f64; 4] {
    let corners = mesh.tets[t].map(|p| mesh.points[p as usize]);
    let whole = mesh.determinant(t);
    [0, 1, 2, 3].map(|k| {
        let mut part = corners;
        part[k] = point;
        let [a, b, c, d] = part;
        determinant(a, b, c, d) / whole
    })
}
