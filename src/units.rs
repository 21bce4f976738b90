//! Numbers as people read them.

pub(crate) use elastocap_coupling::words::{grouped, seconds};
pub(crate) use elastocap_linalg::memory::bytes_in_words as bytes;

/// A quantity with the given number of digits and an SI prefix: `43.97 fF`.
pub(crate) fn prefixed(value: f64, digits: usize, unit: &str) -> String {
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
}
