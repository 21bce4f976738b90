//! Energies as sums of squares of gradients.
//!
//! In the product u A u the potentials of neighbouring nodes cancel, and the relative rounding error on an element of size h grows
//! like 1 / h. Here differences of potentials are taken first, and nothing cancels.

use super::{Primal, Term};
use crate::SolveError;
use crate::boxes::domain::{Axis, per_element};
use crate::boxes::mapped::gradients::{FINER, add_with_error, added_energies};
use elastocap_fem::mixed::{divergence_matrix, potential_offsets};
use elastocap_fem::tensor::{Dims, SparseRows, Strips, along, axpy, dot, target};
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

impl Primal {
    /// Energies u_i A u_j of potentials, a symmetric matrix; under a map no less than these.
    ///
    /// # Errors
    /// A map that turns space inside out.
    pub(crate) fn energies(&self, potentials: &[Vec<f64>]) -> Result<Mat<f64>, SolveError> {
        let mut matrix = self.straight_energies(potentials);
        if let Some((gradients, domain)) = &self.bent
            && let Some(finer) = added_energies(domain, FINER, potentials, self.dims)?
        {
            let coarser = gradients.energies(potentials, self.dims)?;
            add_with_error(&mut matrix, &coarser, &finer, 1.0);
        }
        Ok(matrix)
    }

    /// The same as if there were no map.
    pub(crate) fn straight_energies(&self, potentials: &[Vec<f64>]) -> Mat<f64> {
        let n = potentials.len();
        let mut matrix = Mat::<f64>::zeros(n, n);
        for term in &self.terms.terms {
            matrix += term.energies(potentials, self.dims);
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

/// Matrices of the second and the third axis, for products of slabs.
struct AcrossSlabs<'t> {
    term: &'t Term<f64>,
    mass: [Strips; 2],
    gradient: [Strips; 2],
}

/// Derivatives along one axis in one slab, and those times the coefficient and the masses of the other axes.
#[derive(Default)]
struct Pair {
    gradient: Vec<f64>,
    flux: Vec<f64>,
}

impl AcrossSlabs<'_> {
    fn shape(&self) -> [usize; 2] {
        [self.term.window[1].len(), self.term.window[2].len()]
    }

    /// `out +=` the sum of slabs of `u` with the weights in row `i` of a matrix of the first axis.
    fn combine(&self, matrix: &SparseRows<f64>, i: usize, u: &[f64], dims: Dims, out: &mut [f64]) {
        let ([w0, w1, w2], n2) = (&self.term.window, self.shape()[1]);
        for &(s, weight) in matrix.row(i) {
            let from = ((w0.start + s) * dims[1] + w1.start) * dims[2] + w2.start;
            for (row, to) in out.chunks_exact_mut(n2).enumerate() {
                axpy(to, weight, &u[from + row * dims[2]..][..n2]);
            }
        }
    }

    /// Along the first axis, in row `r` of its derivatives.
    fn along_first(&self, r: usize, u: &[f64], dims: Dims) -> Pair {
        let [n1, n2] = self.shape();
        let own = &self.term.gradient[0];
        let (mut gradient, mut once, mut flux) = (vec![0.0; n1 * n2], vec![0.0; n1 * n2], vec![0.0; n1 * n2]);
        self.combine(&own.matrix, r, u, dims, &mut gradient);
        self.mass[1].times_rows(&gradient, n1, n2, target(&mut once, 0, n2), false);
        self.mass[0].times(&once, n2, &mut flux, false);
        flux.iter_mut().for_each(|x| *x *= own.coefficient[r]);
        Pair { gradient, flux }
    }

    /// Along the second and the third axis, in slab `i`.
    fn along_others(&self, i: usize, u: &[f64], dims: Dims) -> [Pair; 2] {
        let [n1, n2] = self.shape();
        let [_, second, third] = &self.term.gradient;
        let ([w0, w1, w2], rows, columns) =
            (&self.term.window, self.gradient[0].rows(), self.gradient[1].rows());
        let mut own = Vec::with_capacity(n1 * n2);
        for j in w1.clone() {
            let at = ((w0.start + i) * dims[1] + j) * dims[2];
            own.extend_from_slice(&u[at + w2.start..at + w2.end]);
        }
        let mut weighed = vec![0.0; n1 * n2];
        self.combine(&self.term.mass[0], i, u, dims, &mut weighed);
        let (mut gradient, mut once, mut flux) =
            (vec![0.0; rows * n2], vec![0.0; rows * n2], vec![0.0; rows * n2]);
        self.gradient[0].times(&own, n2, &mut gradient, false);
        self.gradient[0].times(&weighed, n2, &mut once, false);
        self.mass[1].times_rows(&once, rows, n2, target(&mut flux, 0, n2), false);
        for (row, c) in flux.chunks_exact_mut(n2).zip(&second.coefficient) {
            row.iter_mut().for_each(|x| *x *= c);
        }
        let along_second = Pair { gradient, flux };
        let (mut gradient, mut once, mut flux) =
            (vec![0.0; n1 * columns], vec![0.0; n1 * columns], vec![0.0; n1 * columns]);
        self.gradient[1].times_rows(&own, n1, n2, target(&mut gradient, 0, columns), false);
        self.gradient[1].times_rows(&weighed, n1, n2, target(&mut once, 0, columns), false);
        self.mass[0].times(&once, columns, &mut flux, false);
        for row in flux.chunks_exact_mut(columns.max(1)) {
            row.iter_mut().zip(&third.coefficient).for_each(|(x, c)| *x *= c);
        }
        [along_second, Pair { gradient, flux }]
    }
}

/// Products of derivatives and fluxes of all pairs, above the diagonal and on it.
fn add_pairs(to: &mut Mat<f64>, pairs: &[Pair]) {
    for (i, Pair { gradient, .. }) in pairs.iter().enumerate() {
        for (j, Pair { flux, .. }) in pairs.iter().enumerate().skip(i) {
            to[(i, j)] += dot(gradient, flux);
        }
    }
}

impl Term<f64> {
    /// Energies of potentials, above the diagonal and on it. Slab by slab, so that derivatives of all of a potential, which take as much memory
    /// as itself, are never held.
    fn energies(&self, potentials: &[Vec<f64>], dims: Dims) -> Mat<f64> {
        let across = AcrossSlabs {
            term: self,
            mass: [Strips::new(&self.mass[1]), Strips::new(&self.mass_last)],
            gradient: [1, 2].map(|a| Strips::new(&self.gradient[a].matrix)),
        };
        let n = potentials.len();
        let (rows, slabs) = (self.gradient[0].matrix.rows(), self.window[0].len());
        let part = |index: usize| {
            let mut own = Mat::zeros(n, n);
            if index < rows {
                let pairs: Vec<Pair> =
                    potentials.iter().map(|u| across.along_first(index, u, dims)).collect();
                add_pairs(&mut own, &pairs);
            } else {
                let both = potentials.iter().map(|u| across.along_others(index - rows, u, dims));
                let (second, third): (Vec<Pair>, Vec<Pair>) =
                    both.map(|[second, third]| (second, third)).unzip();
                add_pairs(&mut own, &second);
                add_pairs(&mut own, &third);
            }
            own
        };
        let plane = across.shape().iter().product::<usize>();
        // Added in order: the sum does not depend on the number of threads.
        let parts: Vec<Mat<f64>> =
            (0..rows + slabs).into_par_iter().with_min_len((1024 / plane.max(1)).max(1)).map(part).collect();
        parts.iter().fold(Mat::zeros(n, n), |sum, part| sum + part)
    }

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
