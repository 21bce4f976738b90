//! Changes of the entries of a capacitance matrix, and the largest one whose sign is certain.

use elastocap_case::{Case, Measurement, Mechanics};
use elastocap_coupling::outcome::{Outcome, Row, StepResult};
use elastocap_electrostatics::Bounded;

/// The change between two steps of a mutual capacitance, or of one against ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairChange {
    /// The positions of its terminals in [`Outcome::conductors`]; the same position twice for a capacitance
    /// against ground.
    pub terminals: [usize; 2],
    /// The capacitance at both steps, F.
    pub values: [f64; 2],
    /// The relative errors of both capacitances, from bounds and estimates.
    pub errors: [f64; 2],
    /// The limits of the change, F: its bounds, moved apart by the estimated errors of both capacitances.
    pub limits: [f64; 2],
}

impl PairChange {
    /// The change, F.
    pub fn change(&self) -> f64 {
        self.values[1] - self.values[0]
    }

    /// The capacitance that changes, as a measurement.
    pub fn measurement(&self) -> Measurement {
        match self.terminals {
            [i, j] if i == j => Measurement::Own(i),
            pair => Measurement::Mutual(pair),
        }
    }

    /// Whether both limits have the same sign.
    pub fn is_certain(&self) -> bool {
        self.limits[0] > 0.0 || self.limits[1] < 0.0
    }
}

/// The first step with a capacitance, and the first one under the largest load: later steps under the same
/// load may be shifted or tilted.
pub fn first_and_most_loaded(outcome: &Outcome) -> Option<[&StepResult; 2]> {
    let solved = || outcome.steps.iter().filter(|step| step.row.capacitance_f.is_some());
    let compression = |step: &StepResult| step.row.compression.unwrap_or(0.0);
    let most = solved().map(compression).fold(f64::NEG_INFINITY, f64::max);
    Some([solved().next()?, solved().find(|step| compression(step) >= most)?])
}

/// The changes between two steps of the capacitances that a case names in its `[measure]`, or of the mutual
/// capacitances of all pairs of terminals. Empty unless a matrix is measured, and is known at both steps.
pub fn pair_changes(case: &Case, outcome: &Outcome, steps: [&StepResult; 2]) -> Vec<PairChange> {
    let Some(Measurement::Matrix { terminals: count, .. }) = outcome.measurement else { return Vec::new() };
    let measured = case.measured_entries();
    let pairs = match measured.as_slice() {
        [] => (0..count).flat_map(|i| (i + 1..count).map(move |j| [i, j])).collect(),
        _ => measured,
    };
    let share = model_share(case, steps.map(|step| &step.row));
    pairs.into_iter().filter_map(|pair| change_of(pair, steps, share)).collect()
}

/// The capacitances that `[measure]` names, if it names several: for each step that has the matrix, the step
/// with their changes since the first one, in the order of the case.
pub(crate) fn measured_changes<'a>(
    case: &Case,
    outcome: &'a Outcome,
) -> Vec<(&'a StepResult, Vec<PairChange>)> {
    let known = || outcome.steps.iter().filter(|step| step.maxwell.is_some());
    let Some(first) = known().next().filter(|_| !case.measured_entries().is_empty()) else {
        return Vec::new();
    };
    known().map(|step| (step, pair_changes(case, outcome, [first, step]))).collect()
}

/// The changes of every capacitance of a matrix between two steps; `None` for those that are not known at
/// both. Empty unless a matrix is measured.
pub(crate) fn matrix_of_changes(
    case: &Case,
    outcome: &Outcome,
    steps: [&StepResult; 2],
) -> Vec<Vec<Option<PairChange>>> {
    let Some(Measurement::Matrix { terminals: count, .. }) = outcome.measurement else { return Vec::new() };
    let share = model_share(case, steps.map(|step| &step.row));
    (0..count).map(|i| (0..count).map(|j| change_of([i, j], steps, share)).collect()).collect()
}

/// The change of one capacitance, where `share` is the error of the layer's model over a change.
///
/// The estimated errors in a row are those of the capacitance that the curve shows. The errors of the layer's
/// mesh and of the faceting are taken to be the same share of every capacitance, and the error of the layer's
/// model the same share of every change.
fn change_of([i, j]: [usize; 2], steps: [&StepResult; 2], share: f64) -> Option<PairChange> {
    let entry = |step: &StepResult| {
        let entry = step.maxwell.as_ref()?.get(i)?.get(j)?;
        Some(if i == j { *entry } else { entry.negative() })
    };
    let [before, after] = steps.map(entry);
    let change = pair_change([i, j], [before?, after?], steps.map(|step| &step.row), share);
    let is_same = steps[0].index == steps[1].index || steps[1].same_as == Some(steps[0].index);
    Some(if is_same { PairChange { limits: [0.0; 2], ..change } } else { change })
}

/// The certain change that is largest in F.
pub fn largest_certain(changes: &[PairChange]) -> Option<&PairChange> {
    let certain = changes.iter().filter(|change| change.is_certain());
    certain.max_by(|a, b| a.change().abs().total_cmp(&b.change().abs()))
}

/// The error of the layer's model over the change of the capacitance in the rows; zero without mechanics, and
/// with finite elements in three dimensions, which have no such error.
fn model_share(case: &Case, [first, last]: [&Row; 2]) -> f64 {
    if let None | Some(Mechanics::Solid(_)) = case.mechanics {
        return 0.0;
    }
    let absolute = |row: &Row| Some(row.model_error_estimate? * row.capacitance_f?.abs());
    let errors = absolute(first).zip(absolute(last)).map_or(f64::INFINITY, |(a, b)| a + b);
    let change = first.capacitance_f.zip(last.capacitance_f).map_or(0.0, |(a, b)| (b - a).abs());
    // The share is undefined where nothing changes.
    Some(errors / change).filter(|share| !share.is_nan()).unwrap_or(f64::INFINITY)
}

/// The change from `before` to `after`, given the rows of both steps and the `share` of [`change_of`].
fn pair_change(
    terminals: [usize; 2],
    [before, after]: [Bounded; 2],
    [first, last]: [&Row; 2],
    share: f64,
) -> PairChange {
    let values = [before.value, after.value];
    let change = after.value - before.value;
    let of_model = if change == 0.0 { 0.0 } else { share * change.abs() };
    let error_of_meshes = |row: &Row, value: f64| {
        let estimated = [row.mechanics_error_estimate, row.geometry_error_estimate];
        estimated.into_iter().flatten().sum::<f64>() * value.abs()
    };
    let of_meshes = [error_of_meshes(first, before.value), error_of_meshes(last, after.value)];
    let estimated = of_meshes[0] + of_meshes[1] + of_model;
    let relative = |capacitance: &Bounded, estimated: f64| {
        capacitance.relative_error() + estimated / capacitance.value.abs()
    };
    PairChange {
        terminals,
        values,
        errors: [relative(&before, of_meshes[0]), relative(&after, of_meshes[1] + of_model)],
        limits: [after.lower - before.upper - estimated, after.upper - before.lower + estimated],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bounded(value: f64, half: f64) -> Bounded {
        Bounded { value, lower: value - half, upper: value + half }
    }

    #[test]
    fn the_largest_change_of_a_pair_counts_only_if_its_limits_leave_one_sign() {
        let exact = Row::default();
        let change = |terminals, values, row: &Row, share| pair_change(terminals, values, [row, row], share);
        // The larger change is hidden in its bounds.
        let hidden = change([0, 1], [bounded(10.0, 1.0), bounded(9.0, 1.0)], &exact, 0.0);
        let small = change([0, 2], [bounded(5.0, 0.01), bounded(5.1, 0.01)], &exact, 0.0);
        let larger = change([1, 2], [bounded(5.0, 0.01), bounded(4.5, 0.01)], &exact, 0.0);
        assert_eq!((hidden.limits, hidden.is_certain()), ([-3.0, 1.0], false));
        assert_eq!(largest_certain(&[hidden, small, larger]).map(|change| change.terminals), Some([1, 2]));
        assert!(largest_certain(&[hidden]).is_none());
        // An estimated error of 6 % of both hides the change of 10 %; a model that is off by more than the
        // change hides every change.
        let rough = Row { mechanics_error_estimate: Some(0.06), ..Row::default() };
        let pair = [bounded(5.0, 0.0), bounded(4.5, 0.0)];
        assert!(!change([1, 2], pair, &rough, 0.0).is_certain());
        let uncertain = change([1, 2], pair, &exact, 0.9);
        assert!(
            uncertain.is_certain()
                && (uncertain.limits[1] + 0.05).abs() < 1e-12
                && (uncertain.errors[1] - 0.1).abs() < 1e-12
        );
        for share in [1.1, f64::INFINITY] {
            assert!(!change([1, 2], pair, &exact, share).is_certain());
        }
    }
}
