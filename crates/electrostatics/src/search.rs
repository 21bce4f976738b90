//! The search for a grid that meets the tolerance: solve, see what is missing and where, refine, solve again.
//!
//! Grids on the way are solved for the primal problem alone and loosely; each is a small multiple of the one before, so
//! that they cost little beside the last. Both problems are solved where the tolerance should be met.

use crate::SolveError;
use crate::adapt::{missing, refine};
use crate::layout::Grid;
use crate::resolution::{MOST_UNKNOWNS, coarser, far, first, graded, iteration_share};
use crate::solution::ResolutionLevel;
use crate::solve::{Outcome, Problem, on_grid};
use std::time::Instant;

/// What is left to miss after a refinement, over what was missing before.
const STEP: f64 = 0.12;

/// Without bounds, the estimated error over what the last refinement gained: several times what should be left.
pub(crate) const REMAINDER: f64 = 0.6;

/// Refinements before giving up.
const MOST_GRIDS: usize = 60;

/// What a search ends with.
pub(crate) struct Found {
    pub(crate) outcome: Outcome,
    pub(crate) grid: Grid,
    pub(crate) shortfall: Option<String>,
    pub(crate) grids: usize,
    /// Seconds spent on grids other than the one reported.
    pub(crate) choosing: f64,
}

/// Solves at a given resolution.
pub(crate) fn fixed(problem: &Problem<'_>, level: ResolutionLevel) -> Result<Found, SolveError> {
    let settings = problem.settings;
    let tolerance = settings.relative_tolerance;
    let distance = |t: f64| far(t, settings.target, problem.layout.endless_contrast());
    let share = iteration_share(tolerance);
    let begin = Instant::now();
    let (mut below, mut grids) = (None, 1);
    if !settings.bounds {
        // The error is told by comparing with a coarser grid in a smaller space.
        let grid = problem.core.grid(&graded(coarser(level)), distance(tolerance / STEP));
        below = Some(on_grid(problem, &grid, share, false)?.bounds.upper);
        grids += 1;
    }
    let choosing = begin.elapsed().as_secs_f64();
    let grid = problem.core.grid(&graded(level), distance(tolerance));
    let mut outcome = on_grid(problem, &grid, share, settings.bounds)?;
    if let Some(below) = below {
        let missing = missing(&grid, &outcome.indicator(problem));
        outcome.estimate(&below, missing);
    }
    let error = outcome.error(settings);
    let shortfall =
        (!(error <= tolerance)).then(|| format!("the error is {error:.1e} at the fixed resolution"));
    Ok(Found { outcome, grid, shortfall, grids, choosing })
}

/// Refines until the tolerance is met, or cannot be.
pub(crate) fn adaptive(problem: &Problem<'_>) -> Result<Found, SolveError> {
    let settings = problem.settings;
    let tolerance = settings.relative_tolerance;
    let contrast = problem.layout.endless_contrast();
    let distance = |t: f64| far(t, settings.target, contrast);
    let begin = Instant::now();
    let mut grid =
        first(&problem.core, distance(if settings.bounds { tolerance } else { tolerance.max(0.1) }));
    // Relative energy that should be missing on the grid; error over what the primal solution misses; grids; radius.
    let (mut foreseen, mut amplification, mut grids, mut widened) = (f64::INFINITY, 1.0, 0, 0);
    let mut before: Option<faer::Mat<f64>> = None;
    let mut judged: Vec<f64> = Vec::new();
    let mut best: Option<(f64, Found)> = None;
    loop {
        if problem.cancelled() {
            return Err(SolveError::Cancelled);
        }
        let start = Instant::now();
        // Both problems miss about as much.
        let last = settings.bounds && 2.0 * amplification * foreseen <= 0.8 * tolerance;
        let share = if last || !settings.bounds {
            iteration_share(tolerance)
        } else {
            (0.01 * foreseen.min(0.1)).max(iteration_share(tolerance))
        };
        let mut outcome = on_grid(problem, &grid, share, last)?;
        let indicator = outcome.indicator(problem);
        let missing = missing(&grid, &indicator);
        grids += 1;
        if let Some(before) = &before
            && !settings.bounds
        {
            outcome.estimate(before, missing);
        }
        let error = (last || before.is_some() && !settings.bounds).then(|| outcome.error(settings));
        if !last {
            amplification = f64::max(amplification, outcome.amplification(settings));
        }
        before = Some(outcome.bounds.upper.clone());
        let met = error.is_some_and(|e| e <= tolerance);
        let mut shortfall = None;
        if std::env::var("TRACE").is_ok() {
            eprintln!(
                "grid {grids} n {} last {last} foreseen {foreseen:.1e} missing {missing:.1e} err {error:?} ampl {amplification:.2} it {} {:?} t {:.4} up {:.8e} low {:.8e} repair {:.1e} conv {} r {:.1e}",
                problem.unknowns(&grid),
                outcome.iterations,
                grid.level(),
                start.elapsed().as_secs_f64(),
                outcome.bounds.upper[(0, 0)] / 8.8541878128e-12,
                outcome.bounds.lower[(0, 0)] / 8.8541878128e-12,
                outcome.repair_share,
                outcome.converged,
                grid.radius
            );
        }
        if let Some(error) = error.filter(|_| !met) {
            // What the repair costs no finer grid gives back.
            let stagnates = judged.last().is_some_and(|before| !(error <= 0.8 * before))
                || outcome.repair_share > 0.5 * error;
            judged.push(error);
            if stagnates && widened < 3 && contrast.is_some() {
                widened += 1;
                judged.clear();
                let radius = 7.0 * grid.radius;
                problem.core.reach_to(&mut grid, radius);
            } else if stagnates || error.is_nan() {
                shortfall = Some(format!("the error stays at {error:.1e}: double precision gives no more"));
            }
            if missing > 0.0 && last {
                amplification = (0.5 * error / missing).clamp(0.3, 1e3);
            }
        }
        if !met && !outcome.converged {
            shortfall =
                Some("the iteration does not converge: sizes or permittivities are too unequal".to_owned());
        }
        if grids >= MOST_GRIDS {
            shortfall = Some(format!("the error is not below {tolerance:e} after {grids} grids"));
        }
        let took = start.elapsed().as_secs_f64();
        let next = (!met && shortfall.is_none()).then(|| {
            let mut next = grid.clone();
            let goal = 0.3 * tolerance / amplification;
            let target = match error {
                Some(error) if settings.bounds => missing * (0.5 * tolerance / error).clamp(0.03, 0.5),
                _ if settings.bounds => goal.clamp(STEP * missing, missing),
                _ => STEP * missing,
            };
            let left = refine(&mut next, &indicator, target);
            if !settings.bounds && contrast.is_some() {
                // Open space is widened with every grid, so that what it adds to the error shows in what the last
                // refinement gained.
                let radius = next.radius * STEP.cbrt().recip();
                problem.core.reach_to(&mut next, radius);
            }
            (next, left)
        });
        let room = |grid: &Grid| {
            problem.memory(grid) <= settings.memory_limit && problem.unknowns(grid) <= MOST_UNKNOWNS
        };
        let next = match next {
            Some((next, left)) if room(&next) => Some((next, left)),
            Some((next, _)) => {
                let unknowns = problem.unknowns(&next);
                shortfall = Some(format!(
                    "a finer grid would take {unknowns} unknowns and {} MB",
                    problem.memory(&next) >> 20
                ));
                (settings.bounds && !last).then(|| (grid.clone(), 0.0))
            }
            // What has been reached is worth bounds.
            None if !met && settings.bounds && !last => Some((grid.clone(), 0.0)),
            None => None,
        };
        let value = error.unwrap_or(f64::INFINITY);
        let better = best.as_ref().is_none_or(|(e, _)| value < *e || e.is_nan());
        if better && (error.is_some() || !settings.bounds) {
            let found = Found { outcome, grid: grid.clone(), shortfall: None, grids, choosing: -took };
            best = Some((value, found));
        }
        match next {
            Some((next, left)) if shortfall.is_none() || left == 0.0 => (grid, foreseen) = (next, left),
            _ => {
                let Some((_, mut found)) = best else { return Err(SolveError::Cancelled) };
                found.shortfall = shortfall;
                found.grids = grids;
                found.choosing += begin.elapsed().as_secs_f64();
                return Ok(found);
            }
        }
    }
}
