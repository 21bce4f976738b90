//! Forecasts unknowns, memory and time of the box solver: solves the first small grids and plans the
//! refinement from there to the tolerance without carrying it out.
//!
//! The work of a forecast is counted beforehand, and where it is too much the forecast is a rough one. So a
//! forecast takes seconds whatever the scene, and does not depend on the load of the machine.

use crate::boxes::conductor_free::{Work, free_boxes_within};
use crate::boxes::domain::Block;
use crate::boxes::grid_problem::GridProblem;
use crate::boxes::grid_refinement::{functions_wanted, missing, refine};
use crate::boxes::grid_search::{STEP, goal};
use crate::boxes::layout::{Grid, Layout};
use crate::boxes::one_grid::{Lower, on_grid};
use crate::boxes::open_space::OpenSpace;
use crate::boxes::primal::axis_keys;
use crate::boxes::primal::terms::separable_terms;
use crate::boxes::resolution::{MAX_UNKNOWNS, MIN_TOLERANCE, USUAL_OVERLAP, first, graded};
use crate::boxes::two_states;
use crate::error::SolveError;
use crate::solution::{Forecast, Settings};
use elastocap_geometry::scene::{Potential, Scene};
use std::collections::BTreeMap;

/// Largest number of unknowns of a grid that is solved for a forecast. Measured: `benches/forecast.py`.
const MAX_SMALL_UNKNOWNS: usize = 40_000;

/// Largest memory of the cells of a layout that is made for a forecast, bytes. Not tuned: a limit that
/// ordinary cases do not reach.
const MAX_LAYOUT: u64 = 40 << 20;

/// Largest work on the conductor-free boxes of all grids of a forecast together, as [`Work`] counts it: about
/// a second.
const MAX_ENUMERATION: u64 = 200_000_000;

/// Processor seconds that one small grid may take, estimated by counting. Not tuned: what `check` may take.
const MAX_SECONDS: f64 = 2.0;

/// Processor seconds that all small grids together may take, estimated by counting. Not tuned: what `check`
/// may take.
const MAX_TOTAL_SECONDS: f64 = 5.0;

/// Bytes that the preconditioner of a small grid may have. Not tuned: what `check` may take.
const MAX_PRECONDITIONER: f64 = 60e6;

/// Processor seconds per entry of a conductor-free box, iteration and function of an axis. It only decides
/// whether a forecast solves a grid.
const BOX_PACE: f64 = 1.5e-10;

/// Processor seconds per function of a term of the permittivity and iteration. It only decides whether a
/// forecast solves a grid.
const TERM_PACE: f64 = 3e-8;

/// Processor seconds for the modes of an interval with n functions, over n^3. It only decides whether a
/// forecast solves a grid.
const MODES_PACE: f64 = 2e-8;

/// Iterations on the first grid for each right-hand side: 15 for a few boxes, 30 to 48 for some bodies of
/// several permittivities. It only decides whether a forecast solves a grid.
const FIRST_ITERATIONS: f64 = 40.0;

/// Work per cell of a box to average a permittivity that is not a product, as [`Work`] counts it. It only
/// decides whether a forecast solves a grid.
const MEAN_WORK: usize = 16;

/// Approximate number of grids that are solved for a forecast: each lists the conductor-free boxes of every
/// part again. It only divides [`MAX_ENUMERATION`].
const GRIDS: u64 = 4;

/// Entries of all conductor-free boxes over those of the array, where they are too many to be listed.
/// Measured: `benches/forecast.py --drawn 200`.
const ROUGH_OVERLAP: f64 = 30.0;

/// Iterations for each right-hand side on a grid where none was counted: an upper estimate, as observed on
/// scenes of some hundred bodies. Measured: `benches/forecast.py --drawn 200`.
const USUAL_ITERATIONS: f64 = 25.0;

/// Ratio of the functions per axis of the last grid to those of the first: an upper estimate, as observed on
/// scenes of some hundred bodies. Measured: `benches/forecast.py --drawn 200`.
const USUAL_GROWTH: usize = 4;

/// Safety factor on the functions of each axis, for the forecast of memory. Measured: `benches/forecast.py`.
const MARGIN: f64 = 1.12;

/// Missing share of the energy on the last small grid above which larger safety factors are used. Such a grid
/// does not show how far the search will refine, least of all for a small capacitance, which is a difference
/// of large energies. Measured: `benches/forecast.py`, and `benches/forecast.py --drawn 200` on other scenes.
const LARGE_MISSING: f64 = 0.1;

/// [`MARGIN`] where more than [`LARGE_MISSING`] is missing. Measured: `benches/forecast.py`, and
/// `benches/forecast.py --drawn 200` on other scenes.
const LARGE_MISSING_MARGIN: f64 = 1.9;

/// Safety factor on the time where more than [`LARGE_MISSING`] is missing. Measured: `benches/forecast.py`,
/// and `benches/forecast.py --drawn 200` on other scenes.
const LARGE_MISSING_TIMES: f64 = 3.0;

/// Seconds per iteration, unknown and axis function on two cores, measured on scenes of one to three
/// conductors. Measured: `benches/forecast.py`.
const PACE: f64 = 1.5e-10;

/// The axes across which the box solver will mirror a scene with such settings, and whether it will use a
/// half turn; none for a scene with too many cells to be laid out for a forecast.
///
/// # Errors
/// A body that is neither a box nor a sheet; more cells than fit into the memory.
pub fn symmetries(scene: &Scene, settings: &Settings) -> Result<([bool; 3], bool), SolveError> {
    let Some(layout) = small_layout(scene, settings)? else { return Ok(([false; 3], false)) };
    let mirrored = layout.mirror.map(|m| m.is_some() && settings.symmetry);
    Ok((mirrored, layout.turn.is_some() && settings.symmetry))
}

/// The layout of a scene; `None` if it has too many cells to be laid out for a forecast.
///
/// # Errors
/// As [`symmetries`].
fn small_layout(scene: &Scene, settings: &Settings) -> Result<Option<Layout>, SolveError> {
    match Layout::new(scene, MAX_LAYOUT.min(settings.memory_limit)) {
        Ok(layout) => Ok(Some(layout)),
        Err(SolveError::TooLarge { bytes, .. }) if bytes <= settings.memory_limit => Ok(None),
        Err(SolveError::TooLarge { bytes, .. }) => {
            Err(SolveError::TooLarge { bytes, limit: settings.memory_limit })
        }
        Err(error) => Err(error),
    }
}

/// The effort that all forecasts of a plan together may still take.
#[derive(Debug)]
pub struct Effort {
    /// Processor seconds, estimated by counting.
    seconds: f64,
}

impl Default for Effort {
    fn default() -> Self {
        Self { seconds: MAX_TOTAL_SECONDS }
    }
}

/// Forecasts unknowns, memory and time of [`crate::solve()`], and deducts the work from `effort`.
///
/// # Errors
/// A body that is neither a box nor a sheet; a first grid that cannot be solved.
pub fn forecast(scene: &Scene, settings: &Settings, effort: &mut Effort) -> Result<Forecast, SolveError> {
    if small_layout(scene, settings)?.is_none() {
        return Ok(of_largest_grid(scene, settings));
    }
    let explore = Settings { field: false, ..settings.clone() };
    let problem = GridProblem::new(scene, None, None, &explore)?;
    let tolerance = settings.relative_tolerance.max(MIN_TOLERANCE);
    let distance = OpenSpace::new(&problem.layout, &problem.floating, settings).distance(tolerance);
    let cost = Cost::of(&problem, &first(&problem.core, distance));
    let overlap = cost.as_ref().map_or(ROUGH_OVERLAP, |cost| cost.overlap);
    let mut take = |grid: &Grid, iterations: Option<usize>| match &cost {
        Some(cost) => cost.take(&problem, grid, iterations, effort),
        None => false,
    };
    if settings.resolution.is_none()
        && let Some(plan) = two_states::plan(scene, &problem, &mut take)?
    {
        let [first, second] = plan.scenes.each_ref().map(|scene| forecast(scene, &plan.settings, effort));
        return Ok(consecutive(first?, second?));
    }
    let work = |dims: [usize; 3]| dims.iter().product::<usize>() as f64 * dims.iter().sum::<usize>() as f64;
    let solves = problem.parts.iter().map(|p| p.potentials.len()).sum::<usize>();
    let (dims, seconds, margin) = if let Some(level) = settings.resolution {
        let dims = problem.core.domain(&problem.core.grid(&graded(level), distance)).0.primal_dims();
        // About 15 iterations for each right-hand side.
        (dims, PACE * 15.0 * solves as f64 * work(dims), MARGIN)
    } else {
        let mut grid = first(&problem.core, distance);
        problem.check_memory(&grid)?;
        if !take(&grid, None) {
            let dims = problem.core.domain(&grid).0.primal_dims().map(|n| USUAL_GROWTH * n);
            let pace = PACE * (overlap / USUAL_OVERLAP).max(1.0);
            let seconds = pace * USUAL_ITERATIONS * solves as f64 * work(dims);
            let rough = problem.forecast_of(dims, seconds, solves, overlap, MARGIN);
            return Ok(Forecast { is_rough: true, ..rough });
        }
        let mut dims;
        let mut iterations;
        let mut misses_much;
        loop {
            let outcome = on_grid(&problem, &grid, 1e-4, Lower::None, None)?;
            let indicator = outcome.indicator(&problem);
            let missing_energy = missing(&grid, &indicator);
            misses_much = missing_energy > LARGE_MISSING;
            let goal = goal(settings.bounds) * tolerance / outcome.amplification(tolerance, settings);
            let current = problem.core.domain(&grid).0.primal_dims();
            // Iterations grow little with the grid; the last grid is solved to half as many digits more than
            // this one.
            iterations = 1.5 * outcome.iterations as f64;
            dims = functions_wanted(&grid, &indicator, goal);
            dims = [0, 1, 2].map(|a| dims[a].max(current[a]));
            let mut next = grid.clone();
            refine(&mut next, &indicator, (STEP * missing_energy).max(goal));
            if missing_energy <= goal
                || problem.unknowns(&next) > MAX_SMALL_UNKNOWNS
                || !take(&next, Some(outcome.iterations))
            {
                break;
            }
            grid = next;
        }
        let (times, margin) =
            if misses_much { (LARGE_MISSING_TIMES, LARGE_MISSING_MARGIN) } else { (1.0, MARGIN) };
        (dims, times * PACE * iterations * work(dims), margin)
    };
    Ok(problem.forecast_of(dims, seconds, solves, overlap, margin))
}

/// The forecast for two solves, one after the other.
fn consecutive(a: Forecast, b: Forecast) -> Forecast {
    let larger = |x: usize, y: usize| x.max(y);
    Forecast {
        unknowns: larger(a.unknowns, b.unknowns),
        memory_bytes: a.memory_bytes.max(b.memory_bytes),
        seconds: a.seconds + b.seconds,
        unmirrored: (larger(a.unmirrored.0, b.unmirrored.0), a.unmirrored.1 + b.unmirrored.1),
        mirrored: a.mirrored,
        turned: a.turned,
        right_hand_sides: a.right_hand_sides + b.right_hand_sides,
        is_rough: a.is_rough || b.is_rough,
    }
}

/// The forecast for a scene with too many cells to be laid out: the cost of a solve on the largest possible
/// grid.
fn of_largest_grid(scene: &Scene, settings: &Settings) -> Forecast {
    let right_hand_sides =
        scene.conductors().filter(|conductor| conductor.potential != Potential::Grounded).count().max(1);
    let functions_per_axis = (MAX_UNKNOWNS as f64 / 2.0).cbrt();
    let seconds = 2.0
        * PACE
        * ROUGH_OVERLAP
        * USUAL_ITERATIONS
        * right_hand_sides as f64
        * 3.0
        * functions_per_axis.powi(4);
    Forecast {
        unknowns: MAX_UNKNOWNS,
        // No grid is solved that would not fit.
        memory_bytes: settings.memory_limit,
        seconds,
        unmirrored: (MAX_UNKNOWNS, seconds),
        mirrored: [false; 3],
        turned: false,
        right_hand_sides,
        is_rough: true,
    }
}

/// The cost of a problem on its first grid.
struct Cost {
    /// Entries of all conductor-free boxes over those of the array.
    overlap: f64,
    /// Unknowns of the grid.
    unknowns: f64,
    /// Processor seconds before the iterations.
    setup: f64,
    /// Processor seconds per iteration.
    iteration: f64,
    /// Number of iterations for all right-hand sides.
    iterations: f64,
    /// Bytes of the preconditioner.
    bytes: f64,
}

impl Cost {
    /// Counts the cost on a grid; `None` if there are too many boxes to be listed.
    fn of(problem: &GridProblem<'_>, grid: &Grid) -> Option<Self> {
        let parts = || problem.parts.iter().filter(|part| !part.potentials.is_empty());
        let mut work = Work { left: MAX_ENUMERATION / (GRIDS * parts().count() as u64 + 1) };
        let (domain, _) = problem.core.domain(grid);
        let boxes = free_boxes_within(&domain, &mut work)?;
        let dims = domain.primal_dims();
        let array = dims.iter().product::<usize>().max(1) as f64;
        let product = domain.product();
        let (mut entries, mut products) = (0.0, 0.0);
        let mut modes = BTreeMap::new();
        for free_box in &boxes {
            let cells = if product.is_some() { 0 } else { MEAN_WORK * free_box.volume() };
            work.count(domain.permittivity.len() + cells)?;
            let shape = [0, 1, 2].map(|a| {
                domain.axes[a].open(free_box.block.lo[a], free_box.block.hi[a], free_box.held[a]).len()
            });
            let volume = shape.iter().map(|n| *n as f64).product::<f64>();
            entries += volume;
            products += volume * shape.iter().sum::<usize>() as f64;
            modes.extend(axis_keys(&domain, free_box).into_iter().zip(shape));
        }
        let functions = |block: &Block| {
            let of_axis = |a: usize| domain.axes[a].closed(block.lo[a], block.hi[a]).len() as f64;
            of_axis(0) * of_axis(1) * of_axis(2)
        };
        let terms: f64 = separable_terms(&domain).iter().map(|(block, _)| functions(block)).sum();
        let cubed = modes.values().map(|n| (*n as f64).powi(3)).sum::<f64>();
        let squared = modes.values().map(|n| (*n as f64).powi(2)).sum::<f64>();
        let right_hand_sides = parts().map(|part| part.potentials.len()).sum::<usize>() as f64;
        Some(Self {
            overlap: entries / array,
            unknowns: problem.unknowns(grid) as f64,
            setup: parts().count() as f64 * MODES_PACE * cubed,
            iteration: BOX_PACE * products + TERM_PACE * terms,
            iterations: right_hand_sides * FIRST_ITERATIONS,
            bytes: 8.0 * (entries + squared),
        })
    }

    /// Decides whether a grid of the same scene is solved for a forecast, and if so deducts its cost from
    /// `effort`; `iterations` are those on the grid before.
    fn take(
        &self,
        problem: &GridProblem<'_>,
        grid: &Grid,
        iterations: Option<usize>,
        effort: &mut Effort,
    ) -> bool {
        let larger = (problem.unknowns(grid) as f64 / self.unknowns).max(1.0);
        let bytes = larger * self.bytes + problem.memory(grid) as f64 / 2.0;
        let iterations = iterations.map_or(self.iterations, |known| known as f64);
        let seconds = larger.powf(4.0 / 3.0) * (self.setup + iterations * self.iteration);
        let is_small = seconds <= MAX_SECONDS.min(effort.seconds) && bytes <= MAX_PRECONDITIONER;
        if is_small {
            effort.seconds -= seconds;
        }
        is_small
    }
}

impl GridProblem<'_> {
    /// The forecast for a last grid with `dims` functions on the axes, whose problems of one bound for
    /// `solves` right-hand sides take `seconds` one after the other. The conductor-free boxes together have
    /// `overlap` times the entries of the array. Memory is that for `margin` times as many functions on each
    /// axis.
    fn forecast_of(
        &self,
        dims: [usize; 3],
        seconds: f64,
        solves: usize,
        overlap: f64,
        margin: f64,
    ) -> Forecast {
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
        // The earlier grids take about half as long as the last one; the primal and the dual problem share
        // two cores.
        let seconds = seconds * f64::from(bounds) * 1.5 + 2e-3;
        let mirrored = self.layout.mirror.map(|m| m.is_some());
        let copies = halves << mirrored.iter().filter(|m| **m).count();
        let unmirrored = (bounds as usize * n * copies, longer(seconds, copies));
        let (unknowns, seconds) =
            if self.settings.symmetry { (bounds as usize * n, seconds) } else { unmirrored };
        let larger = dims.map(|n| (margin * n as f64).ceil() as usize);
        // Two buffers in single precision for each box, of which the memory of a grid has the usual number.
        let entries = larger.iter().map(|n| *n as f64).product::<f64>();
        let boxes = 8.0 * f64::from(bounds) * (overlap - USUAL_OVERLAP).max(0.0) * entries;
        Forecast {
            unknowns,
            memory_bytes: self.memory_of(larger) + boxes as u64,
            seconds,
            unmirrored,
            mirrored: mirrored.map(|m| m && self.settings.symmetry),
            turned: self.layout.turn.is_some() && self.settings.symmetry,
            right_hand_sides: solves,
            is_rough: false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use elastocap_geometry::scene::{Body, Box3, Wall};
    use elastocap_geometry::shapes::Shape;

    #[test]
    fn forecasts_of_a_plan_share_their_effort_and_are_rough_when_it_is_spent() {
        let cube = |at: f64, size: f64| Shape::Box(Box3 { min: [at, 0.0, 0.0], max: [at + size, 1.0, 1.1] });
        let mut scene = Scene {
            bodies: vec![Body::conductor("one", cube(0.0, 1.0)), Body::conductor("other", cube(2.0, 0.7))],
            background_permittivity: 1.0,
            domain: Box3::SPACE,
            walls: [[Wall::Open; 2]; 3],
        };
        scene.bodies.push(Body::dielectric("between", cube(1.2, 0.6), 7.0));
        let (settings, mut effort) = (Settings::default(), Effort::default());
        let mut left = effort.seconds;
        let first = forecast(&scene, &settings, &mut effort).unwrap();
        assert!(!first.is_rough && effort.seconds < left, "{first:?} {effort:?}");
        left = effort.seconds;
        let again = forecast(&scene, &settings, &mut effort).unwrap();
        assert!(again == first && effort.seconds < left, "{again:?} {effort:?}");
        effort.seconds = 0.0;
        let last = forecast(&scene, &settings, &mut effort).unwrap();
        assert!(last.is_rough && effort.seconds == 0.0, "{last:?} {effort:?}");
    }
}
