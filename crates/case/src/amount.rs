//! Numbers with or without a unit as they stand in arguments and in values of a case file: `10kPa`, `"50 um"`, `2.8`.

use crate::units::{self, NotAQuantity};

/// How a number is written: its unit, and what that is of the SI unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Scale {
    /// As it was written; empty for a number without a unit.
    pub unit: String,
    /// The unit over the SI unit of its dimension; 1 for a number without a unit.
    pub factor: f64,
    dimension: Option<units::Dimension>,
}

impl Scale {
    /// Whether both are units of the same dimension.
    pub fn fits(&self, other: &Self) -> bool {
        self.dimension == other.dimension
    }

    /// What it is the unit of, with the article: "a length"; "a number" without a unit.
    pub fn dimension_name(&self) -> &'static str {
        self.dimension.map_or("a number", units::Dimension::name)
    }

    /// A value in SI units as the value of a key in a case file, to ten digits: `"43.2 um"`, `2.85`.
    pub fn to_toml(&self, si: f64) -> String {
        let number = rounded(si / self.factor);
        if self.unit.is_empty() { format!("{number:?}") } else { format!("\"{number} {}\"", self.unit) }
    }

    /// The same for people, to `digits` digits: `43.2 um`.
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

/// To ten digits: what a fit or a search finds has fewer.
fn rounded(value: f64) -> f64 {
    format!("{value:.9e}").parse().unwrap_or(value)
}

/// A number and how it was written.
#[derive(Debug, Clone, PartialEq)]
pub struct Amount {
    /// In SI units; finite.
    pub si: f64,
    /// Its unit.
    pub scale: Scale,
}

impl Amount {
    /// A number without a unit.
    pub fn plain(value: f64) -> Self {
        Self { si: value, scale: Scale { unit: String::new(), factor: 1.0, dimension: None } }
    }

    /// A value in an SI unit that this program knows, such as `F`, to be written with the prefix that suits values of a `size`.
    pub fn with_prefix(si: f64, size: f64, unit: &str) -> Self {
        let prefixes = ["a", "f", "p", "n", "u", "m", "", "k", "M", "G"];
        let power = if size > 0.0 { (size.log10() + 1e-9).div_euclid(3.0) as i32 } else { 0 };
        let prefix = usize::try_from(power + 6).ok().and_then(|k| prefixes.get(k)).copied().unwrap_or("");
        let one = format!("1 {prefix}{unit}").parse::<Self>();
        one.map_or_else(|_| Self::plain(si), |one| Self { si, scale: one.scale })
    }
}

/// Why a text is not a number with or without a unit.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum AmountError {
    /// It does not begin with a number that is finite.
    #[error("`{0}` is not a number with or without a unit; write for example 50um, 10kPa or 2.8")]
    NoNumber(String),
    /// A decimal comma.
    #[error("`{0}` has a decimal comma; write a point")]
    Comma(String),
    /// A unit that is not known.
    #[error("`{0}` is not a unit that is known here; write for example um, kPa, mN or fF")]
    UnknownUnit(String),
}

impl std::str::FromStr for Amount {
    type Err = AmountError;

    /// A number with a unit, or without one; quotation marks around it do not matter.
    fn from_str(text: &str) -> Result<Self, AmountError> {
        let text = text.trim().trim_matches(['"', '\'']).trim();
        if let Ok(si) = text.parse::<f64>() {
            if !si.is_finite() {
                return Err(AmountError::NoNumber(text.to_owned()));
            }
            return Ok(Self { si, scale: Scale { unit: String::new(), factor: 1.0, dimension: None } });
        }
        let quantity = units::parse(text).map_err(|why| match why {
            NotAQuantity::NoNumber
            | NotAQuantity::NotFinite
            | NotAQuantity::TooLarge
            | NotAQuantity::NoUnit { .. } => AmountError::NoNumber(text.to_owned()),
            NotAQuantity::Comma => AmountError::Comma(text.to_owned()),
            NotAQuantity::UnknownUnit { unit, .. } => AmountError::UnknownUnit(unit.to_owned()),
        })?;
        let unit = quantity.unit_text.to_owned();
        let factor = units::parse(&format!("1 {unit}")).map_or(1.0, |one| one.si);
        Ok(Self { si: quantity.si, scale: Scale { unit, factor, dimension: Some(quantity.dimension) } })
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
        assert_eq!(amount("1 um").scale.show(43.251234e-6, 4), "43.25 um");
        assert!(amount("1 mm").scale.fits(&amount("3 um").scale));
        assert!(!amount("1 mm").scale.fits(&amount("3 kPa").scale));
    }

    #[test]
    fn what_is_no_number_says_why() {
        for (text, words) in [
            ("", "not a number"),
            ("kPa", "not a number"),
            ("inf", "not a number"),
            ("1,5 um", "comma"),
            ("3 furlongs", "unit"),
        ] {
            let said = text.parse::<Amount>().unwrap_err().to_string();
            assert!(said.contains(words), "{text}: {said}");
        }
    }
}
