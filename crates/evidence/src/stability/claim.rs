//! The claims of an entry: a number with its stated error, and independent limits of its true value.

use elastocap_electrostatics::Bounded;

use elastocap_coupling::outcome::{Outcome, Row};

/// Relative error that rounding may add to a bound or a formula: bounds are theorems up to this. Not tuned:
/// it only has to lie above rounding errors and below errors that matter.
pub const ROUNDING: f64 = 1e-12;

/// The limits between which a number lies, known independently of the program.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Truth {
    /// The lower limit; may be minus infinity.
    pub low: f64,
    /// The upper limit; may be infinite.
    pub high: f64,
}

impl Truth {
    /// A truth between two numbers.
    pub fn between(low: f64, high: f64) -> Self {
        Self { low, high }
    }

    /// A value with the relative error that it is known to.
    pub fn value(value: f64, relative: f64) -> Self {
        let slack = relative * value.abs();
        Self { low: value - slack, high: value + slack }
    }

    /// A truth of at most this number.
    pub fn at_most(high: f64) -> Self {
        Self { low: f64::NEG_INFINITY, high }
    }

    /// A truth of at least this number.
    pub fn at_least(low: f64) -> Self {
        Self { low, high: f64::INFINITY }
    }

    /// The limits that a solve of another scene proves, scaled.
    pub fn proved(bounds: Bounded, scale: f64) -> Self {
        Self { low: scale * bounds.lower, high: scale * bounds.upper }
    }
}

/// A number with its stated limits beside the truth.
#[derive(Debug, Clone, PartialEq)]
pub struct Claim {
    /// The name of the number, in words.
    pub what: String,
    /// Its unit; empty for none.
    pub unit: &'static str,
    /// The number.
    pub value: f64,
    /// Its stated lower limit.
    pub lower: f64,
    /// Its stated upper limit.
    pub upper: f64,
    /// The true value, as far as it is known.
    pub truth: Truth,
}

impl Claim {
    /// A capacitance.
    pub fn capacitance(what: impl Into<String>, found: Bounded, truth: Truth) -> Self {
        let Bounded { value, lower, upper } = found;
        Self { what: what.into(), unit: "F", value, lower, upper, truth }
    }

    /// A claim on the number of a formula that should have this relative error.
    pub fn formula(
        what: impl Into<String>,
        unit: &'static str,
        value: f64,
        relative: f64,
        truth: Truth,
    ) -> Self {
        let slack = relative * value.abs();
        Self { what: what.into(), unit, value, lower: value - slack, upper: value + slack, truth }
    }

    /// Whether the truth is compatible with the stated limits, and the value lies within them.
    pub fn holds(&self) -> bool {
        let Self { value, lower, upper, truth, .. } = self;
        let slack = ROUNDING * lower.abs().max(upper.abs());
        value.is_finite()
            && lower - slack <= *value
            && *value <= upper + slack
            && truth.low <= upper + slack
            && lower - slack <= truth.high
    }

    /// The stated relative error.
    pub fn stated_error(&self) -> f64 {
        if self.value == 0.0 { 0.0 } else { 0.5 * (self.upper - self.lower) / self.value.abs() }
    }

    /// The largest relative error that is compatible with the truth; `None` if only one side is known.
    pub fn true_error(&self) -> Option<f64> {
        let Truth { low, high } = self.truth;
        let scale = low.abs().max(high.abs());
        if !scale.is_finite() {
            return None;
        }
        let error = (self.value - low).abs().max((self.value - high).abs());
        Some(if scale == 0.0 { error } else { error / scale })
    }

    /// Whether the truth is so narrow that [`Claim::true_error`] is the error itself, not only a limit of it.
    pub fn is_sharp(&self) -> bool {
        let Truth { low, high } = self.truth;
        let error = 0.5 * ((self.value - low).abs() + (self.value - high).abs());
        high - low <= 0.5 * error || high == low
    }
}

/// All claims of an entry, or the reason why there are none.
pub(super) type Claims = Result<Vec<Claim>, ClaimError>;

/// The reason why nothing can be claimed: the outcomes of an entry lack a number that it is about, or have
/// one that they must not have.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ClaimError {
    /// The case has no such step.
    #[error("case {case} has no step {step}")]
    Step {
        /// The number of the case in the entry.
        case: usize,
        /// The step.
        step: usize,
    },
    /// A cell of the row is empty.
    #[error("no {0} was given")]
    Cell(String),
    /// There is a force where the formula has none.
    #[error("a force of {0} N is given")]
    Force(f64),
    /// There is no capacitance between two terminals.
    #[error("case {case} has no two-terminal capacitance")]
    TwoTerminal {
        /// The number of the case in the entry.
        case: usize,
    },
    /// There is no such entry of the Maxwell matrix.
    #[error("case {case} has no Maxwell entry ({row}, {column})")]
    MaxwellEntry {
        /// The number of the case in the entry.
        case: usize,
        /// The row of the entry of the matrix.
        row: usize,
        /// The column of the entry of the matrix.
        column: usize,
    },
}

/// The row of a step.
pub(super) fn row(outcomes: &[Outcome], case: usize, step: usize) -> Result<&Row, ClaimError> {
    let found = outcomes.get(case).and_then(|outcome| outcome.steps.get(step));
    found.map(|found| &found.row).ok_or(ClaimError::Step { case, step })
}

/// A number that the row should have.
pub(super) fn known(value: Option<f64>, what: &str) -> Result<f64, ClaimError> {
    value.ok_or_else(|| ClaimError::Cell(what.to_owned()))
}

/// The two-terminal capacitance of the first step.
pub(super) fn terminals(outcomes: &[Outcome], case: usize) -> Result<Bounded, ClaimError> {
    let found = outcomes.get(case).and_then(|outcome| outcome.steps.first()?.two_terminal);
    found.ok_or(ClaimError::TwoTerminal { case })
}

/// An entry of the Maxwell matrix of the first step.
pub(super) fn maxwell(outcomes: &[Outcome], case: usize, i: usize, j: usize) -> Result<Bounded, ClaimError> {
    let matrix = outcomes.get(case).and_then(|outcome| outcome.steps.first()?.maxwell.as_ref());
    let entry = matrix.and_then(|matrix| matrix.get(i)?.get(j).copied());
    entry.ok_or(ClaimError::MaxwellEntry { case, row: i, column: j })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_truth_of_a_negative_number_lies_on_both_sides_of_it() {
        let truth = Truth::value(-2.0, 0.25);
        assert_eq!((truth.low, truth.high), (-2.5, -1.5));
    }

    fn claim(truth: Truth) -> Claim {
        Claim::capacitance("C", Bounded { value: 2.0, lower: 1.9, upper: 2.1 }, truth)
    }

    #[test]
    fn a_truth_outside_the_stated_limits_is_told() {
        assert!(claim(Truth::value(2.05, 0.0)).holds());
        assert!(!claim(Truth::value(2.11, 0.0)).holds());
        assert!(claim(Truth::value(2.11, 0.01)).holds());
        assert!(!claim(Truth::at_most(1.8)).holds() && claim(Truth::at_most(1.95)).holds());
        assert!(!claim(Truth::at_least(2.2)).holds() && claim(Truth::at_least(0.0)).holds());
    }

    #[test]
    fn numbers_that_are_none_never_hold() {
        let nan = Bounded { value: f64::NAN, lower: 0.0, upper: 1.0 };
        assert!(!Claim::capacitance("C", nan, Truth::at_least(0.0)).holds());
        let nan = Bounded { value: 1.0, lower: f64::NAN, upper: 1.0 };
        assert!(!Claim::capacitance("C", nan, Truth::at_least(0.0)).holds());
        assert!(!claim(Truth::value(f64::NAN, 0.0)).holds());
    }

    #[test]
    fn the_true_error_is_that_of_the_value() {
        assert_eq!(claim(Truth::value(2.5, 0.0)).true_error(), Some(0.2));
        assert_eq!(claim(Truth::at_least(1.0)).true_error(), None);
        assert!(claim(Truth::value(2.5, 0.0)).is_sharp() && !claim(Truth::between(1.0, 3.0)).is_sharp());
    }

    #[test]
    fn a_value_outside_its_own_limits_never_holds() {
        for value in [1.8, 2.2] {
            let found = Bounded { value, lower: 1.9, upper: 2.1 };
            assert!(!Claim::capacitance("C", found, Truth::at_least(0.0)).holds(), "{value}");
        }
    }

    #[test]
    fn the_true_error_reaches_to_the_far_end_of_the_truth_on_either_side() {
        // The value is 2.
        for (low, high, error) in
            [(1.75, 3.0, 1.0 / 3.0), (1.0, 2.25, 1.0 / 2.25), (2.5, 3.0, 1.0 / 3.0), (1.0, 1.5, 1.0 / 1.5)]
        {
            assert_eq!(claim(Truth::between(low, high)).true_error(), Some(error), "{low} {high}");
        }
        for (low, high) in [(2.4, 2.6), (1.4, 1.6)] {
            assert!(claim(Truth::between(low, high)).is_sharp(), "{low} {high}");
        }
        for (low, high) in [(1.9, 2.3), (1.7, 2.1), (2.0, 3.0)] {
            assert!(!claim(Truth::between(low, high)).is_sharp(), "{low} {high}");
        }
    }

    #[test]
    fn a_negative_number_is_judged_as_the_positive_one_of_its_size() {
        for (value, spread) in [(2.0, 0.1), (2.0, 0.0)] {
            for (low, high) in [(1.75, 3.0), (1.0, 2.05), (2.0, 2.0), (2.4, 2.6)] {
                let limits = |sign: f64| [sign * value - spread, sign * value + spread];
                let one = |sign: f64, [low, high]: [f64; 2]| {
                    let [lower, upper] = limits(sign);
                    let found = Bounded { value: sign * value, lower, upper };
                    Claim::capacitance("C", found, Truth::between(low, high))
                };
                let (plus, minus) = (one(1.0, [low, high]), one(-1.0, [-high, -low]));
                let results = |c: &Claim| (c.holds(), c.stated_error(), c.true_error(), c.is_sharp());
                assert_eq!(results(&plus), results(&minus), "{value} {spread} {low} {high}");
            }
        }
        let formula = |value: f64| Claim::formula("F", "N", value, 0.25, Truth::value(value, 0.0));
        assert_eq!((formula(2.0).lower, formula(2.0).upper), (1.5, 2.5));
        assert_eq!((formula(-2.0).lower, formula(-2.0).upper), (-2.5, -1.5));
    }

    #[test]
    fn what_a_solve_of_a_scene_proves_holds_for_the_scene_of_another_size() {
        let truth = Truth::proved(Bounded { value: 2.0, lower: 1.5, upper: 2.5 }, 10.0);
        assert_eq!(truth, Truth::between(15.0, 25.0));
    }
}
