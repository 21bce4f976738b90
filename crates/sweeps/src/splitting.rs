//! Splits an argument at signs outside of quotation marks and brackets.

/// The place of a character outside of quotation marks.
pub(crate) fn outside_quotes(text: &str, wanted: char) -> Option<usize> {
    let mut open = None;
    text.char_indices().find_map(|(at, c)| {
        match open {
            Some(quote) if c == quote => open = None,
            Some(_) => {}
            None if c == '"' || c == '\'' => open = Some(c),
            None if c == wanted => return Some(at),
            None => {}
        }
        None
    })
}

/// The parts of a text between commas outside of brackets and quotation marks; `None` if one of those is not
/// closed.
pub(crate) fn split_at_commas(text: &str) -> Option<Vec<&str>> {
    let (mut parts, mut from, mut depth, mut open) = (Vec::new(), 0, 0_usize, None);
    for (at, c) in text.char_indices() {
        match (open, c) {
            (Some(quote), c) if c == quote => open = None,
            (Some(_), _) => {}
            (None, '"' | '\'') => open = Some(c),
            (None, '[' | '{' | '(') => depth += 1,
            (None, ']' | '}' | ')') => depth = depth.checked_sub(1)?,
            (None, ',') if depth == 0 => {
                parts.push(text[from..at].trim());
                from = at + 1;
            }
            (None, _) => {}
        }
    }
    parts.push(text[from..].trim());
    (depth == 0 && open.is_none()).then_some(parts)
}
