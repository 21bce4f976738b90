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
    // Upper energies of the rungs solved so far, for error estimates.
    let mut uppers: Vec<(usize, Mat<f64>)> = Vec::new();
    loop {
        if settings.cancel.as_ref().is_some_and(|c| c.load(Ordering::Relaxed)) {
            return Err(SolveError::Cancelled);
        }
        let rung = ladder.rung();
        let (index, companion) = ladder.rung_and_companion();
        let start = Instant::now();
        let mut outcome = on_grid(&layout, &parts, &rung, settings)?;
        grids += 1;
        let told = if settings.bounds {
            true
        } else {
            let coarser = uppers.iter().find(|(i, _)| Some(*i) == companion).map(|(_, m)| m);
            if let Some(coarser) = coarser {
                outcome.estimate(coarser);
            }
            coarser.is_some()
        };
        uppers.push((index, outcome.bounds.upper.clone()));
        let error = told.then(|| outcome.error(settings.bounds));
        if !ladder.judge(error, |r| memory(&parts, r, settings.bounds)) {
            seconds.setup += outcome.seconds.setup;
            seconds.primal = outcome.seconds.primal;
            seconds.dual = outcome.seconds.dual;
            return Ok(outcome.finish(&layout, settings, &rung, grids, seconds, ladder.shortfall()));
        }
        seconds.choosing += start.elapsed().as_secs_f64();
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
    /// Without a dual problem: puts the estimated error below the upper energies, from those of a coarser grid.
    ///
    /// Energies fall towards the truth as grids are refined: what the last refinement gained foretells what is left.
    fn estimate(&mut self, coarser: &Mat<f64>) {
        let upper = &self.bounds.upper;
        let n = upper.nrows();
        self.bounds.lower =
            Mat::from_fn(n, n, |i, j| upper[(i, j)] - crate::resolution::REMAINDER * (coarser[(i, j)] - upper[(i, j)]));
    }

    /// The largest relative spread (error estimate without bounds) of what the tolerance is about.
    fn error(&self, bounds: bool) -> f64 {
        let m = &self.bounds;
        let n = m.upper.nrows();
        let relative = |lower: f64, upper: f64| {
            let value = if bounds { 0.5 * (lower + upper) } else { upper };
            if upper > 0.0 { ((upper - lower) / value).abs() } else { 0.0 }
        };
        let diagonal = (0..n).map(|i| relative(m.lower[(i, i)], m.upper[(i, i)]));
        let pair = m.two_terminal().map(|t| relative(t.lower, t.upper));
        // A number that is not one is the worst of all.
        diagonal.chain(pair).fold(0.0, |a, b| if a >= b { a } else { b })
    }

    fn finish(
        self,
        layout: &Layout,
        settings: &Settings,
        rung: &Rung,
        grids: usize,
        seconds: PhaseSeconds,
        shortfall: Option<String>,
    ) -> Solution {
        let mut maxwell = self.bounds.entries();
        let mut two_terminal = self.bounds.two_terminal();
        if !settings.bounds {
            // The computed energy itself is reported, with the estimate on both sides of it.
            let centred = |upper: f64, b: Bounded| {
                let error = b.upper - b.lower;
                Bounded { value: upper, lower: upper - error, upper: upper + error }
            };
            two_terminal = two_terminal.map(|b| centred(b.upper, b));
            for (i, row) in maxwell.iter_mut().enumerate() {
                for (j, b) in row.iter_mut().enumerate() {
                    *b = centred(self.bounds.upper[(i, j)], *b);
                }
            }
        }
        let stalled = || "the iteration stopped before its goal: the grid is too unequal".to_owned();
        let shortfall = shortfall.or_else(|| (!self.converged).then(stalled));
        Solution {
            two_terminal,
            maxwell,
            reached: shortfall.is_none(),
            shortfall,
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
