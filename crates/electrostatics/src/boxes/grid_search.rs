//! The search for a grid that meets the tolerance: solve, estimate how much energy is missing and where,
//! refine, solve again.
//!
//! The intermediate grids are solved to few digits, and for the primal problem only. Each is several times
//! larger than the one before, so that together they cost little compared with the last. Both problems are
//! solved on the grid that should meet the tolerance. Iterations start from the potentials on the previous
//! grid.

use crate::boxes::grid_problem::GridProblem;
use crate::boxes::grid_refinement::{Indicator, missing, refine_weighted};
use crate::boxes::layout::Grid;
use crate::boxes::one_grid::{Coarser, Lower, Outcome, on_grid};
use crate::boxes::one_part::Potentials;
use crate::boxes::open_space::OpenSpace;
use crate::boxes::resolution::{MAX_UNKNOWNS, MIN_TOLERANCE, coarser, graded, iteration_share};
use crate::consistency::is_usable;
use crate::error::SolveError;
use crate::shortfall::Shortfall;
use crate::solution::{Foresight, ResolutionLevel};
use faer::Mat;
use std::time::Instant;

/// Missing energy that a refinement aims for, over the missing energy before the refinement. Tuned:
/// `cargo bench --bench targets`.
pub(crate) const STEP: f64 = 0.12;

/// Relative energy that the primal problem may miss on the last grid, over the tolerance: where the spread of
/// both bounds is to meet the tolerance (`bounds`), or the error estimate.
pub(crate) fn goal(bounds: bool) -> f64 {
    if bounds { 0.36 } else { 0.3 }
}

/// Error to aim for, over the tolerance, where the error on the previous grid is known from bounds. It is
/// less than one, since the error falls more slowly than the missing energy that the indicator predicts.
/// Tuned: `cargo bench --bench targets`.
const PROVED_GOAL: f64 = 0.55;

/// [`STEP`] where the refinements so far reduced the error as expected. A longer step takes fewer grids, but
/// a coarse grid says little of where a much finer one should be fine: 0.02 to 0.03 takes the least work, a
/// tenth less than 0.01 (measured on eight scenes at 1e-2 to 1e-4). Tuned: `cargo bench --bench targets`.
const LONG_STEP: f64 = 0.02;

/// Largest error that may be expected on a grid, over the tolerance, for both problems to be solved on it.
/// Tuned: `cargo bench --bench targets`.
const EXPECTED: f64 = 0.8;

/// [`EXPECTED`] for a base, which may miss its tolerance: the scenes that are added to it make up for that.
/// Tuned: time the runs of the balls in docs/change.md, section "Reach".
const EXPECTED_OF_BASE: f64 = 2.0;

/// Error of the linear solver for a base over the usual one: its iterations are most of the work for all
/// scenes that are added to it. Tuned: time the runs of the balls in docs/change.md, section "Reach".
const BASE_SHARE_FACTOR: f64 = 3.0;

/// Half the error over the energy that the indicator says to be missing, as observed on scenes of a pair at
/// tight tolerances; it is half as much at loose ones, 0.6 on arrays of pads, and 0.2 on combs and on thin
/// plates with feed bars. Tuned: `cargo bench --bench targets`, `benches/outlines.py comb pads`.
const USUAL_AMPLIFICATION: f64 = 1.0;

/// [`USUAL_AMPLIFICATION`] where the energy of a single state is sought: the indicator of one state is more
/// accurate than that of several, on combs too. Tuned: `time elastocap run cases/guarded-plate.toml` at
/// tolerances of 1e-2, 1e-3 and 3e-4.
const ONE_STATE_AMPLIFICATION: f64 = 0.85;

/// [`Foresight::amplification`] grows towards smaller errors as the ratio of the errors to this power: 0.08
/// on pairs, 0.16 on combs under a punch. Tuned: time the runs of docs/change.md, section "Reach".
const AMPLIFICATION_GROWTH: f64 = 0.17;

/// The factor by which the goal may be relaxed where the amplification is known from an earlier solve and
/// [`ACCEPTED_MARGIN`] times the tolerance is accepted. Tuned: time the runs of docs/change.md, section
/// "Reach".
const FORESIGHT_GOAL_FACTOR: f64 = 1.25;

/// Least accepted error, over the tolerance, with which that factor is used. Tuned: time the runs of
/// docs/change.md, section "Reach".
const ACCEPTED_MARGIN: f64 = 1.05;

/// Largest number of grids. Not tuned: a limit that ordinary cases do not reach.
const MAX_GRIDS: usize = 60;

/// The result of a search.
pub(crate) struct SearchResult {
    /// The solution on the grid with the smallest error.
    pub(crate) outcome: Outcome,
    /// That grid.
    pub(crate) grid: Grid,
    /// Why the tolerance was not met, if it was not.
    pub(crate) shortfall: Option<Shortfall>,
    /// Number of grids that were solved.
    pub(crate) grids: usize,
    /// Seconds spent on grids other than the one reported.
    pub(crate) choosing: f64,
    /// What this solve tells about a solve to another tolerance.
    pub(crate) foresight: Option<Foresight>,
}

/// Solves at the given resolution.
pub(crate) fn fixed(problem: &GridProblem<'_>, level: ResolutionLevel) -> Result<SearchResult, SolveError> {
    let settings = problem.settings;
    let tolerance = settings.relative_tolerance;
    let open_space = OpenSpace::new(&problem.layout, &problem.floating, settings);
    let distance = open_space.distance(tolerance);
    let share = iteration_share(tolerance);
    let begin = Instant::now();
    let (mut below, mut grids) = (None, 1);
    if !settings.bounds {
        // The error is estimated by comparison with a coarser grid, whose functions span a smaller space.
        let grid = problem.core.grid(&graded(coarser(level)), distance);
        let outcome = on_grid(problem, &grid, share, Lower::None, None)?;
        let missing = missing(&grid, &outcome.indicator(problem));
        below = Some(Coarser { missing, upper: outcome.bounds.upper });
        grids += 1;
    }
    let choosing = begin.elapsed().as_secs_f64();
    let grid = problem.core.grid(&graded(level), distance);
    problem.check_memory(&grid)?;
    let lower = if settings.bounds { Lower::OF_GRID } else { Lower::None };
    let mut outcome = on_grid(problem, &grid, share, lower, None)?;
    if let Some(below) = below {
        let missing = missing(&grid, &outcome.indicator(problem));
        outcome.estimate(Some(&below), missing, open_space.error(distance), settings);
    }
    let error = outcome.error(settings);
    if !is_usable(outcome.converged, if settings.bounds { error } else { f64::INFINITY }) {
        return Err(SolveError::NotConverged);
    }
    let shortfall = (error.is_nan() || error > tolerance).then_some(Shortfall::FixedResolution { error });
    Ok(SearchResult { outcome, grid, shortfall, grids, choosing, foresight: None })
}

/// Refines until the tolerance is met, or until it is clear that it cannot be met.
pub(crate) fn adaptive(problem: &GridProblem<'_>) -> Result<SearchResult, SolveError> {
    let mut search = Search::new(problem)?;
    let tolerance = problem.settings.relative_tolerance;
    let met = search.pursue(tolerance, problem.settings.accepted.max(1.0) * tolerance)?;
    search.finish(met)
}

/// The purpose of solving a grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Purpose {
    /// To estimate how much energy is missing, and where.
    Explore,
    /// For a result without bounds.
    Estimate,
    /// For a result with bounds.
    Prove,
}

/// Settings of the search for one of several states of a target.
#[derive(Debug, Clone, Copy)]
pub(crate) struct OneState {
    /// Where rays to infinity begin, as in [`OpenSpace::distance`]: the same for all states, whose grids are
    /// joined.
    pub(crate) distance: f64,
    /// Goal of the linear solver, on grids for a result.
    pub(crate) share: f64,
}

/// The state of a search.
pub(crate) struct Search<'p, 's> {
    problem: &'p GridProblem<'s>,
    /// The time at which the search began.
    begin: Instant,
    /// Set where the energy of one state of several is sought.
    one_state: Option<OneState>,
    /// The error to reach: the tolerance, or the smallest that double precision allows.
    tolerance: f64,
    /// The grid that is solved next, or was solved last.
    grid: Grid,
    /// Number of grids that were solved.
    grids: usize,
    /// Relative energy that is expected to be missing on the grid; infinite before the first.
    expected_missing: f64,
    /// Half the error of the target over the energy that the indicator says to be missing: both problems miss
    /// about the same energy, and entries of a matrix follow by polarisation.
    amplification: f64,
    /// By how much the indicator overstated the missing energy on the first grid: see
    /// [`Outcome::overstated`].
    overstated: Option<f64>,
    /// By how much the indicator overstated the missing energy on the last grid.
    last_overstated: Option<f64>,
    /// Whether `last_overstated` differs from its value on the grid before by less than a factor of two.
    settled: bool,
    /// The results on the grid before.
    before: Option<Coarser>,
    /// The potentials on the grid before, from which iterations on the next start.
    potentials: Option<Potentials>,
    /// The latest lower bounds, of all conductors.
    lower: Option<Mat<f64>>,
    /// The largest number of unknowns among the grids that gave bounds.
    unknowns: usize,
    open_space: OpenSpace,
    /// Where rays to infinity begin, as in [`OpenSpace::distance`].
    distance: f64,
    /// The error of the target that a base leaves; zero without one.
    base_error: f64,
    /// The part of that error that is seen by the body that is added to the base.
    seen_error: f64,
    /// Errors of the grids that gave a result so far, as [`Search::grid_error`] computes them.
    grid_errors: Vec<f64>,
    /// Number of times that the grid was extended into open space because refinement did not help.
    widened: usize,
    /// Whether the next grid is the present one, extended into open space: [`Search::obstacle`] decides.
    wider: bool,
    /// Why the search ends without meeting the tolerance, once it does.
    shortfall: Option<Shortfall>,
    /// Whether the linear solver ended far from its goal on the last grid.
    diverged: bool,
    /// The best result so far, with the relative error of its target.
    best: Option<(f64, SearchResult)>,
}

impl<'p, 's> Search<'p, 's> {
    /// A search that begins with the first grid of a problem.
    ///
    /// # Errors
    /// As for [`GridProblem::first_grid`].
    pub(crate) fn new(problem: &'p GridProblem<'s>) -> Result<Self, SolveError> {
        let settings = problem.settings;
        let tolerance = settings.relative_tolerance.max(MIN_TOLERANCE);
        let open_space = OpenSpace::new(&problem.layout, &problem.floating, settings);
        let distance = open_space.distance(tolerance);
        Ok(Self {
            problem,
            begin: Instant::now(),
            one_state: None,
            tolerance,
            grid: problem.first_grid(distance)?,
            grids: 0,
            expected_missing: f64::INFINITY,
            amplification: 1.0,
            overstated: None,
            last_overstated: None,
            settled: true,
            before: None,
            potentials: None,
            lower: None,
            unknowns: 0,
            open_space,
            distance,
            base_error: problem.base.map_or(0.0, |base| base.spread),
            seen_error: 0.0,
            grid_errors: Vec::new(),
            widened: 0,
            wider: false,
            shortfall: None,
            diverged: false,
            best: None,
        })
    }

    /// The search for one state of several.
    ///
    /// # Errors
    /// As for [`GridProblem::first_grid`].
    pub(crate) fn of_one_state(
        problem: &'p GridProblem<'s>,
        one_state: OneState,
    ) -> Result<Self, SolveError> {
        let mut search = Self::new(problem)?;
        search.grid = problem.first_grid(one_state.distance)?;
        search.distance = one_state.distance;
        search.one_state = Some(one_state);
        Ok(search)
    }

    /// Refines towards a tolerance until an error of at most `accepted`, which is no less than the tolerance,
    /// is proved or estimated. Returns `false` where such an error cannot be reached. May be called again for
    /// a smaller tolerance.
    ///
    /// # Errors
    /// A first grid that is too large, one whose matrices cannot be factorised, a request to stop before
    /// anything is known.
    pub(crate) fn pursue(&mut self, tolerance: f64, accepted: f64) -> Result<bool, SolveError> {
        let problem = self.problem;
        self.tolerance = tolerance.max(MIN_TOLERANCE);
        match self.best.take() {
            None => problem.check_memory(&self.grid)?,
            Some((error, best)) => {
                // Refinement continues from the grid with the best result so far.
                self.grid = best.grid.clone();
                let indicator = best.outcome.indicator(problem);
                let missing = missing(&self.grid, &indicator);
                let met = error <= accepted;
                let obstacle = if met { None } else { self.obstacle(&best.outcome, Some(error), missing) };
                let next = if met {
                    None
                } else {
                    self.next(&indicator, Some(error), missing, obstacle, Purpose::Prove)
                };
                self.potentials = next.is_some().then(|| best.outcome.potentials());
                self.best = Some((error, best));
                match next {
                    Some((grid, left)) => (self.grid, self.expected_missing) = (grid, left),
                    None => return Ok(met),
                }
            }
        }
        loop {
            let purpose = self.purpose();
            let start = Instant::now();
            let solved = match problem.cancelled() {
                true => Err(SolveError::Cancelled),
                false => {
                    let known = self.lower.as_ref().filter(|_| problem.sight.is_none());
                    let lower = match purpose {
                        Purpose::Prove => Lower::Proved { known, accepted },
                        Purpose::Explore | Purpose::Estimate => Lower::None,
                    };
                    let potentials = self.potentials.take();
                    on_grid(problem, &self.grid, self.share(purpose), lower, potentials.as_ref())
                }
            };
            let mut outcome = match solved {
                Err(SolveError::Cancelled) => {
                    self.stop()?;
                    return Ok(false);
                }
                solved => solved?,
            };
            self.grids += 1;
            if let Some(sight) = &problem.sight {
                [self.base_error, self.seen_error] = outcome.base_errors(problem, sight);
            } else if let Some(base) = problem.base {
                let value = problem.settings.target.value(&outcome.bounds.upper);
                let ratio = base.value.zip(value).map_or(1.0, |(base, value)| (base / value).abs());
                self.base_error = base.spread * ratio;
            }
            // Bounds that meet the tolerance need no indicator.
            let proved = (purpose == Purpose::Prove).then(|| outcome.error(problem.settings));
            if proved.is_some() {
                self.lower = Some(outcome.all_conductors.lower.clone());
                // If the lower bounds are from another grid, the larger number of unknowns is reported.
                self.unknowns = self.unknowns.max(outcome.unknowns);
                outcome.unknowns = self.unknowns;
            }
            if let Some(error) = proved.filter(|error| *error <= accepted) {
                self.keep(outcome, error, start.elapsed().as_secs_f64());
                return Ok(true);
            }
            let indicator = outcome.indicator(problem);
            let missing = missing(&self.grid, &indicator);
            let error = self.error(&mut outcome, missing, purpose);
            let met = error.is_some_and(|e| e <= accepted);
            let shortfall = if met { None } else { self.obstacle(&outcome, error, missing) };
            let next = if met { None } else { self.next(&indicator, error, missing, shortfall, purpose) };
            // A grid that is solved once more is still compared with the one before it.
            if next.as_ref().is_some_and(|(_, left)| *left > 0.0) {
                self.before = Some(Coarser { missing, upper: outcome.bounds.upper.clone() });
            }
            self.potentials = next.is_some().then(|| outcome.potentials());
            if let Some(error) = error {
                self.keep(outcome, error, start.elapsed().as_secs_f64());
            }
            match next {
                Some((grid, left)) => (self.grid, self.expected_missing) = (grid, left),
                None => return Ok(met),
            }
        }
    }

    /// The best result so far, with the relative error of its target.
    pub(crate) fn best(&self) -> Option<(f64, &SearchResult)> {
        self.best.as_ref().map(|(error, result)| (*error, result))
    }

    /// The part of an error of the target that is due to the grid, and not to a base. The square roots of the
    /// two parts add up to that of the whole. Where the error of the base cancels, its square root enters in
    /// a product with that of the grid.
    fn grid_error(&self, error: f64) -> f64 {
        if self.problem.sight.is_some() {
            let left = (error - self.seen_error).max(0.0);
            return ((4.0 * self.base_error + left).sqrt() - 2.0 * self.base_error.sqrt()).powi(2);
        }
        (error.sqrt() - self.base_error.sqrt()).max(0.0).powi(2)
    }

    /// The largest ratio of the error after a refinement to the error before it that counts as progress.
    /// Where a solution is added to a base, the last grids start from errors that are small compared with
    /// that of the base.
    fn progress(&self) -> f64 {
        if self.problem.base.is_some() { 0.95 } else { 0.8 }
    }

    /// The foresight from an earlier solve, if there is one; `None`, too, where the solution is added to a
    /// base.
    fn foresight_of_settings(&self) -> Option<Foresight> {
        self.problem.settings.foresight.filter(|_| self.problem.base.is_none())
    }

    /// The factor by which foresight relaxes the goal.
    fn goal_factor(&self) -> f64 {
        let has_foresight = self.foresight_of_settings().is_some();
        let has_margin = self.problem.settings.accepted >= ACCEPTED_MARGIN;
        if has_foresight && has_margin { FORESIGHT_GOAL_FACTOR } else { 1.0 }
    }

    /// What the next grid is solved for.
    fn purpose(&self) -> Purpose {
        let bounds = self.problem.settings.bounds;
        let tolerance = self.grid_error(self.tolerance);
        let expected = if self.problem.is_base() { EXPECTED_OF_BASE } else { self.goal_factor() * EXPECTED };
        let near = 2.0 * self.amplification * self.expected_missing <= expected * tolerance;
        // Where the indicator is unreliable, as on combs, the bounds on the last grid but one show how fine
        // the last must be.
        let last_but_one = self.amplification * self.expected_missing * LONG_STEP <= goal(bounds) * tolerance;
        let is_alone = self.one_state.is_none() && !self.problem.is_base();
        let unsure = bounds && is_alone && !self.settled && self.grid_errors.is_empty();
        match (near || unsure && last_but_one, bounds) {
            (false, _) => Purpose::Explore,
            (true, true) => Purpose::Prove,
            (true, false) => Purpose::Estimate,
        }
    }

    /// Goal of the linear solver: its error over the energy.
    fn share(&self, purpose: Purpose) -> f64 {
        let least = match self.one_state {
            Some(one_state) => one_state.share,
            None if self.problem.is_base() => BASE_SHARE_FACTOR * iteration_share(self.tolerance),
            None => iteration_share(self.tolerance),
        };
        match purpose {
            Purpose::Explore => (0.01 * self.expected_missing.min(0.1)).max(least),
            Purpose::Estimate | Purpose::Prove => least,
        }
    }

    /// The error of the target, if it can be determined yet.
    fn error(&mut self, outcome: &mut Outcome, missing: f64, purpose: Purpose) -> Option<f64> {
        let settings = self.problem.settings;
        match purpose {
            Purpose::Explore => {
                let polarised =
                    if self.problem.is_part { 1.0 } else { outcome.amplification(self.tolerance, settings) };
                let overstated = self.before.as_ref().and_then(|b| outcome.overstated(b, missing, settings));
                self.amplification = polarised / overstated.unwrap_or(1.0);
                self.settled = match (self.last_overstated, overstated) {
                    (Some(before), Some(now)) => (now / before).max(before / now) < 2.0,
                    _ => true,
                };
                self.last_overstated = overstated;
                // From grid to grid the indicator becomes more accurate, as on pairs, or it does not, as on
                // combs. Under a map it does once the grid resolves the bent region.
                let without_progress = if self.problem.layout.map.is_some() { 3.0 } else { 1.4 };
                let margin = match (self.overstated, overstated) {
                    (Some(first), Some(now)) if now > first => without_progress,
                    (Some(_), Some(_)) => 4.0,
                    _ => f64::INFINITY,
                };
                let mut least = USUAL_AMPLIFICATION.min(margin * self.amplification);
                if let Some(Foresight { amplification, error }) = self.foresight_of_settings() {
                    let grown = (error / self.tolerance).max(1.0).powf(AMPLIFICATION_GROWTH);
                    // Where more energy is missing than the last refinement should have left, as under a
                    // punch that is pressed in, the next one will leave more as well. The first refinement is
                    // no evidence: it leaves twice the expected energy on any scene.
                    let short = if self.grids > 2 { (missing / self.expected_missing).max(1.0) } else { 1.0 };
                    least = least.min(amplification * grown * short);
                }
                let least = match self.one_state {
                    Some(_) => ONE_STATE_AMPLIFICATION,
                    // A base must not miss its tolerance by much, since its search is not resumed.
                    None if self.problem.is_base() => USUAL_AMPLIFICATION,
                    None => least,
                };
                self.amplification = self.amplification.max(least);
                self.overstated = self.overstated.or(overstated);
                return None;
            }
            Purpose::Estimate => {
                let beyond = self.open_space.error(self.distance);
                outcome.estimate(self.before.as_ref(), missing, beyond, settings);
            }
            Purpose::Prove => {}
        }
        Some(outcome.error(settings))
    }

    /// The obstacle to further refinement, if there is one.
    fn obstacle(&mut self, outcome: &Outcome, error: Option<f64>, missing: f64) -> Option<Shortfall> {
        // How often a grid may be widened. Not tuned: a limit that ordinary cases do not reach.
        const WIDEST: usize = 3;
        self.wider = false;
        self.diverged = !self.is_usable(outcome, error.unwrap_or(f64::INFINITY));
        if self.diverged {
            return Some(Shortfall::NoConvergence);
        }
        if self.grids >= MAX_GRIDS {
            return Some(Shortfall::MaxGrids { grids: MAX_GRIDS });
        }
        if self.problem.settings.bounds {
            let error = outcome.rounding_error(self.problem);
            if error > self.tolerance {
                return Some(Shortfall::Rounding { error });
            }
        }
        let error = error?;
        if missing > 0.0 {
            self.amplification = (0.5 * self.grid_error(error) / missing).clamp(0.1, 1e3);
        }
        // A finer grid does not reduce the energy of the repair.
        if error <= self.tolerance {
            return Some(Shortfall::DoublePrecision { error });
        }
        let grid_error = self.grid_error(error);
        let stagnates = error.is_nan()
            || outcome.repair_share > 0.5 * error
            || self.grid_errors.last().is_some_and(|before| grid_error > self.progress() * before);
        self.grid_errors.push(grid_error);
        if !stagnates {
            return None;
        }
        // Grids of several states are joined, and must reach equally far.
        let may_widen = self.one_state.is_none() && self.problem.reach.is_none();
        if !self.open_space.is_closed() && self.widened < WIDEST && may_widen {
            self.widened += 1;
            self.wider = true;
            self.grid_errors.clear();
            return None;
        }
        Some(Shortfall::Stagnation { error })
    }

    /// The next grid, with the relative energy that is expected to be missing on it.
    fn next(
        &mut self,
        indicator: &Indicator,
        error: Option<f64>,
        missing: f64,
        obstacle: Option<Shortfall>,
        purpose: Purpose,
    ) -> Option<(Grid, f64)> {
        // How much farther from the pole rays begin on a grid that is extended into open space.
        const WIDER: f64 = 7.0;
        let (problem, settings) = (self.problem, self.problem.settings);
        let tolerance = self.grid_error(self.tolerance);
        let mut grid = self.grid.clone();
        let mut left = missing;
        if obstacle.is_some() {
            self.shortfall = obstacle;
        } else if self.wider {
            self.distance *= WIDER;
            problem.core.reach_to(&mut grid, WIDER * self.grid.radius);
        } else {
            // Once refinements reduce the error as expected, the next step may be large. The first grid is no
            // evidence.
            let as_expected = self.grids > 1 && missing < 2.5 * self.expected_missing;
            let step = if as_expected { LONG_STEP } else { STEP };
            let target = match error {
                Some(error) => {
                    missing * (PROVED_GOAL * tolerance / self.grid_error(error)).clamp(0.03, PROVED_GOAL)
                }
                None => {
                    let goal = self.goal_factor() * goal(settings.bounds);
                    let goal = (goal * tolerance / self.amplification).min(missing);
                    match self.one_state.is_some() || problem.is_base() {
                        // As many equal steps as it takes.
                        true if goal > 0.0 => {
                            let steps = ((missing / goal).ln() / -step.ln()).ceil().max(1.0);
                            missing * (goal / missing).powf(1.0 / steps)
                        }
                        _ => goal.max(step * missing),
                    }
                }
            };
            let farthest = problem.core.size();
            let axes = self.grid.axes.clone();
            left = refine_weighted(&mut grid, indicator, target, |a, e| {
                problem.seen_by.as_ref().map_or(1.0, |sight| sight.weight(a, &axes[a], e, farthest))
            });
        }
        let (memory, unknowns) = (problem.memory(&grid), problem.unknowns(&grid));
        if self.shortfall.is_none() && (memory > settings.memory_limit || unknowns > MAX_UNKNOWNS) {
            self.shortfall = Some(Shortfall::LargeGrid { unknowns, bytes: memory });
        }
        match (&self.shortfall, purpose) {
            (None, _) => Some((grid, left)),
            // The last grid is solved once more, for a result.
            (Some(_), Purpose::Explore) => Some((self.grid.clone(), 0.0)),
            (Some(_), Purpose::Estimate | Purpose::Prove) => None,
        }
    }

    /// [`is_usable`], for estimates only where the linear solver reached its goal.
    fn is_usable(&self, outcome: &Outcome, error: f64) -> bool {
        is_usable(outcome.converged, if self.problem.settings.bounds { error } else { f64::INFINITY })
    }

    /// Keeps the outcome of the present grid if it is usable and the best so far: rounding can make a finer
    /// grid worse than a coarser one.
    fn keep(&mut self, outcome: Outcome, error: f64, seconds: f64) {
        if !self.is_usable(&outcome, error) {
            return;
        }
        if self.best.as_ref().is_none_or(|(best, _)| error <= *best || best.is_nan()) {
            let (grid, grids) = (self.grid.clone(), self.grids);
            self.best = Some((
                error,
                SearchResult { outcome, grid, shortfall: None, grids, choosing: -seconds, foresight: None },
            ));
        }
    }

    /// Stops on request, with the best result so far as the one of the search.
    ///
    /// # Errors
    /// No result has a finite error yet.
    fn stop(&mut self) -> Result<(), SolveError> {
        if !self.best.as_ref().is_some_and(|(error, _)| error.is_finite()) {
            return Err(SolveError::Cancelled);
        }
        self.shortfall = Some(Shortfall::Stopped);
        Ok(())
    }

    /// How the proved error is related to the missing energy that was expected on the last grid. A solution
    /// that is added to a base gives none, since it says nothing about solves without a base.
    fn foresight(&self) -> Option<Foresight> {
        let is_whole = self.problem.settings.bounds && self.problem.base.is_none();
        let (error, _) = self.best.as_ref().filter(|_| is_whole)?;
        let amplification = 0.5 * self.grid_error(*error) / self.expected_missing;
        let is_known = amplification.is_finite() && amplification > 0.0;
        is_known.then_some(Foresight { amplification, error: *error })
    }

    /// The result of the search, whether it met the tolerance or not.
    ///
    /// # Errors
    /// A request to stop before anything was known, a linear solver that did not converge.
    pub(crate) fn finish(self, met: bool) -> Result<SearchResult, SolveError> {
        let foresight = self.foresight().filter(|_| met);
        let Some((_, mut result)) = self.best else {
            return Err(if self.diverged { SolveError::NotConverged } else { SolveError::Cancelled });
        };
        result.shortfall = self.shortfall.filter(|_| !met);
        result.grids = self.grids;
        result.foresight = foresight;
        result.choosing += self.begin.elapsed().as_secs_f64();
        Ok(result)
    }
}
