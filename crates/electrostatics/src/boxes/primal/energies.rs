//! Energies as sums of squares of gradients.
//!
//! In the product u A u the potentials of neighbouring nodes cancel, and the relative rounding error on an
//! element of size h grows like 1 / h. Here differences of potentials are taken first, and nothing cancels.

use super::{Primal, Term};
use crate::boxes::domain::{Axis, per_element};
use crate::boxes::mapped::gradients::{FINER, add_with_error, added_energies};
use crate::error::SolveError;
use elastocap_fem::mixed::{divergence_matrix, potential_offsets};
use elastocap_fem::tensor::{Dims, SparseRows, Strips, axpy, dot, target};
use faer::Mat;
use rayon::prelude::*;
use std::ops::Range;

/// Least number of entries of slabs for a parallel task. Tuned: `cargo bench --bench solver`.
const SMALL_TASK: usize = 8192;

/// The derivatives along an axis of the functions of a window, as a matrix D and a coefficient for each of
/// its rows: the stiffness of the axis is D^T diag(coefficient) D.
#[derive(Debug)]
pub(super) struct Gradient {
    matrix: SparseRows<f64>,
    coefficient: Vec<f64>,
}

impl Gradient {
    /// Makes the gradient of an axis with one coefficient per interval, for the functions of `window`; held
    /// ends are trimmed off.
    pub(super) fn new(axis: &Axis, coefficient: &[f64], window: &Range<usize>) -> Result<Self, SolveError> {
        let (whole, first) = (divergence_matrix(&axis.line)?, axis.functions().start + window.start);
        let offsets = potential_offsets(&axis.line);
        let per_mode: Vec<f64> = per_element(axis, coefficient)
            .iter()
            .enumerate()
            .flat_map(|(e, c)| std::iter::repeat_n(*c, offsets[e + 1] - offsets[e]))
            .collect();
        let rows: Vec<usize> = (0..per_mode.len()).filter(|r| per_mode[*r] != 0.0).collect();
        let matrix = Mat::from_fn(rows.len(), window.len(), |i, j| whole[(rows[i], first + j)]);
        Ok(Self {
            matrix: SparseRows::from_mat(matrix.as_ref()),
            coefficient: rows.iter().map(|r| per_mode[*r]).collect(),
        })
    }
}

impl Primal {
    /// Energies u_i A u_j of potentials, a symmetric matrix; under a map an upper bound on them.
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

    /// Energies u_i A u_j of potentials as if there were no map, a symmetric matrix.
    pub(crate) fn straight_energies(&self, potentials: &[Vec<f64>]) -> Mat<f64> {
        let n = potentials.len();
        let mut matrix = Mat::<f64>::zeros(n, n);
        let slices: Vec<&[f64]> = potentials.iter().map(Vec::as_slice).collect();
        for term in &self.terms.terms {
            matrix += term.products(&slices, &slices, |i, j| i <= j, self.dims);
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

    /// The product u A v of two potentials, for which [`Primal::energies`] would do more than is needed. What
    /// a map adds is left out.
    pub(crate) fn product_of(&self, u: &[f64], v: &[f64]) -> f64 {
        let terms = self.terms.terms.iter();
        let total: f64 = terms.map(|term| term.products(&[u], &[v], |_, _| true, self.dims)[(0, 0)]).sum();
        let mut beyond = vec![0.0; v.len()];
        self.faces.add_product(v, &mut beyond, self.dims);
        total + dot(u, &beyond)
    }
}

/// Derivatives of potentials piece by piece: of one row of the derivatives along the first axis, or of one
/// slab along the other two.
struct Pieces<'t> {
    term: &'t Term,
    /// The mass matrices of the second and the third axis.
    mass: [Strips; 2],
    /// The matrices D of the second and the third axis: see [`Gradient`].
    gradient: [Strips; 2],
    /// Dimensions of the arrays of coefficients.
    dims: Dims,
}

/// One of the pieces.
#[derive(Clone, Copy)]
enum Piece {
    /// A row of the derivatives along the first axis.
    Row(usize),
    /// The derivatives of a slab along the other two axes.
    Slab(usize),
}

impl<'t> Pieces<'t> {
    fn new(term: &'t Term, dims: Dims) -> Self {
        Self {
            term,
            mass: [Strips::new(&term.mass[1]), Strips::new(&term.mass[2])],
            gradient: [1, 2].map(|a| Strips::new(&term.gradient[a].matrix)),
            dims,
        }
    }

    /// The pieces that make up all derivatives.
    fn list(&self) -> Vec<Piece> {
        let rows = (0..self.term.gradient[0].matrix.rows()).map(Piece::Row);
        rows.chain((0..self.term.window[0].len()).map(Piece::Slab)).collect()
    }

    /// Numbers of functions of the second and the third axis.
    fn shape(&self) -> [usize; 2] {
        [self.term.window[1].len(), self.term.window[2].len()]
    }

    /// The sum of slabs of `u` with these weights.
    fn combine(&self, weights: &[(usize, f64)], u: &[f64], out: &mut Vec<f64>) {
        let ([w0, w1, w2], [n1, n2]) = (&self.term.window, self.shape());
        out.clear();
        out.resize(n1 * n2, 0.0);
        for &(s, weight) in weights {
            let from = ((w0.start + s) * self.dims[1] + w1.start) * self.dims[2] + w2.start;
            for (row, to) in out.chunks_exact_mut(n2).enumerate() {
                axpy(to, weight, &u[from + row * self.dims[2]..][..n2]);
            }
        }
    }

    /// Derivatives of a slab along the second axis, and behind them those along the third.
    fn differentiate(&self, slab: &[f64], out: &mut Vec<f64>) {
        let ([n1, n2], [r1, r2]) = (self.shape(), self.gradient.each_ref().map(Strips::rows));
        out.resize(r1 * n2 + n1 * r2, 0.0);
        let (second, third) = out.split_at_mut(r1 * n2);
        self.gradient[0].times(slab, n2, second, false);
        self.gradient[1].times_rows(slab, n1, n2, target(third, 0, r2), false);
    }

    /// The derivatives of `u` in a piece.
    fn gradient(&self, piece: Piece, u: &[f64], work: &mut Work, out: &mut Vec<f64>) {
        match piece {
            Piece::Row(r) => self.combine(self.term.gradient[0].matrix.row(r), u, out),
            Piece::Slab(i) => {
                self.combine(&[(i, 1.0)], u, &mut work.slab);
                self.differentiate(&work.slab, out);
            }
        }
    }

    /// The derivatives of `u` in a piece, times the coefficient and the masses of the other axes.
    fn flux(&self, piece: Piece, u: &[f64], work: &mut Work, out: &mut Vec<f64>) {
        let [n1, n2] = self.shape();
        let Work { slab, once } = work;
        match piece {
            Piece::Row(r) => {
                let Gradient { matrix, coefficient } = &self.term.gradient[0];
                self.combine(matrix.row(r), u, slab);
                once.resize(n1 * n2, 0.0);
                out.resize(n1 * n2, 0.0);
                self.mass[1].times_rows(slab, n1, n2, target(once, 0, n2), false);
                self.mass[0].times(once, n2, out, false);
                out.iter_mut().for_each(|x| *x *= coefficient[r]);
            }
            Piece::Slab(i) => {
                let [_, along_second, along_third] = &self.term.gradient;
                let (r1, r2) = (along_second.coefficient.len(), along_third.coefficient.len());
                self.combine(self.term.mass[0].row(i), u, slab);
                self.differentiate(slab, once);
                out.resize(once.len(), 0.0);
                let (second, third) = out.split_at_mut(r1 * n2);
                self.mass[1].times_rows(once, r1, n2, target(second, 0, n2), false);
                self.mass[0].times(&once[r1 * n2..], r2, third, false);
                for (row, c) in second.chunks_exact_mut(n2).zip(&along_second.coefficient) {
                    row.iter_mut().for_each(|x| *x *= c);
                }
                for row in third.chunks_exact_mut(r2.max(1)) {
                    row.iter_mut().zip(&along_third.coefficient).for_each(|(x, c)| *x *= c);
                }
            }
        }
    }
}

/// Working memory in which one thread differentiates, kept from one piece to the next.
#[derive(Default)]
struct Work {
    /// A sum of slabs.
    slab: Vec<f64>,
    /// That slab after products along one of its axes.
    once: Vec<f64>,
}

impl Term {
    /// Products of the potentials `x` with the potentials `y`, for the pairs that are `wanted`; the others
    /// are zero. They are computed piece by piece, so that all derivatives of a potential, which take as much
    /// memory as the potential itself, are never held.
    fn products(
        &self,
        x: &[&[f64]],
        y: &[&[f64]],
        wanted: impl Fn(usize, usize) -> bool + Sync,
        dims: Dims,
    ) -> Mat<f64> {
        let pieces = Pieces::new(self, dims);
        let buffers = || (Work::default(), vec![Vec::new(); x.len()], Vec::new());
        let of_piece = |(work, gradients, flux): &mut (Work, Vec<Vec<f64>>, Vec<f64>), piece: Piece| {
            x.iter().zip(&mut *gradients).for_each(|(u, gradient)| pieces.gradient(piece, u, work, gradient));
            let mut sums = vec![0.0; x.len() * y.len()];
            for (j, u) in y.iter().enumerate() {
                pieces.flux(piece, u, work, flux);
                for (i, gradient) in gradients.iter().enumerate().filter(|(i, _)| wanted(*i, j)) {
                    sums[i * y.len() + j] = dot(gradient, flux);
                }
            }
            sums
        };
        let plane = pieces.shape().iter().product::<usize>();
        // Added in order: the sum does not depend on the number of threads.
        let parts: Vec<Vec<f64>> = pieces
            .list()
            .into_par_iter()
            .with_min_len((SMALL_TASK / plane.max(1)).max(1))
            .map_init(buffers, of_piece)
            .collect();
        Mat::from_fn(x.len(), y.len(), |i, j| parts.iter().map(|part| part[i * y.len() + j]).sum())
    }
}
