//! Messages about load steps, merged where several steps have the same one.

use crate::words::counted;

/// Largest number of reported messages.
const MAX_LINES: usize = 10;

/// One line for each different message, in the order of the first steps that have it. `messages` holds the
/// index of a step and the message, in words that fit one step and several.
pub fn lines(messages: impl IntoIterator<Item = (usize, String)>) -> Vec<String> {
    let mut found: Vec<(String, Vec<usize>)> = Vec::new();
    for (step, text) in messages {
        match found.iter_mut().find(|(known, _)| *known == text) {
            Some((_, steps)) => steps.push(step),
            None => found.push((text, vec![step])),
        }
    }
    let mut out: Vec<String> = found
        .iter()
        .take(MAX_LINES)
        .map(|(text, steps)| match steps.as_slice() {
            [first, _, ..] => format!("{}, from step {first} on, {text}", counted(steps.len(), "step")),
            [] | [_] => format!("step {} {text}", steps.first().copied().unwrap_or_default()),
        })
        .collect();
    if found.len() > MAX_LINES {
        let rest = found[MAX_LINES..].iter().map(|(_, steps)| steps.len()).sum();
        out.push(format!("{} more; --json has the reasons", counted(rest, "step")));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::lines;

    #[test]
    fn steps_that_say_the_same_share_a_line_and_ten_lines_are_enough() {
        let messages =
            [(1, "failed: a"), (2, "failed: b"), (4, "failed: a")].map(|(k, text)| (k, text.to_owned()));
        assert_eq!(lines(messages), ["2 steps, from step 1 on, failed: a", "step 2 failed: b"]);
        let many = lines((0..13).map(|k| (k, format!("failed: {k}"))));
        assert_eq!(many.len(), 11);
        assert!(many[10].starts_with("3 steps more"), "{}", many[10]);
        assert!(lines([]).is_empty());
    }
}
