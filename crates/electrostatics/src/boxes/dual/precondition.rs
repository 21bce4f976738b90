//! The preconditioner: an additive Schwarz method on conductor-free boxes, which are inverted exactly. Flux
//! that leaves along rays is continued at a mean obliqueness.

use super::Basis;
use crate::boxes::conductor_free::free_boxes;
use crate::boxes::domain::{Axis, Block, Domain, per_element};
use crate::boxes::half_turn::halves::not_in_quarters;
use crate::boxes::primal::{AxisKey, axis_keys};
use crate::boxes::schwarz::{Modes, Schwarz, SeparableBox};
use crate::error::SolveError;
use elastocap_fem::mixed::FluxEnd;
use elastocap_fem::modes::{LineModes, dual_modes};
use elastocap_fem::tensor::Dims;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Energy of the continuation in the preconditioner over that of the straight one; the true factor is between
/// 1 and 3, depending on the obliqueness. Tuned: the iterations that `benches/outlines.py bus` prints.
const MEAN: f64 = 1.5;

/// The sum of the boxes' inverses, without those on quarters of a scene whose half the domain is.
pub(super) fn schwarz(
    domain: &Domain,
    basis: &[Option<Basis>; 3],
    dims: Dims,
) -> Result<Schwarz<f32>, SolveError> {
    let boxes = not_in_quarters(domain, free_boxes(domain));
    let keyed: Vec<_> = boxes.iter().map(|b| axis_keys(domain, b)).collect();
    let mut distinct: BTreeMap<AxisKey, usize> = BTreeMap::new();
    for key in keyed.iter().flatten() {
        let next = distinct.len();
        distinct.entry(key.clone()).or_insert(next);
    }
    let mut ordered: Vec<(AxisKey, usize)> = distinct.iter().map(|(k, v)| (k.clone(), *v)).collect();
    ordered.sort_by_key(|(_, index)| *index);
    let modes: Vec<Arc<Modes<f32>>> = ordered
        .par_iter()
        .map(|((a, lo, hi, held, bits), _)| {
            let axis = &domain.axes[*a];
            let factor: Vec<f64> = bits.iter().map(|b| f64::from_bits(*b)).collect();
            Ok(Arc::new(Modes::new(&modes_of(axis, basis[*a].as_ref(), *lo, *hi, *held, &factor, MEAN)?)))
        })
        .collect::<Result<_, SolveError>>()?;
    let boxes = boxes
        .iter()
        .zip(&keyed)
        .map(|(b, keys)| {
            let window = [0, 1, 2].map(|a| domain.axes[a].modes(b.block.lo[a], b.block.hi[a]));
            let separable =
                SeparableBox::new(window, [0, 1, 2].map(|a| Arc::clone(&modes[distinct[&keys[a]]])));
            match scaling(domain, &b.block) {
                Some(scaling) => separable.with_scaling(scaling),
                None => separable,
            }
        })
        .collect();
    Ok(Schwarz::new(boxes, dims))
}

/// The ratio of the two scalings of a box's unknowns: the root of the scene's permittivity over that of the
/// box's separable one, or `None` where they agree. Unknowns are scaled by the former, the operator of a box
/// by the latter.
fn scaling(domain: &Domain, block: &Block) -> Option<Vec<f32>> {
    let factors = domain.separable(block);
    let ratio = |c: [usize; 3]| {
        let separable = factors[0][c[0]] * factors[1][c[1]] * factors[2][c[2]];
        (domain.permittivity_of(c) / separable).sqrt()
    };
    let interval = [0, 1, 2].map(|a| -> Vec<usize> {
        let axis = &domain.axes[a];
        (block.lo[a]..block.hi[a]).flat_map(|m| axis.modes(m, m + 1).map(move |_| m)).collect()
    });
    let cells = |a: usize| block.lo[a]..block.hi[a];
    let agree = cells(0).all(|i| cells(1).all(|j| cells(2).all(|k| (ratio([i, j, k]) - 1.0).abs() < 1e-12)));
    if agree {
        return None;
    }
    let mut out = Vec::new();
    for &i in &interval[0] {
        for &j in &interval[1] {
            out.extend(interval[2].iter().map(|&k| ratio([i, j, k]) as f32));
        }
    }
    Some(out)
}

/// Modes of the intervals `lo..hi` between two obstacles, with the permittivity `factor` of each interval of
/// the axis. `held` marks ends at which a sheet lies on an outer plane. The energy of flux that continues to
/// infinity is `obliqueness` times that of straight lines.
pub(super) fn modes_of(
    axis: &Axis,
    basis: Option<&Basis>,
    lo: usize,
    hi: usize,
    held: [bool; 2],
    factor: &[f64],
    obliqueness: f64,
) -> Result<LineModes, SolveError> {
    let elements = axis.cuts[lo]..axis.cuts[hi];
    let mut ends = axis.flux_ends(lo, hi);
    for side in 0..2 {
        if held[side] {
            ends[side] = FluxEnd::Free;
        }
    }
    let continuation = axis.continuation(lo, hi, [obliqueness; 2]);
    let mut modes = dual_modes(&axis.line, elements, &per_element(axis, factor), ends, continuation)?;
    if let Some(basis) = basis {
        modes.vectors = basis.radial.rotate_rows(axis.cuts[lo], &modes.vectors);
    }
    Ok(modes)
}
