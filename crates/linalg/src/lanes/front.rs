//! The dense part of a factorisation: the first columns of a front are eliminated from it.
//!
//! Nearly all operations of a factorisation are the products of blocks of rows in this file. A block has as
//! many rows and columns as the registers of the machine hold sums for: each number that is read serves a
//! whole row or column, and the additions are independent.

use super::{LANES, Lane, Root};
use crate::gemm::Real;
use pulp::{Simd, WithSimd};

/// A symmetric front whose first columns are to be eliminated.
pub(super) struct Front<'a, T> {
    /// Row by row; only the lower triangle counts.
    pub entries: &'a [Lane<T>],
    /// The number of rows of the front, and of its columns.
    pub rows: usize,
    /// The number of columns that are eliminated.
    pub columns: usize,
    /// Receives these columns of the factor, row by row, with the inverses of the diagonal entries on the
    /// diagonal.
    pub panel: &'a mut [Lane<T>],
    /// Receives the lower triangle of the other columns after the elimination, row by row.
    pub rest: &'a mut Vec<Lane<T>>,
}

impl<T: Real + Root> WithSimd for Front<'_, T> {
    /// Whether all pivots are positive.
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> bool {
        // Processors have 32 registers of 64 bytes or 16 smaller ones; those with at least 32 bytes have
        // fused products. The 16 sums of a block of four rows need a register each, hence 32 of them.
        let register = size_of::<S::f32s>();
        match register {
            64.. if size_of::<Lane<T>>() <= register => self.eliminate::<4, true>(),
            32.. => self.eliminate::<2, true>(),
            _ => self.eliminate::<2, false>(),
        }
    }
}

impl<T: Real + Root> Front<'_, T> {
    /// Eliminates the columns in blocks of `B` rows and columns. Returns whether all pivots are positive.
    #[inline(always)]
    fn eliminate<const B: usize, const FUSED: bool>(self) -> bool {
        let Self { entries, rows, columns, panel, rest } = self;
        for first in (0..columns).step_by(B) {
            let width = B.min(columns - first);
            let mut diagonal = [[Lane::default(); B]; B];
            for row in (first..rows).step_by(B) {
                let height = B.min(rows - row);
                let sums = {
                    let line = |i: usize| &panel[i * columns..][..first];
                    let column_lines: [&[Lane<T>]; B] =
                        std::array::from_fn(|c| line(first + c.min(width - 1)));
                    let lines: [&[Lane<T>]; B] = std::array::from_fn(|r| line(row + r.min(height - 1)));
                    products::<T, B, FUSED>(lines, column_lines)
                };
                let mut block = [[Lane::default(); B]; B];
                for r in 0..height {
                    for c in 0..width {
                        block[r][c] = entries[(row + r) * rows + first + c].minus(sums[r][c]);
                    }
                }
                if row == first {
                    if !factorise(&mut block, width) {
                        return false;
                    }
                    diagonal = block;
                }
                // In a narrow last block of columns, the rows below the diagonal begin in the same block as
                // the diagonal.
                let below = if row == first { width..height } else { 0..height };
                for values in &mut block[below] {
                    for c in 0..width {
                        let mut sum = Lane::default();
                        for k in 0..c {
                            sum = sum.plus_product::<FUSED>(values[k], diagonal[c][k]);
                        }
                        values[c] = values[c].minus(sum).times(diagonal[c][c]);
                    }
                }
                for r in 0..height {
                    panel[(row + r) * columns + first..][..width].copy_from_slice(&block[r][..width]);
                }
            }
            // The panel is read as a whole, so that the entries above the diagonal must be zero.
            for row in 0..first {
                panel[row * columns + first..][..width].fill(Lane::default());
            }
        }
        let below = rows - columns;
        rest.resize(below * (below + 1) / 2, Lane::default());
        let line = |i: usize| &panel[(columns + i) * columns..][..columns];
        for row in (0..below).step_by(B) {
            let height = B.min(below - row);
            let lines: [&[Lane<T>]; B] = std::array::from_fn(|r| line(row + r.min(height - 1)));
            for first in (0..row + height).step_by(B) {
                let others: [&[Lane<T>]; B] = std::array::from_fn(|c| line((first + c).min(below - 1)));
                let sums = products::<T, B, FUSED>(lines, others);
                for r in 0..height {
                    let i = row + r;
                    let width = B.min(i + 1 - first.min(i + 1));
                    let old = &entries[(columns + i) * rows + columns + first..][..width];
                    let target = &mut rest[i * (i + 1) / 2 + first..][..width];
                    for c in 0..width {
                        target[c] = old[c].minus(sums[r][c]);
                    }
                }
            }
        }
        true
    }
}

/// The inner products of each of `rows` and each of `others`.
#[inline(always)]
fn products<T: Real, const B: usize, const FUSED: bool>(
    rows: [&[Lane<T>]; B],
    others: [&[Lane<T>]; B],
) -> [[Lane<T>; B]; B] {
    let mut sums = [[Lane::default(); B]; B];
    let length = rows[0].len();
    let (rows, others) = (rows.map(|line| &line[..length]), others.map(|line| &line[..length]));
    for k in 0..length {
        for r in 0..B {
            for c in 0..B {
                sums[r][c] = sums[r][c].plus_product::<FUSED>(rows[r][k], others[c][k]);
            }
        }
    }
    sums
}

/// Factorises the first rows of a block; the diagonal then holds the inverses of its entries, and zeros are
/// above it. Returns whether all pivots are positive.
#[inline(always)]
fn factorise<T: Real + Root, const B: usize>(block: &mut [[Lane<T>; B]; B], width: usize) -> bool {
    for r in 0..width {
        let (done, rest) = block.split_at_mut(r);
        let row = &mut rest[0];
        for (c, above) in done.iter().enumerate() {
            let mut value = row[c];
            for k in 0..c {
                value = value.minus(row[k].times(above[k]));
            }
            row[c] = value.times(above[c]);
        }
        let mut pivot = row[r];
        for k in 0..r {
            pivot = pivot.minus(row[k].times(row[k]));
        }
        for k in 0..LANES {
            if !pivot.0[k].is_positive() {
                return false;
            }
            row[r].0[k] = T::from_f64(1.0) / pivot.0[k].root();
        }
        row[r + 1..].fill(Lane::default());
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    type Lanes = Vec<Lane<f64>>;

    /// The panel and the rest of a front whose first columns are eliminated, in blocks of `B`.
    fn eliminated<const B: usize, const FUSED: bool>(
        entries: &[Lane<f64>],
        rows: usize,
        columns: usize,
    ) -> Option<(Lanes, Lanes)> {
        let (mut panel, mut rest) = (vec![Lane::splat(f64::NAN); rows * columns], Vec::new());
        let front = Front { entries, rows, columns, panel: &mut panel, rest: &mut rest };
        front.eliminate::<B, FUSED>().then_some((panel, rest))
    }

    fn front(rows: usize) -> Lanes {
        let value = |i: usize, j: usize, lane: usize| {
            let diagonal = if i == j { rows as f64 } else { 0.0 };
            diagonal + ((i * j + i + j + lane) as f64).sin()
        };
        let entries = (0..rows).flat_map(|i| (0..rows).map(move |j| (i, j)));
        entries.map(|(i, j)| Lane(std::array::from_fn(|lane| value(i, j, lane)))).collect()
    }

    #[test]
    fn the_factor_and_what_is_left_add_up_to_the_front_whatever_the_blocks() {
        for rows in 1..=11 {
            let entries = front(rows);
            for columns in 1..=rows {
                for (panel, rest) in [
                    eliminated::<2, false>(&entries, rows, columns),
                    eliminated::<2, true>(&entries, rows, columns),
                    eliminated::<4, true>(&entries, rows, columns),
                ]
                .map(Option::unwrap)
                {
                    for (lane, i, j) in (0..LANES)
                        .flat_map(|lane| (0..rows).flat_map(move |i| (0..=i).map(move |j| (lane, i, j))))
                    {
                        let factor = |i: usize, k: usize| {
                            let entry = panel[i * columns + k].0[lane];
                            if i == k { 1.0 / entry } else { entry }
                        };
                        let mut sum: f64 = (0..columns.min(j + 1)).map(|k| factor(i, k) * factor(j, k)).sum();
                        if j >= columns {
                            let (i, j) = (i - columns, j - columns);
                            sum += rest[i * (i + 1) / 2 + j].0[lane];
                        }
                        let error = sum - entries[i * rows + j].0[lane];
                        assert!(error.abs() < 1e-12, "{rows} {columns}: {i} {j}: {error:e}");
                    }
                    // Above the diagonal the panel holds zeros.
                    for (i, k) in (0..columns).flat_map(|i| (i + 1..columns).map(move |k| (i, k))) {
                        assert_eq!(panel[i * columns + k], Lane::splat(0.0), "{rows} {columns}: {i} {k}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_pivot_that_is_not_positive_in_one_lane_is_noticed_in_any_block() {
        for at in 0..6 {
            let mut entries = front(6);
            entries[at * 6 + at].0[LANES - 1] = -1.0;
            assert!(eliminated::<4, true>(&entries, 6, 6).is_none(), "{at}");
            assert!(eliminated::<2, false>(&entries, 6, 6).is_none(), "{at}");
        }
    }
}
