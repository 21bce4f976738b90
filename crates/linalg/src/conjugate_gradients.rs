//! Conjugate gradients in double precision, until the energy of the solution is known well enough.
//!
//! The preconditioner may work in double or in single precision ([`Operator::Precision`]), and the method
//! follows it:
//!
//! | preconditioner | residual it is given | next direction | step |
//! |---|---|---|---|
//! | `f64` | as it is | Fletcher and Reeves | r M^-1 r / p A p |
//! | `f32` | scaled to order one, since single precision has little range | Polak and Ribiere | r p / p A p |
//!
//! A preconditioner that rounds to single precision is not quite symmetric. The next direction is then made
//! conjugate with the change of the residual (Polak and Ribiere), which costs one inner product and keeps the
//! rate; and r p no longer equals r M^-1 r to all digits, so that it is computed. In exact arithmetic both
//! rows of the table are the same method.

use crate::gemm::Real;
use crate::reduction::dot;
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};

/// A symmetric positive definite operator on the free unknowns of an array, with a preconditioner; both keep
/// entries that are not unknowns at zero.
pub trait Operator {
    /// The precision of the preconditioner, `f32` or `f64`.
    type Precision: Precision;
    /// Number of entries of the array, those that are not unknowns included.
    fn unknowns(&self) -> usize;
    /// y = A x.
    fn apply(&mut self, x: &[f64], y: &mut [f64]);
    /// z = M^-1 r. In single precision r is of order one.
    fn precondition(&mut self, r: &[Self::Precision], z: &mut [Self::Precision]);

    /// y = A x for several x. Operators that read much for each product can do it faster than one by one.
    fn apply_to_all(&mut self, x: &[&[f64]], y: &mut [&mut [f64]]) {
        for (x, y) in x.iter().zip(y) {
            self.apply(x, y);
        }
    }

    /// z = M^-1 r for several r; see [`Operator::apply_to_all`].
    fn precondition_all(&mut self, r: &[&[Self::Precision]], z: &mut [&mut [Self::Precision]]) {
        for (r, z) in r.iter().zip(z) {
            self.precondition(r, z);
        }
    }
}

/// A precision of the preconditioner, and how the method follows it; see the [module](self).
pub trait Precision: Real {
    /// Whether the rounding of the preconditioner makes it asymmetric in double precision.
    const ROUNDED: bool;
    /// The divisor of `r` before the preconditioner is applied.
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
    /// Estimate of the energy of the remaining error: the larger of r M^-1 r and the decrease of the energy
    /// that further iterations would bring.
    pub energy_left: f64,
    /// Whether the goal was met.
    pub reached: bool,
}

/// When a solve stops.
#[derive(Debug, Clone, Copy)]
pub struct Goal<'a> {
    /// Largest estimated energy of the error, as a share of the energy reached.
    pub share: f64,
    /// Energy at x = 0, which every iteration lowers.
    pub start: f64,
    /// The largest number of iterations. A solve also ends after a fifteenth as many iterations in
    /// a row without progress.
    pub iteration_limit: usize,
    /// Set from outside to stop at once, short of the goal.
    pub cancel: Option<&'a AtomicBool>,
}

/// An iteration limit that solves with a good preconditioner stay far below. It is not tuned.
pub const ITERATION_LIMIT: usize = 300;

/// The iteration limit over the number of iterations in a row without progress after which a solve ends.
/// Progress is to lower the least r M^-1 r so far by a tenth. Not tuned: a limit that ordinary cases do not
/// reach.
const STALLED: usize = 15;

/// The least number of vector entries per task. Tuned: `cargo bench --bench solver`.
const TASK: usize = 16_384;

/// One right-hand side, and where its solution goes.
#[derive(Debug)]
pub struct System<'a> {
    /// The right-hand side.
    pub b: &'a [f64],
    /// Zero at first, then the solution.
    pub x: &'a mut [f64],
    /// Working memory, resized as needed; on return b - A x up to the drift of the recursion.
    pub r: &'a mut Vec<f64>,
    /// When the solve stops.
    pub goal: Goal<'a>,
}

/// Solves A x = b from `x` = 0; on return `r` is b - A x up to the drift of the recursion.
///
/// `b` and `x` have [`Operator::unknowns`] entries; `r` is working memory, resized as needed. Stops when the
/// goal is met, on request, after [`Goal::iteration_limit`] iterations, when r M^-1 r no longer falls, or
/// when it is negative or not finite. [`Convergence::reached`] says whether the goal was met.
pub fn solve<O: Operator>(
    op: &mut O,
    b: &[f64],
    x: &mut [f64],
    r: &mut Vec<f64>,
    goal: Goal<'_>,
) -> Convergence {
    let mut iteration = Iteration::new(op.unknowns(), System { b, x, r, goal });
    loop {
        if let Some(end) = step(op, &mut [&mut iteration])[0] {
            return end;
        }
    }
}

/// Solves several systems with one operator as [`solve`] does, with the same results, but iterates on all of
/// them at once.
pub fn solve_all<O: Operator>(op: &mut O, systems: Vec<System<'_>>) -> Vec<Convergence> {
    let n = op.unknowns();
    let mut states: Vec<Iteration<'_, O::Precision>> =
        systems.into_iter().map(|system| Iteration::new(n, system)).collect();
    let mut ends: Vec<Option<Convergence>> = vec![None; states.len()];
    while ends.contains(&None) {
        let running: Vec<usize> = (0..states.len()).filter(|k| ends[*k].is_none()).collect();
        let mut active: Vec<&mut Iteration<'_, O::Precision>> =
            states.iter_mut().zip(&ends).filter_map(|(state, end)| end.is_none().then_some(state)).collect();
        for (k, end) in running.into_iter().zip(step(op, &mut active)) {
            ends[k] = end;
        }
    }
    ends.into_iter().flatten().collect()
}

/// Does one iteration of several systems. Returns how each ended, `None` for those that go on.
fn step<O: Operator>(
    op: &mut O,
    states: &mut [&mut Iteration<'_, O::Precision>],
) -> Vec<Option<Convergence>> {
    let mut ends: Vec<Option<Convergence>> = states.iter_mut().map(|state| state.scale_residual()).collect();
    {
        let (mut r, mut z) = (Vec::new(), Vec::new());
        for (state, _) in states.iter_mut().zip(&ends).filter(|(_, end)| end.is_none()) {
            r.push(O::Precision::rounded(state.system.r, state.scale, &mut state.rounded));
            z.push(&mut state.z[..]);
        }
        op.precondition_all(&r, &mut z);
    }
    for (state, end) in states.iter_mut().zip(&mut ends).filter(|(_, end)| end.is_none()) {
        *end = state.choose_direction();
    }
    {
        let (mut p, mut q) = (Vec::new(), Vec::new());
        for (state, _) in states.iter_mut().zip(&ends).filter(|(_, end)| end.is_none()) {
            p.push(&state.p[..]);
            q.push(&mut state.q[..]);
        }
        op.apply_to_all(&p, &mut q);
    }
    for (state, end) in states.iter_mut().zip(&mut ends).filter(|(_, end)| end.is_none()) {
        *end = state.advance();
    }
    ends
}

/// The state of one system between iterations.
struct Iteration<'a, P> {
    system: System<'a>,
    /// The energy reached so far.
    energy: f64,
    /// The divisor of the residual before it is rounded.
    scale: f64,
    /// Memory for the residual over the scale, rounded.
    rounded: Vec<P>,
    /// M^-1 r over the scale.
    z: Vec<P>,
    /// The direction.
    p: Vec<f64>,
    /// A p, then the previous residual.
    q: Vec<f64>,
    /// r M^-1 r at the last direction.
    rz: f64,
    /// The least r M^-1 r so far.
    best: f64,
    /// The number of iterations in a row without progress.
    stalled: usize,
    /// The amount by which each iteration lowered the energy.
    steps: Vec<f64>,
}

impl<'a, P: Precision> Iteration<'a, P> {
    fn new(n: usize, system: System<'a>) -> Self {
        system.r.clear();
        system.r.extend_from_slice(system.b);
        Self {
            energy: system.goal.start,
            system,
            scale: 1.0,
            rounded: Vec::new(),
            z: vec![P::default(); n],
            p: vec![0.0; n],
            q: vec![0.0; n],
            rz: 0.0,
            best: f64::INFINITY,
            stalled: 0,
            steps: Vec::new(),
        }
    }

    /// Computes the scale of the residual, and ends the solve where the residual is zero or not finite.
    fn scale_residual(&mut self) -> Option<Convergence> {
        self.scale = P::scale(self.system.r);
        let ended = self.scale == 0.0 || !self.scale.is_finite();
        ended.then_some(Convergence {
            iterations: self.steps.len(),
            energy_left: self.scale,
            reached: self.scale == 0.0,
        })
    }

    /// Computes the next direction from the preconditioned residual, unless the solve ends here.
    fn choose_direction(&mut self) -> Option<Convergence> {
        let (iterations, goal, scale) = (self.steps.len(), self.system.goal, self.scale);
        let next: f64 = dot(self.system.r, &self.z) * scale;
        self.stalled = if next < 0.9 * self.best { 0 } else { self.stalled + 1 };
        self.best = self.best.min(next);
        // With a poor preconditioner r M^-1 r says little; the recent decrease of the energy is a second
        // estimate of the error.
        let coming = remaining(&self.steps);
        let enough = goal.share * self.energy.abs();
        let slow = coming > enough;
        let reached = next == 0.0 || (next <= enough && !slow);
        let cancelled = goal.cancel.is_some_and(|c| c.load(Ordering::Relaxed));
        if reached
            || cancelled
            || iterations >= goal.iteration_limit
            || self.stalled >= goal.iteration_limit / STALLED
            || !next.is_finite()
            || next < 0.0
        {
            return Some(Convergence { iterations, energy_left: next.max(coming), reached });
        }
        let beta = match (iterations, P::ROUNDED) {
            (0, _) => 0.0,
            // q is the previous residual.
            (_, true) => ((next - dot(&self.q, &self.z) * scale) / self.rz).max(0.0),
            (_, false) => next / self.rz,
        };
        let p = self.p.par_iter_mut().zip(&self.z).with_min_len(TASK);
        p.for_each(|(p, z)| *p = scale * z.to_f64() + beta * *p);
        self.rz = next;
        None
    }

    /// Takes the step along the direction `p`, with A p in `q`.
    fn advance(&mut self) -> Option<Convergence> {
        let (p, q, r) = (&self.p, &mut self.q, &mut self.system.r[..]);
        let along = if P::ROUNDED { dot(r, p) } else { self.rz };
        let alpha = along / dot(p, q);
        if !alpha.is_finite() {
            return Some(Convergence { iterations: self.steps.len(), energy_left: self.rz, reached: false });
        }
        let x = self.system.x.par_iter_mut();
        x.zip(r).zip(p.par_iter().zip(q)).with_min_len(TASK).for_each(|((x, r), (p, q))| {
            // q becomes the old residual, for the next direction.
            let old = *r;
            *x += alpha * p;
            *r -= alpha * *q;
            *q = old;
        });
        self.energy -= alpha * self.rz;
        self.steps.push(alpha * self.rz);
        None
    }
}

/// The decrease of the energy that further iterations would bring at the rate of the last few.
fn remaining(steps: &[f64]) -> f64 {
    // Iterations from which the rate is taken. Tuned: `cargo bench --bench solver`.
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

    /// The second difference on a line between two zeros, preconditioned by its diagonal in the precision
    /// `T`.
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
        // One iteration per unknown, and more because of rounding.
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
