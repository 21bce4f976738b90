//! Fast products with the dual operator of a line, by static condensation to the fluxes between pieces of the
//! line.
//!
//! T = D M^-1 D^T is dense, but pieces of a line are coupled only through the flux at the nodes between them.
//! With the flux functions of these nodes last, M = [[A, C^T], [C, E]], where A has a block for each piece.
//! With A = L L^T, R = L^-1 D_A^T and X = L^-1 C^T, block elimination gives
//!
//! T = R^T R + V S^-1 V^T,    S = E - X^T X,    V = D_E - R^T X.
//!
//! The first part has a block for each piece, a column of V reaches the two pieces on either side of its
//! node, and S has one row for each such node. On lines of up to a few hundred modes a product with T takes
//! some twenty multiplications for each of them.

use crate::mixed::{IllConditioned, MixedSegment};
use crate::tensor::{Dense, Left, Right, Target, left, multiply, right, sized, target};
use elastocap_linalg::dense::{self, Llt};
use faer::{Mat, MatRef};
use rayon::prelude::*;
use std::ops::Range;

/// The least number of potential modes in a piece of a line. Products with matrices of this size take little
/// longer than reading the vectors from memory. Tuned: `cargo bench --bench solver`.
const MODES: usize = 12;

/// The operator T of a line between two obstacles, in the parts that products with it take.
#[derive(Debug, Clone)]
pub struct Condensed {
    pieces: Vec<Piece>,
    /// S^-1.
    coupling: Dense<f64>,
}

/// A piece of a line.
#[derive(Debug, Clone)]
struct Piece {
    /// The potential modes of this piece.
    modes: Range<usize>,
    /// The numbers of the nodes between pieces that are at the ends of this one.
    nodes: Range<usize>,
    /// The block of R^T R of this piece.
    diagonal: Dense<f64>,
    /// The rows of V of this piece.
    through: Dense<f64>,
    /// The transpose of `through`.
    transposed: Dense<f64>,
}

impl Condensed {
    /// Builds the operator from the mass of the fluxes, well scaled, and D^T (a row for each flux, a column
    /// for each potential mode). `nodes` has, for each node inside the line in ascending order, the first
    /// potential mode above it and the flux function through it. All functions are ordered along the line.
    ///
    /// # Errors
    /// [`IllConditioned`] if the mass cannot be factorised.
    pub fn new(
        mass: MatRef<'_, f64>,
        divergence: MatRef<'_, f64>,
        nodes: &[[usize; 2]],
    ) -> Result<Self, IllConditioned> {
        let cuts = cuts(nodes, divergence.ncols());
        let count = cuts.len();
        let mut schur = Mat::from_fn(count, count, |i, j| mass[(cuts[i][1], cuts[j][1])]);
        let (mut pieces, mut mode, mut function) = (Vec::new(), 0, 0);
        for index in 0..=count {
            let [next_mode, end] =
                cuts.get(index).copied().unwrap_or([divergence.ncols(), divergence.nrows()]);
            let (modes, functions, nodes) =
                (mode..next_mode, function..end, index.saturating_sub(1)..(index + 1).min(count));
            let block = |rows: &Range<usize>, columns: &Range<usize>| {
                divergence.submatrix(rows.start, columns.start, rows.len(), columns.len())
            };
            let (n, inner) = (modes.len(), block(&functions, &modes));
            let across = Mat::from_fn(functions.len(), nodes.len(), |i, j| {
                mass[(functions.start + i, cuts[nodes.start + j][1])]
            });
            let mut through =
                Mat::from_fn(n, nodes.len(), |i, j| divergence[(cuts[nodes.start + j][1], modes.start + i)]);
            let mut diagonal = Mat::zeros(n, n);
            if !functions.is_empty() {
                let inner_mass =
                    mass.submatrix(functions.start, functions.start, functions.len(), functions.len());
                let factor = Llt::new(inner_mass).map_err(|_| IllConditioned)?;
                let (mut root, mut across) = (inner.to_owned(), across);
                dense::solve_lower_triangular(factor.lower(), root.as_mut());
                dense::solve_lower_triangular(factor.lower(), across.as_mut());
                diagonal = dense::product(root.transpose(), root.as_ref());
                through -= dense::product(root.transpose(), across.as_ref());
                let correction = dense::product(across.transpose(), across.as_ref());
                for (i, row) in nodes.clone().enumerate() {
                    for (j, column) in nodes.clone().enumerate() {
                        schur[(row, column)] -= correction[(i, j)];
                    }
                }
            }
            pieces.push(Piece {
                modes,
                nodes,
                diagonal: Dense::from_mat(diagonal.as_ref()),
                transposed: Dense::from_mat(through.transpose()),
                through: Dense::from_mat(through.as_ref()),
            });
            (mode, function) = (next_mode, end + 1);
        }
        let inverse = if count == 0 {
            Mat::zeros(0, 0)
        } else {
            Llt::new(schur.as_ref()).map_err(|_| IllConditioned)?.solve(Mat::identity(count, count).as_ref())
        };
        // Symmetric to the last bit, which an inverse found column by column is not.
        let coupling = Mat::from_fn(count, count, |i, j| 0.5 * (inverse[(i, j)] + inverse[(j, i)]));
        Ok(Self { pieces, coupling: Dense::from_mat(coupling.as_ref()) })
    }

    /// Number of nodes between pieces.
    pub fn nodes(&self) -> usize {
        self.coupling.rows
    }

    /// S^-1 V^T x for the columns of `x`, one row for each node between pieces, into the first entries of
    /// `work`.
    pub fn between<'w>(&self, x: Right<'_, f64>, work: &'w mut Vec<f64>) -> &'w [f64] {
        let width = x.cols;
        let [out, traces] = halves(work, self.nodes() * width);
        for piece in self.pieces.iter().filter(|piece| !piece.nodes.is_empty()) {
            let values = right(x.data, piece.modes.start * x.stride, width, x.stride);
            multiply(piece.transposed.left(), values, target(traces, piece.nodes.start * width, width), true);
        }
        multiply(self.coupling.left(), right(traces, 0, width, width), target(out, 0, width), false);
        out
    }

    /// S^-1 V^T x as from [`Condensed::between`], for each of `count` arrays that begin `apart` entries apart
    /// in `x`, one after the other.
    pub fn between_each(&self, x: Right<'_, f64>, count: usize, apart: usize) -> Vec<f64> {
        let len = self.nodes() * x.cols;
        let mut out = vec![0.0; count * len];
        out.par_chunks_mut(len.max(1)).enumerate().for_each_init(Vec::new, |work, (k, out)| {
            out.copy_from_slice(self.between(right(x.data, k * apart, x.cols, x.stride), work));
        });
        out
    }

    /// `out += T x` for the rows `wanted` of T, which are those of `out`; `between` is the result of
    /// [`Condensed::between`] for `x`.
    pub fn add_rows(&self, wanted: Range<usize>, x: Right<'_, f64>, between: &[f64], out: Target<'_, f64>) {
        let Target { data, stride } = out;
        for Piece { modes, nodes, diagonal, through, .. } in &self.pieces {
            let rows = wanted.start.max(modes.start)..wanted.end.min(modes.end);
            if rows.is_empty() {
                continue;
            }
            let piece_rows = rows.start - modes.start..rows.end - modes.start;
            let mut add = |matrix: &Dense<f64>, from: Right<'_, f64>| {
                let to = target(data, (rows.start - wanted.start) * stride, stride);
                multiply(matrix.left_rows(piece_rows.clone()), from, to, true);
            };
            add(diagonal, right(x.data, modes.start * x.stride, x.cols, x.stride));
            if !nodes.is_empty() {
                add(through, right(between, nodes.start * x.cols, x.cols, x.cols));
            }
        }
    }

    /// `out += T x` for the columns of `x`.
    pub fn add_along_columns(&self, x: Right<'_, f64>, out: Target<'_, f64>, work: &mut Vec<f64>) {
        let modes = self.pieces.last().map_or(0, |piece| piece.modes.end);
        let between = self.between(x, work);
        self.add_rows(0..modes, x, between, out);
    }

    /// `out += x T` for the rows of `x`.
    pub fn add_along_rows(&self, x: Left<'_, f64>, out: Target<'_, f64>, work: &mut Vec<f64>) {
        let (count, rows) = (self.nodes(), x.rows);
        let [between, traces] = halves(work, count * rows);
        let part = |modes: &Range<usize>| left(x.data, modes.start, rows, modes.len(), x.row);
        for Piece { modes, nodes, through, .. } in self.pieces.iter().filter(|piece| !piece.nodes.is_empty())
        {
            multiply(part(modes), through.right(), target(traces, nodes.start, count), true);
        }
        if count > 0 {
            let to = target(between, 0, count);
            multiply(left(traces, 0, rows, count, count), self.coupling.right(), to, false);
        }
        let Target { data, stride } = out;
        for Piece { modes, nodes, diagonal, transposed, .. } in &self.pieces {
            multiply(part(modes), diagonal.right(), target(data, modes.start, stride), true);
            if !nodes.is_empty() {
                let from = left(between, nodes.start, rows, nodes.len(), count);
                multiply(from, transposed.right(), target(data, modes.start, stride), true);
            }
        }
    }
}

impl MixedSegment {
    /// The operator T = R^T R of this segment.
    ///
    /// # Errors
    /// Those of [`Condensed::new`].
    pub fn operator(&self) -> Result<Condensed, IllConditioned> {
        Condensed::new(self.mass.as_ref(), self.divergence.as_ref(), &self.nodes)
    }
}

/// Two arrays of `len` entries in `work`, the second one filled with zeros.
fn halves(work: &mut Vec<f64>, len: usize) -> [&mut [f64]; 2] {
    if work.len() < 2 * len {
        sized(work, 2 * len);
    }
    let (first, second) = work[..2 * len].split_at_mut(len);
    second.fill(0.0);
    [first, second]
}

/// The pairs of `nodes`, as [`Condensed::new`] takes them, at which a line of `modes` modes is cut, so that
/// each piece has at least [`MODES`] modes.
fn cuts(nodes: &[[usize; 2]], modes: usize) -> Vec<[usize; 2]> {
    let mut out: Vec<[usize; 2]> = Vec::new();
    for &[mode, function] in nodes {
        let last = out.last().map_or(0, |[mode, _]| *mode);
        if mode - last >= MODES && modes - mode >= MODES {
            out.push([mode, function]);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::line::{Line, LineEnd};
    use crate::mixed::{FluxEnd, mixed_segment};

    /// Strongly graded, with elements of degree 1 side by side, and long enough for several pieces, one of
    /// which is a single element.
    fn long() -> MixedSegment {
        let degrees = vec![1, 1, 2, 3, 4, 6, 13, 8, 5, 3, 2, 1, 1, 1, 2, 4, 7, 9, 3, 1];
        let widths = (0..degrees.len()).map(|e| 10.0_f64.powi(-((e % 5) as i32)));
        let nodes = std::iter::once(0.0).chain(widths.scan(0.0, |x, w| {
            *x += w;
            Some(*x)
        }));
        let line = Line { nodes: nodes.collect(), degrees, ends: [LineEnd::Finite; 2] };
        let permittivity: Vec<f64> = (0..line.elements()).map(|e| 1.0 + (e % 3) as f64).collect();
        let ends = [FluxEnd::Blocked, FluxEnd::Free];
        mixed_segment(&line, 0..line.elements(), &permittivity, ends, [0.0, 2.0]).unwrap()
    }

    /// With an infinite element below, which belongs to the first piece.
    fn open() -> MixedSegment {
        let ends = [LineEnd::Infinite { degree: 4, pole: 3.0 }, LineEnd::Finite];
        let line = Line { nodes: vec![0.0, 1.0, 1.5, 1.7], degrees: vec![9, 12, 3], ends };
        mixed_segment(&line, 0..4, &[1.0, 3.0, 2.0, 1.0], [FluxEnd::Free; 2], [0.0; 2]).unwrap()
    }

    fn short() -> MixedSegment {
        let line = Line { nodes: vec![0.0, 1.0, 1.5], degrees: vec![2, 3], ends: [LineEnd::Finite; 2] };
        mixed_segment(&line, 0..2, &[1.0, 3.0], [FluxEnd::Free; 2], [0.0; 2]).unwrap()
    }

    fn square_of_root(segment: &MixedSegment) -> Mat<f64> {
        dense::product(segment.root.transpose(), segment.root.as_ref())
    }

    fn values(count: usize) -> Vec<f64> {
        (0..count).map(|k| ((k * 37 % 101) as f64 - 50.0) / 8.0).collect()
    }

    #[test]
    fn the_operator_is_the_square_of_its_root_along_columns_and_along_rows() {
        let mut work = Vec::new();
        for (segment, nodes) in [(long(), 4), (open(), 1), (short(), 0)] {
            let (exact, operator) = (square_of_root(&segment), segment.operator().unwrap());
            assert_eq!(operator.nodes(), nodes);
            let (n, width, apart) = (exact.nrows(), 5, 7);
            // Entries of a sum are as large as the roots of the diagonal allow.
            let allowed = |i: usize| {
                let sum: f64 = (0..n).map(|m| (exact[(i, i)] * exact[(m, m)]).sqrt()).sum();
                1e-13 * (1.0 + 7.0 * sum)
            };
            let x = values(n * apart);
            let mut out = vec![1.0; n * apart];
            operator.add_along_columns(right(&x, 0, width, apart), target(&mut out, 0, apart), &mut work);
            for i in 0..n {
                for j in 0..width {
                    let sum: f64 = (0..n).map(|m| exact[(i, m)] * x[m * apart + j]).sum();
                    assert!((out[i * apart + j] - 1.0 - sum).abs() < allowed(i), "{i} {j}");
                }
                assert_eq!(out[i * apart + width..(i + 1) * apart], [1.0; 2]);
            }
            let (x, mut out) = (values(width * (n + 2)), vec![1.0; width * (n + 3)]);
            let from = left(&x, 0, width, n, n + 2);
            operator.add_along_rows(from, target(&mut out, 0, n + 3), &mut work);
            for j in 0..width {
                for i in 0..n {
                    let sum: f64 = (0..n).map(|m| exact[(i, m)] * x[j * (n + 2) + m]).sum();
                    assert!((out[j * (n + 3) + i] - 1.0 - sum).abs() < allowed(i), "{i} {j}");
                }
                assert_eq!(out[j * (n + 3) + n..(j + 1) * (n + 3)], [1.0; 3]);
            }
        }
    }

    #[test]
    fn some_rows_are_the_same_bytes_as_all_of_them() {
        let operator = long().operator().unwrap();
        let (n, width) = (operator.pieces.last().unwrap().modes.end, 3);
        let (x, mut work) = (values(n * width), Vec::new());
        let x = right(&x, 0, width, width);
        let mut whole = vec![0.0; n * width];
        operator.add_along_columns(x, target(&mut whole, 0, width), &mut work);
        let between = operator.between(x, &mut work);
        for some in [0..5, 5..31, 31..n] {
            let mut part = vec![0.0; some.len() * width];
            operator.add_rows(some.clone(), x, between, target(&mut part, 0, width));
            assert_eq!(part, whole[some.start * width..some.end * width]);
        }
    }

    #[test]
    fn other_modes_of_each_element_give_the_same_energies() {
        // Two modes of the last element but two, which has nine, turned by an angle.
        let (segment, c, s) = (long(), 0.6, 0.8);
        let n = segment.root.ncols();
        let first = n - 1 - 3 - 9 + 2;
        let turned = long().with_modes(|rows| {
            let mut out = rows.to_owned();
            for j in 0..rows.ncols() {
                out[(first, j)] = c * rows[(first, j)] + s * rows[(first + 1, j)];
                out[(first + 1, j)] = c * rows[(first + 1, j)] - s * rows[(first, j)];
            }
            out
        });
        let x = values(n);
        let mut of_turned = x.clone();
        of_turned[first] = c * x[first] + s * x[first + 1];
        of_turned[first + 1] = c * x[first + 1] - s * x[first];
        let energies = |segment: &MixedSegment, x: &[f64]| {
            let flux = |i: usize| (0..n).map(|m| segment.root[(i, m)] * x[m]).sum::<f64>();
            let of_root: f64 = (0..segment.root.nrows()).map(|i| flux(i).powi(2)).sum();
            let (mut out, operator) = (vec![0.0; n], segment.operator().unwrap());
            operator.add_along_columns(right(x, 0, 1, 1), target(&mut out, 0, 1), &mut Vec::new());
            [of_root, out.iter().zip(x).map(|(y, x)| y * x).sum::<f64>()]
        };
        let exact = energies(&segment, &x);
        for found in exact.into_iter().chain(energies(&turned, &of_turned)) {
            assert!((found - exact[0]).abs() < 1e-12 * exact[0], "{found} {exact:?}");
        }
    }
}
