//! The curve of a run, prepared for reading forces from capacitances.

use super::curve_limits::CurveLimits;
use super::monotone::MonotoneCubic;

/// A load step in the form that the curve needs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurveStep {
    /// The number of the step in the run, for messages.
    pub index: usize,
    /// The force, N.
    pub force: f64,
    /// The error of the force, N; zero where it is exact.
    pub force_error: f64,
    /// The reported capacitance, F.
    pub capacitance: f64,
    /// The lower limit of the capacitance, F, from the bounds of the field and the estimated errors.
    pub lower: f64,
    /// The upper limit of the capacitance, F.
    pub upper: f64,
    /// The part of the distance to either limit that is estimated errors, F. It varies slowly from step to
    /// step.
    pub estimated: f64,
}

/// The reason why steps are not a curve that forces can be read from.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CurveError {
    /// There are fewer than two different forces.
    #[error(
        "the result has {0} steps with a force and a capacitance, of different forces; a curve needs two at least: give `[load]` of the \
         case more of them"
    )]
    TooFewSteps(usize),
    /// A force or a capacitance is impossible.
    #[error("step {0} has a force or a capacitance that cannot be; run the case again")]
    Damaged(usize),
    /// The curve is not monotone, so that several forces may give the same capacitance.
    #[error(
        "the capacitance does not tell the force: it {before} up to step {step} ({force} N) and then {after}; measure where the curve is \
         monotonic and give `[load]` of the case those loads only, or, if the turn is smaller than the bounds, tighten `relative_tolerance`"
    )]
    NotMonotonic {
        /// The step at which the curve turns.
        step: usize,
        /// The force there, N.
        force: f64,
        /// The course of the capacitance before that step, as a verb.
        before: &'static str,
        /// The course of the capacitance after it.
        after: &'static str,
    },
    /// The capacitance changes by less than its errors.
    #[error(
        "the capacitance changes by no more than its bounds from the smallest to the largest force; tighten `relative_tolerance`, or run \
         larger loads"
    )]
    Flat,
}

/// A monotone curve of capacitance over force, with its errors.
#[derive(Debug, Clone, PartialEq)]
pub struct ForceCurve {
    /// The forces of the steps, N, strictly increasing; at least two.
    pub(super) forces: Vec<f64>,
    /// The error of each force, N.
    pub(super) force_errors: Vec<f64>,
    /// 1 where the capacitance grows with the force, -1 where it falls. The capacitances below are multiplied
    /// by it.
    pub(super) sign: f64,
    /// The least capacitance at each step, F, times `sign`; like the two lists below, it does not decrease.
    pub(super) lower: Vec<f64>,
    /// The reported capacitance at each step, F, times `sign`.
    pub(super) middle: Vec<f64>,
    /// The greatest capacitance at each step, F, times `sign`.
    pub(super) upper: Vec<f64>,
    /// The limits of the curve between the steps.
    pub(super) limits: CurveLimits,
}

impl ForceCurve {
    /// Makes a curve from load steps in any order.
    ///
    /// # Errors
    /// [`CurveError`] where they are too few or not monotone.
    pub fn new(mut steps: Vec<CurveStep>) -> Result<Self, CurveError> {
        for step in &steps {
            let numbers = [step.force, step.force_error, step.capacitance, step.lower, step.upper];
            let is_sound = numbers.iter().all(|number| number.is_finite())
                && step.force >= 0.0
                && step.force_error >= 0.0
                && step.lower <= step.upper;
            if !is_sound {
                return Err(CurveError::Damaged(step.index));
            }
        }
        steps.sort_by(|a, b| a.force.total_cmp(&b.force).then(a.index.cmp(&b.index)));
        // Steps with the same force count as one.
        steps.dedup_by(|later, earlier| later.force == earlier.force);
        let [first, .., last] = steps.as_slice() else { return Err(CurveError::TooFewSteps(steps.len())) };
        let (sign, before, after) = if last.capacitance > first.capacitance {
            (1.0, "grows", "falls")
        } else {
            (-1.0, "falls", "grows")
        };
        // The curve turns at the first step from which the capacitance changes in the other direction.
        let turn = steps.windows(2).find(|pair| sign * (pair[1].capacitance - pair[0].capacitance) < 0.0);
        if let Some([step, _]) = turn {
            let (before, after) = if step.index == first.index { (after, before) } else { (before, after) };
            // If the curve begins in the wrong direction, the message names the later turn.
            let turn = if step.index == first.index {
                let back = |pair: &&[CurveStep]| sign * (pair[1].capacitance - pair[0].capacitance) > 0.0;
                steps.windows(2).find(back).map_or(*step, |pair| pair[0])
            } else {
                *step
            };
            return Err(CurveError::NotMonotonic { step: turn.index, force: turn.force, before, after });
        }
        // The limits of one step limit the others, since the curve is monotone.
        let mut lower: Vec<f64> = steps.iter().map(|s| if sign > 0.0 { s.lower } else { -s.upper }).collect();
        let mut upper: Vec<f64> = steps.iter().map(|s| if sign > 0.0 { s.upper } else { -s.lower }).collect();
        for k in 1..lower.len() {
            lower[k] = lower[k].max(lower[k - 1]);
        }
        for k in (1..upper.len()).rev() {
            upper[k - 1] = upper[k - 1].min(upper[k]);
        }
        if lower[lower.len() - 1] <= upper[0] {
            return Err(CurveError::Flat);
        }
        let forces: Vec<f64> = steps.iter().map(|step| step.force).collect();
        let of_field = |s: &CurveStep| {
            let [least, greatest] = [s.lower + s.estimated, s.upper - s.estimated];
            if sign > 0.0 { [least, greatest] } else { [-greatest, -least] }
        };
        let limits = CurveLimits::through(forces.clone(), steps.iter().map(of_field).collect(), true)
            .with_shared_errors(steps.iter().map(|step| step.estimated).collect());
        Ok(Self {
            limits,
            forces,
            force_errors: steps.iter().map(|step| step.force_error).collect(),
            sign,
            middle: steps.iter().map(|step| sign * step.capacitance).collect(),
            lower,
            upper,
        })
    }

    /// The interpolation of values at the steps.
    pub(super) fn cubic(&self, values: &[f64]) -> MonotoneCubic {
        MonotoneCubic::through(self.forces.clone(), values.to_vec())
    }
}
