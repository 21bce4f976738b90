//! Runs of points of the third axis over which the tensors of a map do not change. A layer in plane strain is
//! bent in the same way all along that axis: then a few tensors serve for hundreds of points.

use super::points::AxisPoints;
use crate::boxes::placed_map::PlacedMap;
use crate::boxes::tensor::{Symmetric, times};
use std::ops::Range;

/// Consecutive points of the third axis, in runs over which the gradient of a map does not change, within one
/// interval each.
#[derive(Debug)]
pub(crate) struct Runs {
    /// The points of each run.
    pub(crate) ranges: Vec<Range<usize>>,
    /// The run of each point.
    run_of_point: Vec<usize>,
}

impl Runs {
    /// The runs of points of the third axis under a map.
    pub(crate) fn new(map: &PlacedMap, points: &AxisPoints) -> Self {
        let pieces = map.steady_pieces(&points.places);
        let (mut ranges, mut run_of_point) = (Vec::<Range<usize>>::new(), Vec::new());
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
            run_of_point.push(ranges.len() - 1);
        }
        Self { ranges, run_of_point }
    }

    /// The run of a point.
    pub(crate) fn run_of(&self, point: usize) -> usize {
        self.run_of_point[point]
    }

    /// Multiplies fields at points by the tensors and the weights of the third axis. The points are those of
    /// some places on the first axis, of `lines` of the second, and of the third axis; the tensors are those
    /// of the same places and of all `count` points of the second axis.
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

#[cfg(test)]
mod tests {
    use crate::boxes::dual::mapped::tests::{map, scene, solved};
    use crate::boxes::grid_problem::GridProblem;
    use crate::boxes::mapped::gradients::EXTRA;
    use crate::boxes::mapped::metric::{Metric, TensorKind};
    use crate::boxes::one_grid::Lower;
    use crate::boxes::scene_map::SceneMap;
    use crate::solution::Settings;
    use std::sync::Arc;

    #[test]
    fn a_map_that_is_the_same_all_along_the_third_axis_has_a_few_tensors_for_all_points() {
        let steady = map();
        // The same but for a change along the third axis that is more than rounding.
        let other = Arc::new(SceneMap::new(steady.axes().clone(), |x| {
            let to = steady.image(x);
            [to[0] - x[0] + 1e-9 * x[2], to[1] - x[1], to[2] - x[2]]
        }));
        let settings = Settings::default();
        let metric = |map: &Arc<SceneMap>| {
            let problem = GridProblem::new(&scene(), Some(map), None, &settings).unwrap();
            let outcome = solved(&problem, 4, Lower::None);
            Metric::new(&outcome.solved[0].1.domain, EXTRA, TensorKind::Permittivity).unwrap().unwrap()
        };
        let (few, all) = (metric(&steady), metric(&other));
        let [n0, n1, n2] = few.points.each_ref().map(|points| points.len());
        assert_eq!(all.runs.ranges.len(), n2);
        assert!(3 * few.runs.ranges.len() < n2, "{:?}", few.runs.ranges);
        let largest = all.tensors.iter().flatten().fold(0.0_f64, |m, t| m.max(t.abs()));
        for at in (0..n0 * n1 * n2).map(|at| [at / (n1 * n2), at / n2 % n1, at % n2]) {
            let ([x, y], weight) =
                ([&few, &all].map(|m| m.tensor_at(at).unwrap()), few.points[2].weights[at[2]]);
            assert!(x.iter().zip(y).all(|(x, y)| (x - y).abs() < 1e-6 * weight * largest), "{x:?} {y:?}");
        }
    }
}
