//! The matrices of one triangle of the plan, and the elimination of the unknowns that it shares with no
//! other.

use elastocap_linalg::lanes::{LANES, Lane};

/// The place of an unknown in the local matrices of a triangle, and among the unknowns of the skeleton.
pub(super) type Place = (u32, u32);

/// The matrices A and M of a triangle. In its inner unknowns A is diagonal and M the identity.
#[derive(Debug, Default)]
pub(super) struct Local {
    /// The number of outer unknowns, which are those on corners and sides.
    pub outer: usize,
    /// A between the outer unknowns, row by row.
    pub a: Vec<f64>,
    /// M between the outer unknowns; empty where it is zero.
    pub m: Vec<f64>,
    /// A between the outer (rows) and the inner unknowns.
    pub a_inner: Vec<f64>,
    /// M between the outer and the inner unknowns; empty where it is zero.
    pub m_inner: Vec<f64>,
    /// The diagonal of A in the inner unknowns.
    pub inner: Vec<f64>,
}

impl Local {
    /// A + lambda M between the outer unknowns at `places`, times a weight, after the inner unknowns are
    /// eliminated: row by row in `out`. `coupling` is working memory.
    #[inline(always)]
    pub(super) fn without_inner(
        &self,
        places: &[Place],
        weight: f64,
        lambda: &Lane<f64>,
        coupling: &mut Vec<Lane<f64>>,
        out: &mut Vec<Lane<f64>>,
    ) {
        let (inner, n, width) = (self.inner.len(), self.outer, places.len());
        // The roots of the diagonal are taken into the coupling.
        coupling.clear();
        coupling.resize(inner * (width + 1), Lane::splat(0.0));
        let (roots, coupling) = coupling.split_at_mut(inner);
        for (root, s) in roots.iter_mut().zip(&self.inner) {
            for k in 0..LANES {
                root.0[k] = 1.0 / (s + lambda.0[k]).sqrt();
            }
        }
        for (line, (i, _)) in coupling.chunks_exact_mut(inner.max(1)).zip(places) {
            for (k, (value, root)) in line.iter_mut().zip(roots.iter()).enumerate() {
                *value = self.coupling(*i as usize, k, lambda).times(*root);
            }
        }
        out.resize(width * width, Lane::splat(0.0));
        for (row, (i, _)) in places.iter().enumerate() {
            for (column, (j, _)) in places[..=row].iter().enumerate() {
                let k = *i as usize * n + *j as usize;
                let mut value = combined(self.a[k], entry_or_zero(&self.m, k), lambda);
                let (a, b) = (&coupling[row * inner..][..inner], &coupling[column * inner..][..inner]);
                for (a, b) in a.iter().zip(b) {
                    value = value.minus(a.times(*b));
                }
                let value = value.times(Lane::splat(weight));
                out[row * width + column] = value;
                out[column * width + row] = value;
            }
        }
    }

    /// A + lambda M between an outer and an inner unknown.
    #[inline(always)]
    fn coupling(&self, outer: usize, inner: usize, lambda: &Lane<f64>) -> Lane<f64> {
        let k = outer * self.inner.len() + inner;
        combined(self.a_inner[k], entry_or_zero(&self.m_inner, k), lambda)
    }
}

/// An entry of A + lambda M.
#[inline(always)]
pub(super) fn combined(a: f64, m: f64, lambda: &Lane<f64>) -> Lane<f64> {
    let mut out = Lane::splat(0.0);
    for k in 0..LANES {
        out.0[k] = a + lambda.0[k] * m;
    }
    out
}

/// An entry of a matrix, which is stored empty if it is zero.
#[inline(always)]
pub(super) fn entry_or_zero(matrix: &[f64], k: usize) -> f64 {
    matrix.get(k).copied().unwrap_or(0.0)
}
