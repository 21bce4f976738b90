//! Solving with factors of several matrices side by side.
//!
//! Right-hand sides are solved with together, so that a factor is read from memory once for all of them. Rows of a factor are short and
//! sums over them are chains of dependent additions, which is why several rows are summed up at the same time.

use super::{Elimination, Lane, LaneFactor, Root, Supernode};
use crate::gemm::Real;
use pulp::{Arch, Simd, WithSimd};

/// Right-hand sides that are solved with together, at most.
pub const ABREAST: usize = 4;

/// One number of each of `R` right-hand sides, all at the same place in them: a lane for each.
type Abreast<T, const R: usize> = [Lane<T>; R];

impl Elimination {
    /// Overwrites each of several `x`, one row of lanes for each unknown, with the solutions. The factor, which is read from memory, is
    /// read once for [`ABREAST`] of them.
    pub fn solve<T: Real + Root>(&self, factor: &LaneFactor<T>, x: &mut [&mut [Lane<T>]]) {
        for all in x.chunks_mut(ABREAST) {
            match all {
                [a] => solve_together(self, factor, [&mut **a]),
                [a, b] => solve_together(self, factor, [&mut **a, &mut **b]),
                [a, b, c] => solve_together(self, factor, [&mut **a, &mut **b, &mut **c]),
                [a, b, c, d] => solve_together(self, factor, [&mut **a, &mut **b, &mut **c, &mut **d]),
                _ => {}
            }
        }
    }
}

fn solve_together<T: Real + Root, const R: usize>(
    plan: &Elimination,
    factor: &LaneFactor<T>,
    all: [&mut [Lane<T>]; R],
) {
    Arch::new().dispatch(Substitution { plan, factor, all });
}

/// Forward and back substitution.
struct Substitution<'a, 'b, T, const R: usize> {
    plan: &'a Elimination,
    factor: &'a LaneFactor<T>,
    all: [&'b mut [Lane<T>]; R],
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
        let Self { plan, factor, mut all } = self;
        let zero = [Lane::default(); R];
        let columns = plan.supernodes.iter().map(|node| node.columns as usize).max().unwrap_or(0);
        let rows = plan.supernodes.iter().map(|node| node.below.len()).max().unwrap_or(0);
        let (mut own, mut below) = (vec![zero; columns], vec![zero; rows]);
        for node in &plan.supernodes {
            let own = &mut own[..node.columns as usize];
            let (square, panel) = factor.parts(node);
            gather(&all, node, own);
            forward::<T, R, FUSED>(square, own);
            scatter(&mut all, node, own);
            subtract_rows::<T, R, FUSED>(panel, own, &node.below, &mut all);
        }
        for node in plan.supernodes.iter().rev() {
            let (own, below) = (&mut own[..node.columns as usize], &mut below[..node.below.len()]);
            let (square, panel) = factor.parts(node);
            gather(&all, node, own);
            for (values, row) in below.iter_mut().zip(&node.below) {
                for s in 0..R {
                    values[s] = all[s][*row as usize];
                }
            }
            subtract_columns::<T, R, FUSED>(panel, below, own);
            backward(square, own);
            scatter(&mut all, node, own);
        }
    }
}

impl<T> LaneFactor<T> {
    /// The columns of a supernode: their square on the diagonal, and what is below.
    #[inline(always)]
    fn parts(&self, node: &Supernode) -> (&[Lane<T>], &[Lane<T>]) {
        let columns = node.columns as usize;
        let panel = &self.values[node.offset..][..columns * (columns + node.below.len())];
        panel.split_at(columns * columns)
    }
}

#[inline(always)]
fn gather<T: Real, const R: usize>(all: &[&mut [Lane<T>]; R], node: &Supernode, own: &mut [Abreast<T, R>]) {
    let first = node.first as usize;
    for s in 0..R {
        for (own, x) in own.iter_mut().zip(&all[s][first..]) {
            own[s] = *x;
        }
    }
}

#[inline(always)]
fn scatter<T: Real, const R: usize>(all: &mut [&mut [Lane<T>]; R], node: &Supernode, own: &[Abreast<T, R>]) {
    let first = node.first as usize;
    for s in 0..R {
        for (own, x) in own.iter().zip(&mut all[s][first..]) {
            *x = own[s];
        }
    }
}

/// Solves with a lower triangle, row by row, whose diagonal holds inverses.
#[inline(always)]
fn forward<T: Real, const R: usize, const FUSED: bool>(square: &[Lane<T>], own: &mut [Abreast<T, R>]) {
    let columns = own.len();
    for c in 0..columns {
        let line = &square[c * columns..][..=c];
        let mut sum = [Lane::default(); R];
        for (l, x) in line[..c].iter().zip(own.iter()) {
            for s in 0..R {
                sum[s] = sum[s].plus_product::<FUSED>(*l, x[s]);
            }
        }
        for s in 0..R {
            own[c][s] = own[c][s].minus(sum[s]).times(line[c]);
        }
    }
}

/// Solves with the transposed triangle.
#[inline(always)]
fn backward<T: Real, const R: usize>(square: &[Lane<T>], own: &mut [Abreast<T, R>]) {
    let columns = own.len();
    for c in (0..columns).rev() {
        let line = &square[c * columns..][..=c];
        let (before, rest) = own.split_at_mut(c);
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

/// Rows or columns that are summed up at the same time.
const AT_ONCE: usize = 4;

/// Takes the products of the rows of a panel with `own` off the unknowns `below`.
#[inline(always)]
fn subtract_rows<T: Real, const R: usize, const FUSED: bool>(
    panel: &[Lane<T>],
    own: &[Abreast<T, R>],
    below: &[u32],
    all: &mut [&mut [Lane<T>]; R],
) {
    let columns = own.len();
    let whole = below.len() / AT_ONCE * AT_ONCE;
    for first in (0..whole).step_by(AT_ONCE) {
        let lines = &panel[first * columns..][..AT_ONCE * columns];
        let (ab, cd) = lines.split_at(2 * columns);
        let ((a, b), (c, d)) = (ab.split_at(columns), cd.split_at(columns));
        let mut sum = [[Lane::default(); R]; AT_ONCE];
        for ((((a, b), c), d), x) in a.iter().zip(b).zip(c).zip(d).zip(own) {
            for s in 0..R {
                sum[0][s] = sum[0][s].plus_product::<FUSED>(*a, x[s]);
                sum[1][s] = sum[1][s].plus_product::<FUSED>(*b, x[s]);
                sum[2][s] = sum[2][s].plus_product::<FUSED>(*c, x[s]);
                sum[3][s] = sum[3][s].plus_product::<FUSED>(*d, x[s]);
            }
        }
        for i in 0..AT_ONCE {
            for s in 0..R {
                let entry = &mut all[s][below[first + i] as usize];
                *entry = entry.minus(sum[i][s]);
            }
        }
    }
    for row in whole..below.len() {
        let mut sum = [Lane::default(); R];
        for (l, x) in panel[row * columns..][..columns].iter().zip(own) {
            for s in 0..R {
                sum[s] = sum[s].plus_product::<FUSED>(*l, x[s]);
            }
        }
        for s in 0..R {
            let entry = &mut all[s][below[row] as usize];
            *entry = entry.minus(sum[s]);
        }
    }
}

/// Takes the products of the columns of a panel with the values `below` off `own`.
#[inline(always)]
fn subtract_columns<T: Real, const R: usize, const FUSED: bool>(
    panel: &[Lane<T>],
    below: &[Abreast<T, R>],
    own: &mut [Abreast<T, R>],
) {
    let columns = own.len();
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
                own[first + i][s] = own[first + i][s].minus(sum[i][s]);
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
            own[c][s] = own[c][s].minus(sum[s]);
        }
    }
}
