//! Sparse symmetric systems that are factorised and solved again and again on one pattern, by faer.
//!
//! nalgebra-sparse holds pattern and values, faer's supernodal LDL^T factorises them. The products in a
//! factor are cut into parts by its size and not by the number of threads, so that results are the same bytes
//! at any number of threads.

use std::num::NonZeroU32;

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::cholesky::ldlt::factor::LdltRegularization;
use faer::perm::PermRef;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LdltRef, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky, supernodal::SupernodalLdltRef,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side};
use nalgebra_sparse::CscMatrix;
use nalgebra_sparse::pattern::SparsityPattern;

/// Why a linear system has no usable solution.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum LdltError {
    /// A group couples an unknown that does not exist.
    #[error("unknown {unknown} is coupled in a system of {unknowns} unknowns")]
    NoSuchUnknown {
        /// The number in the group.
        unknown: u32,
        /// Order of the matrix.
        unknowns: usize,
    },
    /// The matrix or its factor has more entries than memory or 32-bit numbers can count.
    #[error("the matrix has too many entries for this machine")]
    TooLarge,
    /// A pivot is zero or not finite.
    #[error("the matrix is singular")]
    Singular,
}

/// The index of an entry of the lower triangle among the values of a [`SymmetricSolver`].
///
/// `Option<Place>` takes four bytes: the assembly of a matrix reads one per entry of every element matrix.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Place(NonZeroU32);

impl Place {
    /// The place of entry `index`; `None` beyond 32 bits.
    fn new(index: usize) -> Option<Self> {
        u32::try_from(index + 1).ok().and_then(NonZeroU32::new).map(Self)
    }

    /// The index among the values.
    #[inline]
    fn index(self) -> usize {
        self.0.get() as usize - 1
    }
}

/// The places of the entries of a dense block, row after row. Entries above the diagonal of the matrix have
/// none, nor have those of values that are not unknowns.
pub type BlockPlaces = Vec<Option<Place>>;

/// A symmetric matrix with a fixed pattern, its values, its factors, and the memory for them.
///
/// The unknowns have to be numbered so that the factors stay sparse, as by [`ordering`](crate::ordering): no
/// further reordering is done.
pub struct SymmetricSolver {
    /// The lower triangle, by columns.
    matrix: CscMatrix<f64>,
    /// The pattern of the factors and the order of the operations.
    symbolic: SymbolicCholesky<usize>,
    /// The values of the factors; empty until the first factorisation, so that their size is known before the
    /// memory is allocated.
    factors: Vec<f64>,
    /// The amount of working memory that a factorisation and a solve need.
    scratch: StackReq,
    /// The working memory, allocated together with `factors`.
    memory: MemBuffer,
}

impl std::fmt::Debug for SymmetricSolver {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "SymmetricSolver({} unknowns, {} in the factor)", self.unknowns(), self.factor_entries())
    }
}

/// The least number of operations for which two threads factorise faster than one. Tuned:
/// `cargo bench --bench mechanics`.
const WORTH_TWO_THREADS: f64 = 1e10;

/// The parallelism with which faer factorises. It depends only on a lower estimate of the number of
/// operations: the number for a factor whose columns are equally long.
fn parallelism(symbolic: &SymbolicCholesky<usize>) -> Par {
    let entries = symbolic.len_val() as f64;
    if entries * entries > WORTH_TWO_THREADS * symbolic.ncols() as f64 { Par::rayon(2) } else { Par::Seq }
}

impl SymmetricSolver {
    /// The solver for a matrix of order `unknowns` that couples all unknowns within each of `groups`, and for
    /// each group the places of its dense block, for [`SymmetricSolver::add`]. `None` in a group stands for a
    /// value that is not an unknown, say a prescribed displacement.
    ///
    /// The symbolic factorisation is done here, the memory for the factors is allocated by
    /// [`SymmetricSolver::factorise`].
    ///
    /// # Errors
    /// If a group has an unknown that is not below `unknowns`, or the matrix is too large; see [`LdltError`].
    pub fn new(unknowns: usize, groups: &[Vec<Option<u32>>]) -> Result<(Self, Vec<BlockPlaces>), LdltError> {
        let pattern = lower_triangle(unknowns, groups)?;
        if Place::new(pattern.nnz()).is_none() {
            return Err(LdltError::TooLarge);
        }
        let place = |column: Option<u32>, row: Option<u32>| {
            let (column, row) = (column? as usize, row? as usize);
            let in_column = pattern.lane(column).binary_search(&row).ok()?;
            Place::new(pattern.major_offsets()[column] + in_column)
        };
        let places =
            groups.iter().map(|g| g.iter().flat_map(|&r| g.iter().map(move |&c| place(c, r))).collect());
        let places = places.collect();
        let entries = pattern.nnz();
        let matrix = CscMatrix::try_from_pattern_and_values(pattern, vec![0.0; entries])
            .map_err(|_| LdltError::TooLarge)?;
        let identity: Vec<usize> = (0..unknowns).collect();
        let symbolic = factorize_symbolic_cholesky(
            symbolic(&matrix),
            Side::Lower,
            // Not `Identity`: faer 0.24 then reads a lower triangle as an upper one, and panics.
            SymmetricOrdering::Custom(PermRef::new_checked(&identity, &identity, unknowns)),
            CholeskySymbolicParams {
                supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
                ..Default::default()
            },
        )
        .map_err(|_| LdltError::TooLarge)?;
        let scratch = symbolic
            .factorize_numeric_ldlt_scratch::<f64>(parallelism(&symbolic), Default::default())
            .or(symbolic.solve_in_place_scratch::<f64>(1, Par::Seq));
        let memory = MemBuffer::new(StackReq::EMPTY);
        Ok((Self { matrix, symbolic, factors: Vec::new(), scratch, memory }, places))
    }

    /// Order of the matrix.
    pub fn unknowns(&self) -> usize {
        self.matrix.ncols()
    }

    /// Number of entries of the factor.
    pub fn factor_entries(&self) -> usize {
        self.symbolic.len_val()
    }

    /// Bytes of the matrix, the factor and the working memory, whether they are allocated yet or not.
    pub fn memory_bytes(&self) -> u64 {
        let of_matrix = 16 * self.matrix.nnz() + 8 * self.matrix.col_offsets().len();
        (of_matrix + 8 * self.factor_entries() + self.scratch.unaligned_bytes_required()) as u64
    }

    /// Frees the memory of the factors; the next factorisation allocates it again.
    pub fn release(&mut self) {
        self.factors = Vec::new();
        self.memory = MemBuffer::new(StackReq::EMPTY);
    }

    /// Sets every entry to zero.
    pub fn clear(&mut self) {
        self.matrix.values_mut().fill(0.0);
    }

    /// Adds `value` to an entry and, the matrix being symmetric, to its mirror image.
    #[inline]
    pub fn add(&mut self, place: Place, value: f64) {
        self.matrix.values_mut()[place.index()] += value;
    }

    /// Adds `value` to every entry of the diagonal.
    pub fn add_to_diagonal(&mut self, value: f64) {
        for c in 0..self.unknowns() {
            // The diagonal is the first entry of a column of the lower triangle. An unknown that is in no
            // group has no entry.
            if let (&[first, ..], &mut [ref mut entry, ..]) = self.matrix.col_mut(c).rows_and_values_mut()
                && first == c
            {
                *entry += value;
            }
        }
    }

    /// Factorises the matrix. Returns the number of negative pivots: zero if and only if the matrix is
    /// positive definite.
    ///
    /// # Errors
    /// [`LdltError::Singular`] if a pivot is zero or not finite.
    pub fn factorise(&mut self) -> Result<usize, LdltError> {
        if self.factors.is_empty() {
            self.factors = vec![0.0; self.factor_entries()];
            self.memory = MemBuffer::new(self.scratch);
        }
        self.symbolic
            .factorize_numeric_ldlt(
                &mut self.factors,
                SparseColMatRef::new(symbolic(&self.matrix), self.matrix.values()),
                Side::Lower,
                LdltRegularization::default(),
                parallelism(&self.symbolic),
                MemStack::new(&mut self.memory),
                Default::default(),
            )
            .map_err(|_| LdltError::Singular)?;
        let mut negative = 0;
        if let SymbolicCholeskyRaw::Supernodal(symbolic) = self.symbolic.raw() {
            let factors = SupernodalLdltRef::new(symbolic, &self.factors);
            for s in 0..symbolic.n_supernodes() {
                let block = factors.supernode(s).val();
                negative += (0..block.ncols()).filter(|&k| block[(k, k)] < 0.0).count();
            }
        }
        Ok(negative)
    }

    /// Solves with the last factors, in place, and refines the solution, at most four times, until the
    /// residual is small or stops falling. Returns the least residual met over the right-hand side, both in
    /// the maximum norm; not finite if there is no solution.
    ///
    /// `x` is the right-hand side, then the solution, and has as many entries as there are unknowns. Call
    /// [`SymmetricSolver::factorise`] first.
    pub fn solve(&mut self, x: &mut [f64]) -> f64 {
        let right: Vec<f64> = x.to_vec();
        let size = max_norm(&right);
        if size == 0.0 {
            return 0.0;
        }
        self.back_substitute(x);
        let mut best = f64::INFINITY;
        for _ in 0..4 {
            let mut residual = right.clone();
            self.subtract_product(x, &mut residual);
            let now = max_norm(&residual) / size;
            if now.is_nan() || now > 0.5 * best || now < 1e-15 {
                return best.min(if now.is_nan() { f64::INFINITY } else { now });
            }
            best = now;
            if now < 1e-13 {
                return now;
            }
            self.back_substitute(&mut residual);
            for (x, dx) in x.iter_mut().zip(&residual) {
                *x += dx;
            }
        }
        best
    }

    /// Overwrites a right-hand side with the solution by the last factors.
    fn back_substitute(&mut self, x: &mut [f64]) {
        let n = x.len();
        LdltRef::new(&self.symbolic, &self.factors).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(x, n, 1),
            Par::Seq,
            MemStack::new(&mut self.memory),
        );
    }

    /// `y -= A x`.
    fn subtract_product(&self, x: &[f64], y: &mut [f64]) {
        let (start, rows, values) = self.matrix.csc_data();
        for c in 0..self.unknowns() {
            let mut sum = 0.0;
            for k in start[c]..start[c + 1] {
                let (r, v) = (rows[k], values[k]);
                if r != c {
                    sum += v * x[r];
                }
                y[r] -= v * x[c];
            }
            y[c] -= sum;
        }
    }
}

/// The columns of the lower triangle of a matrix that couples all unknowns within each group.
fn lower_triangle(unknowns: usize, groups: &[Vec<Option<u32>>]) -> Result<SparsityPattern, LdltError> {
    let mut columns: Vec<Vec<u32>> = vec![Vec::new(); unknowns];
    for group in groups {
        for &c in group.iter().flatten() {
            let column =
                columns.get_mut(c as usize).ok_or(LdltError::NoSuchUnknown { unknown: c, unknowns })?;
            column.extend(group.iter().flatten().filter(|&&r| r >= c));
        }
    }
    let mut offsets = vec![0];
    let mut rows = Vec::new();
    for column in &mut columns {
        column.sort_unstable();
        column.dedup();
        rows.extend(column.iter().map(|&r| r as usize));
        offsets.push(rows.len());
    }
    SparsityPattern::try_from_offsets_and_indices(unknowns, unknowns, offsets, rows)
        .map_err(|_| LdltError::TooLarge)
}

/// The pattern of a matrix as faer reads it, without a copy.
fn symbolic(matrix: &CscMatrix<f64>) -> SymbolicSparseColMatRef<'_, usize> {
    SymbolicSparseColMatRef::new_checked(
        matrix.nrows(),
        matrix.ncols(),
        matrix.col_offsets(),
        None,
        matrix.row_indices(),
    )
}

/// The largest magnitude; NaN if there is a NaN.
fn max_norm(x: &[f64]) -> f64 {
    // A plain maximum would drop NaN.
    x.iter().fold(0.0, |m: f64, x| if x.is_nan() { f64::NAN } else { m.max(x.abs()) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use faer::Mat;
    use faer::linalg::solvers::Solve;

    /// A solver and the same matrix as a dense one, from the block `value(group, row, column)` of each group.
    fn assembled(
        unknowns: usize,
        groups: &[Vec<Option<u32>>],
        value: impl Fn(usize, usize, usize) -> f64,
    ) -> (SymmetricSolver, Mat<f64>) {
        let (mut solver, places) = SymmetricSolver::new(unknowns, groups).unwrap();
        let mut dense = Mat::zeros(unknowns, unknowns);
        for (k, (group, place)) in groups.iter().zip(&places).enumerate() {
            for (a, &r) in group.iter().enumerate() {
                for (b, &c) in group.iter().enumerate() {
                    if let Some(place) = place[a * group.len() + b] {
                        solver.add(place, value(k, a, b));
                    }
                    if let (Some(r), Some(c)) = (r, c) {
                        dense[(r as usize, c as usize)] += value(k, a, b);
                    }
                }
            }
        }
        (solver, dense)
    }

    #[test]
    fn an_indefinite_matrix_is_solved_and_its_negative_pivots_counted() {
        // A chain with one negative stiffness.
        let n = 60;
        let groups: Vec<Vec<Option<u32>>> =
            (0..n as u32 - 1).map(|k| vec![Some(k), Some(k + 1)]).chain([vec![Some(0), None]]).collect();
        let (mut solver, dense) = assembled(n, &groups, |k, a, b| {
            let stiffness = if k == 10 { -0.3 } else { 1.0 };
            if a == b { stiffness } else { -stiffness }
        });
        assert_eq!(solver.factorise(), Ok(1));
        let exact = Mat::from_fn(n, 1, |k, _| (k as f64).sin());
        let mut x: Vec<f64> = (&dense * &exact).col(0).iter().copied().collect();
        assert!(solver.solve(&mut x) < 1e-12);
        assert!((0..n).all(|k| (x[k] - exact[(k, 0)]).abs() < 1e-10));
    }

    #[test]
    fn the_solution_is_that_of_the_dense_matrix() {
        // Groups of four unknowns, scattered and overlapping, some with a value that is not an unknown.
        let n = 90;
        let group = |k: u32| {
            [1, 7, 13, 31].map(|step| (step != 13 || !k.is_multiple_of(3)).then_some(k * step % n)).to_vec()
        };
        let groups: Vec<_> = (0..n).map(group).collect();
        let (mut solver, mut dense) = assembled(n as usize, &groups, |k, a, b| {
            let diagonal = if a == b { 3.0 } else { 0.0 };
            diagonal + ((k + a * b + a + b) as f64).cos()
        });
        solver.add_to_diagonal(0.5);
        for k in 0..n as usize {
            dense[(k, k)] += 0.5;
        }
        assert_eq!(solver.factorise(), Ok(0));
        let right = Mat::from_fn(n as usize, 1, |k, _| (0.3 * k as f64).cos());
        let expected = dense.partial_piv_lu().solve(&right);
        let mut x: Vec<f64> = right.col(0).iter().copied().collect();
        assert!(solver.solve(&mut x) < 1e-13);
        assert!(x.iter().enumerate().all(|(k, x)| (x - expected[(k, 0)]).abs() < 1e-12));
        // Once more after a release of the memory, with other values.
        solver.release();
        solver.clear();
        solver.add_to_diagonal(2.0);
        assert_eq!(solver.factorise(), Ok(0));
        let mut x = vec![1.0; n as usize];
        assert!(solver.solve(&mut x) < 1e-15 && x.iter().all(|x| *x == 0.5));
    }

    #[test]
    fn a_singular_matrix_and_an_unknown_that_there_is_not_are_refused() {
        let groups = [vec![Some(0), Some(1)], vec![Some(2), None]];
        let (mut solver, _) = assembled(3, &groups, |_, a, b| if a == b { 1.0 } else { -1.0 });
        assert_eq!(solver.factorise(), Err(LdltError::Singular));
        let missing = LdltError::NoSuchUnknown { unknown: 2, unknowns: 2 };
        assert_eq!(SymmetricSolver::new(2, &groups).err(), Some(missing));
    }

    #[test]
    fn a_place_takes_no_more_memory_than_its_number() {
        assert_eq!(size_of::<Option<Place>>(), 4);
    }
}
