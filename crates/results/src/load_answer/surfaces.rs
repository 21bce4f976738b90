//! Capacitances as polynomials of the load, fitted to the steps of a run.
//!
//! Each quantity is scaled to run from -1 to 1 over the steps. Of several sets of terms, from linear to cubic, the one counts whose fit
//! to the others meets the steps best that were left out: each by itself, and together all that have a quantity in common, but for its
//! least and largest value. Steps on a grid tell by the latter alone what lies between its lines. What is missed then, by root mean square,
//! is the error of the polynomials; where a quantity has two values only, nothing is known of it.

use nalgebra::{DMatrix, DVector};

/// Least ratio of singular values at which steps still determine a polynomial.
const LEAST_RATIO: f64 = 1e-7;
/// Values of a quantity that differ by less, scaled, are one.
const SAME: f64 = 1e-6;

/// The exponents of one term, one for each quantity.
type Term = Vec<i32>;

/// Polynomials of the same terms, one for each capacitance.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Surfaces {
    terms: Vec<Term>,
    /// The coefficients of the polynomial of each capacitance, one for each term, F.
    coefficients: Vec<DVector<f64>>,
    /// How far each polynomial misses steps that it was not fitted to, root mean square, F.
    pub(super) errors: Vec<f64>,
}

/// The sets of terms that are tried for so many quantities.
fn candidates(count: usize) -> Vec<Vec<Term>> {
    let up_to = |degree: i32| -> Vec<Term> {
        let mut all = vec![vec![]];
        for _ in 0..count {
            let longer = |term: &Term| {
                let left = degree - term.iter().sum::<i32>();
                (0..=left).map(|e| [term.as_slice(), &[e]].concat()).collect::<Vec<_>>()
            };
            all = all.iter().flat_map(longer).collect();
        }
        all
    };
    let (linear, quadratic) = (up_to(1), up_to(2));
    // Curved in the force, and linear in what a force makes larger or smaller.
    let crossed = quadratic.iter().filter(|term| term.iter().skip(1).sum::<i32>() <= 1).cloned().collect();
    let mut curved = linear.clone();
    curved.extend(quadratic.iter().filter(|term| term.contains(&2)).cloned());
    vec![linear, crossed, curved, quadratic, up_to(3)]
}

impl Surfaces {
    /// Fitted to `values` (a list for each capacitance, F) at scaled `places` (a list for each step); `None` where no set of terms is
    /// determined by the steps with one to spare.
    pub(super) fn fitted(places: &[Vec<f64>], values: &[Vec<f64>]) -> Option<Self> {
        let count = places.first()?.len();
        let fits = candidates(count).into_iter().filter_map(|terms| Self::with(terms, places, values));
        let miss = |own: &Self| {
            let scaled = own.errors.iter().zip(values).map(|(error, of)| {
                let size = of.iter().fold(0.0, |size: f64, value| size.max(value.abs()));
                (error / size).powi(2)
            });
            scaled.sum::<f64>()
        };
        fits.min_by(|a, b| miss(a).total_cmp(&miss(b)))
    }

    fn with(terms: Vec<Term>, places: &[Vec<f64>], values: &[Vec<f64>]) -> Option<Self> {
        let all: Vec<usize> = (0..places.len()).collect();
        let coefficients = coefficients(&terms, places, values, &all)?;
        let mut errors = vec![0.0_f64; values.len()];
        let mut single = vec![0.0; values.len()];
        for (number, left_out) in left_out(places).iter().enumerate() {
            let kept: Vec<usize> = all.iter().copied().filter(|step| !left_out.contains(step)).collect();
            let others = Self {
                terms: terms.clone(),
                coefficients: self::coefficients(&terms, places, values, &kept)?,
                errors: Vec::new(),
            };
            let mut sums = vec![0.0; values.len()];
            for &step in left_out {
                let found = others.at(&places[step]);
                for (k, sum) in sums.iter_mut().enumerate() {
                    *sum += (found[k] - values[k][step]).powi(2);
                }
            }
            for (k, sum) in sums.into_iter().enumerate() {
                if number < places.len() {
                    single[k] += sum / places.len() as f64;
                } else {
                    errors[k] = errors[k].max((sum / left_out.len() as f64).sqrt());
                }
            }
        }
        for (error, single) in errors.iter_mut().zip(single) {
            *error = error.max(single.sqrt());
        }
        Some(Self { terms, coefficients, errors })
    }

    /// The capacitances at a scaled place, F.
    pub(super) fn at(&self, place: &[f64]) -> DVector<f64> {
        let terms = DVector::from_iterator(self.terms.len(), self.terms.iter().map(|t| monomial(t, place)));
        DVector::from_iterator(self.coefficients.len(), self.coefficients.iter().map(|c| c.dot(&terms)))
    }

    /// Their slopes along each quantity, F: a row for each capacitance.
    pub(super) fn slopes(&self, place: &[f64]) -> DMatrix<f64> {
        let slope = |term: &Term, axis: usize| {
            let mut lower = term.clone();
            lower[axis] -= 1;
            if term[axis] == 0 { 0.0 } else { f64::from(term[axis]) * monomial(&lower, place) }
        };
        DMatrix::from_fn(self.coefficients.len(), place.len(), |k, axis| {
            self.terms.iter().zip(self.coefficients[k].iter()).map(|(t, c)| c * slope(t, axis)).sum()
        })
    }
}

/// The steps that are left out together: first each by itself, then those with a value of a quantity that is neither its least nor its
/// largest one. Without such a value it is all of them, so that no polynomial is fitted.
fn left_out(places: &[Vec<f64>]) -> Vec<Vec<usize>> {
    let mut out: Vec<Vec<usize>> = (0..places.len()).map(|step| vec![step]).collect();
    for axis in 0..places.first().map_or(0, Vec::len) {
        let mut order: Vec<usize> = (0..places.len()).collect();
        order.sort_by(|a, b| places[*a][axis].total_cmp(&places[*b][axis]));
        let levels: Vec<Vec<usize>> = order
            .chunk_by(|a, b| places[*b][axis] - places[*a][axis] < SAME)
            .map(<[usize]>::to_vec)
            .collect();
        let between = levels.len().saturating_sub(2);
        if between == 0 {
            out.push((0..places.len()).collect());
        }
        out.extend(levels.into_iter().skip(1).take(between));
    }
    out
}

/// The coefficients of the polynomials through some of the steps, those in `kept`, by least squares; `None` where these steps do not determine
/// them.
fn coefficients(
    terms: &[Term],
    places: &[Vec<f64>],
    values: &[Vec<f64>],
    kept: &[usize],
) -> Option<Vec<DVector<f64>>> {
    if kept.len() < terms.len() {
        return None;
    }
    let matrix =
        DMatrix::from_fn(kept.len(), terms.len(), |row, term| monomial(&terms[term], &places[kept[row]]));
    let svd = matrix.svd(true, true);
    let (largest, smallest) = (svd.singular_values.max(), svd.singular_values.min());
    if smallest.partial_cmp(&(LEAST_RATIO * largest)) != Some(std::cmp::Ordering::Greater) {
        return None;
    }
    let fit = |of: &Vec<f64>| {
        svd.solve(&DVector::from_iterator(kept.len(), kept.iter().map(|step| of[*step])), 0.0).ok()
    };
    values.iter().map(fit).collect()
}

fn monomial(term: &[i32], place: &[f64]) -> f64 {
    term.iter().zip(place).map(|(exponent, x)| x.powi(*exponent)).product()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid() -> Vec<Vec<f64>> {
        let along = [-1.0, -0.3, 0.4, 1.0];
        along.iter().flat_map(|x| along.iter().map(move |y| vec![*x, *y])).collect()
    }

    #[test]
    fn a_polynomial_of_the_second_degree_is_met_with_its_slopes_and_without_an_error() {
        let u = |p: &[f64]| 3.0 + p[0] - 2.0 * p[1] + 0.5 * p[0] * p[1] - p[1] * p[1];
        let places = grid();
        let values = vec![places.iter().map(|p| u(p)).collect::<Vec<f64>>()];
        let found = Surfaces::fitted(&places, &values).unwrap();
        let place = [0.2, -0.7];
        assert!((found.at(&place)[0] - u(&place)).abs() < 1e-12 && found.errors[0] < 1e-12);
        let slopes = found.slopes(&place);
        assert!((slopes[(0, 0)] - (1.0 + 0.5 * place[1])).abs() < 1e-12);
        assert!((slopes[(0, 1)] - (-2.0 + 0.5 * place[0] - 2.0 * place[1])).abs() < 1e-12);
    }

    #[test]
    fn the_error_is_about_what_steps_that_were_left_out_are_missed_by() {
        let u = |p: &[f64]| (1.5 * p[0] + p[1]).exp();
        let places = grid();
        let values = vec![places.iter().map(|p| u(p)).collect::<Vec<f64>>()];
        let found = Surfaces::fitted(&places, &values).unwrap();
        let others = [[0.7, 0.7], [-0.65, 0.1], [0.05, -0.65], [0.7, -0.9]];
        let misses: Vec<f64> = others.iter().map(|p| (found.at(p)[0] - u(p)).abs()).collect();
        let worst = misses.iter().copied().fold(0.0, f64::max);
        assert!(
            worst < 3.0 * found.errors[0] && worst > 0.05 * found.errors[0],
            "{misses:?} {:?}",
            found.errors
        );
    }

    #[test]
    fn two_values_of_a_quantity_do_not_tell_an_error() {
        let places = vec![vec![-1.0, -1.0], vec![1.0, -1.0], vec![-1.0, 1.0]];
        assert_eq!(Surfaces::fitted(&places, &[vec![1.0, 2.0, 3.0]]), None);
        let corners: Vec<Vec<f64>> = grid().into_iter().filter(|p| p[1].abs() == 1.0).collect();
        assert_eq!(Surfaces::fitted(&corners, &[vec![1.0; corners.len()]]), None);
    }
}
