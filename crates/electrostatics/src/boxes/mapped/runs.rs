//! Runs of points of the third axis over which nothing changes that tensors depend on. A layer in plane strain is bent in the same way
//! all along that axis: then a few tensors serve for hundreds of points.

use super::metric::{Symmetric, times};
use super::placed::PlacedMap;
use super::points::AxisPoints;
use std::ops::Range;

/// Consecutive points of the third axis, in runs over which the gradient of a map does not change, within one interval each.
#[derive(Debug)]
pub(crate) struct Runs {
    pub(crate) ranges: Vec<Range<usize>>,
    /// The run of each point.
    of: Vec<usize>,
}

impl Runs {
    pub(crate) fn new(map: &PlacedMap, points: &AxisPoints) -> Self {
        let pieces = map.steady_pieces(&points.places);
        let (mut ranges, mut of) = (Vec::<Range<usize>>::new(), Vec::new());
        for (k, piece) in pieces.iter().enumerate() {
            let is_same = |last: &Range<usize>| {
                piece.is_some()
                    && pieces[last.start] == *piece
                    && points.interval[last.start] == points.interval[k]
            };
            match ranges.last_mut().filter(|last| is_same(last)) {
                Some(last) => last.end = k + 1,
                None => ranges.push(k..k + 1),
            }
            of.push(ranges.len() - 1);
        }
        Self { ranges, of }
    }

    /// The run of a point.
    pub(crate) fn of(&self, point: usize) -> usize {
        self.of[point]
    }

    /// Fields at the points of the third axis become their images under the tensors of the runs, times the weights of the points.
    pub(crate) fn weigh(&self, tensors: &[Symmetric], weights: &[f64], [x, y, z]: [&mut [f64]; 3]) {
        for (run, k) in self.ranges.iter().zip(tensors) {
            let fields = x[run.clone()].iter_mut().zip(&mut y[run.clone()]).zip(&mut z[run.clone()]);
            for (((x, y), z), weight) in fields.zip(&weights[run.clone()]) {
                [*x, *y, *z] = times(k, [*x, *y, *z]).map(|image| weight * image);
            }
        }
    }
}
