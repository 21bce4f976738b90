//! Fluxes as coordinates on the lines of a grid: their projection, divergence, energies and charges.

use super::aim::Target;
use super::lines::{Bundle, Run};
use super::rays::{inner, shares};
use super::run_values::RunValues;
use super::{Dual, Lines, Strip, others};
use crate::boxes::domain::Domain;
use crate::boxes::mapped::points::AxisPoints;
use crate::boxes::schwarz::row_block;
use elastocap_fem::tensor::{Dense, Dims, Left, Target as Strided, dot, multiply, right};
use elastocap_linalg::conjugate_gradients::Operator;
use faer::Mat;
use rayon::prelude::*;

/// A flux: for each axis and each run of each bundle, the coordinates whose squares add up to the energy,
/// `[coordinate][line]`.
#[derive(Debug)]
pub(super) struct Flux(pub(super) [Vec<Vec<f64>>; 3]);

impl Lines {
    /// The runs of an axis, bundle after bundle, each with its bundle.
    pub(super) fn runs(&self, a: usize) -> impl Iterator<Item = (&Bundle, &Run)> {
        self.bundles[a].iter().flat_map(|bundle| bundle.runs.iter().map(move |run| (bundle, run)))
    }

    /// The offset of each line of a run in an array of one component with these strides, apart from its
    /// position along the axis, and the root of the permittivity at the first interval of the run.
    fn placed_lines(&self, a: usize, bundle: &Bundle, run: &Run, stride: [usize; 3]) -> Vec<(usize, f64)> {
        let (p, q) = others(a);
        self.lines(a, bundle, run).map(|(s, t, root)| (s * stride[p] + t * stride[q], root)).collect()
    }

    /// The lines of a run: their indices across, and the root of the permittivity at the first interval of
    /// the run.
    fn lines<'s>(
        &'s self,
        a: usize,
        bundle: &'s Bundle,
        run: &'s Run,
    ) -> impl Iterator<Item = (usize, usize, f64)> + 's {
        let (p, q) = others(a);
        let columns = bundle.across[1].clone();
        bundle.across[0].clone().flat_map(move |s| {
            columns.clone().map(move |t| {
                let mut position = [0; 3];
                (position[a], position[p], position[q]) = (run.range.start, s, t);
                (s, t, self.weights.root_at(position))
            })
        })
    }

    /// The part along an axis of the flux that is nearest to a target, for each run. `part` is the component
    /// of the target along that axis, from [`Target::parts`].
    fn projected(&self, domain: &Domain, a: usize, points: &AxisPoints, part: &[f64]) -> Vec<Vec<f64>> {
        let values = self.values_at(domain, a, points);
        let mut dims = self.dims;
        dims[a] = points.len();
        let stride = strides(dims);
        let of_run = |(bundle, run): (&Bundle, &Run)| {
            let segment = &self.segments[a][run.segment];
            let RunValues { first, matrix } = &values[run.segment];
            let width = bundle.width();
            let mut weighed = vec![0.0; matrix.rows * width];
            let lines = self.placed_lines(a, bundle, run, stride);
            in_order(a, matrix.rows, width, |row, column| {
                let (offset, root) = lines[column];
                weighed[row * width + column] = root * part[(first + row) * stride[a] + offset];
            });
            let mut y = vec![0.0; matrix.cols * width];
            let weighed = right(&weighed, 0, width, width);
            multiply(matrix.transposed().left(), weighed, Strided { data: &mut y, stride: width }, false);
            for (column, (offset, root)) in lines.iter().enumerate() {
                let target_at = |point: usize| part[point * stride[a] + offset];
                let radius = domain.axes[a].rays.map_or(0.0, |rays| rays.radius);
                for side in segment.leaving.iter().flat_map(|leaving| leaving.sides.iter().copied()) {
                    // The flux that leaves is taken from the last points: the projection need not be exact.
                    let (point, sign) =
                        if side == 0 { (*first, -1.0) } else { (first + matrix.rows - 1, 1.0) };
                    let weight = sign * root * radius * target_at(point) / points.weights[point];
                    segment.face[side]
                        .iter()
                        .enumerate()
                        .for_each(|(r, f)| y[r * width + column] += f * weight);
                }
            }
            y
        };
        let runs: Vec<_> = self.runs(a).collect();
        runs.into_par_iter().map(of_run).collect()
    }

    /// Subtracts the divergence of a flux along an axis from an array, in the scaling of the unknowns.
    fn subtract_divergence(&self, a: usize, flux: &[Vec<f64>], out: &mut [f64]) {
        let [n0, n1, n2] = self.dims;
        let plane = n1 * n2;
        // The negative divergence along a line of unit coordinates (columns), and its transpose.
        let minus = |segment: &super::Segment| {
            let Dense { rows, cols, data } = &segment.root;
            let minus = Dense { rows: *rows, cols: *cols, data: data.iter().map(|x| -x).collect() };
            (minus.transposed(), minus)
        };
        let minus: Vec<(Dense<f64>, Dense<f64>)> = self.segments[a].iter().map(minus).collect();
        let block = row_block(n0, plane);
        out.par_chunks_mut((block * plane).max(1)).enumerate().for_each(|(piece, out)| {
            let slabs = piece * block..piece * block + out.len() / plane;
            for ((bundle, run), y) in self.runs(a).zip(flux) {
                let [rows, columns] = &bundle.across;
                let width = bundle.width();
                let (matrix, transpose) = &minus[run.segment];
                if a == 0 {
                    let places = slabs.start.max(run.range.start)..slabs.end.min(run.range.end);
                    if places.is_empty() {
                        continue;
                    }
                    let part = matrix.left_rows(places.start - run.range.start..places.end - run.range.start);
                    for row in rows.clone() {
                        let lines = right(y, bundle.line(row, columns.start), columns.len(), width);
                        let start = (places.start - slabs.start) * plane + row * n2 + columns.start;
                        multiply(part, lines, Strided { data: &mut out[start..], stride: plane }, true);
                    }
                    continue;
                }
                for row in rows.start.max(slabs.start)..rows.end.min(slabs.end) {
                    let start = (row - slabs.start) * plane;
                    if a == 1 {
                        let lines = right(y, bundle.line(row, columns.start), columns.len(), width);
                        let to = &mut out[start + run.range.start * n2 + columns.start..];
                        multiply(matrix.left(), lines, Strided { data: to, stride: n2 }, true);
                    } else {
                        let data = &y[bundle.line(row, columns.start)..];
                        let lines =
                            Left { data, rows: columns.len(), cols: transpose.rows, row: 1, col: width };
                        let to = &mut out[start + columns.start * n2 + run.range.start..];
                        multiply(lines, transpose.right(), Strided { data: to, stride: n2 }, true);
                    }
                }
            }
        });
    }

    /// The flux M^-1 (g + D^T phi) along an axis, for each run.
    fn fluxes(&self, a: usize, potentials: &[f64], phi: &[f64]) -> Vec<Vec<f64>> {
        let of_run = |(bundle, run): (&Bundle, &Run)| {
            let [rows, columns] = bundle.across.clone();
            let of_row = |s: usize| {
                let strip = Strip { axis: a, run, row: s, columns: columns.clone() };
                let mut flux = self.flux_of(&strip, potentials, phi);
                self.add_obliqueness(&strip, &mut flux);
                flux
            };
            let strips: Vec<Vec<f64>> = rows.clone().into_par_iter().map(of_row).collect();
            let mut y = vec![0.0; self.segments[a][run.segment].root.rows * bundle.width()];
            for (row, strip) in rows.zip(&strips) {
                for (r, values) in strip.chunks_exact(columns.len().max(1)).enumerate() {
                    let start = r * bundle.width() + bundle.line(row, columns.start);
                    y[start..start + columns.len()].copy_from_slice(values);
                }
            }
            y
        };
        self.runs(a).map(of_run).collect()
    }

    /// Adds M^-1 D^T phi along an axis to a flux: the flux of phi where all conductors are at potential zero.
    fn add_gradient(&self, a: usize, flux: &mut Flux, phi: &[f64]) {
        let ends = self.runs(a).flat_map(|(_, run)| run.ends.iter().flatten());
        let none = vec![0.0; ends.max().map_or(0, |last| last + 1)];
        for (y, gradient) in flux.0[a].iter_mut().zip(self.fluxes(a, &none, phi)) {
            y.iter_mut().zip(&gradient).for_each(|(y, x)| *y += x);
        }
    }
}

impl Dual {
    /// The flux that is nearest to a target, with whatever divergence it has.
    pub(super) fn projected(&self, domain: &Domain, target: &Target) -> Flux {
        Flux([0, 1, 2].map(|a| {
            let (points, part) = (&target.points[a], &target.parts[a]);
            match (&self.other, &domain.turn, a) {
                (Some(other), Some(turn), 0) => {
                    let exchange = other.exchange.at_points(points.len());
                    let points = points.with_mirror_image(&domain.axes[0]);
                    other.lines.projected(&turn.half, 0, &points, &exchange.to_second(part, -other.parity))
                }
                _ => self.lines.projected(domain, a, points, part),
            }
        }))
    }

    /// Minus the divergence of a flux, in the scaling of the unknowns.
    pub(super) fn minus_divergence(&self, flux: &Flux) -> Vec<f64> {
        let mut out = vec![0.0; self.unknowns()];
        for a in 0..3 {
            self.add_along(a, &mut out, |lines, out| lines.subtract_divergence(a, &flux.0[a], out));
        }
        out
    }

    /// The negative divergence of the flux M^-1 (g + D^T phi), computed from its rounded coordinates.
    ///
    /// In exact arithmetic this is b - A phi. A product with A cancels nearly all of phi where the
    /// permittivity is high, and its rounding error may exceed all charge that the flux carries. Coordinates
    /// are no larger than the flux, whose divergence loses no digits.
    pub(crate) fn flux_residual(&self, potentials: &[f64], phi: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; self.unknowns()];
        for a in 0..3 {
            let flux = self.whole_lines(a).fluxes(a, potentials, &self.unknowns_along(a, phi));
            self.add_along(a, &mut out, |lines, out| lines.subtract_divergence(a, &flux, out));
        }
        self.clear_conductors(&mut out);
        out
    }

    /// Adds M^-1 D^T phi to a flux.
    pub(super) fn add_gradient(&self, flux: &mut Flux, phi: &[f64]) {
        for a in 0..3 {
            self.whole_lines(a).add_gradient(a, flux, &self.unknowns_along(a, phi));
        }
    }

    /// Energies of fluxes without a map, open space included.
    pub(super) fn energies_of(&self, fluxes: &[&Flux]) -> Mat<f64> {
        let n = fluxes.len();
        let mut out = Mat::zeros(n, n);
        for a in 0..3 {
            let lines = self.whole_lines(a);
            let across = shares(&lines.basis, a);
            for (number, (bundle, run)) in lines.runs(a).enumerate() {
                let segment = &lines.segments[a][run.segment];
                let width = bundle.width();
                for i in 0..n {
                    for j in 0..n {
                        let (x, y) = (&fluxes[i].0[a][number], &fluxes[j].0[a][number]);
                        out[(i, j)] += dot(x, y);
                        let Some(leaving) = &segment.leaving else { continue };
                        for (column, (s, t, _)) in lines.lines(a, bundle, run).enumerate() {
                            let [x, y] = [x, y].map(|y| trace(y, width, column, segment, &leaving.sides));
                            out[(i, j)] += leaving.oblique(across[0][s] + across[1][t], x, y);
                        }
                    }
                }
            }
        }
        out
    }

    /// Charges g_i s_j: the flow from the conductors in the flux of right-hand side j, weighted by the
    /// potentials of right-hand side i.
    pub(super) fn charges(&self, potentials: &[Vec<f64>], fluxes: &[&Flux]) -> Mat<f64> {
        let n = fluxes.len();
        let mut out = Mat::zeros(n, n);
        for a in 0..3 {
            let (lines, (p, q)) = (self.whole_lines(a), others(a));
            for (number, (bundle, run)) in lines.runs(a).enumerate() {
                let segment = &lines.segments[a][run.segment];
                let width = bundle.width();
                for side in 0..2 {
                    let Some(conductor) = run.ends[side] else { continue };
                    let mut flows = vec![0.0; n];
                    for (column, (s, t, _)) in lines.lines(a, bundle, run).enumerate() {
                        let mut position = [0; 3];
                        (position[a], position[p], position[q]) = (run.range.start, s, t);
                        let area = lines.area(a, position);
                        if area == 0.0 {
                            continue;
                        }
                        for (flow, flux) in flows.iter_mut().zip(fluxes) {
                            let y = flux.0[a][number][column..].iter().step_by(width);
                            *flow += area * y.zip(&segment.face[side]).map(|(y, f)| y * f).sum::<f64>();
                        }
                    }
                    for i in 0..n {
                        (0..n).for_each(|j| out[(i, j)] += potentials[i][conductor] * flows[j]);
                    }
                }
            }
        }
        out
    }
}

/// Visits all pairs of a place along lines and a line, in the order of an array of that axis: places are
/// contiguous along the last axis, lines along the others.
fn in_order(axis: usize, places: usize, lines: usize, mut each: impl FnMut(usize, usize)) {
    if axis == 2 {
        (0..lines).for_each(|line| (0..places).for_each(|place| each(place, line)));
    } else {
        (0..places).for_each(|place| (0..lines).for_each(|line| each(place, line)));
    }
}

/// The flux that leaves one line at its open ends.
fn trace(y: &[f64], width: usize, column: usize, segment: &super::Segment, sides: &[usize]) -> [f64; 2] {
    let line: Vec<f64> = y[column..].iter().step_by(width).copied().collect();
    let mut out = [0.0; 2];
    for (out, side) in out.iter_mut().zip(sides) {
        *out = inner(&line, &segment.face[*side]);
    }
    out
}

fn strides(dims: Dims) -> [usize; 3] {
    [dims[1] * dims[2], dims[2], 1]
}
