//! The mixed pair of a line: continuous fluxes of degree p, discontinuous potentials of degree p - 1.
//!
//! Potentials are kept in an orthonormal basis (scaled Legendre polynomials), so that div maps fluxes *onto*
//! potentials and a flux whose divergence is orthogonal to all potentials is exactly divergence-free.
//! Eliminating the flux gives one matrix per line, T = D M^-1 D^T: the 1D factor of the dual operator.
//! Products with it are those of [`crate::condensed`].
//!
//! Everything is computed from R = L^-1 D^T with M = L L^T. The product T = R^T R keeps only half the digits
//! of R; energies are therefore summed as squares of R phi + L^-1 g, in which nothing cancels.

use crate::line::{Element, Line, LineEnd, Numbering, element_matrices, hierarchical, line_matrices};
use crate::quadrature::{gauss_legendre, legendre};
use elastocap_linalg::dense::{self, Llt};
use faer::{Mat, MatRef};
use std::ops::Range;

/// The condition on the flux at one end of a segment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum FluxEnd {
    /// The potential is prescribed there and the flux is free (a conductor, a grounded or an odd plane).
    Free,
    /// No flux passes (an insulated wall, an even plane).
    Blocked,
}

/// Energy of a flux's continuation beyond either end, per unit of squared flux through the end and in units
/// of the resistance 1 / permittivity of the element there. Zero where the flux ends.
pub type Continuation = [f64; 2];

/// The dual 1D operator of a run of elements between two obstacles, in the basis scaled by the square root of
/// the permittivity. E is the diagonal matrix of the permittivities of the modes, and g the source of a unit
/// potential at an end. Nothing in it but `face` changes when the permittivity is multiplied by a constant.
#[derive(Debug, Clone)]
pub struct MixedSegment {
    /// R = L^-1 D^T E^-1/2: one row per flux function, one column per potential mode.
    pub root: Mat<f64>,
    /// L^-1 g for a unit potential at the lower and at the upper end (zero where the flux is not free).
    pub face: [Vec<f64>; 2],
    /// The mass of the fluxes, scaled to unit diagonal.
    pub(crate) mass: Mat<f64>,
    /// D^T E^-1/2 in the same scaling.
    pub(crate) divergence: Mat<f64>,
    /// For each node inside the run, the first potential mode above it and the flux function through it.
    pub(crate) nodes: Vec<[usize; 2]>,
}

impl MixedSegment {
    /// This segment in another orthonormal basis of the potentials. `change` takes rows in the present basis
    /// to rows in the other one, and combines modes of the same element only.
    pub fn with_modes(mut self, change: impl Fn(&Mat<f64>) -> Mat<f64>) -> Self {
        for matrix in [&mut self.root, &mut self.divergence] {
            *matrix = change(&matrix.transpose().to_owned()).transpose().to_owned();
        }
        self
    }

    /// R^T L^-1 g for a unit potential at the end `side`.
    pub fn face_source(&self, side: usize) -> Vec<f64> {
        (0..self.root.ncols())
            .map(|j| (0..self.root.nrows()).map(|i| self.root[(i, j)] * self.face[side][i]).sum())
            .collect()
    }
}

/// The error of a line whose elements differ too much in size for double precision: its potentials cannot be
/// orthonormalised, or a matrix of it cannot be factorised.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the elements along a line of the grid differ too much in size for double precision")]
pub struct IllConditioned;

/// First potential mode of each element, and one past the last: `degree(e)` modes per element.
pub fn potential_offsets(line: &Line) -> Vec<usize> {
    let mut offsets = vec![0];
    for e in 0..line.elements() {
        offsets.push(offsets[e] + line.degree(e));
    }
    offsets
}

/// Coefficients of the constant 1 on the finite elements of a line (an infinite element holds no constant).
pub fn ones(line: &Line) -> Vec<f64> {
    let offsets = potential_offsets(line);
    let mut out = vec![0.0; offsets[line.elements()]];
    for e in 0..line.elements() {
        if let Element::Finite { length, .. } = line.element(e) {
            out[offsets[e]] = length.sqrt();
        }
    }
    out
}

/// Integrals over the finite elements of a line of each potential mode (rows) with each continuous function
/// (columns, in the order of [`Numbering`]): the coefficients of the best approximation of each continuous
/// function by potential modes.
pub fn potential_modes_of(line: &Line) -> Mat<f64> {
    let (numbering, finite) =
        (Numbering::new(line), line.first_finite()..line.first_finite() + line.degrees.len());
    let mut out = Mat::zeros(line.degrees.iter().sum(), numbering.len);
    let mut first = 0;
    for e in finite {
        let (functions, p) = (numbering.element(line, e), line.degree(e));
        let Element::Finite { length, .. } = line.element(e) else { continue };
        let (points, weights) = gauss_legendre(p + 1);
        for (&s, &w) in points.iter().zip(&weights) {
            let (values, _) = hierarchical(p, s);
            for (n, polynomial) in legendre(p - 1, s).iter().enumerate() {
                let mode = ((2 * n + 1) as f64 / length).sqrt() * polynomial;
                for (function, value) in functions.iter().zip(&values) {
                    if let Some(column) = function {
                        out[(first + n, *column)] += w * 0.5 * length * mode * value;
                    }
                }
            }
        }
        first += p;
    }
    out
}

/// Builds the segment of `elements` with permittivity `permittivity[e]` (of the whole line) between the given
/// ends.
///
/// # Errors
/// [`IllConditioned`] if the elements differ too much in size for double precision.
pub fn mixed_segment(
    line: &Line,
    elements: Range<usize>,
    permittivity: &[f64],
    ends: [FluxEnd; 2],
    continuation: Continuation,
) -> Result<MixedSegment, IllConditioned> {
    let piece = sub_line(line, elements.clone());
    let weights = &permittivity[elements];
    let mass = flux_mass(&piece, weights, continuation);
    let divergence = divergence_matrix(&piece)?;
    let blocked = |a: usize| usize::from(ends[a] == FluxEnd::Blocked);
    let (from, to) = (blocked(0), mass.nrows() - blocked(1));
    let n = to - from;
    // Scaled to unit diagonal the mass is well conditioned however graded the line is.
    let mass = mass.as_ref().submatrix(from, from, n, n).to_owned();
    let (lower, scale) = scaled_factor(&mass)?;
    let offsets = potential_offsets(&piece);
    let per_mode: Vec<f64> = weights
        .iter()
        .enumerate()
        .flat_map(|(e, w)| std::iter::repeat_n(1.0 / w.sqrt(), offsets[e + 1] - offsets[e]))
        .collect();
    let divergence =
        Mat::from_fn(n, divergence.nrows(), |i, j| divergence[(j, from + i)] * per_mode[j] * scale[i]);
    let mut root = divergence.clone();
    dense::solve_lower_triangular(lower.as_ref(), root.as_mut());
    // Outward unit normal at the ends; the end functions are the first and the last of the run.
    let face = [(0, -1.0), (n - 1, 1.0)].map(|(index, sign)| {
        let mut g = Mat::zeros(n, 1);
        g[(index, 0)] = sign * scale[index];
        dense::solve_lower_triangular(lower.as_ref(), g.as_mut());
        g.col(0).iter().copied().collect::<Vec<f64>>()
    });
    let face = [0, 1].map(|a| if ends[a] == FluxEnd::Free { face[a].clone() } else { vec![0.0; n] });
    let mass = Mat::from_fn(n, n, |i, j| scale[i] * mass[(i, j)] * scale[j]);
    let (first, numbering) = (piece.first_finite(), Numbering::new(&piece));
    let nodes = (1..piece.elements()).map(|e| [offsets[e], numbering.vertex[e - first] - from]).collect();
    Ok(MixedSegment { root, face, mass, divergence, nodes })
}

/// The coordinates of a segment's fluxes, in which a flux y has the energy y . y: those of
/// `MixedSegment::root` and `MixedSegment::face`.
#[derive(Debug, Clone)]
pub struct FluxCoordinates {
    /// L, the Cholesky factor of the scaled mass.
    lower: Mat<f64>,
    /// S, the scaling of the mass.
    scale: Vec<f64>,
}

impl FluxCoordinates {
    /// Factorises the mass of the fluxes; the arguments are those of [`mixed_segment`].
    ///
    /// # Errors
    /// [`IllConditioned`] if the elements differ too much in size for double precision.
    pub fn new(
        line: &Line,
        elements: Range<usize>,
        permittivity: &[f64],
        ends: [FluxEnd; 2],
        continuation: Continuation,
    ) -> Result<Self, IllConditioned> {
        let piece = sub_line(line, elements.clone());
        let mass = flux_mass(&piece, &permittivity[elements], continuation);
        let blocked = |a: usize| usize::from(ends[a] == FluxEnd::Blocked);
        let (from, to) = (blocked(0), mass.nrows() - blocked(1));
        let n = to - from;
        let (lower, scale) = scaled_factor(&mass.as_ref().submatrix(from, from, n, n).to_owned())?;
        Ok(Self { lower, scale })
    }

    /// Coefficients of the flux functions (rows) for unit coordinates (columns): S L^-T.
    pub fn coefficients(&self) -> Mat<f64> {
        let n = self.scale.len();
        let mut out = Mat::identity(n, n);
        dense::solve_upper_triangular(self.lower.transpose(), out.as_mut());
        Mat::from_fn(n, n, |i, j| self.scale[i] * out[(i, j)])
    }

    /// The coordinates (rows) of fluxes with the given coefficients, one flux in each column: L^T S^-1 times
    /// the coefficients.
    pub fn of(&self, coefficients: MatRef<'_, f64>) -> Mat<f64> {
        let unscaled = Mat::from_fn(coefficients.nrows(), coefficients.ncols(), |i, j| {
            coefficients[(i, j)] / self.scale[i]
        });
        dense::product(self.lower.transpose(), unscaled.as_ref())
    }
}

/// Cholesky factor of S M S with S = diag(M)^-1/2, and S.
pub(crate) fn scaled_factor(mass: &Mat<f64>) -> Result<(Mat<f64>, Vec<f64>), IllConditioned> {
    let n = mass.nrows();
    let scale: Vec<f64> = (0..n).map(|i| 1.0 / mass[(i, i)].sqrt()).collect();
    let scaled = Mat::from_fn(n, n, |i, j| scale[i] * mass[(i, j)] * scale[j]);
    let factor = Llt::new(scaled.as_ref()).map_err(|_| IllConditioned)?;
    Ok((factor.into_lower(), scale))
}

/// Mass of the fluxes of a line weighted by the resistance 1 / permittivity, continuations included.
pub(crate) fn flux_mass(line: &Line, permittivity: &[f64], continuation: Continuation) -> Mat<f64> {
    let resistance: Vec<f64> = permittivity.iter().map(|e| 1.0 / e).collect();
    let (mut mass, _) = line_matrices(line, &resistance);
    let last = mass.nrows() - 1;
    mass[(0, 0)] += continuation[0] * resistance[0];
    mass[(last, last)] += continuation[1] * resistance[resistance.len() - 1];
    mass
}

/// The part of a line with the given elements.
pub(crate) fn sub_line(line: &Line, elements: Range<usize>) -> Line {
    let first = line.first_finite();
    let low_infinite = elements.start < first;
    let high_infinite = elements.end > first + line.degrees.len();
    let from = elements.start.saturating_sub(first);
    let to = (elements.end - first).min(line.degrees.len());
    Line {
        nodes: line.nodes[from..=to].to_vec(),
        degrees: line.degrees[from..to].to_vec(),
        ends: [
            if low_infinite { line.ends[0] } else { LineEnd::Finite },
            if high_infinite { line.ends[1] } else { LineEnd::Finite },
        ],
    }
}

/// D: row = potential mode, column = flux function; D^T D is the stiffness of the line's continuous
/// functions.
///
/// # Errors
/// [`IllConditioned`] if the functions of an infinite element cannot be orthonormalised.
pub fn divergence_matrix(line: &Line) -> Result<Mat<f64>, IllConditioned> {
    let numbering = Numbering::new(line);
    let offsets = potential_offsets(line);
    let mut d = Mat::zeros(offsets[line.elements()], numbering.len);
    for e in 0..line.elements() {
        let indices = numbering.element(line, e);
        let p = line.degree(e);
        match line.element(e) {
            Element::Finite { length, .. } => {
                for (local, sign) in [(0, -1.0), (1, 1.0)] {
                    if let Some(column) = indices[local] {
                        d[(offsets[e], column)] = sign / length.sqrt();
                    }
                }
                for j in 2..=p {
                    if let Some(column) = indices[j] {
                        d[(offsets[e] + j - 1, column)] = (2.0 / length).sqrt();
                    }
                }
            }
            element @ Element::Infinite { .. } => {
                // Potentials are the derivatives of the flux functions, orthonormalised: their Gram matrix is
                // the stiffness K = R^T R, hence D = R.
                let (_, stiffness) = element_matrices(element, p);
                let present: Vec<usize> = (0..=p).filter(|&l| indices[l].is_some()).collect();
                let gram = Mat::from_fn(p, p, |i, j| stiffness[(present[i], present[j])]);
                let factor = Llt::new(gram.as_ref()).map_err(|_| IllConditioned)?;
                let lower = factor.lower();
                for (j, &local) in present.iter().enumerate() {
                    if let Some(column) = indices[local] {
                        for i in 0..=j {
                            d[(offsets[e] + i, column)] = lower[(j, i)];
                        }
                    }
                }
            }
        }
    }
    Ok(d)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line() -> Line {
        Line { nodes: vec![0.5, 0.7, 1.5], degrees: vec![2, 3], ends: [LineEnd::Finite; 2] }
    }

    /// Resistance of the segment between unit and zero potential: energy g M^-1 g - v T^-1 v is the
    /// capacitance per unit area.
    fn capacitance(segment: &MixedSegment) -> f64 {
        let t = dense::product(segment.root.transpose(), segment.root.as_ref());
        let source = segment.face_source(0);
        let n = source.len();
        let v = Mat::from_fn(n, 1, |i, _| source[i]);
        let x = Llt::new(t.as_ref()).unwrap().solve(v.as_ref());
        let y: Vec<f64> = (0..segment.root.nrows())
            .map(|i| segment.face[0][i] - (0..n).map(|j| segment.root[(i, j)] * x[(j, 0)]).sum::<f64>())
            .collect();
        y.iter().map(|y| y * y).sum()
    }

    #[test]
    fn a_layered_capacitor_in_one_dimension_is_exact() {
        let s = mixed_segment(&line(), 0..2, &[2.0, 4.0], [FluxEnd::Free, FluxEnd::Free], [0.0; 2]).unwrap();
        let exact = 1.0 / (0.2 / 2.0 + 0.8 / 4.0);
        assert!((capacitance(&s) - exact).abs() < 1e-12);
    }

    #[test]
    fn nothing_flows_to_an_insulated_end() {
        let s = mixed_segment(&line(), 0..2, &[1.0; 2], [FluxEnd::Free, FluxEnd::Blocked], [0.0; 2]).unwrap();
        assert!(capacitance(&s).abs() < 1e-12);
    }

    #[test]
    fn a_continuation_adds_its_resistance() {
        let s =
            mixed_segment(&line(), 0..2, &[2.0, 4.0], [FluxEnd::Free, FluxEnd::Free], [0.0, 3.0]).unwrap();
        assert!((capacitance(&s) - 1.0 / (0.2 / 2.0 + 0.8 / 4.0 + 3.0 / 4.0)).abs() < 1e-12);
    }

    #[test]
    fn a_continuation_below_the_line_counts_with_the_permittivity_there() {
        let s =
            mixed_segment(&line(), 0..2, &[2.0, 4.0], [FluxEnd::Free, FluxEnd::Free], [3.0, 0.0]).unwrap();
        assert!((capacitance(&s) - 1.0 / (3.0 / 2.0 + 0.2 / 2.0 + 0.8 / 4.0)).abs() < 1e-12);
    }

    #[test]
    fn nothing_flows_between_ends_of_the_same_potential() {
        let permittivity = [2.0, 4.0];
        let s =
            mixed_segment(&line(), 0..2, &permittivity, [FluxEnd::Free, FluxEnd::Free], [1.0, 3.0]).unwrap();
        // The potential is 1 everywhere; in the basis of the segment it is scaled by the root of the
        // permittivity.
        let (one, offsets) = (ones(&line()), potential_offsets(&line()));
        let element = |j: usize| usize::from(j >= offsets[1]);
        for i in 0..s.root.nrows() {
            let inside: f64 =
                (0..one.len()).map(|j| s.root[(i, j)] * one[j] * permittivity[element(j)].sqrt()).sum();
            assert!((s.face[0][i] + s.face[1][i] - inside).abs() < 1e-12, "{i}: {:?} {inside}", s.face);
        }
    }

    /// Lines that end, and that reach infinity on one side or both.
    fn lines() -> Vec<Line> {
        let infinite = LineEnd::Infinite { degree: 3, pole: 1.0 };
        [LineEnd::Finite, infinite]
            .into_iter()
            .flat_map(|low| [LineEnd::Finite, infinite].map(|high| Line { ends: [low, high], ..line() }))
            .collect()
    }

    #[test]
    fn the_divergence_maps_onto_an_orthonormal_basis_so_that_its_square_is_the_stiffness() {
        for line in lines() {
            let d = divergence_matrix(&line).unwrap();
            let square = dense::product(d.transpose(), d.as_ref());
            let (_, stiffness) = line_matrices(&line, &vec![1.0; line.elements()]);
            for i in 0..stiffness.nrows() {
                for j in 0..stiffness.ncols() {
                    let (found, exact) = (square[(i, j)], stiffness[(i, j)]);
                    assert!((found - exact).abs() < 1e-11, "{line:?} ({i}, {j}): {found} {exact}");
                }
            }
        }
    }

    #[test]
    fn what_leaves_a_line_at_its_ends_is_the_integral_of_the_divergence() {
        let (d, one) = (divergence_matrix(&line()).unwrap(), ones(&line()));
        assert!((one.iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-15, "the length of the line");
        let last = d.ncols() - 1;
        for column in 0..=last {
            let integral: f64 = (0..one.len()).map(|row| one[row] * d[(row, column)]).sum();
            let leaves = if column == 0 { -1.0 } else { f64::from(u8::from(column == last)) };
            assert!((integral - leaves).abs() < 1e-14, "{column}: {integral}");
        }
    }

    #[test]
    fn a_run_of_elements_is_the_same_alone_and_in_a_line_that_reaches_further() {
        let alone =
            mixed_segment(&line(), 0..2, &[2.0, 4.0], [FluxEnd::Free, FluxEnd::Blocked], [0.0; 2]).unwrap();
        for longer in lines() {
            let first = longer.first_finite();
            let mut permittivity = vec![9.0; longer.elements()];
            permittivity[first..first + 2].copy_from_slice(&[2.0, 4.0]);
            let ends = [FluxEnd::Free, FluxEnd::Blocked];
            let run = mixed_segment(&longer, first..first + 2, &permittivity, ends, [0.0; 2]).unwrap();
            assert_eq!((run.root, run.face), (alone.root.clone(), alone.face.clone()), "{longer:?}");
        }
    }
}
