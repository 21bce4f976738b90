//! The solution of a scene without the body that comes near: solved once, for all positions of the body.

use crate::boxes::grid_problem::{GridProblem, InFrame};
use crate::boxes::grid_refinement::{missing, refine};
use crate::boxes::grid_search::{STEP, Search};
use crate::boxes::layout::{Frame, Layout};
use crate::boxes::one_grid::{Lower, on_grid};
use crate::boxes::open_space::OpenSpace;
use crate::boxes::scene_map::SceneMap;
use crate::boxes::superposed::{Added, Base, BasePart, Sight};
use crate::boxes::symmetry::Part;
use crate::error::SolveError;
use crate::floating::Floating;
use crate::solution::Settings;
use elastocap_geometry::scene::Scene;
use rayon::prelude::*;
use std::sync::Arc;

/// Largest accepted spread of a base, over the tolerance of the scenes. Tuned: time the runs of the balls in
/// docs/change.md, section "Reach".
const MAX_SPREAD: f64 = 0.8;

/// Largest accepted spread of a base, over the spread aimed for. Tuned: time the runs of the balls in
/// docs/change.md, section "Reach".
const MAX_SPREAD_OF_GOAL: f64 = 2.0;

/// What is to be added to a base: the reach of the scenes, their effect on the target, and the accuracy that
/// they need.
#[derive(Debug, Clone, Copy)]
pub struct Additions {
    /// Distance from the middle of the conductors beyond which no face of any scene lies, m.
    pub reach: f64,
    /// The largest change of the target that they cause, over its value without them; 1 if nothing is known
    /// of it. It decides where the grids end in open space: bounds hold whatever is given, but too small a
    /// value makes them wide.
    pub change: f64,
    /// Relative spread of the base to aim for, over the tolerance of the scenes.
    pub share: f64,
    /// Set where only differences between the scenes need to meet the tolerance: how much nearer to the
    /// conductors of the base than in the given scene the body may come, m.
    pub nearer: Option<f64>,
}

/// Largest share of the error of a base that a body may see where the error is to cancel. Tuned: time the
/// runs of the balls in docs/change.md, section "Reach".
const MAX_SEEN: f64 = 0.35;

/// The error of each part of a base that a body may see, over the tolerance. Tuned: time the runs of the
/// balls in docs/change.md, section "Reach".
const SEEN: f64 = 0.2;

/// Largest error of a part, over the tolerance: it enters in a product with the error of the added solution.
/// Tuned: time the runs of the balls in docs/change.md, section "Reach".
const MAX_PART_ERROR: f64 = 1.2;

/// Largest error that the base may cause by itself, over the tolerance. Tuned: time the runs of the balls in
/// docs/change.md, section "Reach".
const MAX_BASE_ERROR: f64 = 0.6;

/// Largest relative error of a part. Tuned: time the runs of the balls in docs/change.md, section
/// "Reach".
const MAX_RELATIVE_PART_ERROR: f64 = 0.1;

/// Least distance at which rays begin, over the distance of the farthest face: twice as far as any plane, and
/// a little more because the two distances are measured from different points.
const NEAREST: f64 = 2.5;

/// Energy of the added solution over the change of the target, for the choice of where the grids end. Tuned:
/// time the runs of the balls in docs/change.md, section "Reach".
const ENERGY_OVER_CHANGE: f64 = 2.0;

/// Solves a scene as the base of others, for the tolerance of those. `like` is one of them; all have its
/// symmetry. `None` where the scene cannot serve as a base.
///
/// # Errors
/// The errors of [`crate::solve`].
pub fn solve_base(
    scene: &Scene,
    like: (&Scene, &Arc<SceneMap>),
    additions: Additions,
    settings: &Settings,
) -> Result<Option<Base>, SolveError> {
    let frame = Frame::of(scene)?;
    let like_layout = Layout::in_frame(like.0, Some(like.1), Some(frame), settings.memory_limit)?;
    let mirrored = like_layout.mirror.map(|plane| plane.is_some());
    let settings = Settings { field: false, ..settings.clone() };
    let tolerance = settings.relative_tolerance;
    let of_energy = tolerance / (ENERGY_OVER_CHANGE * additions.change).min(1.0);
    let far = OpenSpace::new(&like_layout, &Floating::new(like.0), &settings).distance(of_energy);
    let in_frame =
        InFrame { frame, mirrored, reach: additions.reach / frame.unit, far: far.max(NEAREST), radius: None };
    let sight = additions.nearer.and_then(|nearer| sight(scene, like, &frame, nearer, &settings));
    let mut base = Base {
        conductors: scene.conductors().count(),
        frame,
        radius: 0.0,
        parts: Vec::new(),
        spread: 0.0,
        cancels: false,
        value: None,
        unknowns: 0,
    };
    let problem = GridProblem::new(scene, None, Some(&in_frame), &settings)?;
    let farthest = problem.core.size();
    if let Some(sight) = sight.filter(|sight| sight.is_far(farthest)) {
        base.cancels = true;
        if base.solve_in_parts((scene, like), &problem, &in_frame, &sight)? {
            return Ok(Some(base));
        }
        base.cancels = false;
        (base.parts, base.spread, base.value, base.unknowns) = (Vec::new(), 0.0, None, 0);
    }
    let goal = additions.share * tolerance;
    let accepted = (MAX_SPREAD_OF_GOAL * additions.share).min(MAX_SPREAD) * tolerance;
    Ok(if base.solve(problem, goal, accepted)? { Some(base) } else { None })
}

/// Missing energy of the rough solution from which [`weights`] are found, over its energy: the shares of the
/// parts are then known to a twentieth.
const ROUGH_ENERGY: f64 = 0.2;

/// Error of the linear solver of that rough solution, over its energy.
const ROUGH_SHARE: f64 = 1e-3;

/// For each part, the spread of the target that a gap as large as the energies of the part would cause, over
/// the target's value; from a small grid.
fn weights(problem: &GridProblem<'_>) -> Result<Vec<f64>, SolveError> {
    let settings = problem.settings;
    let far =
        OpenSpace::new(&problem.layout, &problem.floating, settings).distance(settings.relative_tolerance);
    let mut grid = problem.first_grid(far)?;
    loop {
        problem.check_memory(&grid)?;
        let rough = on_grid(problem, &grid, ROUGH_SHARE, Lower::None, None)?;
        let indicator = rough.indicator(problem);
        let missing = missing(&grid, &indicator);
        if missing <= ROUGH_ENERGY {
            return Ok(rough.of_gaps(problem, |part| part.energies.matrix.clone()));
        }
        let unknowns = problem.unknowns(&grid);
        refine(&mut grid, &indicator, (STEP * missing).max(0.5 * ROUGH_ENERGY));
        if problem.unknowns(&grid) == unknowns {
            return Ok(rough.of_gaps(problem, |part| part.energies.matrix.clone()));
        }
    }
}

/// The part of the error of a base that the body of a scene sees, where the error can cancel.
fn sight(
    base: &Scene,
    (scene, map): (&Scene, &Arc<SceneMap>),
    frame: &Frame,
    nearer: f64,
    settings: &Settings,
) -> Option<Sight> {
    let can_cancel = settings.target.is_linear(scene.driven().count())
        && scene.floating().next().is_none()
        && scene.conductors().count() > base.conductors().count();
    let sight = || Sight::of(scene, map, base.conductors().count(), frame, nearer);
    can_cancel.then(sight).flatten().filter(|sight| sight.share(false) <= MAX_SEEN)
}

impl Base {
    /// Solves each part on a separate grid, so that the error cancels in differences between the scenes that
    /// are added. Returns whether the base is then accurate enough; if not, the body sees more of the error
    /// than was expected.
    fn solve_in_parts(
        &mut self,
        (scene, like): (&Scene, (&Scene, &Arc<SceneMap>)),
        problem: &GridProblem<'_>,
        in_frame: &InFrame,
        sight: &Sight,
    ) -> Result<bool, SolveError> {
        let settings = problem.settings;
        let tolerance = settings.relative_tolerance;
        let weights = weights(problem)?;
        let solved = (0..problem.parts.len()).filter(|k| !problem.parts[*k].potentials.is_empty());
        for (k, weight) in solved.zip(&weights) {
            let mut part_problem = GridProblem::new(scene, None, Some(in_frame), settings)?;
            let is_odd = part_problem.parts[k].odd.contains(&true);
            part_problem.leave_part(k);
            part_problem.seen_by = Some(*sight);
            let goal = (SEEN / sight.share(is_odd)).min(MAX_PART_ERROR) * tolerance / weight;
            let goal = if goal.is_finite() { goal.min(MAX_RELATIVE_PART_ERROR) } else { return Ok(false) };
            if !self.solve(part_problem, goal, MAX_SPREAD_OF_GOAL * goal)? {
                return Ok(false);
            }
        }
        match self.least_apart(like, sight, settings) {
            Ok(apart) => {
                let total: f64 = apart.iter().zip(&weights).map(|(apart, weight)| apart * weight).sum();
                Ok(total <= MAX_BASE_ERROR * tolerance)
            }
            Err(SolveError::Superposition) => Ok(false),
            Err(other) => Err(other),
        }
    }

    /// [`Added::least_apart`] of each part.
    fn least_apart(
        &self,
        like: (&Scene, &Arc<SceneMap>),
        sight: &Sight,
        settings: &Settings,
    ) -> Result<Vec<f64>, SolveError> {
        let in_frame = InFrame {
            frame: self.frame,
            mirrored: [true; 3],
            reach: 0.0,
            far: 0.0,
            radius: Some(self.radius),
        };
        let problem = GridProblem::new(like.0, Some(like.1), Some(&in_frame), settings)?;
        let grid = problem.first_grid(0.0)?.reflected(problem.reflected);
        let solved = problem.parts.iter().filter(|part| !part.potentials.is_empty());
        let of_part = |part: &Part| {
            let (domain, held) = part.layout.domain(&grid);
            Added::new(self, part, &domain, &held)?.least_apart(&domain, sight)
        };
        let solved: Vec<&Part> = solved.collect();
        solved.into_par_iter().map(of_part).collect()
    }

    /// Solves the parts of a problem and stores them. Returns whether the accepted error was reached, on a
    /// grid that ends where those of the parts solved before do.
    fn solve(&mut self, mut problem: GridProblem<'_>, goal: f64, accepted: f64) -> Result<bool, SolveError> {
        problem.keeps_fluxes = true;
        let mut search = Search::new(&problem)?;
        let met = search.pursue(goal, accepted)?;
        let result = search.finish(met)?;
        let ends_elsewhere = !self.parts.is_empty() && self.radius != result.grid.radius;
        if !met || ends_elsewhere {
            return Ok(false);
        }
        let settings = problem.settings;
        self.radius = result.grid.radius;
        self.spread += result.outcome.error(settings);
        let value = match self.cancels {
            true => settings.target.within(&result.outcome.bounds).map(|target| target.value),
            false => settings.target.value(&result.outcome.bounds.upper),
        };
        self.value = value.map(|value| self.value.unwrap_or(0.0) + value);
        self.unknowns = self.unknowns.max(result.outcome.unknowns);
        let solved = problem.parts.iter().filter(|part| !part.potentials.is_empty());
        for (part, (_, solved)) in solved.zip(result.outcome.solved) {
            let (Some(mut fluxes), Some(lower)) = (solved.fluxes, solved.lower) else { return Ok(false) };
            fluxes.prepare()?;
            self.parts.push(BasePart {
                odd: part.odd,
                potentials: part.potentials.clone(),
                domain: solved.domain,
                coefficients: solved.energies.coefficients,
                upper: solved.energies.matrix,
                lower,
                fluxes,
            });
        }
        Ok(true)
    }
}
