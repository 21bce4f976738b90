//! Thomson's principle: fluxes without divergence, whose energy bounds the capacitance from below.
//!
//! Unknowns are the discontinuous potentials of the mixed method, scaled by the square root of the permittivity, in
//! an orthonormal basis, `[i][j][k]`. Each grid line between two obstacles carries a dense matrix T
//! (`elastocap_fem::mixed`); the operator is the sum of T over all lines of all three axes.
//!
//! The bound does not rest on the iteration: the divergence r that it leaves is taken up by a second flux, the exact
//! solution with source r on the whole box of the scene as if there were no conductors. With A' the operator of that
//! box the lower bound is
//!
//! J = (sigma, sigma) - r A'^-1 r,    sigma = M^-1 (g + D^T phi),
//!
//! for *any* phi: the flux of phi and the repair together have no divergence, and J is no more than their Thomson
//! functional (the repair's energy inside conductors is counted too, though it need not be).

use crate::SolveError;
use crate::boxes::free_boxes;
use crate::domain::{Axis, Block, Domain, per_element};
use crate::krylov::Operator;
use crate::primal::{AxisKey, axis_keys};
use crate::schwarz::{Modes, Schwarz, SchwarzWork, SeparableBox};
use elastocap_fem::mixed::{FluxEnd, MixedSegment, mixed_segment, ones};
use elastocap_fem::modes::{LineModes, dual_modes};
use elastocap_fem::tensor::{Dense, Dims, Real, Window, clear, dot, left, multiply, right, target};
use faer::Mat;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;

/// A run of modes on one axis with its matrix.
#[derive(Debug, Clone)]
struct Run {
    range: std::ops::Range<usize>,
    segment: usize,
    /// Conductors at the lower and the upper end.
    ends: [Option<usize>; 2],
}

/// Lines of one axis that meet the same obstacles: a rectangle of the two other axes (in ascending axis order).
#[derive(Debug)]
struct Bundle {
    across: [std::ops::Range<usize>; 2],
    runs: Vec<Run>,
}

/// T of every distinct segment, by axis.
type Matrices<T> = [Vec<Dense<T>>; 3];

/// The dual problem on one domain.
#[derive(Debug)]
pub struct Dual {
    dims: Dims,
    conductors: Vec<Window>,
    bundles: [Vec<Bundle>; 3],
    matrices: Matrices<f64>,
    /// R of every segment: energies are sums of squares of it.
    roots: Matrices<f64>,
    /// Face vectors and energies of the segments.
    segments: [Vec<MixedSegment>; 3],
    /// Square root of permittivity times the constant 1, as a product over the axes where the permittivity is one;
    /// otherwise per cell of intervals.
    weights: Weights,
    schwarz: Schwarz<f32>,
    work: SchwarzWork<f32>,
    repair: Repair,
}

#[derive(Debug)]
struct Weights {
    ones: [Vec<f64>; 3],
    /// Square root of the permittivity at each mode's interval.
    root: Vec<f64>,
    cells: [usize; 3],
    interval: [Vec<usize>; 3],
}

impl Weights {
    /// Square root of the permittivity at array position (i, j, k).
    fn root_at(&self, at: [usize; 3]) -> f64 {
        let [i, j, k] = [0, 1, 2].map(|a| self.interval[a][at[a]]);
        self.root[(i * self.cells[1] + j) * self.cells[2] + k]
    }
}

/// The exact solver of the whole box without conductors.
#[derive(Debug)]
struct Repair {
    solver: SeparableBox<f64>,
    singular: bool,
    /// Product permittivity of the repair over the true one, at its largest: scales the repair's energy.
    excess: f64,
    /// Uncut T of each axis, in the scaling of the repair's own permittivity.
    operator: [Dense<f64>; 3],
    /// Repair's root permittivity over the scene's, per cell of intervals; `None` where they agree everywhere.
    ratio: Option<Vec<f64>>,
}

/// One segment's key: elements, ends, permittivity up to a factor.
type SegmentKey = (usize, usize, [FluxEnd; 2], Vec<u64>);

impl Dual {
    /// Assembles line matrices and box modes.
    pub fn new(domain: &Domain) -> Result<Self, SolveError> {
        let domain = &domain.truncated();
        let dims = domain.dual_dims();
        let mut bundles: [Vec<Bundle>; 3] = Default::default();
        let mut segments: [Vec<MixedSegment>; 3] = Default::default();
        for a in 0..3 {
            (bundles[a], segments[a]) = bundles_of(domain, a)?;
        }
        let dense64 =
            [0, 1, 2].map(|a| segments[a].iter().map(|s| Dense::<f64>::from_mat(s.t().as_ref())).collect());
        let roots =
            [0, 1, 2].map(|a| segments[a].iter().map(|s| Dense::<f64>::from_mat(s.root.as_ref())).collect());
        let interval = [0, 1, 2].map(|a| {
            let axis = &domain.axes[a];
            (0..axis.intervals()).flat_map(|m| axis.modes(m, m + 1).map(move |_| m)).collect()
        });
        let weights = Weights {
            ones: [0, 1, 2].map(|a| ones(&domain.axes[a].line)),
            root: domain.permittivity.iter().map(|e| e.sqrt()).collect(),
            cells: domain.cells(),
            interval,
        };
        let windows = domain
            .conductors
            .iter()
            .map(|c| [0, 1, 2].map(|a| domain.axes[a].modes(c.lo[a], c.hi[a])))
            .collect();
        Ok(Self {
            dims,
            conductors: windows,
            bundles,
            matrices: dense64,
            roots,
            segments,
            weights,
            schwarz: schwarz(domain, dims)?,
            work: SchwarzWork::default(),
            repair: Repair::new(domain)?,
        })
    }

    /// Right-hand side b = -D M^-1 g for the given conductor potentials.
    pub fn source(&self, potentials: &[f64]) -> Vec<f64> {
        let mut b = vec![0.0; self.unknowns()];
        for a in 0..3 {
            let (p, q) = others(a);
            for bundle in &self.bundles[a] {
                for run in &bundle.runs {
                    let segment = &self.segments[a][run.segment];
                    for side in 0..2 {
                        let Some(potential) = run.ends[side].map(|c| potentials[c]) else { continue };
                        let face = segment.face_source(side);
                        for s in bundle.across[0].clone() {
                            for t in bundle.across[1].clone() {
                                let mut at = [0; 3];
                                (at[a], at[p], at[q]) = (run.range.start, s, t);
                                let drive = potential * self.area(a, at);
                                if drive == 0.0 {
                                    continue;
                                }
                                for (m, v) in run.range.clone().zip(&face) {
                                    at[a] = m;
                                    b[(at[0] * self.dims[1] + at[1]) * self.dims[2] + at[2]] -= drive * v;
                                }
                            }
                        }
                    }
                }
            }
        }
        for window in &self.conductors {
            clear(&mut b, self.dims, window);
        }
        b
    }

    /// Coefficient of a unit potential on the face of axis `a` at transverse modes `at`, times the root of the
    /// permittivity of the run's first interval (`at[a]`).
    fn area(&self, a: usize, at: [usize; 3]) -> f64 {
        let (p, q) = others(a);
        let one = self.weights.ones[p][at[p]] * self.weights.ones[q][at[q]];
        if one == 0.0 { 0.0 } else { one * self.weights.root_at(at) }
    }

    /// g M^-1 g: the energy at phi = 0, from which the iteration comes down.
    pub fn face_energy(&self, potentials: &[f64]) -> f64 {
        self.flux_energies(&[potentials], &[&vec![0.0; self.unknowns()]])[(0, 0)]
    }

    /// (sigma_i, sigma_j) weighted by 1 / permittivity, of the fluxes M^-1 (g_i + D^T phi_i).
    pub fn flux_energies(&self, potentials: &[&[f64]], phi: &[&[f64]]) -> Mat<f64> {
        let count = phi.len();
        let strides = [self.dims[1] * self.dims[2], self.dims[2], 1];
        let mut total = Mat::zeros(count, count);
        for a in 0..3 {
            let (p, q) = others(a);
            for bundle in &self.bundles[a] {
                for run in &bundle.runs {
                    let (root, segment) = (&self.roots[a][run.segment], &self.segments[a][run.segment]);
                    // One strip of lines at a time: rows of the transverse axis `p`.
                    let partial: Vec<Mat<f64>> = bundle.across[0]
                        .clone()
                        .into_par_iter()
                        .map(|s| {
                            let lines = bundle.across[1].clone();
                            let width = lines.len();
                            let fluxes: Vec<Vec<f64>> = (0..count)
                                .map(|c| {
                                    let offset = run.range.start * strides[a] + s * strides[p];
                                    let mut gathered = Vec::with_capacity(root.cols * width);
                                    for m in 0..root.cols {
                                        for t in lines.clone() {
                                            gathered.push(phi[c][offset + m * strides[a] + t * strides[q]]);
                                        }
                                    }
                                    let mut flux = vec![0.0; root.rows * width];
                                    let b = right(&gathered, 0, width, width);
                                    multiply(root.left(), b, target(&mut flux, 0, width), false);
                                    for side in 0..2 {
                                        let Some(end) = run.ends[side] else { continue };
                                        for (column, t) in lines.clone().enumerate() {
                                            let mut at = [0; 3];
                                            (at[a], at[p], at[q]) = (run.range.start, s, t);
                                            let drive = potentials[c][end] * self.area(a, at);
                                            if drive != 0.0 {
                                                for (i, f) in segment.face[side].iter().enumerate() {
                                                    flux[i * width + column] += drive * f;
                                                }
                                            }
                                        }
                                    }
                                    flux
                                })
                                .collect();
                            Mat::from_fn(count, count, |i, j| {
                                fluxes[i].iter().zip(&fluxes[j]).map(|(x, y)| x * y).sum::<f64>()
                            })
                        })
                        .collect();
                    for m in &partial {
                        total += m;
                    }
                }
            }
        }
        total
    }

    /// r = b - A x.
    pub fn true_residual(&mut self, b: &[f64], x: &[f64], r: &mut [f64]) {
        self.apply(x, r);
        r.iter_mut().zip(b).for_each(|(r, b)| *r = b - *r);
    }

    /// Makes `r` = b - A x sum to what the repair can take up: where every wall is insulated, the residual must hold
    /// no net charge. Moves `x` along the constant, which also lowers its error.
    pub fn balance(&mut self, x: &mut [f64], r: &mut [f64]) {
        if !self.repair.singular {
            return;
        }
        let constant = self.constant();
        let mut image = vec![0.0; r.len()];
        self.apply(&constant, &mut image);
        let step = dot(&constant, r) / dot(&constant, &image);
        for ((x, r), (c, a)) in x.iter_mut().zip(r).zip(constant.iter().zip(&image)) {
            *x += step * c;
            *r -= step * a;
        }
    }

    /// The constant potential 1 on the free cells, in the scaled basis.
    fn constant(&self) -> Vec<f64> {
        let mut out = vec![0.0; self.unknowns()];
        let [n0, n1, n2] = self.dims;
        for i in 0..n0 {
            for j in 0..n1 {
                for k in 0..n2 {
                    let one = self.weights.ones[0][i] * self.weights.ones[1][j] * self.weights.ones[2][k];
                    if one != 0.0 {
                        out[(i * n1 + j) * n2 + k] = one * self.weights.root_at([i, j, k]);
                    }
                }
            }
        }
        for window in &self.conductors {
            clear(&mut out, self.dims, window);
        }
        out
    }

    /// psi = A'^-1 r: the potential of the repairing flux, with what divergence is still left after refinement, as a
    /// share of r.
    pub fn repair(&self, r: &[f64]) -> (Vec<f64>, f64) {
        self.repair.solve(r, self.dims, &self.weights)
    }

    /// By how much the energy of the repair may exceed what its own permittivity gives.
    pub fn repair_excess(&self) -> f64 {
        self.repair.excess
    }
}

/// The two axes across `a`, ascending.
fn others(a: usize) -> (usize, usize) {
    match a {
        0 => (1, 2),
        1 => (0, 2),
        _ => (0, 1),
    }
}

/// Lines of axis `a` grouped by the obstacles they meet.
fn bundles_of(domain: &Domain, a: usize) -> Result<(Vec<Bundle>, Vec<MixedSegment>), SolveError> {
    let (p, q) = others(a);
    let cells = domain.cells();
    let axis = &domain.axes[a];
    let mut keys: BTreeMap<SegmentKey, usize> = BTreeMap::new();
    // Runs of one column of cells, as (first interval, one past the last, segment, end conductors).
    type Column = Vec<(usize, usize, usize, [Option<usize>; 2])>;
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
                    let at = |m: usize| {
                        let mut c = [0; 3];
                        (c[a], c[p], c[q]) = (m, s, t);
                        domain.permittivity_of(c)
                    };
                    let profile = (from..lo).map(|m| (at(m) / at(from)).to_bits()).collect();
                    let next = keys.len();
                    let segment = *keys.entry((from, lo, ends, profile)).or_insert(next);
                    column.push((from, lo, segment, [below, index]));
                }
                (from, below) = (hi, index);
            }
            row.push(column);
        }
    }
    // Merge equal columns to rectangles: along q first, then along p.
    let mut rectangles: Vec<([usize; 4], &Column)> = Vec::new();
    for (s, row) in columns.iter().enumerate() {
        let mut t = 0;
        while t < row.len() {
            let mut end = t + 1;
            while end < row.len() && row[end] == row[t] {
                end += 1;
            }
            match rectangles.iter_mut().find(|(r, c)| r[1] == s && r[2] == t && r[3] == end && **c == row[t])
            {
                Some((r, _)) => r[1] = s + 1,
                None => rectangles.push(([s, s + 1, t, end], &row[t])),
            }
            t = end;
        }
    }
    let bundles = rectangles
        .into_iter()
        .map(|([s0, s1, t0, t1], column)| Bundle {
            across: [domain.axes[p].modes(s0, s1), domain.axes[q].modes(t0, t1)],
            runs: column
                .iter()
                .map(|&(lo, hi, segment, ends)| Run { range: axis.modes(lo, hi), segment, ends })
                .collect(),
        })
        .collect();
    let mut ordered: Vec<(SegmentKey, usize)> = keys.into_iter().collect();
    ordered.sort_by_key(|(_, index)| *index);
    let segments = ordered
        .into_par_iter()
        .map(|((lo, hi, ends, profile), _)| {
            let profile: Vec<f64> = profile.into_iter().map(f64::from_bits).collect();
            segment_of(axis, lo, hi, &profile, ends)
        })
        .collect::<Result<_, _>>()?;
    Ok((bundles, segments))
}

/// The segment of intervals `lo..hi` with the given permittivity per interval of the run.
fn segment_of(
    axis: &Axis,
    lo: usize,
    hi: usize,
    profile: &[f64],
    ends: [FluxEnd; 2],
) -> Result<MixedSegment, SolveError> {
    let mut per_interval = vec![1.0; axis.intervals()];
    per_interval[lo..hi].copy_from_slice(profile);
    let permittivity = per_element(axis, &per_interval);
    let elements = axis.cuts[lo]..axis.cuts[hi];
    Ok(mixed_segment(&axis.line, elements, &permittivity, ends, axis.continuation_of(lo, hi))?)
}

/// Modes of the intervals `lo..hi` between two obstacles; `held` for sheets that lie on an outer plane.
fn modes_of(
    axis: &Axis,
    lo: usize,
    hi: usize,
    held: [bool; 2],
    factor: &[f64],
) -> Result<LineModes, SolveError> {
    let elements = axis.cuts[lo]..axis.cuts[hi];
    let mut ends = axis.flux_ends(lo, hi);
    for side in 0..2 {
        if held[side] {
            ends[side] = FluxEnd::Free;
        }
    }
    let continuation = axis.continuation_of(lo, hi);
    Ok(dual_modes(&axis.line, elements, &per_element(axis, factor), ends, continuation)?)
}

/// y = A x.
fn apply<T: Real>(
    dims: Dims,
    bundles: &[Vec<Bundle>; 3],
    matrices: &Matrices<T>,
    conductors: &[Window],
    x: &[T],
    y: &mut [T],
) {
    let [_, n1, n2] = dims;
    let plane = n1 * n2;
    y.par_chunks_mut(plane).enumerate().with_min_len((2048 / plane.max(1)).max(1)).for_each(|(i, slab)| {
        slab.fill(T::default());
        let source = &x[i * plane..(i + 1) * plane];
        for bundle in bundles[2].iter().filter(|b| b.across[0].contains(&i)) {
            let js = &bundle.across[1];
            for run in &bundle.runs {
                let at = js.start * n2 + run.range.start;
                let len = run.range.len();
                let a = left(source, at, js.len(), len, n2);
                multiply(a, matrices[2][run.segment].right(), target(slab, at, n2), true);
            }
        }
        for bundle in bundles[1].iter().filter(|b| b.across[0].contains(&i)) {
            let ks = &bundle.across[1];
            for run in &bundle.runs {
                let at = run.range.start * n2 + ks.start;
                let b = right(source, at, ks.len(), n2);
                multiply(matrices[1][run.segment].left(), b, target(slab, at, n2), true);
            }
        }
    });
    let block = dims[0].div_ceil((dims[0] * plane / 16_384).clamp(1, 4));
    y.par_chunks_mut(block * plane).enumerate().for_each(|(b, slabs)| {
        let mine = b * block..b * block + slabs.len() / plane;
        for bundle in &bundles[0] {
            let (js, ks) = (&bundle.across[0], &bundle.across[1]);
            // Whole rows of the last axis follow one another: one product for all of them.
            let (strips, width) = if ks.len() == n2 { (1, js.len() * n2) } else { (js.len(), ks.len()) };
            for run in &bundle.runs {
                let some = run.range.start.max(mine.start)..run.range.end.min(mine.end);
                if some.is_empty() {
                    continue;
                }
                let own = some.start - run.range.start..some.end - run.range.start;
                for j in 0..strips {
                    let across = (js.start + j) * n2 + ks.start;
                    multiply(
                        matrices[0][run.segment].left_rows(own.clone()),
                        right(x, run.range.start * plane + across, width, plane),
                        target(slabs, (some.start - mine.start) * plane + across, plane),
                        true,
                    );
                }
            }
        }
    });
    for window in conductors {
        clear(y, dims, window);
    }
}

impl Operator for Dual {
    fn unknowns(&self) -> usize {
        self.dims.iter().product()
    }
    fn apply(&mut self, x: &[f64], y: &mut [f64]) {
        apply(self.dims, &self.bundles, &self.matrices, &self.conductors, x, y);
    }
    fn precondition(&mut self, r: &[f32], z: &mut [f32]) {
        self.schwarz.apply(r, z, &mut self.work);
    }
}

fn schwarz(domain: &Domain, dims: Dims) -> Result<Schwarz<f32>, SolveError> {
    let boxes = free_boxes(domain);
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
            Ok(Arc::new(Modes::new(&modes_of(axis, *lo, *hi, *held, &factor)?)))
        })
        .collect::<Result<_, SolveError>>()?;
    let boxes = boxes
        .iter()
        .zip(&keyed)
        .map(|(b, keys)| {
            let window = [0, 1, 2].map(|a| domain.axes[a].modes(b.block.lo[a], b.block.hi[a]));
            let own = SeparableBox::new(window, [0, 1, 2].map(|a| Arc::clone(&modes[distinct[&keys[a]]])));
            match scaling(domain, &b.block) {
                Some(scaling) => own.with_scaling(scaling),
                None => own,
            }
        })
        .collect();
    Ok(Schwarz::new(boxes, dims))
}

/// Unknowns are scaled by the root of the scene's permittivity, a box's operator by that of its own separable one:
/// their ratio on the box, or `None` where they agree.
fn scaling(domain: &Domain, block: &Block) -> Option<Vec<f32>> {
    let factors = domain.separable(block);
    let ratio = |c: [usize; 3]| {
        let own = factors[0][c[0]] * factors[1][c[1]] * factors[2][c[2]];
        (domain.permittivity_of(c) / own).sqrt()
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

impl Repair {
    fn new(domain: &Domain) -> Result<Self, SolveError> {
        let whole = Block { lo: [0; 3], hi: domain.cells() };
        let factors = domain.separable(&whole);
        let singular = domain.axes.iter().all(|a| a.flux_ends(0, a.intervals()) == [FluxEnd::Blocked; 2]);
        let mut operator = Vec::new();
        let mut modes = Vec::new();
        for (axis, factor) in domain.axes.iter().zip(&factors) {
            let n = axis.intervals();
            let segment = segment_of(axis, 0, n, factor, axis.flux_ends(0, n))?;
            modes.push(Arc::new(Modes::new(&modes_of(axis, 0, n, [false; 2], factor)?)));
            operator.push(Dense::from_mat(segment.t().as_ref()));
        }
        let cells = domain.cells();
        let (mut excess, mut ratio, mut differs) = (1.0_f64, Vec::new(), false);
        for i in 0..cells[0] {
            for j in 0..cells[1] {
                for k in 0..cells[2] {
                    let own = factors[0][i] * factors[1][j] * factors[2][k];
                    let r = own / domain.permittivity_of([i, j, k]);
                    differs |= (r - 1.0).abs() > 1e-14;
                    excess = excess.max(r);
                    ratio.push(r.sqrt());
                }
            }
        }
        let window = domain.dual_dims().map(|n| 0..n);
        let [m0, m1, m2]: [_; 3] = modes.try_into().map_err(|_| SolveError::Eigenvalues)?;
        let [o0, o1, o2]: [_; 3] = operator.try_into().map_err(|_| SolveError::Eigenvalues)?;
        let solver = SeparableBox::new(window, [m0, m1, m2]);
        Ok(Self {
            solver: if singular { solver.without_constant() } else { solver },
            singular,
            excess,
            operator: [o0, o1, o2],
            ratio: differs.then_some(ratio),
        })
    }

    fn solve(&self, r: &[f64], dims: Dims, weights: &Weights) -> (Vec<f64>, f64) {
        // r is scaled by the root of the scene's permittivity, the repair's operator by that of its own.
        let rescale = |v: &mut [f64]| {
            if let Some(ratio) = &self.ratio {
                for i in 0..dims[0] {
                    for j in 0..dims[1] {
                        for k in 0..dims[2] {
                            let [a, b, c] =
                                [weights.interval[0][i], weights.interval[1][j], weights.interval[2][k]];
                            v[(i * dims[1] + j) * dims[2] + k] /=
                                ratio[(a * weights.cells[1] + b) * weights.cells[2] + c];
                        }
                    }
                }
            }
        };
        let mut target = r.to_vec();
        rescale(&mut target);
        let size = dot(&target, &target).sqrt();
        let mut psi = vec![0.0; r.len()];
        let mut rest = target.clone();
        let (mut work, mut step) = (Vec::new(), Vec::new());
        let mut left = 1.0;
        // One pass is exact up to rounding; the second takes the rounding's first digits back.
        for _ in 0..2 {
            self.solver.solve(&rest, dims, &mut work, &mut step);
            psi.iter_mut().zip(&step).for_each(|(p, s)| *p += s);
            rest.copy_from_slice(&target);
            self.subtract_product(&psi, &mut rest, dims);
            left = if size > 0.0 { dot(&rest, &rest).sqrt() / size } else { 0.0 };
            if left < 1e-13 {
                break;
            }
        }
        rescale(&mut psi);
        (psi, left)
    }

    /// `rest -= A' psi`.
    fn subtract_product(&self, psi: &[f64], rest: &mut [f64], dims: Dims) {
        let [_, n1, n2] = dims;
        let plane = n1 * n2;
        let minus: Vec<f64> = psi.iter().map(|p| -p).collect();
        rest.par_chunks_mut(plane).enumerate().for_each(|(i, slab)| {
            let a = left(&minus, i * plane, n1, n2, n2);
            multiply(a, self.operator[2].right(), target(slab, 0, n2), true);
            let b = right(&minus, i * plane, n2, n2);
            multiply(self.operator[1].left(), b, target(slab, 0, n2), true);
            multiply(
                self.operator[0].left_rows(i..i + 1),
                right(&minus, 0, plane, plane),
                target(slab, 0, plane),
                true,
            );
        });
    }
}
