//! The operator of Thomson's principle on a mesh: the divergence of fluxes between given potentials.
//!
//! Unknowns are an array of rows with a number for each discontinuous function of the line. Rows are the
//! traces of the potential on the sides of triangles, and its values inside with the opposite sign. Traces
//! are multiplied by the root of the permittivity of the interval ([`Product::along`]), values by the root of
//! the permittivity of the cell. They determine the flux of least energy along the plan in each triangle, and
//! along the axis on each line; the operator gives the divergence of these fluxes and their jumps across
//! sides.

use super::columns::Column;
use super::free_regions::Product;
use super::local::Local;
use super::mesh::{DISTANCE_STEP, PlanMesh};
use super::plane_system::Numbering;
use crate::boxes::domain::{Axis, per_element};
use crate::error::SolveError;
use elastocap_fem::condensed::Condensed;
use elastocap_fem::mixed::{FluxEnd, mixed_segment, ones};
use elastocap_fem::tensor::{Dense, left, multiply, right, target};
use elastocap_fem::triangle::{FluxForms, FluxIntegrals, divergences};
use elastocap_geometry::scene::Wall;
use elastocap_linalg::dense::{self, Llt};
use elastocap_linalg::lanes::vectorized;
use faer::Mat;
use rayon::prelude::*;
use std::ops::Range;

/// The data of a triangle that the fluxes need besides its local matrices: the flux for unit rows, and the
/// constant 1.
#[derive(Debug)]
pub(super) struct Cell {
    /// L^-1 times the constraints transposed, where the mass is L L^T: the flux for a unit value in each
    /// inner row, then in each row of its sides.
    pub flux: Dense<f64>,
    /// Inner coefficients of the constant 1.
    pub one: Vec<f64>,
}

/// All triangles of a mesh for fluxes of one degree.
#[derive(Debug)]
pub(super) struct Cells {
    /// The numbering of the traces on sides and the values inside triangles.
    pub numbering: Numbering,
    /// The local matrices of each triangle.
    pub locals: Vec<Local>,
    /// The other data of each triangle.
    pub cells: Vec<Cell>,
}

impl Cells {
    /// Computes the data of all triangles for fluxes of this degree.
    pub(super) fn new(mesh: &PlanMesh, degree: usize) -> Result<Self, SolveError> {
        let integrals = FluxIntegrals::new(degree);
        let triangles: Vec<(Local, Cell)> = (0..mesh.triangles.len())
            .into_par_iter()
            .map(|t| cell(&integrals, mesh, t, degree))
            .collect::<Result<_, SolveError>>()?;
        let (locals, cells) = triangles.into_iter().unzip();
        let (edges, p, inner) = (mesh.edges.len() as u32, degree as u32, divergences(degree) as u32);
        let numbering = Numbering {
            entities: mesh.sides.iter().map(|s| s.to_vec()).collect(),
            rows: (0..=edges).map(|e| e * p).collect(),
            inner_rows: (0..=mesh.triangles.len() as u32).map(|t| edges * p + t * inner).collect(),
            places: (0..mesh.edges.len()).map(|e| mesh.middle(e)).collect(),
        };
        Ok(Self { numbering, locals, cells })
    }
}

/// The matrices and the other data of one triangle.
fn cell(
    integrals: &FluxIntegrals,
    mesh: &PlanMesh,
    t: usize,
    degree: usize,
) -> Result<(Local, Cell), SolveError> {
    let failed = |_| SolveError::Eigenvalues;
    let triangle = mesh.triangle(t);
    let FluxForms { mass, constraints, one } =
        integrals.on(&triangle).map_err(|_| SolveError::Eigenvalues)?;
    let (inner, outer) = (divergences(degree), 3 * degree);
    let mut flux = constraints.transpose().to_owned();
    dense::solve_lower_triangular(Llt::new(mass.as_ref()).map_err(failed)?.lower(), flux.as_mut());
    let values = flux.as_ref().subcols(0, inner);
    let square = dense::product(values.transpose(), values);
    let (vectors, spectrum) = dense::symmetric_eigenvectors(square.as_ref()).map_err(failed)?;
    let turned = dense::product(values, vectors.as_ref());
    flux.as_mut().subcols_mut(0, inner).copy_from(&turned);
    let products = dense::product(flux.transpose(), flux.as_ref());
    let block = |rows: usize, columns: Range<usize>| {
        (0..rows)
            .flat_map(|i| columns.clone().map(move |j| (inner + i, j)))
            .map(|(i, j)| products[(i, j)])
            .collect()
    };
    let local = Local {
        outer,
        a: block(outer, inner..inner + outer),
        a_inner: block(outer, 0..inner),
        inner: spectrum.iter().map(|s| s.max(0.0)).collect(),
        ..Local::default()
    };
    let one = (0..inner).map(|i| (0..inner).map(|k| vectors[(k, i)] * one[k]).sum()).collect();
    Ok((local, Cell { flux: Dense::from_mat(flux.as_ref()), one }))
}

/// A part of the line between two conductors or ends.
#[derive(Debug)]
struct Run {
    /// Functions of the line on this part.
    range: Range<usize>,
    /// The number of its segment in [`Fluxes`].
    segment: usize,
    /// The conductors at the ends of the run.
    ends: [Option<u32>; 2],
}

/// The flux along the axis on a run.
#[derive(Debug)]
struct Segment {
    /// The energy of unknowns x is the square of the norm of `root * x`.
    root: Dense<f64>,
    /// `root` transposed times `root`.
    operator: Condensed,
    /// The flux for a unit potential at either end.
    face: [Vec<f64>; 2],
    /// The divergence of these fluxes.
    source: [Vec<f64>; 2],
}

/// Triangles that follow one another and have the same runs.
#[derive(Debug)]
struct Bundle {
    triangles: Range<usize>,
    /// The runs over each of the triangles.
    runs: Vec<Run>,
}

/// The operator of the plan, by rows, in one or several intervals that are filled alike.
#[derive(Debug)]
struct PlanOperator {
    /// For each row the index at which its entries begin, then the number of entries.
    starts: Vec<usize>,
    /// The columns of the entries.
    columns: Vec<u32>,
    /// The values of the entries.
    values: Vec<f64>,
    /// For each column of space over the mesh the permittivity over that of the interval; `None` in
    /// conductors.
    ratios: Vec<Option<f64>>,
}

/// The flux that leaves an edge of the frame along rays.
#[derive(Debug)]
struct Leaving {
    /// The rows of the traces on the edge.
    rows: Range<usize>,
    /// For each function of the line the inverse resistance.
    conductance: Vec<f64>,
}

/// The operator of the fluxes on a mesh.
#[derive(Debug)]
pub(super) struct Fluxes {
    /// The number of discontinuous functions of the line.
    pub width: usize,
    plan_operators: Vec<PlanOperator>,
    /// Functions of each interval, and the number of its operator in `plan_operators`.
    intervals: Vec<(Range<usize>, usize)>,
    /// By ascending triangles, all of which they cover.
    bundles: Vec<Bundle>,
    /// The different segments of all runs.
    segments: Vec<Segment>,
    /// One for each open edge of the frame.
    leaving: Vec<Leaving>,
}

/// The resistance to fluxes that leave along rays.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Beyond<'a> {
    /// No flux leaves along rays.
    Closed,
    /// The resistance of rays as they are, at the least favourable point of each triangle or edge; `met` has
    /// for each interval the least and the greatest permittivity that rays from it meet.
    Rays { radius: f64, met: &'a [[f64; 2]] },
    /// One resistance everywhere, that of the most oblique ray through a permittivity that is lower than the
    /// one it starts from by the factor `contrast`.
    Worst { radius: f64, contrast: f64 },
}

impl Beyond<'_> {
    /// The resistance beyond an end of the axis, in units of that of the interval `m` with this permittivity,
    /// for triangles at this [`PlanMesh::distance`].
    fn of_end(self, m: usize, permittivity: f64, distance: u8) -> f64 {
        match self {
            Self::Closed => 0.0,
            Self::Rays { radius, met } => {
                radius * permittivity / met[m][0] * (1.0 + f64::from(distance) * DISTANCE_STEP)
            }
            Self::Worst { radius, contrast } => 3.0 * radius * contrast,
        }
    }
}

/// Rows that one parallel task computes. Tuned:
/// `cargo run --release -p elastocap-electrostatics --example extruded_tables`.
const ROWS: usize = 64;

impl Fluxes {
    /// Assembles the operator for `columns`, which may differ from those of the mesh.
    pub(super) fn new(
        mesh: &PlanMesh,
        columns: &[Column],
        axis: &Axis,
        walls: &[[Wall; 2]; 2],
        cells: &Cells,
        product: &Product,
        beyond: Beyond<'_>,
    ) -> Result<Self, SolveError> {
        let n = axis.intervals();
        let width = axis.modes(0, n).len();
        let mut plan_operators: Vec<PlanOperator> = Vec::new();
        let mut intervals = Vec::new();
        for m in 0..n {
            let ratios: Vec<Option<f64>> = columns
                .iter()
                .map(|c| c.conductor[m].is_none().then(|| c.permittivity[m] / product.along[m]))
                .collect();
            let known = plan_operators.iter().position(|s| s.ratios == ratios);
            let plan_operator = known.unwrap_or_else(|| {
                plan_operators.push(plan_operator(mesh, cells, ratios));
                plan_operators.len() - 1
            });
            intervals.push((axis.modes(m, m + 1), plan_operator));
        }
        // Runs of each column, for each distance where rays leave through the ends of the axis.
        let mut keys: Vec<(usize, [usize; 2], [bool; 2], u8)> = Vec::new();
        let mut segments = Vec::new();
        let mut bundles: Vec<Bundle> = Vec::new();
        let mut first = 0;
        while first < mesh.triangles.len() {
            let kind = |t: usize| (mesh.column[t], mesh.distance[t]);
            let end = (first..mesh.triangles.len())
                .find(|&t| kind(t) != kind(first))
                .unwrap_or(mesh.triangles.len());
            let column = &columns[mesh.column[first] as usize];
            let mut runs = Vec::new();
            for (lo, hi, ends) in pieces(column) {
                let free = [0, 1].map(|side| ends[side].is_some());
                let leaves = [lo == 0 && !free[0], hi == n && !free[1]];
                let open = [0, 1].map(|side| leaves[side] && axis.walls[side] == Wall::Open);
                let distance = if open.contains(&true) { mesh.distance[first] } else { 0 };
                let column_index = mesh.column[first] as usize;
                let has_key = |k: &(usize, [usize; 2], [bool; 2], u8)| {
                    k.1 == [lo, hi]
                        && k.2 == free
                        && k.3 == distance
                        && columns[k.0].permittivity[lo..hi] == column.permittivity[lo..hi]
                };
                let segment = match keys.iter().position(has_key) {
                    Some(k) => k,
                    None => {
                        let mut flux_ends = axis.flux_ends(lo, hi);
                        (0..2).filter(|&s| free[s]).for_each(|s| flux_ends[s] = FluxEnd::Free);
                        let resistance = [(0, lo), (1, hi - 1)].map(|(side, m)| match open[side] {
                            true => beyond.of_end(m, column.permittivity[m], distance),
                            false => 0.0,
                        });
                        keys.push((column_index, [lo, hi], free, distance));
                        segments.push(line_segment(
                            axis,
                            [lo, hi],
                            &column.permittivity,
                            flux_ends,
                            resistance,
                        )?);
                        keys.len() - 1
                    }
                };
                runs.push(Run { range: axis.modes(lo, hi), segment, ends });
            }
            bundles.push(Bundle { triangles: first..end, runs });
            first = end;
        }
        let leaving = leaving(mesh, axis, walls, cells, product, beyond);
        Ok(Self { width, plan_operators, intervals, bundles, segments, leaving })
    }

    /// `y = A x`, all rows.
    pub(super) fn product(&self, cells: &Cells, x: &[f64], y: &mut [f64]) {
        let width = self.width;
        y.par_chunks_mut(ROWS * width).enumerate().for_each(|(task, out)| {
            out.fill(0.0);
            vectorized(|| {
                for (i, out) in out.chunks_exact_mut(width).enumerate() {
                    let row = task * ROWS + i;
                    for (range, plan_operator) in &self.intervals {
                        let plan_operator = &self.plan_operators[*plan_operator];
                        let out = &mut out[range.clone()];
                        for entry in plan_operator.starts[row]..plan_operator.starts[row + 1] {
                            let x = &x[plan_operator.columns[entry] as usize * width..][range.clone()];
                            let value = plan_operator.values[entry];
                            for (y, x) in out.iter_mut().zip(x) {
                                *y += value * x;
                            }
                        }
                    }
                }
            });
        });
        let first = cells.numbering.inner_rows[0] as usize;
        let per = cells.locals.first().map_or(0, |l| l.inner.len());
        let (traces, inner) = y.split_at_mut(first * width);
        let mut rest = inner;
        let mut parts = Vec::new();
        for bundle in &self.bundles {
            let (bundle_rows, others) = rest.split_at_mut(bundle.triangles.len() * per * width);
            rest = others;
            for (k, part) in bundle_rows.chunks_mut(ROWS * width).enumerate() {
                parts.push((bundle, first + bundle.triangles.start * per + k * ROWS, part));
            }
        }
        parts.into_par_iter().for_each_init(Vec::new, |work, (bundle, row, part)| {
            let rows = part.len() / width;
            for run in &bundle.runs {
                let operator = &self.segments[run.segment].operator;
                let from = run.range.start;
                let x = left(x, row * width + from, rows, run.range.len(), width);
                operator.add_along_rows(x, target(part, from, width), work);
            }
        });
        for leaving in &self.leaving {
            for row in leaving.rows.clone() {
                let (y, x) = (&mut traces[row * width..][..width], &x[row * width..][..width]);
                for ((y, x), c) in y.iter_mut().zip(x).zip(&leaving.conductance) {
                    *y += c * x;
                }
            }
        }
    }

    /// Subtracts from `b` the divergence of the fluxes from conductors above or below a cell, at these
    /// potentials.
    pub(super) fn subtract_sources(&self, cells: &Cells, potentials: &[f64], b: &mut [f64]) {
        self.at_ends(cells, potentials, |segment, side, row, range, drive| {
            for (b, s) in b[row * self.width..][range].iter_mut().zip(&segment.source[side]) {
                *b -= drive * s;
            }
        });
    }

    /// Calls `each` for every inner row of the triangles below or above a conductor with a potential, with
    /// the segment, its end, the row, the functions of the line, and the potential times the coefficient of
    /// the constant 1.
    fn at_ends(
        &self,
        cells: &Cells,
        potentials: &[f64],
        mut each: impl FnMut(&Segment, usize, usize, Range<usize>, f64),
    ) {
        for bundle in &self.bundles {
            for run in &bundle.runs {
                for side in 0..2 {
                    let Some(potential) = run.ends[side].map(|c| potentials[c as usize]) else { continue };
                    if potential == 0.0 {
                        continue;
                    }
                    for t in bundle.triangles.clone() {
                        let first = cells.numbering.inner_rows[t] as usize;
                        for (k, one) in cells.cells[t].one.iter().enumerate() {
                            let segment = &self.segments[run.segment];
                            each(segment, side, first + k, run.range.clone(), potential * one);
                        }
                    }
                }
            }
        }
    }

    /// Energy products of the fluxes of several arrays, each with the potentials of the conductors that it
    /// belongs to.
    pub(super) fn energies(
        &self,
        cells: &Cells,
        mesh: &PlanMesh,
        x: &[Vec<f64>],
        potentials: &[Vec<f64>],
    ) -> Mat<f64> {
        let (n, width) = (x.len(), self.width);
        let inner = cells.locals.first().map_or(0, |l| l.inner.len());
        let gram = |fluxes: &[Vec<f64>], into: &mut Mat<f64>| {
            for i in 0..n {
                for j in 0..=i {
                    let product: f64 = fluxes[i].iter().zip(&fluxes[j]).map(|(a, b)| a * b).sum();
                    into[(i, j)] += product;
                    if i != j {
                        into[(j, i)] += product;
                    }
                }
            }
        };
        // The energies of the fluxes along the plan.
        let of_triangle = |t: usize| {
            let mut out = Mat::zeros(n, n);
            let cell = &cells.cells[t];
            let rows: Vec<usize> =
                (cells.numbering.inner_rows[t]..cells.numbering.inner_rows[t + 1])
                    .chain(mesh.sides[t].iter().flat_map(|e| {
                        cells.numbering.rows[*e as usize]..cells.numbering.rows[*e as usize + 1]
                    }))
                    .map(|r| r as usize)
                    .collect();
            for (range, plan_operator) in &self.intervals {
                let Some(ratio) = self.plan_operators[*plan_operator].ratios[mesh.column[t] as usize] else {
                    continue;
                };
                let root = ratio.sqrt();
                let count = range.len();
                let fluxes: Vec<Vec<f64>> = x
                    .iter()
                    .map(|x| {
                        let mut gathered = Vec::with_capacity(rows.len() * count);
                        for (k, row) in rows.iter().enumerate() {
                            let factor = if k < inner { 1.0 } else { root };
                            gathered.extend(x[row * width..][range.clone()].iter().map(|x| factor * x));
                        }
                        let mut flux = vec![0.0; cell.flux.rows * count];
                        multiply(
                            cell.flux.left(),
                            right(&gathered, 0, count, count),
                            target(&mut flux, 0, count),
                            false,
                        );
                        flux
                    })
                    .collect();
                gram(&fluxes, &mut out);
            }
            out
        };
        let plan: Vec<Mat<f64>> = (0..mesh.triangles.len()).into_par_iter().map(of_triangle).collect();
        // The energies of the fluxes along the axis.
        let along: Vec<Mat<f64>> = self
            .bundles
            .par_iter()
            .map(|bundle| {
                let mut out = Mat::zeros(n, n);
                for run in &bundle.runs {
                    let segment = &self.segments[run.segment];
                    for t in bundle.triangles.clone() {
                        let first = cells.numbering.inner_rows[t] as usize;
                        for (k, one) in cells.cells[t].one.iter().enumerate() {
                            let fluxes: Vec<Vec<f64>> = x
                                .iter()
                                .zip(potentials)
                                .map(|(x, v)| {
                                    let values = &x[(first + k) * width..][run.range.clone()];
                                    let mut flux = vec![0.0; segment.root.rows];
                                    let root = segment.root.data.chunks_exact(segment.root.cols);
                                    for (f, line) in flux.iter_mut().zip(root) {
                                        *f = line.iter().zip(values).map(|(a, b)| a * b).sum();
                                    }
                                    for side in 0..2 {
                                        let Some(c) = run.ends[side] else { continue };
                                        let drive = v[c as usize] * one;
                                        flux.iter_mut()
                                            .zip(&segment.face[side])
                                            .for_each(|(f, s)| *f += drive * s);
                                    }
                                    flux
                                })
                                .collect();
                            gram(&fluxes, &mut out);
                        }
                    }
                }
                out
            })
            .collect();
        let mut total = plan.iter().chain(&along).fold(Mat::zeros(n, n), |sum: Mat<f64>, m| sum + m);
        for leaving in &self.leaving {
            for row in leaving.rows.clone() {
                let fluxes: Vec<Vec<f64>> = x
                    .iter()
                    .map(|x| {
                        x[row * width..][..width]
                            .iter()
                            .zip(&leaving.conductance)
                            .map(|(x, c)| x * c.sqrt())
                            .collect()
                    })
                    .collect();
                gram(&fluxes, &mut total);
            }
        }
        total
    }
}

/// The pieces of a column between conductors: the first interval, one past the last, and the conductors at
/// both ends.
fn pieces(column: &Column) -> Vec<(usize, usize, [Option<u32>; 2])> {
    let n = column.conductor.len();
    let mut out = Vec::new();
    let mut m = 0;
    while m < n {
        if column.conductor[m].is_some() {
            m += 1;
            continue;
        }
        let mut end = m + 1;
        while end < n && column.conductor[end].is_none() && column.held[end].is_none() {
            end += 1;
        }
        out.push((m, end, [column.held[m], column.held[end]]));
        m = end;
    }
    out
}

/// The segment of the line between the cuts `lo` and `hi`.
fn line_segment(
    axis: &Axis,
    [lo, hi]: [usize; 2],
    permittivity: &[f64],
    ends: [FluxEnd; 2],
    beyond: [f64; 2],
) -> Result<Segment, SolveError> {
    let elements = axis.cuts[lo]..axis.cuts[hi];
    let mixed = mixed_segment(&axis.line, elements, &per_element(axis, permittivity), ends, beyond)?;
    Ok(Segment {
        root: Dense::from_mat(mixed.root.as_ref()),
        operator: mixed.operator()?,
        source: [0, 1].map(|side| mixed.face_source(side)),
        face: mixed.face,
    })
}

/// Assembles the operator of the plan for these `ratios` of the permittivity.
fn plan_operator(mesh: &PlanMesh, cells: &Cells, ratios: Vec<Option<f64>>) -> PlanOperator {
    let numbering = &cells.numbering;
    let mut entries: Vec<Vec<(u32, f64)>> = vec![Vec::new(); numbering.len()];
    for (t, local) in cells.locals.iter().enumerate() {
        let Some(ratio) = ratios[mesh.column[t] as usize] else { continue };
        let root = ratio.sqrt();
        let outer: Vec<u32> = mesh.sides[t]
            .iter()
            .flat_map(|e| numbering.rows[*e as usize]..numbering.rows[*e as usize + 1])
            .collect();
        let inner = numbering.inner_rows[t]..numbering.inner_rows[t + 1];
        let (n, count) = (local.outer, inner.len());
        for (i, row) in outer.iter().enumerate() {
            let row_entries = &mut entries[*row as usize];
            row_entries.extend(outer.iter().enumerate().map(|(j, c)| (*c, ratio * local.a[i * n + j])));
            row_entries
                .extend(inner.clone().enumerate().map(|(j, c)| (c, root * local.a_inner[i * count + j])));
        }
        for (j, row) in inner.clone().enumerate() {
            let row_entries = &mut entries[row as usize];
            row_entries
                .extend(outer.iter().enumerate().map(|(i, c)| (*c, root * local.a_inner[i * count + j])));
            row_entries.push((row, local.inner[j]));
        }
    }
    let mut out = PlanOperator { starts: vec![0], columns: Vec::new(), values: Vec::new(), ratios };
    for mut row in entries {
        row.sort_by_key(|(c, _)| *c);
        for (c, value) in row {
            if out.columns.len() > out.starts[out.starts.len() - 1] && out.columns.last() == Some(&c) {
                let last = out.values.len() - 1;
                out.values[last] += value;
            } else {
                out.columns.push(c);
                out.values.push(value);
            }
        }
        out.starts.push(out.columns.len());
    }
    out
}

/// Fluxes through the open sides of the frame: their resistance is greatest where they are most oblique.
fn leaving(
    mesh: &PlanMesh,
    axis: &Axis,
    walls: &[[Wall; 2]; 2],
    cells: &Cells,
    product: &Product,
    beyond: Beyond<'_>,
) -> Vec<Leaving> {
    let radius = match beyond {
        Beyond::Closed => return Vec::new(),
        Beyond::Rays { radius, .. } | Beyond::Worst { radius, .. } => radius,
    };
    let nodes = &axis.line.nodes;
    // For each function of the line the greatest square of its element's distance, and the interval.
    let mut along = Vec::new();
    for m in 0..axis.intervals() {
        for e in axis.cuts[m]..axis.cuts[m + 1] {
            let farthest = nodes[e].abs().max(nodes[e + 1].abs()) / radius;
            along.extend(std::iter::repeat_n((farthest * farthest, m), axis.line.degree(e)));
        }
    }
    let open = (0..mesh.edges.len()).filter(|&e| mesh.wall(e, walls) == Some(Wall::Open));
    open.map(|e| {
        let k = mesh.on_frame[e].map_or(0, |[k, _]| 1 - k);
        let farthest = mesh.edges[e].iter().map(|p| mesh.points[*p as usize][k].abs()).fold(0.0, f64::max);
        let across = (farthest / radius).powi(2);
        let conductance = along
            .iter()
            .map(|(square, m)| match beyond {
                Beyond::Closed => 0.0,
                Beyond::Rays { met, .. } => {
                    met[*m][0] / (product.along[*m] * radius * (1.0 + across + square))
                }
                Beyond::Worst { contrast, .. } => 1.0 / (3.0 * contrast * radius),
            })
            .collect();
        let rows = cells.numbering.rows[e] as usize..cells.numbering.rows[e + 1] as usize;
        Leaving { rows, conductance }
    })
    .collect()
}

/// The constant 1 on the line, times the root of the permittivity of each interval.
pub(super) fn ones_along(axis: &Axis, product: &Product) -> Vec<f64> {
    let mut out = ones(&axis.line);
    for (m, e) in product.along.iter().enumerate() {
        out[axis.modes(m, m + 1)].iter_mut().for_each(|x| *x *= e.sqrt());
    }
    out
}
