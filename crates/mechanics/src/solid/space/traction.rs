//! Dead loads on faces of hexahedra.

use elastocap_fem::quadrature::gauss_legendre;

use super::mesh::{BoundaryFace, cross};
use crate::solid::dimension::Space;
use crate::solid::element::quadratic;
use crate::solid::model::Body;

impl Body<Space> {
    /// Adds to `force` (N, `3 node + axis`) the nodal forces of a dead traction (Pa, per reference area) on reference
    /// faces. `traction` takes the reference position and the outward reference normal.
    pub fn add_traction(
        &self,
        faces: &[BoundaryFace],
        traction: impl Fn([f64; 3], [f64; 3]) -> [f64; 3],
        force: &mut [f64],
    ) {
        let (points, weights) = gauss_legendre(4);
        let line: Vec<_> = points.iter().map(|&s| quadratic(s)).collect();
        for face in faces {
            let x = face.nodes.map(|n| self.mesh.nodes[n as usize]);
            for ((b, wb), (a, wa)) in
                (0..16).map(|k| ((&line[k / 4], weights[k / 4]), (&line[k % 4], weights[k % 4])))
            {
                let shape: [f64; 9] = std::array::from_fn(|n| a.0[n % 3] * b.0[n / 3]);
                let sum = |values: &dyn Fn(usize) -> f64| -> [f64; 3] {
                    std::array::from_fn(|k| (0..9).map(|n| values(n) * x[n][k]).sum())
                };
                let along = sum(&|n| a.1[n % 3] * b.0[n / 3]);
                let up = sum(&|n| a.0[n % 3] * b.1[n / 3]);
                let normal = cross(along, up);
                let area = normal.iter().map(|x| x * x).sum::<f64>().sqrt();
                let t = traction(sum(&|n| shape[n]), normal.map(|x| x / area));
                for (n, value) in face.nodes.iter().zip(shape) {
                    for k in 0..3 {
                        force[3 * *n as usize + k] += area * wa * wb * value * t[k];
                    }
                }
            }
        }
    }
}
