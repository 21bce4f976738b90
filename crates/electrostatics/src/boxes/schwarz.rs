//! Boxes on which an operator is separable, inverted by fast diagonalisation, and the sum of their inverses
//! as a preconditioner.
//!
//! On a box the operator is A0 x B1 x B2 + B0 x A1 x B2 + B0 x B1 x A2 with small matrices per axis. With
//! A u = lambda B u on each axis, its inverse is six small matrix products and a division by
//! lambda0 + lambda1 + lambda2 (Lynch, Rice and Thomas 1964).

use crate::boxes::half_turn::fold::Fold;
use elastocap_fem::modes::LineModes;
use elastocap_fem::tensor::{Dense, Dims, Real, Window, left, multiply, right, sized, target};
use rayon::prelude::*;
use std::sync::Arc;

/// Eigenvectors (columns) and eigenvalues of the pencil of one axis.
#[derive(Debug)]
pub(crate) struct Modes<T> {
    vectors: Dense<T>,
    /// The transpose of `vectors`.
    transposed: Dense<T>,
    values: Vec<T>,
}

impl<T: Real> Modes<T> {
    /// Rounds to the working precision.
    pub(crate) fn new(modes: &LineModes) -> Self {
        Self {
            vectors: Dense::from_mat(modes.vectors.as_ref()),
            transposed: Dense::from_mat(modes.vectors.transpose()),
            values: modes.values.iter().map(|v| T::from_f64(*v)).collect(),
        }
    }
}

/// One box: where it lies in the array, and the modes of its axes.
#[derive(Debug)]
pub(crate) struct SeparableBox<T> {
    /// The entries of the array that belong to the box.
    window: Window,
    /// Whether the constant has no energy: its mode, the first of each axis, is then omitted.
    singular: bool,
    modes: [Arc<Modes<T>>; 3],
    /// Factors of the entries of the box, by which the inverse is multiplied from both sides.
    scaling: Option<Vec<T>>,
}

impl<T: Real> SeparableBox<T> {
    /// A box over `window` of the array.
    pub(crate) fn new(window: Window, modes: [Arc<Modes<T>>; 3]) -> Self {
        Self { window, modes, singular: false, scaling: None }
    }

    /// This box without the constant, for a box without any held or free end, on which the constant has no
    /// energy.
    pub(crate) fn without_constant(self) -> Self {
        Self { singular: true, ..self }
    }

    fn shape(&self) -> Dims {
        [0, 1, 2].map(|a| self.window[a].len())
    }

    /// The least and the greatest eigenvalue of the box; the constant's does not count where it is omitted.
    pub(crate) fn eigenvalues(&self) -> [f64; 2] {
        let value = |a: usize, k: usize| self.modes[a].values.get(k).map_or(f64::INFINITY, |v| v.to_f64());
        let least = match self.singular {
            true => (0..3).map(|a| value(a, 1)).fold(f64::INFINITY, f64::min),
            false => (0..3).map(|a| value(a, 0)).sum(),
        };
        let greatest = (0..3).map(|a| self.modes[a].values.last().map_or(0.0, |v| v.to_f64())).sum();
        [least, greatest]
    }

    /// This box with its inverse between two multiplications by `scaling` (one factor per entry of the box).
    pub(crate) fn with_scaling(self, scaling: Vec<T>) -> Self {
        Self { scaling: Some(scaling), ..self }
    }

    /// Applies the inverse to the box's part of `r` and writes the result to `out` (contiguous, in the shape
    /// of the box).
    pub(crate) fn solve(&self, r: &[T], dims: Dims, work: &mut Vec<T>, out: &mut Vec<T>) {
        let [n0, n1, n2] = self.shape();
        let plane = n1 * n2;
        sized(work, n0 * plane);
        sized(out, n0 * plane);
        if n0 * plane == 0 {
            return;
        }
        let modes = |a: usize| &*self.modes[a];
        let corner = (self.window[0].start * dims[1] + self.window[1].start) * dims[2] + self.window[2].start;
        let stride = dims[1] * dims[2];
        // Along the last two axes, slab by slab, straight from the array.
        let batch = slab_batch(plane);
        let scaling = |i: usize| self.scaling.as_ref().map(|factors| &factors[i * plane..(i + 1) * plane]);
        work.par_chunks_mut(plane).enumerate().with_min_len(batch).for_each_init(
            || vec![T::default(); plane],
            |tmp, (i, slab)| {
                let mut from = right(r, corner + i * stride, n2, dims[2]);
                if let Some(scaling) = scaling(i) {
                    let rows = slab.chunks_exact_mut(n2).zip(scaling.chunks_exact(n2));
                    for ((to, by), row) in rows.zip(from.data.chunks(dims[2])) {
                        for ((t, s), x) in to.iter_mut().zip(by).zip(row) {
                            *t = *s * *x;
                        }
                    }
                    from = right(slab, 0, n2, n2);
                }
                multiply(modes(1).transposed.left(), from, target(tmp, 0, n2), false);
                multiply(left(tmp, 0, n1, n2, n2), modes(2).vectors.right(), target(slab, 0, n2), false);
            },
        );
        self.solve_lines(work);
        // Back along the last two axes.
        out.par_chunks_mut(plane).zip(work.par_chunks(plane)).enumerate().with_min_len(batch).for_each_init(
            || vec![T::default(); plane],
            |tmp, (i, (slab, from))| {
                multiply(left(from, 0, n1, n2, n2), modes(2).transposed.right(), target(tmp, 0, n2), false);
                multiply(modes(1).vectors.left(), right(tmp, 0, n2, n2), target(slab, 0, n2), false);
                if let Some(scaling) = scaling(i) {
                    slab.iter_mut().zip(scaling).for_each(|(x, s)| *x = *x * *s);
                }
            },
        );
    }

    /// Multiplies along the first axis there and back, with the division by the sums of eigenvalues in
    /// between. Entries of such lines lie far apart: a few neighbouring lines are copied to a buffer where
    /// both products find them in the caches.
    fn solve_lines(&self, work: &mut [T]) {
        let [n0, n1, n2] = self.shape();
        let plane = n1 * n2;
        let [first, second, third] = &self.modes;
        let bundle = |(b, mut rows): (usize, Vec<&mut [T]>), [lines, in_modes, sums]: &mut [Vec<T>; 3]| {
            let width = rows.first().map_or(0, |row| row.len());
            for (line, row) in lines.chunks_exact_mut(LINES).zip(&rows) {
                line[..width].copy_from_slice(row);
            }
            for (c, sum) in sums.iter_mut().take(width).enumerate() {
                let line = b * LINES + c;
                *sum = second.values[line / n2] + third.values[line % n2];
            }
            multiply(
                first.transposed.left(),
                right(lines, 0, width, LINES),
                target(in_modes, 0, LINES),
                false,
            );
            for (line, l) in in_modes.chunks_exact_mut(LINES).zip(&first.values) {
                for (x, sum) in line.iter_mut().zip(&*sums).take(width) {
                    *x = *x / (*l + *sum);
                }
            }
            if self.singular && b == 0 {
                in_modes[0] = T::default();
            }
            multiply(first.vectors.left(), right(in_modes, 0, width, LINES), target(lines, 0, LINES), false);
            for (row, line) in rows.iter_mut().zip(lines.chunks_exact(LINES)) {
                row.copy_from_slice(&line[..width]);
            }
        };
        let mut bundles: Vec<Vec<&mut [T]>> =
            (0..plane.div_ceil(LINES)).map(|_| Vec::with_capacity(n0)).collect();
        for slab in work.chunks_exact_mut(plane) {
            for (bundle_rows, row) in bundles.iter_mut().zip(slab.chunks_mut(LINES)) {
                bundle_rows.push(row);
            }
        }
        let batch = slab_batch(n0 * LINES);
        bundles.into_par_iter().enumerate().with_min_len(batch).for_each_init(
            || [n0 * LINES, n0 * LINES, LINES].map(|n| vec![T::default(); n]),
            |buffers, rows| bundle(rows, buffers),
        );
    }
}

/// Lines of the first axis that are solved together. Tuned: `cargo bench --bench solver`.
const LINES: usize = 128;

/// Rows of axis 0 handled by one task: few enough tasks that the right factor is not read too often.
pub(crate) fn row_block(n0: usize, plane: usize) -> usize {
    let pieces = (n0 * plane / 16_384).clamp(1, 4);
    n0.div_ceil(pieces).next_multiple_of(6)
}

/// Slabs handled by one task: enough work to be worth the start of a task.
fn slab_batch(plane: usize) -> usize {
    (4096 / plane.max(1)).max(1)
}

/// The sum of the boxes' inverses: an additive Schwarz preconditioner.
#[derive(Debug)]
pub(crate) struct Schwarz<T> {
    boxes: Vec<SeparableBox<T>>,
    /// Dimensions of the array.
    dims: Dims,
    /// More boxes, on quarters of a scene whose half the array belongs to.
    folded: Option<Box<Folded<T>>>,
}

/// Boxes on two quarters of a scene: one for functions that are odd across the middle of the last axis, one
/// for even functions.
#[derive(Debug)]
struct Folded<T> {
    /// The split of an array into its odd and its even part.
    fold: Fold,
    /// The boxes for each of the two parts.
    quarters: [Schwarz<T>; 2],
}

/// Buffers of [`Schwarz::apply`], kept between calls.
#[derive(Debug, Default)]
pub(crate) struct SchwarzWork<T> {
    /// Scratch and result for each box.
    per_box: Vec<(Vec<T>, Vec<T>)>,
    /// The buffers of the two quarters.
    quarters: [Option<Box<SchwarzWork<T>>>; 2],
    /// The parts of the residual on the two quarters.
    parts: [Vec<T>; 2],
    /// The results of the preconditioners of the two quarters for these parts.
    results: [Vec<T>; 2],
}

impl<T: Real> Schwarz<T> {
    /// Boxes over an array of shape `dims`.
    pub(crate) fn new(boxes: Vec<SeparableBox<T>>, dims: Dims) -> Self {
        Self { boxes, dims, folded: None }
    }

    /// This preconditioner with more boxes, on the quarters of a scene whose half the array belongs to.
    pub(crate) fn with_quarters(self, fold: Fold, quarters: [Self; 2]) -> Self {
        Self { folded: Some(Box::new(Folded { fold, quarters })), ..self }
    }

    /// z = sum over boxes of (A on the box)^-1 r.
    pub(crate) fn apply(&self, r: &[T], z: &mut [T], work: &mut SchwarzWork<T>) {
        self.apply_boxes(r, z, work);
        let Some(folded) = &self.folded else { return };
        let SchwarzWork { quarters, parts, results, .. } = work;
        folded.fold.write_parts(r, parts);
        for (k, (schwarz, r)) in folded.quarters.iter().zip(parts).enumerate() {
            sized(&mut results[k], r.len());
            schwarz.apply(r, &mut results[k], quarters[k].get_or_insert_default());
        }
        folded.fold.add(results.each_ref().map(Vec::as_slice), z);
    }

    /// Applies the boxes of the array itself, without those on quarters.
    fn apply_boxes(&self, r: &[T], z: &mut [T], work: &mut SchwarzWork<T>) {
        work.per_box.resize_with(self.boxes.len(), Default::default);
        self.boxes
            .par_iter()
            .zip(&mut work.per_box)
            .for_each(|(b, (scratch, out))| b.solve(r, self.dims, scratch, out));
        let plane = self.dims[1] * self.dims[2];
        z.par_chunks_mut(plane.max(1)).enumerate().with_min_len(slab_batch(plane)).for_each(|(i, slab)| {
            slab.fill(T::default());
            for (b, (_, out)) in self.boxes.iter().zip(&work.per_box) {
                let [wi, wj, wk] = &b.window;
                if !wi.contains(&i) {
                    continue;
                }
                let (n1, n2) = (wj.len(), wk.len());
                let source = &out[(i - wi.start) * n1 * n2..][..n1 * n2];
                for (j, row) in source.chunks_exact(n2.max(1)).enumerate() {
                    let start = (wj.start + j) * self.dims[2] + wk.start;
                    for (d, s) in slab[start..start + n2].iter_mut().zip(row) {
                        *d += *s;
                    }
                }
            }
        });
    }
}
