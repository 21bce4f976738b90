//! The part of the primal operator that the map adds: the integral of grad v (K - eps) grad u by Gauss points, factor by factor.

use super::metric::{Metric, Of, product, times};
use super::points::{AxisPoints, Evaluation};
use crate::SolveError;
use crate::boxes::domain::Domain;
use elastocap_fem::tensor::{Dims, Window, along};
use faer::Mat;
use rayon::prelude::*;

/// Points on each element beyond its degree: in products with the operator, and for energies.
pub(crate) const EXTRA: usize = 2;
pub(crate) const FINER: usize = 3;

/// Gradients at the points of a [`Metric`].
#[derive(Debug)]
pub(crate) struct Gradients {
    metric: Metric,
    window: Window,
    values: [Evaluation; 3],
    slopes: [Evaluation; 3],
}

impl Gradients {
    /// `None` where the map changes nothing.
    pub(crate) fn new(domain: &Domain, extra: usize) -> Result<Option<Self>, SolveError> {
        let Some(metric) = Metric::new(domain, extra, Of::Permittivity)? else { return Ok(None) };
        let window = [0, 1, 2].map(|a| metric.points[a].window(&domain.axes[a]));
        let both = [0, 1, 2].map(|a| metric.points[a].functions(&domain.axes[a], &window[a]));
        let values = both.each_ref().map(|[value, _]| Evaluation::new(value));
        let slopes = both.each_ref().map(|[_, slope]| Evaluation::new(slope));
        Ok(Some(Self { metric, window, values, slopes }))
    }

    /// The points, on each axis.
    pub(crate) fn points(&self) -> &[AxisPoints; 3] {
        &self.metric.points
    }

    /// The gradient of a function at all points, by component.
    pub(crate) fn of(&self, x: &[f64], dims: Dims) -> [Vec<f64>; 3] {
        let [w0, w1, w2] = &self.window;
        let mut own = Vec::with_capacity(w0.len() * w1.len() * w2.len());
        for i in w0.clone() {
            for j in w1.clone() {
                let row = (i * dims[1] + j) * dims[2];
                own.extend_from_slice(&x[row + w2.start..row + w2.end]);
            }
        }
        let shape = [w0.len(), w1.len(), w2.len()];
        let (v, g) = (&self.values, &self.slopes);
        let (by_value, last) = along(2, &v[2].forward, &own, shape);
        let (by_slope, _) = along(2, &g[2].forward, &own, shape);
        let (none, middle) = along(1, &v[1].forward, &by_value, last);
        let (second, _) = along(1, &g[1].forward, &by_value, last);
        let (third, _) = along(1, &v[1].forward, &by_slope, last);
        [
            along(0, &g[0].forward, &none, middle).0,
            along(0, &v[0].forward, &second, middle).0,
            along(0, &v[0].forward, &third, middle).0,
        ]
    }

    /// `y += A x` for the part that the map adds.
    pub(crate) fn add_product(&self, x: &[f64], y: &mut [f64], dims: Dims) {
        let [f0, f1, f2] = self.added_flux(x, dims);
        let shape = [0, 1, 2].map(|a| self.metric.points[a].len());
        let (v, g) = (&self.values, &self.slopes);
        let (none, middle) = along(0, &g[0].back, &f0, shape);
        let (second, _) = along(0, &v[0].back, &f1, shape);
        let (third, _) = along(0, &v[0].back, &f2, shape);
        let (mut by_value, last) = along(1, &v[1].back, &none, middle);
        let (by_second, _) = along(1, &g[1].back, &second, middle);
        by_value.par_iter_mut().zip(&by_second).with_min_len(4096).for_each(|(a, b)| *a += b);
        let (by_slope, _) = along(1, &v[1].back, &third, middle);
        let (mut own, _) = along(2, &v[2].back, &by_value, last);
        let (rest, _) = along(2, &g[2].back, &by_slope, last);
        own.par_iter_mut().zip(&rest).with_min_len(4096).for_each(|(a, b)| *a += b);
        let [w0, w1, w2] = &self.window;
        let mut rows = own.chunks_exact(w2.len().max(1));
        for i in w0.clone() {
            for j in w1.clone() {
                let row = (i * dims[1] + j) * dims[2];
                let target = &mut y[row + w2.start..row + w2.end];
                rows.next().into_iter().for_each(|own| target.iter_mut().zip(own).for_each(|(y, x)| *y += x));
            }
        }
    }

    /// The flux K grad u times the weight, without its part eps grad u.
    pub(crate) fn added_flux(&self, x: &[f64], dims: Dims) -> [Vec<f64>; 3] {
        let [mut f0, mut f1, mut f2] = self.of(x, dims);
        f0.par_iter_mut().zip(&mut f1).zip(&mut f2).zip(&self.metric.tensors).with_min_len(4096).for_each(
            |(((a, b), c), k)| {
                [*a, *b, *c] = times(k, [*a, *b, *c]);
            },
        );
        [f0, f1, f2]
    }

    /// What the map adds to the energies of potentials.
    pub(crate) fn energies(&self, potentials: &[Vec<f64>], dims: Dims) -> Mat<f64> {
        let n = potentials.len();
        let mut out = Mat::zeros(n, n);
        for i in 0..n {
            let own = self.of(&potentials[i], dims);
            for j in 0..=i {
                let other = if i == j { own.clone() } else { self.of(&potentials[j], dims) };
                out[(i, j)] = product(&self.metric.tensors, &own, &other);
                out[(j, i)] = out[(i, j)];
            }
        }
        out
    }
}

/// Adds to energies what the map adds by the finer of two rules, and to the diagonal, with the sign given, how far the two are apart:
/// what the finer rule leaves out is a small part of that.
pub(crate) fn add_with_error(matrix: &mut Mat<f64>, coarser: &Mat<f64>, finer: &Mat<f64>, sign: f64) {
    for i in 0..matrix.nrows() {
        for j in 0..matrix.ncols() {
            matrix[(i, j)] += finer[(i, j)];
            matrix[(i, i)] += sign * (finer[(i, j)] - coarser[(i, j)]).abs();
        }
    }
}
