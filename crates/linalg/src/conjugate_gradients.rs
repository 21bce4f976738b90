//! Conjugate gradients in double precision, until the energy of the solution is known well enough.
//!
//! The preconditioner may work in double or in single precision ([`Operator::Precision`]), and the method follows it:
//!
//! | preconditioner | residual it is given | next direction | step |
//! |---|---|---|---|
//! | `f64` | as it is | Fletcher and Reeves | r M^-1 r / p A p |
//! | `f32` | scaled to order one, since single precision has little range | Polak and Ribiere | r p / p A p |
//!
//! A preconditioner that rounds to single precision is not quite symmetric. The next direction is then made conjugate
//! with the change of the residual (Polak and Ribiere), which costs one inner product and keeps the rate; and r p is no
//! longer r M^-1 r to all digits, so that it is computed. In exact arithmetic both columns are the same.

use crate::gemm::Real;
use crate::reduction::dot;
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};

/// A symmetric positive definite operator on the free unknowns of an array, with a preconditioner; both keep entries
/// that are not unknowns at zero.
pub trait Operator {
    /// The precision of the preconditioner, `f32` or `f64`.
    type Precision: Precision;
    /// Entries of the array.
    fn unknowns(&self) -> usize;
    /// y = A x.
    fn apply(&mut self, x: &[f64], y: &mut [f64]);
    /// z = M^-1 r. In single precision r is of order one.
    fn precondition(&mut self, r: &[Self::Precision], z: &mut [Self::Precision]);
}

/// What the precision of a preconditioner asks of the method; see the [module](self).
pub trait Precision: Real {
    /// Whether the preconditioner is symmetric to double precision only up to its own rounding.
    const ROUNDED: bool;
    /// The factor that is taken out of `r` before it is given to the preconditioner.
    fn scale(r: &[f64]) -> f64;
    /// `r / scale` in this precision, in the memory of `rounded` if it needs any.
    fn rounded<'a>(r: &'a [f64], scale: f64, rounded: &'a mut Vec<Self>) -> &'a [Self];
}

impl Precision for f64 {
    const ROUNDED: bool = false;

    fn scale(_: &[f64]) -> f64 {
        1.0
    }

    fn rounded<'a>(r: &'a [f64], _: f64, _: &'a mut Vec<Self>) -> &'a [Self] {
        r
    }
}

impl Precision for f32 {
    const ROUNDED: bool = true;

    fn scale(r: &[f64]) -> f64 {
        dot(r, r).sqrt()
    }

    fn rounded<'a>(r: &'a [f64], scale: f64, rounded: &'a mut Vec<Self>) -> &'a [Self] {
        rounded.resize(r.len(), 0.0);
        rounded.par_iter_mut().zip(r).with_min_len(TASK).for_each(|(s, r)| *s = (r / scale) as f32);
        rounded
    }
}

/// How a solve ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Convergence {
    /// Iterations taken.
    pub iterations: usize,
    /// Estimate of the squared energy of the error that is left: r M^-1 r, or what the coming iterations would take off
    /// the energy if that is more.
    pub energy_left: f64,
    /// Whether the goal was met.
    pub reached: bool,
}

/// When to stop.
#[derive(Debug, Clone, Copy)]
pub struct Goal<'a> {
    /// Largest squared energy of the error, as estimated, over the energy reached.
    pub share: f64,
    /// Energy at x = 0, from which every iteration takes its part off.
    pub start: f64,
    /// Iterations before giving up; without progress a fifteenth of them, see [`solve`].
    pub iteration_limit: usize,
    /// Set from outside to stop at once, short of the goal.
    pub cancel: Option<&'a AtomicBool>,
}

/// A limit of iterations that a good preconditioner is far from reaching.
pub const ITERATION_LIMIT: usize = 300;

/// The share of the limit after which iterations in a row without a fall of r M^-1 r by a tenth of its least are given up.
const STALLED: usize = 15;

/// Entries of a vector that one thread takes at least.
const TASK: usize = 16_384;

/// Solves A x = b from `x` = 0; on return `r` is b - A x up to the drift of the recursion.
///
/// `b` and `x` have [`Operator::unknowns`] entries; `r` is memory and takes what it needs. Stops when the goal is met,
/// on request, after [`Goal::iteration_limit`] iterations, when r M^-1 r no longer falls, or when it is negative or not finite:
/// [`Convergence::reached`] tells.
pub fn solve<O: Operator>(
    op: &mut O,
    b: &[f64],
    x: &mut [f64],
    r: &mut Vec<f64>,
    goal: Goal<'_>,
) -> Convergence {
    let n = op.unknowns();
    r.clear();
    r.extend_from_slice(b);
    let mut energy = goal.start;
    let (mut rounded, mut z) = (Vec::new(), vec![O::Precision::default(); n]);
    let (mut p, mut q) = (vec![0f64; n], vec![0f64; n]);
    let (mut rz, mut best, mut stalled) = (0.0, f64::INFINITY, 0);
    // What each iteration took off the energy.
    let mut steps: Vec<f64> = Vec::new();
    loop {
        let iterations = steps.len();
        let scale = O::Precision::scale(r);
        if scale == 0.0 || !scale.is_finite() {
            return Convergence { iterations, energy_left: scale, reached: scale == 0.0 };
        }
        op.precondition(O::Precision::rounded(r, scale, &mut rounded), &mut z);
        let next: f64 = dot(r, &z) * scale;
        stalled = if next < 0.9 * best { 0 } else { stalled + 1 };
        best = best.min(next);
        // With a poor preconditioner r M^-1 r says little: what is left also shows in how slowly the energy falls.
        let coming = remaining(&steps);
        let enough = goal.share * energy.abs();
        let slow = coming > enough;
        let reached = next == 0.0 || (next <= enough && !slow);
        let cancelled = goal.cancel.is_some_and(|c| c.load(Ordering::Relaxed));
        if reached
            || cancelled
            || iterations >= goal.iteration_limit
            || stalled >= goal.iteration_limit / STALLED
            || !next.is_finite()
            || next < 0.0
        {
            return Convergence { iterations, energy_left: next.max(coming), reached };
        }
        let beta = match (iterations, O::Precision::ROUNDED) {
            (0, _) => 0.0,
            // q is the residual of before.
            (_, true) => ((next - dot(&q, &z) * scale) / rz).max(0.0),
            (_, false) => next / rz,
        };
        p.par_iter_mut().zip(&z).with_min_len(TASK).for_each(|(p, z)| *p = scale * z.to_f64() + beta * *p);
        rz = next;
        op.apply(&p, &mut q);
        let along = if O::Precision::ROUNDED { dot(r, &p) } else { rz };
        let alpha = along / dot(&p, &q);
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
    }
}

/// Energy that the coming iterations will take off if it goes on falling as over the last few.
fn remaining(steps: &[f64]) -> f64 {
    const WINDOW: usize = 4;
    let n = steps.len();
    if n <= WINDOW {
        return 0.0;
    }
    let rate = (steps[n - 1] / steps[n - 1 - WINDOW]).powf(1.0 / WINDOW as f64).clamp(0.0, 0.99);
    steps[n - 1] * rate / (1.0 - rate)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The second difference on a line between two zeros, preconditioned by its diagonal in the precision `T`.
    struct Chain<T>(usize, std::marker::PhantomData<T>);

    impl<T: Precision> Operator for Chain<T> {
        type Precision = T;
        fn unknowns(&self) -> usize {
            self.0
        }
        fn apply(&mut self, x: &[f64], y: &mut [f64]) {
            let at = |k: usize| x.get(k).copied().unwrap_or(0.0);
            for k in 0..self.0 {
                y[k] = 2.0 * x[k] - at(k + 1) - at(k.wrapping_sub(1));
            }
        }
        fn precondition(&mut self, r: &[T], z: &mut [T]) {
            r.iter().zip(z).for_each(|(r, z)| *z = *r * T::from_f64(0.5));
        }
    }

    fn check<T: Precision>(size: f64) {
        let n = 24;
        let mut chain = Chain::<T>(n, std::marker::PhantomData);
        let exact: Vec<f64> = (0..n).map(|k| size * (k as f64 * 0.7).sin()).collect();
        let mut b = vec![0.0; n];
        chain.apply(&exact, &mut b);
        let (mut x, mut r) = (vec![0.0; n], Vec::new());
        let goal = Goal {
            share: 1e-24,
            start: 2.0 * dot(&exact, &b),
            iteration_limit: ITERATION_LIMIT,
            cancel: None,
        };
        let end = solve(&mut chain, &b, &mut x, &mut r, goal);
        // As many as there are unknowns, and more for rounding.
        let most = if T::ROUNDED { 3 * n } else { n + 8 };
        assert!(end.reached && end.iterations <= most, "{end:?}");
        assert!(x.iter().zip(&exact).all(|(a, b)| (a - b).abs() < 1e-10 * size));
    }

    #[test]
    fn a_chain_is_solved_in_about_as_many_iterations_as_it_has_links() {
        check::<f64>(1.0);
        check::<f32>(1.0);
    }

    #[test]
    fn a_preconditioner_in_single_precision_serves_for_numbers_beyond_its_range() {
        check::<f32>(1e-100);
        check::<f32>(1e100);
    }

    #[test]
    fn nothing_is_to_be_done_for_a_right_hand_side_of_zeros() {
        for end in [
            solve(
                &mut Chain::<f64>(5, std::marker::PhantomData),
                &[0.0; 5],
                &mut [0.0; 5],
                &mut Vec::new(),
                Goal { share: 1e-9, start: 1.0, iteration_limit: ITERATION_LIMIT, cancel: None },
            ),
            solve(
                &mut Chain::<f32>(5, std::marker::PhantomData),
                &[0.0; 5],
                &mut [0.0; 5],
                &mut Vec::new(),
                Goal { share: 1e-9, start: 1.0, iteration_limit: ITERATION_LIMIT, cancel: None },
            ),
        ] {
            assert_eq!(end, Convergence { iterations: 0, energy_left: 0.0, reached: true });
        }
    }

    #[test]
    fn a_request_to_stop_and_a_number_that_is_none_end_it_short_of_the_goal() {
        let stop = AtomicBool::new(true);
        for (first, cancel) in [(1.0, Some(&stop)), (f64::NAN, None)] {
            let mut b = [1.0; 5];
            b[0] = first;
            let goal = Goal { share: 1e-9, start: 1.0, iteration_limit: ITERATION_LIMIT, cancel };
            let end = solve(
                &mut Chain::<f64>(5, std::marker::PhantomData),
                &b,
                &mut [0.0; 5],
                &mut Vec::new(),
                goal,
            );
            assert!(!end.reached && end.iterations == 0);
        }
    }
}
