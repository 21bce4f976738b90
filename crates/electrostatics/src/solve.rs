//! From a scene to its Maxwell matrix: symmetry, resolution, both bounds.

use crate::SolveError;
use crate::energy::{Energies, lower, upper};
use crate::layout::Layout;
use crate::matrix::{MatrixBounds, from_energies};
use crate::resolution::{Ladder, Rung};
use crate::solution::{Bounded, PhaseSeconds, Settings, Solution};
use crate::symmetry::{Part, parts};
use elastocap_geometry::scene::BoxScene;
use faer::Mat;
use std::sync::atomic::Ordering;
use std::time::Instant;

/// Vacuum permittivity, F/m (CODATA 2018).
pub const EPS0: f64 = 8.854_187_812_8e-12;

/// Solves a scene: the Maxwell matrix with bounds, to the tolerance asked where that can be reached.
pub fn solve(scene: &BoxScene, settings: &Settings) -> Result<Solution, SolveError> {
    let begin = Instant::now();
    let layout = Layout::new(scene);
    let parts = parts(&layout, settings.symmetry);
    let mut seconds = PhaseSeconds { setup: begin.elapsed().as_secs_f64(), ..Default::default() };
    let mut ladder = Ladder::new(settings);
    let mut grids = 0;
    let mut earlier: Option<Outcome> = None;
    loop {
        if settings.cancel.as_ref().is_some_and(|c| c.load(Ordering::Relaxed)) {
            return Err(SolveError::Cancelled);
        }
        let rung = ladder.rung();
        let step = Instant::now();
        let outcome = on_grid(&layout, &parts, &rung, settings)?;
        grids += 1;
        let spread = outcome.spread(settings, earlier.as_ref());
        let took = step.elapsed().as_secs_f64();
        let next = ladder.judge(spread, |r| memory(&parts, r, settings.bounds));
        if next.is_none() {
            seconds.setup += outcome.seconds.setup;
            seconds.primal = outcome.seconds.primal;
            seconds.dual = outcome.seconds.dual;
            return Ok(outcome.finish(&layout, &parts, settings, earlier.as_ref(), &rung, grids, seconds, ladder.shortfall()));
        }
        seconds.choosing += took;
        earlier = Some(outcome);
    }
}

/// Energies of all parts on one grid.
struct Outcome {
    bounds: MatrixBounds,
    upper: Vec<Energies>,
    unknowns: usize,
    iterations: usize,
    converged: bool,
    repair_share: f64,
    seconds: PhaseSeconds,
    /// Field arrays need the grid they live on.
    domains: Vec<crate::domain::Domain>,
}

fn on_grid(layout: &Layout, parts: &[Part], rung: &Rung, settings: &Settings) -> Result<Outcome, SolveError> {
    let n = layout.conductors.len();
    let total: usize = parts.iter().map(|p| p.potentials.len() + p.fieldless.len()).sum();
    debug_assert_eq!(total, n);
    let mut basis = Mat::zeros(n, n);
    let (mut up, mut low) = (Mat::zeros(n, n), Mat::zeros(n, n));
    let mut out = Outcome {
        bounds: MatrixBounds { lower: Mat::zeros(0, 0), upper: Mat::zeros(0, 0) },
        upper: Vec::new(),
        unknowns: 0,
        iterations: 0,
        converged: true,
        repair_share: 0.0,
        seconds: PhaseSeconds::default(),
        domains: Vec::new(),
    };
    let mut at = 0;
    for part in parts {
        for (i, v) in part.potentials.iter().chain(&part.fieldless).enumerate() {
            for c in 0..n {
                basis[(c, at + i)] = v[c];
            }
        }
        if part.potentials.is_empty() {
            at += part.fieldless.len();
            continue;
        }
        let (domain, held) = part.layout.domain(&rung.resolution);
        let potentials: Vec<Vec<f64>> =
            part.potentials.iter().map(|v| held.iter().map(|&c| v[c]).collect()).collect();
        // Both problems side by side: they are of one size.
        let (primal, dual) = rayon::join(
            || upper(&domain, &potentials, rung.iteration_share),
            || settings.bounds.then(|| lower(&domain, &potentials, rung.iteration_share)).transpose(),
        );
        let (primal, _) = primal?;
        let dual = dual?;
        let scale = part.copies;
        for i in 0..potentials.len() {
            for j in 0..potentials.len() {
                up[(at + i, at + j)] = scale * primal.matrix[(i, j)];
                if let Some(dual) = &dual {
                    low[(at + i, at + j)] = scale * dual.matrix[(i, j)];
                }
            }
        }
        at += potentials.len() + part.fieldless.len();
        out.iterations += primal.iterations;
        out.converged &= primal.converged;
        out.seconds.setup += primal.seconds[0];
        out.seconds.primal += primal.seconds[1];
        let mut unknowns = primal.unknowns;
        if let Some(dual) = dual {
            unknowns += dual.unknowns;
            out.iterations += dual.iterations;
            out.converged &= dual.converged;
            out.seconds.setup = out.seconds.setup.max(dual.seconds[0]);
            out.seconds.dual += dual.seconds[1];
            out.repair_share = out.repair_share.max(dual.repair_share);
        }
        out.unknowns = out.unknowns.max(unknowns);
        out.upper.push(primal);
        out.domains.push(domain);
    }
    let unit = EPS0 * layout.unit;
    let scaled = |m: Mat<f64>| {
        let c = from_energies(&basis, &m);
        Mat::from_fn(n, n, |i, j| unit * c[(i, j)])
    };
    out.bounds.upper = scaled(up);
    out.bounds.lower = if settings.bounds { scaled(low) } else { out.bounds.upper.clone() };
    Ok(out)
}

impl Outcome {
    /// Bounds, or without a dual problem the upper value with its estimated error from the next coarser grid.
    fn matrix(&self, settings: &Settings, earlier: Option<&Outcome>) -> MatrixBounds {
        if settings.bounds {
            return self.bounds.clone();
        }
        let n = self.bounds.upper.nrows();
        // Energies fall towards the truth as grids are refined: what the last refinement gained foretells what the
        // next ones will (see `resolution::REMAINDER`).
        let lower = Mat::from_fn(n, n, |i, j| {
            let here = self.bounds.upper[(i, j)];
            earlier.map_or(0.0, |e| here - crate::resolution::REMAINDER * (e.bounds.upper[(i, j)] - here))
        });
        MatrixBounds { lower, upper: self.bounds.upper.clone() }
    }

    /// The largest relative spread of what the tolerance is about.
    fn spread(&self, settings: &Settings, earlier: Option<&Outcome>) -> f64 {
        let m = self.matrix(settings, earlier);
        let n = m.upper.nrows();
        let relative = |lower: f64, upper: f64| if upper > 0.0 { 2.0 * (upper - lower) / (upper + lower).abs() } else { 0.0 };
        let diagonal = (0..n).map(|i| relative(m.lower[(i, i)], m.upper[(i, i)])).fold(0.0, f64::max);
        m.two_terminal().map_or(diagonal, |t| diagonal.max(relative(t.lower, t.upper)))
    }

    #[expect(clippy::too_many_arguments, reason = "the pieces of one result")]
    fn finish(
        self,
        layout: &Layout,
        parts: &[Part],
        settings: &Settings,
        earlier: Option<&Outcome>,
        rung: &Rung,
        grids: usize,
        seconds: PhaseSeconds,
        shortfall: Option<String>,
    ) -> Solution {
        let matrix = self.matrix(settings, earlier);
        let centred = |b: Bounded| {
            if settings.bounds {
                b
            } else {
                // The computed energy itself is reported; the estimate goes to both sides of it.
                let error = b.upper - b.lower;
                Bounded { value: b.upper, lower: b.upper - error, upper: b.upper + error }
            }
        };
        let _ = parts;
        let mut maxwell = matrix.entries();
        if !settings.bounds {
            for (i, row) in maxwell.iter_mut().enumerate() {
                for (j, b) in row.iter_mut().enumerate() {
                    let value = self.bounds.upper[(i, j)];
                    let error = b.upper - b.lower;
                    *b = Bounded { value, lower: value - error, upper: value + error };
                }
            }
        }
        Solution {
            two_terminal: matrix.two_terminal().map(centred),
            maxwell,
            reached: shortfall.is_none() && self.converged,
            shortfall: shortfall.or_else(|| {
                (!self.converged).then(|| "the iteration stopped before its goal: the grid is too unequal".to_owned())
            }),
            unknowns: self.unknowns,
            iterations: self.iterations,
            grids,
            mirrored: if settings.symmetry { layout.mirror.map(|m| m.is_some()) } else { [false; 3] },
            resolution: rung.level,
            repair_share: self.repair_share,
            seconds,
            field: None,
        }
    }
}

/// Bytes the solve of the largest part takes at a resolution.
fn memory(parts: &[Part], rung: &Rung, bounds: bool) -> u64 {
    parts.iter().map(|p| crate::resolution::memory(&p.layout, rung, p.potentials.len(), bounds)).max().unwrap_or(0)
}
