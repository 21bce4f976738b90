//! Quantities as they are printed on the page.

use elastocap_coupling::words::prefixed;

/// A number and its unit with a minus sign in place of a hyphen, and a micro sign in place of the letter u
/// before a unit.
pub(crate) fn typeset(text: &str) -> String {
    let text = match text.split_once(' ') {
        Some((number, unit)) if unit.len() > 1 && unit.starts_with('u') => {
            format!("{number} \u{b5}{}", &unit[1..])
        }
        _ => text.to_owned(),
    };
    match text.strip_prefix('-') {
        Some(rest) => format!("\u{2212}{rest}"),
        None => text,
    }
}

/// A quantity with its unit: `43.97 fF`, with a space that does not break.
pub(crate) fn quantity(value: f64, digits: usize, unit: &str) -> String {
    typeset(&prefixed(value, digits, unit)).replace(' ', "\u{a0}")
}

/// A share as percent with two digits: `0.026 %`.
pub(crate) fn percent(share: f64) -> String {
    let value = 100.0 * share;
    if value == 0.0 {
        return "0\u{a0}%".to_owned();
    }
    if !value.is_finite() {
        return "unknown".to_owned();
    }
    let places = (1 - value.abs().log10().floor() as i32).clamp(0, 12) as usize;
    typeset(&format!("{value:.places$} %")).replace(' ', "\u{a0}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantities_and_shares_read_as_in_print() {
        assert_eq!(quantity(-8.07e-14, 3, "F/N"), "\u{2212}80.7\u{a0}fF/N");
        assert_eq!(quantity(50e-6, 3, "m"), "50.0\u{a0}\u{b5}m");
        assert_eq!(percent(2.555e-4), "0.026\u{a0}%");
        assert_eq!(percent(0.259), "26\u{a0}%");
    }
}
