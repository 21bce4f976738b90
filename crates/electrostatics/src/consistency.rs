//! Whether a result contradicts itself. Every Maxwell matrix is symmetric, no conductor at 1 V draws a negative charge to itself or
//! a positive one to another at 0 V, and the charge of each with all at 1 V is not negative. Proved limits that exclude one of
//! these cannot be right, whatever the reason: such a result is an error and no number of it is reported.

use crate::solution::{Bounded, Solution};

/// What rounding may add up to in a sum of limits, as a share of the diagonal.
const ROUNDING: f64 = 1e-9;

/// What contradicts itself in a solution, as the end of a sentence, if anything does.
pub(crate) fn contradiction(solution: &Solution) -> Option<String> {
    of_matrix(&solution.maxwell).or_else(|| {
        let pair = solution.two_terminal.as_ref()?;
        (!in_order(pair)).then(|| "the two-terminal capacitance lies outside its own limits".to_owned())
    })
}

fn in_order(b: &Bounded) -> bool {
    b.lower.is_finite() && b.upper.is_finite() && b.lower <= b.value && b.value <= b.upper
}

fn of_matrix(maxwell: &[Vec<Bounded>]) -> Option<String> {
    for (i, row) in maxwell.iter().enumerate() {
        let own = row[i].upper.abs();
        for (j, b) in row.iter().enumerate() {
            let place = format!("entry {}, {} of the Maxwell matrix", i + 1, j + 1);
            if !in_order(b) {
                return Some(format!("{place} lies outside its own limits"));
            }
            if maxwell[j][i] != *b {
                return Some(format!("{place} is not that of its transpose"));
            }
            let scale = ROUNDING * own.max(maxwell[j][j].upper.abs());
            if (i == j && b.upper < 0.0) || (i != j && b.lower > scale) {
                return Some(format!("{place} has the wrong sign"));
            }
        }
        if row.iter().map(|b| b.upper).sum::<f64>() < -ROUNDING * own {
            return Some(format!("row {} of the Maxwell matrix has a sum that is provably negative", i + 1));
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

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
