//! Amounts of memory in messages.

/// An amount of memory in a unit that suits its size, rounded up: `12 kB`, `79 MB`, `1.3 GB`, `40.0 TB`.
pub fn bytes_in_words(bytes: u64) -> String {
    match bytes {
        0..1_000_000 => format!("{} kB", bytes.div_ceil(1000)),
        1_000_000..1_000_000_000 => format!("{} MB", bytes.div_ceil(1_000_000)),
        1_000_000_000..1_000_000_000_000 => format!("{:.1} GB", bytes as f64 * 1e-9),
        _ => format!("{:.1} TB", bytes as f64 * 1e-12),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_and_large_amounts_have_a_unit_in_which_they_are_not_zero() {
        let words = [1, 999, 1_000_000, 67_000_000, 1_300_000_000, 40_000_000_000_000].map(bytes_in_words);
        assert_eq!(words, ["1 kB", "1 kB", "1 MB", "67 MB", "1.3 GB", "40.0 TB"]);
    }
}
