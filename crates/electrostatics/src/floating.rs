//! Floating conductors. A floating conductor carries a given charge; its potential is computed, and it is
//! eliminated from the Maxwell matrix. Grounded conductors are at potential zero: they have no row in that
//! matrix either, and nothing to be eliminated.
//!
//! Split the conductors into driven (d) and floating (f) ones. Uncharged floating conductors take the
//! potentials of minimal energy, V_f = -C_ff^-1 C_fd V_d, and the minimum is the form of the Schur complement
//! C_dd - C_df C_ff^-1 C_fd. A minimum is monotone in C: bounds on the whole matrix give bounds on the
//! reduced one.

use crate::bounded::Bounded;
use crate::matrix::{MatrixBounds, rounding};
use crate::solution::FloatingPotential;
use crate::target::Target;
use elastocap_geometry::scene::{Potential, Scene};
use elastocap_linalg::dense::{self, Llt, Lu};
use faer::Mat;

/// Which conductors of a scene are driven and which float; all others are grounded.
#[derive(Debug, Clone)]
pub(crate) struct Floating {
    /// Indices of the driven conductors, ascending.
    pub driven: Vec<usize>,
    /// Indices of the floating ones, ascending.
    pub floating: Vec<usize>,
    /// The charge of each floating one, C.
    pub charges: Vec<f64>,
    /// The number of conductors, grounded ones included.
    pub conductors: usize,
}

impl Floating {
    /// The driven and the floating conductors of a scene.
    pub(crate) fn new(scene: &Scene) -> Self {
        Self::of(&scene.potentials())
    }

    /// The driven and the floating conductors, from the potentials of all conductors.
    pub(crate) fn of(potentials: &[Potential]) -> Self {
        let indexed = || potentials.iter().enumerate();
        Self {
            driven: indexed()
                .filter(|(_, potential)| **potential == Potential::Driven)
                .map(|(i, _)| i)
                .collect(),
            floating: indexed()
                .filter(|(_, potential)| potential.floating_charge().is_some())
                .map(|(i, _)| i)
                .collect(),
            charges: potentials.iter().filter_map(|potential| potential.floating_charge()).collect(),
            conductors: potentials.len(),
        }
    }

    /// Whether some conductors are grounded.
    pub(crate) fn any_grounded(&self) -> bool {
        self.driven.len() + self.floating.len() < self.conductors
    }

    /// Whether the conductors hold no net charge in the state of the target: two with equal and opposite
    /// charges, and none that is grounded.
    pub(crate) fn is_neutral(&self, target: Target) -> bool {
        target == Target::TwoTerminal && self.driven.len() == 2 && !self.any_grounded()
    }

    /// Bounds on the matrix of the driven conductors, from `bounds` on the matrix of all conductors.
    pub(crate) fn reduced(&self, bounds: &MatrixBounds) -> MatrixBounds {
        if self.floating.is_empty() {
            return if self.any_grounded() { bounds.of_rows(&self.driven) } else { bounds.clone() };
        }
        let n = self.driven.len();
        // The factors and the solution are exact for matrices that differ by rounding: the forms are moved by
        // as much before they are reduced. The term that the reduction subtracts may be nearly as large as
        // the entries of the driven conductors, so that rounding of the difference is a share of these
        // entries.
        let error = rounding(&bounds.upper);
        let moved = |c: &Mat<f64>, sign: f64| {
            let moved = Mat::from_fn(c.nrows(), c.nrows(), |i, j| {
                c[(i, j)] + if i == j { sign * error[i] } else { 0.0 }
            });
            let mut reduced = self.schur(&moved)?;
            self.driven.iter().enumerate().for_each(|(k, &i)| reduced[(k, k)] += sign * error[i]);
            Some(reduced)
        };
        // A form that is not positive definite on the floating conductors has no minimum; zero still bounds
        // every energy.
        let lower = moved(&bounds.lower, -1.0).unwrap_or_else(|| Mat::zeros(n, n));
        // The minimum is at most the energy at any potentials, here at zero on the floating conductors.
        let upper =
            moved(&bounds.upper, 1.0).unwrap_or_else(|| block(&bounds.upper, &self.driven, &self.driven));
        let mut reduced = MatrixBounds { lower, upper };
        reduced.uncross();
        reduced
    }

    /// C_dd - C_df C_ff^-1 C_fd; `None` where C_ff is not positive definite.
    fn schur(&self, c: &Mat<f64>) -> Option<Mat<f64>> {
        let factor = Llt::new(block(c, &self.floating, &self.floating).as_ref()).ok()?;
        let mixed = block(c, &self.floating, &self.driven);
        let taken = dense::product(mixed.transpose(), factor.solve(mixed.as_ref()).as_ref());
        let driven = block(c, &self.driven, &self.driven);
        let n = self.driven.len();
        Some(Mat::from_fn(n, n, |i, j| driven[(i, j)] - 0.5 * (taken[(i, j)] + taken[(j, i)])))
    }

    /// Potentials of all conductors, V, from those of the driven ones, V, and the charges of the floating
    /// ones, C, with the capacitance matrix `c`, F.
    pub(crate) fn potentials(&self, c: &Mat<f64>, driven: &[f64], charges: &[f64]) -> Vec<f64> {
        let mut potentials = vec![0.0; c.nrows()];
        self.driven.iter().zip(driven).for_each(|(&i, v)| potentials[i] = *v);
        if self.floating.is_empty() {
            return potentials;
        }
        let from_driven = |i: usize| self.driven.iter().zip(driven).map(|(&j, v)| c[(i, j)] * v).sum::<f64>();
        let source = Mat::from_fn(self.floating.len(), 1, |k, _| charges[k] - from_driven(self.floating[k]));
        let matrix = block(c, &self.floating, &self.floating);
        let solution = Lu::new(matrix.as_ref()).solve(source.as_ref());
        self.floating.iter().enumerate().for_each(|(k, &i)| potentials[i] = solution[(k, 0)]);
        potentials
    }

    /// The potential of every floating conductor with proved limits, from proved bounds on the matrix.
    ///
    /// Let M be the middle of the bounds and G their gap, so that |z^T (C - M) w| <= sqrt(z^T G z w^T G w) /
    /// 2. The potentials w by M miss those by C on conductor i by z^T (C - M) w with z = C_ff^-1 e_i. From
    /// G_ff <= g L_ff <= g C_ff follows z^T G z <= g e_i^T C_ff^-1 e_i <= g (L_ff^-1)_ii.
    pub(crate) fn proved(&self, bounds: &MatrixBounds) -> Vec<FloatingPotential> {
        let n = bounds.upper.nrows();
        let middle = Mat::from_fn(n, n, |i, j| 0.5 * (bounds.lower[(i, j)] + bounds.upper[(i, j)]));
        self.with_limits(bounds, &middle, 0.5)
    }

    /// The potential of every floating conductor by the upper matrix, with limits around it, where the lower
    /// matrix is an estimate; the limits are then estimates too.
    pub(crate) fn estimated(&self, bounds: &MatrixBounds) -> Vec<FloatingPotential> {
        self.with_limits(bounds, &bounds.upper, 1.0)
    }

    /// The potential of every floating conductor by `matrix`, with limits at the distance `share` times
    /// sqrt(z^T G z w^T G w): see [`Floating::proved`].
    fn with_limits(&self, bounds: &MatrixBounds, matrix: &Mat<f64>, share: f64) -> Vec<FloatingPotential> {
        if self.floating.is_empty() {
            return Vec::new();
        }
        let n = bounds.upper.nrows();
        let gap = Mat::from_fn(n, n, |i, j| bounds.upper[(i, j)] - bounds.lower[(i, j)]);
        let factor = Llt::new(block(&bounds.lower, &self.floating, &self.floating).as_ref()).ok();
        let reach = factor.map(|l| self.reach(&l, &block(&gap, &self.floating, &self.floating)));
        let state = |driven: &[f64], charges: &[f64]| -> Vec<Bounded> {
            let w = self.potentials(matrix, driven, charges);
            let spread = (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
            let spread = spread.map(|(i, j)| w[i] * gap[(i, j)] * w[j]).sum::<f64>().max(0.0);
            let bounded = |(k, &i): (usize, &usize)| {
                let known_error =
                    reach.as_ref().map(|r| share * (r[k] * spread).sqrt()).filter(|e| !e.is_nan());
                let error =
                    if w.iter().all(|v| *v == 0.0) { 0.0 } else { known_error.unwrap_or(f64::INFINITY) };
                Bounded { value: w[i], lower: w[i] - error, upper: w[i] + error }
            };
            self.floating.iter().enumerate().map(bounded).collect()
        };
        let uncharged = vec![0.0; self.floating.len()];
        let per_driven: Vec<Vec<Bounded>> = (0..self.driven.len())
            .map(|d| {
                let unit: Vec<f64> = (0..self.driven.len()).map(|e| f64::from(u8::from(d == e))).collect();
                state(&unit, &uncharged)
            })
            .collect();
        let from_charges = state(&vec![0.0; self.driven.len()], &self.charges);
        // By the maximum principle the potential of an uncharged conductor lies between the least and the
        // greatest of the others.
        let clamped = |b: &Bounded| Bounded {
            value: b.value.clamp(0.0, 1.0),
            lower: b.lower.clamp(0.0, 1.0),
            upper: b.upper.clamp(0.0, 1.0),
        };
        let floating_potential = |(k, &conductor): (usize, &usize)| FloatingPotential {
            conductor,
            per_driven: per_driven.iter().map(|bounded| clamped(&bounded[k])).collect(),
            from_charges: from_charges[k],
        };
        self.floating.iter().enumerate().map(floating_potential).collect()
    }

    /// g (L_ff^-1)_ii for each floating conductor, from the factor of L_ff and the gap G_ff; g is a bound on
    /// the largest eigenvalue of L_ff^-1 G_ff.
    fn reach(&self, factor: &Llt, gap: &Mat<f64>) -> Vec<f64> {
        let n = gap.nrows();
        let mut half = gap.clone();
        dense::solve_lower_triangular(factor.lower(), half.as_mut());
        let mut ratio = half.transpose().to_owned();
        dense::solve_lower_triangular(factor.lower(), ratio.as_mut());
        // Two norms that are not less than the largest eigenvalue.
        let row = |i: usize| (0..n).map(|j| ratio[(i, j)].abs()).sum::<f64>();
        let largest = (0..n).map(row).fold(0.0, f64::max).min(ratio.norm_l2());
        let inverse = factor.solve(Mat::<f64>::identity(n, n).as_ref());
        (0..n).map(|i| largest * inverse[(i, i)]).collect()
    }
}

/// The entries of `c` in these rows and columns.
fn block(c: &Mat<f64>, rows: &[usize], columns: &[usize]) -> Mat<f64> {
    Mat::from_fn(rows.len(), columns.len(), |i, j| c[(rows[i], columns[j])])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn three() -> Floating {
        Floating { driven: vec![0, 2], floating: vec![1], charges: vec![2.0], conductors: 3 }
    }

    fn matrix(entries: [[f64; 3]; 3]) -> Mat<f64> {
        Mat::from_fn(3, 3, |i, j| entries[i][j])
    }

    #[test]
    fn a_floating_conductor_between_two_others_makes_two_capacitors_in_series() {
        // 2 and 6 from the outer ones to the middle one, nothing else: 12/8, and the middle one at 1/4 and
        // 3/4.
        let c = matrix([[2.0, -2.0, 0.0], [-2.0, 8.0, -6.0], [0.0, -6.0, 6.0]]);
        let bounds = MatrixBounds { lower: c.clone(), upper: c };
        let reduced = three().reduced(&bounds);
        // The bounds lie around the truth, no further than the rounding that is counted for matrices of this
        // size.
        assert!(reduced.lower[(0, 0)] < 1.5 && 1.5 < reduced.upper[(0, 0)]);
        let near = |found: f64, exact: f64| (found - exact).abs() < 1e-12;
        assert!(near(reduced.lower[(0, 0)], 1.5) && near(reduced.upper[(0, 0)], 1.5));
        assert!(near(reduced.upper[(0, 1)], -1.5));
        let found = &three().proved(&bounds)[0];
        assert_eq!(found.conductor, 1);
        for (found, exact) in found.per_driven.iter().chain([&found.from_charges]).zip([0.25, 0.75, 0.25]) {
            assert!((found.value - exact).abs() < 1e-14 && found.upper - found.lower < 1e-14, "{found:?}");
        }
    }

    #[test]
    fn potentials_of_every_matrix_between_the_bounds_lie_between_theirs() {
        let lower = matrix([[3.0, -1.0, -0.5], [-1.0, 4.0, -1.5], [-0.5, -1.5, 3.5]]);
        // Gaps of rank one, whose sum is the whole gap: every partial sum is a matrix between the bounds.
        let steps = [[0.5, -0.4, 0.1], [-0.1, 0.5, 0.3], [0.2, 0.3, -0.4], [0.0, 0.6, 0.0]];
        let sum = |which: usize| {
            let gap = |i: usize, j: usize| {
                let chosen = steps.iter().enumerate().filter(|(s, _)| which >> s & 1 == 1);
                chosen.map(|(_, v)| v[i] * v[j]).sum::<f64>()
            };
            Mat::from_fn(3, 3, |i, j| lower[(i, j)] + gap(i, j))
        };
        let bounds = MatrixBounds { lower: sum(0), upper: sum(15) };
        let (reduced, found) = (three().reduced(&bounds), &three().proved(&bounds)[0]);
        let entries = reduced.entries();
        for which in 0..16 {
            let c = sum(which);
            let exact_matrix = three().schur(&c).unwrap();
            for (i, j) in [(0, 0), (0, 1), (1, 1)] {
                let e = entries[i][j];
                assert!(
                    e.lower <= exact_matrix[(i, j)] + 1e-14 && exact_matrix[(i, j)] <= e.upper + 1e-14,
                    "{which}: {e:?}"
                );
            }
            let states = [([1.0, 0.0], 0.0), ([0.0, 1.0], 0.0), ([0.0, 0.0], 2.0)];
            for ((driven, charge), bounded) in
                states.iter().zip(found.per_driven.iter().chain([&found.from_charges]))
            {
                let exact = three().potentials(&c, driven, &[*charge])[1];
                assert!(bounded.lower <= exact && exact <= bounded.upper, "{which}: {exact} {bounded:?}");
                assert!(bounded.upper - bounded.lower < 0.5, "{bounded:?}");
            }
        }
    }

    #[test]
    fn a_grounded_conductor_takes_its_row_away_and_nothing_else() {
        let c = matrix([[3.0, -1.0, -0.5], [-1.0, 4.0, -1.5], [-0.5, -1.5, 3.5]]);
        let bounds = MatrixBounds { lower: c.clone(), upper: c };
        let with_middle = |middle| Floating::of(&[Potential::Driven, middle, Potential::Driven]);
        let grounded = with_middle(Potential::Grounded);
        assert!(grounded.any_grounded() && !grounded.is_neutral(Target::TwoTerminal));
        assert!(with_middle(Potential::Floating { charge: 0.0 }).is_neutral(Target::TwoTerminal));
        let reduced = grounded.reduced(&bounds);
        assert_eq!((reduced.upper.nrows(), reduced.upper[(0, 1)], reduced.lower[(1, 1)]), (2, -0.5, 3.5));
        assert_eq!(grounded.potentials(&bounds.upper, &[1.0, 2.0], &[]), [1.0, 0.0, 2.0]);
    }

    #[test]
    fn a_lower_form_without_a_minimum_proves_that_no_energy_is_negative_and_potentials_lie_between_zero_and_one()
     {
        let upper = matrix([[3.0, -1.0, -0.5], [-1.0, 4.0, -1.5], [-0.5, -1.5, 3.5]]);
        let mut lower = upper.clone();
        lower[(1, 1)] = -0.1;
        let bounds = MatrixBounds { lower, upper };
        assert!(three().reduced(&bounds).lower.norm_l2() == 0.0);
        let found = &three().proved(&bounds)[0];
        assert!(found.per_driven.iter().all(|b| b.lower == 0.0 && b.upper == 1.0));
        assert!(found.from_charges.upper.is_infinite());
    }
}
