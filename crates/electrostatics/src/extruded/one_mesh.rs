//! The upper and the lower problem of one mirror parity, on one mesh.

use super::dual::Dual;
use super::mesh::PlanMesh;
use super::primal::Primal;
use crate::boxes::domain::Axis;
use crate::error::SolveError;
use elastocap_fem::tensor::dot;
use elastocap_geometry::scene::Wall;
use elastocap_linalg::conjugate_gradients::{
    Convergence, Goal, ITERATION_LIMIT, Operator, System, solve_all,
};
use faer::Mat;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Safety allowance: a repair that leaves the share s of the residual counts with 1 + 1000 s times its
/// energy. A repair that meets its goal of 1e-6 counts a thousandth more.
const RESIDUAL_ALLOWANCE: f64 = 1e3;

/// Right-hand sides per batch of the linear solver, which reads its factors from memory once per batch.
/// Larger batches gain little and take memory. Tuned: `benches/outlines.py pattern guarded-disc`.
pub(super) const BATCH_SIZE: usize = 4;

/// A mesh with its boundary conditions, and the degree of the functions on it.
#[derive(Debug)]
pub(super) struct Problem<'a> {
    /// The mesh of the plan.
    pub mesh: &'a PlanMesh,
    /// The elements along the axis, and the walls at its ends.
    pub axis: &'a Axis,
    /// For each coordinate of the plan the walls on the lower and on the upper side.
    pub walls: [[Wall; 2]; 2],
    /// Degree of the polynomials on triangles.
    pub degree: usize,
    /// Distance from the origin at which rays begin; `None` where there are none.
    pub radius: Option<f64>,
    /// Set from outside to stop the solve.
    pub cancel: Option<&'a AtomicBool>,
}

/// Energies V^T C V of some right-hand sides, over eps0 and in units of the mesh.
#[derive(Debug)]
pub(super) struct Energies {
    /// The energies of all pairs of right-hand sides.
    pub matrix: Mat<f64>,
    /// The number of unknowns.
    pub unknowns: usize,
    /// Largest number of iterations that a right-hand side took.
    pub iterations: usize,
    /// Whether the linear solver reached its goal for every right-hand side.
    pub converged: bool,
    /// Largest share of an energy by which the repair lowers it (lower bounds only).
    pub repair_share: f64,
    /// Seconds of the assembly and of the solution.
    pub seconds: [f64; 2],
}

impl Problem<'_> {
    /// Ends the solve if a stop was requested.
    fn stop_if_cancelled(&self) -> Result<(), SolveError> {
        if self.cancel.is_some_and(|c| c.load(Ordering::Relaxed)) {
            Err(SolveError::Cancelled)
        } else {
            Ok(())
        }
    }

    /// The goal of the linear solver for an error of `share` of the energy, which is `start` at first.
    fn goal(&self, share: f64, start: f64) -> Goal<'_> {
        Goal { share, start, iteration_limit: ITERATION_LIMIT, cancel: self.cancel }
    }

    /// Upper bounds on the energies, with the problem and its solutions; `potentials` are those of the
    /// conductors for each right-hand side. The linear solver stops when its error is about `share` of the
    /// energy.
    pub(super) fn upper(
        &self,
        potentials: &[Vec<f64>],
        share: f64,
    ) -> Result<(Energies, Primal, Vec<Vec<f64>>), SolveError> {
        let begin = Instant::now();
        let mut primal = Primal::new(self.mesh, self.axis, &self.walls, self.degree, self.radius)?;
        let assembled = Instant::now();
        self.stop_if_cancelled()?;
        let (mut iterations, mut converged) = (0, true);
        let (mut solutions, mut images): (Vec<Vec<f64>>, Vec<Vec<f64>>) = (Vec::new(), Vec::new());
        for batch in potentials.chunks(BATCH_SIZE) {
            let lifts: Vec<Vec<f64>> = batch.iter().map(|v| primal.lift(v)).collect();
            let (sources, goals): (Vec<Vec<f64>>, Vec<Goal<'_>>) = lifts
                .iter()
                .map(|lift| {
                    let mut source = primal.full_product(lift);
                    let start = dot(lift, &source);
                    primal.clear_held(&mut source);
                    source.iter_mut().for_each(|x| *x = -*x);
                    (source, self.goal(share, start))
                })
                .unzip();
            let mut u: Vec<Vec<f64>> = sources.iter().map(|source| vec![0.0; source.len()]).collect();
            let ends = solve_together(&mut primal, &sources, &mut u, goals);
            iterations = ends.iter().map(|end| end.iterations).fold(iterations, usize::max);
            converged &= ends.iter().all(|end| end.reached);
            self.stop_if_cancelled()?;
            for (mut u, lift) in u.into_iter().zip(&lifts) {
                u.iter_mut().zip(lift).for_each(|(u, l)| *u += l);
                images.push(primal.full_product(&u));
                solutions.push(u);
            }
        }
        let n = solutions.len();
        let mut matrix = Mat::zeros(n, n);
        for i in 0..n {
            for j in 0..=i {
                let energy = 0.5 * (dot(&solutions[i], &images[j]) + dot(&solutions[j], &images[i]));
                (matrix[(i, j)], matrix[(j, i)]) = (energy, energy);
            }
        }
        let energies = Energies {
            matrix,
            unknowns: primal.unknowns(),
            iterations,
            converged,
            repair_share: 0.0,
            seconds: [(assembled - begin).as_secs_f64(), assembled.elapsed().as_secs_f64()],
        };
        Ok((energies, primal, solutions))
    }

    /// Lower bounds on the energies, with the arguments of [`Problem::upper`].
    pub(super) fn lower(&self, potentials: &[Vec<f64>], share: f64) -> Result<Energies, SolveError> {
        let begin = Instant::now();
        let mut dual = Dual::new(self.mesh, self.axis, &self.walls, self.degree, self.radius)?;
        let assembled = Instant::now();
        self.stop_if_cancelled()?;
        let mut fluxes: Vec<Flux> = Vec::new();
        for batch in potentials.chunks(BATCH_SIZE) {
            fluxes.extend(self.fluxes(&mut dual, batch, share)?);
        }
        let n = potentials.len();
        // A repair may leave a larger share of the energy than of the residual.
        let left = fluxes.iter().map(|f| f.left).fold(0.0, f64::max);
        let excess = dual.repair_excess() * (1.0 + RESIDUAL_ALLOWANCE * left);
        let solutions: Vec<&[f64]> = fluxes.iter().map(|f| f.potential.as_slice()).collect();
        let mut matrix = dual.energies(self.mesh, &solutions, potentials);
        let mut repair_share = 0.0_f64;
        for (i, flux) in fluxes.iter().enumerate() {
            repair_share = repair_share.max(excess * dot(&flux.repair, &flux.residual) / matrix[(i, i)]);
            for (j, other) in fluxes.iter().enumerate() {
                matrix[(i, j)] -=
                    excess * 0.5 * (dot(&flux.repair, &other.residual) + dot(&other.repair, &flux.residual));
            }
        }
        // Without a repair, zero is the only proved lower bound.
        if fluxes.iter().any(|flux| !flux.proved) {
            matrix = Mat::zeros(n, n);
        }
        Ok(Energies {
            matrix,
            unknowns: dual.unknowns(),
            iterations: fluxes.iter().map(|f| f.iterations).max().unwrap_or(0),
            converged: fluxes.iter().all(|f| f.converged),
            repair_share,
            seconds: [(assembled - begin).as_secs_f64(), assembled.elapsed().as_secs_f64()],
        })
    }

    /// The solutions of the lower problem for these potentials of the conductors. Iterates until the energy
    /// of each repair is at most 20 times `share` of the energy, or further iterations gain little.
    fn fluxes(&self, dual: &mut Dual, potentials: &[Vec<f64>], share: f64) -> Result<Vec<Flux>, SolveError> {
        let excess = dual.repair_excess();
        let mut states: Vec<FluxIteration> = potentials
            .iter()
            .map(|v| {
                let b = dual.source(v);
                let x = vec![0.0; b.len()];
                let start = dual.energies(self.mesh, &[&x], std::slice::from_ref(v))[(0, 0)];
                FluxIteration {
                    r: b.clone(),
                    x,
                    b,
                    start,
                    goal: share,
                    last: f64::INFINITY,
                    iterations: 0,
                    flux: None,
                }
            })
            .collect();
        while states.iter().any(|state| state.flux.is_none()) {
            let running: Vec<usize> = (0..states.len()).filter(|k| states[*k].flux.is_none()).collect();
            let sources: Vec<Vec<f64>> = running.iter().map(|k| std::mem::take(&mut states[*k].r)).collect();
            let goals = running.iter().map(|k| self.goal(states[*k].goal, states[*k].start)).collect();
            let mut steps: Vec<Vec<f64>> = sources.iter().map(|r| vec![0.0; r.len()]).collect();
            let ends = solve_together(dual, &sources, &mut steps, goals);
            self.stop_if_cancelled()?;
            for (((k, mut r), step), end) in running.into_iter().zip(sources).zip(steps).zip(ends) {
                let state = &mut states[k];
                state.iterations += end.iterations;
                state.x.iter_mut().zip(&step).for_each(|(x, s)| *x += s);
                // The recursion's residual drifts by rounding; the bound rests on the true one.
                dual.true_residual(&state.b, &state.x, &mut r);
                dual.balance(&mut state.x, &mut r);
                let (repair, left) = dual.repair(&r);
                let energy =
                    dual.energies(self.mesh, &[&state.x], std::slice::from_ref(&potentials[k]))[(0, 0)];
                let cost = excess * dot(&repair, &r) / energy;
                let proved = left < 1e-3 && cost >= 0.0;
                let cheap = cost <= 20.0 * share;
                let gains_little = cost > 0.5 * state.last;
                if !proved || cheap || gains_little || state.iterations > ITERATION_LIMIT {
                    let potential = std::mem::take(&mut state.x);
                    let iterations = state.iterations;
                    let converged = proved && (end.reached || cheap);
                    state.flux =
                        Some(Flux { potential, residual: r, repair, left, proved, converged, iterations });
                } else {
                    state.start = energy;
                    (state.last, state.goal) = (cost, state.goal * (share / cost).clamp(1e-6, 0.1));
                    state.r = r;
                }
            }
        }
        Ok(states.into_iter().filter_map(|state| state.flux).collect())
    }
}

/// Solves with several right-hand sides `b` at once, from `x` = 0.
fn solve_together<O: Operator>(
    operator: &mut O,
    b: &[Vec<f64>],
    x: &mut [Vec<f64>],
    goals: Vec<Goal<'_>>,
) -> Vec<Convergence> {
    let mut residuals = vec![Vec::new(); b.len()];
    let systems = b.iter().zip(x).zip(&mut residuals).zip(goals);
    solve_all(operator, systems.map(|(((b, x), r), goal)| System { b, x, r, goal }).collect())
}

/// The iteration for one flux, until its repair is cheap.
struct FluxIteration {
    /// The right-hand side.
    b: Vec<f64>,
    /// The solution so far.
    x: Vec<f64>,
    /// b - A x.
    r: Vec<f64>,
    /// Energy of the current flux.
    start: f64,
    /// Share of that energy at which the linear solver stops.
    goal: f64,
    /// Energy of the last repair, as a share of that of the flux.
    last: f64,
    iterations: usize,
    /// The result, once the iteration has ended.
    flux: Option<Flux>,
}

/// The solution of the lower problem for one right-hand side.
struct Flux {
    /// The potential from which the flux follows.
    potential: Vec<f64>,
    /// The divergence left by the linear solver.
    residual: Vec<f64>,
    /// The potential of the flux that cancels the residual.
    repair: Vec<f64>,
    /// Share of the residual that the repair does not cancel.
    left: f64,
    /// Whether the repair cancels the residual, so that the energy is a bound.
    proved: bool,
    /// Whether there is a repair, and the linear solver met its goal or the repair is cheap.
    converged: bool,
    iterations: usize,
}
