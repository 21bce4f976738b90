//! Maxwell matrices from energies, and bounds of their entries and of the two-terminal capacitance.

use crate::solution::Bounded;
use elastocap_linalg::dense::Lu;
use faer::Mat;

/// A lower and an upper bound on a symmetric matrix, in the sense of quadratic forms: both differences to the true matrix are
/// positive semidefinite.
#[derive(Debug, Clone)]
pub(crate) struct MatrixBounds {
    /// From Thomson's principle, F.
    pub lower: Mat<f64>,
    /// From Dirichlet's principle, F.
    pub upper: Mat<f64>,
}

/// The capacitance matrix C from energies E in the basis of the columns of `basis` (B): V^T C V = c^T E c for V = B c.
pub(crate) fn from_energies(basis: &Mat<f64>, energies: &Mat<f64>) -> Mat<f64> {
    let factor = Lu::new(basis.transpose());
    // C = B^-T E B^-1
    let left = factor.solve(energies.as_ref());
    let c = factor.solve(left.transpose());
    let n = c.nrows();
    Mat::from_fn(n, n, |i, j| 0.5 * (c[(i, j)] + c[(j, i)]))
}

/// Bounds that cross by less than this share of the value are taken to have crossed by rounding.
const ROUNDING: f64 = 1e-6;

impl MatrixBounds {
    /// Separates bounds on energies that have crossed by rounding: each is moved by twice the distance by which they crossed.
    pub(crate) fn uncross(&mut self) {
        for i in 0..self.upper.nrows() {
            let (lower, upper) = (self.lower[(i, i)], self.upper[(i, i)]);
            if upper < lower && lower - upper <= ROUNDING * upper {
                self.upper[(i, i)] += 2.0 * (lower - upper);
                self.lower[(i, i)] -= 2.0 * (lower - upper);
            }
        }
    }

    /// Bounds on every entry, F.
    ///
    /// With G = upper - lower and C = lower + E, 0 <= E <= G: polarisation gives |E_ij - G_ij / 2| <=
    /// sqrt(G_ii G_jj) / 2.
    pub(crate) fn entries(&self) -> Vec<Vec<Bounded>> {
        let n = self.upper.nrows();
        let gap = |i: usize| (self.upper[(i, i)] - self.lower[(i, i)]).max(0.0);
        (0..n)
            .map(|i| {
                (0..n)
                    .map(|j| {
                        let value = 0.5 * (self.upper[(i, j)] + self.lower[(i, j)]);
                        let half = 0.5 * (gap(i) * gap(j)).sqrt();
                        Bounded { value, lower: value - half, upper: value + half }
                    })
                    .collect()
            })
            .collect()
    }

    /// Two-terminal capacitance: charge over voltage with equal and opposite charges for two conductors, against
    /// ground or infinity for one.
    ///
    /// It is the minimum of the energy over all common potentials, hence monotone in the matrix: the bounds carry over. `None` for
    /// other numbers of conductors, or if the upper bound is zero.
    pub(crate) fn two_terminal(&self) -> Option<Bounded> {
        let (lower, upper) = match self.upper.nrows() {
            1 => (self.lower[(0, 0)], self.upper[(0, 0)]),
            2 => (two_terminal(&self.lower), two_terminal(&self.upper)),
            _ => return None,
        };
        // No capacitance is negative.
        let lower = lower.max(0.0);
        (upper > 0.0).then_some(Bounded { value: 0.5 * (lower + upper), lower, upper })
    }
}

fn two_terminal(c: &Mat<f64>) -> f64 {
    let row = c[(0, 0)] + c[(0, 1)];
    let sum = row + c[(1, 0)] + c[(1, 1)];
    // No flux leaves the pair: a common potential has no energy.
    if sum <= 1e-12 * c[(0, 0)] { c[(0, 0)] } else { c[(0, 0)] - row * row / sum }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_matrix_is_recovered_from_its_energies_in_another_basis() {
        let c = Mat::from_fn(2, 2, |i, j| [[3.0, -1.0], [-1.0, 2.0]][i][j]);
        let b = Mat::from_fn(2, 2, |i, j| [[1.0, 1.0], [-1.0, 1.0]][i][j]);
        let e = b.transpose() * &c * &b;
        let back = from_energies(&b, &e);
        assert!((0..2).all(|i| (0..2).all(|j| (back[(i, j)] - c[(i, j)]).abs() < 1e-14)));
    }

    #[test]
    fn two_terminal_capacitance_is_the_mutual_one_in_parallel_with_both_capacitors_to_ground_in_series() {
        // c_m = 1 between them, 2 and 1 to ground: 1 + 2 * 1 / 3
        let c = Mat::from_fn(2, 2, |i, j| [[3.0, -1.0], [-1.0, 2.0]][i][j]);
        assert!((two_terminal(&c) - (1.0 + 2.0 / 3.0)).abs() < 1e-14);
    }
}
