//! A basis of a line's discontinuous potentials in which the squared distance from a point is diagonal.
//!
//! The energy of a flux that leaves a box along rays from a pole grows with the obliqueness: on the face x =
//! R by the factor 1 + (y^2 + z^2) / R^2. The energy becomes diagonal when multiplication by y^2 is diagonal
//! on one axis and multiplication by z^2 on the other.

use crate::line::{Element, Line};
use crate::mixed::IllConditioned;
use elastocap_linalg::dense;
use faer::Mat;

/// Orthogonal changes of basis, one per element, and the squared distances on the diagonal in the new basis.
#[derive(Debug, Clone)]
pub struct RadialBasis {
    /// Columns are the new functions in terms of the orthonormal Legendre ones.
    pub blocks: Vec<Mat<f64>>,
    /// Squared distances from the pole, m^2, one per potential mode.
    pub squares: Vec<f64>,
}

impl RadialBasis {
    /// Diagonalises multiplication by (x - pole)^2 on every element of a line without infinite ends. The
    /// functions of two elements that are mirror images about the pole are mirror images to the last bit.
    ///
    /// # Errors
    /// [`IllConditioned`] if the line has an infinite element, or an eigenvalue problem fails.
    pub fn new(line: &Line, pole: f64) -> Result<Self, IllConditioned> {
        let (mut blocks, mut squares) = (Vec::new(), Vec::new());
        for e in 0..line.elements() {
            let Element::Finite { length, .. } = line.element(e) else { return Err(IllConditioned) };
            let (signed, half, p) =
                (0.5 * (line.nodes[e] - pole + (line.nodes[e + 1] - pole)), 0.5 * length, line.degree(e));
            let centre = signed.abs();
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
            // Legendre polynomials of odd degree change their sign when they are mirrored.
            let sign = |n: usize| if signed < 0.0 && n % 2 == 1 { -1.0 } else { 1.0 };
            blocks.push(Mat::from_fn(p, p, |n, k| sign(n) * vectors[(n, k)]));
        }
        Ok(Self { blocks, squares })
    }

    /// Transforms `rows`, one per mode of a run of elements, from the Legendre basis to this one.
    pub fn rotate_rows(&self, first_element: usize, rows: &Mat<f64>) -> Mat<f64> {
        let mut out = Mat::zeros(rows.nrows(), rows.ncols());
        let mut first_row = 0;
        for block in &self.blocks[first_element..] {
            if first_row == rows.nrows() {
                break;
            }
            let p = block.nrows();
            let turned = dense::product(block.transpose(), rows.as_ref().subrows(first_row, p));
            out.as_mut().subrows_mut(first_row, p).copy_from(&turned);
            first_row += p;
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::line::LineEnd;

    #[test]
    fn functions_of_mirrored_elements_are_mirror_images_to_the_last_bit() {
        let nodes = vec![-2.3, -0.7, -0.1, 0.0, 0.1, 0.7, 2.3];
        let line = Line { nodes, degrees: vec![4, 3, 2, 2, 3, 4], ends: [LineEnd::Finite; 2] };
        let basis = RadialBasis::new(&line, 0.0).unwrap();
        let n = basis.squares.len();
        for e in 0..3 {
            let (below, above) = (&basis.blocks[e], &basis.blocks[5 - e]);
            for (i, k) in (0..below.nrows()).flat_map(|i| (0..below.ncols()).map(move |k| (i, k))) {
                let sign = if i % 2 == 1 { -1.0 } else { 1.0 };
                assert_eq!(below[(i, k)], sign * above[(i, k)], "element {e}: {i}, {k}");
            }
        }
        // Elements are in the opposite order, the functions of each in the same.
        assert_eq!(basis.squares[..4], basis.squares[n - 4..]);
        assert_eq!(basis.squares[7..9], basis.squares[9..11]);
    }

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
