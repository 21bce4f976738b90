//! Energies, divergences and traces of Raviart-Thomas fluxes.

use super::functions::{divergences, fluxes, orthonormal};
use super::rules::triangle_rule;
use super::{Folded, NORMALS, SIDES, Triangle};
use crate::quadrature::{gauss_legendre, legendre};
use elastocap_linalg::dense::{self, Llt};
use faer::Mat;

/// Integrals of the fluxes over the reference triangle and its sides.
#[derive(Debug)]
pub struct FluxIntegrals {
    /// The degree of the fluxes.
    degree: usize,
    /// Integrals of products of the components of two fluxes: xx, xy + yx, yy.
    mass: [Mat<f64>; 3],
    /// Integrals of each orthonormal polynomial (row) times the divergence of each flux (column).
    divergence: Mat<f64>,
    /// For each side, as if of length 1, the integrals of each orthonormal polynomial of the side (row) times
    /// the outward component of each flux (column).
    traces: [Mat<f64>; 3],
}

impl FluxIntegrals {
    /// Computes the integrals for fluxes of degree `p`, at least 1.
    pub fn new(p: usize) -> Self {
        let (n, count) = (p * (p + 2), divergences(p));
        let mut mass = [0, 1, 2].map(|_| Mat::zeros(n, n));
        let mut divergence = Mat::zeros(count, n);
        for (point, w) in triangle_rule(p + 2) {
            let (values, flux_divergences) = fluxes(p, point);
            let tests = orthonormal(p - 1, point);
            for i in 0..n {
                for j in 0..n {
                    let (a, b) = (values[i], values[j]);
                    mass[0][(i, j)] += w * a[0] * b[0];
                    mass[1][(i, j)] += w * (a[0] * b[1] + a[1] * b[0]);
                    mass[2][(i, j)] += w * a[1] * b[1];
                }
                for (k, test) in tests.iter().enumerate() {
                    divergence[(k, i)] += w * test.value * flux_divergences[i];
                }
            }
        }
        let (nodes, weights) = gauss_legendre(p + 1);
        let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
        let traces = [0, 1, 2].map(|side| {
            let [a, b] = SIDES[side].map(|c| corners[c]);
            let mut trace = Mat::zeros(p, n);
            for (&s, &w) in nodes.iter().zip(&weights) {
                let point = [0, 1].map(|k| 0.5 * ((1.0 - s) * a[k] + (1.0 + s) * b[k]));
                let l = legendre(p - 1, s);
                for (i, f) in fluxes(p, point).0.iter().enumerate() {
                    let outward = f[0] * NORMALS[side][0] + f[1] * NORMALS[side][1];
                    for m in 0..p {
                        trace[(m, i)] += 0.5 * w * ((2 * m + 1) as f64).sqrt() * l[m] * outward;
                    }
                }
            }
            trace
        });
        Self { degree: p, mass, divergence, traces }
    }

    /// The forms of the fluxes of a triangle. On a bent one a polynomial inside stands for a density: itself
    /// over the determinant of the map. The polynomials are chosen so that these densities are orthonormal.
    ///
    /// # Errors
    /// [`Folded`] if a bent triangle folds or is too uneven to integrate over.
    pub fn on(&self, triangle: &Triangle) -> Result<FluxForms, Folded> {
        if triangle.bent.is_some() {
            return self.on_bent(triangle, 0);
        }
        let (area, [uu, uv, vv]) = (triangle.double_area(), triangle.metric());
        let (p, n, count) = (self.degree, self.divergence.ncols(), self.divergence.nrows());
        let [xx, xy, yy] = &self.mass;
        let mass = Mat::from_fn(n, n, |i, j| (uu * xx[(i, j)] + uv * xy[(i, j)] + vv * yy[(i, j)]) / area);
        let lengths = [0, 1, 2].map(|side| triangle.length(side).sqrt());
        let constraints = Mat::from_fn(count + 3 * p, n, |i, j| match i.checked_sub(count) {
            None => self.divergence[(i, j)] / area.sqrt(),
            Some(row) => self.traces[row / p][(row % p, j)] / lengths[row / p],
        });
        let mut one = vec![0.0; count];
        one[0] = (0.5 * area).sqrt();
        Ok(FluxForms { mass, constraints, one })
    }

    /// The forms of a bent triangle, by a rule with `further` points more along each direction than needed.
    pub(super) fn on_bent(&self, triangle: &Triangle, further: usize) -> Result<FluxForms, Folded> {
        let (p, n, count) = (self.degree, self.divergence.ncols(), self.divergence.nrows());
        let (mut mass, mut gram) = (Mat::zeros(n, n), Mat::zeros(count, count));
        for node in triangle.rule(p + 2, further)? {
            let [u, v] = node.columns;
            let w = node.weight / node.determinant.abs();
            let values: Vec<[f64; 2]> =
                fluxes(p, node.point).0.iter().map(|f| [0, 1].map(|k| u[k] * f[0] + v[k] * f[1])).collect();
            for i in 0..n {
                for j in 0..n {
                    mass[(i, j)] += w * (values[i][0] * values[j][0] + values[i][1] * values[j][1]);
                }
            }
            let tests = orthonormal(p - 1, node.point);
            for i in 0..count {
                for j in 0..count {
                    gram[(i, j)] += w * tests[i].value * tests[j].value;
                }
            }
        }
        let root = Llt::new(gram.as_ref()).map_err(|_| Folded)?;
        let inside = dense::product(root.lower().transpose(), self.divergence.as_ref());
        let lengths = [0, 1, 2].map(|side| triangle.length(side).sqrt());
        let constraints = Mat::from_fn(count + 3 * p, n, |i, j| match i.checked_sub(count) {
            None => inside[(i, j)],
            Some(row) => self.traces[row / p][(row % p, j)] / lengths[row / p],
        });
        // The first of the orthonormal polynomials is the constant sqrt(2).
        let mut one = Mat::zeros(count, 1);
        one[(0, 0)] = 0.5_f64.sqrt();
        dense::solve_lower_triangular(root.lower(), one.as_mut());
        Ok(FluxForms { mass, constraints, one: (0..count).map(|i| one[(i, 0)]).collect() })
    }
}

/// The forms of the fluxes of one triangle, for unit permittivity.
#[derive(Debug, Clone, PartialEq)]
pub struct FluxForms {
    /// Integrals of the scalar products of the fluxes.
    pub mass: Mat<f64>,
    /// One column per flux. The rows are the integrals of its divergence times each orthonormal polynomial of
    /// degree below p, then those of its outward component times each such polynomial on each side.
    pub constraints: Mat<f64>,
    /// Coefficients of the constant 1 in the polynomials inside.
    pub one: Vec<f64>,
}
