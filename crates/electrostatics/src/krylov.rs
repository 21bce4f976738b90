//! Conjugate gradients in single precision inside a residual correction in double precision.

use elastocap_fem::tensor::dot;
use rayon::prelude::*;

/// A symmetric positive definite operator on the free unknowns of an array; entries that are not unknowns are kept
/// at zero by both methods.
pub trait Operator {
    /// Entries of the array.
    fn len(&self) -> usize;
    /// y = A x in single precision.
    fn apply_single(&mut self, x: &[f32], y: &mut [f32]);
    /// y = A x in double precision.
    fn apply_double(&mut self, x: &[f64], y: &mut [f64]);
    /// z = M^-1 r.
    fn precondition(&mut self, r: &[f32], z: &mut [f32]);
}

/// How a solve ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Convergence {
    /// Iterations over all corrections.
    pub iterations: usize,
    /// r M^-1 r at the end, an estimate of the squared energy of the error.
    pub energy_left: f64,
    /// Whether `energy_left` is at most what was asked.
    pub reached: bool,
}

/// Iterations over all corrections before giving up.
pub const ITERATION_LIMIT: usize = 400;

/// Solves A x = b from the given `x`; on return `r` is b - A x, computed in double precision.
///
/// Stops when r M^-1 r, which estimates the squared energy of the error, is at most `energy` (in the operator's own
/// units).
pub fn solve(op: &mut impl Operator, b: &[f64], x: &mut [f64], r: &mut Vec<f64>, energy: f64) -> Convergence {
    let n = op.len();
    let mut iterations = 0;
    r.resize(n, 0.0);
    op.apply_double(x, r);
    r.par_iter_mut().zip(b).for_each(|(r, b)| *r = b - *r);
    let (mut rs, mut z, mut p, mut q, mut d) =
        (vec![0f32; n], vec![0f32; n], vec![0f32; n], vec![0f32; n], vec![0f32; n]);
    let mut previous = f64::INFINITY;
    loop {
        // Scale to order one: single precision has little range.
        let scale = dot(r, r).sqrt();
        if scale == 0.0 || !scale.is_finite() {
            return Convergence { iterations, energy_left: scale, reached: scale == 0.0 };
        }
        rs.par_iter_mut().zip(&r[..]).for_each(|(s, r)| *s = (r / scale) as f32);
        op.precondition(&rs, &mut z);
        let mut rz = dot(&rs, &z);
        let start = rz;
        let left = |rz: f64| rz * scale * scale;
        if left(rz) <= energy || iterations >= ITERATION_LIMIT || !(left(rz) < 0.5 * previous) {
            return Convergence { iterations, energy_left: left(rz), reached: left(rz) <= energy };
        }
        previous = left(rz);
        p.copy_from_slice(&z);
        d.fill(0.0);
        // One correction gains at most what single precision can hold.
        while iterations < ITERATION_LIMIT {
            op.apply_single(&p, &mut q);
            let curvature = dot(&p, &q);
            if !(curvature > 0.0) {
                break;
            }
            let alpha = (rz / curvature) as f32;
            update(&mut d, &mut rs, alpha, &p, &q);
            iterations += 1;
            op.precondition(&rs, &mut z);
            let next = dot(&rs, &z);
            if !next.is_finite() || next <= 0.0 {
                break;
            }
            let beta = (next / rz) as f32;
            rz = next;
            if left(rz) <= 0.7 * energy || rz <= 1e-9 * start {
                break;
            }
            p.par_iter_mut().zip(&z).with_min_len(8192).for_each(|(p, z)| *p = z + beta * *p);
        }
        x.par_iter_mut().zip(&d).with_min_len(8192).for_each(|(x, d)| *x += scale * f64::from(*d));
        op.apply_double(x, r);
        r.par_iter_mut().zip(b).with_min_len(8192).for_each(|(r, b)| *r = b - *r);
    }
}

fn update(x: &mut [f32], r: &mut [f32], alpha: f32, p: &[f32], q: &[f32]) {
    x.par_iter_mut().zip(r).zip(p.par_iter().zip(q)).with_min_len(8192).for_each(|((x, r), (p, q))| {
        *x += alpha * p;
        *r -= alpha * q;
    });
}
