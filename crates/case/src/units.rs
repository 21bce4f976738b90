//! Parses quantities: `"450 um"`, `"1 MPa"`, `"0.05 N"`.
//!
//! Every unit here is a power of ten of SI units, so a prefix is applied to the decimal exponent of the
//! number before it is rounded: `"450 um"` is the same `f64` as the literal `450e-6`.

/// The exponents of the SI base units in a quantity.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Dimension {
    pub(super) metre: i32,
    pub(super) kilogram: i32,
    pub(super) second: i32,
    pub(super) ampere: i32,
    pub(super) radian: i32,
}

/// The dimension with these exponents, and without an angle.
const fn dimension(metre: i32, kilogram: i32, second: i32, ampere: i32) -> Dimension {
    Dimension { metre, kilogram, second, ampere, radian: 0 }
}

pub(super) const LENGTH: Dimension = dimension(1, 0, 0, 0);
pub(super) const PRESSURE: Dimension = dimension(-1, 1, -2, 0);
pub(super) const FORCE: Dimension = dimension(1, 1, -2, 0);
pub(super) const CHARGE: Dimension = dimension(0, 0, 1, 1);
pub(super) const CAPACITANCE: Dimension = dimension(-2, -1, 4, 2);
pub(super) const ANGLE: Dimension = Dimension { radian: 1, ..dimension(0, 0, 0, 0) };

/// The degree, pi / 180 radians: the only unit that is not a power of ten of an SI unit.
const DEGREE: &str = "deg";

/// Dimensions with a name, for messages.
const NAMED: &[(Dimension, &str)] = &[
    (dimension(0, 0, 0, 0), "a number"),
    (LENGTH, "a length"),
    (PRESSURE, "a pressure"),
    (FORCE, "a force"),
    (dimension(2, 0, 0, 0), "an area"),
    (dimension(3, 0, 0, 0), "a volume"),
    (dimension(0, 1, -2, 0), "a force per length"),
    (dimension(2, 1, -3, -1), "a voltage"),
    (CHARGE, "a charge"),
    (ANGLE, "an angle"),
    (CAPACITANCE, "a capacitance"),
    (dimension(-3, -1, 4, 2), "a capacitance per length"),
    (dimension(1, 1, -3, -1), "an electric field"),
    (dimension(2, 1, -2, 0), "an energy"),
    (dimension(0, 1, 0, 0), "a mass"),
    (dimension(0, 0, 1, 0), "a time"),
    (dimension(0, 0, 0, 1), "a current"),
];

impl Dimension {
    /// The name with its article, such as "a length".
    pub(super) fn name(self) -> &'static str {
        NAMED.iter().find(|(d, _)| *d == self).map_or("another kind of quantity", |(_, name)| name)
    }

    /// The dimension of a power of this quantity.
    fn scaled(self, by: i32) -> Self {
        Self {
            metre: self.metre * by,
            kilogram: self.kilogram * by,
            second: self.second * by,
            ampere: self.ampere * by,
            radian: self.radian * by,
        }
    }

    /// The dimension of a product with another quantity.
    fn plus(self, other: Self) -> Self {
        Self {
            metre: self.metre + other.metre,
            kilogram: self.kilogram + other.kilogram,
            second: self.second + other.second,
            ampere: self.ampere + other.ampere,
            radian: self.radian + other.radian,
        }
    }
}

/// Unit symbols, with the power of ten over the SI unit of the dimension, and the dimension.
const SYMBOLS: &[(&str, i32, Dimension)] = &[
    ("m", 0, LENGTH),
    ("N", 0, FORCE),
    ("Pa", 0, PRESSURE),
    ("V", 0, dimension(2, 1, -3, -1)),
    ("F", 0, dimension(-2, -1, 4, 2)),
    ("C", 0, CHARGE),
    ("J", 0, dimension(2, 1, -2, 0)),
    ("g", -3, dimension(0, 1, 0, 0)),
    ("s", 0, dimension(0, 0, 1, 0)),
    ("A", 0, dimension(0, 0, 0, 1)),
    ("rad", 0, ANGLE),
];

/// SI prefixes; mu may be either of two code points or the letter u.
const PREFIXES: &[(&str, i32)] = &[
    ("a", -18),
    ("f", -15),
    ("p", -12),
    ("n", -9),
    ("u", -6),
    ("\u{b5}", -6),
    ("\u{3bc}", -6),
    ("m", -3),
    ("c", -2),
    ("d", -1),
    ("h", 2),
    ("k", 3),
    ("M", 6),
    ("G", 9),
    ("T", 12),
];

/// The regular expression of the units of a dimension, for the JSON Schema.
pub(super) fn pattern(dimension: Dimension) -> String {
    let prefix = "[afpnu\u{b5}\u{3bc}mcdhkMGT]?";
    if dimension == PRESSURE {
        format!("({prefix}Pa|{prefix}N/{prefix}m(\\^2|\u{b2}))")
    } else if dimension == ANGLE {
        format!("({DEGREE}|{prefix}rad)")
    } else {
        let symbol = SYMBOLS.iter().find(|(_, _, d)| *d == dimension).map_or("", |(symbol, ..)| symbol);
        format!("{prefix}{symbol}")
    }
}

/// A unit that is ten to `power` times the SI unit of `dimension`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Unit {
    pub(super) dimension: Dimension,
    pub(super) power: i32,
}

/// A quantity with its text.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Quantity<'a> {
    /// The value in SI units, finite.
    pub(super) si: f64,
    /// The number as text.
    pub(super) number: &'a str,
    /// The unit as text.
    pub(super) unit_text: &'a str,
    pub(super) dimension: Dimension,
}

/// The reason why a text is not a quantity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum NotAQuantity<'a> {
    /// The text does not begin with a number.
    NoNumber,
    /// `nan` or `inf`.
    NotFinite,
    /// A finite decimal beyond the largest `f64`.
    TooLarge,
    /// A decimal comma.
    Comma,
    /// A number without a unit.
    NoUnit { number: &'a str },
    /// An unknown unit.
    UnknownUnit { number: &'a str, unit: &'a str },
}

/// Parses `"number unit"`; the space between the two is optional.
pub(super) fn parse(text: &str) -> Result<Quantity<'_>, NotAQuantity<'_>> {
    let text = text.trim();
    let (number, rest) = split_number(text);
    if number.is_empty() {
        let word = text.trim_start_matches(['+', '-']).to_ascii_lowercase();
        let not_finite = word.starts_with("nan") || word.starts_with("inf");
        return Err(if not_finite { NotAQuantity::NotFinite } else { NotAQuantity::NoNumber });
    }
    let unit_text = rest.trim();
    if unit_text.starts_with(',') {
        return Err(NotAQuantity::Comma);
    }
    if unit_text.is_empty() {
        return Err(NotAQuantity::NoUnit { number });
    }
    if unit_text == DEGREE {
        let si = decimal(number, 0).filter(|v| v.is_finite()).ok_or(NotAQuantity::TooLarge)?.to_radians();
        return Ok(Quantity { si, number, unit_text, dimension: ANGLE });
    }
    let unit = parse_unit(unit_text).ok_or(NotAQuantity::UnknownUnit { number, unit: unit_text })?;
    let si = decimal(number, unit.power).filter(|v| v.is_finite()).ok_or(NotAQuantity::TooLarge)?;
    Ok(Quantity { si, number, unit_text, dimension: unit.dimension })
}

/// Parses a unit: prefixed symbols with optional powers, multiplied by `*` or a middle dot, divided by `/`.
pub(super) fn parse_unit(text: &str) -> Option<Unit> {
    if text.len() > 40 {
        return None;
    }
    let mut unit = Unit { dimension: dimension(0, 0, 0, 0), power: 0 };
    for (k, part) in text.split('/').enumerate() {
        let sign = if k == 0 { 1 } else { -1 };
        for factor in part.split(['*', '\u{b7}', '\u{22c5}']) {
            let (symbol, exponent) = split_exponent(factor.trim());
            let base = parse_symbol(symbol)?;
            unit.dimension = unit.dimension.plus(base.dimension.scaled(sign * exponent));
            unit.power += sign * exponent * base.power;
        }
    }
    Some(unit)
}

/// Parses a unit symbol with or without a prefix.
fn parse_symbol(text: &str) -> Option<Unit> {
    // The symbol without a prefix goes first: "m" is the metre, "Pa" the pascal.
    let plain = |text: &str| {
        SYMBOLS
            .iter()
            .find(|(symbol, ..)| *symbol == text)
            .map(|&(_, power, dimension)| Unit { dimension, power })
    };
    plain(text).or_else(|| {
        PREFIXES.iter().find_map(|(prefix, power)| {
            let unit = plain(text.strip_prefix(prefix)?)?;
            Some(Unit { power: unit.power + power, ..unit })
        })
    })
}

/// Splits the exponent, 2 or 3, off the end of a factor; 1 if it has none.
fn split_exponent(factor: &str) -> (&str, i32) {
    for (ending, exponent) in [("^2", 2), ("\u{b2}", 2), ("^3", 3), ("\u{b3}", 3)] {
        if let Some(symbol) = factor.strip_suffix(ending) {
            return (symbol, exponent);
        }
    }
    (factor, 1)
}

/// Splits the longest decimal number off the front: sign, digits, point, digits, exponent.
pub(super) fn split_number(text: &str) -> (&str, &str) {
    let bytes = text.as_bytes();
    let digits_from = |start: usize| bytes.iter().skip(start).take_while(|b| b.is_ascii_digit()).count();
    let mut end = usize::from(matches!(bytes.first(), Some(b'+' | b'-')));
    let whole = digits_from(end);
    end += whole;
    let mut fraction = 0;
    if bytes.get(end) == Some(&b'.') {
        fraction = digits_from(end + 1);
        if whole + fraction > 0 {
            end += 1 + fraction;
        }
    }
    if whole + fraction == 0 {
        return ("", text);
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        let exponent = digits_from(end + 1 + sign);
        if exponent > 0 {
            end += 1 + sign + exponent;
        }
    }
    // `end` stands behind an ASCII byte, so it is a character boundary.
    text.split_at(end)
}

/// `number` times ten to `power`, rounded once.
fn decimal(number: &str, power: i32) -> Option<f64> {
    let (mantissa, exponent) = number.split_once(['e', 'E']).unwrap_or((number, "0"));
    let huge = if exponent.starts_with('-') { -1_000_000_000 } else { 1_000_000_000 };
    let exponent = exponent.parse::<i64>().unwrap_or(huge).clamp(-1_000_000_000, 1_000_000_000);
    format!("{mantissa}e{}", exponent + i64::from(power)).parse().ok()
}

/// A unit of the dimension that `unknown` is probably a misspelling of.
pub(super) fn nearest_unit(unknown: &str, of: Dimension) -> Option<&'static str> {
    const WORDS: &[(&str, &str)] = &[
        ("micron", "um"),
        ("microns", "um"),
        ("micrometer", "um"),
        ("micrometre", "um"),
        ("millimeter", "mm"),
        ("millimetre", "mm"),
        ("meter", "m"),
        ("metre", "m"),
        ("newton", "N"),
        ("pascal", "Pa"),
        ("kilopascal", "kPa"),
        ("megapascal", "MPa"),
        ("coulomb", "C"),
        ("degree", "deg"),
        ("radian", "rad"),
    ];
    const COMMON: &[&str] = &[
        "m", "um", "mm", "nm", "cm", "km", "Pa", "kPa", "MPa", "GPa", "N", "mN", "kN", "C", "pC", "nC",
        "rad", "mrad", "deg",
    ];
    let word = unknown.to_lowercase();
    let word = word.strip_suffix('s').unwrap_or(&word);
    let named = WORDS.iter().find(|(name, _)| *name == word).map(|(_, unit)| *unit);
    let same_letters = COMMON.iter().copied().find(|unit| unit.eq_ignore_ascii_case(unknown));
    named.or(same_letters).filter(|unit| {
        if *unit == DEGREE { of == ANGLE } else { parse_unit(unit).is_some_and(|u| u.dimension == of) }
    })
}

/// Units that a bare number may be in, with the range of magnitudes of that dimension in a sensor, in SI
/// units.
const MEANT: &[(Dimension, &[&str], [f64; 2])] = &[
    (LENGTH, &["um", "mm", "m"], [1e-8, 1e2]),
    (PRESSURE, &["Pa", "kPa", "MPa"], [1.0, 1e13]),
    (FORCE, &["mN", "N", "kN"], [1e-7, 1e5]),
    (CHARGE, &["fC", "pC", "nC"], [1e-18, 1e-3]),
    (CAPACITANCE, &["fF", "pF"], [1e-20, 1e-3]),
    (ANGLE, &[DEGREE, "rad"], [1e-9, std::f64::consts::FRAC_PI_2]),
];

/// The units that give a bare number a sensible value, each with that value if another unit expresses it
/// better.
pub(super) fn meant(number: &str, of: Dimension) -> Vec<(&'static str, Option<String>)> {
    let Some((_, units, [low, high])) = MEANT.iter().find(|(dimension, ..)| *dimension == of) else {
        return Vec::new();
    };
    let value = |unit: &&'static str| {
        let text = format!("{number} {unit}");
        let si = parse(&text).ok()?.si;
        let is_sensible = (*low..=*high).contains(&si.abs());
        is_sensible.then(|| (*unit, prefixed(si, of).filter(|shown| *shown != text)))
    };
    units.iter().filter_map(value).collect()
}

/// A value to four digits, with the prefix that makes it a number from 1 to 1000.
fn prefixed(si: f64, of: Dimension) -> Option<String> {
    let (symbol, ..) = SYMBOLS.iter().find(|(_, _, dimension)| *dimension == of && of != ANGLE)?;
    let mut prefixes = PREFIXES.iter().filter(|(_, power)| power % 3 == 0).chain(&[("", 0)]);
    prefixes.find_map(|(prefix, power)| {
        let number: f64 = format!("{:.3e}", si / 10_f64.powi(*power)).parse().ok()?;
        (1.0..1000.0).contains(&number.abs()).then(|| format!("{number} {prefix}{symbol}"))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quantity_is_the_same_double_as_the_literal_in_si() {
        let table: &[(&str, f64, Dimension)] = &[
            ("450 um", 450e-6, LENGTH),
            ("450um", 450e-6, LENGTH),
            ("450 \u{b5}m", 450e-6, LENGTH),
            ("450 \u{3bc}m", 450e-6, LENGTH),
            ("0.1 m", 0.1, LENGTH),
            ("1 fm", 1e-15, LENGTH),
            ("3 pm", 3e-12, LENGTH),
            ("7 nm", 7e-9, LENGTH),
            ("1.6 mm", 1.6e-3, LENGTH),
            ("5 cm", 5e-2, LENGTH),
            ("5 dm", 0.5, LENGTH),
            ("2 km", 2e3, LENGTH),
            ("2 Mm", 2e6, LENGTH),
            ("2 Gm", 2e9, LENGTH),
            ("-1e-3 m", -1e-3, LENGTH),
            ("+.5e1 mm", 5e-3, LENGTH),
            ("  9 um ", 9e-6, LENGTH),
            ("682.15 Pa", 682.15, PRESSURE),
            ("1 hPa", 100.0, PRESSURE),
            ("1 MPa", 1e6, PRESSURE),
            ("1 N/mm^2", 1e6, PRESSURE),
            ("1 N/m\u{b2}", 1.0, PRESSURE),
            ("0.3 N", 0.3, FORCE),
            ("1 kg*m/s^2", 1.0, FORCE),
            ("10 mN", 1e-2, FORCE),
            ("0 C", 0.0, CHARGE),
            ("-3 fC", -3e-15, CHARGE),
            ("2.5 uC", 2.5e-6, CHARGE),
            ("180 deg", std::f64::consts::PI, ANGLE),
            ("2 mrad", 2e-3, ANGLE),
        ];
        for &(text, si, dimension) in table {
            let quantity = parse(text).unwrap_or_else(|e| panic!("{text}: {e:?}"));
            assert_eq!((quantity.si, quantity.dimension), (si, dimension), "{text}");
        }
    }

    #[test]
    fn other_dimensions_are_recognised_by_name() {
        let table = [
            ("1 V", "a voltage"),
            ("1 fF", "a capacitance"),
            ("8.85 pF/m", "a capacitance per length"),
            ("1 C", "a charge"),
            ("1 N/m", "a force per length"),
            ("1 um^2", "an area"),
            ("1 V/m", "an electric field"),
            ("1 m/m", "a number"),
            ("1 m/s", "another kind of quantity"),
        ];
        for (text, name) in table {
            assert_eq!(parse(text).map(|q| q.dimension.name()), Ok(name), "{text}");
        }
    }

    #[test]
    fn what_is_not_a_quantity_says_why() {
        use NotAQuantity::*;
        let table = [
            ("", NoNumber),
            ("um", NoNumber),
            ("- 5 um", NoNumber),
            (".", NoNumber),
            ("rigid", NoNumber),
            ("nan Pa", NotFinite),
            ("-inf m", NotFinite),
            ("Infinity", NotFinite),
            ("1e400 m", TooLarge),
            ("1e308 km", TooLarge),
            ("1e99999999999999999999 m", TooLarge),
            ("4,5 um", Comma),
            ("450", NoUnit { number: "450" }),
            ("450 foo", UnknownUnit { number: "450", unit: "foo" }),
            ("5 e", UnknownUnit { number: "5", unit: "e" }),
            ("1 /m", UnknownUnit { number: "1", unit: "/m" }),
            ("1 2 m", UnknownUnit { number: "1", unit: "2 m" }),
        ];
        for (text, why) in table {
            assert_eq!(parse(text), Err(why), "{text}");
        }
        assert_eq!(parse("1e-99999999999999999999 m").map(|q| q.si), Ok(0.0));
    }

    #[test]
    fn a_unit_spelt_out_or_in_the_wrong_case_finds_its_symbol() {
        assert_eq!(nearest_unit("microns", LENGTH), Some("um"));
        assert_eq!(nearest_unit("UM", LENGTH), Some("um"));
        assert_eq!(nearest_unit("mpa", PRESSURE), Some("MPa"));
        assert_eq!(nearest_unit("kpa", LENGTH), None);
    }

    #[test]
    fn a_bare_number_is_offered_with_the_units_that_make_sense_of_it() {
        let shown = |number: &str, of: Dimension| {
            let units = meant(number, of).into_iter();
            units
                .map(|(unit, value)| format!("{unit}={}", value.unwrap_or_default()))
                .collect::<Vec<_>>()
                .join(" ")
        };
        assert_eq!(shown("90000", PRESSURE), "Pa=90 kPa kPa=90 MPa MPa=90 GPa");
        assert_eq!(shown("90", PRESSURE), "Pa= kPa= MPa=");
        assert_eq!(shown("450", LENGTH), "um= mm=");
        assert_eq!(shown("0.00045", LENGTH), "mm=450 nm m=450 um");
        assert_eq!(shown("1500", FORCE), "mN=1.5 N N=1.5 kN");
        assert_eq!(shown("0", LENGTH), "");
        assert_eq!(shown("2", ANGLE), "deg=");
    }

    #[test]
    fn every_prefix_is_the_power_of_ten_of_the_si() {
        let powers = [
            ("a", -18),
            ("f", -15),
            ("p", -12),
            ("n", -9),
            ("u", -6),
            ("m", -3),
            ("c", -2),
            ("d", -1),
            ("", 0),
            ("h", 2),
            ("k", 3),
            ("M", 6),
            ("G", 9),
            ("T", 12),
        ];
        for (prefix, power) in powers {
            for symbol in ["m", "N", "Pa", "C"] {
                let exact: f64 = format!("1e{power}").parse().unwrap();
                assert_eq!(
                    parse(&format!("1 {prefix}{symbol}")).map(|q| q.si),
                    Ok(exact),
                    "{prefix}{symbol}"
                );
            }
        }
    }

    #[test]
    fn a_unit_is_the_product_of_others_that_the_si_defines_it_by() {
        for (one, other) in [
            ("1 Pa", "1 N/m^2"),
            ("1 N", "1 kg*m/s^2"),
            ("1 N", "1 kg\u{b7}m/s\u{b2}"),
            ("1 N", "1 kg\u{22c5}m/s^2"),
            ("1 J", "1 N*m"),
            ("1 Pa", "1 J/m^3"),
            ("1 Pa", "1 J/m\u{b3}"),
            ("1 C", "1 A*s"),
            ("1 J", "1 V*C"),
            ("1 C", "1 F*V"),
            ("1 kPa", "1 mN/mm^2"),
            ("1 MPa", "1 mJ/mm^3"),
        ] {
            let read = |text| parse(text).map(|q| (q.si, q.dimension));
            assert_eq!(read(one), read(other), "{one} = {other}");
            assert!(read(one).is_ok(), "{one}");
        }
    }
}
