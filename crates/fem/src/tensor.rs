//! Operations on three-dimensional arrays `[i][j][k]` (k fastest) along one axis at a time.
//!
//! Every reduction and every product is cut in pieces that depend on the array alone, never on the number of threads,
//! so that results are the same bytes at any thread count.

use faer::linalg::matmul::matmul;
use faer::traits::RealField;
use faer::{Accum, MatMut, MatRef, Par};
use rayon::prelude::*;
use std::ops::Range;

/// Scalars of the kernels: `f32` inside preconditioners, `f64` where results are made.
pub trait Real: RealField + Copy + Default + Send + Sync + num::Float {}
impl Real for f32 {}
impl Real for f64 {}

/// The few conversions the kernels need.
pub mod num {
    /// Conversions and arithmetic shared by `f32` and `f64`.
    pub trait Float:
        std::ops::Add<Output = Self>
        + std::ops::Sub<Output = Self>
        + std::ops::Mul<Output = Self>
        + std::ops::Div<Output = Self>
        + std::ops::AddAssign
        + std::ops::MulAssign
        + Sized
    {
        /// Rounds from double precision.
        fn from_f64(x: f64) -> Self;
        /// Widens to double precision.
        fn to_f64(self) -> f64;
    }
    impl Float for f32 {
        #[inline]
        fn from_f64(x: f64) -> Self {
            x as Self
        }
        #[inline]
        fn to_f64(self) -> f64 {
            f64::from(self)
        }
    }
    impl Float for f64 {
        #[inline]
        fn from_f64(x: f64) -> Self {
            x
        }
        #[inline]
        fn to_f64(self) -> f64 {
            self
        }
    }
}

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
    /// Rounds a faer matrix.
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

    /// View for faer.
    pub fn view(&self) -> MatRef<'_, T> {
        MatRef::from_row_major_slice(&self.data, self.rows, self.cols)
    }
}

/// Row-major view of `rows x cols` entries starting at `offset`, rows `stride` apart.
#[inline]
pub fn rows<T>(data: &[T], offset: usize, rows: usize, cols: usize, stride: usize) -> MatRef<'_, T> {
    MatRef::from_row_major_slice_with_stride(&data[offset..], rows, cols, stride)
}

/// Mutable [`rows`].
#[inline]
pub fn rows_mut<T>(data: &mut [T], offset: usize, rows: usize, cols: usize, stride: usize) -> MatMut<'_, T> {
    MatMut::from_row_major_slice_with_stride_mut(&mut data[offset..], rows, cols, stride)
}

/// `dst (+)= a b`, on the calling thread.
#[inline]
pub fn multiply<T: Real>(dst: MatMut<'_, T>, accumulate: bool, a: MatRef<'_, T>, b: MatRef<'_, T>) {
    let accum = if accumulate { Accum::Add } else { Accum::Replace };
    matmul(dst, accum, a, b, T::from_f64(1.0), Par::Seq);
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

/// `dst += w src`.
#[inline]
pub fn axpy<T: Real>(dst: &mut [T], w: T, src: &[T]) {
    for (d, s) in dst.iter_mut().zip(src) {
        *d += w * *s;
    }
}

/// Entries summed in one run before partial sums are combined.
const DOT_CHUNK: usize = 4096;

/// Inner product in double precision, the same bytes at any thread count.
pub fn dot<T: Real>(a: &[T], b: &[T]) -> f64 {
    let partial = |(x, y): (&[T], &[T])| {
        // Eight independent sums: one alone would wait for every addition.
        let mut sums = [0.0_f64; 8];
        let (xs, ys) = (x.chunks_exact(8), y.chunks_exact(8));
        let tail: f64 = xs.remainder().iter().zip(ys.remainder()).map(|(p, q)| p.to_f64() * q.to_f64()).sum();
        for (p, q) in xs.zip(ys) {
            for l in 0..8 {
                sums[l] += p[l].to_f64() * q[l].to_f64();
            }
        }
        sums.iter().sum::<f64>() + tail
    };
    let chunks = || a.par_chunks(DOT_CHUNK).zip(b.par_chunks(DOT_CHUNK));
    if a.len() <= 8 * DOT_CHUNK {
        return a.chunks(DOT_CHUNK).zip(b.chunks(DOT_CHUNK)).map(partial).sum();
    }
    let sums: Vec<f64> = chunks().with_min_len(4).map(partial).collect();
    sums.iter().sum()
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
