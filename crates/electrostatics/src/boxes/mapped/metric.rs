//! The effect of the map of a domain on energies: in the coordinates of the boxes the permittivity eps
//! becomes the tensor K = eps J F^-1 F^-T, with F the gradient of the map and J its determinant.

use super::points::AxisPoints;
use super::runs::Runs;
use crate::boxes::domain::{Axis, Block, Domain};
use crate::boxes::scene_map::MapGradients;
use crate::boxes::tensor::{Symmetric, adjugate, scaled, times, transposed};
use crate::error::SolveError;
use elastocap_linalg::vector::dot;
use rayon::prelude::*;
use std::ops::Range;

/// Rows of points, along the third axis, that one thread takes at a time. Tuned:
/// `time elastocap run cases/comb-in-layer.toml`.
const ROWS_AT_ONCE: usize = 32;

/// The tensor that a [`Metric`] holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum TensorKind {
    /// K - eps, for potentials.
    Permittivity,
    /// K^-1 - 1 / eps, for fluxes.
    Resistance,
}

/// Gauss points where the map is not the identity.
pub(crate) struct Rule<'d> {
    domain: &'d Domain,
    kind: TensorKind,
    /// The points of each axis.
    pub(crate) points: [AxisPoints; 3],
    /// Runs of points of the third axis with the same tensor.
    pub(crate) runs: Runs,
    /// Gradients of the map at the points of the first two axes and at one point of each run.
    gradients: MapGradients<'d>,
    /// Whether each cell lies in a conductor.
    held: Vec<bool>,
}

impl<'d> Rule<'d> {
    /// The rule with `extra` more points on each element than its degree; `None` where the map changes
    /// nothing.
    pub(crate) fn new(domain: &'d Domain, extra: usize, kind: TensorKind) -> Option<Self> {
        let map = domain.map.as_ref()?;
        let points = [0, 1, 2].map(|a| {
            let axis = &domain.axes[a];
            AxisPoints::new(axis, bent(axis, |x| map.reaches(a, x)), extra)
        });
        if points.iter().any(|points| points.len() == 0) {
            return None;
        }
        let runs = Runs::new(map, &points[2]);
        let mut places = points.each_ref().map(|p| p.places.clone());
        places[2] = runs.ranges.iter().map(|run| points[2].places[run.start]).collect();
        let gradients = map.gradients(&places);
        Some(Self { domain, kind, points, runs, gradients, held: held(domain) })
    }

    /// Number of tensors for one place on the first axis.
    pub(crate) fn plane(&self) -> usize {
        self.points[1].len() * self.runs.ranges.len()
    }

    /// The tensor for each point of the second axis and each run of the third, `[j][run]`, times the weights
    /// of the first two axes, for one place on the first axis; zero in conductors. Returns an upper bound on
    /// the eigenvalues of eps K^-1 at these points, at least 1.
    ///
    /// # Errors
    /// A map that turns space inside out.
    pub(crate) fn slab(&self, i: usize, tensors: &mut [Symmetric]) -> Result<f64, SolveError> {
        let (runs, cells) = (&self.runs.ranges, self.domain.cells());
        let [first, second, third] = &self.points;
        let gradients = self.gradients.slab(i);
        let mut largest: f64 = 1.0;
        let rows = tensors.chunks_exact_mut(runs.len()).zip(gradients.chunks_exact(runs.len()));
        for (j, (tensors, gradients)) in rows.enumerate() {
            let weight = first.weights[i] * second.weights[j];
            let row = (first.interval[i] * cells[1] + second.interval[j]) * cells[2];
            for ((tensor, f), run) in tensors.iter_mut().zip(gradients).zip(runs) {
                let cell = row + third.interval[run.start];
                if self.held[cell] {
                    *tensor = [0.0; 6];
                    continue;
                }
                let (unweighted, stretch) = tensor_of(f, self.kind).ok_or(SolveError::InsideOut)?;
                let eps = self.domain.permittivity[cell];
                let scale = match self.kind {
                    TensorKind::Permittivity => weight * eps,
                    TensorKind::Resistance => weight / eps,
                };
                *tensor = scaled(scale, &unweighted);
                largest = largest.max(stretch);
            }
        }
        Ok(largest)
    }
}

/// Tensors at Gauss points where the map is not the identity.
#[derive(Debug)]
pub(crate) struct Metric {
    /// The points of each axis.
    pub(crate) points: [AxisPoints; 3],
    /// Runs of points of the third axis with the same tensor.
    pub(crate) runs: Runs,
    /// The tensors that [`Rule::slab`] gives for each place on the first axis: `[i][j][run]`.
    pub(crate) tensors: Vec<Symmetric>,
    /// An upper bound on the eigenvalues of eps K^-1 at all points, at least 1.
    pub(crate) largest: f64,
}

impl Metric {
    /// The tensors with `extra` more points on each element than its degree; `None` where the map changes
    /// nothing.
    ///
    /// # Errors
    /// A map that turns space inside out.
    pub(crate) fn new(domain: &Domain, extra: usize, kind: TensorKind) -> Result<Option<Self>, SolveError> {
        let Some(rule) = Rule::new(domain, extra, kind) else { return Ok(None) };
        let plane = rule.plane();
        let mut tensors = vec![[0.0; 6]; rule.points[0].len() * plane];
        // Slab by slab, so that gradients of the map never take more memory than the tensors.
        let slabs = tensors.par_chunks_mut(plane).enumerate();
        let largest: Vec<f64> = slabs.map(|(i, slab)| rule.slab(i, slab)).collect::<Result<_, _>>()?;
        let largest = largest.into_iter().fold(1.0, f64::max);
        Ok(Some(Self { points: rule.points, runs: rule.runs, tensors, largest }))
    }

    /// Weight times the tensor at a point, if there is such a point.
    pub(crate) fn tensor_at(&self, [i, j, k]: [usize; 3]) -> Option<Symmetric> {
        let weight = self.points[2].weights.get(k)?;
        let row = i * self.points[1].len() + j;
        let tensor = self.tensors.get(row * self.runs.ranges.len() + self.runs.run_of(k))?;
        Some(scaled(*weight, tensor))
    }

    /// The weighted sum of x K y over all points.
    pub(crate) fn product(&self, x: &[Vec<f64>; 3], y: &[Vec<f64>; 3]) -> f64 {
        let (n2, count) = (self.points[2].len(), self.runs.ranges.len());
        let weights = &self.points[2].weights;
        // Pieces of a fixed length, added in order: the sum does not depend on the number of threads.
        let pieces: Vec<f64> = self
            .tensors
            .par_chunks((ROWS_AT_ONCE * count).max(1))
            .enumerate()
            .map(|(piece, tensors)| {
                let row = |(n, tensors): (usize, &[Symmetric])| {
                    let first = (piece * ROWS_AT_ONCE + n) * n2;
                    let over_run = |(run, k): (&Range<usize>, &Symmetric)| {
                        let at_point = |n: usize| {
                            let (x, y) =
                                ([0, 1, 2].map(|a| x[a][first + n]), [0, 1, 2].map(|a| y[a][first + n]));
                            let image = times(k, y);
                            weights[n] * (x[0] * image[0] + x[1] * image[1] + x[2] * image[2])
                        };
                        run.clone().map(at_point).sum::<f64>()
                    };
                    self.runs.ranges.iter().zip(tensors).map(over_run).sum::<f64>()
                };
                tensors.chunks_exact(count.max(1)).enumerate().map(row).sum()
            })
            .collect();
        pieces.iter().sum()
    }

    /// An upper bound on the eigenvalues of eps K^-1 at the points outside a block, at least 1. The tensors
    /// must be those of [`TensorKind::Resistance`].
    pub(crate) fn largest_outside(&self, domain: &Domain, block: &Block) -> f64 {
        let (n1, runs) = (self.points[1].len(), &self.runs.ranges);
        let trace = |(index, tensor): (usize, &Symmetric)| {
            let row = index / runs.len();
            let point = [row / n1, row % n1, runs[index % runs.len()].start];
            let cell = [0, 1, 2].map(|a| self.points[a].interval[point[a]]);
            if (0..3).all(|a| block.lo[a] <= cell[a] && cell[a] < block.hi[a]) {
                return 1.0;
            }
            let weight: f64 = (0..2).map(|a| self.points[a].weights[point[a]]).product();
            3.0 + (tensor[0] + tensor[1] + tensor[2]) * domain.permittivity_of(cell) / weight
        };
        self.tensors.par_iter().enumerate().map(trace).reduce(|| 1.0, f64::max)
    }
}

/// The tensor for unit permittivity, less the identity, of a map with gradient `f`; and the trace of K^-1,
/// which is at least its largest eigenvalue. `None` if the map turns space inside out.
///
/// This is called for millions of points and written out by hand: whether the compiler inlines closures over
/// indices depends on code elsewhere.
#[inline]
fn tensor_of(f: &[[f64; 3]; 3], kind: TensorKind) -> Option<(Symmetric, f64)> {
    let (adjugate, volume) = adjugate(f);
    if volume.is_nan() || volume <= 0.0 {
        return None;
    }
    let columns = transposed(f);
    let rows = match kind {
        TensorKind::Permittivity => adjugate,
        TensorKind::Resistance => columns,
    };
    let [a, b, c] = rows;
    let tensor = [
        dot(a, a) / volume - 1.0,
        dot(b, b) / volume - 1.0,
        dot(c, c) / volume - 1.0,
        dot(a, b) / volume,
        dot(a, c) / volume,
        dot(b, c) / volume,
    ];
    let [x, y, z] = columns;
    Some((tensor, dot(x, x) / volume + dot(y, y) / volume + dot(z, z) / volume))
}

/// The range of finite elements of an axis from the first to the last whose middle fulfils a condition.
fn bent(axis: &Axis, reaches: impl Fn(f64) -> bool) -> Range<usize> {
    let line = &axis.line;
    let first = line.first_finite();
    let middle = |e: usize| 0.5 * (line.nodes[e - first] + line.nodes[e - first + 1]);
    let mut elements = (first..first + line.degrees.len()).filter(|e| reaches(middle(*e)));
    match elements.next() {
        Some(low) => low..elements.next_back().unwrap_or(low) + 1,
        None => first..first,
    }
}

/// Which cells of intervals lie in conductors.
pub(crate) fn held(domain: &Domain) -> Vec<bool> {
    let cells = domain.cells();
    let mut out = vec![false; cells.iter().product()];
    for block in &domain.conductors {
        for i in block.lo[0]..block.hi[0] {
            for j in block.lo[1]..block.hi[1] {
                let row = (i * cells[1] + j) * cells[2];
                out[row + block.lo[2]..row + block.hi[2]].fill(true);
            }
        }
    }
    out
}
