//! Operations on three-dimensional arrays `[i][j][k]` (k fastest) along one axis at a time.
//!
//! Every reduction and every product is cut in pieces that depend on the array alone, never on the number of
//! threads, so that results are the same bytes at any thread count.

pub use elastocap_linalg::gemm::{Left, Real, Right, Target, multiply};
pub use elastocap_linalg::reduction::{add, axpy, dot};
use faer::MatRef;
use rayon::prelude::*;
use std::ops::Range;

/// Shape of an array.
pub type Dims = [usize; 3];

/// A box of indices within an array.
pub type Window = [Range<usize>; 3];

/// A dense matrix, stored row by row.
#[derive(Debug, Clone)]
pub struct Dense<T> {
    /// Number of rows.
    pub rows: usize,
    /// Number of columns.
    pub cols: usize,
    /// The entries, row after row.
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

    /// The matrix as a left factor.
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

    /// The transposed matrix.
    pub fn transposed(&self) -> Self {
        let entry = |k: usize| self.data[k % self.rows * self.cols + k / self.rows];
        Self { rows: self.cols, cols: self.rows, data: (0..self.data.len()).map(entry).collect() }
    }

    /// The matrix as a right factor.
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
    /// For each row the index in `entry` at which it begins, then the number of entries.
    start: Vec<usize>,
    /// Column and value of all entries, row after row.
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

/// The largest share of zeros among the entries of a dense strip. Products of small dense matrices are
/// several times as fast per entry as sparse ones. Tuned: `cargo bench --bench solver`.
const MAX_ZEROS: f64 = 0.6;

/// A sparse matrix along one axis, stored as dense matrices of consecutive rows: rows that share most of
/// their columns, or a fixed number of rows at a time.
#[derive(Debug, Clone)]
pub struct Strips {
    /// Number of rows of the matrix.
    rows: usize,
    /// By ascending rows; the rows between two strips are zero.
    strips: Vec<Strip>,
    /// Whether every row is in a strip.
    is_full: bool,
}

/// A dense block of a sparse matrix.
#[derive(Debug, Clone)]
struct Strip {
    /// The row of the sparse matrix at which the block begins.
    first_row: usize,
    /// The column of the sparse matrix at which the block begins.
    first_column: usize,
    matrix: Dense<f64>,
    /// The transpose of `matrix`.
    transposed: Dense<f64>,
}

impl Strips {
    /// Strips of rows that share most of their columns. The values of the functions of a line at points on
    /// its elements give one strip per element.
    pub fn new(matrix: &SparseRows<f64>) -> Self {
        let hull = |row: usize| {
            let columns = || matrix.row(row).iter().map(|(column, _)| *column);
            columns().min().map_or(0..0, |low| low..columns().max().unwrap_or(low) + 1)
        };
        let mut runs: Vec<(Range<usize>, Range<usize>, usize)> = Vec::new();
        for row in (0..matrix.rows()).filter(|row| !matrix.row(*row).is_empty()) {
            let (hull, count) = (hull(row), matrix.row(row).len());
            if let Some((rows, columns, entries)) = runs.last_mut()
                && rows.end == row
            {
                let joint = columns.start.min(hull.start)..columns.end.max(hull.end);
                let dense = ((rows.len() + 1) * joint.len()) as f64;
                if (*entries + count) as f64 >= (1.0 - MAX_ZEROS) * dense {
                    (rows.end, *columns, *entries) = (row + 1, joint, *entries + count);
                    continue;
                }
            }
            runs.push((row..row + 1, hull, count));
        }
        Self::of(matrix, runs.into_iter().map(|(rows, columns, _)| (rows, columns)))
    }

    /// Strips of `count` rows each, whatever their zeros, for a matrix whose entries are near the diagonal.
    pub fn of_rows(matrix: &SparseRows<f64>, count: usize) -> Self {
        let count = count.max(1);
        let rows = |first: usize| first..(first + count).min(matrix.rows());
        let hull = |rows: Range<usize>| {
            let columns = || rows.clone().flat_map(|row| matrix.row(row)).map(|(column, _)| *column);
            let columns = columns().min().map_or(0..0, |low| low..columns().max().unwrap_or(low) + 1);
            (rows, columns)
        };
        Self::of(matrix, (0..matrix.rows()).step_by(count).map(rows).map(hull))
    }

    /// Strips of the given ranges of rows and columns.
    fn of(matrix: &SparseRows<f64>, runs: impl Iterator<Item = (Range<usize>, Range<usize>)>) -> Self {
        let strip = |(rows, columns): (Range<usize>, Range<usize>)| {
            let mut data = vec![0.0; rows.len() * columns.len()];
            for (entries, row) in data.chunks_exact_mut(columns.len().max(1)).zip(rows.clone()) {
                matrix.row(row).iter().for_each(|(column, value)| entries[column - columns.start] += value);
            }
            let dense = Dense { rows: rows.len(), cols: columns.len(), data };
            let transposed = dense.transposed();
            Strip { first_row: rows.start, first_column: columns.start, matrix: dense, transposed }
        };
        let strips: Vec<Strip> = runs.map(strip).collect();
        let is_full = strips.iter().map(|strip| strip.matrix.rows).sum::<usize>() == matrix.rows();
        Self { rows: matrix.rows(), strips, is_full }
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// `out = M x`, or `out += M x`, of an array `x` whose rows have `width` entries.
    pub fn times(&self, x: &[f64], width: usize, out: &mut [f64], accumulate: bool) {
        if !accumulate && !self.is_full {
            out.fill(0.0);
        }
        for strip in &self.strips {
            let source = right(x, strip.first_column * width, width, width);
            multiply(strip.matrix.left(), source, target(out, strip.first_row * width, width), accumulate);
        }
    }

    /// `out = M x` as by [`Strips::times`], on several threads.
    pub fn times_in_parallel(&self, x: &[f64], width: usize, out: &mut [f64]) {
        if !self.is_full {
            out.fill(0.0);
        }
        let (mut rest, mut done) = (out, 0);
        let mut pieces = Vec::with_capacity(self.strips.len());
        for strip in &self.strips {
            let (_, after) = std::mem::take(&mut rest).split_at_mut((strip.first_row - done) * width);
            let (part, after) = after.split_at_mut(strip.matrix.rows * width);
            (rest, done) = (after, strip.first_row + strip.matrix.rows);
            pieces.push((strip, part));
        }
        pieces.into_par_iter().for_each(|(strip, part)| {
            let source = right(x, strip.first_column * width, width, width);
            multiply(strip.matrix.left(), source, target(part, 0, width), false);
        });
    }

    /// `out = X M^T`, or `out += X M^T`, for `count` rows of X, which begin `apart` entries apart, and as
    /// many of `out`.
    pub fn times_rows(&self, x: &[f64], count: usize, apart: usize, out: Target<'_, f64>, accumulate: bool) {
        let Target { data, stride } = out;
        if !accumulate && !self.is_full {
            data.chunks_mut(stride.max(1)).take(count).for_each(|row| {
                let end = self.rows.min(row.len());
                row[..end].fill(0.0);
            });
        }
        for strip in &self.strips {
            let source = left(x, strip.first_column, count, strip.matrix.cols, apart);
            multiply(source, strip.transposed.right(), target(data, strip.first_row, stride), accumulate);
        }
    }
}

/// Applies a sparse matrix along one axis of an array. Returns the product and its shape.
pub fn along(axis: usize, matrix: &SparseRows<f64>, x: &[f64], dims: Dims) -> (Vec<f64>, Dims) {
    let mut shape = dims;
    shape[axis] = matrix.rows();
    let mut out = vec![0.0; shape.iter().product()];
    let (from, to) = (dims[1] * dims[2], shape[1] * shape[2]);
    if to == 0 || from == 0 {
        return (out, shape);
    }
    let strips = Strips::new(matrix);
    match axis {
        0 => strips.times_in_parallel(x, to, &mut out),
        1 => out.par_chunks_mut(to).enumerate().for_each(|(i, slab)| {
            strips.times(&x[i * from..(i + 1) * from], dims[2], slab, false);
        }),
        _ => out.par_chunks_mut(to).enumerate().for_each(|(i, slab)| {
            let slice = &x[i * from..(i + 1) * from];
            strips.times_rows(slice, dims[1], dims[2], target(slab, 0, shape[2]), false);
        }),
    }
    (out, shape)
}

/// Gives a buffer this length; its contents are unspecified. New memory comes zeroed from the system, so that
/// its pages are first touched by the threads that fill it.
pub fn sized<T: Real>(buffer: &mut Vec<T>, len: usize) {
    if buffer.len() != len {
        *buffer = vec![T::default(); len];
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use faer::Mat;

    /// Two dense blocks that overlap, a row without entries, one with two entries far apart, and a dense row.
    fn matrix() -> Mat<f64> {
        Mat::from_fn(11, 12, |i, j| {
            let is_set = match i {
                0..=3 => j < 5,
                4 => false,
                5..=8 => (4..9).contains(&j) && (i, j) != (6, 6),
                9 => j == 0 || j == 11,
                _ => true,
            };
            if is_set { 1.0 + (3 * i + 7 * j) as f64 % 5.0 } else { 0.0 }
        })
    }

    fn array(dims: Dims) -> Vec<f64> {
        (0..dims.iter().product()).map(|k| ((k * 37 % 101) as f64 - 50.0) / 8.0).collect()
    }

    #[test]
    fn a_matrix_with_gaps_and_empty_rows_acts_along_every_axis_as_its_entries_do() {
        let m = matrix();
        let rows = SparseRows::from_mat(m.as_ref());
        for axis in 0..3 {
            let mut dims = [3, 4, 5];
            dims[axis] = m.ncols();
            let x = array(dims);
            let (out, shape) = along(axis, &rows, &x, dims);
            let mut expected_shape = dims;
            expected_shape[axis] = m.nrows();
            assert_eq!(shape, expected_shape);
            for (at, found) in out.iter().enumerate() {
                let place = [at / (shape[1] * shape[2]), at / shape[2] % shape[1], at % shape[2]];
                let entry = |s: usize| {
                    let mut from = place;
                    from[axis] = s;
                    m[(place[axis], s)] * x[(from[0] * dims[1] + from[1]) * dims[2] + from[2]]
                };
                // Sums of eighths are exact.
                assert_eq!(*found, (0..m.ncols()).map(entry).sum::<f64>(), "axis {axis}, {place:?}");
            }
        }
    }

    #[test]
    fn products_are_added_to_what_is_there_where_that_is_asked_for_and_rows_without_entries_are_zero_where_not()
     {
        let m = matrix();
        let rows = SparseRows::from_mat(m.as_ref());
        for strips in [Strips::new(&rows), Strips::of_rows(&rows, 4), Strips::of_rows(&rows, 1)] {
            assert_eq!(strips.rows(), m.nrows());
            acts_as(&m, &strips);
        }
    }

    fn acts_as(m: &Mat<f64>, strips: &Strips) {
        let (width, count) = (3, 2);
        let x = array([m.ncols(), width, 1]);
        let (mut once, mut twice) = (vec![1.0; m.nrows() * width], vec![0.0; m.nrows() * width]);
        strips.times(&x, width, &mut once, false);
        strips.times(&x, width, &mut twice, false);
        strips.times(&x, width, &mut twice, true);
        assert!(once.iter().zip(&twice).all(|(one, two)| 2.0 * one == *two));
        assert!(once[4 * width..5 * width].iter().all(|x| *x == 0.0));
        let mut apart = vec![1.0; m.nrows() * width];
        strips.times_in_parallel(&x, width, &mut apart);
        assert_eq!(apart, once);
        // Rows of an array that is wider than the matrix, into a target that is wider than the product.
        let x = array([count, m.ncols() + 2, 1]);
        let mut out = vec![1.0; count * (m.nrows() + 3)];
        strips.times_rows(&x, count, m.ncols() + 2, target(&mut out, 0, m.nrows() + 3), false);
        let first = out.clone();
        strips.times_rows(&x, count, m.ncols() + 2, target(&mut out, 0, m.nrows() + 3), true);
        for (row, (after, before)) in out.chunks(m.nrows() + 3).zip(first.chunks(m.nrows() + 3)).enumerate() {
            for i in 0..m.nrows() {
                let exact: f64 = (0..m.ncols()).map(|j| m[(i, j)] * x[row * (m.ncols() + 2) + j]).sum();
                assert_eq!((before[i], after[i]), (exact, 2.0 * exact));
            }
            assert_eq!(after[m.nrows()..], [1.0; 3]);
        }
    }
}
