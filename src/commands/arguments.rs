//! Argument values that several commands use.

use std::time::Duration;

/// The reason why the value of an argument is invalid.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(crate) enum ArgumentError {
    /// The text is not a valid number of seconds.
    #[error("a number of seconds above 0, at most 1e6")]
    Seconds,
    /// The text is not a valid time.
    #[error("a time with its unit, such as 90s, 10min or 2h; above 0 and at most 10000h")]
    Time,
    /// The text does not name a figure or table.
    #[error("the figures and tables are {0}")]
    Item(String),
}

/// A duration: a number with the unit s, min or h.
pub(crate) fn time(text: &str) -> Result<Duration, ArgumentError> {
    const MAX_SECONDS: f64 = 3.6e7;
    let text = text.trim();
    let digits = text.find(|c: char| c.is_ascii_alphabetic() && c != 'e').unwrap_or(text.len());
    let (number, unit) = text.split_at(digits);
    let unit = match unit {
        "s" => 1.0,
        "min" => 60.0,
        "h" => 3600.0,
        _ => return Err(ArgumentError::Time),
    };
    let seconds = number.trim().parse::<f64>().ok().map(|number| number * unit);
    let seconds = seconds.filter(|seconds| *seconds > 0.0 && *seconds <= MAX_SECONDS);
    seconds.map(Duration::from_secs_f64).ok_or(ArgumentError::Time)
}

/// A duration as a number of seconds.
pub(crate) fn positive_seconds(text: &str) -> Result<f64, ArgumentError> {
    let value = text.parse::<f64>().ok().filter(|v| *v > 0.0 && *v <= 1e6);
    value.ok_or(ArgumentError::Seconds)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_has_a_unit() {
        for (text, seconds) in [("90s", 90.0), ("10min", 600.0), ("1.5 h", 5400.0), ("2e1 s", 20.0)] {
            assert_eq!(time(text), Ok(Duration::from_secs_f64(seconds)), "{text}");
        }
        for text in ["", "10", "min", "0s", "-1s", "nan s", "inf h", "1e99h", "10 m", "10 minutes", "1 s s"] {
            assert_eq!(time(text), Err(ArgumentError::Time), "{text}");
        }
    }
}
