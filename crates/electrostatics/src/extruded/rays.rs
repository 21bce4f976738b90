//! Open space: potentials that continue along rays from the origin beyond the frame and the ends of the axis,
//! and the permittivities that rays meet.
//!
//! See `boxes/primal/faces.rs` and `boxes/dual/rays.rs` for the continuations of potentials and fluxes, and
//! their energies. Where rays cross different permittivities, the least favourable one that they can meet
//! counts.

use super::mesh::PlanMesh;
use super::plane_system::Beyond;
use crate::boxes::domain::{Axis, per_element};
use crate::error::SolveError;
use elastocap_fem::line::{hierarchical, line_matrices, radial_matrices};
use elastocap_fem::modes::{LineModes, primal_modes_beyond};
use elastocap_fem::quadrature::gauss_legendre;
use elastocap_fem::tensor::{Dense, axpy, left, multiply, target};
use elastocap_fem::triangle::{PotentialIntegrals, continuous_functions};
use elastocap_geometry::scene::Wall;
use elastocap_linalg::dense;
use faer::Mat;
use std::ops::Range;

/// For each interval the least and the greatest permittivity that rays from it, or from the plan over it, can
/// meet.
pub(super) fn met_by_rays(mesh: &PlanMesh, axis: &Axis) -> Vec<[f64; 2]> {
    let n = axis.intervals();
    let extremes: Vec<[f64; 2]> = (0..n)
        .map(|m| {
            let permittivities =
                mesh.columns.iter().filter(|c| c.conductor[m].is_none()).map(|c| c.permittivity[m]);
            permittivities.fold([f64::INFINITY, 0.0], |[a, b], e| [f64::min(a, e), f64::max(b, e)])
        })
        .collect();
    let joined = |range: Range<usize>| {
        extremes[range].iter().fold([f64::INFINITY, 0.0_f64], |[a, b], e| [a.min(e[0]), b.max(e[1])])
    };
    let node = |m: usize| axis.line.nodes[axis.cuts[m]];
    (0..n)
        .map(|m| match (node(m + 1) > 0.0, node(m) < 0.0) {
            (true, false) => joined(m..n),
            (false, true) => joined(0..m + 1),
            _ => joined(0..n),
        })
        .collect()
}

/// A matrix by rows: column, value.
type SparseRows = Vec<Vec<(u32, f64)>>;

/// The energy that open space adds to that of the potentials of a mesh. Beyond the frame it is a sum of four
/// products of a matrix in the plan and a matrix of the line.
#[derive(Debug, Default)]
pub(super) struct PotentialRays {
    /// Rows of the functions on the open sides of the frame.
    rows: Vec<u32>,
    /// The four matrices in the plan, row by row: the columns, as indices in `rows`, each with the four
    /// entries.
    plan: Vec<Vec<(usize, [f64; 4])>>,
    /// The four matrices of the line, side by side.
    line: Option<Dense<f64>>,
    /// For each open end of the axis the function of the line there, and a matrix of the plan.
    ends: Vec<(usize, SparseRows)>,
    /// Greatest permittivity at either end of the axis.
    greatest: [f64; 2],
    /// Degree of the potentials in the plan.
    degree: usize,
}

/// The integrals along one edge of the frame, between its functions: mass, stiffness, phi_i y phi_j', y^2
/// phi_i' phi_j'.
fn along_edge(mesh: &PlanMesh, edge: usize, degree: usize) -> [Mat<f64>; 4] {
    let [a, b] = mesh.edges[edge].map(|p| mesh.points[p as usize]);
    let k = mesh.on_frame[edge].map_or(0, |[k, _]| 1 - k);
    let (middle, half) = (0.5 * (a[k] + b[k]), 0.5 * (b[k] - a[k]));
    let mut out = [0; 4].map(|_| Mat::zeros(degree + 1, degree + 1));
    let (points, weights) = gauss_legendre(degree + 2);
    for (s, w) in points.iter().zip(&weights) {
        let (value, slope) = hierarchical(degree, *s);
        let (y, w) = (middle + s * half, w * half.abs());
        for i in 0..=degree {
            for j in 0..=degree {
                let (u, v) = (slope[i] / half, slope[j] / half);
                out[0][(i, j)] += w * value[i] * value[j];
                out[1][(i, j)] += w * u * v;
                out[2][(i, j)] += w * value[i] * y * v;
                out[3][(i, j)] += w * y * y * u * v;
            }
        }
    }
    out
}

impl PotentialRays {
    /// The energy beyond a frame at the distance `radius`; none without a radius. The inner functions of each
    /// triangle are the columns of its `inner_bases` in terms of those of the integrals.
    pub(super) fn new(
        mesh: &PlanMesh,
        axis: &Axis,
        walls: &[[Wall; 2]; 2],
        degree: usize,
        radius: Option<f64>,
        inner_bases: &[Mat<f64>],
    ) -> Result<Self, SolveError> {
        let Some(radius) = radius else { return Ok(Self::default()) };
        let met = met_by_rays(mesh, axis);
        let points = mesh.points.len();
        // The frame.
        let mut places: std::collections::HashMap<u32, usize> = std::collections::HashMap::new();
        let mut rows = Vec::new();
        let mut plan: Vec<Vec<(usize, [f64; 4])>> = Vec::new();
        for e in (0..mesh.edges.len()).filter(|&e| mesh.wall(e, walls) == Some(Wall::Open)) {
            let indices: Vec<usize> = edge_rows(mesh, e, degree)
                .map(|row| {
                    *places.entry(row).or_insert_with(|| {
                        rows.push(row);
                        plan.push(Vec::new());
                        rows.len() - 1
                    })
                })
                .collect();
            let [mass, stiffness, first, second] = along_edge(mesh, e, degree);
            for (i, row) in indices.iter().enumerate() {
                for (j, column) in indices.iter().enumerate() {
                    let oblique = (second[(i, j)] + first[(i, j)] + first[(j, i)] + mass[(i, j)]) / radius
                        + radius * stiffness[(i, j)];
                    let values = [oblique, mass[(i, j)], first[(i, j)] / radius, first[(j, i)] / radius];
                    match plan[*row].iter_mut().find(|(c, _)| c == column) {
                        Some((_, sum)) => (0..4).for_each(|k| sum[k] += values[k]),
                        None => plan[*row].push((*column, values)),
                    }
                }
            }
        }
        let greatest: Vec<f64> = met.iter().map(|[_, greatest]| *greatest).collect();
        let along = per_element(axis, &greatest);
        let (mass, stiffness) = line_matrices(&axis.line, &along);
        let (first, second) = radial_matrices(&axis.line, &along, 0.0);
        let trim = axis.functions();
        let n = trim.len();
        let line = Mat::from_fn(n, 4 * n, |i, j| {
            let (i, part, j) = (trim.start + i, j / n, trim.start + j % n);
            match part {
                0 => mass[(i, j)],
                1 => (second[(i, j)] + first[(i, j)] + first[(j, i)]) / radius + radius * stiffness[(i, j)],
                2 => first[(i, j)],
                _ => first[(j, i)],
            }
        });
        // The ends of the axis.
        let integrals = PotentialIntegrals::new(degree);
        let functions = axis.functions();
        let open = (0..2).filter(|side| axis.walls[*side] == Wall::Open);
        let ends: Result<Vec<_>, SolveError> = open
            .map(|side| {
                let permittivity = greatest[if side == 0 { 0 } else { greatest.len() - 1 }];
                let mut matrix = vec![Vec::new(); points + mesh.edges.len() * (degree - 1)];
                matrix.resize(matrix.len() + mesh.triangles.len() * inner(degree), Vec::new());
                (if side == 0 { 0 } else { functions.len() - 1 }, permittivity, matrix)
            })
            .map(|(function, permittivity, mut matrix): (usize, f64, Vec<Vec<(u32, f64)>>)| {
                for t in 0..mesh.triangles.len() {
                    let form = integrals.beyond(&mesh.triangle(t), radius).map_err(|_| SolveError::NoPlan)?;
                    let form = in_basis(&form, &inner_bases[t], degree);
                    let rows: Vec<u32> = triangle_rows(mesh, t, degree).collect();
                    for (i, row) in rows.iter().enumerate() {
                        matrix[*row as usize]
                            .extend(rows.iter().enumerate().map(|(j, c)| (*c, permittivity * form[(i, j)])));
                    }
                }
                Ok((function, matrix))
            })
            .collect();
        let at_end = [greatest[0], greatest[greatest.len() - 1]];
        let line = Some(Dense::from_mat(line.as_ref()));
        Ok(Self { rows, plan, line, ends: ends?, greatest: at_end, degree })
    }

    /// `y += A x` for the energy in open space.
    pub(super) fn add_product(&self, x: &[f64], y: &mut [f64], width: usize) {
        if let Some(line) = &self.line {
            let gathered: Vec<f64> =
                self.rows.iter().flat_map(|r| x[*r as usize * width..][..width].iter().copied()).collect();
            let mut by_part = vec![0.0; 4 * gathered.len()];
            let source = left(&gathered, 0, self.rows.len(), width, width);
            multiply(source, line.right(), target(&mut by_part, 0, 4 * width), false);
            for (row, entries) in self.rows.iter().zip(&self.plan) {
                let out = &mut y[*row as usize * width..][..width];
                for (column, values) in entries {
                    for (part, value) in values.iter().enumerate() {
                        axpy(out, *value, &by_part[(4 * column + part) * width..][..width]);
                    }
                }
            }
        }
        for (function, matrix) in &self.ends {
            for (row, entries) in matrix.iter().enumerate() {
                let sum: f64 = entries.iter().map(|(c, v)| v * x[*c as usize * width + function]).sum();
                y[row * width + function] += sum;
            }
        }
    }

    /// The matrices that the preconditioner adds along the frame: the radial and the tangential part, without
    /// their product.
    pub(super) fn beyond(&self, mesh: &PlanMesh, walls: &[[Wall; 2]; 2], radius: Option<f64>) -> Vec<Beyond> {
        let Some(radius) = radius else { return Vec::new() };
        let open = (0..mesh.edges.len()).filter(|&e| mesh.wall(e, walls) == Some(Wall::Open));
        open.map(|e| {
            let [mass, stiffness, ..] = along_edge(mesh, e, self.degree);
            let n = self.degree + 1;
            let [a, b] = mesh.edges[e];
            let table = |f: &dyn Fn(usize, usize) -> f64| (0..n * n).map(|k| f(k / n, k % n)).collect();
            Beyond {
                entities: vec![a, b, (mesh.points.len() + e) as u32],
                a: table(&|i, j| radius * stiffness[(i, j)] + mass[(i, j)] / radius),
                m: table(&|i, j| radius * mass[(i, j)]),
            }
        })
        .collect()
    }

    /// Modes of a part of the line for the preconditioner.
    pub(super) fn modes(
        &self,
        axis: &Axis,
        elements: Range<usize>,
        along: &[f64],
        held: [bool; 2],
        radius: Option<f64>,
    ) -> Result<LineModes, SolveError> {
        let last = axis.line.elements();
        let beyond = [0, 1].map(|side| match radius {
            Some(r)
                if axis.walls[side] == Wall::Open && [elements.start == 0, elements.end == last][side] =>
            {
                [r * self.greatest[side], self.greatest[side] / r]
            }
            _ => [0.0; 2],
        });
        Ok(primal_modes_beyond(&axis.line, elements, along, held, beyond)?)
    }
}

/// A form in the functions of a triangle, in another basis of the inner functions.
fn in_basis(form: &Mat<f64>, inner_basis: &Mat<f64>, degree: usize) -> Mat<f64> {
    let (n, outer) = (form.nrows(), 3 * degree);
    let change = Mat::from_fn(n, n, |i, j| match (i.checked_sub(outer), j.checked_sub(outer)) {
        (Some(i), Some(j)) => inner_basis[(i, j)],
        (None, None) if i == j => 1.0,
        _ => 0.0,
    });
    let half = dense::product(form.as_ref(), change.as_ref());
    dense::product(change.transpose(), half.as_ref())
}

/// The number of inner functions of a triangle.
fn inner(degree: usize) -> usize {
    continuous_functions(degree) - 3 * degree
}

/// Rows of the functions of an edge: those of its ends first, then those inside it.
fn edge_rows(mesh: &PlanMesh, edge: usize, degree: usize) -> impl Iterator<Item = u32> {
    let first = (mesh.points.len() + edge * (degree - 1)) as u32;
    mesh.edges[edge].into_iter().chain(first..first + degree as u32 - 1)
}

/// Rows of the functions of a triangle: those of its corners, of its sides and of its inside.
fn triangle_rows(mesh: &PlanMesh, t: usize, degree: usize) -> impl Iterator<Item = u32> + '_ {
    let points = mesh.points.len();
    let sides = mesh.sides[t].into_iter().flat_map(move |e| {
        let first = (points + e as usize * (degree - 1)) as u32;
        first..first + degree as u32 - 1
    });
    let first = (points + mesh.edges.len() * (degree - 1) + t * inner(degree)) as u32;
    mesh.triangles[t].into_iter().chain(sides).chain(first..first + inner(degree) as u32)
}
