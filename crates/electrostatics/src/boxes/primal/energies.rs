//! Energies as sums of squares of gradients.
//!
//! In the product u A u the potentials of neighbouring nodes cancel, and the relative rounding error on an element of size h grows
//! like 1 / h. Here differences of potentials are taken first, and nothing cancels.

use super::{Primal, Term};
use crate::SolveError;
use crate::boxes::domain::{Axis, per_element};
use crate::boxes::mapped::gradients::{FINER, Gradients, add_with_error};
use elastocap_fem::mixed::{divergence_matrix, potential_offsets};
use elastocap_fem::tensor::{Dims, SparseRows, along, dot};
use faer::Mat;
use rayon::prelude::*;
use std::ops::Range;

/// D and the coefficient of its rows: the stiffness of an axis is D^T diag(coefficient) D.
pub(super) struct GradientMatrix {
    matrix: Mat<f64>,
    coefficient: Vec<f64>,
}

impl GradientMatrix {
    /// Of an axis with a coefficient per interval, held ends trimmed off.
    pub(super) fn new(axis: &Axis, coefficient: &[f64]) -> Result<Self, SolveError> {
        let (whole, functions) = (divergence_matrix(&axis.line)?, axis.functions());
        let offsets = potential_offsets(&axis.line);
        let per_mode: Vec<f64> = per_element(axis, coefficient)
            .iter()
            .enumerate()
            .flat_map(|(e, c)| std::iter::repeat_n(*c, offsets[e + 1] - offsets[e]))
            .collect();
        let rows: Vec<usize> = (0..per_mode.len()).filter(|r| per_mode[*r] != 0.0).collect();
        Ok(Self {
            matrix: Mat::from_fn(rows.len(), functions.len(), |i, j| whole[(rows[i], functions.start + j)]),
            coefficient: rows.iter().map(|r| per_mode[*r]).collect(),
        })
    }

    /// For a window of functions.
    pub(super) fn cut(&self, window: &Range<usize>) -> Gradient {
        let columns = self.matrix.as_ref().subcols(window.start, window.len());
        Gradient { matrix: SparseRows::from_mat(columns), coefficient: self.coefficient.clone() }
    }
}

/// A [`GradientMatrix`] on a window of functions.
#[derive(Debug)]
pub(super) struct Gradient {
    matrix: SparseRows<f64>,
    coefficient: Vec<f64>,
}

/// Potentials whose fluxes are held at a time: few, for they take as much memory as the potentials themselves.
const HELD: usize = 8;

impl Primal {
    /// Energies u_i A u_j of potentials, a symmetric matrix; under a map no less than these.
    ///
    /// # Errors
    /// A map that turns space inside out.
    pub(crate) fn energies(&self, potentials: &[Vec<f64>]) -> Result<Mat<f64>, SolveError> {
        let mut matrix = self.straight_energies(potentials);
        if let Some((gradients, domain)) = &self.bent
            && let Some(finer) = Gradients::new(domain, FINER)?
        {
            let [coarser, finer] = [gradients, &finer].map(|g| g.energies(potentials, self.dims));
            add_with_error(&mut matrix, &coarser, &finer, 1.0);
        }
        Ok(matrix)
    }

    /// The same as if there were no map.
    pub(crate) fn straight_energies(&self, potentials: &[Vec<f64>]) -> Mat<f64> {
        let n = potentials.len();
        let mut matrix = Mat::<f64>::zeros(n, n);
        for term in &self.terms.terms {
            for axis in 0..3 {
                for first in (0..n).step_by(HELD) {
                    let block = first..n.min(first + HELD);
                    let held: Vec<_> = block
                        .clone()
                        .map(|i| term.gradient_and_flux(axis, &potentials[i], self.dims))
                        .collect();
                    for (i, (_, flux)) in block.clone().zip(&held) {
                        for (j, (gradient, _)) in block.clone().zip(&held).filter(|(j, _)| *j >= i) {
                            matrix[(i, j)] += dot(gradient, flux);
                        }
                    }
                    for j in block.end..n {
                        let (gradient, _) = term.gradient(axis, &potentials[j], self.dims);
                        for (i, (_, flux)) in block.clone().zip(&held) {
                            matrix[(i, j)] += dot(&gradient, flux);
                        }
                    }
                }
            }
        }
        let mut beyond = vec![0.0; potentials.first().map_or(0, Vec::len)];
        for (j, u) in potentials.iter().enumerate() {
            beyond.fill(0.0);
            self.faces.add_product(u, &mut beyond, self.dims);
            for (i, v) in potentials[..=j].iter().enumerate() {
                matrix[(i, j)] += dot(v, &beyond);
                matrix[(j, i)] = matrix[(i, j)];
            }
        }
        matrix
    }

    /// The product u A v of two potentials, for which [`Primal::energies`] would do more than is needed. Not under a map.
    pub(crate) fn product_of(&self, u: &[f64], v: &[f64]) -> f64 {
        let mut total = 0.0;
        for term in &self.terms.terms {
            for axis in 0..3 {
                let (_, flux) = term.gradient_and_flux(axis, u, self.dims);
                total += dot(&term.gradient(axis, v, self.dims).0, &flux);
            }
        }
        let mut beyond = vec![0.0; u.len()];
        self.faces.add_product(u, &mut beyond, self.dims);
        total + dot(v, &beyond)
    }
}

impl Term<f64> {
    /// D u along an axis, and its shape.
    fn gradient(&self, axis: usize, u: &[f64], dims: Dims) -> (Vec<f64>, Dims) {
        let [w0, w1, w2] = &self.window;
        if [w0.len(), w1.len(), w2.len()] == dims {
            return along(axis, &self.gradient[axis].matrix, u, dims);
        }
        let mut own = Vec::with_capacity(w0.len() * w1.len() * w2.len());
        for i in w0.clone() {
            for j in w1.clone() {
                let at = (i * dims[1] + j) * dims[2];
                own.extend_from_slice(&u[at + w2.start..at + w2.end]);
            }
        }
        along(axis, &self.gradient[axis].matrix, &own, [w0.len(), w1.len(), w2.len()])
    }

    /// D u along an axis, and the same times the coefficient and the masses of the other axes.
    fn gradient_and_flux(&self, axis: usize, u: &[f64], dims: Dims) -> (Vec<f64>, Vec<f64>) {
        let (gradient, shape) = self.gradient(axis, u, dims);
        let coefficient = &self.gradient[axis].coefficient;
        let mass = |other: usize| if other == 2 { &self.mass_last } else { &self.mass[other] };
        let (first, second) = [(1, 2), (0, 2), (0, 1)][axis];
        let (once, _) = along(first, mass(first), &gradient, shape);
        let (mut flux, _) = along(second, mass(second), &once, shape);
        let (width, across) = (shape[2].max(1), shape[1]);
        flux.par_chunks_mut((across * width).max(1)).enumerate().for_each(|(i, slab)| {
            for (j, row) in slab.chunks_exact_mut(width).enumerate() {
                match axis {
                    2 => row.iter_mut().zip(coefficient).for_each(|(f, c)| *f *= c),
                    _ => {
                        let c = coefficient[if axis == 0 { i } else { j }];
                        row.iter_mut().for_each(|f| *f *= c);
                    }
                }
            }
        });
        (gradient, flux)
    }
}
