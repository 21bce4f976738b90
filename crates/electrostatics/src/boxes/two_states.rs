//! The mutual capacitance of two conductors from two grids, one for each state.
//!
//! It is the product of two fields: that of one conductor at 1 V, and that of the other. Each is singular at
//! different edges: that of a guarded plate at the slit to its guard, that of the plate opposite at the edge
//! of that plate. One grid for both fields is fine at all edges along all axes. Each of two grids is fine
//! only where its field is singular.
//!
//! On two grids the potentials u_1 and u_2 are still functions of one space, that of the common refinement,
//! and so are the fluxes f_1 and f_2: there the products of gradients, U_ij, and those of fluxes, L_ij
//! ([`crate::boxes::dual::across_grids`]), are computed. U - C is the product of the errors e of the
//! potentials, C - L that of the errors q of the fluxes, both hence positive semidefinite. With G_i = U_ii -
//! L_ii, proved on the grid of state i alone,
//!
//! |(U_12 + L_12) / 2 - C_12| = |(e_1, e_2) - (q_1, q_2)| / 2 <= (|e_1| |e_2| + |q_1| |q_2|) / 2 <= sqrt(G_1
//! G_2) / 2,
//!
//! as |e_i|^2 + |q_i|^2 <= G_i, with equality except for the overestimated energies of repairs and of rays.
//! The inequality of Cauchy and Schwarz is used twice, for U - C and C - L as forms, and once for the sum.
//! One grid for both states proves the same from the same gaps, so that two grids pay where they need fewer
//! unknowns. Without the product of the fluxes, U_12 alone is known to sqrt(G_1 G_2) only.

use crate::boxes::common_line::common_line;
use crate::boxes::domain::{Axis, Domain};
use crate::boxes::grid_problem::GridProblem;
use crate::boxes::grid_refinement::{functions_wanted, missing, refine};
use crate::boxes::grid_search::{OneState, STEP, Search, SearchResult, goal};
use crate::boxes::layout::Grid;
use crate::boxes::one_grid::{Lower, Outcome, error_of, on_grid};
use crate::boxes::open_space::OpenSpace;
use crate::boxes::primal::Primal;
use crate::boxes::resolution::first;
use crate::error::SolveError;
use crate::matrix::{MatrixBounds, contrast_of, of_squares};
use crate::solution::Settings;
use crate::target::Target;
use crate::vacuum::VACUUM_PERMITTIVITY;
use elastocap_geometry::scene::{Potential, Role, Scene};
use faer::Mat;
use std::time::Instant;

/// Largest number of unknowns of two grids, each times its number of right-hand sides, over that of one grid
/// for both states, for which two grids are used. Tuned: `time elastocap run cases/guarded-plate.toml` at
/// tolerances of 1e-2, 1e-3 and 3e-4.
const MAX_COST_RATIO: f64 = 0.8;

/// Goal of the linear solvers over the spread that the energies may have. Tuned:
/// `time elastocap run cases/guarded-plate.toml` at tolerances of 1e-2, 1e-3 and 3e-4.
const SOLVER_SHARE: f64 = 0.01;

/// Accepted error of the energy of the first state over its tolerance; the second state makes up for it.
/// Tuned: `time elastocap run cases/guarded-plate.toml` at tolerances of 1e-2, 1e-3 and 3e-4.
const FIRST_ACCEPTED: f64 = 1.6;

/// Accepted error of the energy of the second state over its tolerance; further refinement of the cheaper
/// state makes up for it. Tuned: `time elastocap run cases/guarded-plate.toml` at tolerances of 1e-2, 1e-3
/// and 3e-4.
const SECOND_ACCEPTED: f64 = 1.3;

/// Number of times that the cheaper state is refined further. Not tuned: a limit that ordinary cases do not
/// reach.
const EXTRA_REFINEMENTS: usize = 4;

/// A plan to solve the two states of a target on two grids.
pub(crate) struct Plan {
    /// The scene with one driven conductor, for each of the two states.
    pub(crate) scenes: [Scene; 2],
    /// Settings for each of them. The tolerance is the relative spread of either energy that meets the
    /// tolerance of the target.
    pub(crate) settings: Settings,
    /// That relative spread.
    spread: f64,
    /// Where rays to infinity begin, as in [`OpenSpace::distance`].
    distance: f64,
    /// The state that takes more unknowns.
    larger: usize,
}

/// Searches for a grid for each state of a mutual capacitance; `None` where one grid for both is better, or
/// where two grids did not meet the tolerance.
///
/// # Errors
/// A grid whose matrices cannot be factorised, a first one that is too large, a request to stop before
/// anything is known.
pub(crate) fn search(scene: &Scene, problem: &GridProblem<'_>) -> Result<Option<SearchResult>, SolveError> {
    let begin = Instant::now();
    let Some(plan) = plan(scene, problem, &mut |_, _| true)? else { return Ok(None) };
    let settings = problem.settings;
    let one_state = OneState { distance: plan.distance, share: SOLVER_SHARE * plan.spread };
    let [first, second] =
        plan.scenes.each_ref().map(|scene| GridProblem::new(scene, None, None, &plan.settings));
    let mut problems = [first?, second?];
    problems.iter_mut().for_each(|problem| problem.keeps_fluxes = true);
    let [first, second] = problems.each_ref().map(|problem| Search::of_one_state(problem, one_state));
    let mut searches = [first?, second?];

    let (larger, smaller) = (plan.larger, 1 - plan.larger);
    let mut may_refine = searches[larger].pursue(plan.spread, FIRST_ACCEPTED * plan.spread)?;
    let proved_error = |search: &Search<'_, '_>| search.best().map_or(f64::INFINITY, |(error, _)| error);
    if may_refine {
        let left = plan.spread * (plan.spread / proved_error(&searches[larger])).clamp(0.25, 4.0);
        may_refine = searches[smaller].pursue(left, SECOND_ACCEPTED * left)?;
    }
    for _ in 0..=EXTRA_REFINEMENTS {
        let [Some((_, a)), Some((_, b))] = searches.each_ref().map(Search::best) else { break };
        let Some(bounds) = joined(problem, a, b)? else { return Ok(None) };
        let error = error_of(&problem.floating.reduced(&bounds), settings);
        let met = error <= settings.relative_tolerance;
        if met || !may_refine {
            if !met && !problem.cancelled() {
                return Ok(None);
            }
            let [a, b] = searches;
            return Ok(Some(merged(problem, bounds, a.finish(met)?, b.finish(met)?, begin)));
        }
        let unknowns = |f: &SearchResult| f.outcome.unknowns;
        let cheaper = usize::from(unknowns(b) < unknowns(a));
        let left = proved_error(&searches[cheaper]) * (settings.relative_tolerance / error).powi(2);
        may_refine = searches[cheaper].pursue(0.9 * left, 0.98 * left)?;
    }
    if problem.cancelled() { Err(SolveError::Cancelled) } else { Ok(None) }
}

/// Whether the target is a mutual capacitance of the only two driven conductors, and both states lie on the
/// same part of the scene.
fn is_suited(problem: &GridProblem<'_>) -> bool {
    let (settings, floating) = (problem.settings, &problem.floating);
    let mutual = matches!(settings.target, Target::Mutual([0, 1] | [1, 0]));
    let mut solved = problem.parts.iter().filter(|part| !part.potentials.is_empty());
    mutual
        && settings.bounds
        && problem.layout.map.is_none()
        && floating.driven.len() == 2
        && floating.floating.is_empty()
        && solved.next().is_some_and(|part| {
            // Fluxes on half of a scene have no products with those on another grid.
            part.potentials.len() == 2 && part.fieldless.is_empty() && part.turn.is_none()
        })
        && solved.next().is_none()
}

/// The scene with one driven conductor; all others are at potential zero.
fn with_one_driven(scene: &Scene, conductor: usize) -> Scene {
    let mut out = scene.clone();
    let conductors = out.bodies.iter_mut().filter_map(|body| match &mut body.role {
        Role::Conductor { potential } => Some(potential),
        Role::Dielectric { .. } => None,
    });
    for (_, potential) in conductors.enumerate().filter(|(c, _)| *c != conductor) {
        *potential = Potential::Grounded;
    }
    out
}

/// A plan for two grids, from two small ones for both states; `None` where one grid for both is better, or
/// where a small grid may not be solved. `may_solve` decides on that, given the number of iterations on the
/// grid before.
///
/// # Errors
/// As for [`search`].
pub(crate) fn plan(
    scene: &Scene,
    problem: &GridProblem<'_>,
    may_solve: &mut impl FnMut(&Grid, Option<usize>) -> bool,
) -> Result<Option<Plan>, SolveError> {
    // Goal of the linear solver on the small grids, which only serve to plan. Not tuned: what a grid misses
    // is much more.
    const SHARE: f64 = 1e-3;
    if !is_suited(problem) {
        return Ok(None);
    }
    let settings = problem.settings;
    let open_space = OpenSpace::new(&problem.layout, &problem.floating, settings);
    let distance = open_space.distance(settings.relative_tolerance);
    let mut grid = first(&problem.core, distance);
    problem.check_memory(&grid)?;
    if !may_solve(&grid, None) {
        return Ok(None);
    }
    let outcome = on_grid(problem, &grid, SHARE, Lower::None, None)?;
    let indicator = outcome.indicator(problem);
    let step = STEP * missing(&grid, &indicator);
    refine(&mut grid, &indicator, step);
    if !may_solve(&grid, Some(outcome.iterations)) {
        return Ok(None);
    }
    let outcome = on_grid(problem, &grid, SHARE, Lower::None, Some(&outcome.potentials()))?;
    let upper = &outcome.bounds.upper;
    let scale = upper[(0, 1)].abs().max(settings.least_scale);
    let spread = settings.relative_tolerance * scale / (upper[(0, 0)] * upper[(1, 1)]).sqrt();
    if !(spread > 0.0 && spread.is_finite()) {
        return Ok(None);
    }
    let unknowns = |target: Target, spread: f64| {
        let indicator = outcome.indicator_of(problem, target);
        functions_wanted(&grid, &indicator, goal(true) * spread).iter().map(|n| *n as f64).product::<f64>()
    };
    // The indicator for both states is the sum of their indicators.
    let one_grid = 2.0 * unknowns(settings.target, 2.0 * spread);
    let two_grids = [0, 1].map(|row| unknowns(Target::Own(row), spread));
    if two_grids[0] + two_grids[1] >= MAX_COST_RATIO * one_grid {
        return Ok(None);
    }
    let scenes = [0, 1].map(|row| with_one_driven(scene, problem.floating.driven[row]));
    let settings = Settings {
        target: Target::Own(0),
        relative_tolerance: spread,
        least_scale: 0.0,
        field: false,
        foresight: None,
        ..settings.clone()
    };
    let larger = usize::from(two_grids[1] > two_grids[0]);
    Ok(Some(Plan { scenes, settings, spread, distance, larger }))
}

/// Bounds on the matrix of all conductors from a grid for each state; `None` where the grids have no common
/// refinement.
fn joined(
    problem: &GridProblem<'_>,
    a: &SearchResult,
    b: &SearchResult,
) -> Result<Option<MatrixBounds>, SolveError> {
    let [Some((first_column, first_part)), Some((second_column, second_part))] =
        [a, b].map(|result| result.outcome.solved.first())
    else {
        return Ok(None);
    };
    let Some(domain) = common(&first_part.domain, &second_part.domain) else { return Ok(None) };
    let potentials = [a, b].map(|result| result.outcome.potentials());
    let embedded = |k: usize, column: usize| Some(potentials[k].on(column, &domain)?.potential(0));
    let (Some(u), Some(v)) = (embedded(0, *first_column), embedded(1, *second_column)) else {
        return Ok(None);
    };
    let mutual = Primal::without_preconditioner(&domain)?.product_of(&u, &v);
    let (Some(fluxes), Some(other_fluxes)) = (&first_part.fluxes, &second_part.fluxes) else {
        return Ok(None);
    };
    let Some(flux_product) = fluxes.joint(0, (other_fluxes, 0), &domain)? else { return Ok(None) };
    let unit = VACUUM_PERMITTIVITY * problem.layout.unit * first_part.copies;
    let n = problem.layout.conductors.len();
    let (mut upper, mut lower) = (Mat::zeros(n, n), Mat::zeros(n, n));
    for (result, &row) in [a, b].into_iter().zip(&problem.floating.driven) {
        let bounds = &result.outcome.bounds;
        upper[(row, row)] = bounds.upper[(0, 0)];
        lower[(row, row)] = bounds.lower[(0, 0)];
        let others = problem.floating.driven.iter().filter(|other| **other != row);
        for &other in others {
            upper[(row, other)] = unit * mutual;
            lower[(row, other)] = unit * flux_product;
        }
    }
    let mut bounds = MatrixBounds { lower, upper };
    let rounding = rounding(&bounds);
    bounds.count_rounding(&rounding, of_squares(contrast_of(&problem.layout.permittivity)));
    if let Some(contradiction) = bounds.crossing() {
        return Err(SolveError::Contradiction(contradiction));
    }
    Ok(Some(bounds))
}

/// The form that the rounding error is proportional to: the states are unit potentials of the conductors.
fn rounding(bounds: &MatrixBounds) -> Mat<f64> {
    let upper = &bounds.upper;
    Mat::from_fn(upper.nrows(), upper.nrows(), |i, j| if i == j { upper[(i, i)].abs() } else { 0.0 })
}

/// The result of both searches, as if both states had been solved on one grid: the grid with more unknowns is
/// the one that is reported.
fn merged(
    problem: &GridProblem<'_>,
    bounds: MatrixBounds,
    a: SearchResult,
    b: SearchResult,
    begin: Instant,
) -> SearchResult {
    let larger = if b.outcome.unknowns > a.outcome.unknowns { &b } else { &a };
    let (grid, grids) = (larger.grid.clone(), a.grids + b.grids);
    let shortfall = a.shortfall.or(b.shortfall);
    let mut outcome = Outcome::empty();
    outcome.rounding = rounding(&bounds);
    outcome.basis = problem.basis();
    outcome.bounds = problem.floating.reduced(&bounds);
    outcome.all_conductors = bounds;
    let mut seconds_of_last_grids = 0.0;
    for (row, of_state) in [a.outcome, b.outcome].into_iter().enumerate() {
        outcome.unknowns = outcome.unknowns.max(of_state.unknowns);
        outcome.iterations += of_state.iterations;
        outcome.converged &= of_state.converged;
        outcome.repair_share = outcome.repair_share.max(of_state.repair_share);
        outcome.seconds.setup += of_state.seconds.setup;
        outcome.seconds.primal += of_state.seconds.primal;
        outcome.seconds.dual += of_state.seconds.dual;
        seconds_of_last_grids += of_state.seconds.setup + of_state.seconds.primal.max(of_state.seconds.dual);
        outcome.solved.extend(of_state.solved.into_iter().map(|(_, part)| (row, part)));
    }
    let choosing = (begin.elapsed().as_secs_f64() - seconds_of_last_grids).max(0.0);
    SearchResult { outcome, grid, shortfall, grids, choosing, foresight: None }
}

/// The common refinement of two grids of the same scene; `None` where they do not end at the same places, or
/// where nodes that should be the same differ.
pub(super) fn common(a: &Domain, b: &Domain) -> Option<Domain> {
    let axis = |k: usize| common_axis(&a.axes[k], &b.axes[k]);
    Some(Domain { axes: [axis(0)?, axis(1)?, axis(2)?], ..a.clone() })
}

/// One axis of the common refinement of two grids, as [`common`] has it.
fn common_axis(a: &Axis, b: &Axis) -> Option<Axis> {
    if a.rays != b.rays || a.walls != b.walls || a.cuts.len() != b.cuts.len() {
        return None;
    }
    let line = common_line(&a.line, &b.line)?;
    // Planes are nodes of both; infinite intervals begin and end the axis.
    let cut = |m: usize| match a.plane_node(m) {
        _ if m == 0 => Some(0),
        _ if m + 1 == a.cuts.len() => Some(line.elements()),
        Some(node) => {
            let plane = a.line.nodes[node];
            line.nodes.iter().position(|x| *x == plane).map(|i| i + line.first_finite())
        }
        None => None,
    };
    let cuts = (0..a.cuts.len()).map(cut).collect::<Option<Vec<usize>>>()?;
    Some(Axis { line, cuts, walls: a.walls, rays: a.rays })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::boxes::grid_search::adaptive;
    use crate::consistency::contradiction;
    use elastocap_geometry::scene::{Body, Box3, Wall};
    use elastocap_geometry::shapes::Shape;

    /// A sheet in the plane x2 = `at` over these ranges of x1 and x3.
    fn sheet(at: f64, x: [f64; 2], z: [f64; 2]) -> Shape {
        Shape::Box(Box3 { min: [x[0], at, z[0]], max: [x[1], at, z[1]] })
    }

    /// A plate with a grounded guard around it and a narrow slit between, opposite to a wide one.
    fn guarded_plate() -> Scene {
        let sense = Body::conductor("sense", sheet(0.0, [-2.0, 2.0], [-2.0, 2.0]));
        let drive = Body::conductor("drive", sheet(0.5, [-5.0, 5.0], [-5.0, 5.0]));
        let mut guard = Body::grounded("guard", sheet(0.0, [2.05, 4.0], [-4.0, 4.0]));
        guard.parts.push(sheet(0.0, [-4.0, -2.05], [-4.0, 4.0]));
        guard.parts.push(sheet(0.0, [-4.0, 4.0], [2.05, 4.0]));
        guard.parts.push(sheet(0.0, [-4.0, 4.0], [-4.0, -2.05]));
        in_open_space(vec![sense, drive, guard])
    }

    fn in_open_space(bodies: Vec<Body>) -> Scene {
        Scene { bodies, background_permittivity: 1.0, domain: Box3::SPACE, walls: [[Wall::Open; 2]; 3] }
    }

    fn settings(target: Target, relative_tolerance: f64) -> Settings {
        Settings { target, relative_tolerance, ..Settings::default() }
    }

    #[test]
    fn a_mutual_capacitance_from_a_grid_for_each_state_meets_that_from_one_for_both() {
        let scene = guarded_plate();
        let fine = settings(Target::Mutual([0, 1]), 5e-3);
        let problem = GridProblem::new(&scene, None, None, &fine).unwrap();
        let grid = adaptive(&problem).unwrap();
        let exact = fine.target.of(&grid.outcome.bounds).unwrap();
        for target in [Target::Mutual([0, 1]), Target::Mutual([1, 0])] {
            let solve_settings = Settings { field: true, ..settings(target, 1e-2) };
            let problem = GridProblem::new(&scene, None, None, &solve_settings).unwrap();
            let found =
                search(&scene, &problem).unwrap().expect("the fields are singular at different edges");
            let bounds = found.outcome.all_conductors.clone();
            let field = found.outcome.field(&scene, &problem);
            let solution = found.outcome.finish(&problem, &found.grid, found.shortfall);
            let measured = solution.measured.unwrap();
            assert!(solution.reached && measured.spread_over_value() <= 1e-2, "{solution:?}");
            assert!(measured.lower <= exact.upper && exact.lower <= measured.upper, "{measured:?} {exact:?}");
            for i in 0..2 {
                let entry = solution.maxwell[i][i];
                let (lower, upper) = (grid.outcome.bounds.lower[(i, i)], grid.outcome.bounds.upper[(i, i)]);
                assert!(entry.lower <= upper && lower <= entry.upper, "{entry:?} {lower} {upper}");
                assert!(entry.spread_over_value() < 5e-3, "{entry:?}");
            }
            assert_eq!(contradiction(&solution, &bounds, &problem.floating), None);
            // The state that is shown is that with 1 V on the conductor that is named first.
            let highest = field.potential.iter().copied().fold(0.0, f64::max);
            assert!((highest - 1.0).abs() < 1e-9, "{highest}");
        }
    }

    #[test]
    fn states_that_are_singular_at_the_same_edges_or_mirror_images_are_left_to_one_grid() {
        let pair = |size: f64| {
            let first = Body::conductor("first", sheet(0.0, [-1.0, -0.05], [-1.0, 1.0]));
            let second = Body::conductor("second", sheet(0.0, [0.05, size], [-1.0, 1.0]));
            in_open_space(vec![first, second])
        };
        let settings = settings(Target::Mutual([0, 1]), 5e-3);
        for scene in [pair(1.0), pair(1.2)] {
            let problem = GridProblem::new(&scene, None, None, &settings).unwrap();
            assert!(search(&scene, &problem).unwrap().is_none());
        }
    }

    #[test]
    fn other_targets_and_solves_without_bounds_are_left_to_one_grid() {
        let scene = guarded_plate();
        let others = [Target::Matrix, Target::TwoTerminal, Target::Own(0), Target::Mutual([1, 1])];
        let without = Settings { bounds: false, ..settings(Target::Mutual([0, 1]), 1e-2) };
        for settings in others.map(|target| settings(target, 1e-2)).into_iter().chain([without]) {
            let problem = GridProblem::new(&scene, None, None, &settings).unwrap();
            assert!(search(&scene, &problem).unwrap().is_none(), "{:?}", settings.target);
        }
    }
}
