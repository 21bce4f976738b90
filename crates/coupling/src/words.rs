//! Numbers and lists formatted for readers, and the name of a formula that several messages cite.

/// The formula for the force of the closed form, as messages cite it.
pub(crate) const FORCE_FORMULA: &str = "equation (50) of the paper (Large deformation mechanics of a soft elastomeric layer under \
     compressive loading for a MEMS tactile sensor application)";

/// Formats a count in groups of three digits: `1,234,567`.
pub fn grouped(count: usize) -> String {
    let digits = count.to_string();
    let mut out = String::new();
    for (k, digit) in digits.chars().enumerate() {
        if k > 0 && (digits.len() - k).is_multiple_of(3) {
            out.push(',');
        }
        out.push(digit);
    }
    out
}

/// Formats seconds: `0.12 s`, `12 s`, `3 min 20 s`, `5 h`, `12 days`.
pub fn seconds(value: f64) -> String {
    if value < 0.0995 {
        format!("{:.0} ms", (1e3 * value).ceil())
    } else if value < 9.95 {
        format!("{value:.1} s")
    } else if value < 119.5 {
        format!("{value:.0} s")
    } else if value < 2.0 * 3600.0 {
        let whole = value.round() as u64;
        format!("{} min {} s", whole / 60, whole % 60)
    } else if value < 48.0 * 3600.0 {
        format!("{:.0} h", value / 3600.0)
    } else {
        format!("{} days", grouped((value / 86400.0).round() as usize))
    }
}

/// Joins names: "a", "a and b", "a, b and c".
pub fn listed(names: &[String]) -> String {
    match names {
        [] => String::new(),
        [only] => only.clone(),
        [others @ .., last] => format!("{} and {last}", others.join(", ")),
    }
}

/// Formats a count with its noun: "1 step", "6 steps".
pub fn counted(count: usize, what: &str) -> String {
    format!("{} {what}{}", grouped(count), if count == 1 { "" } else { "s" })
}

/// A quantity with the given number of digits and an SI prefix: `43.97 fF`.
pub fn prefixed(value: f64, digits: usize, unit: &str) -> String {
    if value == 0.0 {
        return format!("0 {unit}");
    }
    if !value.is_finite() {
        return format!("{value} {unit}");
    }
    const PREFIXES: [&str; 13] = ["a", "f", "p", "n", "u", "m", "", "k", "M", "G", "T", "P", "E"];
    // The exponent after rounding to the digits wanted: 999.96 um is 1.000 mm.
    let rounded = format!("{:.*e}", digits.saturating_sub(1), value);
    let exponent: i32 = rounded.split_once('e').and_then(|(_, e)| e.parse().ok()).unwrap_or(0);
    let Some(prefix) = usize::try_from(exponent.div_euclid(3) + 6).ok().and_then(|k| PREFIXES.get(k)) else {
        return format!("{rounded} {unit}");
    };
    let places = digits.saturating_sub(1 + exponent.rem_euclid(3) as usize);
    let scaled = value / 10_f64.powi(exponent.div_euclid(3) * 3);
    format!("{scaled:.places$} {prefix}{unit}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantities_get_the_prefix_that_suits_them() {
        for (value, expected) in [
            (43.965_9e-15, "43.97 fF"),
            (0.0, "0 F"),
            (-2.5e-12, "-2.500 pF"),
            (999.96e-15, "1.000 pF"),
            (1.0, "1.000 F"),
            (1e-30, "1.000e-30 F"),
            (f64::NAN, "NaN F"),
        ] {
            assert_eq!(prefixed(value, 4, "F"), expected);
        }
    }

    #[test]
    fn counts_are_grouped_by_three() {
        assert_eq!([7, 1000, 1_234_567].map(grouped), ["7", "1,000", "1,234,567"]);
    }

    #[test]
    fn seconds_have_two_digits_and_minutes_are_told_from_them() {
        assert_eq!([0.0012, 1.26, 13.04, 200.0].map(seconds), ["2 ms", "1.3 s", "13 s", "3 min 20 s"]);
        assert_eq!([18e3, 1e6].map(seconds), ["5 h", "12 days"]);
    }

    #[test]
    fn lists_end_with_and() {
        let names = ["a", "b", "c"].map(str::to_owned);
        assert_eq!([1, 2, 3].map(|n| listed(&names[..n])), ["a", "a and b", "a, b and c"]);
        assert_eq!(
            (counted(1, "step"), counted(1200, "step")),
            ("1 step".to_owned(), "1,200 steps".to_owned())
        );
    }
}
