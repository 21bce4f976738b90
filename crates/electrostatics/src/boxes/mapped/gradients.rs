//! The part of the primal operator that the map adds: the integral of grad v (K - eps) grad u by Gauss
//! quadrature, one axis after the other.

use super::metric::{Metric, Rule, TensorKind};
use super::points::AxisPoints;
use super::sums::{Fields, Tensors, at_least, at_points, products};
use crate::boxes::domain::Domain;
use crate::error::SolveError;
use elastocap_fem::tensor::{Dense, Dims, SparseRows, Strips, Window, multiply, right, sized, target};
use faer::Mat;
use rayon::prelude::*;
use std::ops::Range;

/// Gauss points on each element beyond its degree, in products with the operator. Tuned: spread and time of
/// `elastocap run cases/comb-in-layer.toml`.
pub(crate) const EXTRA: usize = 2;

/// Gauss points on each element beyond its degree, for energies. The difference from the energies by
/// [`EXTRA`] points is taken for the error. Tuned: spread and time of `elastocap run
/// cases/comb-in-layer.toml`.
pub(crate) const FINER: usize = 3;

/// A matrix from functions of an axis to points, and its transpose.
#[derive(Debug)]
struct WithTranspose {
    /// The matrix, from functions to points.
    forward: Strips,
    /// Its transpose, from points to functions.
    back: Strips,
}

impl WithTranspose {
    fn new(matrix: &Mat<f64>) -> Self {
        let [forward, back] = [matrix.as_ref(), matrix.transpose()].map(SparseRows::from_mat);
        Self { forward: Strips::new(&forward), back: Strips::new(&back) }
    }
}

/// Values and slopes of the functions of a grid at Gauss points.
#[derive(Debug)]
pub(crate) struct Functions {
    /// The functions of each axis that are nonzero at some of the points.
    window: Window,
    /// Points on each axis.
    counts: Dims,
    /// Values of the functions of the second and the third axis.
    values: [WithTranspose; 2],
    /// Slopes of the functions of the second and the third axis.
    slopes: [WithTranspose; 2],
    /// Values and slopes of the functions of the first axis, for the points of each element in turn.
    first: Vec<OfElement>,
}

/// The functions of the first axis that are nonzero on an element, counted from the start of the window, at
/// the element's points.
#[derive(Debug)]
struct OfElement {
    /// The points of the element.
    points: Range<usize>,
    /// The functions.
    functions: Range<usize>,
    /// Values of the functions at the points.
    value: Dense<f64>,
    /// Slopes of the functions at the points.
    slope: Dense<f64>,
    /// Transposes of `value` and `slope`.
    back: [Dense<f64>; 2],
}

/// Intermediate results, after the third axis and before the second, for one function of the first axis.
#[derive(Default)]
struct Between {
    /// Values along the third axis.
    by_value: Vec<f64>,
    /// Slopes along the third axis.
    by_slope: Vec<f64>,
}

impl Functions {
    /// The functions that are nonzero at some of the points.
    pub(crate) fn new(domain: &Domain, points: &[AxisPoints; 3]) -> Self {
        let window = [0, 1, 2].map(|a| points[a].functions_on(&domain.axes[a], &(0..points[a].len())));
        let matrices = [0, 1, 2].map(|a| points[a].functions(&domain.axes[a], &window[a]));
        let values = [1, 2].map(|a: usize| WithTranspose::new(&matrices[a][0]));
        let slopes = [1, 2].map(|a: usize| WithTranspose::new(&matrices[a][1]));
        let [value, slope] = &matrices[0];
        let of_element = |range: Range<usize>| {
            let nonzero = points[0].functions_on(&domain.axes[0], &range);
            let functions =
                nonzero.start.saturating_sub(window[0].start)..nonzero.end.saturating_sub(window[0].start);
            let [value, slope] = [value, slope].map(|matrix| {
                let (rows, columns) = (range.len(), functions.len());
                Dense::from_mat(matrix.as_ref().submatrix(range.start, functions.start, rows, columns))
            });
            let back = [value.transposed(), slope.transposed()];
            OfElement { points: range, functions, value, slope, back }
        };
        let first = points[0].by_element().into_iter().map(of_element).collect();
        Self { window, counts: points.each_ref().map(AxisPoints::len), values, slopes, first }
    }

    /// The part of `x` that belongs to function `i` of the first axis, and its derivatives along the second
    /// and the third axis, at the points of these two.
    fn of_slab(&self, x: &[f64], dims: Dims, i: usize, between: &mut Between, out: [&mut [f64]; 3]) {
        let [w0, w1, w2] = &self.window;
        let n2 = self.counts[2];
        let ([v1, v2], [g1, g2]) = (&self.values, &self.slopes);
        let Between { by_value, by_slope } = between;
        let [by_value, by_slope] = [by_value, by_slope].map(|buffer| at_least(buffer, w1.len() * n2));
        let slab = &x[((w0.start + i) * dims[1] + w1.start) * dims[2] + w2.start..];
        v2.forward.times_rows(slab, w1.len(), dims[2], target(by_value, 0, n2), false);
        g2.forward.times_rows(slab, w1.len(), dims[2], target(by_slope, 0, n2), false);
        let [value, second, third] = out;
        v1.forward.times(by_value, n2, value, false);
        g1.forward.times(by_value, n2, second, false);
        v1.forward.times(by_slope, n2, third, false);
    }
}

/// Potentials whose gradients are the fields.
pub(crate) struct Potentials<'p> {
    /// The functions at the points where the gradients are wanted.
    pub(crate) functions: &'p Functions,
    /// Coefficients of each potential.
    pub(crate) coefficients: &'p [&'p [f64]],
    /// Dimensions of the arrays of coefficients.
    pub(crate) dims: Dims,
}

impl Fields for Potentials<'_> {
    fn count(&self) -> usize {
        self.coefficients.len()
    }

    fn across(&self, field: usize, element: usize, components: &mut [Vec<f64>; 3]) {
        let OfElement { functions, .. } = &self.functions.first[element];
        let [_, n1, n2] = self.functions.counts;
        let size = functions.len() * n1 * n2;
        let [value, second, third] = components.each_mut().map(|buffer| at_least(buffer, size));
        let mut between = Between::default();
        let slabs = value.chunks_exact_mut(n1 * n2).zip(second.chunks_exact_mut(n1 * n2));
        for ((i, third), (value, second)) in functions.clone().zip(third.chunks_exact_mut(n1 * n2)).zip(slabs)
        {
            let out = [value, second, third];
            self.functions.of_slab(self.coefficients[field], self.dims, i, &mut between, out);
        }
    }

    fn along(&self, element: usize) -> [Option<&Dense<f64>>; 3] {
        let OfElement { value, slope, .. } = &self.functions.first[element];
        [Some(slope), Some(value), Some(value)]
    }
}

/// Gradients at the points of a [`Metric`].
#[derive(Debug)]
pub(crate) struct Gradients {
    metric: Metric,
    functions: Functions,
}

/// Working memory of products with the operator, reused: arrays at points of the second and the third axis,
/// for functions of the first.
#[derive(Debug, Default)]
pub(crate) struct Work([Vec<f64>; 3]);

/// Approximate number of points of the second and the third axis that products treat at a time, for all of
/// the first: their data stays in cache. Tuned: `time elastocap run cases/comb-in-layer.toml`.
const AT_ONCE: usize = 512;

/// Working memory for one element of the first axis, by component of the gradient.
#[derive(Default)]
struct OnElement {
    /// Rows of the element's functions.
    rows: [Vec<f64>; 3],
    /// Rows of the previous element's functions.
    rows_before: [Vec<f64>; 3],
    /// Gradients at the element's points, then their products with the tensors.
    flux: [Vec<f64>; 3],
    /// Those products, tested with the element's functions.
    images: [Vec<f64>; 3],
}

impl Gradients {
    /// Gradients at `extra` more Gauss points on each element than its degree; `None` where the map changes
    /// nothing.
    ///
    /// # Errors
    /// A map that turns space inside out.
    pub(crate) fn new(domain: &Domain, extra: usize) -> Result<Option<Self>, SolveError> {
        let Some(metric) = Metric::new(domain, extra, TensorKind::Permittivity)? else { return Ok(None) };
        let functions = Functions::new(domain, &metric.points);
        Ok(Some(Self { metric, functions }))
    }

    /// The points, and the tensors there.
    pub(crate) fn metric(&self) -> &Metric {
        &self.metric
    }

    /// See [`Metric::largest`].
    pub(crate) fn largest(&self) -> f64 {
        self.metric.largest
    }

    /// `y += A x` for the part that the map adds.
    pub(crate) fn add_product(&self, x: &[f64], y: &mut [f64], dims: Dims, work: &mut Work) {
        let Functions {
            window: [w0, w1, w2], counts: [_, n1, n2], values: [v1, v2], slopes: [g1, g2], ..
        } = &self.functions;
        let plane = n1 * n2;
        let Work(middle) = work;
        middle.iter_mut().for_each(|array| sized(array, w0.len() * plane));
        let [value, second, third] = &mut *middle;
        // Slab by slab, so that the results between the second and the third axis stay in cache.
        value
            .par_chunks_mut(plane)
            .zip(second.par_chunks_mut(plane))
            .zip(third.par_chunks_mut(plane))
            .enumerate()
            .for_each_init(Between::default, |between, (i, ((value, second), third))| {
                self.functions.of_slab(x, dims, i, between, [value, second, third]);
            });
        let at_once = (AT_ONCE / n2).max(1);
        columns(middle, plane, at_once * n2).into_par_iter().enumerate().for_each_init(
            OnElement::default,
            |work, (piece, columns)| {
                let lines = piece * at_once..(*n1).min((piece + 1) * at_once);
                self.on_columns(&lines, columns, work);
            },
        );
        let [value, second, third] = &*middle;
        let slabs = &mut y[w0.start * dims[1] * dims[2]..w0.end * dims[1] * dims[2]];
        slabs.par_chunks_mut(dims[1] * dims[2]).enumerate().for_each_init(
            || [vec![0.0; w1.len() * n2], vec![0.0; w1.len() * n2]],
            |[by_value, by_slope], (i, slab)| {
                let range = i * plane..(i + 1) * plane;
                let [value, second, third] = [value, second, third].map(|array| &array[range.clone()]);
                v1.back.times(value, *n2, by_value, false);
                g1.back.times(second, *n2, by_value, true);
                v1.back.times(third, *n2, by_slope, false);
                let mut add_rows = |matrix: &Strips, from: &[f64]| {
                    let to = target(slab, w1.start * dims[2] + w2.start, dims[2]);
                    matrix.times_rows(from, w1.len(), *n2, to, true);
                };
                add_rows(&v2.back, by_value);
                add_rows(&g2.back, by_slope);
            },
        );
    }

    /// For some lines of points along the third axis: turns the rows of the functions of the first axis into
    /// those of (K - eps) grad u, weighted and tested with the functions.
    fn on_columns(&self, lines: &Range<usize>, mut columns: [Vec<&mut [f64]>; 3], work: &mut OnElement) {
        let Metric { points, runs, tensors, .. } = &self.metric;
        let [n1, width] = [points[1].len(), lines.len() * points[2].len()];
        let of_point = n1 * runs.ranges.len();
        let mut functions_before = 0..0;
        for element in &self.functions.first {
            let OfElement { points: own_points, functions, value, slope, back: [value_back, slope_back] } =
                element;
            let OnElement { rows, rows_before, flux, images } = work;
            std::mem::swap(rows, rows_before);
            for c in 0..3 {
                // Rows shared with the previous element already hold its results: their inputs are in the
                // copy made for that element.
                let rows = at_least(&mut rows[c], functions.len() * width);
                for (i, row) in functions.clone().zip(rows.chunks_exact_mut(width)) {
                    row.copy_from_slice(match i < functions_before.end {
                        true => &rows_before[c][(i - functions_before.start) * width..][..width],
                        false => &*columns[c][i],
                    });
                }
                let flux = at_least(&mut flux[c], own_points.len() * width);
                let matrix = if c == 0 { slope } else { value };
                multiply(matrix.left(), right(rows, 0, width, width), target(flux, 0, width), false);
            }
            let tensors = &tensors[own_points.start * of_point..own_points.end * of_point];
            let [x, y, z] = flux.each_mut().map(|component| &mut component[..own_points.len() * width]);
            runs.weigh(tensors, n1, lines, &points[2].weights, [x, y, z]);
            for c in 0..3 {
                let images = at_least(&mut images[c], functions.len() * width);
                let matrix = if c == 0 { slope_back } else { value_back };
                multiply(matrix.left(), right(&flux[c], 0, width, width), target(images, 0, width), false);
                for (i, image) in functions.clone().zip(images.chunks_exact(width)) {
                    match i < functions_before.end {
                        true => columns[c][i].iter_mut().zip(image).for_each(|(x, more)| *x += more),
                        false => columns[c][i].copy_from_slice(image),
                    }
                }
            }
            functions_before = functions.clone();
        }
    }

    /// The energies that the map adds to those of potentials, by the quadrature of these points.
    ///
    /// # Errors
    /// As for [`products`].
    pub(crate) fn energies(&self, potentials: &[Vec<f64>], dims: Dims) -> Result<Mat<f64>, SolveError> {
        let coefficients: Vec<&[f64]> = potentials.iter().map(Vec::as_slice).collect();
        let fields = Potentials { functions: &self.functions, coefficients: &coefficients, dims };
        Ok(products(Tensors::Kept(&self.metric), &fields)?.0)
    }
}

/// Cuts arrays of rows of equal length into pieces of `columns` columns: for each piece the part of every
/// row, by array.
fn columns(arrays: &mut [Vec<f64>; 3], length: usize, columns: usize) -> Vec<[Vec<&mut [f64]>; 3]> {
    let mut out: Vec<[Vec<&mut [f64]>; 3]> =
        (0..length.div_ceil(columns)).map(|_| Default::default()).collect();
    for (c, array) in arrays.iter_mut().enumerate() {
        for row in array.chunks_exact_mut(length) {
            for (out, part) in out.iter_mut().zip(row.chunks_mut(columns)) {
                out[c].push(part);
            }
        }
    }
    out
}

/// The gradients of potentials of a domain at points, by component.
pub(crate) fn gradients_at(
    domain: &Domain,
    points: &[AxisPoints; 3],
    coefficients: &[&[f64]],
) -> Vec<[Vec<f64>; 3]> {
    let functions = Functions::new(domain, points);
    at_points(points, &Potentials { functions: &functions, coefficients, dims: domain.primal_dims() })
}

/// The energies that the map of a domain adds to those of potentials, by a rule of `extra` more points on
/// each element than its degree; `None` where the map changes nothing.
///
/// # Errors
/// A map that turns space inside out.
pub(crate) fn added_energies(
    domain: &Domain,
    extra: usize,
    potentials: &[Vec<f64>],
    dims: Dims,
) -> Result<Option<Mat<f64>>, SolveError> {
    let Some(rule) = Rule::new(domain, extra, TensorKind::Permittivity) else { return Ok(None) };
    let functions = Functions::new(domain, &rule.points);
    let coefficients: Vec<&[f64]> = potentials.iter().map(Vec::as_slice).collect();
    let fields = Potentials { functions: &functions, coefficients: &coefficients, dims };
    Ok(Some(products(Tensors::Of(&rule), &fields)?.0))
}

/// Adds to energies what the map adds according to the finer of two rules. The difference of the two, with
/// the sign given, goes to the diagonal: the error of the finer rule is a small part of it.
pub(crate) fn add_with_error(matrix: &mut Mat<f64>, coarser: &Mat<f64>, finer: &Mat<f64>, sign: f64) {
    for i in 0..matrix.nrows() {
        for j in 0..matrix.ncols() {
            matrix[(i, j)] += finer[(i, j)];
            matrix[(i, i)] += sign * (finer[(i, j)] - coarser[(i, j)]).abs();
        }
    }
}
