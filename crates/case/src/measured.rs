//! Parses a measured capacitance with its error, as an argument has it: `41.2fF`, `41.2 fF +- 0.05 fF`,
//! `41.2fF±0.05fF`.

use std::str::FromStr;

use crate::units::{self, CAPACITANCE, NotAQuantity};

/// A measured capacitance, F.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredCapacitance {
    /// The measured value, F; greater than zero.
    pub value: f64,
    /// The largest difference of the true value from it, F; zero if no error was given.
    pub error: f64,
}

/// The reason why a text is not a measured capacitance.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum MeasuredCapacitanceError {
    /// The value or the error does not begin with a number, or is not finite.
    #[error("`{0}` is not a number with a unit; write for example 41.2fF+-0.05fF")]
    NoNumber(String),
    /// A decimal comma.
    #[error("`{0}` has a decimal comma; write a point, such as 41.2fF")]
    Comma(String),
    /// A number without a unit.
    #[error("`{0}` has no unit; write it with the value and with the error, such as 41.2fF+-0.05fF")]
    NoUnit(String),
    /// An unknown unit.
    #[error("`{0}` is not a unit of capacitance; write F with a prefix: aF, fF, pF, nF, uF")]
    UnknownUnit(String),
    /// A unit of another quantity.
    #[error("`{text}` is {found} and not a capacitance; its unit is F with a prefix, such as fF")]
    OtherQuantity {
        /// The text of the argument.
        text: String,
        /// The quantity of the unit, with its article.
        found: &'static str,
    },
    /// A value that is not greater than zero.
    #[error("`{0}` is not greater than zero; capacitances between electrodes are counted as positive here")]
    NotPositive(String),
    /// A negative error.
    #[error("the error `{0}` is negative; write its size, such as 0.05fF")]
    NegativeError(String),
}

/// Signs between a value and its error, the longest first.
const SEPARATORS: [&str; 3] = ["+/-", "+-", "\u{b1}"];

impl FromStr for MeasuredCapacitance {
    type Err = MeasuredCapacitanceError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let parts = SEPARATORS.iter().find_map(|separator| text.split_once(separator));
        let (value_text, error_text) = match parts {
            Some((value, error)) => (value.trim(), Some(error.trim())),
            None => (text.trim(), None),
        };
        let value = capacitance(value_text)?;
        if value <= 0.0 {
            return Err(MeasuredCapacitanceError::NotPositive(value_text.to_owned()));
        }
        let Some(error_text) = error_text else { return Ok(Self { value, error: 0.0 }) };
        let error = capacitance(error_text)?;
        if error < 0.0 {
            return Err(MeasuredCapacitanceError::NegativeError(error_text.to_owned()));
        }
        Ok(Self { value, error })
    }
}

/// A capacitance with its unit, F.
fn capacitance(text: &str) -> Result<f64, MeasuredCapacitanceError> {
    let owned = || text.to_owned();
    let quantity = units::parse(text).map_err(|why| match why {
        NotAQuantity::NoNumber | NotAQuantity::NotFinite | NotAQuantity::TooLarge => {
            MeasuredCapacitanceError::NoNumber(owned())
        }
        NotAQuantity::Comma => MeasuredCapacitanceError::Comma(owned()),
        NotAQuantity::NoUnit { .. } => MeasuredCapacitanceError::NoUnit(owned()),
        NotAQuantity::UnknownUnit { unit, .. } => MeasuredCapacitanceError::UnknownUnit(unit.to_owned()),
    })?;
    if quantity.dimension != CAPACITANCE {
        return Err(MeasuredCapacitanceError::OtherQuantity {
            text: owned(),
            found: quantity.dimension.name(),
        });
    }
    Ok(quantity.si)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_and_its_error_may_be_written_with_spaces_or_without() {
        let same = MeasuredCapacitance { value: 41.2e-15, error: 0.05e-15 };
        for text in [
            "41.2fF+-0.05fF",
            "41.2 fF +- 0.05 fF",
            "41.2fF\u{b1}0.05fF",
            "41.2 fF +/- 50 aF",
            " 0.0412pF +- 0.05 fF ",
        ] {
            assert_eq!(text.parse(), Ok(same), "{text}");
        }
        assert_eq!("1e-3 pF".parse(), Ok(MeasuredCapacitance { value: 1e-15, error: 0.0 }));
    }

    #[test]
    fn what_is_no_measured_capacitance_says_why() {
        for (text, words) in [
            ("", "not a number with a unit"),
            ("fF", "not a number with a unit"),
            ("nan fF", "not a number with a unit"),
            ("41.2", "no unit"),
            ("41.2+-0.05fF", "no unit"),
            ("41.2fF+-0.05", "no unit"),
            ("41.2fF+-", "not a number with a unit"),
            ("41,2fF", "comma"),
            ("41.2 farad", "is not a unit"),
            ("41.2mN", "is a force"),
            ("41.2fF+-1pC", "is a charge"),
            ("-41.2fF", "greater than zero"),
            ("0fF", "greater than zero"),
            ("41.2fF+--1fF", "negative"),
            ("1fF+-1fF+-1fF", "is not a unit"),
        ] {
            let message = text.parse::<MeasuredCapacitance>().expect_err(text).to_string();
            assert!(message.contains(words), "{text}: {message}");
        }
    }
}
