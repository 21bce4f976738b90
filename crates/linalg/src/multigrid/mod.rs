//! A preconditioner for conjugate gradients: one symmetric multigrid cycle for a sparse matrix that comes
//! from an elliptic problem.
//!
//! Levels are made by smoothed aggregation (Vanek, Mandel, Brezina 1996) of unknowns that are strongly
//! connected; the caller may supply a better first level, say the potentials of order 1 below those of order
//! p. Smoothing is symmetric Gauss-Seidel everywhere, and the last level, of a few hundred unknowns, is
//! solved exactly.
//!
//! No existing crate would do: none of this kind gives the same bytes at any number of threads, and the
//! bindings to hypre or AMGX would bring another language into the build.

mod aggregation;
#[cfg(test)]
mod tests;

use crate::cholesky::Cholesky;
use crate::conjugate_gradients::Operator;
use crate::sparse::SparseMatrix;
use aggregation::smoothed_aggregates;
use faer::Mat;
use rayon::prelude::*;

/// Coarsening ends at a level with at most this many unknowns, which is solved exactly. Where coarsening
/// stalls earlier, up to four times as many are. Tuned:
/// `cargo run --release -p elastocap-electrostatics --example tets_scaling`.
const DIRECT: usize = 400;

/// The share of the geometric mean of two diagonal entries beyond which the entry that couples them is a
/// strong connection, on the finest level of which aggregates are made; half of it on each next level. Tuned:
/// `cargo run --release -p elastocap-electrostatics --example tets_scaling`.
const STRONG: f64 = 0.08;

/// A level that the caller knows, below the finest one.
#[derive(Debug, Clone)]
pub struct CoarseLevel {
    /// The map from values on this level to values on the finest one, with a row for each unknown of the
    /// finest level and a column for each of this one.
    pub prolongation: SparseMatrix,
    /// The symmetric matrix of this level.
    pub matrix: SparseMatrix,
}

/// Levels from fine to coarse.
#[derive(Debug)]
pub struct Multigrid {
    levels: Vec<Level>,
    /// The factor of the last level. `None` if that level is too large or its matrix has no factor; the level
    /// is then smoothed like the others.
    last: Option<Cholesky>,
}

#[derive(Debug)]
struct Level {
    matrix: SparseMatrix,
    /// The inverses of the diagonal entries; zero where an entry is not positive.
    inverse_diagonal: Vec<f64>,
    /// `None` on the last level.
    transfer: Option<Transfer>,
}

/// Prolongation and restriction between a level and the next coarser one.
#[derive(Debug)]
struct Transfer {
    /// Prolongation from the coarser level.
    up: SparseMatrix,
    /// Restriction to the coarser level, the transpose of `up`.
    down: SparseMatrix,
}

/// The working memory of one cycle at one level.
#[derive(Debug)]
struct Vectors {
    residual: Vec<f64>,
    /// The right-hand side on the coarser level.
    right: Vec<f64>,
    /// The solution on the coarser level.
    coarse: Vec<f64>,
    /// What a second visit of the coarser level adds to `coarse`.
    step: Vec<f64>,
}

/// A matrix and its multigrid cycle as [`conjugate_gradients::solve`](crate::conjugate_gradients::solve)
/// takes them, with its working memory. Right-hand sides that are solved for at the same time need a cycle
/// each.
#[derive(Debug)]
pub struct Cycle<'a> {
    grid: &'a Multigrid,
    work: Vec<Vectors>,
}

impl Multigrid {
    /// Builds the levels for a symmetric positive definite matrix; `coarse` is the level below it if the
    /// caller knows one.
    pub fn new(matrix: SparseMatrix, coarse: Option<CoarseLevel>) -> Self {
        let mut levels = Vec::new();
        let mut matrix = matrix;
        if let Some(coarse) = coarse {
            levels.push(Level::new(matrix, Some(Transfer::new(coarse.prolongation))));
            matrix = coarse.matrix;
        }
        let mut strong = STRONG;
        while matrix.rows() > DIRECT {
            let Some(up) = smoothed_aggregates(&matrix, strong) else { break };
            let transfer = Transfer::new(up);
            let coarse = transfer.down.times(&matrix.times(&transfer.up));
            levels.push(Level::new(matrix, Some(transfer)));
            matrix = coarse;
            strong *= 0.5;
        }
        let last = if matrix.rows() <= 4 * DIRECT { Cholesky::new(dense(&matrix)).ok() } else { None };
        levels.push(Level::new(matrix, None));
        Self { levels, last }
    }

    /// The matrix whose inverse the cycle stands in for.
    pub fn matrix(&self) -> &SparseMatrix {
        &self.levels[0].matrix
    }

    /// The matrix and the cycle, for one right-hand side at a time.
    pub fn cycle(&self) -> Cycle<'_> {
        let vectors = |level: &Level| {
            let coarse = level.transfer.as_ref().map_or(0, |t| t.up.columns());
            Vectors {
                residual: vec![0.0; level.matrix.rows()],
                right: vec![0.0; coarse],
                coarse: vec![0.0; coarse],
                step: vec![0.0; coarse],
            }
        };
        Cycle { grid: self, work: self.levels.iter().map(vectors).collect() }
    }

    /// x = M^-1 r at level `at`; `work` has the vectors of this level and of the coarser ones.
    fn apply(&self, at: usize, r: &[f64], x: &mut [f64], work: &mut [Vectors]) {
        let level = &self.levels[at];
        let Some((here, below)) = work.split_first_mut() else { return };
        let Some(transfer) = &level.transfer else {
            match &self.last {
                Some(exact) => {
                    x.copy_from_slice(r);
                    exact.solve_in_place(x);
                }
                None => {
                    level.forward(r, x);
                    level.backward(r, x);
                }
            }
            return;
        };
        level.forward(r, x);
        level.residual_after_forward(x, &mut here.residual);
        transfer.down.product(&here.residual, &mut here.right, |new, _| new);
        self.apply(at + 1, &here.right, &mut here.coarse, below);
        // Levels of aggregates are so much smaller that a second visit costs little. It preserves the
        // convergence rate.
        if at > 0 {
            self.levels[at + 1].matrix.product(&here.coarse, &mut here.right, |product, old| old - product);
            self.apply(at + 1, &here.right, &mut here.step, below);
            for (x, step) in here.coarse.iter_mut().zip(&here.step) {
                *x += step;
            }
        }
        transfer.up.product(&here.coarse, x, |correction, x| x + correction);
        level.backward(r, x);
    }
}

impl Operator for Cycle<'_> {
    type Precision = f64;

    fn unknowns(&self) -> usize {
        self.grid.matrix().rows()
    }

    fn apply(&mut self, x: &[f64], y: &mut [f64]) {
        self.grid.matrix().product(x, y, |product, _| product);
    }

    fn precondition(&mut self, r: &[f64], z: &mut [f64]) {
        self.grid.apply(0, r, z, &mut self.work);
    }
}

impl Transfer {
    fn new(up: SparseMatrix) -> Self {
        let down = up.transposed();
        Self { up, down }
    }
}

impl Level {
    fn new(matrix: SparseMatrix, transfer: Option<Transfer>) -> Self {
        let inverse_diagonal =
            matrix.diagonal().into_iter().map(|d| if d > 0.0 { 1.0 / d } else { 0.0 }).collect();
        Self { matrix, inverse_diagonal, transfer }
    }

    /// Solves (D + L) x = r: a forward sweep of Gauss-Seidel from x = 0.
    fn forward(&self, r: &[f64], x: &mut [f64]) {
        for i in 0..x.len() {
            let mut sum = r[i];
            for (j, a) in self.matrix.terms(i) {
                if j >= i {
                    break;
                }
                sum -= a * x[j];
            }
            x[i] = sum * self.inverse_diagonal[i];
        }
    }

    /// r - A x after [`Level::forward`], to which only the upper triangle of A contributes.
    fn residual_after_forward(&self, x: &[f64], residual: &mut [f64]) {
        residual.par_iter_mut().enumerate().with_min_len(4096).for_each(|(i, residual)| {
            let mut sum = 0.0;
            for (j, a) in self.matrix.terms(i).rev() {
                if j <= i {
                    break;
                }
                sum -= a * x[j];
            }
            *residual = sum;
        });
    }

    /// A backward sweep of Gauss-Seidel.
    fn backward(&self, r: &[f64], x: &mut [f64]) {
        for i in (0..x.len()).rev() {
            let product: f64 = self.matrix.terms(i).map(|(j, a)| a * x[j]).sum();
            x[i] += (r[i] - product) * self.inverse_diagonal[i];
        }
    }
}

/// The matrix with its zeros.
fn dense(matrix: &SparseMatrix) -> Mat<f64> {
    let mut dense = Mat::zeros(matrix.rows(), matrix.columns());
    for i in 0..matrix.rows() {
        for (j, a) in matrix.terms(i) {
            dense[(i, j)] = a;
        }
    }
    dense
}
