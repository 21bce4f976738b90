//! Grid lines between obstacles, grouped by the obstacles they meet.

use super::rays::Leaving;
use super::{Basis, others};
use crate::boxes::domain::{Axis, Block, Domain, per_element};
use crate::boxes::ray_permittivity::RayPermittivity;
use crate::error::SolveError;
use elastocap_fem::condensed::Condensed;
use elastocap_fem::line::Numbering;
use elastocap_fem::mixed::{FluxCoordinates, FluxEnd, MixedSegment, mixed_segment};
use elastocap_fem::tensor::Dense;
use faer::Mat;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::ops::Range;

/// A run of modes on one axis, between two obstacles.
#[derive(Debug, Clone)]
pub(super) struct Run {
    /// The modes.
    pub range: std::ops::Range<usize>,
    /// The index of the [`Segment`] with its matrices.
    pub segment: usize,
    /// Blocks of conductors at the lower and the upper end.
    pub ends: [Option<usize>; 2],
}

/// Lines of one axis that meet the same obstacles: a rectangle of the two other axes (in ascending axis
/// order).
#[derive(Debug)]
pub(super) struct Bundle {
    /// Modes of the two other axes.
    pub across: [std::ops::Range<usize>; 2],
    /// The runs of each line, from the lowest to the highest.
    pub runs: Vec<Run>,
}

impl Bundle {
    /// Number of lines.
    pub(super) fn width(&self) -> usize {
        self.across[0].len() * self.across[1].len()
    }

    /// The index, among the lines of the bundle, of the line at these places on the two other axes.
    pub(super) fn line(&self, row: usize, column: usize) -> usize {
        let [rows, columns] = &self.across;
        (row - rows.start) * columns.len() + column - columns.start
    }
}

/// The matrices of a line between two obstacles, in the radial basis. M = L L^T is the mass matrix of the
/// flux functions, D their divergence, and g the source of a unit potential at an end.
#[derive(Debug)]
pub(super) struct Segment {
    /// R = L^-1 D^T, scaled as [`MixedSegment::root`] is. The squares of R phi + L^-1 g add up to the energy
    /// of the flux of phi.
    pub root: Dense<f64>,
    /// T = R^T R.
    pub operator: Condensed,
    /// L^-1 g for unit potential at either end.
    pub face: [Vec<f64>; 2],
    /// R^T L^-1 g.
    pub source: [Vec<f64>; 2],
    /// The flux that leaves along rays, if any does.
    pub leaving: Option<Leaving>,
    /// For a scene that a map bends: L^-T, which takes coordinates whose squares add up to the energy to
    /// coefficients of the flux functions.
    pub coefficients: Option<Mat<f64>>,
    /// First interval, and one past the last.
    pub intervals: [usize; 2],
    /// The condition on the flux at the two ends.
    pub ends: [FluxEnd; 2],
    /// Permittivity of each interval over that of the first.
    profile: Vec<f64>,
    /// Factors by which straight continuations are multiplied at the two ends.
    factor: [f64; 2],
}

/// The properties that determine a segment's matrices. Permittivities are bit patterns, so that keys have an
/// order and compare exactly.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
struct SegmentKey {
    /// First interval, and one past the last.
    intervals: [usize; 2],
    /// The condition on the flux at the two ends.
    ends: [FluxEnd; 2],
    /// Permittivity of each interval over that of the first.
    profile: Vec<u64>,
    /// Permittivity of the last interval at either end over the least that the rays from it cross; 1 without
    /// rays.
    contrast: [u64; 2],
}

/// One piece of a column of cells: the intervals between two obstacles.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Piece {
    /// First interval, and one past the last.
    intervals: [usize; 2],
    /// Index of the segment.
    segment: usize,
    /// Blocks of conductors at the lower and the upper end.
    ends: [Option<usize>; 2],
}

/// The pieces of one column of cells, from the lowest interval to the highest.
type Column = Vec<Piece>;

/// The bundles of axis `a` and the distinct segments they consist of.
pub(super) fn bundles(
    domain: &Domain,
    a: usize,
    basis: Option<&Basis>,
    rays: &RayPermittivity,
) -> Result<(Vec<Bundle>, Vec<Segment>), SolveError> {
    let (p, q) = others(a);
    let cells = domain.cells();
    let axis = &domain.axes[a];
    let mut segments: BTreeMap<SegmentKey, usize> = BTreeMap::new();
    let columns: Vec<Vec<Column>> = (0..cells[p])
        .map(|s| (0..cells[q]).map(|t| column(domain, a, [s, t], rays, &mut segments)).collect())
        .collect();
    let bundles = rectangles(&columns)
        .into_iter()
        .map(|([s0, s1, t0, t1], column)| Bundle {
            across: [domain.axes[p].modes(s0, s1), domain.axes[q].modes(t0, t1)],
            runs: column
                .iter()
                .map(|piece| Run {
                    range: axis.modes(piece.intervals[0], piece.intervals[1]),
                    segment: piece.segment,
                    ends: piece.ends,
                })
                .collect(),
        })
        .collect();
    let mut ordered: Vec<(SegmentKey, usize)> = segments.into_iter().collect();
    ordered.sort_by_key(|(_, index)| *index);
    let segments = ordered
        .into_par_iter()
        .map(|(key, _)| segment(axis, basis, &key, domain.map.is_some()))
        .collect::<Result<_, SolveError>>()?;
    Ok((bundles, segments))
}

/// The pieces of the column of cells along axis `a` at the intervals `[s, t]` of the two other axes. Segments
/// that are met for the first time are added to `segments`.
fn column(
    domain: &Domain,
    a: usize,
    [s, t]: [usize; 2],
    rays: &RayPermittivity,
    segments: &mut BTreeMap<SegmentKey, usize>,
) -> Column {
    let (p, q) = others(a);
    let axis = &domain.axes[a];
    let cell = |m: usize| {
        let mut c = [0; 3];
        (c[a], c[p], c[q]) = (m, s, t);
        c
    };
    let permittivity = |m: usize| domain.permittivity_of(cell(m));
    let over = |c: &Block| c.lo[p] <= s && s < c.hi[p] && c.lo[q] <= t && t < c.hi[q];
    let mut obstacles: Vec<(usize, usize, usize)> = domain
        .conductors
        .iter()
        .enumerate()
        .filter(|(_, c)| over(c))
        .map(|(index, c)| (c.lo[a], c.hi[a], index))
        .collect();
    obstacles.sort_unstable();
    let last = domain.cells()[a];
    let mut column = Column::new();
    let (mut from, mut below) = (0, None);
    for (to, hi, above) in obstacles.into_iter().map(|(l, h, i)| (l, h, Some(i))).chain([(last, last, None)])
    {
        if from < to {
            let mut ends = axis.flux_ends(from, to);
            if below.is_some() {
                ends[0] = FluxEnd::Free;
            }
            if above.is_some() {
                ends[1] = FluxEnd::Free;
            }
            let straight = axis.continuation(from, to, [1.0; 2]);
            let contrast = [(0, from), (1, to - 1)].map(|(side, m)| {
                if straight[side] > 0.0 { rays.contrast(domain, cell(m)) } else { 1.0 }.to_bits()
            });
            let key = SegmentKey {
                intervals: [from, to],
                ends,
                profile: (from..to).map(|m| (permittivity(m) / permittivity(from)).to_bits()).collect(),
                contrast,
            };
            let next = segments.len();
            let segment = *segments.entry(key).or_insert(next);
            column.push(Piece { intervals: [from, to], segment, ends: [below, above] });
        }
        // Boxes of one conductor may overlap: the line is free behind the farthest end.
        if hi >= from {
            (from, below) = (hi, above);
        }
    }
    column
}

/// The matrices of one segment; [`Segment::coefficients`] among them if the scene is `bent` by a map.
fn segment(axis: &Axis, basis: Option<&Basis>, key: &SegmentKey, bent: bool) -> Result<Segment, SolveError> {
    let [lo, hi] = key.intervals;
    let profile: Vec<f64> = key.profile.iter().copied().map(f64::from_bits).collect();
    let factor = key.contrast.map(f64::from_bits);
    let mixed = mixed(axis, basis, lo, hi, &profile, key.ends, factor)?;
    let straight = axis.continuation(lo, hi, factor);
    let resistance = [1.0 / profile[0], 1.0 / profile[profile.len() - 1]];
    let leaving = Leaving::new(&mixed, [0, 1].map(|side| straight[side] * resistance[side]));
    let mut segment = Segment {
        root: Dense::from_mat(mixed.root.as_ref()),
        operator: mixed.operator()?,
        source: [0, 1].map(|side| mixed.face_source(side)),
        face: mixed.face,
        leaving,
        coefficients: None,
        intervals: key.intervals,
        ends: key.ends,
        profile,
        factor,
    };
    if bent {
        segment.coefficients = Some(segment.coordinates(axis)?.coefficients());
    }
    Ok(segment)
}

impl Segment {
    /// The coordinates of the segment's fluxes on an axis with the same planes, which may be that of another
    /// grid.
    pub(super) fn coordinates(&self, axis: &Axis) -> Result<FluxCoordinates, SolveError> {
        let [lo, hi] = self.intervals;
        let mut per_interval = vec![1.0; axis.intervals()];
        per_interval[lo..hi].copy_from_slice(&self.profile);
        let elements = axis.cuts[lo]..axis.cuts[hi];
        let permittivity = per_element(axis, &per_interval);
        let continuation = axis.continuation(lo, hi, self.factor);
        Ok(FluxCoordinates::new(&axis.line, elements, &permittivity, self.ends, continuation)?)
    }

    /// The range of the segment's flux functions among those of the line of an axis with the same planes and
    /// without infinite elements.
    pub(super) fn functions(&self, axis: &Axis) -> Range<usize> {
        let numbering = Numbering::new(&axis.line);
        let [lo, hi] = self.intervals;
        let blocked = |side: usize| usize::from(self.ends[side] == FluxEnd::Blocked);
        numbering.vertex[axis.cuts[lo]] + blocked(0)..numbering.vertex[axis.cuts[hi]] + 1 - blocked(1)
    }
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

/// The matrices of a line over the intervals `lo..hi`, in the radial basis. `profile` is the permittivity of
/// each of these intervals. The energy of flux that continues to infinity is `factor` times that of straight
/// lines.
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
    let segment = mixed_segment(&axis.line, elements, &permittivity, ends, continuation)?;
    Ok(match basis {
        Some(basis) => segment.with_modes(|rows| basis.radial.rotate_rows(axis.cuts[lo], rows)),
        None => segment,
    })
}
