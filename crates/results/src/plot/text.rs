//! Text and numbers in SVG.

use std::fmt::Write as _;

use super::axis::Text;

/// A coordinate rounded to hundredths of a unit: finer than any screen, and the same bytes on every system.
pub(super) fn coordinate(value: f64) -> String {
    let text = format!("{value:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}

/// The SVG markup of a text, with its raised part.
pub(super) fn markup(text: &Text) -> String {
    let mut out = escape(&text.base);
    if !text.raised.is_empty() {
        let _ = write!(out, "<tspan dy=\"-0.4em\" font-size=\"75%\">{}</tspan>", escape(&text.raised));
        if !text.rest.is_empty() {
            // Back to the baseline: em refers to the smaller size of the raised text, hence 0.4 x 0.75.
            let _ = write!(out, "<tspan dy=\"0.3em\">{}</tspan>", escape(&text.rest));
        }
    }
    out
}

/// Text escaped for element content and attributes; characters that XML does not allow become spaces.
pub(super) fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => out.push(' '),
            c => out.push(c),
        }
    }
    out
}

/// The estimated width of a text with its raised part.
pub(super) fn width(text: &Text, size: f64) -> f64 {
    text_width(&text.base, size) + text_width(&text.rest, size) + 0.75 * text_width(&text.raised, size)
}

/// The width of a text, estimated on the wide side, since the font of the reader is not known.
pub(super) fn text_width(text: &str, size: f64) -> f64 {
    let width_of = |c: char| match c {
        'i' | 'j' | 'l' | 't' | 'f' | 'I' | '.' | ',' | ':' | ';' | '|' | '\'' | '!' | '(' | ')' | '['
        | ']' | ' ' => 0.36,
        'm' | 'w' | 'M' | 'W' | '@' | '%' => 0.95,
        'A'..='Z' | '=' | '+' | '\u{2212}' | '\u{d7}' => 0.7,
        c if (c as u32) >= 0x2e80 => 1.0,
        _ => 0.6,
    };
    size * text.chars().map(width_of).sum::<f64>()
}

/// The text in at most three lines no wider than `room`, broken at spaces; the last line is cut short if
/// necessary.
pub(super) fn wrapped(text: &str, room: f64, size: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            // Bold letters are wider.
            Some(line) if 1.08 * text_width(&format!("{line} {word}"), size) <= room => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    let cut = lines.len() > 3;
    lines.truncate(3);
    let count = lines.len();
    for (i, line) in lines.iter_mut().enumerate() {
        let too_long = |line: &str| 1.08 * text_width(line, size) > room;
        if too_long(line) || (cut && i + 1 == count) {
            while too_long(&format!("{line}\u{2026}")) && line.pop().is_some() {}
            line.push('\u{2026}');
        }
    }
    lines
}
