//! Whether a result contradicts itself. Every Maxwell matrix is symmetric, no conductor at 1 V draws a
//! negative charge to itself or a positive one to another at 0 V, and the charge of each with all at 1 V is
//! not negative. Proved limits that exclude one of these cannot be right, whatever the reason: such a result
//! is an error and no number of it is reported.

use crate::bounded::Bounded;
use crate::floating::Floating;
use crate::matrix::MatrixBounds;
use crate::solution::Solution;

/// The largest rounding error of a sum of limits, as a share of the diagonal. Not tuned: it only has to lie
/// above rounding errors and below errors that matter.
const ROUNDING: f64 = 1e-9;

/// The error of the target below which bounds are reported although the linear solver stopped short of its
/// goal. Not tuned: a choice of what is still worth reporting.
const CLOSE: f64 = 0.05;

/// Whether bounds with this error of the target are reported: if the linear solver converged, or if they are
/// close all the same.
pub(crate) fn is_usable(converged: bool, error: f64) -> bool {
    converged || error < CLOSE
}

/// A contradiction within a solution, as the end of a sentence, if there is one. `bounds` are those of all
/// conductors, those that float among them.
pub(crate) fn contradiction(
    solution: &Solution,
    bounds: &MatrixBounds,
    floating: &Floating,
) -> Option<String> {
    let of_pair = || {
        let pair = solution.two_terminal.as_ref()?;
        (!in_order(pair)).then(|| "the two-terminal capacitance lies outside its own limits".to_owned())
    };
    of_matrix(&solution.maxwell)
        .or_else(of_pair)
        .or_else(|| of_reduction(bounds, &solution.maxwell, floating))
}

/// A contradiction between the matrix of all conductors and that of the driven ones, if there is one.
///
/// Floating conductors take the potentials of least energy, so that no energy of the driven ones is larger
/// with them free than with them at 0 V; and charge that they pass on only adds to the charge that one driven
/// conductor draws from another.
fn of_reduction(bounds: &MatrixBounds, maxwell: &[Vec<Bounded>], floating: &Floating) -> Option<String> {
    if floating.floating.is_empty() {
        return None;
    }
    let before = bounds.entries();
    let driven = || floating.driven.iter().enumerate();
    let entries = driven().flat_map(|row| driven().map(move |column| (row, column)));
    for ((i, &row), (j, &column)) in entries {
        let scale = ROUNDING * before[row][row].upper.abs().max(before[column][column].upper.abs());
        if maxwell[i][j].lower > before[row][column].upper + scale {
            return Some(format!(
                "entry {}, {} of the Maxwell matrix is larger with the floating conductors free than with them at 0 V",
                i + 1,
                j + 1
            ));
        }
    }
    None
}

/// Whether the limits are finite, and the value lies between them.
fn in_order(b: &Bounded) -> bool {
    b.lower.is_finite() && b.upper.is_finite() && b.lower <= b.value && b.value <= b.upper
}

/// A contradiction within the Maxwell matrix, if there is one.
fn of_matrix(maxwell: &[Vec<Bounded>]) -> Option<String> {
    for (i, row) in maxwell.iter().enumerate() {
        let diagonal = row[i].upper.abs();
        for (j, b) in row.iter().enumerate() {
            let place = format!("entry {}, {} of the Maxwell matrix", i + 1, j + 1);
            if !in_order(b) {
                return Some(format!("{place} lies outside its own limits"));
            }
            if maxwell[j][i] != *b {
                return Some(format!("{place} is not that of its transpose"));
            }
            let scale = ROUNDING * diagonal.max(maxwell[j][j].upper.abs());
            if (i == j && b.upper < 0.0) || (i != j && b.lower > scale) {
                return Some(format!("{place} has the wrong sign"));
            }
        }
        if row.iter().map(|b| b.upper).sum::<f64>() < -ROUNDING * diagonal {
            return Some(format!("row {} of the Maxwell matrix has a sum that is provably negative", i + 1));
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use elastocap_geometry::scene::Potential;
    use faer::Mat;

    fn exact(entries: &[&[f64]]) -> Vec<Vec<Bounded>> {
        let bounded = |v: &f64| Bounded { value: *v, lower: v - 0.01, upper: v + 0.01 };
        entries.iter().map(|row| row.iter().map(bounded).collect()).collect()
    }

    #[test]
    fn a_matrix_that_may_be_a_maxwell_matrix_is_no_contradiction() {
        assert_eq!(of_matrix(&exact(&[&[2.0, -1.0], &[-1.0, 1.0]])), None);
        // Within its limits the first row may sum to zero, and the coupling may vanish.
        assert_eq!(of_matrix(&exact(&[&[1.0, -1.01], &[-1.01, 2.0]])), None);
        assert_eq!(of_matrix(&exact(&[&[1.0, 0.005], &[0.005, 2.0]])), None);
    }

    #[test]
    fn free_conductors_that_raise_an_energy_or_lower_a_coupling_are_a_contradiction() {
        let middle = Potential::Floating { charge: 0.0 };
        let floating = Floating::of(&[Potential::Driven, middle, Potential::Driven]);
        let sharp = |entries: &[&[f64]]| {
            let m = Mat::from_fn(entries.len(), entries.len(), |i, j| entries[i][j]);
            MatrixBounds { lower: m.clone(), upper: m }
        };
        let bounds = sharp(&[&[3.0, -1.0, -1.0], &[-1.0, 2.0, -1.0], &[-1.0, -1.0, 3.0]]);
        let of_reduction = |maxwell: &MatrixBounds| of_reduction(&bounds, &maxwell.entries(), &floating);
        assert_eq!(of_reduction(&floating.reduced(&bounds)), None);
        let raised = sharp(&[&[3.1, -1.5], &[-1.5, 2.5]]);
        assert!(of_reduction(&raised).unwrap().contains("entry 1, 1"));
        let less = sharp(&[&[2.5, -0.5], &[-0.5, 2.5]]);
        assert!(of_reduction(&less).unwrap().contains("entry 1, 2"));
    }

    #[test]
    fn each_rule_that_is_broken_is_named() {
        let broken = |change: &dyn Fn(&mut Vec<Vec<Bounded>>)| {
            let mut matrix = exact(&[&[2.0, -1.0], &[-1.0, 1.5]]);
            change(&mut matrix);
            of_matrix(&matrix).unwrap()
        };
        assert!(broken(&|m| m[0][0].value = 2.02).contains("entry 1, 1 of the Maxwell matrix lies outside"));
        assert!(broken(&|m| m[1][1].upper = f64::NAN).contains("entry 2, 2"));
        assert!(broken(&|m| m[1][0].value = -0.995).contains("not that of its transpose"));
        let positive = |m: &mut Vec<Vec<Bounded>>| {
            for (i, j) in [(0, 1), (1, 0)] {
                m[i][j] = Bounded { value: 0.5, lower: 0.4, upper: 0.6 };
            }
        };
        assert!(broken(&positive).contains("entry 1, 2 of the Maxwell matrix has the wrong sign"));
        let weak = |m: &mut Vec<Vec<Bounded>>| m[1][1] = Bounded { value: 0.5, lower: 0.4, upper: 0.6 };
        assert!(broken(&weak).contains("row 2 of the Maxwell matrix has a sum that is provably negative"));
    }
}
