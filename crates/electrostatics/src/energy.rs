//! Energy matrices of one part on one grid: upper by the primal, lower by the dual method.

use crate::SolveError;
use crate::domain::Domain;
use crate::dual::Dual;
use crate::krylov::{self, Operator};
use crate::primal::Primal;
use elastocap_fem::tensor::dot;
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
    let (mut coefficients, mut products, mut lifted) = (Vec::new(), Vec::new(), Vec::new());
    let (mut iterations, mut converged) = (0, true);
    let mut residual = Vec::new();
    for v in potentials {
        let lift = primal.lift(v);
        let mut source = primal.full_product(&lift);
        let start = dot(&lift, &source);
        lifted.push(start);
        primal.clear_prescribed(&mut source);
        source.iter_mut().for_each(|x| *x = -*x);
        let mut u = vec![0.0; source.len()];
        let c =
            krylov::solve(&mut primal, &source, &mut u, &mut residual, krylov::Goal { share, start, cancel });
        iterations += c.iterations;
        converged &= c.reached;
        u.iter_mut().zip(&lift).for_each(|(u, l)| *u += l);
        products.push(primal.full_product(&u));
        coefficients.push(u);
    }
    let n = potentials.len();
    let mut matrix = Mat::from_fn(n, n, |i, j| {
        0.5 * (dot(&coefficients[i], &products[j]) + dot(&coefficients[j], &products[i]))
    });
    for i in 0..n {
        // Rows of the operator cancel down from the size of the lift's own: what rounding may have taken off the energy
        // is put back.
        matrix[(i, i)] += 16.0 * f64::EPSILON * lifted[i];
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
    let (mut phi, mut residual, mut repair) = (Vec::new(), Vec::new(), Vec::new());
    let (mut iterations, mut converged) = (0, true);
    for v in potentials {
        let b = dual.source(v);
        let mut x = vec![0.0; b.len()];
        let mut r = Vec::new();
        let start = dual.face_energy(v);
        let c = krylov::solve(&mut dual, &b, &mut x, &mut r, krylov::Goal { share, start, cancel });
        iterations += c.iterations;
        converged &= c.reached;
        // The recursion's residual drifts by rounding; the bound rests on the true one.
        dual.true_residual(&b, &x, &mut r);
        dual.balance(&mut x, &mut r);
        repair.push(dual.repair(&r).0);
        phi.push(x);
        residual.push(r);
    }
    let excess = dual.repair_excess();
    let mut share_of_repair = 0.0_f64;
    let potentials: Vec<&[f64]> = potentials.iter().map(Vec::as_slice).collect();
    let phi: Vec<&[f64]> = phi.iter().map(Vec::as_slice).collect();
    let mut matrix = dual.flux_energies(&potentials, &phi);
    for i in 0..n {
        share_of_repair = share_of_repair.max(excess * dot(&repair[i], &residual[i]) / matrix[(i, i)]);
        for j in 0..n {
            matrix[(i, j)] -= excess * 0.5 * (dot(&repair[i], &residual[j]) + dot(&repair[j], &residual[i]));
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
