//! Conjugate gradients in double precision with a preconditioner in single precision.

use crate::reduction::dot;
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};

/// A symmetric positive definite operator on the free unknowns of an array; entries that are not unknowns are kept
/// at zero by both methods.
pub trait Operator {
    /// Entries of the array.
    fn unknowns(&self) -> usize;
    /// y = A x.
    fn apply(&mut self, x: &[f64], y: &mut [f64]);
    /// z = M^-1 r, for r of order one.
    fn precondition(&mut self, r: &[f32], z: &mut [f32]);
}

/// How a solve ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Convergence {
    /// Iterations taken.
    pub iterations: usize,
    /// r M^-1 r at the end, an estimate of the squared energy of the error.
    pub energy_left: f64,
    /// Whether the goal was met.
    pub reached: bool,
}

/// When to stop.
#[derive(Debug, Clone, Copy)]
pub struct Goal<'a> {
    /// Largest r M^-1 r, which estimates the squared energy of the error, over the energy reached.
    pub share: f64,
    /// Energy at x = 0, from which every step takes its share off.
    pub start: f64,
    /// Set from outside to stop at once, short of the goal.
    pub cancel: Option<&'a AtomicBool>,
}

/// Iterations before giving up.
pub const ITERATION_LIMIT: usize = 300;

/// Solves A x = b from `x` = 0; on return `r` is b - A x up to the drift of the recursion.
///
/// Stops when the goal is met, or when r M^-1 r has stopped falling.
///
/// The preconditioner is rounded, hence not quite symmetric: the next direction is made conjugate with the change of
/// the residual (Polak and Ribiere), which costs one inner product and keeps the rate.
pub fn solve(
    op: &mut impl Operator,
    b: &[f64],
    x: &mut [f64],
    r: &mut Vec<f64>,
    goal: Goal<'_>,
) -> Convergence {
    const TASK: usize = 16_384;
    let n = op.unknowns();
    r.clear();
    r.extend_from_slice(b);
    let mut energy = goal.start;
    let (mut single, mut z) = (vec![0f32; n], vec![0f32; n]);
    let (mut p, mut q) = (vec![0f64; n], vec![0f64; n]);
    let mut scale = dot(r, r).sqrt();
    let (mut iterations, mut rz, mut best, mut stalled) = (0, 0.0, f64::INFINITY, 0);
    // What each step took off the energy.
    let mut steps: Vec<f64> = Vec::new();
    loop {
        if scale == 0.0 || !scale.is_finite() {
            return Convergence { iterations, energy_left: scale, reached: scale == 0.0 };
        }
        // Scaled to order one: single precision has little range.
        single.par_iter_mut().zip(&r[..]).with_min_len(TASK).for_each(|(s, r)| *s = (r / scale) as f32);
        op.precondition(&single, &mut z);
        let next: f64 = dot_mixed(r, &z) * scale;
        stalled = if next < 0.9 * best { 0 } else { stalled + 1 };
        best = best.min(next);
        // With a poor preconditioner r M^-1 r says little: what is left also shows in how slowly the energy falls.
        let slow = remaining(&steps) > goal.share * energy.abs();
        let reached = next <= goal.share * energy.abs() && !slow;
        let cancelled = goal.cancel.is_some_and(|c| c.load(Ordering::Relaxed));
        if reached
            || cancelled
            || iterations >= ITERATION_LIMIT
            || stalled >= 20
            || !next.is_finite()
            || next <= 0.0
        {
            return Convergence { iterations, energy_left: next, reached };
        }
        let beta = if iterations == 0 { 0.0 } else { ((next - dot_mixed(&q, &z) * scale) / rz).max(0.0) };
        p.par_iter_mut().zip(&z).with_min_len(TASK).for_each(|(p, z)| *p = scale * f64::from(*z) + beta * *p);
        rz = next;
        op.apply(&p, &mut q);
        let alpha = dot(r, &p) / dot(&p, &q);
        if !alpha.is_finite() {
            return Convergence { iterations, energy_left: rz, reached: false };
        }
        x.par_iter_mut().zip(&mut r[..]).zip(p.par_iter().zip(&mut q)).with_min_len(TASK).for_each(
            |((x, r), (p, q))| {
                // q becomes the old residual, for the next direction.
                let old = *r;
                *x += alpha * p;
                *r -= alpha * *q;
                *q = old;
            },
        );
        energy -= alpha * rz;
        steps.push(alpha * rz);
        iterations += 1;
        scale = dot(r, r).sqrt();
    }
}

/// Energy that the coming steps will take off if they go on falling as over the last few.
pub fn remaining(steps: &[f64]) -> f64 {
    const WINDOW: usize = 4;
    let n = steps.len();
    if n <= WINDOW {
        return 0.0;
    }
    let rate = (steps[n - 1] / steps[n - 1 - WINDOW]).powf(1.0 / WINDOW as f64).clamp(0.0, 0.99);
    steps[n - 1] * rate / (1.0 - rate)
}

fn dot_mixed(a: &[f64], b: &[f32]) -> f64 {
    const CHUNK: usize = 4096;
    let partial = |(x, y): (&[f64], &[f32])| {
        let mut sums = [0.0_f64; 8];
        let (xs, ys) = (x.chunks_exact(8), y.chunks_exact(8));
        let tail: f64 = xs.remainder().iter().zip(ys.remainder()).map(|(p, q)| p * f64::from(*q)).sum();
        for (p, q) in xs.zip(ys) {
            for l in 0..8 {
                sums[l] += p[l] * f64::from(q[l]);
            }
        }
        sums.iter().sum::<f64>() + tail
    };
    let sums: Vec<f64> = a.par_chunks(CHUNK).zip(b.par_chunks(CHUNK)).with_min_len(4).map(partial).collect();
    sums.iter().sum()
}
