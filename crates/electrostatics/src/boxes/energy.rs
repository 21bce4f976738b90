//! Energy matrices of one part on one grid: upper by the primal, lower by the dual method.

use crate::SolveError;
use crate::boxes::domain::Domain;
use crate::boxes::dual::Dual;
use crate::boxes::primal::Primal;
use elastocap_fem::tensor::dot;
use elastocap_linalg::conjugate_gradients::{self, Operator};
use faer::Mat;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// Energies V^T C V (per eps0, in the domain's scale) in the basis of the right-hand sides.
#[derive(Debug)]
pub struct Energies {
    /// One row and column per right-hand side.
    pub matrix: Mat<f64>,
    /// Unknowns, conductors not subtracted.
    pub unknowns: usize,
    /// Iterations of all right-hand sides.
    pub iterations: usize,
    /// Whether every iteration reached what was asked.
    pub converged: bool,
    /// Largest share of an energy that repairing the divergence took (lower bounds only).
    pub repair_share: f64,
    /// Primal coefficients, one array per right-hand side (upper bounds only).
    pub coefficients: Vec<Vec<f64>>,
    /// Seconds assembling and seconds solving.
    pub seconds: [f64; 2],
}

/// Upper energies by Dirichlet's principle; the iteration stops when its error is about `share` of the energy.
pub fn upper(
    domain: &Domain,
    potentials: &[Vec<f64>],
    share: f64,
    cancel: Option<&AtomicBool>,
) -> Result<(Energies, Primal), SolveError> {
    let begin = Instant::now();
    let mut primal = Primal::new(domain)?;
    let assembled = Instant::now();
    let (mut coefficients, mut products) = (Vec::new(), Vec::new());
    let (mut iterations, mut converged) = (0, true);
    let mut residual = Vec::new();
    for v in potentials {
        let lift = primal.lift(v);
        let mut source = primal.full_product(&lift);
        let start = dot(&lift, &source);
        primal.clear_prescribed(&mut source);
        source.iter_mut().for_each(|x| *x = -*x);
        let mut u = vec![0.0; source.len()];
        let goal = |start: f64| conjugate_gradients::Goal { share, start, cancel };
        let c = conjugate_gradients::solve(&mut primal, &source, &mut u, &mut residual, goal(start));
        iterations += c.iterations;
        let mut reached = c.reached;
        if !reached && c.iterations < conjugate_gradients::ITERATION_LIMIT {
            // Rounding may have parted the recursion from the residual: once more, from the true one.
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
        u.iter_mut().zip(&lift).for_each(|(u, l)| *u += l);
        products.push(primal.full_product(&u));
        coefficients.push(u);
    }
    let n = potentials.len();
    let mut matrix = Mat::from_fn(n, n, |i, j| {
        0.5 * (dot(&coefficients[i], &products[j]) + dot(&coefficients[j], &products[i]))
    });
    for (i, u) in coefficients.iter().enumerate() {
        // Without the rounding of the product; what that of the sums may have taken off is put back.
        matrix[(i, i)] = primal.energy(u) * (1.0 + 64.0 * f64::EPSILON);
    }
    let energies = Energies {
        matrix,
        unknowns: primal.unknowns(),
        iterations,
        converged,
        repair_share: 0.0,
        coefficients,
        seconds: [(assembled - begin).as_secs_f64(), assembled.elapsed().as_secs_f64()],
    };
    Ok((energies, primal))
}

/// Lower energies by Thomson's principle, the divergence that the iteration leaves repaired and counted.
pub fn lower(
    domain: &Domain,
    potentials: &[Vec<f64>],
    share: f64,
    cancel: Option<&AtomicBool>,
) -> Result<Energies, SolveError> {
    let begin = Instant::now();
    let mut dual = Dual::new(domain)?;
    let assembled = Instant::now();
    let n = potentials.len();
    let (mut phi, mut residual, mut repair, mut proved) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let (mut iterations, mut converged) = (0, true);
    let excess = dual.repair_excess();
    for v in potentials {
        let b = dual.source(v);
        let mut start = dual.face_energy(v);
        let mut x = vec![0.0; b.len()];
        let mut r = b.clone();
        let (mut step, mut rest) = (vec![0.0; b.len()], Vec::new());
        let (mut goal, mut last) = (share, f64::INFINITY);
        let mut sound;
        let taken = loop {
            step.fill(0.0);
            let c = conjugate_gradients::solve(
                &mut dual,
                &r,
                &mut step,
                &mut rest,
                conjugate_gradients::Goal { share: goal, start, cancel },
            );
            iterations += c.iterations;
            x.iter_mut().zip(&step).for_each(|(x, s)| *x += s);
            // The recursion's residual drifts by rounding; the bound rests on the true one.
            dual.true_residual(&b, &x, &mut r);
            dual.balance(&mut x, &mut r);
            let (repair, left) = dual.repair(&r);
            let energy = dual.flux_energies(&[v], &[&x])[(0, 0)];
            let cost = excess * dot(&repair, &r) / energy;
            // Near conductors the repair knows nothing of their shielding and may cost far more than the iteration's
            // own error: then that must be smaller.
            sound = left < 1e-3 && cost >= 0.0;
            if !sound
                || cost <= 20.0 * share
                || cost > 0.5 * last
                || iterations > conjugate_gradients::ITERATION_LIMIT
            {
                converged &= sound && (c.reached || cost <= 20.0 * share);
                break repair;
            }
            start = energy;
            (last, goal) = (cost, goal * (share / cost).clamp(1e-6, 0.1));
        };
        proved.push(sound);
        repair.push(taken);
        phi.push(x);
        residual.push(r);
    }
    let mut share_of_repair = 0.0_f64;
    let potentials: Vec<&[f64]> = potentials.iter().map(Vec::as_slice).collect();
    let phi: Vec<&[f64]> = phi.iter().map(Vec::as_slice).collect();
    let mut matrix = dual.flux_energies(&potentials, &phi);
    for i in 0..n {
        share_of_repair = share_of_repair.max(excess * dot(&repair[i], &residual[i]) / matrix[(i, i)]);
        for j in 0..n {
            matrix[(i, j)] -= excess * 0.5 * (dot(&repair[i], &residual[j]) + dot(&repair[j], &residual[i]));
        }
        // A repair that failed proves nothing but that no energy is negative.
        if !proved[i] {
            for j in 0..n {
                (matrix[(i, j)], matrix[(j, i)]) = (0.0, 0.0);
            }
        }
        // What rounding of the sums may have added is taken off again.
        matrix[(i, i)] *= 1.0 - 64.0 * f64::EPSILON;
    }
    Ok(Energies {
        matrix,
        unknowns: dual.unknowns(),
        iterations,
        converged,
        repair_share: share_of_repair,
        coefficients: Vec::new(),
        seconds: [(assembled - begin).as_secs_f64(), assembled.elapsed().as_secs_f64()],
    })
}
