//! A basis of a line's discontinuous potentials in which the squared distance from a point is diagonal.
//!
//! The energy of a flux that leaves a box along rays from a pole grows with the obliqueness: on the face x = R by the factor
//! 1 + (y^2 + z^2) / R^2. This sum becomes diagonal when multiplication by y^2 is diagonal on one axis and multiplication by z^2 on
//! the other.

use crate::line::{Element, Line};
use crate::mixed::IllConditioned;
use elastocap_linalg::dense;
use faer::Mat;

/// Orthogonal changes of basis, one per element, and the squared distances on the diagonal in the new basis.
#[derive(Debug, Clone)]
pub struct RadialBasis {
    /// Columns are the new functions in terms of the orthonormal Legendre ones.
    pub blocks: Vec<Mat<f64>>,
    /// m^2, one per potential mode.
    pub squares: Vec<f64>,
}

impl RadialBasis {
    /// Diagonalises multiplication by (x - pole)^2 on every element of a line without infinite ends.
    ///
    /// # Errors
    /// [`IllConditioned`] if the line has an infinite element, or an eigenvalue problem fails.
    pub fn new(line: &Line, pole: f64) -> Result<Self, IllConditioned> {
        let (mut blocks, mut squares) = (Vec::new(), Vec::new());
        for e in 0..line.elements() {
            let Element::Finite { start, length } = line.element(e) else { return Err(IllConditioned) };
            let (centre, half, p) = (start + 0.5 * length - pole, 0.5 * length, line.degree(e));
            // s phi_n = a_{n+1} phi_{n+1} + a_n phi_{n-1} for orthonormal Legendre polynomials.
            let a = |n: usize| n as f64 / ((2 * n - 1) as f64 * (2 * n + 1) as f64).sqrt();
            let square = Mat::from_fn(p, p, |i, j| match i.abs_diff(j) {
                0 => {
                    let s2 = a(i + 1).powi(2) + if i > 0 { a(i).powi(2) } else { 0.0 };
                    centre * centre + half * half * s2
                }
                1 => 2.0 * centre * half * a(i.max(j)),
                2 => half * half * a(i.max(j)) * a(i.max(j) - 1),
                _ => 0.0,
            });
            let (vectors, values) =
                dense::symmetric_eigenvectors(square.as_ref()).map_err(|_| IllConditioned)?;
            // A squared distance is not negative; rounding can make an eigenvalue so.
            squares.extend(values.iter().map(|s| s.max(0.0)));
            blocks.push(vectors);
        }
        Ok(Self { blocks, squares })
    }

    /// The basis of a run of elements: `rows` (one per mode of the run, in the Legendre basis) become rows in this one.
    pub fn rotate_rows(&self, first_element: usize, rows: &Mat<f64>) -> Mat<f64> {
        let mut out = Mat::zeros(rows.nrows(), rows.ncols());
        let mut at = 0;
        for block in &self.blocks[first_element..] {
            if at == rows.nrows() {
                break;
            }
            let p = block.nrows();
            let turned = dense::product(block.transpose(), rows.as_ref().subrows(at, p));
            out.as_mut().subrows_mut(at, p).copy_from(&turned);
            at += p;
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::line::LineEnd;

    #[test]
    fn the_squared_distance_of_a_function_is_the_integral_of_its_square_times_that_of_the_point() {
        let line = Line { nodes: vec![0.5, 0.9, 2.0], degrees: vec![1, 3], ends: [LineEnd::Finite; 2] };
        let basis = RadialBasis::new(&line, 0.25).unwrap();
        // The constant of each element, normalised, and its mean squared distance.
        let constant = Mat::from_fn(4, 1, |i, _| if i < 2 { 1.0 } else { 0.0 });
        let turned = basis.rotate_rows(0, &constant);
        let mean = |lo: f64, hi: f64| (f64::powi(hi - 0.25, 3) - f64::powi(lo - 0.25, 3)) / (3.0 * (hi - lo));
        assert!((basis.squares[0] - mean(0.5, 0.9)).abs() < 1e-14);
        let second: f64 = (1..4).map(|i| turned[(i, 0)].powi(2) * basis.squares[i]).sum();
        assert!((second - mean(0.9, 2.0)).abs() < 1e-13);
    }
}
