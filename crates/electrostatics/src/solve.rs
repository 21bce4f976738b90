//! From a scene to its Maxwell matrix: symmetry, resolution, both bounds.

use crate::SolveError;
use crate::energy::{Energies, lower, upper};
use crate::field::{Share, sample};
use crate::layout::Layout;
use crate::matrix::{MatrixBounds, from_energies};
use crate::resolution::{Ladder, Rung};
use crate::solution::{Bounded, Field, Forecast, PhaseSeconds, Settings, Solution, Target};
use crate::symmetry::{Part, parts};
use elastocap_geometry::scene::BoxScene;
use faer::Mat;
use faer::linalg::solvers::Solve;
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
    let mut ladder = Ladder::new(settings, layout.endless_contrast());
    let mut grids = 0;
    let mut best: Option<(f64, Outcome, Rung)> = None;
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
        let error = told.then(|| outcome.error(settings));
        let again = ladder.judge(error, |r| memory(&parts, r, settings.bounds));
        let took = start.elapsed().as_secs_f64();
        // Rounding can make a finer grid worse than a coarser one: the best is kept.
        let improves = match (&best, error) {
            (Some((before, ..)), Some(now)) => now < *before,
            (None, _) => true,
            _ => false,
        };
        if improves {
            best = error.or((!again).then_some(f64::INFINITY)).map(|e| (e, outcome, rung));
        }
        if let Some((_, outcome, rung)) = best.take_if(|_| !again) {
            seconds.setup += outcome.seconds.setup;
            seconds.primal = outcome.seconds.primal;
            seconds.dual = outcome.seconds.dual;
            seconds.choosing += if improves { 0.0 } else { took };
            let field = settings.field.then(|| outcome.field(scene, &layout, &parts, settings));
            return Ok(Solution {
                field,
                ..outcome.finish(&layout, settings, &rung, grids, seconds, ladder.shortfall())
            });
        }
        seconds.choosing += took;
    }
}

/// Energies of all parts on one grid.
struct Outcome {
    bounds: MatrixBounds,
    /// Potentials of the right-hand sides, in columns.
    basis: Mat<f64>,
    /// Upper energies of the parts that have a field, with the grids they live on.
    upper: Vec<Energies>,
    unknowns: usize,
    iterations: usize,
    converged: bool,
    repair_share: f64,
    seconds: PhaseSeconds,
    domains: Vec<crate::domain::Domain>,
}

fn on_grid(layout: &Layout, parts: &[Part], rung: &Rung, settings: &Settings) -> Result<Outcome, SolveError> {
    let n = layout.conductors.len();
    let mut basis = Mat::zeros(n, n);
    let (mut up, mut low) = (Mat::zeros(n, n), Mat::zeros(n, n));
    let mut out = Outcome {
        bounds: MatrixBounds { lower: Mat::zeros(0, 0), upper: Mat::zeros(0, 0) },
        basis: Mat::zeros(0, 0),
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
    out.basis = basis;
    Ok(out)
}

impl Outcome {
    /// The state to look at: one volt between two conductors, or one volt on the first.
    fn field(&self, scene: &BoxScene, layout: &Layout, parts: &[Part], settings: &Settings) -> Field {
        let n = layout.conductors.len();
        let potentials: Vec<f64> = match n {
            2 => vec![0.5, -0.5],
            _ => (0..n).map(|c| if c == 0 { 1.0 } else { 0.0 }).collect(),
        };
        let target = Mat::from_fn(n, 1, |i, _| potentials[i]);
        let weights = self.basis.partial_piv_lu().solve(&target);
        let (mut at, mut solved, mut shares, mut common) = (0, 0, Vec::new(), 0.0);
        for part in parts {
            let from = at;
            at += part.potentials.len() + part.fieldless.len();
            common += (from + part.potentials.len()..at).map(|i| weights[(i, 0)]).sum::<f64>();
            if part.potentials.is_empty() {
                continue;
            }
            let energies = &self.upper[solved];
            let mut coefficients = vec![0.0; energies.coefficients[0].len()];
            let mut any = false;
            for (i, u) in energies.coefficients.iter().enumerate() {
                let w = weights[(from + i, 0)];
                any |= w != 0.0;
                coefficients.iter_mut().zip(u).for_each(|(c, u)| *c += w * u);
            }
            if any {
                shares.push(Share { domain: &self.domains[solved], coefficients, odd: part.odd });
            }
            solved += 1;
        }
        let mirrored = layout.mirror.map(|m| m.is_some() && settings.symmetry);
        let mut field = sample(scene, layout, &shares, mirrored, potentials);
        field.potential.iter_mut().for_each(|p| *p += common);
        field
    }

    /// Without a dual problem: puts the estimated error below the upper energies, from those of a coarser grid.
    ///
    /// Energies fall towards the truth as grids are refined: what the last refinement gained foretells what is left.
    fn estimate(&mut self, coarser: &Mat<f64>) {
        let upper = &self.bounds.upper;
        let n = upper.nrows();
        self.bounds.lower = Mat::from_fn(n, n, |i, j| {
            upper[(i, j)] - crate::resolution::REMAINDER * (coarser[(i, j)] - upper[(i, j)])
        });
    }

    /// The largest relative spread (error estimate without bounds) of what the tolerance is about.
    fn error(&self, settings: &Settings) -> f64 {
        let m = &self.bounds;
        let n = m.upper.nrows();
        let value = |lower: f64, upper: f64| if settings.bounds { 0.5 * (lower + upper) } else { upper };
        let relative = |lower: f64, upper: f64| {
            if upper > 0.0 { (upper - lower) / value(lower, upper).abs() } else { 0.0 }
        };
        let pair = m.two_terminal().map(|t| relative(t.lower, t.upper));
        if let (Target::TwoTerminal, Some(pair)) = (settings.target, pair) {
            return pair;
        }
        let entries = (0..n).flat_map(|i| (0..=i).map(move |j| (i, j))).map(|(i, j)| {
            let (lower, upper) = (&m.lower, &m.upper);
            if i == j {
                return relative(lower[(i, i)], upper[(i, i)]);
            }
            let gap = |i: usize| (upper[(i, i)] - lower[(i, i)]).max(0.0);
            let size =
                value(lower[(i, j)], upper[(i, j)]).abs().max(0.1 * (upper[(i, i)] * upper[(j, j)]).sqrt());
            (gap(i) * gap(j)).sqrt() / size
        });
        // A number that is not one is the worst of all.
        entries.chain(pair).fold(0.0, |a, b| if a >= b { a } else { b })
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
    parts
        .iter()
        .map(|p| crate::resolution::memory(&p.layout, rung, p.potentials.len(), bounds))
        .max()
        .unwrap_or(0)
}

/// Foretells what [`solve()`] will take, from the grid it would end on for a scene like the in-plane pair.
pub fn forecast(scene: &BoxScene, settings: &Settings) -> Result<Forecast, SolveError> {
    let layout = Layout::new(scene);
    let parts = parts(&layout, settings.symmetry);
    let rung = crate::resolution::foretold(settings);
    let solves = if settings.bounds { 2 } else { 1 };
    let (mut unknowns, mut seconds, mut right_hand_sides) = (0, 0.0, 0);
    for part in parts.iter().filter(|p| !p.potentials.is_empty()) {
        let (domain, _) = part.layout.domain(&rung.resolution);
        let dims = domain.primal_dims();
        let n: usize = dims.iter().product();
        unknowns = unknowns.max(solves * n);
        right_hand_sides += part.potentials.len();
        // A preconditioned step costs about as many operations per unknown as an axis is long.
        let work = n as f64 * dims.iter().sum::<usize>() as f64 / 3.0;
        seconds += 7e-9 * (solves * part.potentials.len()) as f64 * work + 5e-3;
    }
    Ok(Forecast {
        unknowns,
        memory_bytes: memory(&parts, &rung, settings.bounds),
        seconds,
        mirrored: layout.mirror.map(|m| m.is_some() && settings.symmetry),
        right_hand_sides,
    })
}
