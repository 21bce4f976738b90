//! The computed capacitance against the load, at and between the steps, with its known errors.

use elastocap_case::{Case, MeasuredLoad};
use elastocap_coupling::outcome::{Outcome, StepResult};

use crate::force_answer::{CurveLimits, MonotoneCubic};

/// A value of the curve at one load. Capacitances and errors in F.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurveValue {
    /// The capacitance.
    pub capacitance: f64,
    /// Its derivative by the load, F/N, F/m or F.
    pub slope: f64,
    /// The error from the proved bounds and the stated errors of mechanics, geometry and force, to either
    /// side.
    pub error: f64,
    /// The estimated error of interpolation, to either side, in addition; `None` where the steps give no
    /// estimate, such as with two steps.
    pub interpolation_error: Option<f64>,
    /// The limit of the interpolation error for any monotonic curve through the two neighbouring steps, to
    /// either side, F. It counts where no estimate is known.
    pub monotonic_error: f64,
}

impl CurveValue {
    /// The sum of all errors, to either side, F.
    pub fn whole_error(&self) -> f64 {
        self.error + self.interpolation_error.unwrap_or(self.monotonic_error)
    }
}

/// A step in the form that the curve needs, in SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurveStep {
    /// The load: N, m, or U/H.
    pub load: f64,
    /// The stated error of the load, in its unit; zero where it is exact.
    pub load_error: f64,
    /// The capacitance, F.
    pub capacitance: f64,
    /// Half the distance between the bounds of the capacitance, with the stated errors of mechanics and
    /// geometry, F.
    pub error: f64,
}

/// Fewer than two steps of a run have both a load of this kind and a capacitance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "the run has {steps} steps with a {} and a capacitance, of different loads; a curve needs two at least: give `[load]` more of them",
    .load.name()
)]
pub struct NoCurve {
    /// The number of suitable steps.
    pub steps: usize,
    /// The kind of load that the curve is over.
    pub load: MeasuredLoad,
}

/// Capacitance against load. Between steps it is a cubic that is monotone wherever the steps are.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadCurve {
    steps: Vec<CurveStep>,
    cubic: MonotoneCubic,
    /// The error of the interpolation between each step and the next, F; `None` where the steps give no
    /// estimate.
    interpolation_errors: Vec<Option<f64>>,
}

impl LoadCurve {
    /// The curve of a run: its steps in contact that are neither shifted nor tilted.
    ///
    /// # Errors
    /// [`NoCurve`] if there are fewer than two of them.
    pub fn of(case: &Case, outcome: &Outcome, load: MeasuredLoad) -> Result<Self, NoCurve> {
        let is_suitable =
            |step: &&StepResult| case.pose(step.index).is_aligned() && !step.row.is_before_contact();
        let steps =
            outcome.steps.iter().filter(is_suitable).filter_map(|step| curve_step(step, load)).collect();
        Self::through(steps).map_err(|steps| NoCurve { steps, load })
    }

    /// The curve through steps in any order; of steps with the same load, one counts.
    ///
    /// # Errors
    /// The number of different loads, if it is below two.
    pub fn through(mut steps: Vec<CurveStep>) -> Result<Self, usize> {
        steps.sort_by(|a, b| a.load.total_cmp(&b.load));
        steps.dedup_by(|a, b| a.load == b.load);
        if steps.len() < 2 {
            return Err(steps.len());
        }
        let capacitances: Vec<f64> = steps.iter().map(|step| step.capacitance).collect();
        let loads: Vec<f64> = steps.iter().map(|step| step.load).collect();
        let at_steps =
            steps.iter().map(|step| [step.capacitance - step.error, step.capacitance + step.error]);
        let limits = CurveLimits::through(loads.clone(), at_steps.collect(), false);
        let cubic = MonotoneCubic::through(loads, capacitances);
        let interpolation_errors = (1..steps.len())
            .map(|k| {
                let error = steps[k - 1].error.max(steps[k].error);
                let farther =
                    |at: f64, [low, high]: [f64; 2]| (cubic.value(at) - low).max(high - cubic.value(at));
                limits.largest(k - 1, farther).map(|farthest| (farthest - error).max(0.0))
            })
            .collect();
        Ok(Self { steps, cubic, interpolation_errors })
    }

    /// The smallest and the largest load.
    pub fn range(&self) -> [f64; 2] {
        [self.steps[0].load, self.steps[self.steps.len() - 1].load]
    }

    /// The steps, by ascending load.
    pub fn steps(&self) -> &[CurveStep] {
        &self.steps
    }

    /// The value of the curve at a load; `None` outside of [`LoadCurve::range`]. A curve that begins without
    /// load is continued below it with its value at rest: a load below zero is one before contact.
    pub fn at(&self, load: f64) -> Option<CurveValue> {
        let [first, last] = self.range();
        let reached = load <= last && (load >= first || first == 0.0);
        reached.then(|| self.continued(load))
    }

    /// The curve continued beyond its ends: at rest below a first step without load, elsewhere along its
    /// tangent. A search may pass through there; no result should rest on it.
    pub fn continued(&self, load: f64) -> CurveValue {
        let [first, last] = self.range();
        let end = self.within(load.clamp(first, last));
        let slope = if load < first && first == 0.0 { 0.0 } else { end.slope };
        if load >= first && load <= last {
            end
        } else {
            CurveValue {
                capacitance: end.capacitance + slope * (load - load.clamp(first, last)),
                slope,
                ..end
            }
        }
    }

    /// The value of the curve at a load within [`LoadCurve::range`].
    fn within(&self, load: f64) -> CurveValue {
        let k =
            self.steps.partition_point(|step| step.load <= load).saturating_sub(1).min(self.steps.len() - 2);
        let [before, after] = [self.steps[k], self.steps[k + 1]];
        let (capacitance, slope) = (self.cubic.value(load), self.cubic.slope(load));
        let is_step = load == before.load || load == after.load;
        let away = |step: CurveStep| (step.capacitance - capacitance).abs();
        CurveValue {
            capacitance,
            slope,
            error: before.error.max(after.error) + slope.abs() * before.load_error.max(after.load_error),
            interpolation_error: if is_step { Some(0.0) } else { self.interpolation_errors[k] },
            monotonic_error: if is_step { 0.0 } else { away(before).max(away(after)) },
        }
    }
}

fn curve_step(step: &StepResult, load: MeasuredLoad) -> Option<CurveStep> {
    let row = &step.row;
    let layer = step.layer.as_ref().and_then(|layer| layer.relative_error_estimate);
    let (load_value, load_error) = match load {
        MeasuredLoad::Force => (row.force_n?, layer.unwrap_or(0.0) * row.force_n?),
        MeasuredLoad::Displacement => (row.top_displacement_m?, 0.0),
        MeasuredLoad::Compression => (row.compression?, 0.0),
    };
    let capacitance = row.capacitance_f?;
    // The load read off a curve is that of the layer's model, so that the error within the model counts.
    let error = capacitance.abs() * row.error_in_model().unwrap_or(0.0);
    let is_sound = [load_value, load_error, capacitance, error].iter().all(|number| number.is_finite());
    is_sound.then_some(CurveStep { load: load_value, load_error, capacitance, error })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(count: u32) -> LoadCurve {
        let step = |k: u32| {
            let load = f64::from(k) / f64::from(count);
            CurveStep { load, load_error: 0.0, capacitance: (-load).exp(), error: 1e-3 }
        };
        LoadCurve::through((0..=count).map(step).collect()).unwrap()
    }

    #[test]
    fn between_two_steps_that_are_all_the_error_is_that_of_any_monotonic_curve() {
        let step = |load: f64, capacitance: f64| CurveStep { load, load_error: 0.0, capacitance, error: 0.5 };
        let curve = LoadCurve::through(vec![step(0.0, 10.0), step(1.0, 4.0)]).unwrap();
        let value = curve.at(0.25).unwrap();
        assert_eq!(value.interpolation_error, None);
        assert_eq!(value.monotonic_error, value.capacitance - 4.0);
        assert_eq!(value.whole_error(), value.error + value.monotonic_error);
        assert_eq!(curve.at(1.0).unwrap().whole_error(), 0.5);
    }

    #[test]
    fn the_interpolation_error_is_at_least_what_a_smooth_curve_is_wrong_by() {
        let curve = curve(6);
        for k in 0..=100 {
            let load = 0.01 * f64::from(k);
            let value = curve.at(load).unwrap();
            assert!(
                (value.capacitance - (-load).exp()).abs() <= value.interpolation_error.unwrap() + 1e-15,
                "{load}"
            );
            assert_eq!(value.error, 1e-3);
        }
    }

    #[test]
    fn below_no_load_the_curve_is_at_rest_and_beyond_its_end_it_goes_on_along_its_tangent() {
        let curve = curve(4);
        assert!(curve.at(1.1).is_none());
        assert_eq!((curve.at(-0.1).unwrap().capacitance, curve.at(-0.1).unwrap().slope), (1.0, 0.0));
        assert_eq!(curve.continued(-0.1).capacitance, 1.0);
        let end = curve.at(1.0).unwrap();
        let beyond = curve.continued(1.5).capacitance;
        assert!((beyond - (end.capacitance + 0.5 * end.slope)).abs() < 1e-15);
    }

    #[test]
    fn the_error_of_a_force_counts_by_the_slope() {
        let step = |load: f64| CurveStep { load, load_error: 0.1, capacitance: 2.0 * load, error: 0.0 };
        let curve = LoadCurve::through([0.0, 1.0, 2.0].map(step).to_vec()).unwrap();
        assert!((curve.at(0.7).unwrap().error - 0.2).abs() < 1e-12);
    }
}
