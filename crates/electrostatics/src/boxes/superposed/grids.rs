//! The grid of a base and the coarse grid of what is added to it: their common refinement, and interpolation
//! from the first to the second.

use crate::boxes::common_line::common_line;
use crate::boxes::domain::{Axis, Block, Domain};
use elastocap_fem::embedding::interpolation as of_lines;
use elastocap_fem::line::Line;
use elastocap_fem::tensor::{Dims, SparseRows, Window, clear};
use std::ops::Range;

/// The common refinement of the grids of a base and of a scene, with the bodies of the scene; `None` where
/// the grids do not end at the same nodes.
pub(super) fn joined_domain(base: &Domain, coarse: &Domain) -> Option<Domain> {
    let axis = |a: usize| joined_axis(&base.axes[a], &coarse.axes[a]);
    Some(Domain { axes: [axis(0)?, axis(1)?, axis(2)?], ..coarse.clone() })
}

/// One axis of [`joined_domain`].
fn joined_axis(base: &Axis, coarse: &Axis) -> Option<Axis> {
    if base.rays != coarse.rays || base.walls != coarse.walls {
        return None;
    }
    // Nodes of the base that agree with nodes of the scene but for rounding take the coordinates of the
    // latter.
    let line = common_line(&coarse.line, &base.line)?;
    let last = coarse.cuts.len() - 1;
    let cut = |m: usize| match coarse.plane_node(m) {
        _ if m == 0 => Some(0),
        _ if m == last => Some(line.elements()),
        Some(node) => {
            let plane = coarse.line.nodes[node];
            line.nodes.iter().position(|x| *x == plane).map(|i| i + line.first_finite())
        }
        None => None,
    };
    let cuts = (0..=last).map(cut).collect::<Option<Vec<usize>>>()?;
    Some(Axis { line, cuts, walls: coarse.walls, rays: coarse.rays })
}

/// The grid of a base, divided at the planes of a scene as well, and at `more` coordinates of each axis.
pub(super) fn at_planes(base: &Domain, coarse: &Domain, more: &[Vec<f64>; 3]) -> Option<Domain> {
    let planes = [0, 1, 2].map(|a| {
        let axis = &coarse.axes[a];
        let (first, nodes) = (axis.line.first_finite(), &axis.line.nodes);
        let node = |cut: &usize| nodes[cut.saturating_sub(first).min(nodes.len() - 1)];
        let ends = [nodes[0], nodes[nodes.len() - 1]];
        let within = more[a].iter().copied().filter(|x| ends[0] < *x && *x < ends[1]);
        let mut places: Vec<f64> = axis.cuts.iter().map(node).chain(ends).chain(within).collect();
        places.sort_unstable_by(f64::total_cmp);
        places.dedup();
        let cut = |cut: &usize| {
            let end = axis.line.elements();
            if *cut == 0 {
                0
            } else if *cut == end {
                places.len() - 1 + axis.line.elements() - axis.line.degrees.len()
            } else {
                places.partition_point(|x| *x < node(cut)) + first
            }
        };
        let cuts = axis.cuts.iter().map(cut).collect();
        let line = Line { degrees: vec![1; places.len() - 1], nodes: places, ends: axis.line.ends };
        Axis { line, cuts, ..axis.clone() }
    });
    joined_domain(base, &Domain { axes: planes, ..coarse.clone() })
}

/// The matrices that interpolate functions of a base along each axis by the functions of a grid that do not
/// vanish on a block; all other coefficients are zero.
pub(super) fn interpolation(base: &Domain, coarse: &Domain, block: &Block) -> Option<[SparseRows<f64>; 3]> {
    let axis = |a: usize| {
        let (from, to) = (&base.axes[a], &coarse.axes[a]);
        let common = joined_axis(from, to)?.line;
        let elements = to.cuts[block.lo[a]]..to.cuts[block.hi[a]];
        let whole = of_lines(&from.line, &to.line, &common, elements)?;
        let (rows, columns) = (to.functions(), from.functions());
        let free = whole.as_ref().submatrix(rows.start, columns.start, rows.len(), columns.len());
        Some(SparseRows::from_mat(free))
    };
    Some([axis(0)?, axis(1)?, axis(2)?])
}

/// The block of intervals that the map of a domain bends; `None` where it bends nothing.
pub(super) fn bent_block(domain: &Domain) -> Option<Block> {
    let map = domain.map.as_ref()?;
    let mut block = Block { lo: [0; 3], hi: [0; 3] };
    for a in 0..3 {
        let axis = &domain.axes[a];
        let is_bent = |m: &usize| {
            let ends = [axis.plane_node(*m), axis.plane_node(m + 1)].map(|n| n.map(|n| axis.line.nodes[n]));
            let [Some(low), Some(high)] = ends else { return false };
            map.reaches(a, 0.5 * (low + high))
        };
        let mut bent = (0..axis.intervals()).filter(is_bent);
        block.lo[a] = bent.next()?;
        block.hi[a] = bent.next_back().unwrap_or(block.lo[a]) + 1;
    }
    Some(block)
}

/// The permittivities of a base in the cells of a scene; `None` where the base is not uniform in one of them.
pub(super) fn permittivity_of(base: &Domain, coarse: &Domain) -> Option<Vec<f64>> {
    let [x, y, z] = [0, 1, 2].map(|a| overlaps(&base.axes[a], &coarse.axes[a]));
    let mut out = Vec::with_capacity(x.len() * y.len() * z.len());
    for i in &x {
        for j in &y {
            for k in &z {
                let pairs = i.clone().flat_map(|i| j.clone().map(move |j| (i, j)));
                let mut values =
                    pairs.flat_map(|(i, j)| k.clone().map(move |k| base.permittivity_of([i, j, k])));
                let first = values.next()?;
                if values.any(|eps| eps != first) {
                    return None;
                }
                out.push(first);
            }
        }
    }
    Some(out)
}

/// Overlap of two intervals, over the shorter one, below which it is due to rounding. Not tuned: it only has
/// to lie above rounding errors and below distances that matter.
const MEET: f64 = 1e-3;

/// For each interval of an axis of a scene, the intervals of a base that it overlaps.
fn overlaps(base: &Axis, coarse: &Axis) -> Vec<Range<usize>> {
    let ends = |axis: &Axis, m: usize| {
        let node = |m: usize| axis.plane_node(m).map(|n| axis.line.nodes[n]);
        [node(m).unwrap_or(f64::NEG_INFINITY), node(m + 1).unwrap_or(f64::INFINITY)]
    };
    let overlapping = |m: usize| {
        let [low, high] = ends(coarse, m);
        let is_common = |n: &usize| {
            let [from, to] = ends(base, *n);
            let shorter = (high - low).min(to - from);
            let rounding = if shorter.is_finite() { MEET * shorter } else { 0.0 };
            high.min(to) - low.max(from) > rounding
        };
        let mut common = (0..base.intervals()).filter(is_common);
        let first = common.next().unwrap_or(0);
        first..common.next_back().unwrap_or(first) + 1
    };
    (0..coarse.intervals()).map(overlapping).collect()
}

/// Zeroes all but a window.
pub(super) fn only(v: &mut [f64], dims: Dims, window: &Window) {
    let mut rest = v.to_vec();
    clear(&mut rest, dims, window);
    v.iter_mut().zip(rest).for_each(|(v, rest)| *v -= rest);
}
