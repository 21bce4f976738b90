//! The mixed pair of a line: continuous fluxes of degree p, discontinuous potentials of degree p - 1.
//!
//! Potentials are kept in an orthonormal basis (scaled Legendre polynomials; on an infinite element the orthonormalised
//! derivatives of the flux functions), so that div maps fluxes *onto* potentials and a flux whose divergence is
//! orthogonal to all potentials is exactly divergence-free. Eliminating the flux leaves one dense matrix per line,
//! T = D M^-1 D^T: the 1D factor of the dual operator.

use crate::line::{Element, Line, LineEnd, Numbering, element_matrices, line_matrices};
use faer::linalg::solvers::Solve;
use faer::{Mat, Side};
use std::ops::Range;

/// What the flux does at an end of a segment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum FluxEnd {
    /// The potential is prescribed there and the flux is free (a conductor, a grounded or an odd plane).
    Free,
    /// No flux passes (an insulated wall, an even plane).
    Blocked,
}

/// Flux that goes on beyond an end: the energy of its continuation, per unit of squared flux through the end and in
/// units of the resistance 1 / permittivity of the element there. Zero where the flux ends.
pub type Continuation = [f64; 2];

/// The dual 1D operator of a run of elements between two obstacles.
#[derive(Debug, Clone)]
pub struct MixedSegment {
    /// D M^-1 D^T, square, one row per potential mode of the run.
    pub t: Mat<f64>,
    /// D M^-1 g for unit potential at the lower and at the upper end (zero where the flux is not free).
    pub face: [Vec<f64>; 2],
    /// g_a M^-1 g_b for unit potentials at the ends.
    pub face_energy: [[f64; 2]; 2],
}

/// A line's potentials cannot be orthonormalised or its mass matrix factorised: elements too unequal for f64.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("a line of the grid is too unequal for double precision")]
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

/// Builds the segment of `elements` with permittivity `permittivity[e]` (of the whole line) between the given ends.
pub fn mixed_segment(
    line: &Line,
    elements: Range<usize>,
    permittivity: &[f64],
    ends: [FluxEnd; 2],
    continuation: Continuation,
) -> Result<MixedSegment, IllConditioned> {
    let piece = sub_line(line, elements.clone());
    let mass = flux_mass(&piece, &permittivity[elements], continuation);
    let divergence = divergence_matrix(&piece)?;
    let numbering = Numbering::new(&piece);
    let lo = usize::from(ends[0] == FluxEnd::Blocked);
    let hi = numbering.len - usize::from(ends[1] == FluxEnd::Blocked);
    let mass = mass.as_ref().submatrix(lo, lo, hi - lo, hi - lo);
    let divergence = divergence.as_ref().subcols(lo, hi - lo);
    let factor = mass.llt(Side::Lower).map_err(|_| IllConditioned)?;
    let inverse_dt = factor.solve(divergence.transpose());
    let mut t = divergence * &inverse_dt;
    for i in 0..t.nrows() {
        for j in 0..i {
            let mean = 0.5 * (t[(i, j)] + t[(j, i)]);
            t[(i, j)] = mean;
            t[(j, i)] = mean;
        }
    }
    // Outward unit normal at the ends; the end functions are the first and the last of the run.
    let end_index = [0, hi - lo - 1];
    let sign = [-1.0, 1.0];
    let mut face = [vec![0.0; t.nrows()], vec![0.0; t.nrows()]];
    let mut face_energy = [[0.0; 2]; 2];
    for a in 0..2 {
        if ends[a] != FluxEnd::Free {
            continue;
        }
        let mut g = Mat::zeros(hi - lo, 1);
        g[(end_index[a], 0)] = sign[a];
        let solved = factor.solve(&g);
        let column = divergence * &solved;
        face[a] = column.col(0).iter().copied().collect();
        for b in 0..2 {
            if ends[b] == FluxEnd::Free {
                face_energy[a][b] = sign[b] * solved[(end_index[b], 0)];
            }
        }
    }
    Ok(MixedSegment { t, face, face_energy })
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

/// The line of a run of elements alone.
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

/// D: row = potential mode, column = flux function.
pub(crate) fn divergence_matrix(line: &Line) -> Result<Mat<f64>, IllConditioned> {
    let numbering = Numbering::new(line);
    let offsets = potential_offsets(line);
    let mut d = Mat::zeros(offsets[line.elements()], numbering.len);
    for e in 0..line.elements() {
        let at = numbering.element(line, e);
        let p = line.degree(e);
        match line.element(e) {
            Element::Finite { length, .. } => {
                for (local, sign) in [(0, -1.0), (1, 1.0)] {
                    if let Some(column) = at[local] {
                        d[(offsets[e], column)] = sign / length.sqrt();
                    }
                }
                for j in 2..=p {
                    if let Some(column) = at[j] {
                        d[(offsets[e] + j - 1, column)] = (2.0 / length).sqrt();
                    }
                }
            }
            element @ Element::Infinite { .. } => {
                // Potentials are the derivatives of the flux functions, orthonormalised: their Gram matrix is the
                // stiffness K = R^T R, hence D = R.
                let (_, stiffness) = element_matrices(element, p);
                let present: Vec<usize> = (0..=p).filter(|&l| at[l].is_some()).collect();
                let gram = Mat::from_fn(p, p, |i, j| stiffness[(present[i], present[j])]);
                let factor = gram.llt(Side::Lower).map_err(|_| IllConditioned)?;
                let lower = factor.L();
                for (j, &local) in present.iter().enumerate() {
                    if let Some(column) = at[local] {
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

    /// Resistance of the segment between unit and zero potential: energy g M^-1 g - v T^-1 v is the capacitance
    /// per unit area.
    fn capacitance(segment: &MixedSegment) -> f64 {
        let n = segment.t.nrows();
        let v = Mat::from_fn(n, 1, |i, _| segment.face[0][i]);
        let x = segment.t.llt(Side::Lower).unwrap().solve(&v);
        segment.face_energy[0][0] - (0..n).map(|i| v[(i, 0)] * x[(i, 0)]).sum::<f64>()
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
        let s = mixed_segment(&line(), 0..2, &[2.0, 4.0], [FluxEnd::Free, FluxEnd::Free], [0.0, 3.0]).unwrap();
        assert!((capacitance(&s) - 1.0 / (0.2 / 2.0 + 0.8 / 4.0 + 3.0 / 4.0)).abs() < 1e-12);
    }
}
