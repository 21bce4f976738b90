//! Polynomials on triangles: continuous potentials, Raviart-Thomas fluxes and their traces.
//!
//! The reference triangle has the corners (0, 0), (1, 0) and (0, 1), in this order; its sides are numbered by
//! [`SIDES`] and run from the first to the second of their corners. A triangle of a mesh is its affine image.
//! Where all triangles list their corners by ascending number, every side runs the same way in both triangles
//! that it belongs to, and no function needs a sign.
//!
//! A triangle may also be a part of one with a side on a curve ([`Bent`]). Potentials keep their values under
//! the map, fluxes their integrals over curves (Piola), so that neither continuity nor divergence is lost;
//! integrals are then taken by a rule of higher order.
//!
//! The continuous functions of degree p are the three barycentric coordinates, p - 1 functions of each side,
//! whose trace is that of [`hierarchical`](crate::line::hierarchical), and those that vanish on all sides
//! (Szabo and Babuska, *Finite Element Analysis*, 1991). The fluxes of degree p are Raviart-Thomas's of order
//! p - 1, without any continuity: their divergences are all polynomials of degree p - 1, and so are their
//! normal components on each side.

mod fluxes;
mod functions;
mod potentials;
mod rules;
#[cfg(test)]
mod tests;

pub use fluxes::{FluxForms, FluxIntegrals};
pub use functions::{continuous_functions, divergences};
pub use potentials::PotentialIntegrals;

use crate::bent::Bent;

/// Corners of the sides.
pub const SIDES: [[usize; 2]; 3] = [[0, 1], [0, 2], [1, 2]];

/// Outward normals of the sides of the reference triangle, as long as the sides.
const NORMALS: [[f64; 2]; 3] = [[0.0, -1.0], [-1.0, 0.0], [1.0, 1.0]];

/// The error of a triangle that is so bent that its map folds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("a triangle of the mesh is too bent")]
pub struct Folded;

/// The geometry of a triangle of a mesh for integration.
#[derive(Debug, Clone, Copy)]
pub struct Triangle {
    /// Corners, m (or any other unit).
    pub corners: [[f64; 2]; 3],
    /// The bent triangle that this one is a part of, with the shares of its corners there; `None` for a
    /// straight triangle.
    pub bent: Option<(Bent, [[f64; 2]; 3])>,
}

impl Triangle {
    /// The sides of the straight triangle from its first corner to the second and to the third.
    fn sides(&self) -> [[f64; 2]; 2] {
        let [a, b, c] = self.corners;
        [[b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]]
    }

    /// The image of a point of the reference triangle, and the derivative of the map there: its columns are
    /// the derivatives along the two axes of the reference triangle.
    pub(super) fn map(&self, point: [f64; 2]) -> ([f64; 2], [[f64; 2]; 2]) {
        let [u, v] = self.sides();
        let Some((bent, [p, q, r])) = &self.bent else {
            let a = self.corners[0];
            return ([0, 1].map(|k| a[k] + point[0] * u[k] + point[1] * v[k]), [u, v]);
        };
        let along = [[q[0] - p[0], q[1] - p[1]], [r[0] - p[0], r[1] - p[1]]];
        let shares = [0, 1].map(|k| p[k] + point[0] * along[0][k] + point[1] * along[1][k]);
        let x = bent.jets(shares);
        let column = |d: [f64; 2]| [0, 1].map(|k| x[k].slope[0] * d[0] + x[k].slope[1] * d[1]);
        (x.map(|x| x.value), [column(along[0]), column(along[1])])
    }

    /// Twice the area, m^2, of the straight triangle with these corners.
    pub fn double_area(&self) -> f64 {
        let [u, v] = self.sides();
        (u[0] * v[1] - u[1] * v[0]).abs()
    }

    /// Length of a side, m.
    pub fn length(&self, side: usize) -> f64 {
        let [a, b] = SIDES[side].map(|c| self.corners[c]);
        (b[0] - a[0]).hypot(b[1] - a[1])
    }

    /// Scalar products, m^2, of the columns u and v of the map from the reference triangle: uu, uv, vv.
    pub(super) fn metric(&self) -> [f64; 3] {
        let [u, v] = self.sides();
        let product = |a: [f64; 2], b: [f64; 2]| a[0] * b[0] + a[1] * b[1];
        [product(u, u), product(u, v), product(v, v)]
    }
}
