//! Entry points of the solver for extruded scenes: recognition, forecast and solution.

use super::family::Level;
use super::layout::Layout;
use super::search::{ExtrudedSolution, Search};
use super::size::Size;
use crate::error::SolveError;
use crate::parity::Parity;
use crate::solution::{Forecast, Settings};
use elastocap_geometry::mirror;
use elastocap_geometry::scene::Scene;
use elastocap_geometry::shapes::Shape;
use elastocap_geometry::turn::{Turn, to_mirror_planes};
use std::borrow::Cow;
use std::time::Instant;

/// Seconds per unknown and right-hand side on two cores. Measured: `benches/forecast.py`.
const SECONDS: f64 = 1.0e-6;

/// Largest sum over the first meshes of unknowns times right-hand sides with which they are solved for a
/// forecast, which takes some seconds. Not tuned: what `check` may take.
const MAX_EXPLORED: f64 = 3e6;

/// Largest memory, bytes, with which the first meshes are solved for a forecast. Not tuned: what `check` may
/// take.
const MAX_EXPLORED_BYTES: u64 = 400 << 20;

/// Approximate ratio of the unknowns of the last mesh to those of the finest of the first ones at a relative
/// tolerance of 1e-3, and the power of the inverse tolerance that it grows with. Two discs and a star on a
/// board take 0.8 and 0.2 times as many at 2e-2, 10 and 4 times at 1e-3, and the star 13 times at 1e-4.
/// Measured: `benches/forecast.py`.
const USUAL_GROWTH: (f64, f64) = (10.0, 0.75);

/// The axis along which the bodies of a scene are outlines pulled; `None` if there is none. Of several such
/// axes it is one to which all sheets are normal, if possible; of those, the one with the fewest planes at
/// which conductors begin or end; and of those, the one along which the conductors reach farthest.
pub fn extrusion_axis(scene: &Scene) -> Option<usize> {
    let hull = scene.conductors().filter_map(|c| c.body.bounds()).reduce(|a, b| a.union(&b))?;
    let layouts = (0..3).filter_map(|axis| Some((axis, Layout::new(scene, axis)?)));
    let edges = |layout: &Layout| layout.planes.iter().filter(|plane| plane.edge).count();
    let rank =
        |(axis, layout): &(usize, Layout)| (layout.has_upright_sheets(), edges(layout), -hull.extent(*axis));
    let best = layouts.min_by(|a, b| rank(a).partial_cmp(&rank(b)).unwrap_or(std::cmp::Ordering::Equal))?;
    Some(best.0)
}

/// Whether the bodies of a scene are outlines pulled along an axis, as [`solve_extruded()`] takes them.
pub fn is_extruded(scene: &Scene, axis: usize) -> bool {
    Layout::new(scene, axis).is_some()
}

/// Whether a scene that [`is_extruded()`] is solved faster as extruded than on tetrahedra: its outlines have
/// few sides along which conductors end, each of which takes strips of triangles.
pub fn has_few_edges(scene: &Scene) -> bool {
    // Mirror planes leave no more than a quarter of the sides to be meshed, to which others may add more.
    if corners(scene) / 8 > MAX_EDGES {
        return false;
    }
    let Some(axis) = extrusion_axis(scene) else { return false };
    let (_, scene) = turned(scene, axis, true);
    let part = mirror::part(&scene, &mirror::planes(&scene));
    let Some(layout) = Layout::new(&part, axis) else { return false };
    layout.plan(2.0 * layout.reach, false).is_ok_and(|plan| plan.marks.edges.len() <= MAX_EDGES)
}

/// Corners of the outlines of all conductors.
fn corners(scene: &Scene) -> usize {
    let count = |shape: &Shape| match shape {
        Shape::Extrusion { outline, .. } => outline.len(),
        Shape::Box(_)
        | Shape::Sphere { .. }
        | Shape::Shell { .. }
        | Shape::Capsule { .. }
        | Shape::Cylinder { .. }
        | Shape::Tube { .. }
        | Shape::Surface(_)
        | Shape::Physical(_) => 0,
    };
    scene.conductor_parts().map(|(_, shape)| count(shape)).sum()
}

/// Sides of triangles along which conductors end, in a scene that is solved faster as extruded than on
/// tetrahedra: with 32 (a pad and a disc on a board) it takes two thirds of the time, with 234 (a spiral
/// under a round pad) seven times as long. Measured: `elastocap run cases/spiral.toml` with `solver =
/// "extruded"` and without it.
const MAX_EDGES: usize = 100;

/// Smallest growth that a rough forecast of memory allows for: a random scene to 1e-2 took five times the
/// forecast of [`USUAL_GROWTH`]. Measured: `benches/forecast.py --drawn 200`.
const MIN_GROWTH_OF_MEMORY: f64 = 8.0;

/// Safety factor on the memory of the mesh that is expected to be the last one; the worst of the random
/// scenes took 1.45 times as much. Measured: `benches/forecast.py --drawn 200`.
const SPARE: f64 = 1.7;

/// Forecasts unknowns, memory and time of [`solve_extruded()`] from its first meshes.
///
/// # Errors
/// Those of [`solve_extruded()`].
pub fn forecast_extruded(scene: &Scene, settings: &Settings) -> Result<Forecast, SolveError> {
    let axis = extrusion_axis(scene).ok_or(SolveError::NotExtruded)?;
    let explore = Settings { field: false, ..settings.clone() };
    let (turn, scene) = turned(scene, axis, settings.symmetry);
    let mut search = Search::new(&scene, axis, turn, &explore)?;
    let right_hand_sides = search.parities.iter().map(Parity::sides).sum::<usize>().max(1);
    let size_on =
        |search: &Search<'_>, level: Level| Size::of(&search.mesh(level), &search.axis(level), level.degree);
    let first: Vec<Size> = search.explored().map(|level| size_on(&search, level)).collect();
    let work = first.iter().map(|size| size.unknowns as f64).sum::<f64>() * right_hand_sides as f64;
    let bytes = first.iter().map(|size| size.memory(right_hand_sides)).max().unwrap_or(0);
    let is_rough = work > MAX_EXPLORED || bytes > MAX_EXPLORED_BYTES;
    let (unknowns, memory_bytes) = if is_rough {
        let unknowns = first.iter().map(|size| size.unknowns).max().unwrap_or(0);
        let (at_a_thousandth, power) = USUAL_GROWTH;
        let growth = (at_a_thousandth * (1e-3 / settings.relative_tolerance).powf(power)).max(1.0);
        let memory = SPARE * growth.max(MIN_GROWTH_OF_MEMORY) * bytes as f64;
        ((growth * unknowns as f64) as usize, memory as u64)
    } else {
        let expected = search.explore()?;
        let size = size_on(&search, search.first(&expected).0);
        (size.unknowns, (SPARE * size.memory(right_hand_sides) as f64) as u64)
    };
    let seconds = SECONDS * unknowns as f64 * right_hand_sides as f64;
    let mirrored = search.planes.each_ref().map(Option::is_some);
    let parts = 1_usize << mirrored.iter().filter(|m| **m).count();
    Ok(Forecast {
        unknowns,
        // No mesh is solved that would not fit.
        memory_bytes: memory_bytes.min(settings.memory_limit),
        seconds: seconds + SECONDS * work,
        unmirrored: (parts * unknowns, parts as f64 * seconds),
        turned: false,
        mirrored,
        right_hand_sides,
        is_rough,
    })
}

/// Solves for the Maxwell capacitance matrix of a scene of outlines that are pulled along one axis, with
/// proved bounds. Where the tolerance cannot be reached, [`shortfall`](crate::Solution::shortfall) says why.
///
/// Outlines may differ from slab to slab; conductors may have no thickness along the axis.
///
/// # Errors
/// If the scene has other bodies, if the matrices of a mesh cannot be factorised or do not fit the memory, if
/// a stop is requested before there are bounds, or if proved bounds contradict each other.
pub fn solve_extruded(scene: &Scene, settings: &Settings) -> Result<ExtrudedSolution, SolveError> {
    let begin = Instant::now();
    let axis = extrusion_axis(scene).ok_or(SolveError::NotExtruded)?;
    let (turn, scene) = turned(scene, axis, settings.symmetry);
    let mut search = Search::new(&scene, axis, turn, settings)?;
    search.seconds.setup = begin.elapsed().as_secs_f64();
    search.run()
}

/// The scene, turned about the axis where that gives it more mirror planes.
fn turned(scene: &Scene, axis: usize, symmetry: bool) -> (Option<Turn>, Cow<'_, Scene>) {
    let better = if symmetry { to_mirror_planes(scene, axis) } else { None };
    better.map_or((None, Cow::Borrowed(scene)), |(turn, scene)| (Some(turn), Cow::Owned(scene)))
}
