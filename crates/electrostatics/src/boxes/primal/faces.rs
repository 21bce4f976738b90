//! Potentials that decay along rays beyond the last nodes of open space.
//!
//! Beyond the cube of half-width R around the pole the potential is continued as u(s x) = u(x) / s: the field
//! of a point charge at the pole is of this kind. On the face x = R, with u = g(y, z) there, its energy is,
//! for unit permittivity,
//!
//! integral of (g + y g_y + z g_z)^2 / R + R (g_y^2 + g_z^2) over the face,
//!
//! a sum of products of 1D matrices. Where rays cross different permittivities the greatest one is used: the
//! energy of a trial potential may be too large, never too small.

use crate::boxes::domain::{Axis, Domain, per_element};
use crate::boxes::ray_permittivity::RayPermittivity;
use elastocap_fem::line::{line_matrices, radial_matrices};
use elastocap_fem::tensor::{Dense, Dims, SparseRows, axpy, dot, left, multiply, target};
use elastocap_geometry::scene::{Wall, across};
use faer::Mat;
use rayon::prelude::*;
use std::ops::Range;

/// The faces of the cube through which rays leave; none in a scene without rays.
#[derive(Debug)]
pub(crate) struct Faces {
    /// The rectangles that the faces consist of.
    pieces: Vec<Piece>,
}

/// A rectangle of one face with one permittivity.
#[derive(Debug)]
struct Piece {
    /// The axis across the face.
    axis: usize,
    /// The function of that axis that is 1 at the outermost node.
    index: usize,
    /// The functions of the two transverse axes that do not vanish on the rectangle.
    across: [Range<usize>; 2],
    /// Matrices of the first transverse axis: (M + E + N + N^T) / R + R K, M, N / R, N^T / R, times the
    /// permittivity. M and K are mass and stiffness, N and E the first and the second radial matrix
    /// ([`radial_matrices`]).
    rows: [SparseRows<f64>; 4],
    /// Matrices of the second transverse axis, side by side: `[M | (E + N + N^T) / R + R K | N | N^T]`.
    columns: Dense<f64>,
}

/// 1D matrices of one side of a rectangle, cut to its functions.
struct Side {
    mass: Mat<f64>,
    stiffness: Mat<f64>,
    /// The first of the [`radial_matrices`].
    first: Mat<f64>,
    /// The second of the [`radial_matrices`].
    second: Mat<f64>,
    /// The functions of the axis that do not vanish on the side.
    functions: Range<usize>,
}

impl Side {
    fn new(axis: &Axis, pole: f64, lo: usize, hi: usize) -> Self {
        let inside: Vec<f64> =
            (0..axis.intervals()).map(|m| if (lo..hi).contains(&m) { 1.0 } else { 0.0 }).collect();
        let inside = per_element(axis, &inside);
        let (mass, stiffness) = line_matrices(&axis.line, &inside);
        let (first, second) = radial_matrices(&axis.line, &inside, pole);
        let functions = axis.closed(lo, hi);
        let from = axis.functions().start + functions.start;
        let n = functions.len();
        let cut = |m: Mat<f64>| m.as_ref().submatrix(from, from, n, n).to_owned();
        Self { mass: cut(mass), stiffness: cut(stiffness), first: cut(first), second: cut(second), functions }
    }
}

impl Faces {
    pub(crate) fn new(domain: &Domain) -> Self {
        let ray_permittivity = RayPermittivity::new(domain);
        let mut pieces = Vec::new();
        for (a, axis) in domain.axes.iter().enumerate() {
            let Some(rays) = axis.rays else { continue };
            for side in (0..2).filter(|&side| axis.walls[side] == Wall::Open) {
                pieces.extend(face(domain, &ray_permittivity, a, side, rays.radius));
            }
        }
        Self { pieces }
    }

    /// The products u A v of potentials on the faces. Each potential is given by a function from an axis and
    /// a side to its coefficients on that whole face, `[p][q]`; `dims` are those of the arrays of
    /// coefficients.
    pub(crate) fn products(&self, on_face: &[impl Fn(usize, usize) -> Vec<f64>], dims: Dims) -> Mat<f64> {
        let n = on_face.len();
        let mut out = Mat::zeros(n, n);
        for piece in &self.pieces {
            let [p, q] = across(piece.axis);
            let side = usize::from(piece.index > 0);
            let cut = |face: Vec<f64>| -> Vec<f64> {
                let width = dims[q];
                let rows = piece.across[0].clone();
                rows.flat_map(|s| face[s * width..][piece.across[1].clone()].to_vec()).collect()
            };
            debug_assert!(piece.across[0].end <= dims[p]);
            let cuts: Vec<Vec<f64>> = on_face.iter().map(|face| cut(face(piece.axis, side))).collect();
            let images: Vec<Vec<f64>> =
                cuts.iter().map(|coefficients| piece.product_of(coefficients)).collect();
            for i in 0..n {
                (0..n).for_each(|j| out[(i, j)] += dot(&cuts[i], &images[j]));
            }
        }
        out
    }

    /// `y += A x` for the part of A that belongs to the faces.
    pub(super) fn add_product(&self, x: &[f64], y: &mut [f64], dims: Dims) {
        let products: Vec<Vec<f64>> = self.pieces.par_iter().map(|p| p.product(x, dims)).collect();
        for (piece, product) in self.pieces.iter().zip(products) {
            for (index, value) in piece.places(dims).zip(product) {
                y[index] += value;
            }
        }
    }
}

/// The rectangles of the face of axis `a` at one end.
fn face(
    domain: &Domain,
    ray_permittivity: &RayPermittivity,
    a: usize,
    side: usize,
    radius: f64,
) -> Vec<Piece> {
    let [p, q] = across(a);
    let cells = domain.cells();
    let permittivity_at = |s: usize, t: usize| {
        let mut c = [0; 3];
        (c[a], c[p], c[q]) = (if side == 0 { 0 } else { cells[a] - 1 }, s, t);
        ray_permittivity.greatest(domain, c)
    };
    // Equal cells merged along q, then equal rows along p.
    let mut rectangles: Vec<([usize; 4], f64)> = Vec::new();
    for s in 0..cells[p] {
        let mut t = 0;
        while t < cells[q] {
            let value = permittivity_at(s, t);
            let end = (t + 1..cells[q]).find(|&n| permittivity_at(s, n) != value).unwrap_or(cells[q]);
            match rectangles.iter_mut().find(|(r, v)| r[1] == s && r[2] == t && r[3] == end && *v == value) {
                Some((r, _)) => r[1] = s + 1,
                None => rectangles.push(([s, s + 1, t, end], value)),
            }
            t = end;
        }
    }
    let pole = |b: usize| domain.axes[b].rays.map_or(0.0, |r| r.pole);
    let index = if side == 0 { 0 } else { domain.axes[a].functions().len() - 1 };
    rectangles
        .into_iter()
        .map(|([s0, s1, t0, t1], permittivity)| {
            let row = Side::new(&domain.axes[p], pole(p), s0, s1);
            let column = Side::new(&domain.axes[q], pole(q), t0, t1);
            let oblique = |side: &Side, i: usize, j: usize| {
                (side.second[(i, j)] + side.first[(i, j)] + side.first[(j, i)]) / radius
                    + radius * side.stiffness[(i, j)]
            };
            let n = row.functions.len();
            let rows = [
                Mat::from_fn(n, n, |i, j| oblique(&row, i, j) + row.mass[(i, j)] / radius),
                row.mass.clone(),
                &row.first * faer::Scale(1.0 / radius),
                row.first.transpose() * faer::Scale(1.0 / radius),
            ]
            .map(|m| SparseRows::from_mat((m * faer::Scale(permittivity)).as_ref()));
            let m = column.functions.len();
            let columns = Mat::from_fn(m, 4 * m, |i, j| match j / m {
                0 => column.mass[(i, j)],
                1 => oblique(&column, i, j - m),
                2 => column.first[(i, j - 2 * m)],
                _ => column.first[(j - 3 * m, i)],
            });
            let columns = Dense::from_mat(columns.as_ref());
            Piece { axis: a, index, across: [row.functions, column.functions], rows, columns }
        })
        .collect()
}

impl Piece {
    /// Places of the rectangle's coefficients in the array, row by row.
    fn places(&self, dims: Dims) -> impl Iterator<Item = usize> {
        let strides = [dims[1] * dims[2], dims[2], 1];
        let [p, q] = across(self.axis);
        let (base, columns) = (self.index * strides[self.axis], self.across[1].clone());
        self.across[0]
            .clone()
            .flat_map(move |s| columns.clone().map(move |t| base + s * strides[p] + t * strides[q]))
    }

    /// The product of the rectangle's part of A with the potential `x`, at [`Piece::places`].
    fn product(&self, x: &[f64], dims: Dims) -> Vec<f64> {
        let gathered: Vec<f64> = self.places(dims).map(|index| x[index]).collect();
        self.product_of(&gathered)
    }

    /// The product of the rectangle's part of A with a potential whose coefficients on the rectangle are
    /// given, row by row.
    fn product_of(&self, gathered: &[f64]) -> Vec<f64> {
        let [rows, columns] = [0, 1].map(|b| self.across[b].len());
        let mut by_columns = vec![0.0; rows * 4 * columns];
        let source = left(gathered, 0, rows, columns, columns);
        multiply(source, self.columns.right(), target(&mut by_columns, 0, 4 * columns), false);
        let mut out = vec![0.0; rows * columns];
        for (i, out) in out.chunks_exact_mut(columns.max(1)).enumerate() {
            for (part, matrix) in self.rows.iter().enumerate() {
                for &(s, weight) in matrix.row(i) {
                    axpy(out, weight, &by_columns[(4 * s + part) * columns..][..columns]);
                }
            }
        }
        out
    }
}
