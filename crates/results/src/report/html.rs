//! Pieces of HTML, with everything that comes from a case escaped.

use std::fmt::Write as _;

use crate::typeset::{percent, typeset};
use elastocap_coupling::words::prefixed;
use serde_json::Value;

/// Text escaped for element content and for attribute values in double quotes; characters that HTML does not
/// allow become spaces.
pub(super) fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len() + 8);
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            '\n' | '\t' => out.push(c),
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => out.push(' '),
            c => out.push(c),
        }
    }
    out
}

/// JSON as the content of a script element: nothing in it can end the element or begin a comment.
pub(super) fn json_in_script(value: &Value) -> String {
    let text = value.to_string();
    if text.contains(['<', '>', '&', '\u{2028}', '\u{2029}']) {
        // In JSON these stand only inside strings, where escapes are allowed.
        return text
            .replace('<', "\\u003c")
            .replace('>', "\\u003e")
            .replace('&', "\\u0026")
            .replace('\u{2028}', "\\u2028")
            .replace('\u{2029}', "\\u2029");
    }
    text
}

/// The number of decimals with which a number has so many significant digits.
fn places_of(value: f64, digits: usize) -> usize {
    let exponent = if value > 0.0 { value.log10().floor() } else { 0.0 };
    (digits as f64 - 1.0 - exponent).clamp(0.0, 12.0) as usize
}

/// A column of numbers in one unit, so that they line up: the unit with the prefix that suits the largest
/// number, and the numbers with as many decimals as give that one `digits` significant digits.
pub(super) fn column(values: &[Option<f64>], digits: usize, unit: &str) -> (String, Vec<String>) {
    let finite = || values.iter().flatten().filter(|v| v.is_finite());
    let largest = finite().fold(0.0_f64, |m, v| m.max(v.abs()));
    // A number without a unit has no prefix either.
    let shown = match unit {
        "" => format!("{largest:.*}", places_of(largest, digits)),
        _ => prefixed(largest, digits, unit),
    };
    let (number, unit_shown) = shown.split_once(' ').unwrap_or((shown.as_str(), unit));
    let places = number.split_once('.').map_or(0, |(_, places)| places.len());
    let scale = match number.parse::<f64>() {
        Ok(n) if n > 0.0 && largest > 0.0 => 10_f64.powf((largest / n).log10().round()),
        _ => 1.0,
    };
    let cell = |value: &Option<f64>| match value {
        Some(v) if v.is_finite() => typeset(&format!("{:.places$}", v / scale + 0.0)),
        Some(_) | None => "\u{2013}".to_owned(),
    };
    let unit = match unit_shown.strip_prefix('u') {
        Some(rest) if !rest.is_empty() => format!("\u{b5}{rest}"),
        _ => unit_shown.to_owned(),
    };
    (unit, values.iter().map(cell).collect())
}

/// A table under construction.
#[derive(Debug, Default)]
pub(super) struct Table {
    caption: String,
    head: Vec<String>,
    /// The positions of the columns that hold words; all others hold numbers.
    words: Vec<usize>,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// A table with a caption in plain text.
    pub(super) fn new(caption: &str) -> Self {
        Self { caption: caption.to_owned(), ..Self::default() }
    }

    /// Adds a column of numbers.
    pub(super) fn numbers(&mut self, head: &str, cells: Vec<String>) {
        self.head.push(head.to_owned());
        self.fill(cells);
    }

    /// Adds a column of numbers in one unit, unless none is known.
    pub(super) fn quantities(&mut self, head: &str, values: &[Option<f64>], digits: usize, unit: &str) {
        if values.iter().any(Option::is_some) {
            let (unit, cells) = column(values, digits, unit);
            let head = if unit.is_empty() { head.to_owned() } else { format!("{head} ({unit})") };
            self.numbers(&head, cells);
        }
    }

    /// Adds a column of shares as percent, unless none is known.
    pub(super) fn shares(&mut self, head: &str, values: &[Option<f64>]) {
        if values.iter().any(Option::is_some) {
            let cell = |v: &Option<f64>| v.map_or_else(|| "\u{2013}".to_owned(), percent);
            self.numbers(head, values.iter().map(cell).collect());
        }
    }

    /// Adds a column of words.
    pub(super) fn words(&mut self, head: &str, cells: Vec<String>) {
        self.words.push(self.head.len());
        self.numbers(head, cells);
    }

    fn fill(&mut self, cells: Vec<String>) {
        self.rows.resize_with(self.rows.len().max(cells.len()), Vec::new);
        for (row, cell) in self.rows.iter_mut().zip(cells) {
            row.push(cell);
        }
    }

    /// The table in a box that scrolls where it is too wide. The first cell of each row is its head.
    pub(super) fn html(&self) -> String {
        let caption = escape(&self.caption);
        let mut out = format!(
            "<div class=\"scroll\" role=\"region\" aria-label=\"{caption}\" tabindex=\"0\"><table><caption>{caption}</caption>\n<thead><tr>"
        );
        let class = |k: usize| if self.words.contains(&k) { " class=\"words\"" } else { "" };
        for (k, head) in self.head.iter().enumerate() {
            let _ = write!(out, "<th scope=\"col\"{}>{}</th>", class(k), escape(head));
        }
        out.push_str("</tr></thead>\n<tbody>\n");
        for row in &self.rows {
            out.push_str("<tr>");
            for (k, cell) in row.iter().enumerate() {
                let cell = escape(cell);
                let _ = match k {
                    0 => write!(out, "<th scope=\"row\"{}>{cell}</th>", class(k)),
                    _ => write!(out, "<td{}>{cell}</td>", class(k)),
                };
            }
            out.push_str("</tr>\n");
        }
        out.push_str("</tbody></table></div>\n");
        out
    }
}

/// A section of the page with its heading; `id` is a plain word.
pub(super) fn section(id: &str, heading: &str, body: &str) -> String {
    format!(
        "<section id=\"{id}\" aria-labelledby=\"{id}-heading\">\n<h2 id=\"{id}-heading\">{}</h2>\n{body}</section>\n",
        escape(heading)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_from_a_case_can_end_neither_an_element_nor_a_script() {
        let hostile = "</script><script>alert(1)</script><!-- \" onload='x' & \u{2028}";
        let escaped = escape(hostile);
        assert!(!escaped.contains(['<', '>', '"', '\'']), "{escaped}");
        let value = serde_json::json!({ "title": hostile });
        let script = json_in_script(&value);
        assert!(!script.contains(['<', '>', '&', '\u{2028}']), "{script}");
        assert_eq!(serde_json::from_str::<Value>(&script).unwrap(), value);
    }

    #[test]
    fn numbers_of_a_column_have_one_unit_and_as_many_places() {
        let values = [Some(43.9661e-15), Some(-9.5e-15), None, Some(0.0)];
        let (unit, cells) = column(&values, 4, "F");
        assert_eq!(
            (unit.as_str(), cells),
            ("fF", ["43.97", "\u{2212}9.50", "\u{2013}", "0.00"].map(str::to_owned).to_vec())
        );
        assert_eq!(column(&[Some(50e-6)], 3, "m").0, "\u{b5}m");
        assert_eq!(column(&[Some(0.1)], 3, "").1, ["0.100"]);
    }
}
