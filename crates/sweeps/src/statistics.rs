//! Statistics of results over the cases: mean, deviation and percentiles for each step.

use elastocap_coupling::outcome::Row;
use serde::Serialize;

use crate::influence::{Influence, influence};
use crate::record::CaseRecord;
use crate::table::Column;

/// The reported percentiles.
pub const PERCENTILES: [f64; 7] = [2.5, 5.0, 25.0, 50.0, 75.0, 95.0, 97.5];

/// The columns of curve.csv whose scatter is reported.
pub(crate) const QUANTITIES: [&str; 5] =
    ["capacitance_f", "change_f", "change_relative", "sensitivity_f_per_n", "force_n"];

/// The statistics of one quantity.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Moments {
    /// The number of cases with the quantity.
    pub count: usize,
    /// The mean, in SI units, as all that follow.
    pub mean: f64,
    /// The standard deviation of a case, with `count - 1`; `None` for one case.
    pub deviation: Option<f64>,
    /// The smallest value.
    pub least: f64,
    /// The values below which these percentages of the cases lie, with linear interpolation between cases.
    pub percentiles: Vec<(f64, f64)>,
    /// The largest value.
    pub greatest: f64,
}

/// One quantity at one load step.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StepStatistics {
    /// The load step.
    pub step: usize,
    /// The column of curve.csv.
    pub quantity: &'static str,
    /// The statistics.
    #[serde(flatten)]
    pub moments: Moments,
    /// The influence of each key; `None` if the quantity does not scatter, or if there are too few cases.
    pub influence: Option<Influence>,
}

impl Moments {
    /// The moments of values in any order; `None` without values.
    pub fn of(values: &[f64]) -> Option<Self> {
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        let (least, greatest) = (*sorted.first()?, *sorted.last()?);
        let n = sorted.len() as f64;
        // Summed by size, so that the result does not depend on the order of the cases.
        let mean = sorted.iter().sum::<f64>() / n;
        let squares: f64 = sorted.iter().map(|value| (value - mean).powi(2)).sum();
        let deviation = (sorted.len() > 1).then(|| (squares / (n - 1.0)).sqrt());
        let percentiles = PERCENTILES.iter().map(|p| (*p, percentile(&sorted, *p))).collect();
        Some(Self { count: sorted.len(), mean, deviation, least, percentiles, greatest })
    }
}

/// A percentile of sorted values, with linear interpolation (the definition 7 of Hyndman and Fan, which NumPy
/// and R use).
fn percentile(sorted: &[f64], percent: f64) -> f64 {
    let last = sorted.len().saturating_sub(1);
    let at = percent / 100.0 * last as f64;
    let below = (at.floor() as usize).min(last);
    let above = (below + 1).min(last);
    let (low, high) = (sorted.get(below).copied().unwrap_or(f64::NAN), sorted.get(above).copied());
    low + (high.unwrap_or(low) - low) * (at - below as f64)
}

/// The statistics of each quantity at each step, with the influence of the keys. Steps that failed in a case
/// are left out.
pub fn statistics(columns: &[Column], records: &[Option<CaseRecord>]) -> Vec<StepStatistics> {
    let records: Vec<&CaseRecord> = records.iter().flatten().filter(|r| r.refused.is_none()).collect();
    let steps = records.iter().map(|record| record.steps.len()).max().unwrap_or(0);
    let mut found = Vec::new();
    for step in 0..steps {
        for quantity in QUANTITIES {
            debug_assert!(Row::COLUMNS.contains(&quantity));
            let pairs: Vec<(usize, f64)> = records
                .iter()
                .filter_map(|record| {
                    let step = record.steps.get(step).filter(|step| !step.failed)?;
                    Some((record.case, step.number(quantity)?))
                })
                .collect();
            let (cases, values): (Vec<usize>, Vec<f64>) = pairs.into_iter().unzip();
            if let Some(moments) = Moments::of(&values) {
                let influence = influence(columns, &cases, &values);
                found.push(StepStatistics { step, quantity, moments, influence });
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_and_percentiles_are_those_of_numpy() {
        // numpy.percentile([1, 2, 3, 4, 10], [2.5, 5, 25, 50, 75, 95, 97.5]) and std(ddof=1).
        let moments = Moments::of(&[10.0, 1.0, 3.0, 2.0, 4.0]).unwrap();
        assert_eq!((moments.mean, moments.least, moments.greatest), (4.0, 1.0, 10.0));
        assert!((moments.deviation.unwrap() - 12.5_f64.sqrt()).abs() < 1e-15);
        let expected = [1.1, 1.2, 2.0, 3.0, 4.0, 8.8, 9.4];
        for ((_, found), expected) in moments.percentiles.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-12, "{found} for {expected}");
        }
        assert_eq!(Moments::of(&[]), None);
        assert_eq!(Moments::of(&[2.0]).unwrap().deviation, None);
    }
}
