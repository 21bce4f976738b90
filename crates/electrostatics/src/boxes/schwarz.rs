//! Separable boxes inverted by fast diagonalisation, and their sum as a preconditioner.
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
    window: Window,
    /// Whether the constant has no energy: its mode, the first of each axis, is then omitted.
    singular: bool,
    modes: [Arc<Modes<T>>; 3],
    scaling: Option<Vec<T>>,
}

impl<T: Real> SeparableBox<T> {
    /// A box over `window` of the array.
    pub(crate) fn new(window: Window, modes: [Arc<Modes<T>>; 3]) -> Self {
        Self { window, modes, singular: false, scaling: None }
    }

    /// The same for a box without any held or free end, on which the constant has no energy.
    pub(crate) fn without_constant(self) -> Self {
        Self { singular: true, ..self }
    }

    fn shape(&self) -> Dims {
        [0, 1, 2].map(|a| self.window[a].len())
    }

    /// The same between two multiplications by `scaling` (one factor per entry of the box).
    pub(crate) fn with_scaling(self, scaling: Vec<T>) -> Self {
        Self { scaling: Some(scaling), ..self }
    }

    /// Applies the inverse to the box's part of `r` and writes the result to `out` (contiguous, in the box's own shape).
    pub(crate) fn solve(&self, r: &[T], dims: Dims, work: &mut Vec<T>, out: &mut Vec<T>) {
        let [n0, n1, n2] = self.shape();
        let plane = n1 * n2;
        sized(work, n0 * plane);
        sized(out, n0 * plane);
        if n0 * plane == 0 {
            return;
        }
        let modes = |a: usize| &*self.modes[a];
        let block = row_block(n0, plane);
        let corner = (self.window[0].start * dims[1] + self.window[1].start) * dims[2] + self.window[2].start;
        let (mut r, mut corner, mut stride, mut row) = (r, corner, dims[1] * dims[2], dims[2]);
        if let Some(scaling) = &self.scaling {
            for (line, (to, by)) in out.chunks_exact_mut(n2).zip(scaling.chunks_exact(n2)).enumerate() {
                let from = corner + line / n1 * stride + line % n1 * row;
                for ((t, s), x) in to.iter_mut().zip(by).zip(&r[from..from + n2]) {
                    *t = *s * *x;
                }
            }
            (r, corner, stride, row) = (&*out, 0, plane, n2);
        }
        // Along axis 0 straight from the array: whole runs of rows where the box spans the last axis.
        let (strips, width) = if n2 == row { (1, plane) } else { (n1, n2) };
        work.par_chunks_mut(block * plane).enumerate().for_each(|(b, out)| {
            let some = b * block..(b * block + out.len() / plane);
            for j in 0..strips {
                let source = right(r, corner + j * row, width, stride);
                let a = modes(0).transposed.left_rows(some.clone());
                multiply(a, source, target(out, j * n2, plane), false);
            }
        });
        // Along the other two, slab by slab, there and back.
        let (l0, l1, l2) = (&modes(0).values, &modes(1).values, &modes(2).values);
        work.par_chunks_mut(plane).enumerate().with_min_len(slab_batch(plane)).for_each_init(
            || vec![T::default(); plane],
            |tmp, (i, slab)| {
                multiply(modes(1).transposed.left(), right(slab, 0, n2, n2), target(tmp, 0, n2), false);
                multiply(left(tmp, 0, n1, n2, n2), modes(2).vectors.right(), target(slab, 0, n2), false);
                for j in 0..n1 {
                    let base = l0[i] + l1[j];
                    for (x, l) in slab[j * n2..(j + 1) * n2].iter_mut().zip(l2) {
                        *x = *x / (base + *l);
                    }
                }
                if self.singular && i == 0 {
                    slab[0] = T::default();
                }
                multiply(left(slab, 0, n1, n2, n2), modes(2).transposed.right(), target(tmp, 0, n2), false);
                multiply(modes(1).vectors.left(), right(tmp, 0, n2, n2), target(slab, 0, n2), false);
            },
        );
        out.par_chunks_mut(block * plane).enumerate().for_each(|(b, out)| {
            let some = b * block..(b * block + out.len() / plane);
            multiply(
                modes(0).vectors.left_rows(some),
                right(work, 0, plane, plane),
                target(out, 0, plane),
                false,
            );
        });
        if let Some(scaling) = &self.scaling {
            out.par_iter_mut().zip(scaling).with_min_len(16_384).for_each(|(x, s)| *x = *x * *s);
        }
    }
}

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
    dims: Dims,
    folded: Option<Box<Folded<T>>>,
}

/// Boxes on two quarters of a scene, for what is odd across the middle of the last axis of a half of it, and what is even.
#[derive(Debug)]
struct Folded<T> {
    fold: Fold,
    quarters: [Schwarz<T>; 2],
}

/// Buffers of [`Schwarz::apply`], kept between calls.
#[derive(Debug, Default)]
pub(crate) struct SchwarzWork<T> {
    per_box: Vec<(Vec<T>, Vec<T>)>,
    /// Of the quarters, the parts of the residual on them, and what they give.
    quarters: [Option<Box<SchwarzWork<T>>>; 2],
    parts: [Vec<T>; 2],
    found: [Vec<T>; 2],
}

impl<T: Real> Schwarz<T> {
    /// Boxes over an array of shape `dims`.
    pub(crate) fn new(boxes: Vec<SeparableBox<T>>, dims: Dims) -> Self {
        Self { boxes, dims, folded: None }
    }

    /// With more boxes, on the quarters of a scene whose half the array belongs to.
    pub(crate) fn with_quarters(self, fold: Fold, quarters: [Self; 2]) -> Self {
        Self { folded: Some(Box::new(Folded { fold, quarters })), ..self }
    }

    /// z = sum over boxes of (A on the box)^-1 r.
    pub(crate) fn apply(&self, r: &[T], z: &mut [T], work: &mut SchwarzWork<T>) {
        self.apply_boxes(r, z, work);
        let Some(folded) = &self.folded else { return };
        let SchwarzWork { quarters, parts, found, .. } = work;
        folded.fold.write_parts(r, parts);
        for (k, (schwarz, r)) in folded.quarters.iter().zip(parts).enumerate() {
            sized(&mut found[k], r.len());
            schwarz.apply(r, &mut found[k], quarters[k].get_or_insert_default());
        }
        folded.fold.add(found.each_ref().map(Vec::as_slice), z);
    }

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
                    let at = (wj.start + j) * self.dims[2] + wk.start;
                    for (d, s) in slab[at..at + n2].iter_mut().zip(row) {
                        *d += *s;
                    }
                }
            }
        });
    }
}
