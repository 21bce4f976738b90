//! Inverses on products of a part of the plan and a part of the line, by the modes of the line and a factor
//! of the plan for each mode.

use super::inner_unknowns::InnerUnknowns;
use super::local::Local;
use super::plane_system::{Numbering, PlaneSystem};
use elastocap_fem::modes::LineModes;
use elastocap_fem::tensor::{Real, left, multiply, right, target};
use elastocap_linalg::lanes::{LANES, Lane, LaneFactor, Root};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Arc;

/// Rows per parallel task in the transforms to the modes and back. Tuned:
/// `cargo run --release -p elastocap-electrostatics --example extruded_tables`.
const ROWS: usize = 128;

/// The inverse on the product of a part of the plan and a part of the line.
#[derive(Debug)]
pub(super) struct Region<T> {
    /// The system on the part of the plan.
    system: Arc<PlaneSystem>,
    /// The functions on the part of the line.
    window: Range<usize>,
    /// The vectors of the modes, a row for each function of the window. Batches of [`LANES`] modes follow one
    /// another; the last one is filled up with zeros.
    vectors: Vec<T>,
    /// The transpose of `vectors`.
    transposed: Vec<T>,
    batches: Vec<Batch<T>>,
    /// Factors by which the unknowns are multiplied before and after the solution.
    scaling: Scaling,
    /// The couplings of the unknowns inside triangles.
    couplings: InnerUnknowns<T>,
}

/// Modes whose systems are solved side by side.
#[derive(Debug)]
struct Batch<T> {
    /// The eigenvalue of each mode.
    lambda: Lane<T>,
    /// The factors of A + lambda M for each mode.
    factor: LaneFactor<T>,
}

/// Factors by which unknowns are multiplied: a number for each piece of the window and each row.
#[derive(Debug, Clone, Default)]
pub(super) struct Scaling {
    /// The pieces of the window; empty where all factors are 1.
    pub pieces: Vec<Range<usize>>,
    /// A factor for each piece, row after row.
    pub factors: Vec<f64>,
}

impl Scaling {
    /// Multiplies the values of a row by its factors.
    fn apply<T: Real>(&self, row: usize, values: &mut [T]) {
        let factors = self.factors.get(row * self.pieces.len()..).unwrap_or(&[]);
        for (piece, factor) in self.pieces.iter().zip(factors) {
            let factor = T::from_f64(*factor);
            values[piece.clone()].iter_mut().for_each(|x| *x = *x * factor);
        }
    }
}

/// Arrays for the modes of a region, reused from one solution to the next: with few right-hand sides,
/// allocation would cost as much as the solution.
#[derive(Debug, Default)]
pub(super) struct Workspace {
    /// For each batch of modes the rows of all right-hand sides, for inverses in single precision.
    single: Vec<Vec<Lane<f32>>>,
    /// The same arrays for inverses in double precision.
    double: Vec<Vec<Lane<f64>>>,
}

impl<T: Real + Root> Region<T> {
    /// The inverse on the functions of the window, whose `modes` are given. `None` if A + lambda M is not
    /// positive definite for some mode.
    fn new(
        system: Arc<PlaneSystem>,
        numbering: &Numbering,
        locals: &[Local],
        window: Range<usize>,
        modes: &LineModes,
    ) -> Option<Self> {
        let LineModes { vectors, values } = modes;
        let (count, n) = (values.len(), window.len());
        let starts: Vec<usize> = (0..count).step_by(LANES).collect();
        let padded = starts.len() * LANES;
        let entry = |i: usize, k: usize| if k < count { T::from_f64(vectors[(i, k)]) } else { T::default() };
        let by_functions = (0..n).flat_map(|i| (0..padded).map(move |k| (i, k))).map(|(i, k)| entry(i, k));
        let by_modes = (0..padded).flat_map(|k| (0..n).map(move |i| (i, k))).map(|(i, k)| entry(i, k));
        let (vectors, transposed) = (by_functions.collect(), by_modes.collect());
        let batches: Option<Vec<_>> = starts
            .par_iter()
            .map(|&start| {
                // The last batch is filled up with copies of the last mode, whose vectors are zero.
                let (mut exact, mut lambda) = (Lane::splat(0.0), Lane::default());
                for k in 0..LANES {
                    exact.0[k] = values[(start + k).min(count - 1)];
                    lambda.0[k] = T::from_f64(exact.0[k]);
                }
                Some(Batch { lambda, factor: system.factorise(numbering, locals, &exact)? })
            })
            .collect();
        let couplings = system.inner_unknowns(locals);
        let scaling = Scaling::default();
        Some(Self { system, window, vectors, transposed, batches: batches?, scaling, couplings })
    }

    /// Adds the solutions for several right-hand sides `r`, arrays of rows with `width` numbers each, to `z`.
    fn add_solutions<U: Real>(
        &self,
        r: &[&[U]],
        z: &mut [&mut [U]],
        width: usize,
        workspace: &mut Vec<Vec<Lane<T>>>,
    ) {
        let (rows, sides) = (self.system.rows.len(), r.len());
        if rows == 0 || self.window.is_empty() {
            return;
        }
        // For each batch of modes the rows of all right-hand sides.
        workspace.resize_with(self.batches.len().max(workspace.len()), Vec::new);
        let modal = &mut workspace[..self.batches.len()];
        modal.iter_mut().for_each(|batch| batch.resize(rows * sides, Lane::default()));
        for (side, r) in r.iter().enumerate() {
            self.to_modes(r, width, modal, side * rows..(side + 1) * rows);
        }
        modal.par_iter_mut().zip(&self.batches).for_each(|(batch, Batch { lambda, factor })| {
            let mut vectors: Vec<&mut [Lane<T>]> = batch.chunks_exact_mut(rows).collect();
            self.system.solve(&self.couplings, lambda, factor, &mut vectors);
        });
        for (side, z) in z.iter_mut().enumerate() {
            self.add_from_modes(modal, side * rows..(side + 1) * rows, z, width);
        }
    }

    /// Transforms the rows of a right-hand side to the modes of the line.
    fn to_modes<U: Real>(&self, r: &[U], width: usize, modal: &mut [Vec<Lane<T>>], places: Range<usize>) {
        let (n, padded) = (self.window.len(), self.batches.len() * LANES);
        let mut of_batches: Vec<_> =
            modal.iter_mut().map(|batch| batch[places.clone()].chunks_mut(ROWS)).collect();
        let chunks: Vec<_> = self
            .system
            .rows
            .chunks(ROWS)
            .map(|rows| (rows, of_batches.iter_mut().filter_map(Iterator::next).collect::<Vec<_>>()))
            .collect();
        chunks.into_par_iter().enumerate().for_each_init(
            || (vec![T::default(); ROWS * n], vec![T::default(); ROWS * padded]),
            |(gathered, by_modes), (chunk, (rows, mut targets))| {
                for (k, (row, out)) in rows.iter().zip(gathered.chunks_exact_mut(n)).enumerate() {
                    let values = &r[*row as usize * width + self.window.start..][..n];
                    out.iter_mut().zip(values).for_each(|(x, r)| *x = T::from_f64(r.to_f64()));
                    self.scaling.apply(chunk * ROWS + k, out);
                }
                multiply(
                    left(gathered, 0, rows.len(), n, n),
                    right(&self.vectors, 0, padded, padded),
                    target(by_modes, 0, padded),
                    false,
                );
                for (row, values) in by_modes.chunks_exact(padded).take(rows.len()).enumerate() {
                    for (target, values) in targets.iter_mut().zip(values.chunks_exact(LANES)) {
                        target[row].0.copy_from_slice(values);
                    }
                }
            },
        );
    }

    /// Transforms a solution back from the modes and adds it to the rows of `z`.
    fn add_from_modes<U: Real>(
        &self,
        modal: &[Vec<Lane<T>>],
        places: Range<usize>,
        z: &mut [U],
        width: usize,
    ) {
        let (n, padded) = (self.window.len(), self.batches.len() * LANES);
        // Each row belongs to one chunk.
        let mut rows: Vec<Option<&mut [U]>> = z.chunks_exact_mut(width).map(Some).collect();
        let mut region_rows: Vec<&mut [U]> =
            self.system.rows.iter().filter_map(|row| rows[*row as usize].take()).collect();
        region_rows.par_chunks_mut(ROWS).enumerate().for_each_init(
            || (vec![T::default(); ROWS * n], vec![T::default(); ROWS * padded]),
            |(solution, by_modes), (chunk, rows)| {
                let first = places.start + chunk * ROWS;
                for (row, values) in by_modes.chunks_exact_mut(padded).take(rows.len()).enumerate() {
                    for (batch, values) in modal.iter().zip(values.chunks_exact_mut(LANES)) {
                        values.copy_from_slice(&batch[first + row].0);
                    }
                }
                multiply(
                    left(by_modes, 0, rows.len(), padded, padded),
                    right(&self.transposed, 0, n, n),
                    target(solution, 0, n),
                    false,
                );
                for (k, (row, values)) in rows.iter_mut().zip(solution.chunks_exact_mut(n)).enumerate() {
                    self.scaling.apply(chunk * ROWS + k, values);
                    let z = &mut row[self.window.clone()];
                    z.iter_mut().zip(values).for_each(|(z, x)| *z += U::from_f64(x.to_f64()));
                }
            },
        );
    }
}

/// An inverse, in single or in double precision.
#[derive(Debug)]
pub(super) enum Inverse {
    Single(Region<f32>),
    Double(Region<f64>),
}

impl Inverse {
    /// Computes the inverse in single precision, or in double precision where triangles are too flat for
    /// that; see [`Region::new`]. `None` if a matrix is not positive definite in double precision either.
    pub(super) fn new(
        system: PlaneSystem,
        numbering: &Numbering,
        locals: &[Local],
        window: Range<usize>,
        modes: &LineModes,
    ) -> Option<Self> {
        let system = Arc::new(system);
        let single =
            Region::new(Arc::clone(&system), numbering, locals, window.clone(), modes).map(Self::Single);
        single.or_else(|| Region::new(system, numbering, locals, window, modes).map(Self::Double))
    }

    /// Recomputes a single-precision inverse in double precision. `None` if it is in double precision
    /// already, or if a matrix is not positive definite.
    pub(super) fn doubled(&self, numbering: &Numbering, locals: &[Local], modes: &LineModes) -> Option<Self> {
        let Self::Single(region) = self else { return None };
        let (system, window) = (Arc::clone(&region.system), region.window.clone());
        Region::new(system, numbering, locals, window, modes).map(Self::Double)
    }

    /// Sets the factors by which the unknowns are multiplied before and after the solution.
    pub(super) fn scale(&mut self, scaling: Scaling) {
        match self {
            Self::Single(region) => region.scaling = scaling,
            Self::Double(region) => region.scaling = scaling,
        }
    }

    /// Adds the solutions for several right-hand sides `r` to `z`.
    pub(super) fn add_solutions<U: Real>(
        &self,
        r: &[&[U]],
        z: &mut [&mut [U]],
        width: usize,
        workspace: &mut Workspace,
    ) {
        match self {
            Self::Single(region) => region.add_solutions(r, z, width, &mut workspace.single),
            Self::Double(region) => region.add_solutions(r, z, width, &mut workspace.double),
        }
    }
}
