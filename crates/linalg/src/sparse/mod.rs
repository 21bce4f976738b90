//! Sparse matrices by rows.
//!
//! A [`SparseMatrix`] is a [`CsrMatrix`] of nalgebra-sparse, which owns and transposes pattern and values.
//! The products are computed here for two reasons. They run on all threads, where those of nalgebra-sparse
//! 0.12 run on one; and the product with a vector applies a function to each sum, so that a residual costs
//! one sweep over memory and not two.
//!
//! nalgebra-sparse keeps eight bytes per column index, and a product with a vector does little but read
//! memory: for a matrix of 14 million entries it takes 16.8 ms on two cores, and 13.2 ms with four bytes per
//! index. Products therefore read a copy of the column indices in four bytes.

mod rows;

pub use nalgebra_sparse::CsrMatrix;
pub use rows::Rows;

use rayon::prelude::*;

/// Rows of one task, so that results do not depend on the number of threads. Tuned:
/// `cargo run --release -p elastocap-electrostatics --example tets_scaling`.
const TASK: usize = 4096;

/// A sparse matrix in double precision, with fewer than 2^32 columns.
#[derive(Debug, Clone)]
pub struct SparseMatrix {
    matrix: CsrMatrix<f64>,
    /// The column indices of `matrix` in half the memory.
    compact: Vec<u32>,
}

impl From<CsrMatrix<f64>> for SparseMatrix {
    /// # Panics
    /// If the matrix has 2^32 columns or more.
    fn from(matrix: CsrMatrix<f64>) -> Self {
        assert!(u32::try_from(matrix.ncols()).is_ok(), "{} columns do not fit 32 bits", matrix.ncols());
        let compact = matrix.col_indices().par_iter().with_min_len(TASK).map(|&c| c as u32).collect();
        Self { matrix, compact }
    }
}

impl SparseMatrix {
    /// A matrix from its rows: `parts` hold them one after the other, from the first to the last.
    ///
    /// # Panics
    /// If an entry is in a column that is not below `columns`.
    pub fn from_rows(columns: usize, parts: Vec<Rows>) -> Self {
        rows::joined(columns, parts).into()
    }

    /// A matrix whose row `i` is the sum of the terms (column, value) that `row(i, terms)` appends to
    /// `terms`, in any order.
    ///
    /// # Panics
    /// If an entry is in a column that is not below `columns`.
    pub fn build(rows: usize, columns: usize, row: impl Fn(usize, &mut Vec<(u32, f64)>) + Sync) -> Self {
        let parts = (0..rows.div_ceil(TASK)).into_par_iter().map(|task| {
            let (mut part, mut terms) = (Rows::default(), Vec::new());
            for i in task * TASK..((task + 1) * TASK).min(rows) {
                row(i, &mut terms);
                part.push(&mut terms);
            }
            part
        });
        Self::from_rows(columns, parts.collect())
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.matrix.nrows()
    }

    /// Number of columns.
    pub fn columns(&self) -> usize {
        self.matrix.ncols()
    }

    /// The matrix as nalgebra-sparse knows it.
    pub fn csr(&self) -> &CsrMatrix<f64> {
        &self.matrix
    }

    /// Columns, ascending, and values of row `i`.
    #[inline]
    pub fn row(&self, i: usize) -> (&[u32], &[f64]) {
        let (start, _, values) = self.matrix.csr_data();
        let range = start[i]..start[i + 1];
        (&self.compact[range.clone()], &values[range])
    }

    /// Column and value of each entry of row `i`, by ascending column.
    #[inline]
    pub fn terms(&self, i: usize) -> impl DoubleEndedIterator<Item = (usize, f64)> {
        let (columns, values) = self.row(i);
        columns.iter().zip(values).map(|(c, v)| (*c as usize, *v))
    }

    /// The diagonal, zero where it has no entry.
    pub fn diagonal(&self) -> Vec<f64> {
        let entry = |i: usize| {
            let (columns, values) = self.row(i);
            columns.binary_search(&(i as u32)).map_or(0.0, |k| values[k])
        };
        (0..self.rows()).into_par_iter().with_min_len(TASK).map(entry).collect()
    }

    /// `y_i = f((A x)_i, y_i)` for every row: `f` decides whether the product replaces, is added or is
    /// subtracted.
    ///
    /// `x` has as many entries as the matrix has columns, `y` as many as it has rows.
    pub fn product(&self, x: &[f64], y: &mut [f64], f: impl Fn(f64, f64) -> f64 + Sync) {
        y.par_iter_mut().enumerate().with_min_len(TASK).for_each(|(i, y)| {
            let sum: f64 = self.terms(i).map(|(j, a)| a * x[j]).sum();
            *y = f(sum, *y);
        });
    }

    /// The transposed matrix.
    pub fn transposed(&self) -> Self {
        self.matrix.transpose().into()
    }

    /// The product A B with another matrix, which has as many rows as this one has columns.
    pub fn times(&self, other: &Self) -> Self {
        Self::build(self.rows(), other.columns(), |i, terms| {
            for (k, a) in self.terms(i) {
                terms.extend(other.terms(k).map(|(j, b)| (j as u32, a * b)));
            }
        })
    }
}

#[cfg(test)]
mod tests;
