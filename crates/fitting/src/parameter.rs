//! Free parameters of a fit or a search: keys of the case, or corrections of the measurement.

use std::str::FromStr;

use elastocap_case::{Amount, AmountError, MeasuredLoad, MeasuredPoints, OverrideError, Scale, value_at};

/// The default range of a key: from its present value over this to its present value times this.
const USUAL_RATIO: f64 = 100.0;

/// A free parameter as the user writes it: `NAME`, `NAME=a..b`, `NAME=a..b@start` or `NAME=@start`.
#[derive(Debug, Clone, PartialEq)]
pub struct Free {
    /// The path of a key, or `offset`, `parasitic` or `gain`.
    pub name: String,
    /// The least and the greatest value.
    pub range: Option<[Amount; 2]>,
    /// The value to begin with.
    pub start: Option<Amount>,
}

/// The reason why a parameter cannot be free.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ParameterError {
    /// The name is missing.
    #[error("`{0}` names nothing; write for example layer.relative_permittivity=2..4")]
    NoName(String),
    /// The text after `=` is not a range.
    #[error("`{0}` is not a range; write for example {1}=a..b, with a start if need be: {1}=a..b@c")]
    NoRange(String, String),
    /// An end of the range or the start is not a number.
    #[error("{name}: {source}")]
    Amount {
        /// The name of the parameter.
        name: String,
        /// The error in the number.
        source: AmountError,
    },
    /// An end of the range or the start has another dimension than the parameter.
    #[error("{name} is {expected}, and {found} is given for it")]
    Dimension {
        /// The name of the parameter.
        name: String,
        /// The dimension of the parameter, with its article.
        expected: &'static str,
        /// The dimension of the given value, with its article.
        found: &'static str,
    },
    /// The range is empty, or the start is outside of it.
    #[error("{0}: the range must go from a smaller to a larger value, and the start must lie in it")]
    Order(String),
    /// The case does not have the key, and there is no range.
    #[error("the case has no number at `{0}`; give a range, such as {0}=1..2, or check the path")]
    Absent(String),
    /// No range follows from the value in the case.
    #[error("{0} is not above zero in the case, so that no range follows from it; give one: {0}=a..b")]
    NeedsRange(String),
    /// The path does not fit the case.
    #[error(transparent)]
    Path(#[from] OverrideError),
    /// A parameter is given twice.
    #[error("{0} is given twice")]
    Twice(String),
    /// A correction of measured points where only keys of the case can vary.
    #[error("{0} is of a measurement; here only keys of the case can vary")]
    NotHere(String),
}

impl FromStr for Free {
    type Err = ParameterError;

    fn from_str(text: &str) -> Result<Self, ParameterError> {
        let (name, rest) = match text.split_once('=') {
            Some((name, rest)) => (name.trim(), Some(rest.trim())),
            None => (text.trim(), None),
        };
        if name.is_empty() {
            return Err(ParameterError::NoName(text.to_owned()));
        }
        let name = name.to_owned();
        let Some(rest) = rest else { return Ok(Self { name, range: None, start: None }) };
        let amount = |text: &str| {
            text.parse::<Amount>().map_err(|source| ParameterError::Amount { name: name.clone(), source })
        };
        let (range, start) = match rest.split_once('@') {
            Some((range, start)) => (range.trim(), Some(amount(start)?)),
            None => (rest, None),
        };
        let range = match range.split_once("..") {
            Some((low, high)) => Some([amount(low)?, amount(high)?]),
            None if range.is_empty() && start.is_some() => None,
            None => return Err(ParameterError::NoRange(rest.to_owned(), name)),
        };
        Ok(Self { name, range, start })
    }
}

/// The kind of a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// A key of the case: each of its values gives another curve.
    Key,
    /// The offset that is subtracted from the measured loads.
    Offset,
    /// The parasitic capacitance that is subtracted from the measured capacitances, F.
    Parasitic,
    /// The gain that the measured capacitances are divided by.
    Gain,
}

/// A parameter with its range, in SI units.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// The name as the user wrote it.
    pub name: String,
    /// The path of its key in the case file.
    pub path: String,
    /// The kind of the parameter.
    pub quantity: Quantity,
    /// The scale in which its values are written.
    pub scale: Scale,
    /// The least and the greatest value; infinite without a limit.
    pub range: [f64; 2],
    /// The value at which a search begins, in the range.
    pub start: f64,
}

impl Parameter {
    /// A value as it is written in a case file.
    pub fn to_toml(&self, value: f64) -> String {
        self.scale.to_toml(value)
    }

    /// A value as it is shown to the user.
    pub fn show(&self, value: f64, digits: usize) -> String {
        self.scale.show(value, digits)
    }
}

/// The parameters of a case with this text. `measured` are its points, if corrections may be free.
///
/// # Errors
/// [`ParameterError`] if a parameter is not in the case, or its range has another dimension or is empty.
pub fn parameters(
    free: &[Free],
    source: &str,
    measured: Option<&MeasuredPoints>,
) -> Result<Vec<Parameter>, ParameterError> {
    let parameters =
        free.iter().map(|free| parameter(free, source, measured)).collect::<Result<Vec<_>, _>>()?;
    for (k, parameter) in parameters.iter().enumerate() {
        if parameters.iter().take(k).any(|other| other.path == parameter.path) {
            return Err(ParameterError::Twice(parameter.name.clone()));
        }
    }
    Ok(parameters)
}

/// One parameter of a case with this text.
fn parameter(
    free: &Free,
    source: &str,
    measured: Option<&MeasuredPoints>,
) -> Result<Parameter, ParameterError> {
    let name = free.name.as_str();
    let special = match name {
        "offset" | "measurement.offset" => Some((Quantity::Offset, "measurement.offset")),
        "parasitic" | "measurement.parasitic" => Some((Quantity::Parasitic, "measurement.parasitic")),
        "gain" | "measurement.gain" => Some((Quantity::Gain, "measurement.gain")),
        _ => None,
    };
    let (quantity, path) = special.unwrap_or((Quantity::Key, name));
    let present = value_at(source, path)?.map(|text| text.parse::<Amount>());
    let written = || free.range.iter().flatten().chain(&free.start).next().cloned();
    let usual = match (quantity, measured) {
        (Quantity::Key, _) => None,
        (_, None) => return Err(ParameterError::NotHere(name.to_owned())),
        (quantity, Some(measured)) => Some(usual(quantity, measured)),
    };
    let present = match (present, &usual) {
        (Some(Ok(present)), _) => Some(present),
        (None | Some(Err(_)), Some(usual)) => Some(usual.clone()),
        (Some(Err(_)), None) => return Err(ParameterError::Absent(name.to_owned())),
        (None, None) => None,
    };
    // An amount that has the dimension of the parameter.
    let kind = present.clone().or_else(written).ok_or_else(|| ParameterError::Absent(name.to_owned()))?;
    // If the case does not have the quantity, the unit of the argument reads better.
    let is_in_case = value_at(source, path)?.is_some();
    let scale = if is_in_case {
        kind.scale.clone()
    } else {
        written().map_or(kind.scale.clone(), |amount| amount.scale)
    };
    for amount in free.range.iter().flatten().chain(&free.start) {
        if !amount.scale.fits(&kind.scale) {
            return Err(ParameterError::Dimension {
                name: name.to_owned(),
                expected: kind.scale.dimension_name(),
                found: amount.scale.dimension_name(),
            });
        }
    }
    let range = match (&free.range, quantity) {
        (Some([low, high]), _) => [low.si, high.si],
        (None, Quantity::Gain) => [1e-3, 1e3],
        (None, Quantity::Offset | Quantity::Parasitic) => [f64::NEG_INFINITY, f64::INFINITY],
        (None, Quantity::Key) => match present.as_ref() {
            Some(present) if present.si > 0.0 => [present.si / USUAL_RATIO, present.si * USUAL_RATIO],
            Some(_) | None => return Err(ParameterError::NeedsRange(name.to_owned())),
        },
    };
    let [low, high] = range;
    let inside = |value: f64| value >= low && value <= high;
    let middle = if low > 0.0 && high > 3.0 * low { (low * high).sqrt() } else { 0.5 * (low + high) };
    let start = match (&free.start, &present) {
        (Some(start), _) => start.si,
        (None, Some(present)) if inside(present.si) => present.si,
        (None, Some(_) | None) => middle,
    };
    if low >= high || !inside(start) {
        return Err(ParameterError::Order(name.to_owned()));
    }
    Ok(Parameter { name: name.to_owned(), path: path.to_owned(), quantity, scale, range, start })
}

/// The value of a correction of the measured points, in a unit that suits them.
fn usual(quantity: Quantity, measured: &MeasuredPoints) -> Amount {
    let correction = measured.correction;
    let largest_load = measured.points.iter().map(|point| point.load.abs()).fold(0.0, f64::max);
    let largest = measured.points.iter().map(|point| point.capacitance.abs()).fold(0.0, f64::max);
    let (si, size, unit) = match quantity {
        Quantity::Parasitic => (correction.parasitic, largest, "F"),
        Quantity::Gain | Quantity::Key => return Amount::plain(correction.gain),
        Quantity::Offset => match measured.load {
            MeasuredLoad::Compression => return Amount::plain(correction.offset),
            MeasuredLoad::Force | MeasuredLoad::Displacement => {
                (correction.offset, largest_load, measured.load.unit())
            }
        },
    };
    Amount::with_prefix(si, size, unit)
}

#[cfg(test)]
mod tests {
    use super::*;
    use elastocap_case::{Correction, MeasuredPoint};

    const CASE: &str = "format = 1\n[layer]\nthickness = \"450 um\"\nrelative_permittivity = 2.8\n[measurement]\ngain = 1.1\n";

    fn measured() -> MeasuredPoints {
        let point = MeasuredPoint { line: 2, load: 0.3, capacitance: 40e-15, deviation: None };
        MeasuredPoints {
            file: "p.csv".to_owned(),
            load: MeasuredLoad::Force,
            points: vec![point],
            correction: Correction { gain: 1.1, ..Correction::default() },
        }
    }

    fn parsed(text: &str) -> Result<Parameter, ParameterError> {
        Ok(parameters(&[text.parse()?], CASE, Some(&measured()))?.remove(0))
    }

    #[test]
    fn a_key_has_the_unit_and_the_start_of_the_case() {
        let thickness = parsed("layer.thickness=0.2mm..1mm").unwrap();
        assert_eq!((thickness.range, thickness.start), ([2e-4, 1e-3], 450e-6));
        assert_eq!(thickness.to_toml(5e-4), "\"500 um\"");
        assert_eq!(parsed("layer.relative_permittivity").unwrap().range, [2.8 / 100.0, 2.8 * 100.0]);
        assert_eq!(parsed("layer.relative_permittivity=1..2").unwrap().start, 1.5);
        assert_eq!(parsed("layer.relative_permittivity=1..4@3").unwrap().start, 3.0);
    }

    #[test]
    fn corrections_have_reserved_names() {
        assert_eq!(parsed("gain").unwrap().start, 1.1);
        let parasitic = parsed("parasitic").unwrap();
        assert_eq!(
            (parasitic.quantity, parasitic.start, parasitic.path.as_str()),
            (Quantity::Parasitic, 0.0, "measurement.parasitic")
        );
        assert_eq!(parsed("offset=-1mN..10mN").unwrap().range, [-1e-3, 1e-2]);
        assert!(matches!(
            parameters(&["gain".parse().unwrap()], CASE, None),
            Err(ParameterError::NotHere(_))
        ));
    }

    #[test]
    fn what_cannot_be_free_says_why() {
        for (text, words) in [
            ("=1..2", "names nothing"),
            ("layer.thickness=1mm", "is not a range"),
            ("layer.thickness=1kPa..2kPa", "a length"),
            ("layer.thickness=1mm..2", "a length"),
            ("layer.thickness=2mm..1mm", "from a smaller"),
            ("layer.thickness=1mm..2mm@3mm", "from a smaller"),
            ("layer.half_length", "no number at"),
            ("layer.thickness=1mm..x", "not a number"),
            ("layer..thickness", "missing before or after a dot"),
            ("offset=1mm..2mm", "a force"),
        ] {
            let message = parsed(text).unwrap_err().to_string();
            assert!(message.contains(words), "{text}: {message}");
        }
    }
}
