//! The first grid of a search, the accuracy of the iterations, and the memory that a grid takes.

use crate::boxes::layout::{Grid, Layout};
use crate::solution::ResolutionLevel;
use elastocap_fem::tensor::Dims;
use elastocap_geometry::meshing::grid::Resolution;

/// Size of a layer of elements over that of the next larger one. On the in-plane pair 0.12 is best for
/// tolerances below 1e-4, and 0.15 above. Measured: `cargo bench --bench targets`, the table of layers.
const RATIO: f64 = 0.13;

/// Largest number of unknowns of a symmetric part, primal plus dual: about a minute's work on two cores. It
/// is not tuned.
pub(crate) const MAX_UNKNOWNS: usize = 24_000_000;

/// Approximate smallest spread that double precision allows. Grids are not refined further.
pub(crate) const MIN_TOLERANCE: f64 = 2e-12;

/// Largest number of unknowns of a first grid that has a layer at every edge. Tuned:
/// `benches/outlines.py comb`.
const MAX_FIRST_UNKNOWNS: usize = 30_000;

/// The first grid of a layout: with one layer at every edge, or with none where that takes more than
/// [`MAX_FIRST_UNKNOWNS`]. Rays to infinity begin `far` times as far from the pole as the farthest conductor.
pub(crate) fn first(layout: &Layout, far: f64) -> Grid {
    let resolution = |levels: usize| graded(ResolutionLevel { order: levels + 2, levels });
    let layered = layout.grid(&resolution(1), far);
    let (domain, _) = layout.domain(&layered);
    if domain.primal_dims().iter().product::<usize>() <= MAX_FIRST_UNKNOWNS {
        layered
    } else {
        layout.grid(&resolution(0), far)
    }
}

/// A resolution with the same number of layers at every edge, and with degrees that grow away from it up to
/// the order.
pub(crate) fn graded(level: ResolutionLevel) -> Resolution {
    let ResolutionLevel { order, levels } = level;
    Resolution { order, levels, ratio: RATIO, slope: 1.0, first: 2.min(order) }
}

/// The resolution below a fixed one, for the error estimate without bounds.
pub(crate) fn coarser(level: ResolutionLevel) -> ResolutionLevel {
    ResolutionLevel { order: level.order.saturating_sub(1).max(1), levels: level.levels.saturating_sub(1) }
}

/// Largest error of the linear solver over the energy, on grids whose result is reported. It widens the
/// bounds by about as much, and entries of a matrix by several times as much; the energies of a symmetric
/// part and of the whole scene agree to about as many digits, since the single-precision preconditioner
/// rounds differently for the two.
pub(crate) fn iteration_share(tolerance: f64) -> f64 {
    (2e-3 * tolerance).clamp(1e-14, 2e-5)
}

/// Entries of all conductor-free boxes over those of the array, on scenes of some bodies. Measured:
/// `benches/forecast.py`.
pub(crate) const USUAL_OVERLAP: f64 = 2.0;

/// Peak memory in bytes of a solve with `dims` functions on the axes: vectors of the iterations, boxes of the
/// preconditioner, line matrices, solutions of all parts.
pub(crate) fn memory(dims: Dims, right_hand_sides: usize, bounds: bool) -> u64 {
    let n = dims.iter().product::<usize>() as u64;
    // Per unknown: six double vectors, the scratch of the operator (two more), single-precision copies, the
    // boxes ([`USUAL_OVERLAP`] times the array, two buffers each), the slopes for the indicator, and three
    // vectors per right-hand side: a solution, the potential that it starts from, and the data of the repair.
    let per_bound = n * (8 * 8 + 2 * 4 + 2 * 2 * 4 + 4 * 8 + 3 * 8 * right_hand_sides as u64);
    let lines: u64 = dims.iter().map(|d| (d * d * 8 * 24) as u64).sum();
    (if bounds { 2 } else { 1 }) * (per_bound + lines) + (16 << 20)
}
