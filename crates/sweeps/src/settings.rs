//! Settings of a sweep, a key with its values, as an argument has them: `key=10um..100um:10`,
//! `key=400um,450um`, `key=normal(50um, 2um)`.

use std::str::FromStr;

use elastocap_case::{Amount, AmountError};

use crate::distribution::{Distribution, DistributionError};
use crate::splitting::{outside_quotes, split_at_commas};

/// The largest number of cases of a sweep, and so of values of a range.
pub const MAX_CASES: usize = 1_000_000;

/// A key of the case file with its values.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    /// The path of the key, as [`elastocap_case::with_value`] takes it.
    pub key: String,
    /// Its values.
    pub values: Values,
}

/// The values of a key.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// These values in this order, as a case file has them; at least one.
    Listed(Vec<String>),
    /// Values drawn at random.
    Drawn(Distribution),
}

/// The reason why a setting cannot be read.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SettingError {
    /// The `=` between key and values is missing.
    #[error("`{0}` has no `=`; write a key and its values, such as layer.thickness=400um,450um")]
    NoEquals(String),
    /// There is no key before the `=`.
    #[error("`{0}` has no key before `=`; write for example layer.thickness=400um,450um")]
    NoKey(String),
    /// There is no value after the `=`, or between two commas.
    #[error("`{0}`: a value is missing; write for example 400um,450um or 10um..100um:10")]
    NoValue(String),
    /// A range has no number of values.
    #[error("the range `{0}` does not say how many values; write for example 10um..100um:10")]
    NoCount(String),
    /// The number of values is not a whole number, too small or too large.
    #[error("the range `{range}` has `{count}` values; write a number from 2 to {max}")]
    BadCount {
        /// The range.
        range: String,
        /// The text after the colon.
        count: String,
        /// The largest number.
        max: usize,
    },
    /// The spacing of a range is not known.
    #[error("the range `{range}` ends with `:{word}`; only `:log` is known, for equal ratios")]
    BadSpacing {
        /// The range.
        range: String,
        /// The word instead of `log`.
        word: String,
    },
    /// An end of a range is not a number, or its unit is not known.
    #[error("the range `{range}`: {why}")]
    BadEnd {
        /// The range.
        range: String,
        /// The fault of that end.
        why: AmountError,
    },
    /// The ends of a range have units of different kinds.
    #[error("the range `{range}` goes from {from} to {to}; give both ends the same kind of unit")]
    EndsDiffer {
        /// The range.
        range: String,
        /// The kind of the first end.
        from: &'static str,
        /// The kind of the last end.
        to: &'static str,
    },
    /// A range with equal ratios has an end that is not above zero.
    #[error("the range `{0}` goes through zero or below, where `:log` has no values; leave out `:log`")]
    NoLogarithm(String),
    /// A bracket or a quotation mark is not closed.
    #[error("`{0}`: a bracket or a quotation mark is not closed")]
    Open(String),
    /// A distribution cannot be used.
    #[error(transparent)]
    Distribution(#[from] DistributionError),
}

impl FromStr for Setting {
    type Err = SettingError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let equals = outside_quotes(text, '=').ok_or_else(|| SettingError::NoEquals(text.to_owned()))?;
        let (key, values) = (text[..equals].trim(), text[equals + 1..].trim());
        if key.is_empty() {
            return Err(SettingError::NoKey(text.to_owned()));
        }
        if values.is_empty() {
            return Err(SettingError::NoValue(text.to_owned()));
        }
        let values = match Distribution::parse(values)? {
            Some(distribution) => Values::Drawn(distribution),
            None => Values::Listed(listed(values)?),
        };
        Ok(Self { key: key.to_owned(), values })
    }
}

/// The values between commas, with ranges expanded.
fn listed(text: &str) -> Result<Vec<String>, SettingError> {
    let parts = split_at_commas(text).ok_or_else(|| SettingError::Open(text.to_owned()))?;
    let mut values = Vec::new();
    for part in parts {
        if part.is_empty() {
            return Err(SettingError::NoValue(text.to_owned()));
        }
        match part.split_once("..") {
            // A file such as `../body.obj` is not a range.
            Some((from, rest)) if from.starts_with(|c: char| c.is_ascii_digit() || "+-.\"'".contains(c)) => {
                values.extend(range(part, from, rest)?);
            }
            _ => values.push(part.to_owned()),
        }
    }
    Ok(values)
}

/// The values of `from..to:count` or `from..to:count:log`, all in the unit of `from`. The first and the last
/// one are the ends of the range without rounding.
fn range(text: &str, from: &str, rest: &str) -> Result<Vec<String>, SettingError> {
    let owned = || text.to_owned();
    let mut rest = rest.split(':');
    let to = rest.next().unwrap_or("");
    let count_text = rest.next().map(str::trim).ok_or_else(|| SettingError::NoCount(owned()))?;
    let count = count_text.parse().ok().filter(|count| (2..=MAX_CASES).contains(count));
    let count: usize = count.ok_or_else(|| SettingError::BadCount {
        range: owned(),
        count: count_text.to_owned(),
        max: MAX_CASES,
    })?;
    let spacing = rest.next().map(str::trim);
    let logarithmic = match (spacing, rest.next()) {
        (None, _) => false,
        (Some("log"), None) => true,
        (Some(word), _) => return Err(SettingError::BadSpacing { range: owned(), word: word.to_owned() }),
    };
    let end = |text: &str| text.parse::<Amount>().map_err(|why| SettingError::BadEnd { range: owned(), why });
    let (from, to) = (end(from)?, end(to)?);
    let scale = &from.scale;
    if !to.scale.fits(scale) {
        let (from, to) = (scale.dimension_name(), to.scale.dimension_name());
        return Err(SettingError::EndsDiffer { range: owned(), from, to });
    }
    let (first, last) = (from.number, to.number_in(scale));
    if logarithmic && (first <= 0.0 || last <= 0.0) {
        return Err(SettingError::NoLogarithm(owned()));
    }
    let value = |k: usize| {
        let share = k as f64 / (count - 1) as f64;
        match k {
            0 => first,
            k if k == count - 1 => last,
            _ if logarithmic => first * (last / first).powf(share),
            _ => first + (last - first) * share,
        }
    };
    Ok((0..count).map(|k| scale.written(value(k))).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(text: &str) -> Vec<String> {
        match format!("key={text}").parse::<Setting>().unwrap().values {
            Values::Listed(values) => values,
            Values::Drawn(drawn) => panic!("{drawn:?}"),
        }
    }

    #[track_caller]
    fn refused(text: &str, words: &str) {
        let message = text.parse::<Setting>().unwrap_err().to_string();
        assert!(message.contains(words), "{message}\nlacks: {words}");
    }

    #[test]
    fn a_range_has_both_ends_and_equal_distances_or_ratios() {
        assert_eq!(values("10um..30um:3"), ["\"10 um\"", "\"20 um\"", "\"30 um\""]);
        assert_eq!(values("10um..0.03mm:3"), ["\"10 um\"", "\"20 um\"", "\"30 um\""]);
        assert_eq!(values("0.1..0.4:4"), ["0.1", "0.2", "0.3", "0.4"]);
        assert_eq!(values("1..100:3:log"), ["1.0", "10.0", "100.0"]);
        assert_eq!(values("30um..10um:2"), ["\"30 um\"", "\"10 um\""]);
        assert_eq!(values("\"10 um\"..\"30 um\":2"), ["\"10 um\"", "\"30 um\""]);
    }

    #[test]
    fn a_list_keeps_arrays_tables_and_texts_whole() {
        assert_eq!(values("400um, 450um"), ["400um", "450um"]);
        assert_eq!(values("[0.0, 0.1],[0.2]"), ["[0.0, 0.1]", "[0.2]"]);
        assert_eq!(values("{ gent = { a = 1, b = 2 } }"), ["{ gent = { a = 1, b = 2 } }"]);
        assert_eq!(values("'a,b','c'"), ["'a,b'", "'c'"]);
        assert_eq!(values("../a.obj,b..c.obj"), ["../a.obj", "b..c.obj"]);
        assert_eq!(values("1um..2um:2,5um"), ["\"1 um\"", "\"2 um\"", "5um"]);
    }

    #[test]
    fn a_key_in_quotes_may_hold_an_equals_sign() {
        assert_eq!("'a=b'.c=5".parse::<Setting>().unwrap().key, "'a=b'.c");
    }

    #[test]
    fn what_cannot_be_read_is_refused_with_the_right_form() {
        refused("layer.thickness", "has no `=`");
        refused("=5", "no key");
        refused("a=", "a value is missing");
        refused("a=1,,2", "a value is missing");
        refused("a=1um..2um", "does not say how many");
        refused("a=1um..2um:1", "a number from 2");
        refused("a=1um..2um:x", "a number from 2");
        refused("a=1um..2um:5:cubic", "only `:log`");
        refused("a=1um..2kPa:5", "from a length to a pressure");
        refused("a=1..2um:5", "from a number to a length");
        refused("a=0..2:5:log", "leave out `:log`");
        refused("a=1um..2parsec:5", "`parsec` is not a unit");
        refused("a=[1,2", "not closed");
    }
}
