//! Modes of a line: the eigenvectors that diagonalise its mass and stiffness together.
//!
//! On graded lines the eigenvalues span the square of the ratio of the largest to the smallest element, which
//! soon exceeds the range of double precision: an eigensolver that is accurate relative to the largest
//! eigenvalue loses the smooth modes. The primal and the dual problem are both of the form B^T B, so the
//! singular values of B are computed instead; their range is the square root of that of the eigenvalues, and
//! the smooth modes keep half the digits or more at any grading.

use crate::line::{Line, line_matrices};
use crate::mixed::{
    Continuation, FluxEnd, IllConditioned, divergence_matrix, mixed_segment, potential_offsets,
    scaled_factor, sub_line,
};
use elastocap_linalg::dense;
use faer::Mat;
use std::ops::Range;

/// The modes of a line: eigenvectors and their eigenvalues, which are not negative.
#[derive(Debug, Clone)]
pub struct LineModes {
    /// The eigenvectors, one column per mode.
    pub vectors: Mat<f64>,
    /// The eigenvalue of each mode, ascending.
    pub values: Vec<f64>,
}

/// Modes of stiffness against mass, `K u = lambda M u`, `u^T M u = 1`, of the continuous functions on
/// `elements`, both weighted by `permittivity` (per element of the whole line); `held` drops the function of
/// an end node.
///
/// # Errors
/// [`IllConditioned`] if the elements differ too much in size for double precision.
pub fn primal_modes(
    line: &Line,
    elements: Range<usize>,
    permittivity: &[f64],
    held: [bool; 2],
) -> Result<LineModes, IllConditioned> {
    primal_modes_beyond(line, elements, permittivity, held, [[0.0; 2]; 2])
}

/// The modes of [`primal_modes`] for functions that continue beyond the ends of the line: `beyond[side]` is
/// the mass and the stiffness that the continuation of a function with the value 1 at that end adds.
///
/// # Errors
/// [`IllConditioned`] if the elements differ too much in size for double precision.
pub fn primal_modes_beyond(
    line: &Line,
    elements: Range<usize>,
    permittivity: &[f64],
    held: [bool; 2],
    beyond: [[f64; 2]; 2],
) -> Result<LineModes, IllConditioned> {
    let piece = sub_line(line, elements.clone());
    let weights = &permittivity[elements];
    let (mut mass, _) = line_matrices(&piece, weights);
    let last = mass.nrows() - 1;
    mass[(0, 0)] += beyond[0][0];
    mass[(last, last)] += beyond[1][0];
    let divergence = divergence_matrix(&piece)?;
    let (from, to) = (usize::from(held[0]), mass.nrows() - usize::from(held[1]));
    let n = to - from;
    // K = D^T E D: with M = L L^T the modes are L^-T v for the right singular vectors v of E^1/2 D L^-T.
    let (lower, scale) = scaled_factor(&mass.as_ref().submatrix(from, from, n, n).to_owned())?;
    let offsets = potential_offsets(&piece);
    let root: Vec<f64> = weights
        .iter()
        .enumerate()
        .flat_map(|(e, w)| std::iter::repeat_n(w.sqrt(), offsets[e + 1] - offsets[e]))
        .collect();
    // The stiffness beyond the ends is a sum of squares too.
    let ends = [(0, beyond[0][1]), (last, beyond[1][1])].map(|(end, stiffness)| (end, stiffness.sqrt()));
    let (count, extra) = (divergence.nrows(), ends.iter().filter(|(_, root)| *root > 0.0).count());
    let extra_rows: Vec<_> = ends.iter().filter(|(_, root)| *root > 0.0).collect();
    let mut b = Mat::from_fn(n, count + extra, |i, j| match j.checked_sub(count) {
        None => divergence[(j, from + i)] * root[j] * scale[i],
        Some(k) if extra_rows[k].0 == from + i => extra_rows[k].1 * scale[i],
        Some(_) => 0.0,
    });
    dense::solve_lower_triangular(lower.as_ref(), b.as_mut());
    let (mut vectors, values) = left_singular(&b)?;
    dense::solve_upper_triangular(lower.transpose(), vectors.as_mut());
    for i in 0..n {
        for j in 0..n {
            vectors[(i, j)] *= scale[i];
        }
    }
    Ok(LineModes { vectors, values })
}

/// Modes of the dual matrix T of a run of elements in the basis scaled by the root of the permittivity.
///
/// # Errors
/// [`IllConditioned`] if the elements differ too much in size for double precision.
pub fn dual_modes(
    line: &Line,
    elements: Range<usize>,
    permittivity: &[f64],
    ends: [FluxEnd; 2],
    continuation: Continuation,
) -> Result<LineModes, IllConditioned> {
    let root = mixed_segment(line, elements, permittivity, ends, continuation)?.root;
    let (vectors, values) = left_singular(&root.transpose().to_owned())?;
    Ok(LineModes { vectors, values })
}

/// All left singular vectors of `b` and the squares of their singular values, ascending. A vector without a
/// singular value, where `b` has fewer columns than rows, has the value zero.
fn left_singular(b: &Mat<f64>) -> Result<(Mat<f64>, Vec<f64>), IllConditioned> {
    let n = b.nrows();
    let (u, sigma) = dense::left_singular_vectors(b.as_ref()).map_err(|_| IllConditioned)?;
    let values = (0..n).map(|j| sigma.get(n - 1 - j).map_or(0.0, |s| s * s)).collect();
    Ok((Mat::from_fn(n, n, |i, j| u[(i, n - 1 - j)]), values))
}
