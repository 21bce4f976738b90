//! Sums and updates of long vectors.
//!
//! Every sum is cut in pieces that depend on the vector alone, never on the number of threads, so that
//! results are the same bytes at any thread count.

use rayon::prelude::*;

use crate::gemm::Real;

/// `dst += w src`, both of one length.
#[inline]
pub fn axpy<T: Real>(dst: &mut [T], w: T, src: &[T]) {
    for (d, s) in dst.iter_mut().zip(src) {
        *d += w * *s;
    }
}

/// The least number of entries that one task adds. Tuned: `cargo bench --bench solver`.
const TASK: usize = 16_384;

/// `dst += src`, both of one length, on several threads.
pub fn add(dst: &mut [f64], src: &[f64]) {
    dst.par_iter_mut().zip(src).with_min_len(TASK).for_each(|(d, s)| *d += s);
}

/// Entries summed in one run before partial sums are combined. Tuned: `cargo bench --bench solver`.
const DOT_CHUNK: usize = 4096;

/// Inner product in double precision of two vectors of one length, each in any precision; the same bytes at
/// any thread count.
pub fn dot<A: Real, B: Real>(a: &[A], b: &[B]) -> f64 {
    let partial = |(x, y): (&[A], &[B])| {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_inner_product_of_two_precisions_is_that_of_the_wider_one_and_the_same_at_any_number_of_threads() {
        let n = 10 * DOT_CHUNK + 13;
        let a: Vec<f64> = (0..n).map(|k| (k as f64 * 0.37).sin()).collect();
        let b: Vec<f32> = (0..n).map(|k| (k as f32 * 0.11).cos()).collect();
        let wide: Vec<f64> = b.iter().map(|b| f64::from(*b)).collect();
        let plain: f64 = a.iter().zip(&wide).map(|(a, b)| a * b).sum();
        assert!((dot(&a, &b) - plain).abs() < 1e-9);
        assert_eq!(dot(&a, &b), dot(&a, &wide));
        let run = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| dot(&a, &b))
        };
        assert_eq!(run(1), run(3));
        // Short vectors are summed without other threads, in the same order.
        assert_eq!(dot(&a[..5], &b[..5]), a[..5].iter().zip(&wide).map(|(a, b)| a * b).sum::<f64>());
    }
}
