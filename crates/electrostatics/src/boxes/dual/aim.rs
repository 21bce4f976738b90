//! The flux that the lower bound under a map approximates: that of the primal solution.

use super::{Dual, reflection};
use crate::boxes::domain::Domain;
use crate::boxes::half_turn::images::Image;
use crate::boxes::mapped::gradients::{EXTRA, Functions, Gradients, Potentials};
use crate::boxes::mapped::metric::Metric;
use crate::boxes::mapped::points::AxisPoints;
use crate::boxes::mapped::pool::Pool;
use crate::boxes::mapped::sums::{Fields, at_least, by_element};
use crate::boxes::tensor::{Symmetric, times};
use elastocap_fem::tensor::{Dense, Dims, SparseRows, Strips, multiply, right, target as to_rows};
use faer::Mat;
use rayon::prelude::*;
use std::ops::Range;

/// Potentials whose fluxes are subtracted from those that are aimed at.
#[derive(Clone, Copy)]
pub(crate) struct Less<'a> {
    /// One for each right-hand side.
    pub(crate) potentials: &'a [Vec<f64>],
    /// The permittivity that their gradients are multiplied by, in each cell.
    pub(crate) permittivity: &'a [f64],
}

impl Less<'_> {
    /// The permittivity of these potentials over that of a domain at Gauss points; `None` where both agree
    /// everywhere.
    pub(super) fn ratio(&self, domain: &Domain, points: &[AxisPoints; 3]) -> Option<Vec<f64>> {
        if self.permittivity == domain.permittivity.as_slice() {
            return None;
        }
        let cells = domain.cells();
        let [n0, n1, n2] = points.each_ref().map(AxisPoints::len);
        let places = (0..n0).flat_map(|i| (0..n1).flat_map(move |j| (0..n2).map(move |k| [i, j, k])));
        let ratio = |point: [usize; 3]| {
            let cell = [0, 1, 2].map(|a| points[a].interval[point[a]]);
            let permittivity = self.permittivity[(cell[0] * cells[1] + cell[1]) * cells[2] + cell[2]];
            permittivity / domain.permittivity_of(cell)
        };
        Some(places.map(ratio).collect())
    }
}

/// Integrals of K grad u / eps with the potential modes of the two other axes, at Gauss points along each
/// axis in turn: the target of the projection.
pub(super) struct Target {
    /// The points of each axis.
    pub(super) points: [AxisPoints; 3],
    /// An array for each component: its entries belong to points of the axis of the component and to modes of
    /// the two others.
    pub(super) parts: [Vec<f64>; 3],
}

impl Target {
    /// The target for the image of a potential, if `self` is that of the potential.
    pub(super) fn image(&self, dual: &Dual, domain: &Domain, image: &Image) -> Self {
        let counts = self.points.each_ref().map(AxisPoints::len);
        let whole = domain.truncated();
        let parts = [0, 1, 2].map(|component| {
            let mut dims = dual.lines.dims;
            dims[component] = counts[component];
            image.applied(&self.parts[component], dims, |a| {
                let n = counts[a];
                if a == component {
                    Mat::from_fn(n, n, |i, j| if i + j + 1 == n { -1.0 } else { 0.0 })
                } else {
                    reflection(&whole, &dual.lines.basis, a)
                }
            })
        });
        Self { points: self.points.clone(), parts }
    }
}

/// The target for a potential under a map, less that for another potential where one is given.
pub(super) fn target(
    domain: &Domain,
    dual: &Dual,
    less: Option<(&Less<'_>, &[f64])>,
    (u, bent): (&[f64], Option<&Gradients>),
) -> Target {
    let points = all_points(domain);
    let whole = domain.truncated();
    let modes = [0, 1, 2].map(|a| {
        let radial = dual.lines.basis[a].as_ref().map(|basis| &basis.radial);
        points[a].modes(&whole.axes[a], radial)
    });
    let back = |a: usize| Strips::new(&SparseRows::from_mat(modes[a].transpose()));
    let functions = Functions::new(domain, &points);
    let coefficients: Vec<&[f64]> = std::iter::once(u).chain(less.map(|(_, p)| p)).collect();
    let elements = points[0].by_element();
    let ranges = elements.iter().map(|range| (range.clone(), points[0].modes_on(&whole.axes[0], range)));
    let aim = Aim {
        potentials: Potentials {
            functions: &functions,
            coefficients: &coefficients,
            dims: domain.primal_dims(),
        },
        // Where the two permittivities differ, the gradient that is subtracted is scaled.
        ratio: less.and_then(|(less, _)| less.ratio(domain, &points)),
        bent: bent.map(|bent| Bent::new(bent.metric(), &points, domain)),
        back: [back(1), back(2)],
        first: ranges.map(|(range, rows)| (transposed_part(&modes[0], &range, &rows), range, rows)).collect(),
        points: &points,
    };
    let plane = |component: usize| {
        let count = |a: usize| if a == component { points[a].len() } else { dual.lines.dims[a] };
        count(1) * count(2)
    };
    let length = |component: usize| if component == 0 { points[0].len() } else { dual.lines.dims[0] };
    let mut parts = [0, 1, 2].map(|component| vec![0.0; length(component) * plane(component)]);
    let lengths = aim
        .first
        .iter()
        .map(|(_, range, rows)| [range.len() * plane(0), rows.len() * plane(1), rows.len() * plane(2)]);
    let pool = Pool::<Work>::default();
    by_element(&mut parts, lengths)
        .into_par_iter()
        .enumerate()
        .for_each(|(element, parts)| pool.with(|work| aim.of_element(element, parts, work)));
    Target { points, parts }
}

/// The data that the targets of all elements share.
struct Aim<'a> {
    /// The potential whose flux is aimed at, and the one whose flux is subtracted, if there is one.
    potentials: Potentials<'a>,
    /// The result of [`Less::ratio`].
    ratio: Option<Vec<f64>>,
    /// The points where a map bends space, if one does.
    bent: Option<Bent<'a>>,
    /// Matrices from points to potential modes of the second and the third axis.
    back: [Strips; 2],
    /// For each element of the first axis, the matrix from points to potential modes, with the element's
    /// points and modes.
    first: Vec<(Dense<f64>, Range<usize>, Range<usize>)>,
    /// The points of each axis.
    points: &'a [AxisPoints; 3],
}

/// Working memory of one thread, reused for each element.
#[derive(Default)]
struct Work {
    /// The rows of [`Fields::across`].
    across: [Vec<f64>; 3],
    /// Gradients of the first potential at points, then the flux that is aimed at.
    flux: [Vec<f64>; 3],
    /// Gradients of the potential to subtract, at points.
    less: [Vec<f64>; 3],
    /// A component for the modes of the first axis, at points of the two others.
    rows: Vec<f64>,
    /// A component for one place on the first axis, at points of the second, for modes of the third.
    half: Vec<f64>,
}

/// The points where a map bends space.
struct Bent<'a> {
    /// The tensors at these points.
    metric: &'a Metric,
    /// On each axis, the index of the first of them among all points.
    first: [usize; 3],
    /// Their numbers on each axis.
    counts: Dims,
    domain: &'a Domain,
}

impl<'a> Bent<'a> {
    fn new(metric: &'a Metric, points: &[AxisPoints; 3], domain: &'a Domain) -> Self {
        let first = [0, 1, 2].map(|a| {
            let start = metric.points[a].element.first().copied().unwrap_or(0);
            points[a].element.partition_point(|e| *e < start)
        });
        Self { metric, first, counts: metric.points.each_ref().map(AxisPoints::len), domain }
    }

    /// The weighted tensor at a point, and the permittivity there; `None` where no map bends space.
    fn tensor_at(&self, point: [usize; 3]) -> Option<(Symmetric, f64)> {
        let mut local = [0; 3];
        for a in 0..3 {
            local[a] = point[a].checked_sub(self.first[a]).filter(|k| *k < self.counts[a])?;
        }
        let cell = [0, 1, 2].map(|a| self.metric.points[a].interval[local[a]]);
        Some((self.metric.tensor_at(local)?, self.domain.permittivity_of(cell)))
    }
}

impl Aim<'_> {
    /// Writes the parts of [`Target::parts`] that belong to one element of the first axis.
    fn of_element(&self, element: usize, [first, second, third]: [&mut [f64]; 3], work: &mut Work) {
        let (transposed, range, rows) = &self.first[element];
        let [n1, n2] = [self.points[1].len(), self.points[2].len()];
        let plane = n1 * n2;
        let Work { across, flux, less, rows: of_rows, half } = work;
        let along = self.potentials.along(element);
        for (field, to) in [&mut *flux, less].into_iter().enumerate().take(self.potentials.count()) {
            self.potentials.across(field, element, across);
            for ((to, from), matrix) in to.iter_mut().zip(&*across).zip(along.into_iter().flatten()) {
                let to = to_rows(at_least(to, range.len() * plane), 0, plane);
                multiply(matrix.left(), right(from, 0, plane, plane), to, false);
            }
        }
        self.weigh(range, flux, less);
        let [modes1, modes2] = [self.back[0].rows(), self.back[1].rows()];
        let half = at_least(half, n1 * modes2);
        for (from, to) in flux[0].chunks_exact(plane).zip(first.chunks_exact_mut((modes1 * modes2).max(1))) {
            self.back[1].times_rows(from, n1, n2, to_rows(half, 0, modes2), false);
            self.back[0].times(half, modes2, to, false);
        }
        let of_rows = at_least(of_rows, rows.len() * plane);
        multiply(transposed.left(), right(&flux[1], 0, plane, plane), to_rows(of_rows, 0, plane), false);
        for (from, to) in of_rows.chunks_exact(plane).zip(second.chunks_exact_mut((n1 * modes2).max(1))) {
            self.back[1].times_rows(from, n1, n2, to_rows(to, 0, modes2), false);
        }
        multiply(transposed.left(), right(&flux[2], 0, plane, plane), to_rows(of_rows, 0, plane), false);
        for (from, to) in of_rows.chunks_exact(plane).zip(third.chunks_exact_mut((modes1 * n2).max(1))) {
            self.back[0].times(from, n2, to, false);
        }
    }

    /// Turns gradients at the points of an element into the flux that is aimed at, over the permittivity and
    /// weighted.
    fn weigh(&self, range: &Range<usize>, flux: &mut [Vec<f64>; 3], less: &[Vec<f64>; 3]) {
        let [p0, p1, p2] = self.points;
        let has_other = self.potentials.count() > 1;
        let mut index = 0;
        for i in range.clone() {
            for j in 0..p1.len() {
                let outer = p0.weights[i] * p1.weights[j];
                for (k, last) in p2.weights.iter().enumerate() {
                    let weight = outer * last;
                    let gradient = [0, 1, 2].map(|c| flux[c][index]);
                    let mut out = gradient.map(|x| weight * x);
                    if has_other {
                        let point = (i * p1.len() + j) * p2.len() + k;
                        let ratio = self.ratio.as_ref().and_then(|ratio| ratio.get(point)).unwrap_or(&1.0);
                        (0..3).for_each(|c| out[c] -= weight * ratio * less[c][index]);
                    }
                    if let Some((tensor, eps)) = self.bent.as_ref().and_then(|bent| bent.tensor_at([i, j, k]))
                    {
                        let added = times(&tensor, gradient);
                        (0..3).for_each(|c| out[c] += added[c] / eps);
                    }
                    (0..3).for_each(|c| flux[c][index] = out[c]);
                    index += 1;
                }
            }
        }
    }
}

/// The transpose of a part of a matrix.
fn transposed_part(matrix: &Mat<f64>, rows: &Range<usize>, columns: &Range<usize>) -> Dense<f64> {
    let part = matrix.as_ref().submatrix(rows.start, columns.start, rows.len(), columns.len());
    Dense::from_mat(part.transpose())
}

/// Points on all finite elements.
fn all_points(domain: &Domain) -> [AxisPoints; 3] {
    [0, 1, 2].map(|a| {
        let line = &domain.axes[a].line;
        let first = line.first_finite();
        AxisPoints::new(&domain.axes[a], first..first + line.degrees.len(), EXTRA)
    })
}
