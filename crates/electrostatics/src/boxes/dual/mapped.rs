//! The lower bound of a scene that a map bends.
//!
//! Fluxes are those in the coordinates of the boxes, and their energy is the integral of s K^-1 s. A flux
//! near the best one is made from the primal solution: K grad u is projected, in the norm without a map, on
//! the fluxes without divergence. Projection cannot enlarge the distance from the best flux in that norm, and
//! the norms differ at most by the stretch of the map. This takes one dual problem without a map.
//!
//! The solver leaves a divergence -r. A repair p cancels it exactly ([`super::repair`]), and the bound is
//!
//! J = 2 g s - (s, K^-1 s) - 2 (s, K^-1 p) - (p, K^-1 p).
//!
//! The energy of p is at most the largest eigenvalue of eps K^-1 times r A'^-1 r. The repair does not change
//! the charge g s of a conductor: it has no divergence inside the conductor, so that inflow and outflow are
//! equal. The product of s and p is that of grad u and p, except for s - K grad u, which is as small as the
//! error of the grid. By Green's formula (grad u, p) = (u, r) and (grad u, s) = g s - (u, r), so that
//!
//! J >= 2 g s - (s, K^-1 s) - 2 (u, r) - d N - (1 + 1/d) (p, K^-1 p)
//!
//! for any d > 0, by Young's inequality, with
//!
//! N = |s - K grad u|^2 = U + (s, K^-1 s) - 2 g s + 2 (u, r)
//!
//! and U the energy of the potential. Half of N is about the error of the grid.

use super::Dual;
use super::aim::{Less, Target, target};
use super::flux::Flux;
use super::repair::Repaired;
use crate::boxes::domain::Domain;
use crate::boxes::energies::Energies;
use crate::boxes::half_turn::images::Image;
use crate::boxes::mapped::gradients::{EXTRA, FINER, Gradients, add_with_error};
use crate::error::{SolveError, stop_if_cancelled};
use elastocap_fem::tensor::{add, dot};
use elastocap_linalg::conjugate_gradients::{self, Operator};
use faer::Mat;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// Energy of a repair to aim for, over the error that the linear solver may have. The error of the grid is
/// usually at least 200 times as large, and the bound loses about a fiftieth of it. Tuned: time
/// `elastocap run cases/comb-in-layer.toml`.
const ENOUGH: f64 = 1e-2;

/// Largest accepted energy of a repair, over the energy to aim for. Tuned:
/// `time elastocap run cases/comb-in-layer.toml`.
const CHEAP: f64 = 4.0;

/// The solved primal problem.
pub(crate) struct Solved<'a> {
    /// The potentials.
    pub(crate) coefficients: &'a [Vec<f64>],
    /// Potentials to subtract: the flux aimed at is K grad u less eps times their gradient, without a map.
    pub(crate) less: Option<Less<'a>>,
    /// The energies of the potentials.
    pub(crate) energies: &'a Mat<f64>,
    /// Which right-hand sides are images of others: their targets and starts are the images of those of the
    /// others.
    pub(crate) images: &'a [Option<Image>],
    /// The operator that the map added to the problem.
    pub(crate) bent: Option<&'a Gradients>,
}

/// The flux of one right-hand side, its divergence and the repair.
pub(super) struct Projection {
    /// The flux s, without its repair.
    pub(super) flux: Flux,
    /// The potential whose gradient removed most of the divergence.
    correction: Vec<f64>,
    /// r: the divergence that is left, with the opposite sign.
    residual: Vec<f64>,
    /// The potential of the repair.
    repair: Vec<f64>,
    /// Whether the repair cancels the divergence that is left, so that the energy is a bound.
    pub(super) proved: bool,
    /// Whether the linear solver reached its goal, or the repair is cheap enough all the same.
    pub(super) converged: bool,
    /// Iterations of the linear solver.
    pub(super) iterations: usize,
}

/// Initial guesses for the correction of a flux and for its repair.
struct Near {
    correction: Vec<f64>,
    repair: Vec<f64>,
}

/// The fluxes of all right-hand sides, and the forms that the bound is made of.
pub(super) struct Projected {
    /// The dual problem without a map.
    pub(super) dual: Dual,
    /// The flux of each right-hand side.
    pub(super) projections: Vec<Projection>,
    /// An upper bound on (s, K^-1 s).
    energy: Mat<f64>,
    /// g s.
    flow: Mat<f64>,
    /// (u, r).
    work: Mat<f64>,
    /// An upper bound on (p, K^-1 p).
    pub(super) repair: Mat<f64>,
    /// N.
    pub(super) apart: Mat<f64>,
    /// An upper bound on the eigenvalues of eps K^-1.
    pub(super) largest: f64,
    /// Seconds assembling and seconds solving.
    pub(super) seconds: [f64; 2],
}

/// Lower energies of a scene that a map bends, from the `solved` primal problem.
pub(crate) fn lower(
    domain: &Domain,
    potentials: &[Vec<f64>],
    solved: &Solved<'_>,
    share: f64,
    cancel: Option<&AtomicBool>,
) -> Result<Energies, SolveError> {
    let projected = project(domain, potentials, solved, (share, 0.0), cancel)?;
    let Projected { dual, projections, energy, flow, work, repair, apart, seconds, .. } = &projected;
    let n = potentials.len();
    let trace = |m: &Mat<f64>| (0..n).map(|i| m[(i, i)]).sum::<f64>().max(0.0);
    let ratio = (trace(repair) / trace(apart)).sqrt();
    // The d that minimises d N + (1 + 1/d) (p, K^-1 p).
    let young = match ratio {
        0.0 => [0.0, 1.0],
        _ if ratio.is_finite() => [ratio, 1.0 + 1.0 / ratio],
        _ => [1.0, 2.0],
    };
    let cost = |i: usize, j: usize| young[0] * apart[(i, j)] + young[1] * repair[(i, j)];
    let mut matrix =
        Mat::from_fn(n, n, |i, j| 2.0 * flow[(i, j)] - energy[(i, j)] - 2.0 * work[(i, j)] - cost(i, j));
    let mut repair_share = 0.0_f64;
    for i in 0..n {
        repair_share = repair_share.max(cost(i, i) / matrix[(i, i)]);
        // This covers the rounding of the sums.
        matrix[(i, i)] -= 256.0 * f64::EPSILON * energy[(i, i)];
    }
    if projections.iter().any(|projection| !projection.proved) {
        matrix = Mat::zeros(n, n);
    }
    Ok(Energies {
        matrix,
        unknowns: dual.unknowns(),
        iterations: projections.iter().map(|projection| projection.iterations).sum(),
        converged: projections.iter().all(|projection| projection.converged),
        repair_share,
        coefficients: Vec::new(),
        with_error_of_base: None,
        seconds: *seconds,
    })
}

/// Fluxes without divergence near those of the `solved` potentials. The energy of their repairs may be a
/// share of the energy of the flux, which follows from the error `share` of the linear solver, plus a share
/// `of_correction` of the energy of the correction, which is a good part of the error of the grid.
pub(super) fn project(
    domain: &Domain,
    potentials: &[Vec<f64>],
    solved: &Solved<'_>,
    (share, of_correction): (f64, f64),
    cancel: Option<&AtomicBool>,
) -> Result<Projected, SolveError> {
    let begin = Instant::now();
    let mut dual = Dual::new(domain)?;
    let whole = &domain.truncated();
    let assembled = Instant::now();
    stop_if_cancelled(cancel)?;
    let stretch = solved.bent.map_or(1.0, Gradients::largest);
    let mut projections: Vec<Projection> = Vec::new();
    let mut targets: Vec<Option<Target>> = Vec::new();
    let has_image = |k: usize| solved.images.iter().flatten().any(|image| image.original == k);
    for (k, (u, image)) in solved.coefficients.iter().zip(solved.images).enumerate() {
        let less = solved.less.as_ref().map(|less| (less, less.potentials[k].as_slice()));
        // Potentials that are subtracted need not be images of each other.
        let of_image = image
            .filter(|_| less.is_none())
            .and_then(|image| Some(targets.get(image.original)?.as_ref()?.image(&dual, domain, &image)));
        let target = of_image.unwrap_or_else(|| target(domain, &dual, less, (u, solved.bent)));
        let flux = dual.projected(whole, &target);
        targets.push(has_image(k).then_some(target));
        let start = image.and_then(|image| {
            let original = projections.get(image.original)?;
            let image_of = |x: &[f64]| dual.image(domain, x, &image);
            Some(Near { correction: image_of(&original.correction), repair: image_of(&original.repair) })
        });
        projections.push(dual.without_divergence(flux, start, (share, of_correction), stretch, cancel)?);
    }
    drop(targets);
    let n = potentials.len();
    let fluxes: Vec<&Flux> = projections.iter().map(|projection| &projection.flux).collect();
    let mut energy = dual.energies_of(&fluxes);
    let mut largest = 1.0;
    if let (Some((coarser, _)), Some((finer, stretch))) =
        (dual.added_energies(whole, EXTRA, &fluxes)?, dual.added_energies(whole, FINER, &fluxes)?)
    {
        add_with_error(&mut energy, &coarser, &finer, 1.0);
        largest = stretch;
    }
    let charges = dual.charges(potentials, &fluxes);
    let modes: Vec<Vec<f64>> = solved.coefficients.iter().map(|u| dual.modes_of(domain, u)).collect();
    let worst = dual.repair_excess() * largest;
    let symmetric =
        |form: &dyn Fn(usize, usize) -> f64| Mat::from_fn(n, n, |i, j| 0.5 * (form(i, j) + form(j, i)));
    let repair = symmetric(&|i, j| worst * dot(&projections[i].repair, &projections[j].residual));
    let work = symmetric(&|i, j| dot(&modes[i], &projections[j].residual));
    let flow = symmetric(&|i, j| charges[(i, j)]);
    let apart =
        symmetric(&|i, j| solved.energies[(i, j)] + energy[(i, j)] - 2.0 * flow[(i, j)] + 2.0 * work[(i, j)]);
    let seconds = [(assembled - begin).as_secs_f64(), assembled.elapsed().as_secs_f64()];
    Ok(Projected { dual, projections, energy, flow, work, repair, apart, largest, seconds })
}

impl Dual {
    /// Removes the divergence of a flux by solving the dual problem without a map, from an initial guess if
    /// there is one.
    fn without_divergence(
        &mut self,
        mut flux: Flux,
        start: Option<Near>,
        (share, of_correction): (f64, f64),
        largest: f64,
        cancel: Option<&AtomicBool>,
    ) -> Result<Projection, SolveError> {
        let b = self.minus_divergence(&flux);
        let energy = flux.0.iter().flatten().map(|y| dot(y, y)).sum::<f64>();
        let worst = self.repair_excess() * largest;
        let mut r = b.clone();
        let (start, mut near) = start.map(|near| (near.correction, near.repair)).unzip();
        if let Some(start) = &start {
            self.true_residual(&b, start, &mut r);
        }
        let mut x = start.unwrap_or_else(|| vec![0.0; b.len()]);
        let (mut step, mut rest) = (vec![0.0; b.len()], Vec::new());
        let of_solver = ENOUGH * share * energy;
        let mut corrected = dot(&x, &b).abs();
        let (mut factor, mut last_cost, mut iterations) = (1.0 / largest, f64::INFINITY, 0);
        loop {
            step.fill(0.0);
            let (share, start) = match of_correction {
                0.0 => (ENOUGH * share, energy),
                // The accepted energy grows with that of the correction, which every iteration increases.
                _ => (of_correction, -(of_solver / of_correction + corrected)),
            };
            let goal_now = conjugate_gradients::Goal {
                share: factor * share,
                start,
                iteration_limit: conjugate_gradients::ITERATION_LIMIT,
                cancel,
            };
            let c = conjugate_gradients::solve(self, &r, &mut step, &mut rest, goal_now);
            stop_if_cancelled(cancel)?;
            iterations += c.iterations;
            add(&mut x, &step);
            self.true_residual(&b, &x, &mut r);
            if self.must_balance() {
                self.balance(&mut x, &mut r);
            }
            corrected = dot(&x, &b).abs();
            let Repaired { potential: repair, left, .. } = self.repair(&r, near.take());
            let cost = worst * dot(&repair, &r);
            let enough = of_solver + of_correction * corrected;
            let proved = left < 1e-3 && cost >= 0.0;
            let cheap = cost <= CHEAP * enough;
            if !proved || cheap || cost > 0.5 * last_cost || iterations > conjugate_gradients::ITERATION_LIMIT
            {
                self.add_gradient(&mut flux, &x);
                let converged = proved && (c.reached || cheap);
                return Ok(Projection {
                    flux,
                    correction: x,
                    residual: r,
                    repair,
                    proved,
                    converged,
                    iterations,
                });
            }
            (last_cost, factor) = (cost, factor * (enough / cost).clamp(1e-6, 0.1));
        }
    }
}

#[cfg(test)]
pub(in crate::boxes) mod tests {
    use crate::boxes::grid_problem::GridProblem;
    use crate::boxes::layout::Grid;
    use crate::boxes::one_grid::{Lower, Outcome, on_grid};
    use crate::boxes::resolution::graded;
    use crate::boxes::scene_map::{MapAxis, SceneMap};
    use crate::solution::{ResolutionLevel, Settings};
    use elastocap_geometry::scene::{Body, Box3, Scene, Wall};
    use elastocap_geometry::shapes::Shape;
    use std::sync::Arc;

    /// Bodies in a box over ground.
    pub(in crate::boxes::dual) fn boxed(bodies: Vec<Body>) -> Scene {
        let domain = Box3 { min: [-1.0, 0.0, -1.2], max: [1.0, 1.6, 1.2] };
        let mut walls = [[Wall::Insulated; 2]; 3];
        walls[1][0] = Wall::Grounded;
        Scene { bodies, background_permittivity: 1.0, domain, walls }
    }

    /// Two plates of different sizes, one of them in a layer.
    pub(in crate::boxes) fn scene() -> Scene {
        let cuboid = |min: [f64; 3], max: [f64; 3]| Shape::Box(Box3 { min, max });
        boxed(vec![
            Body::conductor("left", cuboid([-0.7, 0.3, -0.6], [-0.2, 0.5, 0.6])),
            Body::conductor("right", cuboid([0.2, 0.3, -0.2], [0.6, 0.4, 0.3])),
            Body::dielectric("layer", cuboid([-1.0, 0.0, -1.2], [0.1, 1.0, 1.2]), 3.0),
        ])
    }

    pub(in crate::boxes) fn map() -> Arc<SceneMap> {
        let axis = |breaks: &[f64], degree: usize, mirrored: bool| {
            let degrees = vec![degree; breaks.len() - 1];
            MapAxis { breaks: breaks.to_vec(), degrees, mirrored }
        };
        let axes = [
            axis(&[0.0, 0.2, 0.7, 1.0], 4, true),
            axis(&[0.0, 0.3, 0.5, 1.0, 1.6], 4, false),
            axis(&[0.0, 1.2], 1, true),
        ];
        let bend = |[x, y, _]: [f64; 3]| [0.3 * x * (1.0 - x) * y, 0.4 * y * (1.6 - y) * (x * x - 0.4), 0.0];
        Arc::new(SceneMap::new(axes, bend))
    }

    fn grid(problem: &GridProblem<'_>, order: usize) -> Grid {
        problem.core.grid(&graded(ResolutionLevel { order, levels: order - 2 }), 1.0)
    }

    pub(in crate::boxes) fn solved(problem: &GridProblem<'_>, order: usize, lower: Lower<'_>) -> Outcome {
        on_grid(problem, &grid(problem, order), 1e-10, lower, None).unwrap()
    }

    #[test]
    fn a_divergence_that_is_left_makes_bounds_a_little_lower_and_never_higher() {
        let settings = Settings::default();
        let problem = GridProblem::new(&scene(), Some(&map()), None, &settings).unwrap();
        let outcome = solved(&problem, 3, Lower::None);
        let part = &outcome.solved[0].1;
        let [upper, sharp] = [&part.energies.matrix, &part.bent_lower(&problem, 1e-13).unwrap().matrix];
        let gap = |i: usize| upper[(i, i)] - sharp[(i, i)];
        assert!((0..2).all(|i| gap(i) > 0.0 && gap(i) < 0.1 * upper[(i, i)]), "{upper:?} {sharp:?}");
        for share in [1e-2, 1e-3, 1e-4, 1e-6] {
            let loose = part.bent_lower(&problem, share).unwrap().matrix;
            // The difference as a form.
            let d = |i: usize, j: usize| sharp[(i, j)] - loose[(i, j)];
            println!("{share:e}: {:e} {:e} of {:e} {:e}", d(0, 0), d(1, 1), gap(0), gap(1));
            assert!(d(0, 0) > 0.0 && d(1, 1) > 0.0 && d(0, 0) * d(1, 1) >= d(0, 1).powi(2), "{share:e}");
            let scale = |form: &dyn Fn(usize) -> f64| form(0).max(form(1));
            let whole = share * scale(&|i| upper[(i, i)]);
            let lost = (whole * scale(&gap)).sqrt() + whole;
            assert!(d(0, 0).max(d(1, 1)) < lost, "{share:e}: {lost:e}");
        }
    }

    #[test]
    fn the_dual_problem_is_left_out_where_lower_bounds_of_another_grid_are_enough() {
        let settings = Settings::default();
        let problem = GridProblem::new(&scene(), Some(&map()), None, &settings).unwrap();
        let coarse = solved(&problem, 2, Lower::OF_GRID);
        let error = coarse.error(&settings);
        let with = |accepted: f64| {
            solved(&problem, 3, Lower::Proved { known: Some(&coarse.all_conductors.lower), accepted })
        };
        let (spared, whole) = (with(0.9 * error), with(0.0));
        println!("{error:e} {:e} {:e}", spared.error(&settings), whole.error(&settings));
        assert!(spared.seconds.dual == 0.0 && whole.seconds.dual > 0.0);
        assert!(
            spared.error(&settings) <= 0.9 * error && whole.error(&settings) < 0.9 * spared.error(&settings)
        );
        for i in 0..2 {
            let bounds = |o: &Outcome| [o.all_conductors.lower[(i, i)], o.all_conductors.upper[(i, i)]];
            let [[a, b], [c, d], [e, f]] = [&coarse, &spared, &whole].map(bounds);
            assert!((c / a - 1.0).abs() < 1e-9 && a < e && e < f && f == d && d < b);
        }
    }
}
