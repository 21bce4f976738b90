//! Sparse symmetric systems that are solved again and again with one pattern.

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

/// Why a linear system has no usable solution.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SingularMatrix;

/// A symmetric matrix with a fixed pattern, its values, its factors, and the memory for them.
///
/// The unknowns have to be numbered so that the factors stay sparse: no further reordering is done.
pub struct SymmetricSolver {
    column_start: Vec<usize>,
    row: Vec<usize>,
    /// Values of the lower triangle, column after column.
    pub values: Vec<f64>,
    symbolic: SymbolicCholesky<usize>,
    /// Empty until the first factorisation, so that its size can be asked for before the memory is taken.
    factors: Vec<f64>,
    scratch: StackReq,
    memory: MemBuffer,
    par: Par,
}

impl std::fmt::Debug for SymmetricSolver {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "SymmetricSolver({} unknowns, {} in the factor)", self.unknowns(), self.factor_entries())
    }
}

impl SymmetricSolver {
    /// The solver for a matrix that couples all unknowns within each of `groups` (`u32::MAX` marks no unknown), and
    /// for each group the places of its dense block in [`SymmetricSolver::values`]: `u32::MAX` above the diagonal.
    pub fn new(
        unknowns: usize,
        groups: &[Vec<u32>],
        par: Par,
    ) -> Result<(Self, Vec<Vec<u32>>), SingularMatrix> {
        let mut columns: Vec<Vec<u32>> = vec![Vec::new(); unknowns];
        for group in groups {
            for &c in group.iter().filter(|&&c| c != u32::MAX) {
                columns[c as usize].extend(group.iter().filter(|&&r| r != u32::MAX && r >= c));
            }
        }
        let mut column_start = vec![0];
        let mut row = Vec::new();
        for column in &mut columns {
            column.sort_unstable();
            column.dedup();
            row.extend(column.iter().map(|&r| r as usize));
            column_start.push(row.len());
        }
        let places = groups
            .iter()
            .map(|group| {
                let place = |&c: &u32, &r: &u32| {
                    if c == u32::MAX || r == u32::MAX || r < c {
                        return u32::MAX;
                    }
                    let within = columns[c as usize].binary_search(&r).unwrap_or(0);
                    (column_start[c as usize] + within) as u32
                };
                group.iter().flat_map(|r| group.iter().map(move |c| place(c, r))).collect()
            })
            .collect();
        let pattern = SymbolicSparseColMatRef::new_checked(unknowns, unknowns, &column_start, None, &row);
        let same: Vec<usize> = (0..unknowns).collect();
        let symbolic = factorize_symbolic_cholesky(
            pattern,
            Side::Lower,
            // Not `Identity`: faer 0.24 then reads a lower triangle as an upper one, and panics.
            SymmetricOrdering::Custom(PermRef::new_checked(&same, &same, unknowns)),
            CholeskySymbolicParams {
                supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
                ..Default::default()
            },
        )
        .map_err(|_| SingularMatrix)?;
        let scratch = symbolic
            .factorize_numeric_ldlt_scratch::<f64>(par, Default::default())
            .or(symbolic.solve_in_place_scratch::<f64>(1, par));
        let solver = Self {
            values: vec![0.0; row.len()],
            column_start,
            row,
            factors: Vec::new(),
            symbolic,
            scratch,
            memory: MemBuffer::new(StackReq::EMPTY),
            par,
        };
        Ok((solver, places))
    }

    /// Order of the matrix.
    pub fn unknowns(&self) -> usize {
        self.column_start.len() - 1
    }

    /// Entries of the factor.
    pub fn factor_entries(&self) -> usize {
        self.symbolic.len_val()
    }

    /// Bytes of matrix and factor, whether they are taken yet or not.
    pub fn memory_bytes(&self) -> u64 {
        let of_matrix = 16 * self.values.len() + 8 * self.column_start.len();
        (of_matrix + 8 * self.factor_entries() + self.scratch.unaligned_bytes_required()) as u64
    }

    /// Gives the memory of the factors back; the next factorisation takes it again.
    pub fn release(&mut self) {
        self.factors = Vec::new();
        self.memory = MemBuffer::new(StackReq::EMPTY);
    }

    /// Adds `value` to every entry of the diagonal.
    pub fn add_to_diagonal(&mut self, value: f64) {
        // Of a column's lower triangle the diagonal is the first.
        for &first in &self.column_start[..self.column_start.len() - 1] {
            self.values[first] += value;
        }
    }

    /// Factorises the matrix that [`SymmetricSolver::values`] holds. Returns the number of negative pivots: zero if
    /// and only if the matrix is positive definite.
    pub fn factorise(&mut self) -> Result<usize, SingularMatrix> {
        if self.factors.is_empty() {
            self.factors = vec![0.0; self.factor_entries()];
            self.memory = MemBuffer::new(self.scratch);
        }
        let pattern = SymbolicSparseColMatRef::new_checked(
            self.unknowns(),
            self.unknowns(),
            &self.column_start,
            None,
            &self.row,
        );
        self.symbolic
            .factorize_numeric_ldlt(
                &mut self.factors,
                SparseColMatRef::new(pattern, &self.values),
                Side::Lower,
                LdltRegularization::default(),
                self.par,
                MemStack::new(&mut self.memory),
                Default::default(),
            )
            .map_err(|_| SingularMatrix)?;
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

    /// Solves with the last factors, in place, and refines until the residual stops falling. Returns the residual
    /// over the right-hand side, in the maximum norm.
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

    fn back_substitute(&mut self, x: &mut [f64]) {
        let n = x.len();
        LdltRef::new(&self.symbolic, &self.factors).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(x, n, 1),
            self.par,
            MemStack::new(&mut self.memory),
        );
    }

    /// `y -= A x`.
    fn subtract_product(&self, x: &[f64], y: &mut [f64]) {
        for c in 0..self.unknowns() {
            let mut sum = 0.0;
            for k in self.column_start[c]..self.column_start[c + 1] {
                let (r, v) = (self.row[k], self.values[k]);
                if r != c {
                    sum += v * x[r];
                }
                y[r] -= v * x[c];
            }
            y[c] -= sum;
        }
    }
}

fn max_norm(x: &[f64]) -> f64 {
    // A plain maximum would drop NaN.
    x.iter().fold(0.0, |m: f64, x| if x.is_nan() { f64::NAN } else { m.max(x.abs()) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_indefinite_matrix_is_solved_and_its_negative_pivots_counted() {
        // A chain with one negative stiffness.
        let n = 60;
        let groups: Vec<Vec<u32>> =
            (0..n as u32 - 1).map(|k| vec![k, k + 1]).chain([vec![0, u32::MAX]]).collect();
        let (mut solver, places) = SymmetricSolver::new(n, &groups, Par::Seq).unwrap();
        let mut dense = vec![vec![0.0; n]; n];
        for (k, (group, place)) in groups.iter().zip(&places).enumerate() {
            let stiffness = if k == 10 { -0.3 } else { 1.0 };
            for (a, &r) in group.iter().enumerate() {
                for (b, &c) in group.iter().enumerate() {
                    let value = if a == b { stiffness } else { -stiffness };
                    if place[a * 2 + b] != u32::MAX {
                        solver.values[place[a * 2 + b] as usize] += value;
                    }
                    if r != u32::MAX && c != u32::MAX {
                        dense[r as usize][c as usize] += value;
                    }
                }
            }
        }
        assert_eq!(solver.factorise(), Ok(1));
        let exact: Vec<f64> = (0..n).map(|k| (k as f64).sin()).collect();
        let mut x: Vec<f64> =
            dense.iter().map(|row| row.iter().zip(&exact).map(|(a, x)| a * x).sum()).collect();
        assert!(solver.solve(&mut x) < 1e-12);
        assert!(x.iter().zip(&exact).all(|(a, b)| (a - b).abs() < 1e-10));
    }
}
