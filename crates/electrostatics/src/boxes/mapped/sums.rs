//! Fields at Gauss points, and integrals of two of them with a tensor between them, element by element of the
//! first axis. The integrals never hold fields at all points at once: such arrays are larger than those of
//! the unknowns.

use super::metric::{Metric, Rule};
use super::points::AxisPoints;
use super::pool::Pool;
use super::runs::Runs;
use crate::boxes::tensor::Symmetric;
use crate::error::SolveError;
use elastocap_fem::tensor::{Dense, dot, multiply, right, target};
use faer::Mat;
use rayon::prelude::*;
use std::ops::Range;

/// Approximate number of points of the second and the third axis that are treated together, for all points of
/// an element of the first: their data stays in cache. Tuned: `time elastocap run cases/comb-in-layer.toml`.
const TOGETHER: usize = 1024;

/// Largest number of fields in each of the two blocks of fields that are held at a time. All of many fields
/// would take, on many threads, more memory than the unknowns.
const HELD: usize = 8;

/// Fields with three components that are wanted at Gauss points.
pub(crate) trait Fields: Sync {
    /// Number of fields.
    fn count(&self) -> usize;

    /// The components of one field at the points of the second and the third axis, `[row][j][k]`.
    /// [`Fields::along`] takes the rows to the points of an element of the first axis.
    fn across(&self, field: usize, element: usize, components: &mut [Vec<f64>; 3]);

    /// For each component the matrix from these rows to the points of the element; `None` where the rows are
    /// those of the points.
    fn along(&self, element: usize) -> [Option<&Dense<f64>>; 3];
}

/// The weighted tensors at points.
#[derive(Clone, Copy)]
pub(crate) enum Tensors<'t> {
    /// Computed before.
    Kept(&'t Metric),
    /// Computed where they are needed.
    Of(&'t Rule<'t>),
}

impl Tensors<'_> {
    fn points(&self) -> &[AxisPoints; 3] {
        match self {
            Self::Kept(metric) => &metric.points,
            Self::Of(rule) => &rule.points,
        }
    }

    fn runs(&self) -> &Runs {
        match self {
            Self::Kept(metric) => &metric.runs,
            Self::Of(rule) => &rule.runs,
        }
    }
}

/// Working memory of one thread, kept from one element to the next.
#[derive(Default)]
struct Work {
    /// Tensors that are computed where they are needed.
    tensors: Vec<Symmetric>,
    /// The components of each field that is held, in the rows of [`Fields::across`].
    across: Vec<[Vec<f64>; 3]>,
    /// The values of one field after the other, by component, at the points of an element that are looked at
    /// together.
    values: Vec<f64>,
    /// The weighted tensors times the values of one field at these points.
    images: Vec<f64>,
}

/// The components of all fields at all points.
pub(crate) fn at_points(points: &[AxisPoints; 3], fields: &impl Fields) -> Vec<[Vec<f64>; 3]> {
    let elements = points[0].by_element();
    let plane = points[1].len() * points[2].len();
    let pool = Pool::default();
    let of_field = |field: usize| {
        let mut out = [0; 3].map(|_| vec![0.0; points[0].len() * plane]);
        let parts = by_element(&mut out, elements.iter().map(|range| [range.len() * plane; 3]));
        parts.into_par_iter().enumerate().for_each(|(element, parts)| {
            pool.with(|across: &mut [Vec<f64>; 3]| {
                fields.across(field, element, across);
                for ((rows, matrix), to) in across.iter().zip(fields.along(element)).zip(parts) {
                    to_points(rows, matrix, plane, 0..plane, to);
                }
            });
        });
        out
    };
    (0..fields.count()).map(of_field).collect()
}

/// Three arrays cut in the parts of one element after the other, which have these `lengths`.
pub(crate) fn by_element(
    arrays: &mut [Vec<f64>; 3],
    lengths: impl Iterator<Item = [usize; 3]>,
) -> Vec<[&mut [f64]; 3]> {
    let mut rest = arrays.each_mut().map(Vec::as_mut_slice);
    let mut cut = |c: usize, length: usize| {
        let (part, after) = std::mem::take(&mut rest[c]).split_at_mut(length);
        rest[c] = after;
        part
    };
    lengths.map(|[a, b, c]| [cut(0, a), cut(1, b), cut(2, c)]).collect()
}

/// Takes rows of [`Fields::across`] to the points of an element, for the `chosen` ones of the `plane` points
/// of the second and the third axis, and writes the result.
fn to_points(rows: &[f64], matrix: Option<&Dense<f64>>, plane: usize, chosen: Range<usize>, to: &mut [f64]) {
    let width = chosen.len();
    match matrix {
        Some(matrix) => {
            multiply(matrix.left(), right(rows, chosen.start, width, plane), target(to, 0, width), false);
        }
        None => {
            for (row, to) in to.chunks_exact_mut(width).enumerate() {
                to.copy_from_slice(&rows[row * plane + chosen.start..][..width]);
            }
        }
    }
}

/// The sums of x T y over all points for all pairs of fields, and the upper bound on the eigenvalues of eps
/// K^-1 of [`Metric::largest`].
///
/// # Errors
/// A map that turns space inside out.
pub(crate) fn products(tensors: Tensors<'_>, fields: &impl Fields) -> Result<(Mat<f64>, f64), SolveError> {
    let elements = tensors.points()[0].by_element();
    let pool = Pool::<Work>::default();
    // Added in order: the sum does not depend on the number of threads.
    let parts: Vec<(Mat<f64>, f64)> = elements
        .par_iter()
        .enumerate()
        .map(|(element, points)| pool.with(|work| of_element(tensors, fields, element, points, work)))
        .collect::<Result<_, _>>()?;
    let (mut sum, mut largest) = (Mat::zeros(fields.count(), fields.count()), 1.0_f64);
    for (part, part_largest) in parts {
        sum += part;
        largest = largest.max(part_largest);
    }
    Ok((sum, largest))
}

/// What one element of the first axis, which has these points, contributes to [`products`].
fn of_element(
    tensors: Tensors<'_>,
    fields: &impl Fields,
    element: usize,
    points: &Range<usize>,
    work: &mut Work,
) -> Result<(Mat<f64>, f64), SolveError> {
    let [_, n1, n2] = tensors.points().each_ref().map(AxisPoints::len);
    let (runs, weights) = (tensors.runs(), &tensors.points()[2].weights);
    let (plane, run_count) = (n1 * n2, runs.ranges.len());
    let (n, count) = (fields.count(), points.len());
    let Work { tensors: computed, across, values, images } = work;
    let (tensors, largest) = match tensors {
        Tensors::Kept(metric) => {
            (&metric.tensors[points.start * n1 * run_count..points.end * n1 * run_count], metric.largest)
        }
        Tensors::Of(rule) => {
            let slabs = at_least(computed, count * n1 * run_count);
            let mut largest = 1.0_f64;
            for (i, slab) in points.clone().zip(slabs.chunks_exact_mut(n1 * run_count)) {
                largest = largest.max(rule.slab(i, slab)?);
            }
            (&*slabs, largest)
        }
    };
    let along = fields.along(element);
    let mut out = Mat::zeros(n, n);
    let blocks: Vec<Range<usize>> = (0..n).step_by(HELD).map(|first| first..n.min(first + HELD)).collect();
    for (block_number, first) in blocks.iter().enumerate() {
        for second in &blocks[block_number..] {
            let held: Vec<usize> = if first == second {
                first.clone().collect()
            } else {
                first.clone().chain(second.clone()).collect()
            };
            across.resize_with(across.len().max(held.len()), Default::default);
            for (field, components) in held.iter().zip(across.iter_mut()) {
                fields.across(*field, element, components);
            }
            let at_once = (TOGETHER / n2.max(1)).max(1);
            for from in (0..n1).step_by(at_once) {
                let lines = from..n1.min(from + at_once);
                let chosen = lines.start * n2..lines.end * n2;
                let size = count * chosen.len();
                let values = at_least(values, 3 * held.len() * size);
                for (components, to) in across.iter().zip(values.chunks_exact_mut(3 * size)) {
                    for ((rows, matrix), to) in components.iter().zip(along).zip(to.chunks_exact_mut(size)) {
                        to_points(rows, matrix, plane, chosen.clone(), to);
                    }
                }
                let images = at_least(images, 3 * size);
                let values_of = |place: usize| &values[3 * place * size..3 * (place + 1) * size];
                for (place, &j) in held.iter().enumerate().filter(|(_, j)| second.contains(j)) {
                    images.copy_from_slice(values_of(place));
                    let (x, rest) = images.split_at_mut(size);
                    let (y, z) = rest.split_at_mut(size);
                    runs.weigh(tensors, n1, &lines, weights, [x, y, z]);
                    let others = held.iter().enumerate().filter(|(_, i)| first.contains(i) && **i <= j);
                    for (other, &i) in others {
                        out[(i, j)] += dot(values_of(other), images);
                    }
                }
            }
        }
    }
    for j in 0..n {
        (0..j).for_each(|i| out[(j, i)] = out[(i, j)]);
    }
    Ok((out, largest))
}

/// The first entries of a buffer, made longer where it is too short.
pub(crate) fn at_least<T: Copy + Default>(buffer: &mut Vec<T>, len: usize) -> &mut [T] {
    if buffer.len() < len {
        buffer.resize(len, T::default());
    }
    &mut buffer[..len]
}
