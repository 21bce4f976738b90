//! Grid lines between obstacles, grouped by the obstacles they meet.

use super::rays::Leaving;
use super::{Basis, others};
use crate::SolveError;
use crate::boxes::domain::{Axis, Block, Domain, per_element};
use crate::boxes::ray_permittivity::Ahead;
use elastocap_fem::mixed::{FluxEnd, MixedSegment, mixed_segment};
use elastocap_fem::tensor::Dense;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// A run of modes on one axis, with its matrices.
#[derive(Debug, Clone)]
pub(super) struct Run {
    pub range: std::ops::Range<usize>,
    pub segment: usize,
    /// Conductors at the lower and the upper end.
    pub ends: [Option<usize>; 2],
}

/// Lines of one axis that meet the same obstacles: a rectangle of the two other axes (in ascending axis order).
#[derive(Debug)]
pub(super) struct Bundle {
    pub across: [std::ops::Range<usize>; 2],
    pub runs: Vec<Run>,
}

/// The lines between two obstacles, in the radial basis.
#[derive(Debug)]
pub(super) struct Segment {
    /// R: energies are sums of squares of it.
    pub root: Dense<f64>,
    /// T = R^T R.
    pub matrix: Dense<f64>,
    /// L^-1 g for unit potential at either end.
    pub face: [Vec<f64>; 2],
    /// R^T L^-1 g.
    pub source: [Vec<f64>; 2],
    /// What leaves along rays.
    pub leaving: Option<Leaving>,
}

/// One segment's key: intervals, ends, permittivity per interval up to a factor, contrast ahead of the rays.
type Key = (usize, usize, [FluxEnd; 2], Vec<u64>, [u64; 2]);

/// Runs of one column of cells, as (first interval, one past the last, segment, end conductors).
type Column = Vec<(usize, usize, usize, [Option<usize>; 2])>;

/// The bundles of axis `a` and the distinct segments they consist of.
pub(super) fn bundles(
    domain: &Domain,
    a: usize,
    basis: Option<&Basis>,
    ahead: &Ahead,
) -> Result<(Vec<Bundle>, Vec<Segment>), SolveError> {
    let (p, q) = others(a);
    let cells = domain.cells();
    let axis = &domain.axes[a];
    let mut keys: BTreeMap<Key, usize> = BTreeMap::new();
    let mut columns: Vec<Vec<Column>> = vec![Vec::new(); cells[p]];
    for (s, row) in columns.iter_mut().enumerate() {
        for t in 0..cells[q] {
            let over = |c: &Block| c.lo[p] <= s && s < c.hi[p] && c.lo[q] <= t && t < c.hi[q];
            let mut hit: Vec<(usize, usize, usize)> = domain
                .conductors
                .iter()
                .enumerate()
                .filter(|(_, c)| over(c))
                .map(|(index, c)| (c.lo[a], c.hi[a], index))
                .collect();
            hit.sort_unstable();
            let mut column = Column::new();
            let (mut from, mut below) = (0, None);
            for (lo, hi, index) in
                hit.into_iter().map(|(l, h, i)| (l, h, Some(i))).chain([(cells[a], cells[a], None)])
            {
                if from < lo {
                    let mut ends = axis.flux_ends(from, lo);
                    if below.is_some() {
                        ends[0] = FluxEnd::Free;
                    }
                    if index.is_some() {
                        ends[1] = FluxEnd::Free;
                    }
                    let cell = |m: usize| {
                        let mut c = [0; 3];
                        (c[a], c[p], c[q]) = (m, s, t);
                        c
                    };
                    let at = |m: usize| domain.permittivity_of(cell(m));
                    let profile = (from..lo).map(|m| (at(m) / at(from)).to_bits()).collect();
                    let straight = axis.continuation(from, lo, [1.0; 2]);
                    let contrast = [(0, from), (1, lo - 1)].map(|(side, m)| {
                        if straight[side] > 0.0 { ahead.contrast(domain, cell(m)) } else { 1.0 }.to_bits()
                    });
                    let next = keys.len();
                    let segment = *keys.entry((from, lo, ends, profile, contrast)).or_insert(next);
                    column.push((from, lo, segment, [below, index]));
                }
                (from, below) = (hi, index);
            }
            row.push(column);
        }
    }
    let bundles = rectangles(&columns)
        .into_iter()
        .map(|([s0, s1, t0, t1], column)| Bundle {
            across: [domain.axes[p].modes(s0, s1), domain.axes[q].modes(t0, t1)],
            runs: column
                .iter()
                .map(|&(lo, hi, segment, ends)| Run { range: axis.modes(lo, hi), segment, ends })
                .collect(),
        })
        .collect();
    let mut ordered: Vec<(Key, usize)> = keys.into_iter().collect();
    ordered.sort_by_key(|(_, index)| *index);
    let segments = ordered
        .into_par_iter()
        .map(|((lo, hi, ends, profile, contrast), _)| {
            let profile: Vec<f64> = profile.into_iter().map(f64::from_bits).collect();
            let factor = contrast.map(f64::from_bits);
            let mixed = mixed(axis, basis, lo, hi, &profile, ends, factor)?;
            let straight = axis.continuation(lo, hi, factor);
            let resistance = [1.0 / profile[0], 1.0 / profile[profile.len() - 1]];
            let leaving = Leaving::new(&mixed, [0, 1].map(|side| straight[side] * resistance[side]));
            Ok(Segment {
                root: Dense::from_mat(mixed.root.as_ref()),
                matrix: Dense::from_mat(mixed.t().as_ref()),
                source: [0, 1].map(|side| mixed.face_source(side)),
                face: mixed.face,
                leaving,
            })
        })
        .collect::<Result<_, SolveError>>()?;
    Ok((bundles, segments))
}

/// Equal columns merged to rectangles `[s0, s1, t0, t1]`: along t first, then along s.
fn rectangles(columns: &[Vec<Column>]) -> Vec<([usize; 4], &Column)> {
    let mut out: Vec<([usize; 4], &Column)> = Vec::new();
    for (s, row) in columns.iter().enumerate() {
        let mut t = 0;
        while t < row.len() {
            let mut end = t + 1;
            while end < row.len() && row[end] == row[t] {
                end += 1;
            }
            match out.iter_mut().find(|(r, c)| r[1] == s && r[2] == t && r[3] == end && **c == row[t]) {
                Some((r, _)) => r[1] = s + 1,
                None => out.push(([s, s + 1, t, end], &row[t])),
            }
            t = end;
        }
    }
    out
}

/// The matrices of intervals `lo..hi` with the given permittivity per interval of the run, in the radial basis, rays
/// continued straight times `factor`.
pub(super) fn mixed(
    axis: &Axis,
    basis: Option<&Basis>,
    lo: usize,
    hi: usize,
    profile: &[f64],
    ends: [FluxEnd; 2],
    factor: [f64; 2],
) -> Result<MixedSegment, SolveError> {
    let mut per_interval = vec![1.0; axis.intervals()];
    per_interval[lo..hi].copy_from_slice(profile);
    let permittivity = per_element(axis, &per_interval);
    let elements = axis.cuts[lo]..axis.cuts[hi];
    let continuation = axis.continuation(lo, hi, factor);
    let mut out = mixed_segment(&axis.line, elements, &permittivity, ends, continuation)?;
    if let Some(basis) = basis {
        let rows = out.root.transpose().to_owned();
        out.root = basis.radial.rotate_rows(axis.cuts[lo], &rows).transpose().to_owned();
    }
    Ok(out)
}
