//! The part of the primal operator that the map adds: the integral of grad v (K - eps) grad u by Gauss points, factor by factor.

use super::metric::{Metric, Of, product, times};
use super::points::{AxisPoints, Evaluation};
use crate::SolveError;
use crate::boxes::domain::Domain;
use elastocap_fem::tensor::{Dims, Strips, Window, sized, target};
use faer::Mat;
use rayon::prelude::*;

/// Points on each element beyond its degree: in products with the operator, and for energies.
pub(crate) const EXTRA: usize = 2;
pub(crate) const FINER: usize = 3;

/// Functions of an axis at points, and the transpose.
#[derive(Debug)]
struct Both {
    forward: Strips,
    back: Strips,
}

impl Both {
    fn new(matrix: &Mat<f64>) -> Self {
        let Evaluation { forward, back } = Evaluation::new(matrix);
        Self { forward: Strips::new(&forward), back: Strips::new(&back) }
    }
}

/// Gradients at the points of a [`Metric`].
#[derive(Debug)]
pub(crate) struct Gradients {
    metric: Metric,
    window: Window,
    values: [Both; 3],
    slopes: [Both; 3],
}

/// What products with the operator need besides, kept from one to the next.
#[derive(Debug, Default)]
pub(crate) struct Work {
    /// At points of the second and the third axis, for functions of the first.
    middle: [Vec<f64>; 3],
    /// At points of all axes.
    flux: [Vec<f64>; 3],
}

impl Gradients {
    /// `None` where the map changes nothing.
    pub(crate) fn new(domain: &Domain, extra: usize) -> Result<Option<Self>, SolveError> {
        let Some(metric) = Metric::new(domain, extra, Of::Permittivity)? else { return Ok(None) };
        let window = [0, 1, 2].map(|a| metric.points[a].window(&domain.axes[a]));
        let both = [0, 1, 2].map(|a| metric.points[a].functions(&domain.axes[a], &window[a]));
        let values = both.each_ref().map(|[value, _]| Both::new(value));
        let slopes = both.each_ref().map(|[_, slope]| Both::new(slope));
        Ok(Some(Self { metric, window, values, slopes }))
    }

    /// The points, on each axis.
    pub(crate) fn points(&self) -> &[AxisPoints; 3] {
        &self.metric.points
    }

    /// See [`Metric::largest`].
    pub(crate) fn largest(&self) -> f64 {
        self.metric.largest
    }

    fn counts(&self) -> Dims {
        self.metric.points.each_ref().map(AxisPoints::len)
    }

    /// The gradient of a function at all points, by component, into the flux of `work`.
    fn evaluate(&self, x: &[f64], dims: Dims, work: &mut Work) {
        let [w0, w1, w2] = &self.window;
        let [n0, n1, n2] = self.counts();
        let plane = n1 * n2;
        let Work { middle, flux } = work;
        middle.iter_mut().for_each(|own| sized(own, w0.len() * plane));
        flux.iter_mut().for_each(|own| sized(own, n0 * plane));
        let (v, g) = (&self.values, &self.slopes);
        let [none, second, third] = middle;
        // Slab by slab, so that what is between the second and the third axis stays in cache.
        none.par_chunks_mut(plane)
            .zip(second.par_chunks_mut(plane))
            .zip(third.par_chunks_mut(plane))
            .enumerate()
            .for_each_init(
                || [vec![0.0; w1.len() * n2], vec![0.0; w1.len() * n2]],
                |[by_value, by_slope], (i, ((none, second), third))| {
                    let own = &x[((w0.start + i) * dims[1] + w1.start) * dims[2] + w2.start..];
                    v[2].forward.times_rows(own, w1.len(), dims[2], target(by_value, 0, n2), false);
                    g[2].forward.times_rows(own, w1.len(), dims[2], target(by_slope, 0, n2), false);
                    v[1].forward.times(by_value, n2, none, false);
                    g[1].forward.times(by_value, n2, second, false);
                    v[1].forward.times(by_slope, n2, third, false);
                },
            );
        for (matrix, (from, to)) in [&g[0], &v[0], &v[0]].into_iter().zip(middle.iter().zip(flux)) {
            matrix.forward.times_in_parallel(from, plane, to);
        }
    }

    /// The gradient of a function at all points, by component.
    fn of(&self, x: &[f64], dims: Dims) -> [Vec<f64>; 3] {
        let mut work = Work::default();
        self.evaluate(x, dims, &mut work);
        work.flux
    }

    /// `y += A x` for the part that the map adds.
    pub(crate) fn add_product(&self, x: &[f64], y: &mut [f64], dims: Dims, work: &mut Work) {
        self.evaluate(x, dims, work);
        self.weigh(&mut work.flux);
        let [w0, w1, w2] = &self.window;
        let [_, n1, n2] = self.counts();
        let plane = n1 * n2;
        let Work { middle, flux } = work;
        let (v, g) = (&self.values, &self.slopes);
        for (matrix, (to, from)) in [&g[0], &v[0], &v[0]].into_iter().zip(middle.iter_mut().zip(flux)) {
            matrix.back.times_in_parallel(from, plane, to);
        }
        let [none, second, third] = &*middle;
        let slabs = &mut y[w0.start * dims[1] * dims[2]..w0.end * dims[1] * dims[2]];
        slabs.par_chunks_mut(dims[1] * dims[2]).enumerate().for_each_init(
            || [vec![0.0; w1.len() * n2], vec![0.0; w1.len() * n2]],
            |[by_value, by_slope], (i, slab)| {
                let [none, second, third] = [none, second, third].map(|own| &own[i * plane..(i + 1) * plane]);
                v[1].back.times(none, n2, by_value, false);
                g[1].back.times(second, n2, by_value, true);
                v[1].back.times(third, n2, by_slope, false);
                let mut own = |matrix: &Strips, from: &[f64]| {
                    let to = target(slab, w1.start * dims[2] + w2.start, dims[2]);
                    matrix.times_rows(from, w1.len(), n2, to, true);
                };
                own(&v[2].back, by_value);
                own(&g[2].back, by_slope);
            },
        );
    }

    /// Gradients become K grad u times the weight, without its part eps grad u.
    fn weigh(&self, [f0, f1, f2]: &mut [Vec<f64>; 3]) {
        f0.par_iter_mut().zip(f1).zip(f2).zip(&self.metric.tensors).with_min_len(4096).for_each(
            |(((a, b), c), k)| {
                [*a, *b, *c] = times(k, [*a, *b, *c]);
            },
        );
    }

    /// The flux K grad u times the weight, without its part eps grad u.
    pub(crate) fn added_flux(&self, x: &[f64], dims: Dims) -> [Vec<f64>; 3] {
        let mut flux = self.of(x, dims);
        self.weigh(&mut flux);
        flux
    }

    /// What the map adds to the energies of potentials.
    pub(crate) fn energies(&self, potentials: &[Vec<f64>], dims: Dims) -> Mat<f64> {
        let n = potentials.len();
        let mut out = Mat::zeros(n, n);
        for i in 0..n {
            let own = self.of(&potentials[i], dims);
            for j in 0..=i {
                out[(i, j)] = if i == j {
                    product(&self.metric.tensors, &own, &own)
                } else {
                    product(&self.metric.tensors, &own, &self.of(&potentials[j], dims))
                };
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
