//! By how much the capacitance has changed since the first step: what a sensor's electronics read.

use elastocap_coupling::outcome::StepResult;

/// The change of a capacitance relative to that of the first step that has one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Change {
    /// C over that of the first step, less one.
    pub(crate) value: f64,
    /// It is not smaller.
    pub(crate) lower: f64,
    /// It is not larger.
    pub(crate) upper: f64,
}

/// The change at each step; `None` where a step has no capacitance.
///
/// The bounds are those of the quotient of two capacitances that are each known between bounds, and hold whatever the errors of the
/// two have in common. The step that the others are compared with has not changed, and neither have those that repeat it.
pub(crate) fn changes(steps: &[StepResult]) -> Vec<Option<Change>> {
    let known = |step: &StepResult| {
        let row = &step.row;
        let found = [row.capacitance_f?, row.capacitance_lower_f?, row.capacitance_upper_f?];
        found.iter().all(|c| c.is_finite() && *c > 0.0).then_some(found)
    };
    let Some((first, [value, lower, upper])) = steps.iter().find_map(|step| Some((step, known(step)?)))
    else {
        return vec![None; steps.len()];
    };
    let change = |step: &StepResult| {
        let [own, least, most] = known(step)?;
        let same = step.index == first.index || step.same_as == Some(first.index);
        Some(if same {
            Change { value: 0.0, lower: 0.0, upper: 0.0 }
        } else {
            Change { value: own / value - 1.0, lower: least / upper - 1.0, upper: most / lower - 1.0 }
        })
    };
    steps.iter().map(change).collect()
}
