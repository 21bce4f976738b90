//! Sums and updates of long vectors.
//!
//! Every sum is cut in pieces that depend on the vector alone, never on the number of threads, so that results are the same
//! bytes at any thread count.

use rayon::prelude::*;

use crate::gemm::Real;

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
