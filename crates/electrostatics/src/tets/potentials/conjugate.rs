//! Conjugate gradients in double precision, until the energy is known well enough.

use super::multigrid::Multigrid;
use elastocap_fem::tensor::dot;
use elastocap_linalg::conjugate_gradients::{Convergence, Goal, ITERATION_LIMIT, remaining};
use rayon::prelude::*;
use std::sync::atomic::Ordering;

/// Solves A x = b from x = 0 with one multigrid cycle per step.
pub(super) fn solve(grid: &Multigrid, b: &[f64], x: &mut [f64], goal: Goal<'_>) -> Convergence {
    const TASK: usize = 16_384;
    let n = b.len();
    let mut r = b.to_vec();
    let (mut z, mut p, mut q) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    let mut work = grid.work();
    let (mut energy, mut before, mut best, mut stalled) = (goal.start, 0.0, f64::INFINITY, 0);
    // What each step took off the energy.
    let mut steps: Vec<f64> = Vec::new();
    loop {
        grid.apply(&r, &mut z, &mut work);
        let rz = dot(&r, &z);
        let iterations = steps.len();
        stalled = if rz < 0.9 * best { 0 } else { stalled + 1 };
        best = best.min(rz);
        // With a poor preconditioner r M^-1 r says little: what is left also shows in how slowly the energy falls.
        let left = rz.max(remaining(&steps));
        let reached = rz == 0.0 || left <= goal.share * energy.abs();
        let cancelled = goal.cancel.is_some_and(|c| c.load(Ordering::Relaxed));
        let stop = reached || cancelled || iterations >= ITERATION_LIMIT || stalled >= 20;
        if stop || !rz.is_finite() || rz < 0.0 {
            return Convergence { iterations, energy_left: left, reached };
        }
        let beta = if iterations == 0 { 0.0 } else { rz / before };
        p.par_iter_mut().zip(&z).with_min_len(TASK).for_each(|(p, z)| *p = z + beta * *p);
        before = rz;
        grid.matrix().product(&p, &mut q, |product, _| product);
        let alpha = rz / dot(&p, &q);
        if !alpha.is_finite() {
            return Convergence { iterations, energy_left: rz, reached: false };
        }
        x.par_iter_mut().zip(&mut r).zip(p.par_iter().zip(&q)).with_min_len(TASK).for_each(
            |((x, r), (p, q))| {
                *x += alpha * p;
                *r -= alpha * q;
            },
        );
        energy -= alpha * rz;
        steps.push(alpha * rz);
    }
}
