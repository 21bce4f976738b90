//! Operations on three-dimensional arrays `[i][j][k]` (k fastest) along one axis at a time.
//!
//! Every reduction and every product is cut in pieces that depend on the array alone, never on the number of threads,
//! so that results are the same bytes at any thread count.

pub use elastocap_linalg::gemm::{Left, Real, Right, Target, multiply};
pub use elastocap_linalg::reduction::{axpy, dot};
use faer::MatRef;
use rayon::prelude::*;
use std::ops::Range;

/// Shape of an array.
pub type Dims = [usize; 3];

/// A box of indices within an array.
pub type Window = [Range<usize>; 3];

/// A dense row-major square or rectangular matrix.
#[derive(Debug, Clone)]
pub struct Dense<T> {
    /// Rows.
    pub rows: usize,
    /// Columns.
    pub cols: usize,
    /// Row-major entries.
    pub data: Vec<T>,
}

impl<T: Real> Dense<T> {
    /// Copies a faer matrix, rounded to the entry type.
    pub fn from_mat(m: MatRef<'_, f64>) -> Self {
        let (rows, cols) = (m.nrows(), m.ncols());
        let mut data = Vec::with_capacity(rows * cols);
        for i in 0..rows {
            for j in 0..cols {
                data.push(T::from_f64(m[(i, j)]));
            }
        }
        Self { rows, cols, data }
    }

    /// As a left factor.
    #[inline]
    pub fn left(&self) -> Left<'_, T> {
        Left { data: &self.data, rows: self.rows, cols: self.cols, row: self.cols, col: 1 }
    }

    /// Rows `range` as a left factor.
    #[inline]
    pub fn left_rows(&self, range: Range<usize>) -> Left<'_, T> {
        let data = &self.data[range.start * self.cols..range.end * self.cols];
        Left { data, rows: range.len(), cols: self.cols, row: self.cols, col: 1 }
    }

    /// As a right factor.
    #[inline]
    pub fn right(&self) -> Right<'_, T> {
        Right { data: &self.data, cols: self.cols, stride: self.cols }
    }
}

/// `rows x cols` entries from `offset`, rows `stride` apart, as a left factor.
#[inline]
pub fn left<T>(data: &[T], offset: usize, rows: usize, cols: usize, stride: usize) -> Left<'_, T> {
    Left { data: &data[offset..], rows, cols, row: stride, col: 1 }
}

/// Rows of `cols` entries from `offset`, `stride` apart, as a right factor.
#[inline]
pub fn right<T>(data: &[T], offset: usize, cols: usize, stride: usize) -> Right<'_, T> {
    Right { data: &data[offset..], cols, stride }
}

/// Rows from `offset`, `stride` apart, as a target.
#[inline]
pub fn target<T>(data: &mut [T], offset: usize, stride: usize) -> Target<'_, T> {
    Target { data: &mut data[offset..], stride }
}

/// A sparse 1D matrix by rows, for operators whose rows have a handful of entries.
#[derive(Debug, Clone)]
pub struct SparseRows<T> {
    start: Vec<usize>,
    entry: Vec<(usize, T)>,
}

impl<T: Real> SparseRows<T> {
    /// Keeps the entries of `m` that are not zero.
    pub fn from_mat(m: MatRef<'_, f64>) -> Self {
        let (mut start, mut entry) = (vec![0], Vec::new());
        for i in 0..m.nrows() {
            for j in 0..m.ncols() {
                if m[(i, j)] != 0.0 {
                    entry.push((j, T::from_f64(m[(i, j)])));
                }
            }
            start.push(entry.len());
        }
        Self { start, entry }
    }

    /// Entries of row `i`: column and value.
    #[inline]
    pub fn row(&self, i: usize) -> &[(usize, T)] {
        &self.entry[self.start[i]..self.start[i + 1]]
    }
}

impl<T> SparseRows<T> {
    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.start.len() - 1
    }
}

/// A sparse matrix applied along one axis of an array: the product and its shape.
pub fn along(axis: usize, matrix: &SparseRows<f64>, x: &[f64], dims: Dims) -> (Vec<f64>, Dims) {
    let mut shape = dims;
    shape[axis] = matrix.rows();
    let mut out = vec![0.0; shape.iter().product()];
    let (from, to) = (dims[1] * dims[2], shape[1] * shape[2]);
    if to > 0 {
        out.par_chunks_mut(to).enumerate().for_each(|(i, slab)| match axis {
            0 => matrix.row(i).iter().for_each(|(s, w)| axpy(slab, *w, &x[s * from..(s + 1) * from])),
            1 => {
                for (j, row) in slab.chunks_exact_mut(dims[2]).enumerate() {
                    for (s, w) in matrix.row(j) {
                        let at = i * from + s * dims[2];
                        axpy(row, *w, &x[at..at + dims[2]]);
                    }
                }
            }
            _ => {
                for (j, row) in slab.chunks_exact_mut(shape[2]).enumerate() {
                    let source = &x[i * from + j * dims[2]..][..dims[2]];
                    for (k, y) in row.iter_mut().enumerate() {
                        *y = matrix.row(k).iter().map(|(s, w)| w * source[*s]).sum();
                    }
                }
            }
        });
    }
    (out, shape)
}

/// Sets a window of an array to zero.
pub fn clear<T: Real>(data: &mut [T], dims: Dims, window: &Window) {
    for i in window[0].clone() {
        for j in window[1].clone() {
            let row = (i * dims[1] + j) * dims[2];
            data[row + window[2].start..row + window[2].end].fill(T::default());
        }
    }
}
