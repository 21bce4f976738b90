//! The box solver, from a scene to its Maxwell matrix: on a grid of given resolution, or by a search for one.

use crate::boxes::grid_problem::{GridProblem, InFrame};
use crate::boxes::grid_search;
use crate::boxes::scene_map::SceneMap;
use crate::boxes::superposed::{Base, Sight};
use crate::boxes::two_states;
use crate::consistency::contradiction;
use crate::error::SolveError;
use crate::solution::{Settings, Solution};
use elastocap_geometry::scene::Scene;
use std::sync::Arc;
use std::time::Instant;

/// Solves for the Maxwell capacitance matrix of a scene of boxes and sheets, with bounds. Where the tolerance
/// cannot be reached, [`Solution::shortfall`] says why.
///
/// A conductor may consist of several boxes, which may touch, overlap or be disjoint.
///
/// # Errors
/// A body that is neither a box nor a sheet, a grid whose matrices cannot be factorised, a request to stop.
pub fn solve(scene: &Scene, settings: &Settings) -> Result<Solution, SolveError> {
    solve_under(scene, None, settings)
}

/// Solves for the Maxwell capacitance matrix of a scene of boxes and sheets that a map bends, as [`solve`]
/// does of the boxes. The walls of the scene move with the map.
///
/// The integrals of the permittivity tensor under the map are computed by Gauss's rule; the difference to a
/// finer rule is included in the bounds.
///
/// # Errors
/// As for [`solve`]; a map that turns space inside out, or moves points where it ends in the scene.
pub fn solve_mapped(scene: &Scene, map: &Arc<SceneMap>, settings: &Settings) -> Result<Solution, SolveError> {
    solve_under(scene, Some(map), settings)
}

/// Solves for the Maxwell capacitance matrix of a scene under a map, as [`solve_mapped`] does, by adding to
/// the solution of a `base` the change due to bodies that the base does not have. These are conductors that
/// follow those of the base in the scene, and the map bends nothing but the space around them. The solution
/// comes without its field. The source describes the method, in `boxes/superposed`.
///
/// # Errors
/// As for [`solve_mapped`]; [`SolveError::Superposition`] where the scene cannot be solved in this way.
pub fn solve_superposed(
    scene: &Scene,
    map: &Arc<SceneMap>,
    base: &Base,
    settings: &Settings,
) -> Result<Solution, SolveError> {
    let memory_limit = settings.memory_limit.saturating_sub(base.bytes());
    let settings = &Settings { memory_limit, field: false, ..settings.clone() };
    solve_in(scene, Some(map), Some(base), settings)
}

/// Solves a scene that a `map` may bend.
fn solve_under(
    scene: &Scene,
    map: Option<&Arc<SceneMap>>,
    settings: &Settings,
) -> Result<Solution, SolveError> {
    solve_in(scene, map, None, settings)
}

/// Solves a scene that a `map` may bend, as a change of the solution of a `base` if there is one.
fn solve_in(
    scene: &Scene,
    map: Option<&Arc<SceneMap>>,
    base: Option<&Base>,
    settings: &Settings,
) -> Result<Solution, SolveError> {
    let begin = Instant::now();
    if map.is_some_and(|map| !map.is_continuous(scene)) {
        return Err(SolveError::TornMap);
    }
    let in_frame = base.map(|base| InFrame {
        frame: base.frame,
        mirrored: [true; 3],
        reach: 0.0,
        far: 0.0,
        radius: Some(base.radius),
    });
    let mut problem = GridProblem::new(scene, map, in_frame.as_ref(), settings)?;
    problem.base = base;
    if let Some(base) = base.filter(|base| base.cancels) {
        problem.sight = map.and_then(|map| Sight::of(scene, map, base.conductors, &base.frame, 0.0));
        if problem.sight.is_none() {
            return Err(SolveError::Superposition);
        }
    }
    let setup = begin.elapsed().as_secs_f64();
    let result = match settings.resolution {
        Some(level) => grid_search::fixed(&problem, level)?,
        None => match two_states::search(scene, &problem)? {
            Some(result) => result,
            None => grid_search::adaptive(&problem)?,
        },
    };
    // The field of an interrupted solve is not computed. A solve that was complete when the request came
    // keeps its field: its step counts as solved.
    let wanted =
        settings.field && !problem.opposite_alone && (result.shortfall.is_none() || !problem.cancelled());
    let field = wanted.then(|| {
        let straight = result.outcome.field(scene, &problem);
        match map {
            Some(map) => map.bend(straight),
            None => straight,
        }
    });
    let bounds = result.outcome.all_conductors.clone();
    let mut solution = result.outcome.finish(&problem, &result.grid, result.shortfall);
    solution.grids = result.grids;
    solution.seconds.setup += setup;
    solution.seconds.choosing = result.choosing;
    solution.foresight = result.foresight;
    solution.field = field;
    match contradiction(&solution, &bounds, &problem.floating) {
        Some(contradiction) => Err(SolveError::Contradiction(contradiction)),
        None => Ok(solution),
    }
}
