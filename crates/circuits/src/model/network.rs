//! Computes the capacitors of a network, with bounds, from the matrices of the steps.

use super::ModelError;
use crate::curve::StepValue;
use crate::document::Step;

/// A capacitor's ends and its values at the steps.
pub(super) type Values = ((usize, Option<usize>), Vec<StepValue>);

/// The capacitance that the run measured, at each step.
pub(super) fn measured(steps: &[&Step]) -> Result<Vec<StepValue>, ModelError> {
    let at_step = |step: &&Step| {
        let bounded = (step.capacitance_f, step.capacitance_lower_f, step.capacitance_upper_f);
        let (Some(value), Some(lower), Some(upper)) = bounded else {
            return Err(ModelError::FailedStep { step: step.index, reason: step.why() });
        };
        let estimated = value.abs() * step.estimates();
        let (lower, upper) = (lower - estimated, upper + estimated);
        let is_sound =
            [lower, value, upper].iter().all(|c| c.is_finite()) && lower <= value && value <= upper;
        if !is_sound {
            return Err(ModelError::Damaged(step.index));
        }
        if lower <= 0.0 {
            return Err(ModelError::NotPositive { step: step.index, lower });
        }
        Ok(StepValue { lower, value, upper })
    };
    steps.iter().map(at_step).collect()
}

/// The mutual capacitances of all pairs by rows, and then those to ground, at each step.
///
/// No capacitance of either kind can be negative (the potential of a conductor at 1 V lies between 0 and 1 V
/// everywhere), so that lower bounds below zero become zero and remain bounds.
pub(super) fn matrix(steps: &[&Step], count: usize) -> Result<Vec<Values>, ModelError> {
    let matrices: Vec<Vec<Vec<StepValue>>> =
        steps.iter().map(|step| network_of(step, count)).collect::<Result<_, ModelError>>()?;
    let at_steps = |i: usize, j: usize| matrices.iter().map(|network| network[i][j]).collect();
    let mutual = (0..count).flat_map(|i| (i + 1..count).map(move |j| (i, j)));
    let mut out: Vec<Values> = mutual.map(|(i, j)| ((i, Some(j)), at_steps(i, j))).collect();
    out.extend((0..count).map(|i| ((i, None), at_steps(i, i))));
    Ok(out)
}

/// The capacitances of one step as a square matrix: mutual capacitances off the diagonal, those to ground on
/// it.
fn network_of(step: &Step, count: usize) -> Result<Vec<Vec<StepValue>>, ModelError> {
    let matrices = (&step.maxwell_matrix_f, &step.maxwell_matrix_lower_f, &step.maxwell_matrix_upper_f);
    let (Some(value), Some(lower), Some(upper)) = matrices else {
        return Err(ModelError::NoMatrix(step.index));
    };
    let damaged = || ModelError::Damaged(step.index);
    let is_square = |m: &Vec<Vec<f64>>| m.len() == count && m.iter().all(|row| row.len() == count);
    if count == 0 || ![value, lower, upper].into_iter().all(is_square) {
        return Err(damaged());
    }
    let estimates = step.estimates();
    // The lower bound, the value and the upper bound of an entry of the Maxwell matrix.
    let bounded = |i: usize, j: usize| {
        let estimated = estimates * value[i][j].abs();
        [lower[i][j] - estimated, value[i][j], upper[i][j] + estimated]
    };
    let mut network = vec![vec![StepValue { lower: 0.0, value: 0.0, upper: 0.0 }; count]; count];
    for i in 0..count {
        for j in 0..i {
            // Both entries are the same capacitance.
            let ([la, va, ua], [lb, vb, ub]) = (bounded(i, j), bounded(j, i));
            let mutual = sound((-ua).max(-ub), -0.5 * (va + vb), (-la).min(-lb)).ok_or_else(damaged)?;
            network[i][j] = mutual;
            network[j][i] = mutual;
        }
    }
    for i in 0..count {
        let [mut least, mut value, mut greatest] = bounded(i, i);
        let rounding = 1e-12 * greatest.abs();
        for j in (0..count).filter(|j| *j != i) {
            let mutual = network[i][j];
            least -= mutual.upper;
            value -= mutual.value;
            greatest -= mutual.lower;
        }
        // Where no field line leads to ground, this is the difference of equal numbers, and rounding may
        // leave less than zero.
        if greatest < 0.0 && greatest >= -rounding {
            greatest = 0.0;
        }
        network[i][i] = sound(least, value, greatest).ok_or_else(damaged)?;
    }
    Ok(network)
}

/// Nonnegative bounds, and a value within them. `None` if the bounds contradict each other.
fn sound(lower: f64, value: f64, upper: f64) -> Option<StepValue> {
    let lower = lower.max(0.0);
    let is_sound = [lower, value, upper].iter().all(|c| c.is_finite()) && lower <= upper;
    is_sound.then(|| StepValue { lower, value: value.clamp(lower, upper), upper })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_below_zero_become_zero_and_contradictions_are_none() {
        assert_eq!(sound(-1.0, -0.1, 2.0), Some(StepValue { lower: 0.0, value: 0.0, upper: 2.0 }));
        assert_eq!(sound(1.0, 3.0, 2.0), Some(StepValue { lower: 1.0, value: 2.0, upper: 2.0 }));
        assert_eq!(sound(-3.0, -2.0, -1.0), None);
        assert_eq!(sound(0.0, f64::NAN, 1.0), None);
    }
}
