//! Numbers and lists as people read them, and the name of the formula that several messages cite.

/// The force of the closed form.
pub(crate) const FORCE_FORMULA: &str = "equation (50) of the paper (Large deformation mechanics of a soft elastomeric layer under \
     compressive loading for a MEMS tactile sensor application)";

/// A count in groups of three digits: `1,234,567`.
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

/// Seconds: `0.12 s`, `12 s`, `3 min 20 s`, `5 h`, `12 days`.
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

/// "a", "a and b", "a, b and c".
pub fn listed(names: &[String]) -> String {
    match names {
        [] => String::new(),
        [only] => only.clone(),
        [all @ .., last] => format!("{} and {last}", all.join(", ")),
    }
}

/// "1 step", "6 steps".
pub fn counted(count: usize, what: &str) -> String {
    format!("{} {what}{}", grouped(count), if count == 1 { "" } else { "s" })
}

#[cfg(test)]
mod tests {
    use super::*;

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
