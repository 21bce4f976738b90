//! Distributions of tolerances: `normal(50um, 2um)`, `uniform(1, 2)` and others, drawn the same from the same
//! seed on every machine.

use elastocap_case::{Amount, AmountError, Scale};
use rand::{Rng, RngExt as _};

use crate::splitting::split_at_commas;

/// The distribution of a value. Numbers are in the unit of the first parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Distribution {
    shape: Shape,
    /// The unit of the first parameter, and so of the values.
    scale: Scale,
    /// The text as the user wrote it.
    text: String,
}

/// The kind of a distribution, with its parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Shape {
    /// A normal distribution. If it has `limits`, values beyond them are drawn again.
    Normal {
        mean: f64,
        deviation: f64,
        limits: Option<(f64, f64)>,
    },
    /// A lognormal distribution; `deviation` is that of the logarithm.
    LogNormal {
        median: f64,
        deviation: f64,
    },
    Uniform {
        low: f64,
        high: f64,
    },
    LogUniform {
        low: f64,
        high: f64,
    },
    Triangular {
        low: f64,
        mode: f64,
        high: f64,
    },
}

/// The reason why a distribution cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DistributionError {
    /// No distribution has this name.
    #[error("`{0}` is not a distribution; there are normal, lognormal, uniform, loguniform and triangular")]
    Unknown(String),
    /// The parentheses are not closed.
    #[error("`{0}`: a parenthesis is not closed; write for example normal(50um, 2um)")]
    Open(String),
    /// There are too few parameters, or too many.
    #[error("`{text}` has {found} parameters; write {form}")]
    Parameters {
        /// The text of the distribution.
        text: String,
        /// The number of parameters.
        found: usize,
        /// The right form.
        form: &'static str,
    },
    /// A parameter is not a number.
    #[error("`{text}`: {why}")]
    Number {
        /// The text of the distribution.
        text: String,
        /// The error.
        why: AmountError,
    },
    /// The parameters have units of different kinds.
    #[error("`{text}` has {first} and {other}; give all parameters the same kind of unit")]
    Kinds {
        /// The text of the distribution.
        text: String,
        /// The kind of the first parameter.
        first: &'static str,
        /// The kind of another one.
        other: &'static str,
    },
    /// The parameters are outside the range of this distribution.
    #[error("`{text}`: {why}")]
    Range {
        /// The text of the distribution.
        text: String,
        /// The error, with a remedy.
        why: &'static str,
    },
}

/// The name of each distribution, and how it is written.
const FORMS: [(&str, &str); 5] = [
    ("normal", "normal(mean, deviation) or normal(mean, deviation, lowest, highest)"),
    ("lognormal", "lognormal(median, deviation of the logarithm), such as lognormal(90kPa, 0.1)"),
    ("uniform", "uniform(lowest, highest)"),
    ("loguniform", "loguniform(lowest, highest)"),
    ("triangular", "triangular(lowest, most likely, highest)"),
];

/// The largest number of draws until one lies between the limits, which contain a share of at least some 3e-4
/// of all draws. Not tuned: a limit that ordinary cases do not reach.
const MAX_DRAWS: usize = 1_000_000;

impl Distribution {
    /// Reads a distribution; `None` if the text is not of the form `name(..)`.
    ///
    /// # Errors
    /// A text of this form whose name or parameters are not those of a distribution.
    pub fn parse(text: &str) -> Result<Option<Self>, DistributionError> {
        let text = text.trim();
        let Some((name, rest)) = text.split_once('(') else { return Ok(None) };
        let name = name.trim();
        if name.is_empty() || !name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') {
            return Ok(None);
        }
        let owned = || text.to_owned();
        let inside = rest.strip_suffix(')').ok_or_else(|| DistributionError::Open(owned()))?;
        let parts = split_at_commas(inside).ok_or_else(|| DistributionError::Open(owned()))?;
        let (_, form) = *FORMS
            .iter()
            .find(|(known, _)| *known == name)
            .ok_or_else(|| DistributionError::Unknown(name.to_owned()))?;
        let wrong = || DistributionError::Parameters { text: owned(), found: parts.len(), form };
        let amount = |part: &str| {
            part.parse::<Amount>().map_err(|why| DistributionError::Number { text: owned(), why })
        };
        let first = amount(parts.first().copied().unwrap_or(""))?;
        let in_unit = |part: &str| {
            let other = amount(part)?;
            if !other.scale.fits(&first.scale) {
                let (first, other) = (first.scale.dimension_name(), other.scale.dimension_name());
                return Err(DistributionError::Kinds { text: owned(), first, other });
            }
            Ok(other.number_in(&first.scale))
        };
        // A deviation may be a share of the mean.
        let deviation = |part: &str| match part.strip_suffix('%') {
            Some(percent) => percent
                .trim()
                .parse::<f64>()
                .map(|percent| first.number.abs() * percent / 100.0)
                .map_err(|_| DistributionError::Range { text: owned(), why: "write a percentage as 4%" }),
            None => in_unit(part),
        };
        let shape = match (name, parts.as_slice()) {
            ("normal", [_, spread]) => {
                Shape::Normal { mean: first.number, deviation: deviation(spread)?, limits: None }
            }
            ("normal", [_, spread, low, high]) => Shape::Normal {
                mean: first.number,
                deviation: deviation(spread)?,
                limits: Some((in_unit(low)?, in_unit(high)?)),
            },
            ("lognormal", [_, spread]) => {
                let factor = match spread.strip_suffix('%') {
                    Some(percent) => percent.trim().parse::<f64>().map(|percent| percent / 100.0),
                    None => spread.parse(),
                };
                let why = "the deviation of the logarithm is a bare number, such as 0.1, or a percentage";
                let deviation = factor.map_err(|_| DistributionError::Range { text: owned(), why })?;
                Shape::LogNormal { median: first.number, deviation }
            }
            ("uniform", [_, high]) => Shape::Uniform { low: first.number, high: in_unit(high)? },
            ("loguniform", [_, high]) => Shape::LogUniform { low: first.number, high: in_unit(high)? },
            ("triangular", [_, mode, high]) => {
                Shape::Triangular { low: first.number, mode: in_unit(mode)?, high: in_unit(high)? }
            }
            _ => return Err(wrong()),
        };
        shape.check().map_err(|why| DistributionError::Range { text: owned(), why })?;
        Ok(Some(Self { shape, scale: first.scale, text: text.to_owned() }))
    }

    /// The text as the user wrote it.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// A drawn value as a case file has it, such as `"49.3 um"`, with nine digits, which hide differences of
    /// logarithms between machines in the last digit.
    pub fn draw(&self, random: &mut impl Rng) -> String {
        let value = self.shape.draw(random);
        let rounded = format!("{value:.8e}").parse().unwrap_or(value);
        self.scale.written(rounded)
    }
}

impl Shape {
    /// Checks the parameters. The error is in words, with a remedy.
    fn check(self) -> Result<(), &'static str> {
        let proper = |deviation: f64| deviation.is_finite() && deviation > 0.0;
        match self {
            Self::Normal { deviation, .. } | Self::LogNormal { deviation, .. } if !proper(deviation) => {
                Err("the deviation must be greater than zero")
            }
            Self::Normal { mean, deviation, limits: Some((low, high)) } => {
                let (low, high) = ((low - mean) / deviation, (high - mean) / deviation);
                if high - low < 0.1 {
                    Err("the highest value must lie at least a tenth of the deviation above the lowest")
                } else if low > 3.0 || high < -3.0 {
                    Err("the limits must reach to within three deviations of the mean")
                } else {
                    Ok(())
                }
            }
            Self::Normal { .. } => Ok(()),
            Self::LogNormal { median, .. } if median <= 0.0 => Err("the median must be greater than zero"),
            Self::LogUniform { low, .. } if low <= 0.0 => Err("the lowest value must be greater than zero"),
            Self::Uniform { low, high } | Self::LogUniform { low, high } if low >= high => {
                Err("the lowest value comes first, and the highest must be greater")
            }
            Self::Triangular { low, mode, high } if !(low <= mode && mode <= high && low < high) => {
                Err("write the lowest, the most likely and the highest value in this order")
            }
            Self::LogNormal { .. }
            | Self::Uniform { .. }
            | Self::LogUniform { .. }
            | Self::Triangular { .. } => Ok(()),
        }
    }

    fn draw(self, random: &mut impl Rng) -> f64 {
        match self {
            Self::Normal { mean, deviation, limits } => {
                let (low, high) = limits.unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
                for _ in 0..MAX_DRAWS {
                    let normal = standard_normal(random);
                    let value = mean + deviation * normal;
                    if (low..=high).contains(&value) {
                        return value;
                    }
                }
                mean.clamp(low, high)
            }
            Self::LogNormal { median, deviation } => {
                let normal = standard_normal(random);
                median * (deviation * normal).exp()
            }
            Self::Uniform { low, high } => low + (high - low) * random.random::<f64>(),
            Self::LogUniform { low, high } => low * (high / low).powf(random.random::<f64>()),
            Self::Triangular { low, mode, high } => {
                // The inverse of the distribution function, which is quadratic on both sides of the mode.
                let share = random.random::<f64>();
                let rising = (mode - low) / (high - low);
                if share < rising {
                    low + (share * (high - low) * (mode - low)).sqrt()
                } else {
                    high - ((1.0 - share) * (high - low) * (high - mode)).sqrt()
                }
            }
        }
    }
}

/// A draw with mean 0 and deviation 1, by Marsaglia's polar method: exact up to a logarithm and a root.
fn standard_normal(random: &mut impl Rng) -> f64 {
    loop {
        let [x, y] = [0; 2].map(|_| 2.0 * random.random::<f64>() - 1.0);
        let square = x * x + y * y;
        if square > 0.0 && square < 1.0 {
            return x * (-2.0 * square.ln() / square).sqrt();
        }
    }
}

#[cfg(test)]
mod tests {
    use chacha20::ChaCha12Rng;
    use rand::SeedableRng as _;

    use super::*;

    fn drawn(text: &str, count: usize) -> Vec<f64> {
        let distribution = Distribution::parse(text).unwrap().unwrap();
        let mut random = ChaCha12Rng::seed_from_u64(7);
        let value = |_| distribution.draw(&mut random).parse::<Amount>().unwrap().si;
        (0..count).map(value).collect()
    }

    fn mean_and_deviation(values: &[f64]) -> (f64, f64) {
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        (mean, (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt())
    }

    #[track_caller]
    fn scatters(text: &str, mean: f64, deviation: f64) -> Vec<f64> {
        let values = drawn(text, 40_000);
        let (found_mean, found_deviation) = mean_and_deviation(&values);
        assert!((found_mean - mean).abs() < 0.02 * deviation, "{text}: mean {found_mean}");
        assert!((found_deviation / deviation - 1.0).abs() < 0.02, "{text}: deviation {found_deviation}");
        values
    }

    #[test]
    fn each_distribution_has_its_mean_and_deviation() {
        scatters("normal(50um, 2um)", 50e-6, 2e-6);
        scatters("normal(50um, 4%)", 50e-6, 2e-6);
        scatters("uniform(1, 4)", 2.5, 3.0 / 12.0_f64.sqrt());
        // (a + b + c) / 3 and sqrt((a^2 + b^2 + c^2 - ab - ac - bc) / 18).
        scatters("triangular(1, 2, 6)", 3.0, (21.0_f64 / 18.0).sqrt());
        let s: f64 = 0.1;
        let mean = 90e3 * (s * s / 2.0).exp();
        scatters("lognormal(90kPa, 0.1)", mean, mean * ((s * s).exp() - 1.0).sqrt());
        scatters("lognormal(90kPa, 10%)", mean, mean * ((s * s).exp() - 1.0).sqrt());
        let logarithm = 100.0_f64.ln();
        let mean = 99.0 / logarithm;
        scatters("loguniform(1, 100)", mean, ((1e4 - 1.0) / (2.0 * logarithm) - mean * mean).sqrt());
    }

    #[test]
    fn limits_cut_a_normal_distribution() {
        // Symmetric limits at one deviation: 1 - 2 phi(1) / (2 Phi(1) - 1) of the variance is left.
        let deviation = 2e-6 * (1.0_f64 - 2.0 * 0.241_970_72 / 0.682_689_49).sqrt();
        let values = scatters("normal(50um, 2um, 48um, 0.052mm)", 50e-6, deviation);
        assert!(values.iter().all(|v| (48e-6..=52e-6).contains(v)));
    }

    #[test]
    fn a_value_has_nine_digits_and_the_unit_of_the_first_parameter() {
        let distribution = Distribution::parse("normal(0.05 mm, 2um)").unwrap().unwrap();
        let text = distribution.draw(&mut ChaCha12Rng::seed_from_u64(1));
        let inside = text.strip_prefix('"').unwrap().strip_suffix(" mm\"").unwrap();
        let digits = inside.trim_start_matches(['0', '.']).replace('.', "");
        assert!(digits.len() <= 9, "{text}");
    }

    #[test]
    fn what_is_no_distribution_is_told_from_a_wrong_one() {
        for text in ["50um", "[1, 2]", "a b(c)"] {
            assert_eq!(Distribution::parse(text), Ok(None), "{text}");
        }
        for (text, words) in [
            ("gauss(1, 2)", "there are normal"),
            ("normal(1, 2", "not closed"),
            ("normal(1)", "normal(mean, deviation)"),
            ("uniform(1, 2, 3)", "uniform(lowest, highest)"),
            ("normal(1um, 2kPa)", "a length and a pressure"),
            ("normal(a, 2)", "not a number"),
            ("normal(1, 0)", "greater than zero"),
            ("normal(1, x%)", "percentage"),
            ("normal(1, 0.1, 2, 3)", "within three deviations"),
            ("normal(1, 0.1, 1, 1)", "a tenth of the deviation"),
            ("uniform(2, 1)", "the lowest value comes first"),
            ("triangular(1, 5, 3)", "in this order"),
            ("loguniform(0, 1)", "greater than zero"),
            ("lognormal(-1, 0.1)", "median must be"),
            ("lognormal(1, 0.1um)", "bare number"),
        ] {
            let message = Distribution::parse(text).unwrap_err().to_string();
            assert!(message.contains(words), "{text}: {message}");
        }
    }
}
