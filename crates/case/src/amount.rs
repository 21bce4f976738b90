//! Numbers with or without a unit, in arguments and in values of a case file: `10kPa`, `"50 um"`, `2.8`.

use crate::diagnostics::shown;
use crate::units::{self, NotAQuantity};

/// The unit that a number is written in.
#[derive(Debug, Clone, PartialEq)]
pub struct Scale {
    /// The text of the unit; empty for a number without a unit.
    pub unit: String,
    /// The unit over the SI unit of its dimension; 1 for a number without a unit.
    pub factor: f64,
    /// The dimension of the unit; `None` for a number without a unit.
    dimension: Option<units::Dimension>,
}

impl Scale {
    /// Whether both are units of the same dimension.
    pub fn fits(&self, other: &Self) -> bool {
        self.dimension == other.dimension
    }

    /// The quantity of the unit, with the article: "a length"; "a number" without a unit.
    pub fn dimension_name(&self) -> &'static str {
        self.dimension.map_or("a number", units::Dimension::name)
    }

    /// A value in SI units as the value of a key in a case file, to ten digits, more than a fit or a search
    /// determines: `"43.2 um"`, `2.85`.
    pub fn to_toml(&self, si: f64) -> String {
        self.written(rounded(si / self.factor, 10))
    }

    /// A number with this unit as the value of a key in a case file: `"40 um"` in quotation marks, or a
    /// number alone. It has 12 digits, so that 0.1 + 0.2 is written 0.3.
    pub fn written(&self, number: f64) -> String {
        let number = rounded(number, 12);
        if self.unit.is_empty() { format!("{number:?}") } else { format!("\"{number} {}\"", self.unit) }
    }

    /// A value in SI units for the user, to `digits` digits: `43.2 um`.
    pub fn show(&self, si: f64, digits: usize) -> String {
        let value = si / self.factor;
        let before = if value == 0.0 { 1 } else { value.abs().log10().floor() as i32 + 1 };
        let places = usize::try_from(digits as i32 - before).unwrap_or(0);
        let number = if (-3..=7).contains(&before) {
            format!("{value:.places$}")
        } else {
            format!("{value:.*e}", digits.saturating_sub(1))
        };
        if self.unit.is_empty() { number } else { format!("{number} {}", self.unit) }
    }
}

/// The value rounded to so many significant digits.
fn rounded(value: f64, digits: usize) -> f64 {
    format!("{value:.*e}", digits - 1).parse().unwrap_or(value)
}

/// A number with its unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Amount {
    /// The number before the unit; finite.
    pub number: f64,
    /// The value in SI units (radians for angles), finite; the number itself without a unit.
    pub si: f64,
    /// The unit.
    pub scale: Scale,
}

impl Amount {
    /// A number without a unit.
    pub fn plain(value: f64) -> Self {
        let scale = Scale { unit: String::new(), factor: 1.0, dimension: None };
        Self { number: value, si: value, scale }
    }

    /// A value in a known SI unit, such as `F`, to be written with the prefix that suits values of a `size`.
    pub fn with_prefix(si: f64, size: f64, unit: &str) -> Self {
        let prefixes = ["a", "f", "p", "n", "u", "m", "", "k", "M", "G"];
        let power = if size > 0.0 { (size.log10() + 1e-9).div_euclid(3.0) as i32 } else { 0 };
        let prefix = usize::try_from(power + 6).ok().and_then(|k| prefixes.get(k)).copied().unwrap_or("");
        let unit_amount = format!("1 {prefix}{unit}").parse::<Self>();
        unit_amount.map_or_else(
            |_| Self::plain(si),
            |amount| Self { number: si / amount.scale.factor, si, scale: amount.scale },
        )
    }

    /// The number in a unit that [fits](Scale::fits).
    pub fn number_in(&self, scale: &Scale) -> f64 {
        if self.scale.unit == scale.unit { self.number } else { self.si / scale.factor }
    }
}

/// The reason why a text is not a number with or without a unit.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum AmountError {
    /// The text does not begin with a finite number.
    #[error("`{0}` is not a number with or without a unit; write for example 50um, 10kPa or 2.8")]
    NoNumber(String),
    /// A decimal comma.
    #[error("`{0}` has a decimal comma; write a point")]
    Comma(String),
    /// An unknown unit.
    #[error("`{0}` is not a unit that is known here; write for example um, kPa, mN or fF")]
    UnknownUnit(String),
}

impl std::str::FromStr for Amount {
    type Err = AmountError;

    /// Parses a number with or without a unit; quotation marks around it are removed.
    fn from_str(text: &str) -> Result<Self, AmountError> {
        let text = text.trim();
        let inside = ['"', '\''].into_iter().find_map(|quote| text.strip_prefix(quote)?.strip_suffix(quote));
        let text = inside.unwrap_or(text).trim();
        let no_number = || AmountError::NoNumber(shown(text));
        let quantity = match units::parse(text) {
            Ok(quantity) => quantity,
            Err(NotAQuantity::NoUnit { number }) => {
                let number = number.parse::<f64>().ok().filter(|number| number.is_finite());
                return number.map(Self::plain).ok_or_else(no_number);
            }
            Err(NotAQuantity::Comma) => return Err(AmountError::Comma(shown(text))),
            Err(NotAQuantity::UnknownUnit { unit, .. }) => return Err(AmountError::UnknownUnit(shown(unit))),
            Err(NotAQuantity::NoNumber | NotAQuantity::NotFinite | NotAQuantity::TooLarge) => {
                return Err(no_number());
            }
        };
        let number = quantity.number.parse::<f64>().ok().filter(|number| number.is_finite());
        let number = number.ok_or_else(no_number)?;
        let unit = quantity.unit_text.to_owned();
        let factor = units::parse(&format!("1 {unit}")).map_or(f64::NAN, |one| one.si);
        Ok(Self {
            number,
            si: quantity.si,
            scale: Scale { unit, factor, dimension: Some(quantity.dimension) },
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn amount(text: &str) -> Amount {
        text.parse().unwrap()
    }

    #[test]
    fn numbers_are_read_with_and_without_units_and_written_as_toml_again() {
        assert_eq!(amount("10kPa").si, 1e4);
        assert_eq!(amount("\"50 um\"").si, 50e-6);
        assert_eq!(amount("-2.8").si, -2.8);
        assert_eq!(amount("50 um").scale.to_toml(43.25e-6), "\"43.25 um\"");
        assert_eq!(amount("2").scale.to_toml(2.0), "2.0");
        assert_eq!(amount(" 2.8 ").scale.written(3.0), "3.0");
        assert_eq!(amount("50um").scale.written(0.1 + 0.2), "\"0.3 um\"");
        assert_eq!(amount("1 um").scale.show(43.251234e-6, 4), "43.25 um");
        assert!(amount("1 mm").scale.fits(&amount("3 um").scale));
        assert!(!amount("1 mm").scale.fits(&amount("3 kPa").scale));
        assert!(!amount("1 mm").scale.fits(&amount("3").scale));
    }

    #[test]
    fn a_number_keeps_its_unit_and_is_converted_to_others() {
        let gap = amount("50um");
        assert_eq!((gap.number, gap.si, gap.scale.dimension_name()), (50.0, 50e-6, "a length"));
        assert_eq!(gap.number_in(&gap.scale), 50.0);
        assert!((amount("\"0.1 mm\"").number_in(&gap.scale) - 100.0).abs() < 1e-12);
        assert_eq!(amount("90 deg").number_in(&amount("1 rad").scale), std::f64::consts::FRAC_PI_2);
        assert_eq!(amount("2.8").scale.dimension_name(), "a number");
    }

    #[test]
    fn what_is_no_number_says_why() {
        for (text, words) in [
            ("", "not a number"),
            ("kPa", "not a number"),
            ("inf", "not a number"),
            ("nan um", "not a number"),
            ("1e999", "not a number"),
            ("[1, 2]", "not a number"),
            ("1,5 um", "comma"),
            ("3 furlongs", "unit"),
        ] {
            let message = text.parse::<Amount>().unwrap_err().to_string();
            assert!(message.contains(words), "{text}: {message}");
        }
    }
}
