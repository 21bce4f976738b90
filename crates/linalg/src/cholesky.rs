//! Dense factors of small symmetric matrices that are positive definite but for rounding, by faer.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::ldlt::factor::{
    LdltRegularization, cholesky_in_place, cholesky_in_place_scratch,
};
use faer::linalg::cholesky::ldlt::solve::solve_in_place;
use faer::{Mat, MatMut, Par};

/// The least pivot of a matrix that is scaled to a unit diagonal; smaller pivots are raised to this
/// number. Not tuned: it only has to lie above rounding errors and below errors that matter.
const LEAST_PIVOT: f64 = 1e-13;

/// A factor `A = S^-1 L D L^T S^-1` with `S` and `D` diagonal, such that `S A S` has a unit diagonal.
///
/// A matrix with a null space, say the Laplacian of a region that touches no conductor, has pivots that are
/// zero but for rounding. These pivots are raised to 1e-13 of the diagonal entry: such a matrix is solved as
/// if constants had a little energy.
///
/// Where all pivots are known to be positive, take [`Llt`](crate::dense::Llt). The version of faer's L L^T
/// that raises pivots is no use here: in faer 0.24 it divides the column by the raised pivot and leaves the
/// old one on the diagonal.
#[derive(Debug, Clone)]
pub struct Cholesky {
    /// `L` below the diagonal, `D` on it.
    factor: Mat<f64>,
    /// The diagonal of `S`.
    scale: Vec<f64>,
}

/// The error of a matrix without a factor: an entry or a pivot is not finite.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("a dense matrix has no Cholesky factor, since an entry or a pivot of it is not finite")]
pub struct NotFinite;

impl Cholesky {
    /// Factorises `matrix`, which is square; only its lower triangle is read.
    ///
    /// # Errors
    /// If an entry or a pivot is not finite.
    pub fn new(mut matrix: Mat<f64>) -> Result<Self, NotFinite> {
        let n = matrix.nrows();
        let scale = |i: usize| if matrix[(i, i)] > 0.0 { 1.0 / matrix[(i, i)].sqrt() } else { 1.0 };
        let scale: Vec<f64> = (0..n).map(scale).collect();
        for j in 0..n {
            for i in j..n {
                matrix[(i, j)] *= scale[i] * scale[j];
            }
        }
        let positive = vec![1; n];
        let regularization = LdltRegularization {
            dynamic_regularization_signs: Some(&positive),
            dynamic_regularization_delta: LEAST_PIVOT,
            dynamic_regularization_epsilon: LEAST_PIVOT,
        };
        // On one thread: the matrices are small.
        let mut memory = MemBuffer::new(cholesky_in_place_scratch::<f64>(n, Par::Seq, Default::default()));
        cholesky_in_place(
            matrix.as_mut(),
            regularization,
            Par::Seq,
            MemStack::new(&mut memory),
            Default::default(),
        )
        .map_err(|_| NotFinite)?;
        Ok(Self { factor: matrix, scale })
    }

    /// Overwrites `x`, a right-hand side with as many entries as the matrix has rows, with the solution.
    pub fn solve_in_place(&self, x: &mut [f64]) {
        let n = self.scale.len();
        x.iter_mut().zip(&self.scale).for_each(|(x, s)| *x *= s);
        let column = MatMut::from_column_major_slice_mut(&mut *x, n, 1);
        // An empty stack, since triangular solves need no memory.
        let none = MemStack::new(&mut []);
        solve_in_place(self.factor.as_ref(), self.factor.diagonal(), column, Par::Seq, none);
        x.iter_mut().zip(&self.scale).for_each(|(x, s)| *x *= s);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use faer::Side;
    use faer::linalg::solvers::Solve;

    #[test]
    fn a_badly_scaled_matrix_is_solved_as_by_faer() {
        let n = 70;
        let size = |i: usize| 10f64.powi(i as i32 % 9 - 4);
        let entry =
            |i: usize, j: usize| if i == j { 3.0 } else { 1.0 / (1.0 + i.abs_diff(j) as f64).powi(2) };
        let matrix = Mat::from_fn(n, n, |i, j| size(i) * entry(i, j) * size(j));
        let right = Mat::from_fn(n, 1, |i, _| (i as f64).sin());
        let expected = matrix.llt(Side::Lower).unwrap().solve(&right);
        let mut x: Vec<f64> = right.col(0).iter().copied().collect();
        Cholesky::new(matrix).unwrap().solve_in_place(&mut x);
        for (i, x) in x.iter().enumerate() {
            assert!((x / expected[(i, 0)] - 1.0).abs() < 1e-11, "{i}: {x} {}", expected[(i, 0)]);
        }
    }

    #[test]
    fn a_laplacian_with_constants_in_its_null_space_is_solved_for_a_balanced_source() {
        // More than one block of the factorisation, so that the raised pivot is in the last of several.
        let n = 150;
        let matrix = Mat::from_fn(n, n, |i, j| match i.abs_diff(j) {
            0 if i == 0 || i == n - 1 => 1.0,
            0 => 2.0,
            1 => -1.0,
            _ => 0.0,
        });
        let mut x = vec![0.0; n];
        (x[0], x[n - 1]) = (1.0, -1.0);
        Cholesky::new(matrix).unwrap().solve_in_place(&mut x);
        for k in 1..n {
            assert!((x[k - 1] - x[k] - 1.0).abs() < 1e-2, "{k}: {x:?}");
        }
    }

    #[test]
    fn a_matrix_that_is_not_finite_is_refused() {
        let matrix = Mat::from_fn(3, 3, |i, j| if i == j { f64::NAN } else { 0.0 });
        assert_eq!(Cholesky::new(matrix).err(), Some(NotFinite));
    }

    #[test]
    fn only_the_lower_triangle_is_read() {
        let entry = |i: usize, j: usize| if i == j { 4.0 } else { 1.0 };
        let (mut whole, mut half) = ([1.0, -2.0, 3.0], [1.0, -2.0, 3.0]);
        Cholesky::new(Mat::from_fn(3, 3, entry)).unwrap().solve_in_place(&mut whole);
        let lower = Mat::from_fn(3, 3, |i, j| if i < j { f64::NAN } else { entry(i, j) });
        Cholesky::new(lower).unwrap().solve_in_place(&mut half);
        assert_eq!(half, whole);
    }

    #[test]
    fn a_row_without_entries_leaves_the_others_alone() {
        // [2 1; 1 2] x = [3 3] beside a row and a column of zeros.
        let entry = |i: usize, j: usize| if i == 1 || j == 1 { 0.0 } else { [2.0, 1.0][i.abs_diff(j) / 2] };
        let mut x = [3.0, 0.0, 3.0];
        Cholesky::new(Mat::from_fn(3, 3, entry)).unwrap().solve_in_place(&mut x);
        for (x, exact) in x.iter().zip([1.0, 0.0, 1.0]) {
            assert!((x - exact).abs() < 1e-12, "{x} {exact}");
        }
    }

    #[test]
    fn a_pivot_is_raised_where_it_is_zero_and_kept_where_it_is_small() {
        // [1 -c; -c 1] x = [1 -1] has x = [1 -1] / (1 + c), also where the second pivot, 1 - c^2, vanishes.
        for small in [1e-2, 1e-4, 1e-8, 1e-11, 0.0] {
            let c = 1.0 - small;
            let mut x = [1.0, -1.0];
            let matrix = Mat::from_fn(2, 2, |i, j| if i == j { 1.0 } else { -c });
            Cholesky::new(matrix.clone()).unwrap().solve_in_place(&mut x);
            assert!((x[0] - x[1] - 2.0 / (1.0 + c)).abs() < 1e-9, "{small}: {x:?}");
            // The other eigenvector is divided by 1 - c, or by its substitute where c is 1.
            let mut x = [1.0, 1.0];
            Cholesky::new(matrix).unwrap().solve_in_place(&mut x);
            assert!(x[0] > 0.0 && x[0].is_finite(), "{small}: {x:?}");
            if small > 0.0 {
                assert!((x[0] * small - 1.0).abs() < 1e-4, "{small}: {x:?}");
            }
        }
    }
}
