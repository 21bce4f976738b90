//! Capacitances as polynomials of the load, fitted to the steps of a run.
//!
//! Each quantity is scaled to run from -1 to 1 over the steps. Several sets of terms, from linear to cubic,
//! are tried, and cross-validation chooses one: each step is left out by itself, and then all steps with the
//! same value of a quantity, other than its least and its largest value, are left out together. On a grid of
//! steps only the latter shows the error between its lines. The larger root mean square of the errors at the
//! steps left out is the error of the polynomials; where a quantity has two values only, the error is
//! unknown.

use nalgebra::{DMatrix, DVector};

/// The least ratio of singular values at which steps still determine a polynomial. Not tuned: it only has to
/// lie above rounding errors and below errors that matter.
const LEAST_RATIO: f64 = 1e-7;
/// The largest difference of scaled values of a quantity that count as one. Not tuned: it only has to lie
/// above rounding errors and below differences that matter.
const SAME: f64 = 1e-6;

/// The exponents of one term, one exponent for each quantity.
type Term = Vec<i32>;

/// Polynomials of the same terms, one for each capacitance.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Surfaces {
    terms: Vec<Term>,
    /// The coefficients of the polynomial of each capacitance, one for each term, F.
    coefficients: Vec<DVector<f64>>,
    /// The root-mean-square error of each polynomial at steps that it was not fitted to, F.
    pub(super) errors: Vec<f64>,
}

/// The sets of terms to be tried for so many quantities.
fn candidates(count: usize) -> Vec<Vec<Term>> {
    let up_to = |degree: i32| -> Vec<Term> {
        let mut terms = vec![vec![]];
        for _ in 0..count {
            let longer = |term: &Term| {
                let left = degree - term.iter().sum::<i32>();
                (0..=left).map(|e| [term.as_slice(), &[e]].concat()).collect::<Vec<_>>()
            };
            terms = terms.iter().flat_map(longer).collect();
        }
        terms
    };
    let (linear, quadratic) = (up_to(1), up_to(2));
    // Quadratic in the force, and linear in the other quantities, whose effect grows or falls with the force.
    let crossed = quadratic.iter().filter(|term| term.iter().skip(1).sum::<i32>() <= 1).cloned().collect();
    let mut curved = linear.clone();
    curved.extend(quadratic.iter().filter(|term| term.contains(&2)).cloned());
    vec![linear, crossed, curved, quadratic, up_to(3)]
}

impl Surfaces {
    /// Polynomials fitted to `values` (a list for each capacitance, F) at scaled `places` (a list for each
    /// step); `None` if the steps overdetermine no set of terms.
    pub(super) fn fitted(places: &[Vec<f64>], values: &[Vec<f64>]) -> Option<Self> {
        let count = places.first()?.len();
        let fits = candidates(count).into_iter().filter_map(|terms| Self::with_terms(terms, places, values));
        let miss = |fit: &Self| {
            let scaled = fit.errors.iter().zip(values).map(|(error, values)| {
                let size = values.iter().fold(0.0, |size: f64, value| size.max(value.abs()));
                (error / size).powi(2)
            });
            scaled.sum::<f64>()
        };
        fits.min_by(|a, b| miss(a).total_cmp(&miss(b)))
    }

    /// Polynomials of these terms, fitted to all steps, with their errors by cross-validation.
    fn with_terms(terms: Vec<Term>, places: &[Vec<f64>], values: &[Vec<f64>]) -> Option<Self> {
        let steps: Vec<usize> = (0..places.len()).collect();
        let coefficients = coefficients(&terms, places, values, &steps)?;
        let mut errors = vec![0.0_f64; values.len()];
        let mut single = vec![0.0; values.len()];
        for (number, left_out) in left_out(places).iter().enumerate() {
            let remaining: Vec<usize> =
                steps.iter().copied().filter(|step| !left_out.contains(step)).collect();
            let others = Self {
                terms: terms.clone(),
                coefficients: self::coefficients(&terms, places, values, &remaining)?,
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

    /// The slopes of the capacitances along each quantity, F: a row for each capacitance.
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

/// The groups of steps that are left out together: first each step by itself, then the steps with the same
/// value of a quantity that is neither its least nor its largest. A quantity without such a value gives the
/// group of all steps, so that no polynomial is fitted.
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

/// The least-squares coefficients of the polynomials through the steps in `used`; `None` where these steps do
/// not determine them.
fn coefficients(
    terms: &[Term],
    places: &[Vec<f64>],
    values: &[Vec<f64>],
    used: &[usize],
) -> Option<Vec<DVector<f64>>> {
    if used.len() < terms.len() {
        return None;
    }
    let matrix =
        DMatrix::from_fn(used.len(), terms.len(), |row, term| monomial(&terms[term], &places[used[row]]));
    let svd = matrix.svd(true, true);
    let (largest, smallest) = (svd.singular_values.max(), svd.singular_values.min());
    if smallest.partial_cmp(&(LEAST_RATIO * largest)) != Some(std::cmp::Ordering::Greater) {
        return None;
    }
    let fit = |values_of_one: &Vec<f64>| {
        svd.solve(&DVector::from_iterator(used.len(), used.iter().map(|step| values_of_one[*step])), 0.0).ok()
    };
    values.iter().map(fit).collect()
}

/// The value of a term at a scaled place.
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
