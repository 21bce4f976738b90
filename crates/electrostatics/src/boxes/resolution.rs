//! The first grid, the distance to which grids reach into open space, and the memory that a grid takes.

use crate::boxes::layout::{Grid, Layout};
use crate::solution::{ResolutionLevel, Target};
use elastocap_fem::tensor::Dims;
use elastocap_geometry::meshing::grid::Resolution;

/// Size of a layer over the next larger one: between 0.12 (best below 1e-4) and 0.15 (best above), measured on the
/// in-plane pair.
const RATIO: f64 = 0.13;

/// Largest number of unknowns of a part, primal plus dual: about a minute's work on two cores.
pub(crate) const MAX_UNKNOWNS: usize = 24_000_000;

/// About the smallest spread that double precision allows. Grids are not refined further.
pub(crate) const MIN_TOLERANCE: f64 = 2e-12;

/// Largest number of unknowns of a first grid that has a layer at every edge.
const MAX_FIRST_UNKNOWNS: usize = 30_000;

/// Error that is left to where rays to infinity begin, for a tolerance. An estimate counts it as often as entries of a matrix
/// amplify it, so that less of it is left.
pub(crate) fn left_beyond(tolerance: f64, bounds: bool) -> f64 {
    if bounds { 0.3 * tolerance } else { 0.1 * tolerance }
}

/// Where rays to infinity begin, as the distance from the pole over that of the farthest conductor, for an error of this size.
/// `contrast` is that of the permittivities that the rays pass through.
///
/// The inverse of [`error_beyond()`].
pub(crate) fn far(error: f64, target: Target, contrast: Option<f64>) -> f64 {
    let falls = fall_beyond(target, contrast.unwrap_or(1.0));
    falls.into_iter().map(|(factor, power)| (factor / error).powf(1.0 / power)).fold(0.0, f64::max)
}

/// Spread of the target, relative, that comes from where rays to infinity begin.
pub(crate) fn error_beyond(far: f64, target: Target, contrast: Option<f64>) -> f64 {
    let falls = fall_beyond(target, contrast.unwrap_or(1.0));
    falls.into_iter().map(|(factor, power)| factor * far.powf(-power)).fold(0.0, f64::max)
}

/// The terms `factor / far^power` of which the largest is the error of open space.
///
/// For two terminals, whose field has no net charge, the factor was measured on two plates, and on an electrode pair in a layer of
/// relative permittivity 1 to 80 that goes to infinity. That of a net charge was measured on a cube next to a small one, and where
/// the rays pass through different permittivities on a cube on a slab.
fn fall_beyond(target: Target, contrast: f64) -> [(f64, f64); 2] {
    match target {
        Target::TwoTerminal => [(0.15 * contrast.powf(0.7), 3.0), (0.0, 3.0)],
        Target::Matrix => [(0.27, 3.0), (0.32 * (contrast - 1.0).min(10.0), 1.8)],
    }
}

/// The first grid of a layout.
pub(crate) fn first(layout: &Layout, far: f64) -> Grid {
    let with = |levels: usize| graded(ResolutionLevel { order: levels + 2, levels });
    let layered = layout.grid(&with(1), far);
    let (domain, _) = layout.domain(&layered);
    if domain.primal_dims().iter().product::<usize>() <= MAX_FIRST_UNKNOWNS {
        layered
    } else {
        layout.grid(&with(0), far)
    }
}

/// The same number of layers at every edge, with degrees that grow away from it up to the order.
pub(crate) fn graded(level: ResolutionLevel) -> Resolution {
    let ResolutionLevel { order, levels } = level;
    Resolution { order, levels, ratio: RATIO, slope: 1.0, first: 2.min(order) }
}

/// The grid below a fixed one, for the estimate without bounds.
pub(crate) fn coarser(level: ResolutionLevel) -> ResolutionLevel {
    ResolutionLevel { order: level.order.saturating_sub(1).max(1), levels: level.levels.saturating_sub(1) }
}

/// Largest error of the linear solver over the energy, on grids whose result is reported. The single-precision preconditioner
/// rounds differently for a symmetric part and for the whole scene; the two agree to 1e-10 only if this error is small.
pub(crate) fn iteration_share(tolerance: f64) -> f64 {
    (2e-3 * tolerance).clamp(1e-14, 3e-8)
}

/// Peak memory in bytes of a solve with `dims` functions on the axes: vectors of the iterations, boxes of the preconditioner, line
/// matrices, solutions of all parts.
pub(crate) fn memory(dims: Dims, right_hand_sides: usize, bounds: bool) -> u64 {
    let n = dims.iter().product::<usize>() as u64;
    // Per unknown: six double vectors, the scratch of the operator (two more), single-precision copies, the boxes
    // (about twice the array, two buffers each), the slopes for the indicator, and what is kept per right-hand side.
    let one = n * (8 * 8 + 2 * 4 + 2 * 2 * 4 + 4 * 8 + 2 * 8 * right_hand_sides as u64);
    let lines: u64 = dims.iter().map(|d| (d * d * 8 * 24) as u64).sum();
    (if bounds { 2 } else { 1 }) * (one + lines) + (16 << 20)
}
