//! Energies as sums of squares of gradients.
//!
//! In the product u A u the potentials of neighbouring nodes cancel, and the relative rounding error on an element of size h grows
//! like 1 / h. Here differences of potentials are taken first, and nothing cancels.

use super::{Primal, Term};
use crate::SolveError;
use crate::boxes::domain::{Axis, per_element};
use crate::boxes::mapped::gradients::{FINER, add_with_error, added_energies};
use elastocap_fem::mixed::{divergence_matrix, potential_offsets};
use elastocap_fem::tensor::{Dims, SparseRows, Strips, axpy, dot, target};
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

/// Entries of slabs that are worth a task of their own.
const SMALL_TASK: usize = 1024;

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
        let all: Vec<&[f64]> = potentials.iter().map(Vec::as_slice).collect();
        for term in &self.terms.terms {
            matrix += term.products(&all, &all, |i, j| i <= j, self.dims);
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
        let terms = self.terms.terms.iter();
        let total: f64 = terms.map(|term| term.products(&[u], &[v], |_, _| true, self.dims)[(0, 0)]).sum();
        let mut beyond = vec![0.0; v.len()];
        self.faces.add_product(v, &mut beyond, self.dims);
        total + dot(u, &beyond)
    }
}

/// Derivatives of potentials piece by piece: of one row of the derivatives along the first axis, or of one slab along the other two.
struct Pieces<'t> {
    term: &'t Term<f64>,
    /// Of the second and the third axis.
    mass: [Strips; 2],
    gradient: [Strips; 2],
    dims: Dims,
}

/// One of the pieces.
#[derive(Clone, Copy)]
enum Piece {
    Row(usize),
    Slab(usize),
}

impl<'t> Pieces<'t> {
    fn new(term: &'t Term<f64>, dims: Dims) -> Self {
        Self {
            term,
            mass: [Strips::new(&term.mass[1]), Strips::new(&term.mass_last)],
            gradient: [1, 2].map(|a| Strips::new(&term.gradient[a].matrix)),
            dims,
        }
    }

    fn all(&self) -> Vec<Piece> {
        let rows = (0..self.term.gradient[0].matrix.rows()).map(Piece::Row);
        rows.chain((0..self.term.window[0].len()).map(Piece::Slab)).collect()
    }

    /// Functions of the second and the third axis.
    fn shape(&self) -> [usize; 2] {
        [self.term.window[1].len(), self.term.window[2].len()]
    }

    /// The sum of slabs of `u` with these weights.
    fn combined(&self, weights: &[(usize, f64)], u: &[f64]) -> Vec<f64> {
        let ([w0, w1, w2], [n1, n2]) = (&self.term.window, self.shape());
        let mut out = vec![0.0; n1 * n2];
        for &(s, weight) in weights {
            let from = ((w0.start + s) * self.dims[1] + w1.start) * self.dims[2] + w2.start;
            for (row, to) in out.chunks_exact_mut(n2).enumerate() {
                axpy(to, weight, &u[from + row * self.dims[2]..][..n2]);
            }
        }
        out
    }

    /// Derivatives of a slab along the second and along the third axis.
    fn derivatives(&self, slab: &[f64]) -> [Vec<f64>; 2] {
        let ([n1, n2], [r1, r2]) = (self.shape(), self.gradient.each_ref().map(Strips::rows));
        let (mut second, mut third) = (vec![0.0; r1 * n2], vec![0.0; n1 * r2]);
        self.gradient[0].times(slab, n2, &mut second, false);
        self.gradient[1].times_rows(slab, n1, n2, target(&mut third, 0, r2), false);
        [second, third]
    }

    /// The derivatives of `u` in a piece.
    fn gradient(&self, piece: Piece, u: &[f64]) -> Vec<f64> {
        match piece {
            Piece::Row(r) => self.combined(self.term.gradient[0].matrix.row(r), u),
            Piece::Slab(i) => self.derivatives(&self.combined(&[(i, 1.0)], u)).concat(),
        }
    }

    /// The same times the coefficient and the masses of the other axes.
    fn flux(&self, piece: Piece, u: &[f64]) -> Vec<f64> {
        let [n1, n2] = self.shape();
        match piece {
            Piece::Row(r) => {
                let Gradient { matrix, coefficient } = &self.term.gradient[0];
                let (mut once, mut flux) = (vec![0.0; n1 * n2], vec![0.0; n1 * n2]);
                let gradient = self.combined(matrix.row(r), u);
                self.mass[1].times_rows(&gradient, n1, n2, target(&mut once, 0, n2), false);
                self.mass[0].times(&once, n2, &mut flux, false);
                flux.iter_mut().for_each(|x| *x *= coefficient[r]);
                flux
            }
            Piece::Slab(i) => {
                let [second, third] = self.derivatives(&self.combined(self.term.mass[0].row(i), u));
                let [_, along_second, along_third] = &self.term.gradient;
                let (r1, r2) = (along_second.coefficient.len(), along_third.coefficient.len());
                let mut flux = vec![0.0; second.len() + third.len()];
                let (to_second, to_third) = flux.split_at_mut(second.len());
                self.mass[1].times_rows(&second, r1, n2, target(to_second, 0, n2), false);
                self.mass[0].times(&third, r2, to_third, false);
                for (row, c) in to_second.chunks_exact_mut(n2).zip(&along_second.coefficient) {
                    row.iter_mut().for_each(|x| *x *= c);
                }
                for row in to_third.chunks_exact_mut(r2.max(1)) {
                    row.iter_mut().zip(&along_third.coefficient).for_each(|(x, c)| *x *= c);
                }
                flux
            }
        }
    }
}

impl Term<f64> {
    /// Products of potentials with others, those that are `wanted`. Piece by piece, so that derivatives of all of a potential, which take as
    /// much memory as itself, are never held.
    fn products(
        &self,
        x: &[&[f64]],
        y: &[&[f64]],
        wanted: impl Fn(usize, usize) -> bool + Sync,
        dims: Dims,
    ) -> Mat<f64> {
        let pieces = Pieces::new(self, dims);
        let of_piece = |piece: Piece| {
            let gradients: Vec<Vec<f64>> = x.iter().map(|u| pieces.gradient(piece, u)).collect();
            let fluxes: Vec<Vec<f64>> = y.iter().map(|u| pieces.flux(piece, u)).collect();
            let product = |i, j| if wanted(i, j) { dot(&gradients[i], &fluxes[j]) } else { 0.0 };
            Mat::from_fn(x.len(), y.len(), product)
        };
        let plane = pieces.shape().iter().product::<usize>();
        // Added in order: the sum does not depend on the number of threads.
        let parts: Vec<Mat<f64>> = pieces
            .all()
            .into_par_iter()
            .with_min_len((SMALL_TASK / plane.max(1)).max(1))
            .map(of_piece)
            .collect();
        parts.iter().fold(Mat::zeros(x.len(), y.len()), |sum, part| sum + part)
    }
}
