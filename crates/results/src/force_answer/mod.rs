//! The force that a measured capacitance belongs to, read from the curve of a run.
//!
//! The true curve C(F) is taken to be monotone between the first and the last step, and at each step C lies
//! between two limits. Together they bound the force: where C grows, a step whose upper limit is below the
//! measured capacitance has a smaller force, and a step whose lower limit is above it has a larger one. This
//! is the *enclosure*, and it needs no interpolation. Where the steps show that the curve bends one way, they
//! also limit it between one step and the next ([`CurveLimits`]); that gives the narrower *interval*, which
//! is never wider than the enclosure.

mod curve;
mod curve_limits;
mod file;
pub(crate) mod monotone;

use elastocap_case::MeasuredCapacitance;
use serde::Serialize;

pub use curve::{CurveError, CurveStep, ForceCurve};
pub use curve_limits::CurveLimits;
pub use file::{CurveFileError, CurveOnFile, read_curve, read_document};
pub use monotone::MonotoneCubic;

/// A force with its limits.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ForceAnswer {
    /// The force at which the interpolated curve has the capacitance, N.
    pub force_n: f64,
    /// The lower limit of the true force, N, from the errors of the measurement, of the computed steps and of
    /// the interpolation.
    pub force_lower_n: f64,
    /// The upper limit of the true force, N.
    pub force_upper_n: f64,
    /// The limits if the measured capacitance alone were uncertain, N.
    pub from_measurement_n: [f64; 2],
    /// The limits if the computed curve alone were uncertain, N.
    pub from_curve_n: [f64; 2],
    /// The limits without interpolation, N: they hold for every monotone curve.
    pub enclosure_n: [f64; 2],
    /// The estimated error of the capacitance by interpolation between the two steps around the force, F;
    /// `None` where the steps only show that the curve is monotone.
    pub interpolation_error_f: Option<f64>,
}

/// The reason why a measured capacitance has no force.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NoForce {
    /// No force of the curve gives this capacitance.
    #[error(
        "no force on the curve gives {value:e} F +- {error:e} F: from {first_force} N to {last_force} N its capacitance goes from \
         {first:e} F to {last:e} F; check unit and offset of the measurement, or run the case with loads up to that capacitance"
    )]
    Outside {
        /// The measured capacitance, F.
        value: f64,
        /// Its error, F.
        error: f64,
        /// Smallest force of the curve, N.
        first_force: f64,
        /// Largest force of the curve, N.
        last_force: f64,
        /// Capacitance at the smallest force, F.
        first: f64,
        /// Capacitance at the largest force, F.
        last: f64,
    },
    /// The measurement reaches below the first step, which has a nonzero force.
    #[error(
        "the force may be smaller than {0} N, where the curve begins; add a step without load to the case (`compression` or `force` 0)"
    )]
    BelowFirst(f64),
    /// The measurement reaches beyond the last step.
    #[error(
        "the force may be larger than {0} N, where the curve ends; add a step with a larger load to the case"
    )]
    BeyondLast(f64),
}

impl ForceCurve {
    /// The force that belongs to a measured capacitance.
    ///
    /// # Errors
    /// [`NoForce`] where the measured interval is not entirely on the curve.
    pub fn force(&self, measured: MeasuredCapacitance) -> Result<ForceAnswer, NoForce> {
        let MeasuredCapacitance { value, error } = measured;
        let c = value * self.sign;
        let forces = &self.forces;
        let last = forces.len() - 1;
        if c + error < self.lower[0] || c - error > self.upper[last] {
            return Err(NoForce::Outside {
                value,
                error,
                first_force: forces[0],
                last_force: forces[last],
                first: self.middle[0] * self.sign,
                last: self.middle[last] * self.sign,
            });
        }
        // Compressive forces are not below zero, so that nothing is missing below a first step without load.
        if forces[0] > 0.0 && c - error <= self.upper[0] {
            return Err(NoForce::BelowFirst(forces[0]));
        }
        if c + error >= self.lower[last] {
            return Err(NoForce::BeyondLast(forces[last]));
        }
        let limits = [c - error, c + error];
        let [force_lower, force_upper] = self.by_limits(limits);
        let [force, _] = self.by_cubic([c, c]);
        Ok(ForceAnswer {
            force_n: force.clamp(force_lower, force_upper),
            force_lower_n: force_lower,
            force_upper_n: force_upper,
            from_measurement_n: self.by_cubic(limits),
            from_curve_n: self.by_limits([c, c]),
            enclosure_n: self.by_steps(limits),
            interpolation_error_f: self.interpolation_error(self.interval(force)),
        })
    }

    /// The interval between steps that contains a force.
    fn interval(&self, force: f64) -> usize {
        let after = self.forces.partition_point(|step| *step <= force);
        after.saturating_sub(1).min(self.forces.len() - 2)
    }

    /// The excess width of the limits between step `k` and the next over the interpolated limits of the
    /// steps, F.
    fn interpolation_error(&self, k: usize) -> Option<f64> {
        let [lower, upper] = [&self.lower, &self.upper].map(|values| self.cubic(values));
        let excess =
            |at: f64, [low, high]: [f64; 2]| (lower.value(at) - low).max(high - upper.value(at)).max(0.0);
        self.limits.largest(k, excess).filter(|_| self.limits.is_curved(k))
    }

    /// The last step whose capacitance is certainly less than `least`, and the first whose capacitance is
    /// certainly more than `greatest`.
    fn around(&self, [least, greatest]: [f64; 2]) -> [Option<usize>; 2] {
        [self.upper.iter().rposition(|c| *c < least), self.lower.iter().position(|c| *c > greatest)]
    }

    /// The larger error of the forces of step `k` and the next, N.
    fn error_of(&self, k: usize) -> f64 {
        self.force_errors[k].max(self.force_errors[k + 1])
    }

    /// The least and the greatest force at which the capacitance may be between two values, by the limits of
    /// the curve between its steps; the ends of the curve where it may be beyond them. Errors of the steps'
    /// forces are counted.
    fn by_limits(&self, values: [f64; 2]) -> [f64; 2] {
        self.between(
            values,
            |k, least| self.limits.first_reach(k, least),
            |k, most| self.limits.last_hold(k, most),
        )
    }

    /// The least and the greatest force at which the capacitance may be between two values, by the steps
    /// alone. Errors of the steps' forces are counted.
    fn by_steps(&self, values: [f64; 2]) -> [f64; 2] {
        self.between(values, |k, _| self.forces[k], |k, _| self.forces[k + 1])
    }

    /// The least and the greatest force at which the capacitance may be between two values. In the interval
    /// after step `k`, `first` gives the first force at which a value may be reached, and `last` the last
    /// force at which the curve may have it.
    fn between(
        &self,
        values: [f64; 2],
        first: impl Fn(usize, f64) -> f64,
        last: impl Fn(usize, f64) -> f64,
    ) -> [f64; 2] {
        let end = self.forces.len() - 1;
        let [below, above] = self.around(values);
        let low = match below {
            None => self.forces[0],
            Some(k) if k == end => self.forces[end],
            Some(k) => (first(k, values[0]) - self.error_of(k)).max(0.0),
        };
        let high = match above {
            None => self.forces[end],
            Some(0) => self.forces[0],
            Some(k) => last(k - 1, values[1]) + self.error_of(k - 1),
        };
        [low, high]
    }

    /// The first force at which the interpolated curve has the value `least`, and the last at which it has
    /// `greatest`; its ends where it does not reach them.
    fn by_cubic(&self, [least, greatest]: [f64; 2]) -> [f64; 2] {
        let cubic = self.cubic(&self.middle);
        let at = |after: usize, value| match after.checked_sub(1) {
            None => self.forces[0],
            Some(k) => cubic.argument(k.min(self.forces.len() - 2), value),
        };
        let first = self.middle.partition_point(|c| *c < least);
        let last = self.middle.partition_point(|c| *c <= greatest);
        [at(first, least), at(last, greatest)]
    }
}

#[cfg(test)]
mod tests;
