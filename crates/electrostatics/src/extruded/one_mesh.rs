//! Both problems of one parity on one mesh.

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

/// The residual that a repair leaves adds to its energy by this many times the share that is left, at most: a generous allowance.
const LEFT_IN_ENERGY: f64 = 1e3;

/// Right-hand sides that are iterated on at once: factors are then read from memory once for all of them. More gain little and take
/// memory.
pub(super) const TOGETHER: usize = 4;

/// A mesh with what holds at its ends, and the degree of the functions on it.
#[derive(Debug)]
pub(super) struct Problem<'a> {
    pub mesh: &'a PlanMesh,
    pub axis: &'a Axis,
    pub walls: [[Wall; 2]; 2],
    pub degree: usize,
    /// Where rays begin; `None` in a closed scene.
    pub radius: Option<f64>,
    pub cancel: Option<&'a AtomicBool>,
}

/// Energies V^T C V, per eps0 and in the scale of the mesh, of some right-hand sides.
#[derive(Debug)]
pub(super) struct Energies {
    pub matrix: Mat<f64>,
    pub unknowns: usize,
    /// The largest number that a right-hand side took.
    pub iterations: usize,
    /// Whether the linear solver reached its goal for every right-hand side.
    pub converged: bool,
    /// Largest share of an energy by which the repair lowers it (lower bounds only).
    pub repair_share: f64,
    /// Seconds assembling and seconds solving.
    pub seconds: [f64; 2],
}

impl Problem<'_> {
    fn stop_if_asked(&self) -> Result<(), SolveError> {
        if self.cancel.is_some_and(|c| c.load(Ordering::Relaxed)) {
            Err(SolveError::Cancelled)
        } else {
            Ok(())
        }
    }

    fn goal(&self, share: f64, start: f64) -> Goal<'_> {
        Goal { share, start, iteration_limit: ITERATION_LIMIT, cancel: self.cancel }
    }

    /// Energies that are too large; `potentials` are those of the conductors for each right-hand side. The linear solver stops when its
    /// error is about `share` of the energy.
    pub(super) fn upper(
        &self,
        potentials: &[Vec<f64>],
        share: f64,
    ) -> Result<(Energies, Primal, Vec<Vec<f64>>), SolveError> {
        let begin = Instant::now();
        let mut primal = Primal::new(self.mesh, self.axis, &self.walls, self.degree, self.radius)?;
        let assembled = Instant::now();
        self.stop_if_asked()?;
        let (mut iterations, mut converged) = (0, true);
        let (mut found, mut images): (Vec<Vec<f64>>, Vec<Vec<f64>>) = (Vec::new(), Vec::new());
        for together in potentials.chunks(TOGETHER) {
            let lifts: Vec<Vec<f64>> = together.iter().map(|v| primal.lift(v)).collect();
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
            self.stop_if_asked()?;
            for (mut u, lift) in u.into_iter().zip(&lifts) {
                u.iter_mut().zip(lift).for_each(|(u, l)| *u += l);
                images.push(primal.full_product(&u));
                found.push(u);
            }
        }
        let n = found.len();
        let mut matrix = Mat::zeros(n, n);
        for i in 0..n {
            for j in 0..=i {
                let energy = 0.5 * (dot(&found[i], &images[j]) + dot(&found[j], &images[i]));
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
        Ok((energies, primal, found))
    }

    /// Energies that are too small.
    pub(super) fn lower(&self, potentials: &[Vec<f64>], share: f64) -> Result<Energies, SolveError> {
        let begin = Instant::now();
        let mut dual = Dual::new(self.mesh, self.axis, &self.walls, self.degree, self.radius)?;
        let assembled = Instant::now();
        self.stop_if_asked()?;
        let mut fluxes: Vec<Flux> = Vec::new();
        for together in potentials.chunks(TOGETHER) {
            fluxes.extend(self.fluxes(&mut dual, together, share)?);
        }
        let n = potentials.len();
        // The share of the energy that is left may be larger than that of the residual.
        let left = fluxes.iter().map(|f| f.left).fold(0.0, f64::max);
        let excess = dual.repair_excess() * (1.0 + LEFT_IN_ENERGY * left);
        let solutions: Vec<&[f64]> = fluxes.iter().map(|f| f.potential.as_slice()).collect();
        let mut matrix = dual.energies(self.mesh, &solutions, potentials);
        let mut repair_share = 0.0_f64;
        for (i, own) in fluxes.iter().enumerate() {
            repair_share = repair_share.max(excess * dot(&own.repair, &own.residual) / matrix[(i, i)]);
            for (j, other) in fluxes.iter().enumerate() {
                matrix[(i, j)] -=
                    excess * 0.5 * (dot(&own.repair, &other.residual) + dot(&other.repair, &own.residual));
            }
        }
        // Where the repair failed, that no energy is negative is all that is proved.
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

    /// Iterates until the energies of the repairs are small compared with `share` of the energies, or further iterations gain little.
    fn fluxes(&self, dual: &mut Dual, potentials: &[Vec<f64>], share: f64) -> Result<Vec<Flux>, SolveError> {
        let excess = dual.repair_excess();
        let mut all: Vec<Refined> = potentials
            .iter()
            .map(|v| {
                let b = dual.source(v);
                let x = vec![0.0; b.len()];
                let start = dual.energies(self.mesh, &[&x], std::slice::from_ref(v))[(0, 0)];
                Refined {
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
        while all.iter().any(|own| own.flux.is_none()) {
            let running: Vec<usize> = (0..all.len()).filter(|k| all[*k].flux.is_none()).collect();
            let sources: Vec<Vec<f64>> = running.iter().map(|k| std::mem::take(&mut all[*k].r)).collect();
            let goals = running.iter().map(|k| self.goal(all[*k].goal, all[*k].start)).collect();
            let mut steps: Vec<Vec<f64>> = sources.iter().map(|r| vec![0.0; r.len()]).collect();
            let ends = solve_together(dual, &sources, &mut steps, goals);
            self.stop_if_asked()?;
            for (((k, mut r), step), end) in running.into_iter().zip(sources).zip(steps).zip(ends) {
                let own = &mut all[k];
                own.iterations += end.iterations;
                own.x.iter_mut().zip(&step).for_each(|(x, s)| *x += s);
                // The recursion's residual drifts by rounding; the bound rests on the true one.
                dual.true_residual(&own.b, &own.x, &mut r);
                dual.balance(&mut own.x, &mut r);
                let (repair, left) = dual.repair(&r);
                let energy =
                    dual.energies(self.mesh, &[&own.x], std::slice::from_ref(&potentials[k]))[(0, 0)];
                let cost = excess * dot(&repair, &r) / energy;
                let proved = left < 1e-3 && cost >= 0.0;
                let cheap = cost <= 20.0 * share;
                let gains_little = cost > 0.5 * own.last;
                if !proved || cheap || gains_little || own.iterations > ITERATION_LIMIT {
                    let potential = std::mem::take(&mut own.x);
                    let iterations = own.iterations;
                    let converged = proved && (end.reached || cheap);
                    own.flux =
                        Some(Flux { potential, residual: r, repair, left, proved, converged, iterations });
                } else {
                    own.start = energy;
                    (own.last, own.goal) = (cost, own.goal * (share / cost).clamp(1e-6, 0.1));
                    own.r = r;
                }
            }
        }
        Ok(all.into_iter().filter_map(|own| own.flux).collect())
    }
}

/// Solves with several right-hand sides at once.
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

/// A flux on its way to a small repair.
struct Refined {
    b: Vec<f64>,
    x: Vec<f64>,
    /// b - A x.
    r: Vec<f64>,
    /// Energy reached.
    start: f64,
    /// Share of it at which the iterations stop.
    goal: f64,
    /// The cost of the last repair.
    last: f64,
    iterations: usize,
    flux: Option<Flux>,
}

/// The solution of the lower problem for one right-hand side.
struct Flux {
    potential: Vec<f64>,
    /// The divergence that the fluxes still have.
    residual: Vec<f64>,
    /// The potential of the flux that cancels the residual.
    repair: Vec<f64>,
    /// The share of the residual that it does not cancel.
    left: f64,
    /// Whether it does, so that the energy is a bound.
    proved: bool,
    converged: bool,
    iterations: usize,
}
