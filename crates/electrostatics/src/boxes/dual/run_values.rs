//! The values of fluxes with unit coordinates at Gauss points of an axis.

use super::{Lines, Segment};
use crate::boxes::domain::Domain;
use crate::boxes::mapped::points::AxisPoints;
use elastocap_fem::line::Numbering;
use elastocap_fem::mixed::FluxEnd;
use elastocap_fem::tensor::Dense;
use elastocap_linalg::dense;
use faer::Mat;

/// The points that lie on a run, and the values there of the fluxes whose coordinates are unit vectors.
pub(super) struct RunValues {
    /// The number of the first of the points.
    pub(super) first: usize,
    /// The values: a row for each point, a column for each coordinate.
    pub(super) matrix: Dense<f64>,
}

impl Lines {
    /// For each segment of an axis, the values at `points` of fluxes with unit coordinates.
    pub(super) fn values_at(&self, domain: &Domain, a: usize, points: &AxisPoints) -> Vec<RunValues> {
        let axis = &domain.axes[a];
        let numbering = Numbering::new(&axis.line);
        let [functions, _] = points.all_functions(axis, 0..numbering.len);
        let run_values = |segment: &Segment| {
            let [lo, hi] = segment.intervals;
            let elements = axis.cuts[lo]..axis.cuts[hi];
            let first = points.element.partition_point(|e| *e < elements.start);
            let end = points.element.partition_point(|e| *e < elements.end);
            let blocked = usize::from(segment.ends[0] == FluxEnd::Blocked);
            let from = numbering.vertex[axis.cuts[lo]] + blocked;
            let none = Mat::zeros(0, 0);
            let coefficients = segment.coefficients.as_ref().unwrap_or(&none);
            let n = coefficients.nrows();
            let values = functions.as_ref().submatrix(first, from, end - first, n);
            let product = dense::product(values, coefficients.as_ref());
            RunValues { first, matrix: Dense::from_mat(product.as_ref()) }
        };
        self.segments[a].iter().map(run_values).collect()
    }
}
