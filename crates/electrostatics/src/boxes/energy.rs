//! Energy matrices of one part on one grid: upper bounds by the primal problem (Dirichlet's principle), lower
//! ones by the dual problem (Thomson's principle).

use crate::boxes::domain::Domain;
use crate::boxes::dual::Dual;
use crate::boxes::dual::across_grids::{Fluxes, State};
use crate::boxes::energies::Energies;
use crate::boxes::half_turn::images::Image;
use crate::boxes::primal::Primal;
use crate::error::{SolveError, stop_if_cancelled};
use elastocap_fem::tensor::{add, dot};
use elastocap_linalg::conjugate_gradients::{self, Operator};
use faer::Mat;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// A source of potentials other than the conductors: the solution u minimises u A u - 2 u B p, with A the
/// operator of the domain, p the potential in `pull`, and B the operator without the domain's map.
pub(crate) struct Drive<'a> {
    /// The potentials p, one for each right-hand side.
    pub(crate) pull: &'a [Vec<f64>],
    /// The products B p, where B has another permittivity than the domain.
    pub(crate) products: Option<&'a [Vec<f64>]>,
    /// Energies to be added, one for each right-hand side: the linear solver's error is measured against the
    /// sum.
    pub(crate) energies: &'a [f64],
}

/// Initial guess of the iteration for a right-hand side.
#[derive(Debug)]
pub(crate) enum Start {
    /// Zero.
    Nothing,
    /// Coefficients of a potential near the solution; those on conductors do not matter.
    Potential(Vec<f64>),
    /// The turned solution of an earlier right-hand side.
    Image(Image),
}

/// Upper energies by Dirichlet's principle, with a start for each right-hand side; the iteration stops when
/// its error is about `share` of the energy.
pub(crate) fn upper(
    domain: &Domain,
    potentials: &[Vec<f64>],
    starts: &[Start],
    driven: Option<&Drive<'_>>,
    share: f64,
    cancel: Option<&AtomicBool>,
) -> Result<(Energies, Primal), SolveError> {
    let started = Instant::now();
    let mut primal = Primal::new(domain)?;
    let assembled = Instant::now();
    stop_if_cancelled(cancel)?;
    let mut coefficients: Vec<Vec<f64>> = Vec::new();
    let (mut iterations, mut converged) = (0, true);
    let mut residual = Vec::new();
    let pulled: Vec<Vec<f64>> = match driven {
        Some(Drive { products: Some(products), .. }) => products.to_vec(),
        Some(drive) => drive.pull.iter().map(|p| primal.straight_product(p)).collect(),
        None => Vec::new(),
    };
    for (k, (v, start)) in potentials.iter().zip(starts).enumerate() {
        let mut begin = primal.lift(v);
        let near = match start {
            Start::Nothing => None,
            Start::Potential(u) => Some(u.clone()),
            Start::Image(image) => Some(image.of_potential(domain, &coefficients[image.original])),
        };
        if let Some(mut free) = near {
            primal.clear_prescribed(&mut free);
            begin.iter_mut().zip(&free).for_each(|(b, f)| *b += f);
        }
        let mut source = primal.full_product(&begin);
        let mut start = dot(&begin, &source);
        if let (Some(pulled_source), Some(drive)) = (pulled.get(k), driven) {
            start += drive.energies.get(k).copied().unwrap_or(0.0) + dot(&drive.pull[k], pulled_source)
                - 2.0 * dot(&begin, pulled_source);
            source.iter_mut().zip(pulled_source).for_each(|(s, p)| *s -= p);
        }
        primal.clear_prescribed(&mut source);
        source.iter_mut().for_each(|x| *x = -*x);
        let mut u = vec![0.0; source.len()];
        let iteration_limit = primal.iteration_limit();
        let goal = |start: f64| conjugate_gradients::Goal { share, start, iteration_limit, cancel };
        let c = conjugate_gradients::solve(&mut primal, &source, &mut u, &mut residual, goal(start));
        iterations += c.iterations;
        let mut reached = c.reached;
        if !reached && c.iterations < iteration_limit {
            // Rounding may have separated the recursion from the true residual: solve once more, from the
            // true one.
            let mut image = vec![0.0; u.len()];
            primal.apply(&u, &mut image);
            let rest: Vec<f64> = source.iter().zip(&image).map(|(b, a)| b - a).collect();
            let energy = start - 2.0 * dot(&source, &u) + dot(&u, &image);
            let mut step = vec![0.0; u.len()];
            let c = conjugate_gradients::solve(&mut primal, &rest, &mut step, &mut residual, goal(energy));
            iterations += c.iterations;
            reached = c.reached;
            u.iter_mut().zip(&step).for_each(|(u, s)| *u += s);
        }
        converged &= reached;
        stop_if_cancelled(cancel)?;
        u.iter_mut().zip(&begin).for_each(|(u, b)| *u += b);
        coefficients.push(u);
    }
    // Summed from products of gradients, free of the cancellation in u A u. The factor covers the rounding of
    // the sums, so that the energies stay upper bounds.
    let mut matrix = primal.energies(&coefficients)?;
    let n = coefficients.len();
    for i in 0..n {
        matrix[(i, i)] *= 1.0 + 64.0 * f64::EPSILON * n as f64;
    }
    let energies = Energies {
        matrix,
        unknowns: primal.unknowns(),
        iterations,
        converged,
        repair_share: 0.0,
        coefficients,
        with_error_of_base: None,
        seconds: [(assembled - started).as_secs_f64(), assembled.elapsed().as_secs_f64()],
    };
    Ok((energies, primal))
}

/// Lower energies by Thomson's principle. The linear solver leaves a small divergence; a second flux cancels
/// it exactly, and the bound includes its energy. The fluxes are returned too, if `keep_fluxes` is set and
/// they are proved.
pub(crate) fn lower(
    domain: &Domain,
    potentials: &[Vec<f64>],
    starts: &[Start],
    share: f64,
    keep_fluxes: bool,
    cancel: Option<&AtomicBool>,
) -> Result<(Energies, Option<Fluxes>), SolveError> {
    let begin = Instant::now();
    let mut dual = Dual::new(domain)?;
    let assembled = Instant::now();
    stop_if_cancelled(cancel)?;
    let mut fluxes: Vec<Flux> = Vec::new();
    for (v, start) in potentials.iter().zip(starts) {
        let start = match start {
            Start::Nothing => None,
            Start::Potential(u) => Some(dual.modes_of(domain, u)),
            Start::Image(image) => Some(dual.image(domain, &fluxes[image.original].phi, image)),
        };
        fluxes.push(dual_flux(&mut dual, v, start, share, cancel)?);
    }

    let n = potentials.len();
    let excess = dual.repair_excess();
    let mut share_of_repair = 0.0_f64;
    let mut matrix = flux_energies(&dual, potentials, &fluxes);
    // With P the energies of the repairs and l those of their remaining divergences, the repair of c_i r_i
    // costs at most (sqrt(c P c) + sum |c_i| sqrt(l_i))^2, and c P c at most (sum |c_i| sqrt(P_ii))^2.
    let roots: Vec<[f64; 2]> = fluxes
        .iter()
        .map(|flux| [dot(&flux.repair, &flux.residual).max(0.0).sqrt(), flux.energy_left.sqrt()])
        .collect();
    for (i, flux) in fluxes.iter().enumerate() {
        let [repair, left] = roots[i];
        let unseen: f64 = roots.iter().map(|[other, rest]| repair * rest + left * other + left * rest).sum();
        share_of_repair = share_of_repair.max(excess * (repair * repair + unseen) / matrix[(i, i)]);
        for (j, other) in fluxes.iter().enumerate() {
            matrix[(i, j)] -=
                excess * 0.5 * (dot(&flux.repair, &other.residual) + dot(&other.repair, &flux.residual));
        }
        matrix[(i, i)] -= excess * unseen;
        // The factor covers the rounding of the sums, so that the energy stays a lower bound.
        matrix[(i, i)] *= 1.0 - 64.0 * f64::EPSILON;
    }
    // Where the repair of a flux failed, nothing but zero is proved to be a lower bound for the potentials
    // that contain its right-hand side. The bound is one form for all potentials, and so becomes zero.
    let proved = fluxes.iter().all(|flux| flux.proved);
    if !proved {
        matrix = Mat::zeros(n, n);
    }
    let energies = Energies {
        matrix,
        unknowns: dual.unknowns(),
        iterations: fluxes.iter().map(|flux| flux.iterations).sum(),
        converged: fluxes.iter().all(|flux| flux.converged),
        repair_share: share_of_repair,
        coefficients: Vec::new(),
        with_error_of_base: None,
        seconds: [(assembled - begin).as_secs_f64(), assembled.elapsed().as_secs_f64()],
    };
    let state = |(v, mut flux): (&Vec<f64>, Flux)| {
        flux.finer.iter().for_each(|finer| add(&mut flux.phi, finer));
        State { potentials: v.clone(), phi: flux.phi, repair: flux.repair }
    };
    let states = || potentials.iter().zip(fluxes).map(state).collect();
    let kept_fluxes = if keep_fluxes && proved { Fluxes::new(dual, domain, states()) } else { None };
    Ok((energies, kept_fluxes))
}

/// The solution of the dual problem for one set of conductor potentials.
struct Flux {
    /// Potentials of the mixed method, from which the flux is made.
    phi: Vec<f64>,
    /// A correction of `phi` that is smaller than its last digit.
    finer: Option<Vec<f64>>,
    /// The divergence of the flux, with the opposite sign.
    residual: Vec<f64>,
    /// The potential of the flux that cancels the residual.
    repair: Vec<f64>,
    /// An upper bound on the energy of a flux that cancels what the repair leaves of the residual.
    energy_left: f64,
    /// Whether the repair cancelled the residual, so that the energy is a bound.
    proved: bool,
    /// Iterations of the linear solver.
    iterations: usize,
    /// Whether the linear solver reached its goal, or the repair is cheap enough all the same.
    converged: bool,
}

/// Energies of the fluxes without their repairs, a symmetric matrix.
fn flux_energies(dual: &Dual, potentials: &[Vec<f64>], fluxes: &[Flux]) -> Mat<f64> {
    let none = vec![0.0; dual.blocks()];
    let finer = || fluxes.iter().enumerate().filter_map(|(i, flux)| Some((i, flux.finer.as_deref()?)));
    let (mut flux_of, mut held, mut phi): (Vec<usize>, Vec<&[f64]>, Vec<&[f64]>) = Default::default();
    for (i, (v, flux)) in potentials.iter().zip(fluxes).enumerate() {
        flux_of.push(i);
        held.push(v);
        phi.push(&flux.phi);
    }
    for (i, correction) in finer() {
        flux_of.push(i);
        held.push(&none);
        phi.push(correction);
    }
    let products = dual.flux_energies(&held, &phi);
    let mut matrix = Mat::zeros(fluxes.len(), fluxes.len());
    for (k, &i) in flux_of.iter().enumerate() {
        flux_of.iter().enumerate().for_each(|(l, &j)| matrix[(i, j)] += products[(k, l)]);
    }
    matrix
}

/// Solves the dual problem for one set of conductor potentials: iterates until the energy of the repair is at
/// most some twenty times `share` of the energy of the flux, or until further iterations gain little.
fn dual_flux(
    dual: &mut Dual,
    potentials: &[f64],
    start: Option<Vec<f64>>,
    share: f64,
    cancel: Option<&AtomicBool>,
) -> Result<Flux, SolveError> {
    let excess = dual.repair_excess();
    let b = dual.source(potentials);
    let mut x = start.unwrap_or_else(|| vec![0.0; b.len()]);
    let mut start = dual.flux_energies(&[potentials], &[&x])[(0, 0)];
    let mut r = vec![0.0; b.len()];
    dual.true_residual(&b, &x, &mut r);
    let (mut step, mut rest) = (vec![0.0; b.len()], Vec::new());
    let (mut goal, mut last_cost, mut iterations) = (share, f64::INFINITY, 0);
    let none = vec![0.0; dual.blocks()];
    let mut finer: Option<Vec<f64>> = None;
    let zeros = || vec![0.0; b.len()];
    loop {
        step.fill(0.0);
        let goal_now = conjugate_gradients::Goal {
            share: goal,
            start,
            iteration_limit: conjugate_gradients::ITERATION_LIMIT,
            cancel,
        };
        let c = conjugate_gradients::solve(dual, &r, &mut step, &mut rest, goal_now);
        stop_if_cancelled(cancel)?;
        iterations += c.iterations;
        // Steps after the first may be less than the last digit of the potentials where the permittivity is
        // high.
        match last_cost.is_infinite() {
            true => add(&mut x, &step),
            false => add(finer.get_or_insert_with(zeros), &step),
        }
        // The recursion's residual drifts by rounding; the bound rests on the true one.
        r = dual.flux_residual(potentials, &x);
        if let Some(finer) = &finer {
            add(&mut r, &dual.flux_residual(&none, finer));
        }
        if dual.must_balance() {
            dual.balance(finer.get_or_insert_with(zeros), &mut r);
        }
        let repaired = dual.repair(&r, None);
        let flux = Flux {
            phi: std::mem::take(&mut x),
            finer: finer.take(),
            residual: std::mem::take(&mut r),
            repair: repaired.potential,
            energy_left: repaired.energy_left,
            proved: false,
            iterations,
            converged: false,
        };
        let energy = flux_energies(dual, &[potentials.to_vec()], std::slice::from_ref(&flux))[(0, 0)];
        let repair = dot(&flux.repair, &flux.residual);
        let cost = excess * (repair.sqrt() + flux.energy_left.sqrt()).powi(2) / energy;
        // The repair ignores how conductors shield the field, and near them its energy may be far larger than
        // the error of the linear solver: then that error must become smaller.
        let proved = repaired.left < 1e-3 && cost >= 0.0 && cost.is_finite();
        let cheap = cost <= 20.0 * share;
        let gains_little = cost > 0.5 * last_cost;
        if !proved || cheap || gains_little || iterations > conjugate_gradients::ITERATION_LIMIT {
            let converged = proved && (c.reached || cheap);
            return Ok(Flux { proved, converged, ..flux });
        }
        (x, finer, r) = (flux.phi, flux.finer, flux.residual);
        start = energy;
        (last_cost, goal) = (cost, goal * (share / cost).clamp(1e-6, 0.1));
    }
}
