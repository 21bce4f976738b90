//! The reference for true errors: the intersection of all proved intervals.

use elastocap_electrostatics::Bounded;

/// Proved bounds are theorems up to rounding of double precision: intervals that miss one another by less
/// than this share of their value count as touching. Not tuned: it only has to lie above rounding errors and
/// below errors that matter.
const ROUNDING: f64 = 1e-12;

/// The intersection of all proved intervals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reference {
    /// The largest lower bound, F.
    pub lower: f64,
    /// The smallest upper bound, F.
    pub upper: f64,
    /// The number of proved intervals.
    pub intervals: usize,
}

impl Reference {
    /// The intersection of proved intervals; `None` without one.
    pub fn of(proved: impl Iterator<Item = Bounded>) -> Option<Self> {
        proved.fold(None, |reference, found| {
            let Self { lower, upper, intervals } =
                reference.unwrap_or(Self { lower: found.lower, upper: found.upper, intervals: 0 });
            Some(Self {
                lower: lower.max(found.lower),
                upper: upper.min(found.upper),
                intervals: intervals + 1,
            })
        })
    }

    /// The middle of the interval, F.
    pub fn value(&self) -> f64 {
        0.5 * (self.lower + self.upper)
    }

    /// Half the width of the interval over its middle: true errors are known up to this.
    pub fn half_width(&self) -> f64 {
        0.5 * (self.upper - self.lower).abs() / self.value().abs()
    }

    /// Whether some two of the intervals are disjoint: then one of the bounds is wrong.
    pub fn contradicts(&self) -> bool {
        self.lower - self.upper > ROUNDING * self.value().abs()
    }

    /// Distance of a value from the middle, over the middle; it is known to [`Reference::half_width`].
    pub fn true_error(&self, value: f64) -> f64 {
        (value - self.value()).abs() / self.value().abs()
    }

    /// An error estimate over the true error; `None` unless the reference determines the true error to a
    /// quarter.
    pub fn estimate_over_true(&self, value: f64, estimate: f64) -> Option<f64> {
        let error = self.true_error(value);
        (error > 4.0 * self.half_width()).then(|| estimate / error)
    }

    /// Judges an error estimate, if the reference is sharp enough.
    pub fn judge(&self, value: f64, estimate: f64) -> Honesty {
        let (error, uncertain) = (self.true_error(value), self.half_width());
        if estimate < error - uncertain {
            Honesty::TooLow
        } else if estimate > MAX_CAUTION * (error + uncertain) {
            Honesty::TooHigh
        } else {
            Honesty::Fair
        }
    }
}

/// The largest acceptable ratio of an estimate to the true error.
pub const MAX_CAUTION: f64 = 10.0;

/// The verdict on an error estimate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Honesty {
    /// Between the true error and ten times the true error, as far as the reference is known.
    Fair,
    /// Certainly below the true error.
    TooLow,
    /// Certainly above ten times the true error.
    TooHigh,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn interval(lower: f64, upper: f64) -> Bounded {
        Bounded { value: 0.5 * (lower + upper), lower, upper }
    }

    #[test]
    fn the_reference_is_what_all_intervals_have_in_common() {
        let intervals = [interval(0.9, 1.1), interval(0.99, 1.2), interval(0.5, 1.03)];
        let found = Reference::of(intervals.into_iter()).unwrap();
        assert_eq!((found.lower, found.upper, found.intervals), (0.99, 1.03, 3));
        assert!(!found.contradicts());
        assert!((found.half_width() - 0.02 / 1.01).abs() < 1e-15);
        assert!((found.true_error(1.11) - 0.1 / 1.01).abs() < 1e-15);
        assert_eq!(Reference::of(std::iter::empty()), None);
    }

    #[test]
    fn intervals_with_nothing_in_common_contradict_each_other() {
        let apart = [interval(0.9, 1.0), interval(1.000001, 1.1)];
        assert!(Reference::of(apart.into_iter()).unwrap().contradicts());
        let touching = [interval(0.9, 1.0), interval(1.0 + 1e-13, 1.1)];
        assert!(!Reference::of(touching.into_iter()).unwrap().contradicts());
    }

    #[test]
    fn an_estimate_is_judged_only_where_the_reference_can_tell() {
        let sharp = Reference { lower: 1.0 - 1e-9, upper: 1.0 + 1e-9, intervals: 1 };
        assert_eq!(sharp.judge(1.001, 0.9e-3), Honesty::TooLow);
        assert_eq!(sharp.judge(1.001, 5e-3), Honesty::Fair);
        assert_eq!(sharp.judge(1.001, 11e-3), Honesty::TooHigh);
        assert!((sharp.estimate_over_true(1.001, 5e-3).unwrap() - 5.0).abs() < 1e-6);
        let blurred = Reference { lower: 0.999, upper: 1.001, intervals: 1 };
        assert_eq!(blurred.judge(1.001, 0.9e-3), Honesty::Fair);
        assert_eq!(blurred.judge(1.001, 11e-3), Honesty::Fair);
        assert_eq!(blurred.estimate_over_true(1.001, 5e-3), None);
    }
}
