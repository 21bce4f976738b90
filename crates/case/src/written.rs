//! Numbers with or without a unit, as they are written in arguments: limits of a range, parameters of a distribution.

use super::diagnostics::shown;
use super::units::{self, Dimension, NotAQuantity};

/// A number as it was written, with its unit if it has one.
#[derive(Debug, Clone, PartialEq)]
pub struct WrittenNumber {
    /// The number before the unit; finite.
    pub number: f64,
    /// The unit as it was written; empty for a bare number.
    pub unit: String,
    /// In SI units (radians for angles); the number itself without a unit.
    pub si: f64,
    dimension: Option<Dimension>,
    /// SI units in one of the unit.
    scale: f64,
}

/// Why a text is not a number with or without a unit.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum WrittenNumberError {
    /// It does not begin with a number, or that is not finite.
    #[error("`{0}` is not a number; write for example 50um, \"90 kPa\" or 2.8")]
    NoNumber(String),
    /// A decimal comma.
    #[error("`{0}` has a decimal comma; write a point")]
    Comma(String),
    /// A unit that the program does not know.
    #[error("`{0}` has a unit that is not known; units are those of case files, such as um, mm, kPa, N, deg")]
    UnknownUnit(String),
}

impl WrittenNumber {
    /// Reads a number with or without a unit; quotation marks around it are taken off.
    ///
    /// # Errors
    /// Neither: the error says what is wrong.
    pub fn parse(text: &str) -> Result<Self, WrittenNumberError> {
        let text = text.trim();
        let inside = ['"', '\''].into_iter().find_map(|quote| text.strip_prefix(quote)?.strip_suffix(quote));
        let text = inside.unwrap_or(text).trim();
        let own = || shown(text);
        match units::parse(text) {
            Ok(quantity) => {
                let number = quantity.number.parse().map_err(|_| WrittenNumberError::NoNumber(own()))?;
                let one = units::parse(&format!("1{}", quantity.unit_text)).map_or(f64::NAN, |unit| unit.si);
                Ok(Self {
                    number,
                    unit: quantity.unit_text.to_owned(),
                    si: quantity.si,
                    dimension: Some(quantity.dimension),
                    scale: one,
                })
            }
            Err(NotAQuantity::NoUnit { number }) => match number.parse::<f64>() {
                Ok(number) if number.is_finite() => {
                    Ok(Self { number, unit: String::new(), si: number, dimension: None, scale: 1.0 })
                }
                _ => Err(WrittenNumberError::NoNumber(own())),
            },
            Err(NotAQuantity::Comma) => Err(WrittenNumberError::Comma(own())),
            Err(NotAQuantity::UnknownUnit { .. }) => Err(WrittenNumberError::UnknownUnit(own())),
            Err(NotAQuantity::NoNumber | NotAQuantity::NotFinite | NotAQuantity::TooLarge) => {
                Err(WrittenNumberError::NoNumber(own()))
            }
        }
    }

    /// Whether both are lengths, both pressures, both bare numbers and so on.
    pub fn is_like(&self, other: &Self) -> bool {
        self.dimension == other.dimension
    }

    /// What it is, with its article: "a length", "a bare number".
    pub fn kind(&self) -> &'static str {
        self.dimension.map_or("a bare number", Dimension::name)
    }

    /// The value in the unit of another one that [is like](Self::is_like) it.
    pub fn in_unit_of(&self, other: &Self) -> f64 {
        if self.unit == other.unit { self.number } else { self.si / other.scale }
    }

    /// Another number with this unit, as it is written in a case file: `"40 um"` in quotation marks, or a bare number. 12 digits of it
    /// are kept, so that 0.1 + 0.2 is written 0.3.
    pub fn written_with(&self, number: f64) -> String {
        let rounded = format!("{number:.11e}").parse().unwrap_or(number);
        match self.unit.as_str() {
            "" => format!("{rounded:?}"),
            unit => format!("\"{rounded} {unit}\""),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_read_with_its_unit_and_written_again() {
        let gap = WrittenNumber::parse("50um").unwrap();
        assert_eq!((gap.number, gap.unit.as_str(), gap.si, gap.kind()), (50.0, "um", 50e-6, "a length"));
        assert_eq!(gap.written_with(0.1 + 0.2), "\"0.3 um\"");
        let other = WrittenNumber::parse("\"0.1 mm\"").unwrap();
        assert!(gap.is_like(&other));
        assert!((other.in_unit_of(&gap) - 100.0).abs() < 1e-12);
        let bare = WrittenNumber::parse(" 2.8 ").unwrap();
        assert_eq!((bare.si, bare.kind(), bare.written_with(3.0).as_str()), (2.8, "a bare number", "3.0"));
        assert!(!bare.is_like(&gap));
        let angle = WrittenNumber::parse("90 deg").unwrap();
        assert_eq!(angle.in_unit_of(&WrittenNumber::parse("1 rad").unwrap()), std::f64::consts::FRAC_PI_2);
    }

    #[test]
    fn what_is_no_number_is_refused() {
        for text in ["", "rigid", "um", "nan", "inf um", "1,5 um", "5 parsec", "1e999", "[1, 2]"] {
            assert!(WrittenNumber::parse(text).is_err(), "{text}");
        }
    }
}
