//! Values of arguments that several commands take.

/// Why the value of an argument cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(crate) enum ArgumentError {
    /// No number of seconds to work for.
    #[error("a number of seconds above 0, at most 1e6")]
    Seconds,
    /// No figure or table.
    #[error("the figures and tables are {0}")]
    Item(String),
}

/// A number of seconds to work for.
pub(crate) fn positive_seconds(text: &str) -> Result<f64, ArgumentError> {
    let value = text.parse::<f64>().ok().filter(|v| *v > 0.0 && *v <= 1e6);
    value.ok_or(ArgumentError::Seconds)
}
