//! Cholesky factors of several sparse matrices on one pattern, side by side in vector registers.
//!
//! The modes of a line give one matrix each, all sums K + lambda M on the same mesh. The elimination is planned once
//! ([`Elimination`]); then [`LANES`] matrices are factorised and solved with at a time, every number being a row of as many as there
//! are matrices ([`Lane`]). No index is read more than once for all of them, and every operation is one on a whole vector.
//!
//! The method is the multifrontal one (Duff and Reid, ACM Trans. Math. Softw. 9, 1983): unknowns that are eliminated together share a
//! dense front, and what is left of it is added to that of the next unknown to go.

use crate::gemm::Real;
use pulp::{Arch, WithSimd};

/// Matrices that are treated at the same time.
pub const LANES: usize = 8;

/// One number for each of the matrices.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(align(32))]
pub struct Lane<T>(pub [T; LANES]);

/// Does some work on lanes with the widest vectors of the machine: `work` is compiled for each kind, so that what it calls must be
/// inlined into it.
pub fn vectorized<R>(work: impl FnOnce() -> R) -> R {
    Arch::new().dispatch(work)
}

impl<T: Real> Default for Lane<T> {
    fn default() -> Self {
        Self([T::default(); LANES])
    }
}

impl<T: Real> Lane<T> {
    /// The same number for all.
    #[inline(always)]
    pub fn splat(x: T) -> Self {
        Self([x; LANES])
    }

    #[inline(always)]
    fn map2(self, other: Self, f: impl Fn(T, T) -> T) -> Self {
        let mut out = self.0;
        for k in 0..LANES {
            out[k] = f(self.0[k], other.0[k]);
        }
        Self(out)
    }

    /// The product, lane by lane.
    #[inline(always)]
    #[must_use]
    pub fn times(self, other: Self) -> Self {
        self.map2(other, |a, b| a * b)
    }

    /// The sum, lane by lane.
    #[inline(always)]
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        self.map2(other, |a, b| a + b)
    }

    /// The difference, lane by lane.
    #[inline(always)]
    #[must_use]
    pub fn minus(self, other: Self) -> Self {
        self.map2(other, |a, b| a - b)
    }
}

/// Unknowns that are eliminated together.
#[derive(Debug)]
struct Supernode {
    /// The first of them; they are consecutive.
    first: u32,
    columns: u32,
    /// The other unknowns of the front, ascending.
    below: Vec<u32>,
    /// The supernode that what is left of the front is added to, and where its unknowns are in that front.
    parent: Option<(u32, Vec<u32>)>,
    /// Supernodes of which this one is the parent.
    children: Vec<u32>,
    /// Groups that are added here, each with the places of its unknowns in the front.
    groups: Vec<(u32, Vec<Option<u32>>)>,
    /// Where its columns of the factor begin.
    offset: usize,
}

/// The plan by which the unknowns of a sparse symmetric matrix are eliminated.
#[derive(Debug)]
pub struct Elimination {
    supernodes: Vec<Supernode>,
    unknowns: usize,
    entries: usize,
}

/// Zeros that may be stored for larger supernodes, as a share of the entries.
const FILL: f64 = 0.25;

impl Elimination {
    /// Plans the elimination of blocks of unknowns, in their order. `sizes` has the number of unknowns of each block, which are
    /// numbered block by block; `groups` are blocks that a dense matrix couples, `None` for what is no unknown.
    ///
    /// # Panics
    /// If a group names a block that there is not.
    pub fn new(sizes: &[usize], groups: &[Vec<Option<u32>>]) -> Self {
        let n = sizes.len();
        let mut first = vec![0_u32; n + 1];
        for (b, size) in sizes.iter().enumerate() {
            first[b + 1] = first[b] + *size as u32;
        }
        let structure = structures(n, groups);
        // Blocks joined to supernodes: each ends where joining the next block would store too many zeros.
        let height = |b: usize| structure[b].iter().map(|&c| sizes[c as usize]).sum::<usize>();
        let mut starts = vec![0];
        let (mut columns, mut exact) = (0, 0);
        for b in 0..n {
            let rows = height(b);
            columns += sizes[b];
            exact += sizes[b] * (sizes[b] + rows);
            if b + 1 == n {
                break;
            }
            let joins = structure[b].first() == Some(&(b as u32 + 1));
            let joined = columns + sizes[b + 1];
            let stored = joined * (joined + height(b + 1));
            let needed = exact + sizes[b + 1] * (sizes[b + 1] + height(b + 1));
            // Only half of the square on the diagonal is needed of either.
            let zeros = stored.saturating_sub(needed) as f64 - 0.5 * (joined * joined) as f64;
            if !joins || (zeros > FILL * stored as f64 && joined > 12) {
                starts.push(b + 1);
                (columns, exact) = (0, 0);
            }
        }
        starts.push(n);
        let mut of_block = vec![0_u32; n];
        let mut supernodes: Vec<Supernode> = Vec::new();
        let mut entries = 0;
        for range in starts.windows(2).filter(|w| w[0] < w[1]) {
            let last = range[1] - 1;
            of_block[range[0]..range[1]].fill(supernodes.len() as u32);
            let below: Vec<u32> =
                structure[last].iter().flat_map(|&c| first[c as usize]..first[c as usize + 1]).collect();
            let columns = first[range[1]] - first[range[0]];
            supernodes.push(Supernode {
                first: first[range[0]],
                columns,
                offset: entries,
                below,
                parent: None,
                children: Vec::new(),
                groups: Vec::new(),
            });
            entries += columns as usize * (columns as usize + supernodes[supernodes.len() - 1].below.len());
        }
        // Where what is left of each front goes.
        for range in starts.windows(2).filter(|w| w[0] < w[1]) {
            let last = range[1] - 1;
            let Some(&next) = structure[last].first() else { continue };
            let (own, parent) = (of_block[last] as usize, of_block[next as usize]);
            let target = &supernodes[parent as usize];
            let places = supernodes[own].below.iter().map(|row| target.place(*row)).collect();
            supernodes[own].parent = Some((parent, places));
            supernodes[parent as usize].children.push(own as u32);
        }
        for (g, group) in groups.iter().enumerate() {
            let Some(lowest) = group.iter().flatten().min() else { continue };
            let target = &mut supernodes[of_block[*lowest as usize] as usize];
            let places = group.iter().map(|block| block.map(|b| target.place(first[b as usize]))).collect();
            target.groups.push((g as u32, places));
        }
        Self { supernodes, unknowns: first[n] as usize, entries }
    }

    /// Order of the matrices.
    pub fn unknowns(&self) -> usize {
        self.unknowns
    }

    /// Entries of one factor.
    pub fn entries(&self) -> usize {
        self.entries
    }

    /// Operations, multiplications and additions, of one factorisation.
    pub fn operations(&self) -> f64 {
        let of = |s: &Supernode| {
            let (c, r) = (f64::from(s.columns), s.below.len() as f64);
            c * c * c / 3.0 + c * c * r + c * r * r
        };
        self.supernodes.iter().map(of).sum()
    }

    /// Factorises [`LANES`] matrices, each the sum of the dense ones of all groups. `element(group, matrix)` writes those of one
    /// group: row by row, where row and column of a block begin at `starts[block]` and blocks that are `None` have neither.
    ///
    /// `None` if a matrix is not positive definite.
    pub fn factorise<T: Real + Root>(
        &self,
        sizes: impl Fn(u32) -> Vec<usize>,
        mut element: impl FnMut(u32, &mut Vec<Lane<f64>>),
    ) -> Option<LaneFactor<T>> {
        let mut factor = vec![Lane::<T>::default(); self.entries];
        let mut left: Vec<Vec<Lane<T>>> = vec![Vec::new(); self.supernodes.len()];
        let mut front: Vec<Lane<T>> = Vec::new();
        let mut matrix = Vec::new();
        for (number, node) in self.supernodes.iter().enumerate() {
            let (columns, rows) = (node.columns as usize, node.columns as usize + node.below.len());
            front.clear();
            front.resize(rows * rows, Lane::default());
            for (group, places) in &node.groups {
                matrix.clear();
                element(*group, &mut matrix);
                let own = sizes(*group);
                let places: Vec<usize> = places
                    .iter()
                    .zip(&own)
                    .flat_map(|(at, size)| at.map(|at| at as usize..at as usize + size).into_iter().flatten())
                    .collect();
                let n = places.len();
                for (i, &row) in places.iter().enumerate() {
                    for (j, &column) in places.iter().enumerate() {
                        if column <= row {
                            let value = matrix[i * n + j];
                            let entry = &mut front[row * rows + column];
                            for k in 0..LANES {
                                entry.0[k] += T::from_f64(value.0[k]);
                            }
                        }
                    }
                }
            }
            for &child in &node.children {
                let rest = std::mem::take(&mut left[child as usize]);
                let Some((_, places)) = &self.supernodes[child as usize].parent else { continue };
                let mut at = 0;
                for (i, &row) in places.iter().enumerate() {
                    let target = &mut front[row as usize * rows..][..rows];
                    for &column in &places[..=i] {
                        let entry = &mut target[column as usize];
                        *entry = entry.plus(rest[at]);
                        at += 1;
                    }
                }
            }
            let panel = &mut factor[node.offset..][..columns * rows];
            let mut rest = Vec::new();
            let eliminate = Eliminate { front: &mut front, rows, columns, panel, rest: &mut rest };
            if !Arch::new().dispatch(eliminate) {
                return None;
            }
            left[number] = rest;
        }
        Some(LaneFactor { values: factor })
    }

    /// Overwrites each of several `x`, one row of lanes for each unknown, with the solutions. The factor, which is read from memory, is
    /// read once for all of them.
    pub fn solve<T: Real + Root>(&self, factor: &LaneFactor<T>, x: &mut [&mut [Lane<T>]]) {
        Arch::new().dispatch(Substitute { plan: self, factor, all: x });
    }
}

impl Supernode {
    /// Where an unknown is in the front.
    fn place(&self, unknown: u32) -> u32 {
        if unknown < self.first + self.columns {
            unknown - self.first
        } else {
            self.columns + self.below.partition_point(|&r| r < unknown) as u32
        }
    }
}

/// For each block the later blocks that its elimination couples it to, ascending.
fn structures(n: usize, groups: &[Vec<Option<u32>>]) -> Vec<Vec<u32>> {
    let mut own: Vec<Vec<u32>> = vec![Vec::new(); n];
    for group in groups {
        if let Some(lowest) = group.iter().flatten().min() {
            own[*lowest as usize].extend(group.iter().flatten().filter(|b| *b != lowest));
        }
    }
    let mut children: Vec<Vec<u32>> = vec![Vec::new(); n];
    let mut mark = vec![u32::MAX; n];
    for b in 0..n {
        let mut all = std::mem::take(&mut own[b]);
        for &child in &children[b] {
            all.extend(own[child as usize].iter().filter(|c| **c as usize != b));
        }
        all.retain(|&c| std::mem::replace(&mut mark[c as usize], b as u32) != b as u32);
        all.sort_unstable();
        if let Some(&parent) = all.first() {
            children[parent as usize].push(b as u32);
        }
        own[b] = all;
    }
    own
}

/// The factors of [`LANES`] matrices; see [`Elimination::factorise`].
#[derive(Debug, Clone)]
pub struct LaneFactor<T> {
    values: Vec<Lane<T>>,
}

/// Numbers with a square root.
pub trait Root {
    /// The square root; not finite or not positive where there is none.
    #[must_use]
    fn root(self) -> Self;
    /// Whether it is finite and positive.
    fn is_positive(&self) -> bool;
}

impl Root for f32 {
    #[inline(always)]
    fn root(self) -> Self {
        self.sqrt()
    }
    #[inline(always)]
    fn is_positive(&self) -> bool {
        *self > 0.0 && self.is_finite()
    }
}

impl Root for f64 {
    #[inline(always)]
    fn root(self) -> Self {
        self.sqrt()
    }
    #[inline(always)]
    fn is_positive(&self) -> bool {
        *self > 0.0 && self.is_finite()
    }
}

#[inline(always)]
fn dot<T: Real>(a: &[Lane<T>], b: &[Lane<T>]) -> Lane<T> {
    let mut sum = Lane::default();
    for (a, b) in a.iter().zip(b) {
        sum = sum.plus(a.times(*b));
    }
    sum
}

/// The first columns of a front are eliminated: they go to the panel, what is left of the lower triangle to the rest.
struct Eliminate<'a, T> {
    front: &'a mut [Lane<T>],
    rows: usize,
    columns: usize,
    panel: &'a mut [Lane<T>],
    rest: &'a mut Vec<Lane<T>>,
}

impl<T: Real + Root> WithSimd for Eliminate<'_, T> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> bool {
        let Self { front, rows, columns, panel, rest } = self;
        for i in 0..rows {
            let (done, own) = panel.split_at_mut(i * columns);
            let own = &mut own[..columns];
            own.copy_from_slice(&front[i * rows..][..columns]);
            for j in 0..columns.min(i) {
                let above = &done[j * columns..][..=j];
                // The diagonal holds the inverse.
                own[j] = own[j].minus(dot(&own[..j], &above[..j])).times(above[j]);
            }
            if i < columns {
                let pivot = own[i].minus(dot(&own[..i], &own[..i]));
                for k in 0..LANES {
                    if !pivot.0[k].is_positive() {
                        return false;
                    }
                    own[i].0[k] = T::from_f64(1.0) / pivot.0[k].root();
                }
                own[i + 1..].fill(Lane::default());
            }
        }
        let below = rows - columns;
        rest.resize(below * (below + 1) / 2, Lane::default());
        let line = |i: usize| &panel[(columns + i) * columns..][..columns];
        let start = |i: usize| i * (i + 1) / 2;
        let mut i = 0;
        while i < below {
            // Two rows and two columns at a time: each number that is read serves twice.
            let pair = i + 1 < below;
            let (a, b) = (line(i), line(if pair { i + 1 } else { i }));
            let mut j = 0;
            while j <= i {
                let two = j < i + usize::from(pair);
                let (c, d) = (line(j), line(if two { j + 1 } else { j }));
                let mut sum = [Lane::default(); 4];
                for k in 0..columns {
                    let (a, b, c, d) = (a[k], b[k], c[k], d[k]);
                    sum[0] = sum[0].plus(a.times(c));
                    sum[1] = sum[1].plus(a.times(d));
                    sum[2] = sum[2].plus(b.times(c));
                    sum[3] = sum[3].plus(b.times(d));
                }
                let old = |i: usize, j: usize| front[(columns + i) * rows + columns + j];
                rest[start(i) + j] = old(i, j).minus(sum[0]);
                if j < i {
                    rest[start(i) + j + 1] = old(i, j + 1).minus(sum[1]);
                }
                if pair {
                    rest[start(i + 1) + j] = old(i + 1, j).minus(sum[2]);
                    rest[start(i + 1) + j + 1] = old(i + 1, j + 1).minus(sum[3]);
                }
                j += 2;
            }
            i += 2;
        }
        true
    }
}

/// Forward and back substitution.
struct Substitute<'a, 'b, T> {
    plan: &'a Elimination,
    factor: &'a LaneFactor<T>,
    all: &'a mut [&'b mut [Lane<T>]],
}

impl<T: Real + Root> WithSimd for Substitute<'_, '_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let Self { plan, factor, all } = self;
        let panel = |node: &Supernode| {
            let columns = node.columns as usize;
            (columns, &factor.values[node.offset..][..columns * (columns + node.below.len())])
        };
        for node in &plan.supernodes {
            let (columns, panel) = panel(node);
            let base = node.first as usize + columns;
            for x in all.iter_mut() {
                let (before, after) = x.split_at_mut(base);
                let own = &mut before[node.first as usize..];
                for c in 0..columns {
                    let line = &panel[c * columns..][..=c];
                    own[c] = own[c].minus(dot(&line[..c], &own[..c])).times(line[c]);
                }
                for (line, row) in panel[columns * columns..].chunks_exact(columns).zip(&node.below) {
                    let entry = &mut after[*row as usize - base];
                    *entry = entry.minus(dot(line, own));
                }
            }
        }
        for node in plan.supernodes.iter().rev() {
            let (columns, panel) = panel(node);
            let base = node.first as usize + columns;
            for x in all.iter_mut() {
                let (before, after) = x.split_at_mut(base);
                let own = &mut before[node.first as usize..];
                for (line, row) in panel[columns * columns..].chunks_exact(columns).zip(&node.below) {
                    let value = after[*row as usize - base];
                    for (own, l) in own.iter_mut().zip(line) {
                        *own = own.minus(l.times(value));
                    }
                }
                for c in (0..columns).rev() {
                    let line = &panel[c * columns..][..=c];
                    own[c] = own[c].times(line[c]);
                    let value = own[c];
                    for k in 0..c {
                        own[k] = own[k].minus(line[k].times(value));
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A grid of blocks of one or two unknowns, coupled in squares, in an order that is anything but good.
    fn grid(n: usize) -> (Vec<usize>, Vec<Vec<Option<u32>>>) {
        let number = |i: usize, j: usize| ((i * n + j) * 7 % (n * n)) as u32;
        let mut groups = Vec::new();
        for i in 0..n - 1 {
            for j in 0..n - 1 {
                let mut group: Vec<Option<u32>> =
                    [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(a, b)| Some(number(i + a, j + b))).to_vec();
                if (i + j) % 5 == 0 {
                    group.push(None);
                }
                groups.push(group);
            }
        }
        ((0..n * n).map(|b| 1 + b % 2).collect(), groups)
    }

    fn check<T: Real + Root>(tolerance: f64) {
        let n = 9;
        let (sizes, groups) = grid(n);
        let plan = Elimination::new(&sizes, &groups);
        let unknowns: usize = sizes.iter().sum();
        assert_eq!(plan.unknowns(), unknowns);
        let group_sizes = |g: u32| -> Vec<usize> {
            groups[g as usize].iter().map(|b| b.map_or(0, |b| sizes[b as usize])).collect()
        };
        let order = |g: u32| group_sizes(g).iter().sum::<usize>();
        let value = |g: u32, lane: usize, i: usize, j: usize| {
            let diagonal = if i == j { order(g) as f64 + lane as f64 } else { 0.0 };
            diagonal + ((g as usize + i + j + i * j + lane) as f64).cos()
        };
        let factor = plan
            .factorise::<T>(group_sizes, |g, out| {
                let m = order(g);
                for i in 0..m {
                    for j in 0..m {
                        out.push(Lane([0, 1, 2, 3, 4, 5, 6, 7].map(|lane| value(g, lane, i, j))));
                    }
                }
            })
            .unwrap();
        let exact = |lane: usize, i: usize| ((i + 3 * lane) as f64 * 0.3).sin();
        let mut right = vec![[0.0; LANES]; unknowns];
        let starts: Vec<usize> = sizes.iter().scan(0, |at, s| Some(std::mem::replace(at, *at + s))).collect();
        for (g, group) in groups.iter().enumerate() {
            let places: Vec<usize> = group
                .iter()
                .flatten()
                .flat_map(|&b| starts[b as usize]..starts[b as usize] + sizes[b as usize])
                .collect();
            for (i, &row) in places.iter().enumerate() {
                for (j, &column) in places.iter().enumerate() {
                    for lane in 0..LANES {
                        right[row][lane] += value(g as u32, lane, i, j) * exact(lane, column);
                    }
                }
            }
        }
        let mut x: Vec<Lane<T>> = right.iter().map(|r| Lane(r.map(T::from_f64))).collect();
        let mut twice: Vec<Lane<T>> = right.iter().map(|r| Lane(r.map(|r| T::from_f64(2.0 * r)))).collect();
        plan.solve(&factor, &mut [&mut x, &mut twice]);
        for (i, (x, twice)) in x.iter().zip(&twice).enumerate() {
            for lane in 0..LANES {
                assert!((x.0[lane].to_f64() - exact(lane, i)).abs() < tolerance, "{i} {lane}");
                assert!(
                    (twice.0[lane].to_f64() - 2.0 * exact(lane, i)).abs() < 2.0 * tolerance,
                    "{i} {lane}"
                );
            }
        }
    }

    #[test]
    fn eight_matrices_of_one_pattern_are_solved_in_either_precision() {
        check::<f64>(1e-13);
        check::<f32>(1e-5);
    }

    #[test]
    fn a_matrix_that_is_not_positive_definite_has_no_factor() {
        let plan = Elimination::new(&[1, 1], &[vec![Some(0), Some(1)]]);
        let factor =
            plan.factorise::<f64>(|_| vec![1, 1], |_, out| out.extend([1.0, 2.0, 2.0, 1.0].map(Lane::splat)));
        assert!(factor.is_none());
    }
}
