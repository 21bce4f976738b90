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

    /// Fields at points become their images. The points are those of some places on the first axis, of `lines` of the second, and of the third
    /// axis, which have these weights; the tensors are those of the same places and of all `count` points of the second axis.
    pub(crate) fn weigh(
        &self,
        tensors: &[Symmetric],
        count: usize,
        lines: &Range<usize>,
        weights: &[f64],
        [x, y, z]: [&mut [f64]; 3],
    ) {
        let (runs, n2) = (self.ranges.len(), weights.len());
        let slabs = tensors.chunks_exact(count * runs);
        let of_lines = slabs.flat_map(|slab| slab[lines.start * runs..lines.end * runs].chunks_exact(runs));
        let fields = x.chunks_exact_mut(n2).zip(y.chunks_exact_mut(n2)).zip(z.chunks_exact_mut(n2));
        for (tensors, ((x, y), z)) in of_lines.zip(fields) {
            for (run, k) in self.ranges.iter().zip(tensors) {
                let fields = x[run.clone()].iter_mut().zip(&mut y[run.clone()]).zip(&mut z[run.clone()]);
                for (((x, y), z), weight) in fields.zip(&weights[run.clone()]) {
                    [*x, *y, *z] = times(k, [*x, *y, *z]).map(|image| weight * image);
                }
            }
        }
    }
}
