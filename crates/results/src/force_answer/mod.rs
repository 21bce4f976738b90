//! The force that belongs to a measured capacitance, by the curve of a run.
//!
//! The true curve C(F) is taken to be monotone between the first and the last step. Of each step it is known that C lies between two
//! limits. Both together bound the force: where C grows, a step whose upper limit is below the measured capacitance has a smaller
//! force, and a step whose lower limit is above it has a larger one. This is the *enclosure*, and it needs no interpolation. Between
//! steps, the two limits are interpolated and moved apart by an estimate of the interpolation's error; that gives the narrower
//! *interval*, which is never wider than the enclosure.

mod curve;
mod file;
pub(crate) mod monotone;

use elastocap_case::MeasuredCapacitance;
use serde::Serialize;

pub use curve::{CurveError, CurveStep, ForceCurve};
pub use file::{CurveFileError, CurveOnFile, read_curve, read_document};
pub use monotone::MonotoneCubic;

/// A force with its limits.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ForceAnswer {
    /// The force at which the interpolated curve has the capacitance, N.
    pub force_n: f64,
    /// The true force is not below this one, N: errors of the measurement, of the computed steps and of the interpolation.
    pub force_lower_n: f64,
    /// It is not above this one, N.
    pub force_upper_n: f64,
    /// The limits if the measured capacitance alone were uncertain, N.
    pub from_measurement_n: [f64; 2],
    /// The limits if the computed curve alone were uncertain, N.
    pub from_curve_n: [f64; 2],
    /// The limits without interpolation, N: they hold for every monotone curve.
    pub enclosure_n: [f64; 2],
    /// Estimated error of the capacitance by interpolation, where the force is, F; `None` with two steps, of which nothing is known.
    pub interpolation_error_f: Option<f64>,
}

/// Why a measured capacitance has no force.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NoForce {
    /// No force of the curve gives this capacitance.
    #[error(
        "no force on the curve gives {value:e} F +- {error:e} F: from {first_force} N to {last_force} N its capacitance goes from \
         {first:e} F to {last:e} F; check unit and offset of the measurement, or run the case with loads up to that capacitance"
    )]
    Outside {
        /// What was measured, F.
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
    /// The measurement reaches below the first step, at which there is a force already.
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

/// What is known of C at the steps, counted so that it does not decrease with the force.
#[derive(Debug)]
struct Envelope {
    lower: Vec<f64>,
    upper: Vec<f64>,
    /// Of the interpolation, for each interval between steps; infinite where nothing is known.
    errors: Vec<f64>,
}

impl ForceCurve {
    /// The force that belongs to a measured capacitance.
    ///
    /// # Errors
    /// [`NoForce`] where the capacitance, or a part of what it may be, is not on the curve.
    pub fn force(&self, measured: MeasuredCapacitance) -> Result<ForceAnswer, NoForce> {
        let MeasuredCapacitance { value, error } = measured;
        let c = value * self.sign;
        let forces = &self.forces;
        let last = forces.len() - 1;
        let known = self.envelope();
        if c + error < known.lower[0] || c - error > known.upper[last] {
            return Err(NoForce::Outside {
                value,
                error,
                first_force: forces[0],
                last_force: forces[last],
                first: self.middle[0] * self.sign,
                last: self.middle[last] * self.sign,
            });
        }
        // No compressive force is below zero, and so nothing is lost below a first step without load.
        if forces[0] > 0.0 && c - error <= known.upper[0] {
            return Err(NoForce::BelowFirst(forces[0]));
        }
        if c + error >= known.lower[last] {
            return Err(NoForce::BeyondLast(forces[last]));
        }
        let exact =
            Envelope { lower: self.middle.clone(), upper: self.middle.clone(), errors: vec![0.0; last] };
        let loose = Envelope { errors: vec![f64::INFINITY; last], ..self.envelope() };
        let [force_lower, force_upper] = self.limits(&known, [c - error, c + error], true);
        let [force, _] = self.limits(&exact, [c, c], false);
        let here = self.interval(force);
        Ok(ForceAnswer {
            force_n: force.clamp(force_lower, force_upper),
            force_lower_n: force_lower,
            force_upper_n: force_upper,
            from_measurement_n: self.limits(&exact, [c - error, c + error], false),
            from_curve_n: self.limits(&known, [c, c], true),
            enclosure_n: self.limits(&loose, [c - error, c + error], true),
            interpolation_error_f: Some(self.errors[here]).filter(|error| error.is_finite()),
        })
    }

    fn envelope(&self) -> Envelope {
        Envelope { lower: self.lower.clone(), upper: self.upper.clone(), errors: self.errors.clone() }
    }

    /// The interval between steps that a force is in.
    fn interval(&self, force: f64) -> usize {
        let after = self.forces.partition_point(|step| *step <= force);
        after.saturating_sub(1).min(self.forces.len() - 2)
    }

    /// The least and the greatest force at which the capacitance may be between two values; those of the curve's ends where it may be
    /// beyond them. Errors of the steps' forces are counted if `force_errors` says so.
    fn limits(&self, curve: &Envelope, [least, greatest]: [f64; 2], force_errors: bool) -> [f64; 2] {
        let last = self.forces.len() - 1;
        let error_of = |k: usize| {
            if force_errors { self.force_errors[k].max(self.force_errors[k + 1]) } else { 0.0 }
        };
        // All steps up to here have less capacitance than was measured.
        let low = match curve.upper.iter().rposition(|upper| *upper < least) {
            None => self.forces[0],
            Some(k) if k == last => self.forces[last],
            Some(k) => {
                let upper = self.cubic(&curve.upper);
                (upper.argument(k, least - curve.errors[k]) - error_of(k)).max(0.0)
            }
        };
        // All steps from here on have more.
        let high = match curve.lower.iter().position(|lower| *lower > greatest) {
            None => self.forces[last],
            Some(0) => self.forces[0],
            Some(k) => {
                let lower = self.cubic(&curve.lower);
                lower.argument(k - 1, greatest + curve.errors[k - 1]) + error_of(k - 1)
            }
        };
        [low, high]
    }
}

#[cfg(test)]
mod tests;
