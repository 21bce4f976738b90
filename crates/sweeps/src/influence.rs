//! The influence of scattered values on a result, by squared standardised rank regression coefficients.
//!
//! Values and results are replaced by their ranks, and a linear function of the ranks of the values is fitted
//! to those of the result. For independent values, the square of each standardised coefficient is the share
//! of the variance of the ranks that the value explains, and the shares add up to R^2. The rest up to 1 comes
//! from non-monotonic dependence or interactions of several values, which this method does not distinguish:
//! Saltelli, Ratto et al., Global Sensitivity Analysis, The Primer (2008), section 1.2.5.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use crate::table::Column;

/// The influence of the values on a result.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Influence {
    /// The share of the variance of the ranks that all values together explain; from 0 to 1.
    pub r_squared: f64,
    /// The shares of the keys, in falling order.
    pub shares: Vec<Share>,
}

/// The influence of one value.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Share {
    /// The path of the key.
    pub key: String,
    /// The share of the variance of the ranks that the value explains.
    pub share: f64,
    /// The coefficient: positive if the result rises with the value.
    pub coefficient: f64,
}

/// The least number of cases for each scattered value; with fewer a share says little.
const CASES_FOR_EACH: usize = 5;

/// The influence of each scattered key on `values`, which are those of `cases`. `None` if nothing scatters, a
/// scattered key is not a number, or there are too few cases.
pub(crate) fn influence(columns: &[Column], cases: &[usize], values: &[f64]) -> Option<Influence> {
    let result = standardised(&ranks(values))?;
    let mut keys = Vec::new();
    let mut inputs = Vec::new();
    for column in columns {
        let numbers: Option<Vec<f64>> =
            cases.iter().map(|case| column.numbers.get(*case).copied().flatten()).collect();
        let all_the_same =
            || cases.windows(2).all(|two| column.texts.get(two[0]) == column.texts.get(two[1]));
        match numbers {
            Some(numbers) => {
                if let Some(input) = standardised(&ranks(&numbers)) {
                    keys.push(column.key.clone());
                    inputs.push(input);
                }
            }
            None if all_the_same() => {}
            None => return None,
        }
    }
    if keys.is_empty() || cases.len() < CASES_FOR_EACH * keys.len() {
        return None;
    }
    let n = cases.len() as f64;
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>() / n;
    let size = keys.len();
    let correlations = DMatrix::from_fn(size, size, |i, j| dot(&inputs[i], &inputs[j]));
    let with_result = DVector::from_fn(size, |i, _| dot(&inputs[i], &result));
    // Keys of the same ranks cannot be distinguished.
    let coefficients = correlations.cholesky()?.solve(&with_result);
    let r_squared = coefficients.dot(&with_result).clamp(0.0, 1.0);
    let mut shares: Vec<Share> = keys
        .into_iter()
        .zip(coefficients.iter())
        .map(|(key, &coefficient)| Share { key, share: coefficient * coefficient, coefficient })
        .collect();
    shares.sort_by(|a, b| b.share.total_cmp(&a.share));
    Some(Influence { r_squared, shares })
}

/// The rank of each value; equal values have the mean of their ranks.
fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    let mut ranks = vec![0.0; values.len()];
    let mut from = 0;
    while from < order.len() {
        let same = order[from..].iter().take_while(|k| values[**k] == values[order[from]]).count().max(1);
        for k in &order[from..from + same] {
            ranks[*k] = from as f64 + (same - 1) as f64 / 2.0;
        }
        from += same;
    }
    ranks
}

/// The values scaled to mean 0 and variance 1; `None` if they are all equal.
fn standardised(values: &[f64]) -> Option<Vec<f64>> {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let deviation = (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / n).sqrt();
    (deviation > 0.0).then(|| values.iter().map(|value| (value - mean) / deviation).collect())
}

#[cfg(test)]
mod tests {
    use chacha20::ChaCha12Rng;
    use rand::{RngExt as _, SeedableRng as _};

    use super::*;

    fn column(key: &str, numbers: &[f64]) -> Column {
        Column {
            key: key.to_owned(),
            texts: numbers.iter().map(f64::to_string).collect(),
            numbers: numbers.iter().copied().map(Some).collect(),
            unit: String::new(),
        }
    }

    fn uniform(seed: u64, count: usize) -> Vec<f64> {
        let mut random = ChaCha12Rng::seed_from_u64(seed);
        (0..count).map(|_| random.random::<f64>() - 0.5).collect()
    }

    #[test]
    fn shares_are_those_of_the_variance_and_do_not_depend_on_the_scale() {
        let count = 4000;
        let (a, b, c) = (uniform(1, count), uniform(2, count), uniform(3, count));
        // Of 3 a - 4 b + 0 c: 9, 16 and 0 parts of 25. Ranks of a sum of uniform values follow it nearly.
        let sum: Vec<f64> = (0..count).map(|k| 3.0 * a[k] - 4.0 * b[k]).collect();
        let columns = [column("a", &a), column("b", &b), column("c", &c), column("same", &vec![1.0; count])];
        let cases: Vec<usize> = (0..count).collect();
        let found = influence(&columns, &cases, &sum).unwrap();
        let keys: Vec<&str> = found.shares.iter().map(|share| share.key.as_str()).collect();
        assert_eq!(keys, ["b", "a", "c"]);
        assert!(
            (found.shares[0].share - 0.64).abs() < 0.03 && found.shares[0].coefficient < 0.0,
            "{found:?}"
        );
        assert!(
            (found.shares[1].share - 0.36).abs() < 0.03 && found.shares[1].coefficient > 0.0,
            "{found:?}"
        );
        assert!(found.shares[2].share < 0.002 && found.r_squared > 0.97, "{found:?}");
        // A function that rises throughout does not change ranks.
        let bent: Vec<f64> = sum.iter().map(|value| value.exp()).collect();
        assert_eq!(influence(&columns, &cases, &bent), Some(found));
    }

    #[test]
    fn what_cannot_be_told_is_not_told() {
        let values = uniform(1, 20);
        let cases: Vec<usize> = (0..20).collect();
        let a = column("a", &values);
        assert_eq!(influence(std::slice::from_ref(&a), &cases, &[1.0; 20]), None, "nothing scatters");
        let twin = [a.clone(), column("b", &values)];
        assert_eq!(influence(&twin, &cases, &values), None, "two keys that go together");
        assert_eq!(influence(std::slice::from_ref(&a), &cases[..4], &values[..4]), None, "four cases");
        let mut words = a.clone();
        words.numbers = vec![None; 20];
        assert_eq!(influence(&[a, words], &cases, &values), None, "a key of words");
    }

    #[test]
    fn equal_values_share_their_ranks() {
        assert_eq!(ranks(&[3.0, 1.0, 3.0, 2.0]), [2.5, 0.0, 2.5, 1.0]);
    }
}
