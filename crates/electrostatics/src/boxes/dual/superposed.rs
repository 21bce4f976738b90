//! The distance of a flux that is added to that of a base from the flux of the added potential: see
//! [`crate::boxes::superposed`].

use super::across_grids::Fluxes;
use super::aim::Less;
use super::flux::Flux;
use super::mapped::{Solved, project};
use super::pointwise::fluxes_at;
use crate::boxes::domain::{Axis, Block, Domain};
use crate::boxes::mapped::gradients::{EXTRA, FINER, add_with_error, gradients_at};
use crate::boxes::mapped::metric::{Metric, TensorKind, held};
use crate::boxes::mapped::points::AxisPoints;
use crate::error::SolveError;
use elastocap_linalg::conjugate_gradients::Operator;
use faer::Mat;
use rayon::prelude::*;
use std::sync::atomic::AtomicBool;

/// Largest share of the energy of a flux's correction that its repair may take: negligible, but more than the
/// solver is asked for where the added solution is small. Tuned: time the runs of the balls in
/// docs/change.md, section "Reach".
const OF_CORRECTION: f64 = 1e-4;

/// Squared distances, as forms of the right-hand sides, and the cost of computing them.
pub(crate) struct Distances {
    /// |s - (K grad y - eps grad p)|^2, in the norm of K^-1.
    pub(crate) apart: Mat<f64>,
    /// An upper bound on the square of the repair of s.
    pub(crate) repair: Mat<f64>,
    /// An upper bound on the eigenvalues of eps K^-1.
    pub(crate) largest: f64,
    /// Unknowns of the dual problem.
    pub(crate) unknowns: usize,
    /// Iterations of all right-hand sides.
    pub(crate) iterations: usize,
    /// Whether the linear solver reached its goal for all right-hand sides.
    pub(crate) converged: bool,
    /// Whether the repairs cancelled all divergence.
    pub(crate) proved: bool,
    /// Seconds assembling and seconds solving.
    pub(crate) seconds: [f64; 2],
}

/// The distances of fluxes s without divergence from K grad y - eps grad p, for the `solved` potentials y and
/// the potentials p of `less`, which vanish outside of `around` and the elements next to it.
pub(crate) fn distances(
    domain: &Domain,
    potentials: &[Vec<f64>],
    solved: &Solved<'_>,
    less: &Less<'_>,
    around: &Block,
    share: f64,
    cancel: Option<&AtomicBool>,
) -> Result<Distances, SolveError> {
    let projected = project(domain, potentials, solved, (share, OF_CORRECTION), cancel)?;
    let (whole, n) = (&domain.truncated(), potentials.len());
    let mut apart = projected.apart.clone();
    // |s - K grad y + eps grad p|^2 is |s - K grad y|^2, plus twice the product of s - K grad y and eps grad
    // p, plus the square of the latter: first without a map, where Gauss's rule is exact, then the part of
    // K^-1 - 1 / eps.
    let points = near(whole, around);
    let weights = Weights::new(whole, &points);
    let gradients = |u: &[Vec<f64>], points: &[AxisPoints; 3]| {
        let u: Vec<&[f64]> = u.iter().map(Vec::as_slice).collect();
        gradients_at(domain, points, &u)
    };
    // eps grad p, over the permittivity of the domain.
    let subtracted_at = |points: &[AxisPoints; 3]| -> Vec<[Vec<f64>; 3]> {
        let ratio = less.ratio(whole, points);
        let mut out = gradients(less.potentials, points);
        for component in out.iter_mut().flatten() {
            component.iter_mut().zip(ratio.iter().flatten()).for_each(|(x, ratio)| *x *= ratio);
        }
        out
    };
    let (subtracted, field) = (subtracted_at(&points), gradients(solved.coefficients, &points));
    let projected_fluxes: Vec<&Flux> =
        projected.projections.iter().map(|projection| &projection.flux).collect();
    let flux_at =
        |points: &[AxisPoints; 3]| fluxes_at(projected.dual.all_lines(), whole, points, &projected_fluxes);
    let fluxes = flux_at(&points);
    for i in 0..n {
        for j in 0..n {
            let flux_term = weights.product(&fluxes[i], &subtracted[j], false);
            let potential_term = weights.product(&field[i], &subtracted[j], true);
            apart[(i, j)] += flux_term - potential_term;
            apart[(j, i)] += flux_term - potential_term;
            apart[(i, j)] += weights.product(&subtracted[i], &subtracted[j], true);
        }
    }
    drop((fluxes, field, subtracted));
    let added = |extra: usize| -> Result<Mat<f64>, SolveError> {
        let Some(metric) = Metric::new(whole, extra, TensorKind::Resistance)? else {
            return Ok(Mat::zeros(n, n));
        };
        let fluxes = flux_at(&metric.points);
        let permittivity = Weights::new(whole, &metric.points);
        let subtracted: Vec<[Vec<f64>; 3]> =
            subtracted_at(&metric.points).into_iter().map(|p| permittivity.times_permittivity(p)).collect();
        let product = |x: &[Vec<f64>; 3], y: &[Vec<f64>; 3]| metric.product(x, y);
        Ok(Mat::from_fn(n, n, |i, j| {
            product(&fluxes[i], &subtracted[j])
                + product(&fluxes[j], &subtracted[i])
                + product(&subtracted[i], &subtracted[j])
        }))
    };
    let (coarser, finer) = (added(EXTRA)?, added(FINER)?);
    add_with_error(&mut apart, &coarser, &finer, 1.0);
    Ok(Distances {
        apart,
        repair: projected.repair,
        largest: projected.largest,
        unknowns: projected.dual.unknowns(),
        iterations: projected.projections.iter().map(|projection| projection.iterations).sum(),
        converged: projected.projections.iter().all(|projection| projection.converged),
        proved: projected.projections.iter().all(|projection| projection.proved),
        seconds: projected.seconds,
    })
}

/// Gauss points on a block and the elements next to it.
fn near(domain: &Domain, block: &Block) -> [AxisPoints; 3] {
    [0, 1, 2].map(|a| {
        let axis = &domain.axes[a];
        let elements =
            axis.cuts[block.lo[a]].saturating_sub(1)..(axis.cuts[block.hi[a]] + 1).min(axis.line.elements());
        AxisPoints::new(axis, elements, EXTRA)
    })
}

/// Weights of Gauss points, zero in conductors, and the permittivity there.
pub(crate) struct Weights {
    weights: Vec<f64>,
    permittivity: Vec<f64>,
}

impl Weights {
    pub(crate) fn new(domain: &Domain, points: &[AxisPoints; 3]) -> Self {
        let (held, cells) = (held(domain), domain.cells());
        let [n0, n1, n2] = points.each_ref().map(AxisPoints::len);
        let (mut weights, mut permittivity) = (Vec::new(), Vec::new());
        for point in (0..n0).flat_map(|i| (0..n1).flat_map(move |j| (0..n2).map(move |k| [i, j, k]))) {
            let cell = [0, 1, 2].map(|a| points[a].interval[point[a]]);
            let is_held = held[(cell[0] * cells[1] + cell[1]) * cells[2] + cell[2]];
            let weight: f64 = (0..3).map(|a| points[a].weights[point[a]]).product();
            weights.push(if is_held { 0.0 } else { weight });
            permittivity.push(domain.permittivity_of(cell));
        }
        Self { weights, permittivity }
    }

    /// The integral of x y, or of x y times the permittivity.
    pub(super) fn product(&self, x: &[Vec<f64>; 3], y: &[Vec<f64>; 3], by_permittivity: bool) -> f64 {
        let scale = |n: usize| if by_permittivity { self.permittivity[n] } else { 1.0 };
        self.sum(|n| scale(n) * (0..3).map(|a| x[a][n] * y[a][n]).sum::<f64>())
    }

    /// The integral of x y over the permittivity.
    pub(crate) fn over_permittivity(&self, x: &[Vec<f64>; 3], y: &[Vec<f64>; 3]) -> f64 {
        self.sum(|n| (0..3).map(|a| x[a][n] * y[a][n]).sum::<f64>() / self.permittivity[n])
    }

    /// The integral of a density that is given at each point.
    fn sum(&self, density: impl Fn(usize) -> f64 + Sync) -> f64 {
        // Pieces of a fixed length, added in order: the sum does not depend on the number of threads. Not
        // tuned: other lengths change the sum by rounding alone.
        const PIECE: usize = 4096;
        let pieces: Vec<f64> = self
            .weights
            .par_chunks(PIECE)
            .enumerate()
            .map(|(piece, weights)| {
                weights.iter().enumerate().map(|(n, w)| w * density(piece * PIECE + n)).sum()
            })
            .collect();
        pieces.iter().sum()
    }

    /// A gradient times the permittivity.
    pub(crate) fn times_permittivity(&self, gradient: [Vec<f64>; 3]) -> [Vec<f64>; 3] {
        gradient.map(|mut component| {
            component.iter_mut().zip(&self.permittivity).for_each(|(x, eps)| *x *= eps);
            component
        })
    }
}

impl Fluxes {
    /// Computes and keeps the coordinates of the fluxes, for [`Fluxes::flux_at`].
    ///
    /// # Errors
    /// Elements that differ too much in size.
    pub(crate) fn prepare(&mut self) -> Result<(), SolveError> {
        for a in 0..3 {
            for segment in &mut self.lines.segments[a] {
                let coefficients = segment.coordinates(&self.domain.axes[a])?.coefficients();
                segment.coefficients = Some(coefficients);
            }
        }
        self.prepared = (0..self.states()).map(|state| self.run_fluxes(state)).collect::<Result<_, _>>()?;
        Ok(())
    }

    /// The axes that points for [`Fluxes::flux_at`] lie on.
    pub(crate) fn axes(&self) -> &[Axis; 3] {
        &self.domain.axes
    }

    /// The flux of a state, its repair included, at points on the axes of this grid; `None` before
    /// [`Fluxes::prepare`].
    pub(crate) fn flux_at(&self, state: usize, points: &[AxisPoints; 3]) -> Option<[Vec<f64>; 3]> {
        fluxes_at((&self.lines, None), &self.domain, points, &[self.prepared.get(state)?]).pop()
    }
}
