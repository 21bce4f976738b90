//! Products and factors of dense matrices by faer, on the calling thread alone.
//!
//! The methods of faer's matrices (`a * b`, `a.svd()`, `a.llt(..)`) take as many threads as rayon has and
//! distribute their sums over them: singular vectors, say, then depend on the number of threads in their last
//! digits. The matrices of this project are small, since they belong to one line of a grid or to a few
//! conductors, and many of them are treated at the same time, so that one thread for each is fast as well.
//! Outside of tests those methods are not called.

use faer::diag::Diag;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt;
use faer::linalg::lu::partial_pivoting as lu;
use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve;
use faer::linalg::{evd, svd};
use faer::perm::PermRef;
use faer::{Accum, Mat, MatMut, MatRef, Par};

/// Why a dense matrix has no factors.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum NoFactors {
    /// A pivot of Cholesky's factorisation is not positive.
    #[error("a dense matrix is not positive definite")]
    NotPositiveDefinite,
    /// The iteration for singular values or eigenvalues did not converge: an entry is not finite.
    #[error("the singular values or eigenvalues of a dense matrix were not found")]
    NoConvergence,
}

/// The product `a b`.
///
/// # Panics
/// If `a` has not as many columns as `b` has rows.
pub fn product(a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Mat<f64> {
    let mut c = Mat::zeros(a.nrows(), b.ncols());
    matmul(c.as_mut(), Accum::Replace, a, b, 1.0, Par::Seq);
    c
}

/// Overwrites `x` with `lower^-1 x`; the upper triangle of `lower` is not read.
pub fn solve_lower_triangular(lower: MatRef<'_, f64>, x: MatMut<'_, f64>) {
    triangular_solve::solve_lower_triangular_in_place(lower, x, Par::Seq);
}

/// Overwrites `x` with `upper^-1 x`; the lower triangle of `upper` is not read.
pub fn solve_upper_triangular(upper: MatRef<'_, f64>, x: MatMut<'_, f64>) {
    triangular_solve::solve_upper_triangular_in_place(upper, x, Par::Seq);
}

/// The factor `A = L L^T` of a positive definite matrix. [`crate::cholesky`] is for those that are
/// semi-definite.
#[derive(Debug, Clone)]
pub struct Llt {
    lower: Mat<f64>,
}

impl Llt {
    /// Factorises a square matrix; only its lower triangle is read.
    ///
    /// # Errors
    /// [`NoFactors::NotPositiveDefinite`] if a pivot is not positive.
    pub fn new(matrix: MatRef<'_, f64>) -> Result<Self, NoFactors> {
        let n = matrix.nrows();
        let mut lower = Mat::zeros(n, n);
        lower.copy_from_triangular_lower(matrix);
        let scratch = llt::factor::cholesky_in_place_scratch::<f64>(n, Par::Seq, Default::default());
        llt::factor::cholesky_in_place(
            lower.as_mut(),
            Default::default(),
            Par::Seq,
            MemStack::new(&mut MemBuffer::new(scratch)),
            Default::default(),
        )
        .map_err(|_| NoFactors::NotPositiveDefinite)?;
        for j in 1..n {
            for i in 0..j {
                lower[(i, j)] = 0.0;
            }
        }
        Ok(Self { lower })
    }

    /// `L`, with zeros above the diagonal.
    pub fn lower(&self) -> MatRef<'_, f64> {
        self.lower.as_ref()
    }

    /// `L`, with zeros above the diagonal.
    pub fn into_lower(self) -> Mat<f64> {
        self.lower
    }

    /// `A^-1 right`.
    pub fn solve(&self, right: MatRef<'_, f64>) -> Mat<f64> {
        let mut x = right.to_owned();
        // An empty stack, since triangular solves need no memory.
        llt::solve::solve_in_place(self.lower.as_ref(), x.as_mut(), Par::Seq, MemStack::new(&mut []));
        x
    }
}

/// The factors `P A = L U` of a square matrix, rows exchanged for the largest pivots.
#[derive(Debug, Clone)]
pub struct Lu {
    /// `U` on and above the diagonal, `L` without its unit diagonal below.
    factors: Mat<f64>,
    /// The permutation of the rows, and its inverse, as faer gives them.
    forward: Vec<usize>,
    inverse: Vec<usize>,
}

impl Lu {
    /// Factorises a square matrix. A singular one gives solutions that are not finite.
    pub fn new(matrix: MatRef<'_, f64>) -> Self {
        let n = matrix.nrows();
        let (mut factors, mut forward, mut inverse) = (matrix.to_owned(), vec![0; n], vec![0; n]);
        let scratch = lu::factor::lu_in_place_scratch::<usize, f64>(n, n, Par::Seq, Default::default());
        lu::factor::lu_in_place(
            factors.as_mut(),
            &mut forward,
            &mut inverse,
            Par::Seq,
            MemStack::new(&mut MemBuffer::new(scratch)),
            Default::default(),
        );
        Self { factors, forward, inverse }
    }

    /// `A^-1 right`.
    pub fn solve(&self, right: MatRef<'_, f64>) -> Mat<f64> {
        let n = self.factors.nrows();
        let mut x = right.to_owned();
        let scratch = lu::solve::solve_in_place_scratch::<usize, f64>(n, x.ncols(), Par::Seq);
        lu::solve::solve_in_place(
            self.factors.as_ref(),
            self.factors.as_ref(),
            PermRef::new_checked(&self.forward, &self.inverse, n),
            x.as_mut(),
            Par::Seq,
            MemStack::new(&mut MemBuffer::new(scratch)),
        );
        x
    }
}

/// All left singular vectors, in the columns of a square matrix, and the singular values, descending.
///
/// # Errors
/// [`NoFactors::NoConvergence`] if the iteration does not converge.
pub fn left_singular_vectors(matrix: MatRef<'_, f64>) -> Result<(Mat<f64>, Vec<f64>), NoFactors> {
    let (m, n) = matrix.shape();
    let (mut u, mut v) = (Mat::zeros(m, m), Mat::zeros(n, n));
    let mut values = Diag::zeros(m.min(n));
    let full = svd::ComputeSvdVectors::Full;
    let scratch = svd::svd_scratch::<f64>(m, n, full, full, Par::Seq, Default::default());
    svd::svd(
        matrix,
        values.as_mut(),
        Some(u.as_mut()),
        Some(v.as_mut()),
        Par::Seq,
        MemStack::new(&mut MemBuffer::new(scratch)),
        Default::default(),
    )
    .map_err(|_| NoFactors::NoConvergence)?;
    Ok((u, values.column_vector().iter().copied().collect()))
}

/// Eigenvectors of a symmetric matrix, in columns, and its eigenvalues, ascending; only the lower triangle is
/// read.
///
/// # Errors
/// [`NoFactors::NoConvergence`] if the iteration does not converge.
pub fn symmetric_eigenvectors(matrix: MatRef<'_, f64>) -> Result<(Mat<f64>, Vec<f64>), NoFactors> {
    let n = matrix.nrows();
    let (mut vectors, mut values) = (Mat::zeros(n, n), Diag::zeros(n));
    let with_vectors = evd::ComputeEigenvectors::Yes;
    let scratch = evd::self_adjoint_evd_scratch::<f64>(n, with_vectors, Par::Seq, Default::default());
    evd::self_adjoint_evd(
        matrix,
        values.as_mut(),
        Some(vectors.as_mut()),
        Par::Seq,
        MemStack::new(&mut MemBuffer::new(scratch)),
        Default::default(),
    )
    .map_err(|_| NoFactors::NoConvergence)?;
    Ok((vectors, values.column_vector().iter().copied().collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Far larger than the size from which faer uses several threads.
    const SIZE: usize = 400;

    fn matrix() -> Mat<f64> {
        Mat::from_fn(SIZE, SIZE, |i, j| {
            f64::from(u8::from(i == j)) * 3.0 + ((i * 31 + j * 17) % 101) as f64 / 101.0 - 0.5
        })
    }

    #[test]
    fn every_product_and_every_factor_is_the_same_at_any_number_of_threads() {
        let a = matrix();
        let work = || {
            let gram = product(a.transpose(), a.as_ref());
            let llt = Llt::new(gram.as_ref()).unwrap();
            let (vectors, values) = left_singular_vectors(a.as_ref()).unwrap();
            let (eigenvectors, eigenvalues) = symmetric_eigenvectors(gram.as_ref()).unwrap();
            let solved = [llt.solve(a.as_ref()), Lu::new(a.as_ref()).solve(gram.as_ref())];
            let matrices = [gram, llt.into_lower(), vectors, eigenvectors];
            let entries = matrices.iter().chain(&solved).flat_map(|m| m.col_iter().flat_map(|c| c.iter()));
            entries.chain(&values).chain(&eigenvalues).map(|x| x.to_bits()).collect::<Vec<u64>>()
        };
        let on = |threads: usize| {
            rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(work)
        };
        let alone = on(1);
        assert!(alone == on(2) && alone == on(3));
    }

    #[test]
    fn factors_give_the_matrix_back() {
        let a = matrix();
        let near = |x: &Mat<f64>, y: &Mat<f64>| (x - y).norm_max() < 1e-11 * y.norm_max();
        let gram = product(a.transpose(), a.as_ref());
        let lower = Llt::new(gram.as_ref()).unwrap().into_lower();
        assert!(near(&product(lower.as_ref(), lower.transpose()), &gram));
        let x = Lu::new(a.as_ref()).solve(gram.as_ref());
        assert!((&product(a.as_ref(), x.as_ref()) - &gram).norm_max() < 1e-8 * gram.norm_max());
        // A A^T = U S^2 U^T and A^T A = V L V^T.
        let scaled = |u: &Mat<f64>, by: &[f64]| Mat::from_fn(SIZE, SIZE, |i, j| u[(i, j)] * by[j]);
        let (u, s) = left_singular_vectors(a.as_ref()).unwrap();
        assert!(s.windows(2).all(|two| two[0] >= two[1]));
        let squares: Vec<f64> = s.iter().map(|s| s * s).collect();
        let outer = product(a.as_ref(), a.transpose());
        assert!(near(&product(scaled(&u, &squares).as_ref(), u.transpose()), &outer));
        let (v, l) = symmetric_eigenvectors(gram.as_ref()).unwrap();
        assert!(l.windows(2).all(|two| two[0] <= two[1]));
        assert!(near(&product(scaled(&v, &l).as_ref(), v.transpose()), &gram));
    }

    #[test]
    fn an_indefinite_matrix_has_no_cholesky_factor() {
        let matrix = Mat::from_fn(2, 2, |i, j| if i == j { 1.0 } else { 2.0 });
        assert_eq!(Llt::new(matrix.as_ref()).err(), Some(NoFactors::NotPositiveDefinite));
    }
}
