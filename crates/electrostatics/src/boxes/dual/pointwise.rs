//! Fluxes at Gauss points: all of them at once, or element by element of the first axis.

use super::flux::Flux;
use super::run_values::RunValues;
use super::{Basis, Dual, Lines, OtherLines};
use crate::boxes::domain::{Domain, OtherParts};
use crate::boxes::mapped::metric::{Rule, TensorKind};
use crate::boxes::mapped::points::AxisPoints;
use crate::boxes::mapped::sums::{Fields, Tensors, at_least, at_points, products};
use crate::error::SolveError;
use elastocap_fem::tensor::{Dense, Left, SparseRows, Strips, multiply, right, target};
use faer::Mat;
use rayon::prelude::*;
use std::ops::Range;

/// Pieces into which the points of the first axis are divided among threads. Tuned:
/// `time elastocap run cases/comb-in-layer.toml`.
const PIECES: usize = 4;

impl Lines {
    /// The component of a flux along the first axis at `count` points of that axis, for a window of the modes
    /// of the other two axes. `values` are those of the axis's segments at the points.
    fn along_first(&self, flux: &Flux, values: &[RunValues], count: usize, window: &Window) -> Vec<f64> {
        let [rows, columns] = window;
        let plane = rows.len() * columns.len();
        let mut out = vec![0.0; count * plane];
        // Few enough pieces that the flux is not read too often.
        let block = count.div_ceil(PIECES);
        out.par_chunks_mut((block * plane).max(1)).enumerate().for_each(|(piece, out)| {
            let piece_points = piece * block..piece * block + out.len() / plane;
            for ((bundle, run), y) in self.runs(0).zip(&flux.0[0]) {
                let RunValues { first, matrix } = &values[run.segment];
                let points = piece_points.start.max(*first)..piece_points.end.min(first + matrix.rows);
                if points.is_empty() {
                    continue;
                }
                let part = matrix.left_rows(points.start - first..points.end - first);
                let [lines, across] = &bundle.across;
                let shared = common(across, columns);
                if shared.is_empty() {
                    continue;
                }
                for row in common(lines, rows) {
                    let line = right(y, bundle.line(row, shared.start), shared.len(), bundle.width());
                    let start = (points.start - piece_points.start) * plane
                        + (row - rows.start) * columns.len()
                        + (shared.start - columns.start);
                    multiply(part, line, target(out, start, plane), false);
                    let root = |t: usize| self.weights.root_at([run.range.start, row, t]);
                    let roots: Vec<f64> = shared.clone().map(root).collect();
                    for line in out[start..].chunks_mut(plane).take(points.len()) {
                        line.iter_mut().zip(&roots).for_each(|(x, root)| *x *= root);
                    }
                }
            }
        });
        out
    }
}

/// Modes of the second and of the third axis.
type Window = [Range<usize>; 2];

/// The intersection of two ranges.
fn common(a: &Range<usize>, b: &Range<usize>) -> Range<usize> {
    a.start.max(b.start)..a.end.min(b.end)
}

/// Fluxes on lines at points, by component; those along the first axis are on the `other` lines, where given.
pub(super) fn fluxes_at(
    (lines, other): (&Lines, Option<&OtherLines>),
    domain: &Domain,
    points: &[AxisPoints; 3],
    fluxes: &[&Flux],
) -> Vec<[Vec<f64>; 3]> {
    at_points(points, &FluxesAt::new(lines, other, domain, points, fluxes))
}

impl OtherLines {
    /// The component of a flux along the first axis at points of that axis of a domain, for modes of the
    /// other two.
    fn component_along_first(
        &self,
        domain: &Domain,
        turn: &OtherParts,
        points: &AxisPoints,
        flux: &Flux,
    ) -> Vec<f64> {
        let all_points = points.with_mirror_image(&domain.axes[0]);
        let values = self.lines.values_at(&turn.half, 0, &all_points);
        let [_, n1, n2] = self.lines.dims;
        let on_other_half = self.lines.along_first(flux, &values, all_points.len(), &[0..n1, 0..n2]);
        let exchange = self.exchange.at_points(points.len());
        let mut out = vec![0.0; exchange.dims()[0].iter().product()];
        // A derivative along the first axis has the other parity.
        exchange.add_to_first(&on_other_half, -self.parity, &mut out);
        out
    }
}

impl Dual {
    /// The lines of the problem, as [`fluxes_at`] takes them.
    pub(super) fn all_lines(&self) -> (&Lines, Option<&OtherLines>) {
        (&self.lines, self.other.as_ref())
    }

    /// The energies that the map adds to those of fluxes, by a rule of `extra` more points on each element
    /// than its degree, and an upper bound on the eigenvalues of eps K^-1 at the points; `None` where the map
    /// changes nothing.
    pub(super) fn added_energies(
        &self,
        domain: &Domain,
        extra: usize,
        fluxes: &[&Flux],
    ) -> Result<Option<(Mat<f64>, f64)>, SolveError> {
        let Some(rule) = Rule::new(domain, extra, TensorKind::Resistance) else { return Ok(None) };
        let fluxes = FluxesAt::new(&self.lines, self.other.as_ref(), domain, &rule.points, fluxes);
        products(Tensors::Of(&rule), &fluxes).map(Some)
    }
}

/// Fluxes at points of the elements of the first axis.
struct FluxesAt<'f> {
    /// The lines of the second and the third axis.
    lines: &'f Lines,
    /// The fluxes.
    fluxes: &'f [&'f Flux],
    /// The modes of the second and the third axis that are nonzero at some of the points; on the half of a
    /// scene, all of them.
    window: Window,
    /// The component of each flux along the first axis, at the points there and for the window.
    first: Vec<Vec<f64>>,
    /// Points on the second and the third axis.
    counts: [usize; 2],
    /// For each segment of the second and of the third axis, the values at the points of the axis, and the
    /// transpose.
    values: [Vec<(RunValues, Dense<f64>)>; 2],
    /// Potential modes of the second and of the third axis, those of the window, at the points of the axis.
    modes: [Strips; 2],
    /// For each element of the first axis its points, and its potential modes there.
    elements: Vec<(Range<usize>, Range<usize>, Dense<f64>)>,
}

impl<'f> FluxesAt<'f> {
    fn new(
        lines: &'f Lines,
        other: Option<&OtherLines>,
        domain: &Domain,
        points: &[AxisPoints; 3],
        fluxes: &'f [&'f Flux],
    ) -> Self {
        let radial = |a: usize| lines.basis[a].as_ref().map(|basis: &Basis| &basis.radial);
        let modes = |a: usize| points[a].modes(&domain.axes[a], radial(a));
        let is_turned = other.is_some() && domain.turn.is_some();
        let window = [1, 2].map(|a| match is_turned {
            true => 0..lines.dims[a],
            false => points[a].modes_on(&domain.axes[a], &(0..points[a].len())),
        });
        let strips = |a: usize| {
            let (modes, window) = (modes(a), &window[a - 1]);
            let part = modes.as_ref().submatrix(0, window.start, modes.nrows(), window.len());
            Strips::new(&SparseRows::from_mat(part))
        };
        let first = modes(0);
        let of_element = |elements: Range<usize>| {
            let rows = points[0].modes_on(&domain.axes[0], &elements);
            let part = first.as_ref().submatrix(elements.start, rows.start, elements.len(), rows.len());
            (elements, rows, Dense::from_mat(part))
        };
        let with_transpose = |values: RunValues| {
            let transpose = values.matrix.transposed();
            (values, transpose)
        };
        let along_first = |flux: &&Flux| match (other, &domain.turn) {
            (Some(other), Some(turn)) => other.component_along_first(domain, turn, &points[0], flux),
            _ => lines.along_first(flux, &lines.values_at(domain, 0, &points[0]), points[0].len(), &window),
        };
        Self {
            lines,
            fluxes,
            first: fluxes.iter().map(along_first).collect(),
            counts: [points[1].len(), points[2].len()],
            values: [1, 2].map(|a| {
                let values = lines.values_at(domain, a, &points[a]);
                values.into_iter().map(with_transpose).collect()
            }),
            modes: [strips(1), strips(2)],
            window,
            elements: points[0].by_element().into_iter().map(of_element).collect(),
        }
    }

    /// The component of a flux along the second axis for one mode of the first, at the points of the second
    /// and for the window of the third.
    fn along_second(&self, flux: &Flux, i: usize, out: &mut [f64]) {
        let [_, window] = &self.window;
        let across = window.len();
        out.fill(0.0);
        for ((bundle, run), y) in self.lines.runs(1).zip(&flux.0[1]) {
            let [rows, columns] = &bundle.across;
            if !rows.contains(&i) {
                continue;
            }
            let (RunValues { first, matrix }, _) = &self.values[0][run.segment];
            if matrix.rows == 0 {
                continue;
            }
            let shared = common(columns, window);
            if shared.is_empty() {
                continue;
            }
            let (width, from) = (bundle.width(), bundle.line(i, shared.start));
            let start = first * across + shared.start - window.start;
            multiply(matrix.left(), right(y, from, shared.len(), width), target(out, start, across), false);
            let roots: Vec<f64> =
                shared.clone().map(|t| self.lines.weights.root_at([i, run.range.start, t])).collect();
            for row in out[start..].chunks_mut(across).take(matrix.rows) {
                row.iter_mut().zip(&roots).for_each(|(x, root)| *x *= root);
            }
        }
    }

    /// The component of a flux along the third axis for one mode of the first, for the window of the second
    /// and at the points of the third.
    fn along_third(&self, flux: &Flux, i: usize, out: &mut [f64]) {
        let [window, _] = &self.window;
        let across = self.counts[1];
        out.fill(0.0);
        for ((bundle, run), y) in self.lines.runs(2).zip(&flux.0[2]) {
            let [rows, columns] = &bundle.across;
            if !rows.contains(&i) {
                continue;
            }
            let (RunValues { first, .. }, transpose) = &self.values[1][run.segment];
            if transpose.cols == 0 {
                continue;
            }
            let shared = common(columns, window);
            if shared.is_empty() {
                continue;
            }
            let (width, from) = (bundle.width(), bundle.line(i, shared.start));
            let lines =
                Left { data: &y[from..], rows: shared.len(), cols: transpose.rows, row: 1, col: width };
            let start = (shared.start - window.start) * across + first;
            multiply(lines, transpose.right(), target(out, start, across), false);
            for j in shared {
                let root = self.lines.weights.root_at([i, j, run.range.start]);
                let start = (j - window.start) * across + first;
                out[start..start + transpose.cols].iter_mut().for_each(|x| *x *= root);
            }
        }
    }
}

impl Fields for FluxesAt<'_> {
    fn count(&self) -> usize {
        self.fluxes.len()
    }

    fn across(&self, field: usize, element: usize, components: &mut [Vec<f64>; 3]) {
        let (flux, (points, rows, _)) = (self.fluxes[field], &self.elements[element]);
        let ([d1, d2], [n1, n2]) = (self.window.each_ref().map(Range::len), self.counts);
        let plane = n1 * n2;
        let [first, second, third] = components;
        let slabs_along_first = &self.first[field][points.start * d1 * d2..points.end * d1 * d2];
        let mut half = vec![0.0; d1 * n2];
        let slabs = at_least(first, points.len() * plane).chunks_exact_mut(plane);
        for (slab, to) in slabs_along_first.chunks_exact((d1 * d2).max(1)).zip(slabs) {
            self.modes[1].times_rows(slab, d1, d2, target(&mut half, 0, n2), false);
            self.modes[0].times(&half, n2, to, false);
        }
        let mut between = vec![0.0; n1 * d2];
        let slabs = at_least(second, rows.len() * plane).chunks_exact_mut(plane);
        for (i, to) in rows.clone().zip(slabs) {
            self.along_second(flux, i, &mut between);
            self.modes[1].times_rows(&between, n1, d2, target(to, 0, n2), false);
        }
        let slabs = at_least(third, rows.len() * plane).chunks_exact_mut(plane);
        for (i, to) in rows.clone().zip(slabs) {
            self.along_third(flux, i, &mut half);
            self.modes[0].times(&half, n2, to, false);
        }
    }

    fn along(&self, element: usize) -> [Option<&Dense<f64>>; 3] {
        let (_, _, modes) = &self.elements[element];
        [None, Some(modes), Some(modes)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::boxes::dual::aim::target;
    use crate::boxes::dual::mapped::tests::{boxed, map, scene, solved};
    use crate::boxes::dual::mapped::{Projected, Solved, project};
    use crate::boxes::dual::superposed::Weights;
    use crate::boxes::grid_problem::GridProblem;
    use crate::boxes::half_turn::images::images;
    use crate::boxes::mapped::gradients::{EXTRA, FINER, added_energies, gradients_at};
    use crate::boxes::mapped::metric::Metric;
    use crate::boxes::one_grid::Lower;
    use crate::boxes::one_part::SolvedPart;
    use crate::solution::Settings;
    use elastocap_geometry::scene::{Body, Box3, Scene, Wall};
    use elastocap_geometry::shapes::Shape;

    /// The largest difference of two forms over the root of the product of the diagonal's entries.
    fn apart(a: &Mat<f64>, b: &Mat<f64>) -> f64 {
        let n = a.nrows();
        let one = |i: usize, j: usize| (a[(i, j)] - b[(i, j)]).abs() / (a[(i, i)] * a[(j, j)]).abs().sqrt();
        (0..n).flat_map(|i| (0..n).map(move |j| (i, j))).map(|(i, j)| one(i, j)).fold(0.0, f64::max)
    }

    /// Runs a check on the potentials and the fluxes without divergence of a scene under a map.
    fn with_both(scene: &Scene, check: impl Fn(&SolvedPart, &Projected)) {
        let settings = Settings::default();
        let problem = GridProblem::new(scene, Some(&map()), None, &settings).unwrap();
        let outcome = solved(&problem, 4, Lower::None);
        let part = &outcome.solved[0].1;
        let solved_part = Solved {
            coefficients: &part.energies.coefficients,
            less: None,
            energies: &part.energies.matrix,
            images: &[None; 2],
            bent: part.primal.bent(),
        };
        let potentials = vec![vec![0.0; part.domain.conductors.len()]; 2];
        check(part, &project(&part.domain, &potentials, &solved_part, (1e-3, 0.0), None).unwrap());
    }

    #[test]
    fn squares_at_points_add_up_to_the_energies_of_potentials_and_fluxes_without_a_map() {
        with_both(&scene(), |part, projected| {
            let (domain, u) = (&part.domain, &part.energies.coefficients);
            let whole = &domain.truncated();
            let points = [0, 1, 2].map(|a| {
                let axis = &whole.axes[a];
                AxisPoints::new(axis, 0..axis.line.elements(), EXTRA)
            });
            let weights = Weights::new(whole, &points);
            let coefficients: Vec<&[f64]> = u.iter().map(Vec::as_slice).collect();
            let at = gradients_at(domain, &points, &coefficients);
            let found = Mat::from_fn(2, 2, |i, j| weights.product(&at[i], &at[j], true));
            assert!(apart(&part.primal.straight_energies(u), &found) < 1e-12, "{found:?}");
            let fluxes: Vec<&Flux> = projected.projections.iter().map(|one| &one.flux).collect();
            let at = fluxes_at(projected.dual.all_lines(), whole, &points, &fluxes);
            let found = Mat::from_fn(2, 2, |i, j| weights.over_permittivity(&at[i], &at[j]));
            assert!(apart(&projected.dual.energies_of(&fluxes), &found) < 1e-12, "{found:?}");
        });
    }

    #[test]
    fn fluxes_at_the_points_of_some_elements_are_those_among_all_points() {
        with_both(&scene(), |part, projected| {
            let whole = &part.domain.truncated();
            let on = |from: &dyn Fn(usize) -> Range<usize>| {
                [0, 1, 2].map(|a| {
                    let axis = &whole.axes[a];
                    AxisPoints::new(axis, from(axis.line.elements()), EXTRA)
                })
            };
            let (all, some) = (on(&|n| 0..n), on(&|n| n / 3..n / 3 + 2));
            let fluxes: Vec<&Flux> = projected.projections.iter().map(|one| &one.flux).collect();
            let lines = projected.dual.all_lines();
            let [of_all, of_some] = [&all, &some].map(|points| fluxes_at(lines, whole, points, &fluxes));
            let first = [0, 1, 2].map(|a| all[a].element.partition_point(|e| *e < some[a].element[0]));
            let counts = |points: &[AxisPoints; 3]| points.each_ref().map(AxisPoints::len);
            let ([_, m1, m2], [n0, n1, n2]) = (counts(&all), counts(&some));
            for (x, y) in of_all.iter().flatten().zip(of_some.iter().flatten()) {
                let largest = x.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
                for at in 0..n0 * n1 * n2 {
                    let [i, j, k] = [at / (n1 * n2), at / n2 % n1, at % n2];
                    let among = ((first[0] + i) * m1 + first[1] + j) * m2 + first[2] + k;
                    assert!((x[among] - y[at]).abs() < 1e-12 * largest, "{} {}", x[among], y[at]);
                }
            }
        });
    }

    #[test]
    fn sums_by_elements_are_those_over_all_points_at_once() {
        let check = |part: &SolvedPart, projected: &Projected| {
            let (domain, u) = (&part.domain, &part.energies.coefficients);
            let whole = &domain.truncated();
            let coefficients: Vec<&[f64]> = u.iter().map(Vec::as_slice).collect();
            let fluxes: Vec<&Flux> = projected.projections.iter().map(|one| &one.flux).collect();
            for extra in [EXTRA, FINER] {
                let products = |metric: &Metric, x: &[[Vec<f64>; 3]]| {
                    Mat::from_fn(2, 2, |i, j| metric.product(&x[i], &x[j]))
                };
                let metric = Metric::new(domain, extra, TensorKind::Permittivity).unwrap().unwrap();
                let at = gradients_at(domain, &metric.points, &coefficients);
                let found = added_energies(domain, extra, u, domain.primal_dims()).unwrap().unwrap();
                assert!(apart(&products(&metric, &at), &found) < 1e-12, "{extra}: {found:?}");
                let metric = Metric::new(whole, extra, TensorKind::Resistance).unwrap().unwrap();
                let at = fluxes_at(projected.dual.all_lines(), whole, &metric.points, &fluxes);
                let (found, largest) = projected.dual.added_energies(whole, extra, &fluxes).unwrap().unwrap();
                assert!(apart(&products(&metric, &at), &found) < 1e-12, "{extra}: {found:?}");
                assert_eq!(largest, metric.largest);
            }
        };
        with_both(&scene(), check);
        // Where rays and infinite elements begin beyond the map, too.
        let mut open = scene();
        (open.domain, open.walls) = (Box3::SPACE, [[Wall::Open; 2]; 3]);
        open.bodies.truncate(2);
        with_both(&open, check);
    }

    #[test]
    fn sums_of_many_potentials_are_those_of_the_few_that_they_are_made_of() {
        with_both(&scene(), |part, _| {
            let (domain, u) = (&part.domain, &part.energies.coefficients);
            let added =
                |u: &[Vec<f64>]| added_energies(domain, EXTRA, u, domain.primal_dims()).unwrap().unwrap();
            let shares: Vec<[f64; 2]> = (0..19).map(|k| [f64::from(k).cos(), f64::from(k).sin()]).collect();
            let sum = |s: &[f64; 2]| u[0].iter().zip(&u[1]).map(|(x, y)| s[0] * x + s[1] * y).collect();
            let (few, many) = (added(u), added(&shares.iter().map(sum).collect::<Vec<Vec<f64>>>()));
            let product = |x: &[f64; 2], y: &[f64; 2]| -> f64 {
                (0..2).map(|i| (0..2).map(|j| x[i] * few[(i, j)] * y[j]).sum::<f64>()).sum()
            };
            let expected = Mat::from_fn(19, 19, |i, j| product(&shares[i], &shares[j]));
            assert!(apart(&expected, &many) < 1e-11);
        });
    }

    #[test]
    fn the_target_of_an_image_is_the_image_of_the_target() {
        let plate =
            |x: [f64; 2], z: [f64; 2]| Shape::Box(Box3 { min: [x[0], 0.3, z[0]], max: [x[1], 0.5, z[1]] });
        // No mirror takes the permittivity to itself.
        let quarter =
            |x: [f64; 2], z: [f64; 2]| Shape::Box(Box3 { min: [x[0], 0.0, z[0]], max: [x[1], 1.0, z[1]] });
        let scene = boxed(vec![
            Body::conductor("left", plate([-0.7, -0.2], [-0.6, 0.2])),
            Body::conductor("right", plate([0.2, 0.7], [-0.2, 0.6])),
            Body::dielectric("here", quarter([-1.0, 0.0], [-1.2, 0.0]), 3.0),
            Body::dielectric("there", quarter([0.0, 1.0], [0.0, 1.2]), 3.0),
        ]);
        let settings = Settings::default();
        let problem = GridProblem::new(&scene, Some(&map()), None, &settings).unwrap();
        let outcome = solved(&problem, 3, Lower::None);
        let part = &outcome.solved[0].1;
        let domain = &part.domain;
        let image = images(domain, &[vec![1.0, 0.0], vec![0.0, 1.0]])[1].unwrap();
        let u = &part.energies.coefficients[0];
        let dual = Dual::new(domain).unwrap();
        let target_of = |u: &[f64]| target(domain, &dual, None, (u, part.primal.bent()));
        let turned = target_of(u).image(&dual, domain, &image);
        let direct = target_of(&image.of_potential(domain, u));
        for (turned, direct) in turned.parts.iter().zip(&direct.parts) {
            let size = direct.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
            let apart = turned.iter().zip(direct).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(size > 0.0 && apart < 1e-11 * size, "{apart:e} of {size:e}");
        }
    }
}
