//! Quantities with a unit and numbers without one, each of a kind with its limits.

use std::marker::PhantomData;

use serde_json::{Value, json};
use toml::Spanned;
use toml::de::DeValue;

use super::diagnostics::{Diagnostic, shown};
use super::reader::{FromToml, Log, Node, alternatives};
use super::units::{self, Dimension, NotAQuantity};

/// The allowed signs of a quantity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Sign {
    Any,
    NonNegative,
    Positive,
}

/// A kind of quantity with a unit: its dimension, its sign and its limits.
pub(super) trait QuantityKind {
    const DIMENSION: Dimension;
    const SIGN: Sign;
    /// The proposed unit if the file has none of this dimension.
    const UNIT: &'static str;
    /// The proposed number.
    const SAMPLE: &'static str;
    /// Smallest and largest allowed magnitude other than zero, in SI units. The smallest one is not checked
    /// where any sign is allowed.
    const LIMITS: [f64; 2];
    /// The limits in words.
    const LIMITS_SHOWN: &'static str;
}

macro_rules! lengths {
    ($($(#[doc = $doc:literal])* $Name:ident: $sign:ident, $sample:literal;)*) => {
        $(
            $(#[doc = $doc])*
            #[derive(Debug, Clone, Copy)]
            pub(super) struct $Name;
            impl QuantityKind for $Name {
                const DIMENSION: Dimension = units::LENGTH;
                const SIGN: Sign = Sign::$sign;
                const UNIT: &'static str = "um";
                const SAMPLE: &'static str = $sample;
                const LIMITS: [f64; 2] = [1e-15, 1e9];
                const LIMITS_SHOWN: &'static str = "1 fm to 1 Gm";
            }
        )*
    };
}

lengths! {
    /// A coordinate.
    PositionKind: Any, "0";
    /// The size of a body, greater than zero.
    SizeKind: Positive, "100";
    /// A height that may be zero.
    HeightKind: NonNegative, "100";
}

macro_rules! pressures {
    ($($(#[doc = $doc:literal])* $Name:ident: $sign:ident;)*) => {
        $(
            $(#[doc = $doc])*
            #[derive(Debug, Clone, Copy)]
            pub(super) struct $Name;
            impl QuantityKind for $Name {
                const DIMENSION: Dimension = units::PRESSURE;
                const SIGN: Sign = Sign::$sign;
                const UNIT: &'static str = "kPa";
                const SAMPLE: &'static str = "100";
                const LIMITS: [f64; 2] = [1e-6, 1e18];
                const LIMITS_SHOWN: &'static str = "1 uPa to 1e9 GPa";
            }
        )*
    };
}

pressures! {
    /// A modulus that must be positive.
    ModulusKind: Positive;
    /// A material constant that may vanish beside another one.
    ConstantKind: NonNegative;
    /// A material constant of either sign.
    SignedConstantKind: Any;
}

/// A compressive force.
#[derive(Debug, Clone, Copy)]
pub(super) struct ForceKind;
impl QuantityKind for ForceKind {
    const DIMENSION: Dimension = units::FORCE;
    const SIGN: Sign = Sign::NonNegative;
    const UNIT: &'static str = "N";
    const SAMPLE: &'static str = "0.1";
    const LIMITS: [f64; 2] = [1e-24, 1e18];
    const LIMITS_SHOWN: &'static str = "1e-24 N to 1e18 N";
}

/// The charge of a floating conductor.
#[derive(Debug, Clone, Copy)]
pub(super) struct ChargeKind;
impl QuantityKind for ChargeKind {
    const DIMENSION: Dimension = units::CHARGE;
    const SIGN: Sign = Sign::Any;
    const UNIT: &'static str = "C";
    const SAMPLE: &'static str = "0";
    const LIMITS: [f64; 2] = [0.0, 1e9];
    const LIMITS_SHOWN: &'static str = "at most 1 GC";
}

/// A capacitance greater than zero: a tolerance, or the deviation of a measured value.
#[derive(Debug, Clone, Copy)]
pub(super) struct CapacitanceKind;
impl QuantityKind for CapacitanceKind {
    const DIMENSION: Dimension = units::CAPACITANCE;
    const SIGN: Sign = Sign::Positive;
    const UNIT: &'static str = "fF";
    const SAMPLE: &'static str = "1";
    const LIMITS: [f64; 2] = [1e-24, 1.0];
    const LIMITS_SHOWN: &'static str = "1e-24 F to 1 F";
}

/// A capacitance of either sign, which is added to another.
#[derive(Debug, Clone, Copy)]
pub(super) struct SignedCapacitanceKind;
impl QuantityKind for SignedCapacitanceKind {
    const DIMENSION: Dimension = units::CAPACITANCE;
    const SIGN: Sign = Sign::Any;
    const UNIT: &'static str = "fF";
    const SAMPLE: &'static str = "10";
    const LIMITS: [f64; 2] = [0.0, 1.0];
    const LIMITS_SHOWN: &'static str = "at most 1 F";
}

/// An angle, between -90 and 90 degrees.
#[derive(Debug, Clone, Copy)]
pub(super) struct AngleKind;
impl QuantityKind for AngleKind {
    const DIMENSION: Dimension = units::ANGLE;
    const SIGN: Sign = Sign::Any;
    const UNIT: &'static str = "deg";
    const SAMPLE: &'static str = "0.2";
    const LIMITS: [f64; 2] = [0.0, std::f64::consts::FRAC_PI_2];
    const LIMITS_SHOWN: &'static str = "-90 deg to 90 deg";
}

/// The beginning of the help for a number without a unit if several units make sense.
pub(super) const UNIT_MEANT: &str = "write the unit that is meant";

/// A quantity of kind `K` in SI units.
#[derive(Debug)]
pub(super) struct Quantity<K> {
    /// The value in SI units.
    pub(super) si: f64,
    kind: PhantomData<K>,
}

pub(super) type Position = Quantity<PositionKind>;
pub(super) type Size = Quantity<SizeKind>;
pub(super) type Height = Quantity<HeightKind>;
pub(super) type Modulus = Quantity<ModulusKind>;
pub(super) type Constant = Quantity<ConstantKind>;
pub(super) type SignedConstant = Quantity<SignedConstantKind>;
pub(super) type Force = Quantity<ForceKind>;
pub(super) type Charge = Quantity<ChargeKind>;
pub(super) type Angle = Quantity<AngleKind>;
pub(super) type SignedCapacitance = Quantity<SignedCapacitanceKind>;
pub(super) type Capacitance = Quantity<CapacitanceKind>;

impl<K: QuantityKind> Quantity<K> {
    /// A quantity with a value in SI units that does not come from a file.
    pub(super) fn of(si: f64) -> Self {
        Self { si, kind: PhantomData }
    }

    /// A bare number with the most frequent unit of the file, or a usual one. Another unit may have been
    /// meant.
    fn with_unit(number: &str, log: &Log<'_>) -> String {
        format!("\"{number} {}\"", log.usual_unit(K::DIMENSION).unwrap_or(K::UNIT))
    }

    /// The help for a number without a right unit: the number with each unit that gives a sensible value, and
    /// that value.
    fn units_for(number: &str, node: Node<'_>, log: &Log<'_>) -> String {
        let meant = units::meant(number, K::DIMENSION);
        let written = match meant.as_slice() {
            [] => Self::with_unit(number, log),
            [(unit, _)] => format!("\"{number} {unit}\""),
            [_, ..] => String::new(),
        };
        if !written.is_empty() {
            return format!("write {}", node.assign(&written));
        }
        let shown: Vec<String> = meant
            .iter()
            .map(|(unit, value)| match value {
                Some(value) => format!("\"{number} {unit}\" ({value})"),
                None => format!("\"{number} {unit}\""),
            })
            .collect();
        format!("{UNIT_MEANT}: {}", alternatives(&shown, "or"))
    }

    /// The quantity, if its sign and its magnitude are allowed; reports why not otherwise.
    fn check(si: f64, number: &str, node: Node<'_>, log: &mut Log<'_>) -> Option<Self> {
        let place = node.place();
        let unsigned = number.trim_start_matches('-');
        let wrong_sign = match K::SIGN {
            Sign::Any => None,
            Sign::NonNegative => (si < 0.0).then_some("must not be negative"),
            Sign::Positive => (si <= 0.0).then_some("must be greater than zero"),
        };
        if let Some(rule) = wrong_sign {
            let text = log.text(&node.span()).replacen('-', "", 1);
            let suggestion = if si < 0.0 && text.len() < 40 { text } else { Self::sample(log) };
            let label = if si < 0.0 { "negative" } else { "zero" };
            log.push(
                Diagnostic::at(&node.span(), format!("{place} {rule}"))
                    .label(label)
                    .help(format!("write for example {}", node.assign(&suggestion))),
            );
            return None;
        }
        let [low, high] = K::LIMITS;
        let too_small = K::SIGN != Sign::Any && si != 0.0 && si.abs() < low;
        if too_small || si.abs() > high {
            log.push(
                Diagnostic::at(
                    &node.span(),
                    format!("{place} is beyond what elastocap computes: {}", K::LIMITS_SHOWN),
                )
                .label(format!("{unsigned} is too {}", if too_small { "small" } else { "large" }))
                .help("is the prefix of the unit right?"),
            );
            return None;
        }
        // Minus zero would be printed with its sign.
        Some(Self { si: si + 0.0, kind: PhantomData })
    }

    /// Reports why a text is not a quantity.
    fn refuse(text: &str, why: NotAQuantity<'_>, node: Node<'_>, log: &mut Log<'_>) {
        let place = node.place();
        let name = K::DIMENSION.name();
        let at = |message: String| Diagnostic::at(&node.span(), message);
        let sample = Self::sample(log);
        let example = format!("write for example {}", node.assign(&sample));
        let diagnostic = match why {
            NotAQuantity::NoNumber => at(format!("{place}: expected {name}, found \"{}\"", shown(text)))
                .label("no number in it")
                .help(example),
            NotAQuantity::NotFinite => {
                at(format!("{place} must be a finite number")).label("not a finite number").help(example)
            }
            NotAQuantity::TooLarge => {
                at(format!("{place} is beyond what elastocap computes: {}", K::LIMITS_SHOWN))
                    .label("too large")
                    .help("is the prefix of the unit right?")
            }
            NotAQuantity::Comma => {
                at(format!("{place}: the decimal sign is a point")).label("a comma in a number").help(
                    format!("write {}", node.assign(&format!("\"{}\"", shown(&text.replacen(',', ".", 1))))),
                )
            }
            NotAQuantity::NoUnit { number } => at(format!("{place} needs a unit: it is {name}"))
                .label("a number without a unit")
                .help(Self::units_for(number, node, log)),
            NotAQuantity::UnknownUnit { number, unit } => {
                let diagnostic = at(format!("{place}: unknown unit `{}`", shown(unit)))
                    .label(format!("expected {name}, in {}", units_in_words(K::DIMENSION)));
                diagnostic.help(match units::nearest_unit(unit, K::DIMENSION) {
                    Some(unit) => {
                        format!("write for example {}", node.assign(&format!("\"{number} {unit}\"")))
                    }
                    None => Self::units_for(number, node, log),
                })
            }
        };
        log.push(diagnostic);
    }
}

/// The units of a dimension that case files use, for a message.
fn units_in_words(dimension: Dimension) -> &'static str {
    match dimension {
        units::LENGTH => "m with an SI prefix",
        units::PRESSURE => "Pa with an SI prefix",
        units::CHARGE => "C with an SI prefix",
        units::CAPACITANCE => "F with an SI prefix",
        units::ANGLE => "deg or rad",
        _ => "N with an SI prefix",
    }
}

/// A bare TOML number as text, if a unit can follow it.
fn bare_number(value: &DeValue<'_>) -> Option<String> {
    match value {
        DeValue::Integer(_) => number(value).map(|v| format!("{v}")),
        DeValue::Float(float) => {
            let (number, rest) = units::split_number(float.as_str());
            (rest.is_empty() && !number.is_empty()).then(|| number.to_owned())
        }
        _ => None,
    }
}

/// The value of a TOML number; may be infinite or nan.
fn number(value: &DeValue<'_>) -> Option<f64> {
    match value {
        DeValue::Integer(integer) => {
            #[expect(
                clippy::cast_precision_loss,
                reason = "a number is a double here, however it is written"
            )]
            let value = i128::from_str_radix(integer.as_str(), integer.radix()).ok().map(|i| i as f64);
            value
        }
        DeValue::Float(float) => float.as_str().parse().ok(),
        _ => None,
    }
}

impl<K: QuantityKind> FromToml for Quantity<K> {
    fn expected() -> String {
        format!("{}, a text such as \"{} {}\"", K::DIMENSION.name(), K::SAMPLE, K::UNIT)
    }

    fn sample(log: &Log<'_>) -> String {
        Self::with_unit(K::SAMPLE, log)
    }

    fn accepts(value: &DeValue<'_>) -> bool {
        matches!(value, DeValue::String(_) | DeValue::Integer(_) | DeValue::Float(_))
    }

    fn mended(value: &Spanned<DeValue<'_>>, log: &Log<'_>) -> Option<String> {
        bare_number(value.get_ref()).map(|number| Self::with_unit(&number, log))
    }

    fn from_toml(node: Node<'_>, log: &mut Log<'_>) -> Option<Self> {
        if let Some(number) = bare_number(node.value.get_ref()) {
            let message = format!("{} needs a unit: it is {}", node.place(), K::DIMENSION.name());
            let help = Self::units_for(&number, node, log);
            log.push(Diagnostic::at(&node.span(), message).label("a number without a unit").help(help));
            return None;
        }
        let Some(text) = node.value.get_ref().as_str() else {
            log.wrong_type::<Self>(node);
            return None;
        };
        let quantity = match units::parse(text) {
            Ok(quantity) => quantity,
            Err(why) => {
                Self::refuse(text, why, node, log);
                return None;
            }
        };
        if quantity.dimension != K::DIMENSION {
            let help = Self::units_for(quantity.number, node, log);
            let (expected, found) = (K::DIMENSION.name(), quantity.dimension.name());
            let message = format!("{}: expected {expected}, found {found}", node.place());
            log.push(
                Diagnostic::at(&node.span(), message)
                    .label(format!("`{}` makes this {found}", shown(quantity.unit_text)))
                    .help(help),
            );
            return None;
        }
        Self::check(quantity.si, quantity.number, node, log)
    }

    fn schema() -> Value {
        let sign = if K::SIGN == Sign::Any { "[+-]?" } else { "\\+?" };
        let unit = units::pattern(K::DIMENSION);
        json!({
            "type": "string",
            "pattern": format!("^\\s*{sign}([0-9]+\\.?[0-9]*|\\.[0-9]+)([eE][+-]?[0-9]+)?\\s*{unit}\\s*$"),
            "examples": [format!("{} {}", K::SAMPLE, K::UNIT)],
        })
    }
}

/// A range of numbers.
#[derive(Debug, Clone, Copy)]
pub(super) struct Interval {
    pub(super) low: f64,
    /// Whether `low` belongs to the range.
    pub(super) low_belongs: bool,
    pub(super) high: f64,
    /// Whether `high` belongs to the range.
    pub(super) high_belongs: bool,
}

impl Interval {
    fn contains(self, x: f64) -> bool {
        (if self.low_belongs { x >= self.low } else { x > self.low })
            && (if self.high_belongs { x <= self.high } else { x < self.high })
    }
}

/// A kind of number without a unit: its name and its range.
pub(super) trait NumberKind {
    /// The name with its article.
    const NAME: &'static str;
    /// The proposed number.
    const SAMPLE: &'static str;
    const RANGE: Interval;
    /// The range in words, after "must be".
    const RULE: &'static str;
    /// The remark beside a number out of range.
    const REASON: &'static str;
    /// The number that was probably meant by one out of range.
    fn slip(_value: f64) -> Option<f64> {
        None
    }
}

/// A relative permittivity.
#[derive(Debug, Clone, Copy)]
pub(super) struct PermittivityKind;
impl NumberKind for PermittivityKind {
    const NAME: &'static str = "a relative permittivity";
    const SAMPLE: &'static str = "2.8";
    const RANGE: Interval = Interval { low: 1e-12, low_belongs: true, high: 1e12, high_belongs: true };
    const RULE: &'static str = "greater than zero (between 1e-12 and 1e12)";
    const REASON: &'static str = "relative to vacuum, which has 1";
    fn slip(value: f64) -> Option<f64> {
        (value < 0.0).then_some(-value)
    }
}

/// A compression U/H: the displacement of the top over the thickness of the layer.
#[derive(Debug, Clone, Copy)]
pub(super) struct CompressionKind;
impl NumberKind for CompressionKind {
    const NAME: &'static str = "a compression";
    const SAMPLE: &'static str = "0.1";
    const RANGE: Interval = Interval { low: 0.0, low_belongs: true, high: 1.0, high_belongs: false };
    const RULE: &'static str = "at least 0 and less than 1";
    const REASON: &'static str = "displacement over layer thickness: at 1 nothing is left of the layer";
    fn slip(value: f64) -> Option<f64> {
        (value > 1.0 && value < 100.0).then_some(value / 100.0)
    }
}

/// A relative tolerance.
#[derive(Debug, Clone, Copy)]
pub(super) struct ToleranceKind;
impl NumberKind for ToleranceKind {
    const NAME: &'static str = "a relative tolerance";
    const SAMPLE: &'static str = "1e-3";
    const RANGE: Interval = Interval { low: 0.0, low_belongs: false, high: 1.0, high_belongs: false };
    const RULE: &'static str = "greater than 0 and less than 1";
    const REASON: &'static str = "a share of the value; no computation reaches zero";
}

/// A volume fraction.
#[derive(Debug, Clone, Copy)]
pub(super) struct VolumeFractionKind;
impl NumberKind for VolumeFractionKind {
    const NAME: &'static str = "a share of the volume";
    const SAMPLE: &'static str = "0.3";
    const RANGE: Interval = Interval { low: 0.0, low_belongs: false, high: 1.0, high_belongs: true };
    const RULE: &'static str = "greater than 0 and at most 1";
    const REASON: &'static str = "1 is solid without pores";
    fn slip(value: f64) -> Option<f64> {
        (value > 1.0 && value < 100.0).then_some(value / 100.0)
    }
}

/// The ratio of the capacitance shown by a meter to the true one.
#[derive(Debug, Clone, Copy)]
pub(super) struct GainKind;
impl NumberKind for GainKind {
    const NAME: &'static str = "a gain";
    const SAMPLE: &'static str = "1.02";
    const RANGE: Interval = Interval { low: 1e-3, low_belongs: true, high: 1e3, high_belongs: true };
    const RULE: &'static str = "between 1e-3 and 1e3";
    const REASON: &'static str = "1 is a meter that shows what there is";
}

/// A compression that is subtracted from others.
#[derive(Debug, Clone, Copy)]
pub(super) struct LoadShiftKind;
impl NumberKind for LoadShiftKind {
    const NAME: &'static str = "a compression";
    const SAMPLE: &'static str = "0.05";
    const RANGE: Interval = Interval { low: -10.0, low_belongs: true, high: 10.0, high_belongs: true };
    const RULE: &'static str = "between -10 and 10";
    const REASON: &'static str = "displacement over layer thickness";
}

/// The exponent alpha of a term of an Ogden material.
#[derive(Debug, Clone, Copy)]
pub(super) struct ExponentKind;
impl NumberKind for ExponentKind {
    const NAME: &'static str = "an exponent";
    const SAMPLE: &'static str = "2.0";
    const RANGE: Interval = Interval { low: -50.0, low_belongs: true, high: 50.0, high_belongs: true };
    const RULE: &'static str = "between -50 and 50";
    const REASON: &'static str = "measured rubbers have exponents between -10 and 20";
}

/// A dimensionless number of kind `K`.
#[derive(Debug)]
pub(super) struct Number<K> {
    pub(super) value: f64,
    kind: PhantomData<K>,
}

pub(super) type Permittivity = Number<PermittivityKind>;
pub(super) type Compression = Number<CompressionKind>;
pub(super) type Tolerance = Number<ToleranceKind>;
pub(super) type Gain = Number<GainKind>;
pub(super) type LoadShift = Number<LoadShiftKind>;
pub(super) type Exponent = Number<ExponentKind>;
pub(super) type VolumeFraction = Number<VolumeFractionKind>;

impl<K: NumberKind> FromToml for Number<K> {
    fn expected() -> String {
        format!("{}, a bare number such as {}", K::NAME, K::SAMPLE)
    }

    fn sample(_: &Log<'_>) -> String {
        K::SAMPLE.to_owned()
    }

    fn accepts(value: &DeValue<'_>) -> bool {
        matches!(value, DeValue::Integer(_) | DeValue::Float(_))
    }

    fn mended(value: &Spanned<DeValue<'_>>, _: &Log<'_>) -> Option<String> {
        let (number, rest) = units::split_number(value.get_ref().as_str()?.trim());
        let divisor = match rest.trim() {
            "" => 1.0,
            "%" => 100.0,
            _ => return None,
        };
        number.parse::<f64>().ok().map(|v| v / divisor).filter(|v| v.is_finite()).map(|v| format!("{v:?}"))
    }

    fn from_toml(node: Node<'_>, log: &mut Log<'_>) -> Option<Self> {
        if !Self::accepts(node.value.get_ref()) {
            log.wrong_type::<Self>(node);
            return None;
        }
        let value = number(node.value.get_ref()).unwrap_or(f64::NAN);
        let place = node.place();
        if !value.is_finite() {
            let message = format!("{place} must be a finite number");
            log.push(
                Diagnostic::at(&node.span(), message)
                    .label("not a finite number")
                    .help(format!("write for example {}", node.assign(K::SAMPLE))),
            );
            return None;
        }
        if !K::RANGE.contains(value) {
            let help = match K::slip(value) {
                Some(meant) => format!("was {} meant?", node.assign(&format!("{meant}"))),
                None => format!("write for example {}", node.assign(K::SAMPLE)),
            };
            let message = format!("{place} must be {}", K::RULE);
            log.push(Diagnostic::at(&node.span(), message).label(K::REASON).help(help));
            return None;
        }
        Some(Self { value: value + 0.0, kind: PhantomData })
    }

    fn schema() -> Value {
        let Interval { low, low_belongs, high, high_belongs } = K::RANGE;
        let lower = if low_belongs { "minimum" } else { "exclusiveMinimum" };
        let upper = if high_belongs { "maximum" } else { "exclusiveMaximum" };
        json!({ "type": "number", lower: low, upper: high })
    }
}
