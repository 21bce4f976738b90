//! The search for a grid that meets the tolerance: solve, estimate how much energy is missing and where, refine, solve again.
//!
//! The intermediate grids are solved to few digits, and for the primal problem alone. Each is several times larger than the one
//! before, so that together they cost little compared with the last. Both problems are solved on the grid that should meet the
//! tolerance.

use crate::SolveError;
use crate::boxes::grid_refinement::{Indicator, missing, refine};
use crate::boxes::layout::Grid;
use crate::boxes::one_grid::{GAIN_FACTOR, GridProblem, Outcome, on_grid};
use crate::boxes::resolution::{MAX_UNKNOWNS, MIN_TOLERANCE, coarser, far, first, graded, iteration_share};
use crate::matrix::rounding_alone;
use crate::solution::{ResolutionLevel, STOPPED};
use faer::Mat;
use std::time::Instant;

/// Missing energy that a refinement aims for, over the missing energy before it.
pub(crate) const STEP: f64 = 0.12;

/// Relative energy that the primal problem may miss where both bounds are to meet the tolerance, over the tolerance.
pub(crate) const GOAL: f64 = 0.36;

/// [`STEP`] where the refinements so far reduced the error as expected.
const LONG_STEP: f64 = 0.01;

/// Refinements before giving up.
const MAX_GRIDS: usize = 60;

/// The result of a search.
pub(crate) struct Found {
    pub(crate) outcome: Outcome,
    pub(crate) grid: Grid,
    pub(crate) shortfall: Option<String>,
    pub(crate) grids: usize,
    /// Seconds spent on grids other than the one reported.
    pub(crate) choosing: f64,
}

/// Solves at a given resolution.
pub(crate) fn fixed(problem: &GridProblem<'_>, level: ResolutionLevel) -> Result<Found, SolveError> {
    let settings = problem.settings;
    let tolerance = settings.relative_tolerance;
    let distance = |t: f64| far(t, settings.target, problem.layout.endless_contrast());
    let share = iteration_share(tolerance);
    let begin = Instant::now();
    let (mut below, mut grids) = (None, 1);
    if !settings.bounds {
        // The error is estimated by comparison with a coarser grid, whose functions span a smaller space.
        let grid = problem.core.grid(&graded(coarser(level)), distance(tolerance / STEP));
        below = Some(on_grid(problem, &grid, share, false)?.bounds.upper);
        grids += 1;
    }
    let choosing = begin.elapsed().as_secs_f64();
    let grid = problem.core.grid(&graded(level), distance(tolerance));
    problem.check_memory(&grid)?;
    let mut outcome = on_grid(problem, &grid, share, settings.bounds)?;
    if let Some(below) = below {
        let missing = missing(&grid, &outcome.indicator(problem));
        outcome.estimate(&below, missing, settings);
    }
    let error = outcome.error(settings);
    let shortfall = (error.is_nan() || error > tolerance)
        .then(|| format!("the error is {error:.1e} at the fixed resolution"));
    Ok(Found { outcome, grid, shortfall, grids, choosing })
}

/// Refines until the tolerance is met, or cannot be.
pub(crate) fn adaptive(problem: &GridProblem<'_>) -> Result<Found, SolveError> {
    let begin = Instant::now();
    let mut search = Search::new(problem);
    problem.check_memory(&search.grid)?;
    loop {
        let purpose = search.purpose();
        let start = Instant::now();
        let found = match problem.cancelled() {
            true => Err(SolveError::Cancelled),
            false => on_grid(problem, &search.grid, search.share(purpose), purpose == Purpose::Prove),
        };
        let mut outcome = match found {
            Err(SolveError::Cancelled) => return search.stop(begin),
            found => found?,
        };
        search.grids += 1;
        let indicator = outcome.indicator(problem);
        let missing = missing(&search.grid, &indicator);
        let error = search.error(&mut outcome, missing, purpose);
        let met = error.is_some_and(|e| e <= problem.settings.relative_tolerance);
        let shortfall = if met { None } else { search.obstacle(&outcome, error, missing) };
        let next = if met {
            // A number is reported only where the iteration's own error is small.
            (purpose == Purpose::Explore).then(|| (search.grid.clone(), 0.0))
        } else {
            search.next(&indicator, error, missing, shortfall, purpose)
        };
        if error.is_some() || !problem.settings.bounds {
            search.keep(outcome, error, start.elapsed().as_secs_f64());
        }
        match next {
            Some((grid, left)) => (search.grid, search.foreseen) = (grid, left),
            None => return search.finish(met, begin),
        }
    }
}

/// Why a grid is solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Purpose {
    /// To estimate how much energy is missing, and where.
    Explore,
    /// For a result without bounds.
    Estimate,
    /// For a result with bounds.
    Prove,
}

struct Search<'p, 's> {
    problem: &'p GridProblem<'s>,
    /// The error to reach: the tolerance, or the smallest that double precision allows.
    tolerance: f64,
    grid: Grid,
    grids: usize,
    /// Relative energy that should be missing on the grid; infinite before the first.
    foreseen: f64,
    /// Error of the target over the relative energy that each problem misses. Both miss about the same, and entries of a matrix
    /// follow by polarisation.
    amplification: f64,
    /// Without bounds: what was missing on the grid before, and its energies.
    before: Option<(f64, Mat<f64>)>,
    /// Errors found so far.
    judged: Vec<f64>,
    /// How often the grid was extended into open space because refinement did not help.
    widened: usize,
    /// Set by [`Search::obstacle`].
    wider: bool,
    shortfall: Option<String>,
    best: Option<(f64, Found)>,
}

impl<'p, 's> Search<'p, 's> {
    fn new(problem: &'p GridProblem<'s>) -> Self {
        let settings = problem.settings;
        let tolerance = settings.relative_tolerance.max(MIN_TOLERANCE);
        let distance = far(
            if settings.bounds { tolerance } else { tolerance.max(0.1) },
            settings.target,
            problem.layout.endless_contrast(),
        );
        Self {
            problem,
            tolerance,
            grid: first(&problem.core, distance),
            grids: 0,
            foreseen: f64::INFINITY,
            amplification: 1.0,
            before: None,
            judged: Vec::new(),
            widened: 0,
            wider: false,
            shortfall: None,
            best: None,
        }
    }

    fn purpose(&self) -> Purpose {
        let tolerance = self.tolerance;
        if self.problem.settings.bounds {
            let near = 2.0 * self.amplification * self.foreseen <= 0.8 * tolerance;
            return if near { Purpose::Prove } else { Purpose::Explore };
        }
        let gain = self.before.as_ref().map_or(f64::INFINITY, |(missing, _)| GAIN_FACTOR * missing);
        let near = self.amplification * f64::max(0.5 * gain, self.foreseen) <= tolerance;
        if near { Purpose::Estimate } else { Purpose::Explore }
    }

    /// Goal of the linear solver: its error over the energy.
    fn share(&self, purpose: Purpose) -> f64 {
        let least = iteration_share(self.tolerance);
        match purpose {
            Purpose::Explore => (0.01 * self.foreseen.min(0.1)).max(least),
            Purpose::Estimate | Purpose::Prove => least,
        }
    }

    /// The error of the target, if it can be determined yet.
    fn error(&mut self, outcome: &mut Outcome, missing: f64, purpose: Purpose) -> Option<f64> {
        let settings = self.problem.settings;
        let solved = outcome.bounds.upper.clone();
        let known = match &self.before {
            Some((_, before)) if !settings.bounds => {
                outcome.estimate(before, missing, settings);
                true
            }
            _ => purpose == Purpose::Prove,
        };
        if purpose == Purpose::Explore {
            self.amplification = self.amplification.max(outcome.amplification(settings));
        }
        // A grid that is solved once more is still compared with the one before it.
        if self.foreseen > 0.0 {
            self.before = Some((missing, solved));
        }
        known.then(|| outcome.error(settings))
    }

    /// Why refining further would not help, if so.
    fn obstacle(&mut self, outcome: &Outcome, error: Option<f64>, missing: f64) -> Option<String> {
        const WIDEST: usize = 3;
        self.wider = false;
        // Bounds hold wherever the linear solver stopped; those that are close already may still improve.
        let close = self.problem.settings.bounds && error.is_some_and(|e| e < 0.05);
        if !outcome.converged && !close {
            return Some(
                "the iteration does not converge: sizes or permittivities are too unequal".to_owned(),
            );
        }
        if self.grids >= MAX_GRIDS {
            return Some(format!("the error is still above the tolerance after {MAX_GRIDS} grids"));
        }
        if self.problem.settings.bounds {
            let rounding = outcome.rounding_error(self.problem);
            if rounding > self.tolerance {
                return Some(rounding_alone(rounding));
            }
        }
        let error = error?;
        if self.problem.settings.bounds && missing > 0.0 {
            self.amplification = (0.5 * error / missing).clamp(0.3, 1e3);
        }
        // A finer grid does not reduce the energy of the repair.
        if error <= self.tolerance {
            return Some(format!("the error is {error:.1e}: double precision gives no more"));
        }
        let stagnates = error.is_nan()
            || outcome.repair_share > 0.5 * error
            || self.judged.last().is_some_and(|before| error > 0.8 * before);
        self.judged.push(error);
        if !stagnates {
            return None;
        }
        if self.problem.layout.endless_contrast().is_some() && self.widened < WIDEST {
            self.widened += 1;
            self.wider = true;
            self.judged.clear();
            return None;
        }
        Some(format!("the error stays at {error:.1e}: double precision gives no more"))
    }

    /// The next grid, with the relative energy that should be missing on it.
    fn next(
        &mut self,
        indicator: &Indicator,
        error: Option<f64>,
        missing: f64,
        obstacle: Option<String>,
        purpose: Purpose,
    ) -> Option<(Grid, f64)> {
        let (problem, settings) = (self.problem, self.problem.settings);
        let tolerance = self.tolerance;
        let mut grid = self.grid.clone();
        let mut left = missing;
        if obstacle.is_some() {
            self.shortfall = obstacle;
        } else if self.wider {
            problem.core.reach_to(&mut grid, 7.0 * self.grid.radius);
        } else {
            // Once refinements reduce the error as expected, the next step may be large. The first grid is no evidence of that.
            let as_expected = self.grids > 1 && missing < 2.5 * self.foreseen;
            let step = if as_expected { LONG_STEP } else { STEP };
            let target = match error {
                _ if !settings.bounds => STEP * missing,
                Some(error) => missing * (0.5 * tolerance / error).clamp(0.03, 0.5),
                None => (GOAL * tolerance / self.amplification).clamp(step * missing, missing),
            };
            left = refine(&mut grid, indicator, target);
            if !settings.bounds && problem.layout.endless_contrast().is_some() {
                // Every grid reaches further into open space, so that the error from there shows in the gain of the last
                // refinement.
                problem.core.reach_to(&mut grid, self.grid.radius / STEP.cbrt());
            }
        }
        let (memory, unknowns) = (problem.memory(&grid), problem.unknowns(&grid));
        if self.shortfall.is_none() && (memory > settings.memory_limit || unknowns > MAX_UNKNOWNS) {
            self.shortfall =
                Some(format!("a finer grid would take {unknowns} unknowns and {} MB", memory >> 20));
        }
        match (&self.shortfall, purpose) {
            (None, _) => Some((grid, left)),
            // The last grid is solved once more, with bounds.
            (Some(_), Purpose::Explore) if settings.bounds => Some((self.grid.clone(), 0.0)),
            (Some(_), _) => None,
        }
    }

    /// Keeps the outcome if it is the best so far: rounding can make a finer grid worse than a coarser one.
    fn keep(&mut self, outcome: Outcome, error: Option<f64>, seconds: f64) {
        let error = error.unwrap_or(f64::INFINITY);
        if self.best.as_ref().is_none_or(|(best, _)| error <= *best || best.is_nan()) {
            let (grid, grids) = (self.grid.clone(), self.grids);
            self.best = Some((error, Found { outcome, grid, shortfall: None, grids, choosing: -seconds }));
        }
    }

    /// The best so far, of a search that is stopped on request.
    fn stop(mut self, begin: Instant) -> Result<Found, SolveError> {
        if !self.best.as_ref().is_some_and(|(error, _)| error.is_finite()) {
            return Err(SolveError::Cancelled);
        }
        self.shortfall = Some(STOPPED.to_owned());
        self.finish(false, begin)
    }

    fn finish(self, met: bool, begin: Instant) -> Result<Found, SolveError> {
        let Some((_, mut found)) = self.best else { return Err(SolveError::Cancelled) };
        found.shortfall = self.shortfall.filter(|_| !met);
        found.grids = self.grids;
        found.choosing += begin.elapsed().as_secs_f64();
        Ok(found)
    }
}
