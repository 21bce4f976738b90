//! Forward and back substitution with the factors of several matrices side by side.
//!
//! Up to [`ABREAST`] right-hand sides are solved for together, so that the factor is read from memory only
//! once. The rows of a factor are short and a sum over one is a chain of dependent additions, which is why
//! several rows are summed at the same time.

use super::{Elimination, Lane, LaneFactor, Root, Supernode};
use crate::gemm::Real;
use pulp::{Arch, Simd, WithSimd};

/// The largest number of right-hand sides that are solved for together. Tuned:
/// `cargo run --release -p elastocap-electrostatics --example extruded_tables`.
pub const ABREAST: usize = 4;

/// The lanes of one unknown in each of `R` right-hand sides.
type Abreast<T, const R: usize> = [Lane<T>; R];

impl Elimination {
    /// Overwrites each right-hand side in `x`, one lane per unknown, with its solution. The factor is read
    /// from memory once for [`ABREAST`] right-hand sides.
    pub fn solve<T: Real + Root>(&self, factor: &LaneFactor<T>, x: &mut [&mut [Lane<T>]]) {
        for vectors in x.chunks_mut(ABREAST) {
            match vectors {
                [a] => solve_together(self, factor, [&mut **a]),
                [a, b] => solve_together(self, factor, [&mut **a, &mut **b]),
                [a, b, c] => solve_together(self, factor, [&mut **a, &mut **b, &mut **c]),
                [a, b, c, d] => solve_together(self, factor, [&mut **a, &mut **b, &mut **c, &mut **d]),
                _ => {}
            }
        }
    }
}

/// Overwrites `R` right-hand sides with their solutions, by one pass over the factor.
fn solve_together<T: Real + Root, const R: usize>(
    plan: &Elimination,
    factor: &LaneFactor<T>,
    vectors: [&mut [Lane<T>]; R],
) {
    Arch::new().dispatch(Substitution { plan, factor, vectors });
}

/// Forward and back substitution for `R` right-hand sides.
struct Substitution<'a, 'b, T, const R: usize> {
    plan: &'a Elimination,
    factor: &'a LaneFactor<T>,
    /// The right-hand sides, then the solutions.
    vectors: [&'b mut [Lane<T>]; R],
}

impl<T: Real + Root, const R: usize> WithSimd for Substitution<'_, '_, T, R> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        // Machines with registers of 32 bytes have fused products.
        match size_of::<S::f32s>() {
            32.. => self.solve::<true>(),
            _ => self.solve::<false>(),
        }
    }
}

impl<T: Real + Root, const R: usize> Substitution<'_, '_, T, R> {
    #[inline(always)]
    fn solve<const FUSED: bool>(self) {
        let Self { plan, factor, mut vectors } = self;
        let zero = [Lane::default(); R];
        let columns = plan.supernodes.iter().map(|node| node.columns as usize).max().unwrap_or(0);
        let rows = plan.supernodes.iter().map(|node| node.below.len()).max().unwrap_or(0);
        let (mut unknowns, mut below) = (vec![zero; columns], vec![zero; rows]);
        for node in &plan.supernodes {
            let unknowns = &mut unknowns[..node.columns as usize];
            let (square, panel) = factor.parts(node);
            gather(&vectors, node, unknowns);
            forward::<T, R, FUSED>(square, unknowns);
            scatter(&mut vectors, node, unknowns);
            subtract_rows::<T, R, FUSED>(panel, unknowns, &node.below, &mut vectors);
        }
        for node in plan.supernodes.iter().rev() {
            let (unknowns, below) = (&mut unknowns[..node.columns as usize], &mut below[..node.below.len()]);
            let (square, panel) = factor.parts(node);
            gather(&vectors, node, unknowns);
            for (values, row) in below.iter_mut().zip(&node.below) {
                for s in 0..R {
                    values[s] = vectors[s][*row as usize];
                }
            }
            subtract_columns::<T, R, FUSED>(panel, below, unknowns);
            backward(square, unknowns);
            scatter(&mut vectors, node, unknowns);
        }
    }
}

impl<T> LaneFactor<T> {
    /// The columns of a supernode: the square block on the diagonal, and the panel below it.
    #[inline(always)]
    fn parts(&self, node: &Supernode) -> (&[Lane<T>], &[Lane<T>]) {
        let columns = node.columns as usize;
        let panel = &self.values[node.offset..][..columns * (columns + node.below.len())];
        panel.split_at(columns * columns)
    }
}

/// Copies the entries at the unknowns of a supernode out of the vectors.
#[inline(always)]
fn gather<T: Real, const R: usize>(
    vectors: &[&mut [Lane<T>]; R],
    node: &Supernode,
    unknowns: &mut [Abreast<T, R>],
) {
    let first = node.first as usize;
    for s in 0..R {
        for (unknown, x) in unknowns.iter_mut().zip(&vectors[s][first..]) {
            unknown[s] = *x;
        }
    }
}

/// Copies the entries at the unknowns of a supernode back into the vectors.
#[inline(always)]
fn scatter<T: Real, const R: usize>(
    vectors: &mut [&mut [Lane<T>]; R],
    node: &Supernode,
    unknowns: &[Abreast<T, R>],
) {
    let first = node.first as usize;
    for s in 0..R {
        for (unknown, x) in unknowns.iter().zip(&mut vectors[s][first..]) {
            *x = unknown[s];
        }
    }
}

/// Solves with a lower triangle, stored row by row, whose diagonal holds the inverses of its entries.
#[inline(always)]
fn forward<T: Real, const R: usize, const FUSED: bool>(square: &[Lane<T>], unknowns: &mut [Abreast<T, R>]) {
    let columns = unknowns.len();
    for c in 0..columns {
        let line = &square[c * columns..][..=c];
        let mut sum = [Lane::default(); R];
        for (l, x) in line[..c].iter().zip(unknowns.iter()) {
            for s in 0..R {
                sum[s] = sum[s].plus_product::<FUSED>(*l, x[s]);
            }
        }
        for s in 0..R {
            unknowns[c][s] = unknowns[c][s].minus(sum[s]).times(line[c]);
        }
    }
}

/// Solves with the transpose of the lower triangle that [`forward`] solves with.
#[inline(always)]
fn backward<T: Real, const R: usize>(square: &[Lane<T>], unknowns: &mut [Abreast<T, R>]) {
    let columns = unknowns.len();
    for c in (0..columns).rev() {
        let line = &square[c * columns..][..=c];
        let (before, rest) = unknowns.split_at_mut(c);
        for s in 0..R {
            rest[0][s] = rest[0][s].times(line[c]);
        }
        for (x, l) in before.iter_mut().zip(line) {
            for s in 0..R {
                x[s] = x[s].minus(l.times(rest[0][s]));
            }
        }
    }
}

/// Rows or columns that are summed at the same time. Tuned:
/// `cargo run --release -p elastocap-electrostatics --example extruded_tables`.
const AT_ONCE: usize = 4;

/// Subtracts the products of the rows of a panel and the `unknowns` of its supernode from the entries of
/// `vectors` at the unknowns `below`.
#[inline(always)]
fn subtract_rows<T: Real, const R: usize, const FUSED: bool>(
    panel: &[Lane<T>],
    unknowns: &[Abreast<T, R>],
    below: &[u32],
    vectors: &mut [&mut [Lane<T>]; R],
) {
    let columns = unknowns.len();
    let whole = below.len() / AT_ONCE * AT_ONCE;
    for first in (0..whole).step_by(AT_ONCE) {
        let lines = &panel[first * columns..][..AT_ONCE * columns];
        let (ab, cd) = lines.split_at(2 * columns);
        let ((a, b), (c, d)) = (ab.split_at(columns), cd.split_at(columns));
        let mut sum = [[Lane::default(); R]; AT_ONCE];
        for ((((a, b), c), d), x) in a.iter().zip(b).zip(c).zip(d).zip(unknowns) {
            for s in 0..R {
                sum[0][s] = sum[0][s].plus_product::<FUSED>(*a, x[s]);
                sum[1][s] = sum[1][s].plus_product::<FUSED>(*b, x[s]);
                sum[2][s] = sum[2][s].plus_product::<FUSED>(*c, x[s]);
                sum[3][s] = sum[3][s].plus_product::<FUSED>(*d, x[s]);
            }
        }
        for i in 0..AT_ONCE {
            for s in 0..R {
                let entry = &mut vectors[s][below[first + i] as usize];
                *entry = entry.minus(sum[i][s]);
            }
        }
    }
    for row in whole..below.len() {
        let mut sum = [Lane::default(); R];
        for (l, x) in panel[row * columns..][..columns].iter().zip(unknowns) {
            for s in 0..R {
                sum[s] = sum[s].plus_product::<FUSED>(*l, x[s]);
            }
        }
        for s in 0..R {
            let entry = &mut vectors[s][below[row] as usize];
            *entry = entry.minus(sum[s]);
        }
    }
}

/// Subtracts the products of the columns of a panel and the values `below` from the `unknowns` of its
/// supernode.
#[inline(always)]
fn subtract_columns<T: Real, const R: usize, const FUSED: bool>(
    panel: &[Lane<T>],
    below: &[Abreast<T, R>],
    unknowns: &mut [Abreast<T, R>],
) {
    let columns = unknowns.len();
    let mut first = 0;
    while first + AT_ONCE <= columns {
        let mut sum = [[Lane::default(); R]; AT_ONCE];
        for (line, x) in panel.chunks_exact(columns).zip(below) {
            let line = &line[first..][..AT_ONCE];
            for i in 0..AT_ONCE {
                for s in 0..R {
                    sum[i][s] = sum[i][s].plus_product::<FUSED>(line[i], x[s]);
                }
            }
        }
        for i in 0..AT_ONCE {
            for s in 0..R {
                unknowns[first + i][s] = unknowns[first + i][s].minus(sum[i][s]);
            }
        }
        first += AT_ONCE;
    }
    for c in first..columns {
        let mut sum = [Lane::default(); R];
        for (line, x) in panel.chunks_exact(columns).zip(below) {
            for s in 0..R {
                sum[s] = sum[s].plus_product::<FUSED>(line[c], x[s]);
            }
        }
        for s in 0..R {
            unknowns[c][s] = unknowns[c][s].minus(sum[s]);
        }
    }
}
