//! A number between limits: the form in which capacitances and potentials are reported.

use serde::{Deserialize, Serialize};

/// A number between proved (or estimated) limits.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Bounded {
    /// Reported value, between the limits.
    pub value: f64,
    /// Proved lower bound; without bounds, value minus error estimate.
    pub lower: f64,
    /// Proved upper bound; without bounds, value plus error estimate.
    pub upper: f64,
}

impl Bounded {
    /// The distance to the farther limit over the value: half the distance between the limits where the value
    /// is their middle, as it mostly is. The true relative error is no larger where the limits are proved.
    /// Infinite where the value is zero and the limits are not.
    pub fn relative_error(&self) -> f64 {
        self.over_value((self.upper - self.value).max(self.value - self.lower))
    }

    /// The distance between the limits over the value, which is compared with the tolerance. Infinite where
    /// the value is zero and the limits are not.
    pub fn spread_over_value(&self) -> f64 {
        self.over_value(self.upper - self.lower)
    }

    /// Whether the number may be zero.
    pub fn holds_zero(&self) -> bool {
        self.lower <= 0.0 && 0.0 <= self.upper
    }

    /// Minus the number.
    #[must_use]
    pub fn negative(&self) -> Self {
        Self { value: -self.value, lower: -self.upper, upper: -self.lower }
    }

    /// The number between these limits and further ones. Where the further ones narrow the limits, its value
    /// is the middle of what is left. Further limits that contradict these, as rounding can make them do, are
    /// ignored.
    pub(crate) fn narrowed(self, lower: f64, upper: f64) -> Self {
        let (lower, upper) = (self.lower.max(lower), self.upper.min(upper));
        if lower > upper || (lower, upper) == (self.lower, self.upper) {
            return self;
        }
        Self { value: 0.5 * (lower + upper), lower, upper }
    }

    /// The distance over the magnitude of the value.
    fn over_value(&self, distance: f64) -> f64 {
        if distance == 0.0 { 0.0 } else { distance / self.value.abs() }
    }
}
