//! The two-terminal capacitance of a pair among other conductors.

use elastocap_electrostatics::Bounded;

/// Charge over voltage of two conductors with equal and opposite charges, F, when all others are at potential zero: a finger, a
/// guard, a shield. `pair` are their rows in the Maxwell matrix; `None` if the matrix has fewer rows.
///
/// With m = -C12, a = C11 + C12, b = C22 + C12, none of them negative, it is m + ab/(a + b): the mutual capacitance
/// in parallel with the two capacitances to ground in series. It grows with C11 and C22 and falls with C12, so bounds of the matrix give
/// bounds of it.
pub fn pair_among(maxwell: &[Vec<Bounded>], pair: [usize; 2]) -> Option<Bounded> {
    let entry = |i: usize, j: usize| maxwell.get(pair[i])?.get(pair[j]);
    let (c11, c12, c22) = (entry(0, 0)?, entry(0, 1)?, entry(1, 1)?);
    let value = series(c11.value, c22.value, c12.value);
    // Where the bounds leave the sign of a or b open, zero is the smallest value that they can have.
    let lower = series(c11.lower, c22.lower, c12.upper);
    let upper = series(c11.upper, c22.upper, c12.lower.max(-c11.upper).max(-c22.upper));
    Some(Bounded { value: value.clamp(lower.min(upper), upper), lower, upper })
}

fn series(c11: f64, c22: f64, c12: f64) -> f64 {
    let (a, b) = ((c11 + c12).max(0.0), (c22 + c12).max(0.0));
    let to_ground = if a + b > 0.0 { a / (a + b) * b } else { 0.0 };
    -c12 + to_ground
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matrix(c: [[(f64, f64); 2]; 2]) -> Vec<Vec<Bounded>> {
        c.map(|row| {
            row.map(|(value, error)| Bounded { value, lower: value - error, upper: value + error }).to_vec()
        })
        .to_vec()
    }

    #[test]
    fn ground_stands_in_series_beside_the_mutual_capacitance() {
        // Mutual 1 F, 2 F and 6 F to ground: 1 + 12/8.
        let found =
            pair_among(&matrix([[(3.0, 0.0), (-1.0, 0.0)], [(-1.0, 0.0), (7.0, 0.0)]]), [0, 1]).unwrap();
        assert_eq!((found.lower, found.value, found.upper), (2.5, 2.5, 2.5));
    }

    #[test]
    fn without_a_ground_the_mutual_capacitance_is_left() {
        let found =
            pair_among(&matrix([[(1.0, 0.0), (-1.0, 0.0)], [(-1.0, 0.0), (1.0, 0.0)]]), [0, 1]).unwrap();
        assert_eq!((found.lower, found.value, found.upper), (1.0, 1.0, 1.0));
    }

    #[test]
    fn every_matrix_within_the_bounds_gives_a_value_within_the_bounds() {
        let centre = [[(3.0, 0.4), (-1.0, 0.2)], [(-1.0, 0.2), (1.1, 0.15)]];
        let found = pair_among(&matrix(centre), [0, 1]).unwrap();
        for d11 in [-0.4, 0.0, 0.4] {
            for d22 in [-0.15, 0.0, 0.15] {
                for d12 in [-0.2, 0.0, 0.2] {
                    let (c11, c22, c12) = (3.0 + d11, 1.1 + d22, -1.0 + d12);
                    if c11 + c12 >= 0.0 && c22 + c12 >= 0.0 {
                        let exact = (c11 * c22 - c12 * c12) / (c11 + c22 + 2.0 * c12);
                        let bounded = found.lower - 1e-12 <= exact && exact <= found.upper + 1e-12;
                        assert!(bounded, "{exact} outside {found:?}");
                    }
                }
            }
        }
    }
}
