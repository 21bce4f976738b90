//! Forecasts unknowns, memory and time of the box solver: solves the first small grids and plans the refinement from there to the
//! tolerance without carrying it out.

use crate::SolveError;
use crate::boxes::grid_problem::GridProblem;
use crate::boxes::grid_refinement::{functions_wanted, missing, refine};
use crate::boxes::grid_search::{STEP, goal};
use crate::boxes::layout::Layout;
use crate::boxes::one_grid::{Lower, on_grid};
use crate::boxes::open_space::OpenSpace;
use crate::boxes::resolution::{MAX_UNKNOWNS, MIN_TOLERANCE, first, graded};
use crate::boxes::two_states;
use crate::solution::{Forecast, Settings};
use elastocap_geometry::scene::Scene;

/// Largest number of unknowns of a grid that is solved for a forecast.
const MAX_SMALL_UNKNOWNS: usize = 40_000;

/// Largest number of unknowns times right-hand sides of a grid that is solved for a forecast: some two seconds.
const MAX_SMALL_WORK: usize = 20_000_000;

/// Iterations on a grid that was not solved, and how many times as many functions per axis the last grid has as the first: upper
/// estimates, as observed on scenes of some hundred bodies.
const USUAL_ITERATIONS: f64 = 25.0;
const USUAL_GROWTH: usize = 4;

/// Safety factor on the functions of each axis, for the forecast of memory.
const MARGIN: f64 = 1.12;

/// Seconds per iteration, unknown and axis function on two cores, measured on scenes of one to three conductors.
const PACE: f64 = 1.5e-10;

/// The axes across which the box solver will mirror a scene with such settings, and whether it will use a half turn.
///
/// # Errors
/// A body that is neither a box nor a sheet; more cells than fit into the memory.
pub fn symmetries(scene: &Scene, settings: &Settings) -> Result<([bool; 3], bool), SolveError> {
    let layout = Layout::new(scene, settings.memory_limit)?;
    let mirrored = layout.mirror.map(|m| m.is_some() && settings.symmetry);
    Ok((mirrored, layout.turn.is_some() && settings.symmetry))
}

/// Forecasts unknowns, memory and time of [`crate::solve()`].
///
/// # Errors
/// A body that is neither a box nor a sheet; a first grid that cannot be solved.
pub fn forecast(scene: &Scene, settings: &Settings) -> Result<Forecast, SolveError> {
    let explore = Settings { field: false, ..settings.clone() };
    let problem = GridProblem::new(scene, None, None, &explore)?;
    if let (None, Some(plan)) = (settings.resolution, two_states::plan(scene, &problem)?) {
        let [first, second] = plan.scenes.each_ref().map(|scene| forecast(scene, &plan.settings));
        return Ok(both(first?, second?));
    }
    let tolerance = settings.relative_tolerance.max(MIN_TOLERANCE);
    let distance = OpenSpace::new(&problem.layout, &problem.floating, settings).distance(tolerance);
    let work = |dims: [usize; 3]| dims.iter().product::<usize>() as f64 * dims.iter().sum::<usize>() as f64;
    let solves = problem.parts.iter().map(|p| p.potentials.len()).sum::<usize>();
    let (dims, seconds) = if let Some(level) = settings.resolution {
        let dims = problem.core.domain(&problem.core.grid(&graded(level), distance)).0.primal_dims();
        (dims, PACE * 15.0 * solves as f64 * work(dims))
    } else {
        let mut grid = first(&problem.core, distance);
        problem.check_memory(&grid)?;
        if problem.unknowns(&grid).saturating_mul(solves) > MAX_SMALL_WORK {
            let dims = problem.core.domain(&grid).0.primal_dims().map(|n| USUAL_GROWTH * n);
            let seconds = PACE * USUAL_ITERATIONS * solves as f64 * work(dims);
            return Ok(problem.forecast_of(dims, seconds, solves));
        }
        let mut dims;
        let mut iterations;
        loop {
            let outcome = on_grid(&problem, &grid, 1e-4, Lower::None, None)?;
            let indicator = outcome.indicator(&problem);
            let lacking = missing(&grid, &indicator);
            let goal = goal(settings.bounds) * tolerance / outcome.amplification(tolerance, settings);
            let own = problem.core.domain(&grid).0.primal_dims();
            // Iterations grow little with the grid; the last grid is solved to half as many digits again as this one.
            iterations = 1.5 * outcome.iterations as f64;
            dims = functions_wanted(&grid, &indicator, goal);
            dims = [0, 1, 2].map(|a| dims[a].max(own[a]));
            let mut next = grid.clone();
            refine(&mut next, &indicator, (STEP * lacking).max(goal));
            if lacking <= goal || problem.unknowns(&next) > MAX_SMALL_UNKNOWNS {
                break;
            }
            grid = next;
        }
        (dims, PACE * iterations * work(dims))
    };
    Ok(problem.forecast_of(dims, seconds, solves))
}

/// The forecast for two solves, one after the other.
fn both(a: Forecast, b: Forecast) -> Forecast {
    let larger = |x: usize, y: usize| x.max(y);
    Forecast {
        unknowns: larger(a.unknowns, b.unknowns),
        memory_bytes: a.memory_bytes.max(b.memory_bytes),
        seconds: a.seconds + b.seconds,
        unmirrored: (larger(a.unmirrored.0, b.unmirrored.0), a.unmirrored.1 + b.unmirrored.1),
        mirrored: a.mirrored,
        turned: a.turned,
        right_hand_sides: a.right_hand_sides + b.right_hand_sides,
    }
}

impl GridProblem<'_> {
    /// The forecast for a last grid with `dims` functions on the axes, whose problems for `solves` right-hand sides take so many
    /// seconds one after the other, those of one bound.
    fn forecast_of(&self, dims: [usize; 3], seconds: f64, solves: usize) -> Forecast {
        let bounds = if self.settings.bounds { 2 } else { 1 };
        // The grid is that of a quarter where a half turn leaves a half of the scene.
        let halves = if self.layout.turn.is_some() { 2 } else { 1 };
        let longer = |seconds: f64, times: usize| seconds * (times as f64).powf(4.0 / 3.0);
        let seconds = longer(seconds, halves);
        // No grid is refined beyond the largest number of unknowns.
        let functions = halves as f64 * dims.iter().map(|n| *n as f64).product::<f64>();
        let planned = (f64::from(bounds) * functions).max(1.0);
        let shrink = (MAX_UNKNOWNS as f64 / planned).min(1.0);
        let dims = dims.map(|n| (n as f64 * shrink.cbrt()) as usize);
        let seconds = seconds * shrink.powf(4.0 / 3.0);
        let n: usize = halves * dims.iter().product::<usize>();
        // The earlier grids take about half as long as the last one; the primal and the dual problem share two cores.
        let seconds = seconds * f64::from(bounds) * 1.5 + 2e-3;
        let mirrored = self.layout.mirror.map(|m| m.is_some());
        let copies = halves << mirrored.iter().filter(|m| **m).count();
        let unmirrored = (bounds as usize * n * copies, longer(seconds, copies));
        let (unknowns, seconds) =
            if self.settings.symmetry { (bounds as usize * n, seconds) } else { unmirrored };
        Forecast {
            unknowns,
            memory_bytes: self.memory_of(dims.map(|n| (MARGIN * n as f64).ceil() as usize)),
            seconds,
            unmirrored,
            mirrored: mirrored.map(|m| m && self.settings.symmetry),
            turned: self.layout.turn.is_some() && self.settings.symmetry,
            right_hand_sides: solves,
        }
    }
}
