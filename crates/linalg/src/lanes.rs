//! Cholesky factors of several sparse matrices on one pattern, side by side in vector registers.
//!
//! The modes of a line give one matrix each, all sums K + lambda M on the same mesh. The elimination is
//! planned once ([`Elimination`]); then [`LANES`] matrices are factorised and solved with at a time. Each
//! entry is a [`Lane`], one number per matrix: every index is read once for all matrices, and every operation
//! is one on whole vectors.
//!
//! The method is the multifrontal one (Duff and Reid, ACM Trans. Math. Softw. 9, 1983): unknowns that are
//! eliminated together share a dense front, and the remainder of the front is added to that of the next
//! unknown to be eliminated.

mod front;
mod substitution;

pub use substitution::ABREAST;

use crate::gemm::Real;
use front::Front;
use pulp::Arch;

/// The number of matrices that are factorised at the same time. Tuned:
/// `cargo run --release -p elastocap-electrostatics --example extruded_tables`.
pub const LANES: usize = 16;

/// One number for each of the matrices.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(align(64))]
pub struct Lane<T>(pub [T; LANES]);

/// Runs `work` with the widest vectors of the machine. It is compiled for each vector width, so that all
/// functions it calls must be inlined.
pub fn vectorized<R>(work: impl FnOnce() -> R) -> R {
    Arch::new().dispatch(work)
}

impl<T: Real> Default for Lane<T> {
    fn default() -> Self {
        Self([T::default(); LANES])
    }
}

impl<T: Real> Lane<T> {
    /// A lane with the number `x` for all matrices.
    #[inline(always)]
    pub fn splat(x: T) -> Self {
        Self([x; LANES])
    }

    /// The values of `f`, lane by lane.
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

    /// The sum of this and a product, lane by lane. `FUSED` says that the processor has an instruction for
    /// it, which rounds once; where it has none, one is emulated at a hundred times the cost.
    #[inline(always)]
    #[must_use]
    fn plus_product<const FUSED: bool>(self, a: Self, b: Self) -> Self {
        if !FUSED {
            return self.plus(a.times(b));
        }
        let mut out = self.0;
        for k in 0..LANES {
            out[k] = a.0[k].multiply_add(b.0[k], self.0[k]);
        }
        Self(out)
    }
}

/// Unknowns that are eliminated together.
#[derive(Debug)]
struct Supernode {
    /// The first of these unknowns, which are consecutive.
    first: u32,
    /// The number of these unknowns.
    columns: u32,
    /// The other unknowns of the front, ascending.
    below: Vec<u32>,
    /// The supernode whose front takes the remainder of this one, and the places of the unknowns `below` in
    /// that front.
    parent: Option<(u32, Vec<u32>)>,
    /// Supernodes of which this one is the parent.
    children: Vec<u32>,
    /// Groups whose matrices are added to this front, each with the places of its blocks in the front.
    groups: Vec<(u32, Vec<Option<u32>>)>,
    /// The index at which the columns of this supernode begin in the factor.
    offset: usize,
}

/// The plan by which the unknowns of a sparse symmetric matrix are eliminated.
#[derive(Debug)]
pub struct Elimination {
    /// In the order in which they are eliminated.
    supernodes: Vec<Supernode>,
    /// The order of the matrices.
    unknowns: usize,
    /// The number of entries of one factor.
    entries: usize,
}

/// The largest share of zeros among the stored entries of a supernode of more than twelve unknowns that is
/// joined from smaller ones. Tuned:
/// `cargo run --release -p elastocap-electrostatics --example extruded_tables`.
const FILL: f64 = 0.25;

impl Elimination {
    /// Plans the elimination of blocks of unknowns, in their order. `sizes` has the number of unknowns of
    /// each block, which are numbered block by block; `groups` are blocks that a dense matrix couples, with
    /// `None` for values that are not unknowns.
    ///
    /// # Panics
    /// If a group names a block that does not exist.
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
            // Only one half of the square on the diagonal is needed.
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
        // The front to which the remainder of each front is added.
        for range in starts.windows(2).filter(|w| w[0] < w[1]) {
            let last = range[1] - 1;
            let Some(&next) = structure[last].first() else { continue };
            let (node, parent) = (of_block[last] as usize, of_block[next as usize]);
            let target = &supernodes[parent as usize];
            let places = supernodes[node].below.iter().map(|row| target.place(*row)).collect();
            supernodes[node].parent = Some((parent, places));
            supernodes[parent as usize].children.push(node as u32);
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

    /// Number of entries of one factor.
    pub fn entries(&self) -> usize {
        self.entries
    }

    /// Operations, multiplications and additions, of one factorisation.
    pub fn operations(&self) -> f64 {
        let operations = |s: &Supernode| {
            let (c, r) = (f64::from(s.columns), s.below.len() as f64);
            c * c * c / 3.0 + c * c * r + c * r * r
        };
        self.supernodes.iter().map(operations).sum()
    }

    /// Factorises [`LANES`] matrices, each the sum of the dense matrices of all groups. `sizes(group)` is the
    /// number of unknowns of each block of a group. `element(group, matrix)` appends the matrices of a group
    /// row by row, its blocks one after the other; a block that is `None` has no rows or columns.
    ///
    /// `None` if a matrix is not positive definite.
    pub fn factorise<T: Real + Root>(
        &self,
        sizes: impl Fn(u32) -> Vec<usize>,
        mut element: impl FnMut(u32, &mut Vec<Lane<f64>>),
    ) -> Option<LaneFactor<T>> {
        let mut factor = vec![Lane::<T>::default(); self.entries];
        // The remainder of each front, until it is added to the front of the parent.
        let mut remainders: Vec<Vec<Lane<T>>> = vec![Vec::new(); self.supernodes.len()];
        // Memory of remainders that have been added to other fronts, for the next remainders.
        let mut spare: Vec<Vec<Lane<T>>> = Vec::new();
        let mut front: Vec<Lane<T>> = Vec::new();
        let mut matrix = Vec::new();
        for (number, node) in self.supernodes.iter().enumerate() {
            let (columns, rows) = (node.columns as usize, node.columns as usize + node.below.len());
            front.clear();
            front.resize(rows * rows, Lane::default());
            for (group, places) in &node.groups {
                matrix.clear();
                element(*group, &mut matrix);
                let block_sizes = sizes(*group);
                let places: Vec<usize> = places
                    .iter()
                    .zip(&block_sizes)
                    .flat_map(|(place, size)| {
                        place.map(|p| p as usize..p as usize + size).into_iter().flatten()
                    })
                    .collect();
                vectorized(|| add_element(&matrix, &places, &mut front, rows));
            }
            for &child in &node.children {
                let rest = std::mem::take(&mut remainders[child as usize]);
                let Some((_, places)) = &self.supernodes[child as usize].parent else { continue };
                vectorized(|| add_rest(&rest, places, &mut front, rows));
                spare.push(rest);
            }
            let panel = &mut factor[node.offset..][..columns * rows];
            let mut rest = spare.pop().unwrap_or_default();
            rest.clear();
            if !Arch::new().dispatch(Front { entries: &front, rows, columns, panel, rest: &mut rest }) {
                return None;
            }
            remainders[number] = rest;
        }
        Some(LaneFactor { values: factor })
    }
}

/// Adds a matrix, row by row, to the places of its unknowns in the lower triangle of a front.
#[inline(always)]
fn add_element<T: Real>(matrix: &[Lane<f64>], places: &[usize], front: &mut [Lane<T>], rows: usize) {
    for (&row, values) in places.iter().zip(matrix.chunks_exact(places.len().max(1))) {
        for (&column, value) in places.iter().zip(values) {
            if column <= row {
                let entry = &mut front[row * rows + column];
                for k in 0..LANES {
                    entry.0[k] += T::from_f64(value.0[k]);
                }
            }
        }
    }
}

/// Adds `rest`, the lower triangle that remains of another front, to a front at the places of the unknowns of
/// `rest`.
#[inline(always)]
fn add_rest<T: Real>(rest: &[Lane<T>], places: &[u32], front: &mut [Lane<T>], rows: usize) {
    let mut rest = rest;
    for (i, &row) in places.iter().enumerate() {
        let target = &mut front[row as usize * rows..][..rows];
        let (row_values, remainder) = rest.split_at(i + 1);
        for (&column, value) in places.iter().zip(row_values) {
            let entry = &mut target[column as usize];
            *entry = entry.plus(*value);
        }
        rest = remainder;
    }
}

impl Supernode {
    /// The row of an unknown in the front.
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
    let mut coupled: Vec<Vec<u32>> = vec![Vec::new(); n];
    for group in groups {
        if let Some(lowest) = group.iter().flatten().min() {
            coupled[*lowest as usize].extend(group.iter().flatten().filter(|b| *b != lowest));
        }
    }
    let mut children: Vec<Vec<u32>> = vec![Vec::new(); n];
    let mut mark = vec![u32::MAX; n];
    for b in 0..n {
        let mut blocks = std::mem::take(&mut coupled[b]);
        for &child in &children[b] {
            blocks.extend(coupled[child as usize].iter().filter(|c| **c as usize != b));
        }
        blocks.retain(|&c| std::mem::replace(&mut mark[c as usize], b as u32) != b as u32);
        blocks.sort_unstable();
        if let Some(&parent) = blocks.first() {
            children[parent as usize].push(b as u32);
        }
        coupled[b] = blocks;
    }
    coupled
}

/// The factors of [`LANES`] matrices; see [`Elimination::factorise`].
#[derive(Debug, Clone)]
pub struct LaneFactor<T> {
    /// The columns of each supernode, row by row, from the index `offset` of the supernode on.
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A grid of blocks of one to `largest` unknowns, coupled in squares, in an order that is anything but
    /// good.
    fn grid(n: usize, largest: usize) -> (Vec<usize>, Vec<Vec<Option<u32>>>) {
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
        ((0..n * n).map(|b| 1 + b % largest).collect(), groups)
    }

    fn check<T: Real + Root>(largest: usize, tolerance: f64) {
        let n = 9;
        let (sizes, groups) = grid(n, largest);
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
                        out.push(Lane(std::array::from_fn(|lane| value(g, lane, i, j))));
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
        // Up to one right-hand side more than are solved for together, each a multiple of the first.
        for sides in 1..=ABREAST + 1 {
            let multiple =
                |s: usize| right.iter().map(|r| Lane(r.map(|r| T::from_f64((s + 1) as f64 * r)))).collect();
            let mut solutions: Vec<Vec<Lane<T>>> = (0..sides).map(multiple).collect();
            plan.solve(&factor, &mut solutions.iter_mut().map(Vec::as_mut_slice).collect::<Vec<_>>());
            for (s, x) in solutions.iter().enumerate() {
                for (i, x) in x.iter().enumerate() {
                    for lane in 0..LANES {
                        let error = x.0[lane].to_f64() / (s + 1) as f64 - exact(lane, i);
                        assert!(error.abs() < tolerance, "{sides} {s} {i} {lane}: {error:e}");
                    }
                }
            }
        }
    }

    #[test]
    fn matrices_of_one_pattern_are_solved_side_by_side_in_either_precision() {
        // Fronts of all sizes modulo those of the blocks in registers.
        for largest in [1, 2, 3, 5] {
            check::<f64>(largest, 1e-13);
            check::<f32>(largest, 1e-5);
        }
    }

    #[test]
    fn a_matrix_that_is_not_positive_definite_has_no_factor() {
        let plan = Elimination::new(&[1, 1], &[vec![Some(0), Some(1)]]);
        let factor =
            plan.factorise::<f64>(|_| vec![1, 1], |_, out| out.extend([1.0, 2.0, 2.0, 1.0].map(Lane::splat)));
        assert!(factor.is_none());
    }
}
