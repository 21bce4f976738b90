//! Text and numbers in SVG.

use std::fmt::Write as _;

use super::axis::Text;

/// Hundredths of a unit are finer than any screen, and the same bytes everywhere.
pub(super) fn coordinate(value: f64) -> String {
    let text = format!("{value:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}

pub(super) fn markup(text: &Text) -> String {
    let mut out = escape(&text.base);
    if !text.raised.is_empty() {
        let _ = write!(out, "<tspan dy=\"-0.4em\" font-size=\"75%\">{}</tspan>", escape(&text.raised));
        if !text.rest.is_empty() {
            // Back down: em is of the smaller size above, hence 0.4 x 0.75.
            let _ = write!(out, "<tspan dy=\"0.3em\">{}</tspan>", escape(&text.rest));
        }
    }
    out
}

/// For element content and attributes; what XML cannot hold at all becomes a space.
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

pub(super) fn width(text: &Text, size: f64) -> f64 {
    text_width(&text.base, size) + text_width(&text.rest, size) + 0.75 * text_width(&text.raised, size)
}

/// An estimate on the wide side of the common sans-serif fonts, for nobody knows which one the reader has.
pub(super) fn text_width(text: &str, size: f64) -> f64 {
    let of = |c: char| match c {
        'i' | 'j' | 'l' | 't' | 'f' | 'I' | '.' | ',' | ':' | ';' | '|' | '\'' | '!' | '(' | ')' | '['
        | ']' | ' ' => 0.36,
        'm' | 'w' | 'M' | 'W' | '@' | '%' => 0.95,
        'A'..='Z' | '=' | '+' | '\u{2212}' | '\u{d7}' => 0.7,
        c if (c as u32) >= 0x2e80 => 1.0,
        _ => 0.6,
    };
    size * text.chars().map(of).sum::<f64>()
}

/// Lines no wider than the room, broken at spaces; at most three, the last cut short if need be.
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
