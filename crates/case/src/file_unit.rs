//! The length of one unit of an imported file: `"mm"`, or with a number, `"25.4 mm"`.

use serde_json::{Value, json};
use toml::Spanned;
use toml::de::DeValue;

use super::diagnostics::{Diagnostic, shown};
use super::quantities::Size;
use super::reader::{FromToml, Log, Node};
use super::units;

/// A positive length, which may be written as its unit alone.
#[derive(Debug)]
pub(super) struct FileUnit {
    /// The length, m.
    pub(super) si: f64,
}

impl FromToml for FileUnit {
    fn expected() -> String {
        "a unit of length such as \"mm\", or a length such as \"25.4 mm\"".to_owned()
    }

    fn sample(log: &Log<'_>) -> String {
        format!("\"{}\"", log.usual_unit(units::LENGTH).unwrap_or("mm"))
    }

    fn accepts(value: &DeValue<'_>) -> bool {
        Size::accepts(value)
    }

    fn mended(value: &Spanned<DeValue<'_>>, log: &Log<'_>) -> Option<String> {
        Size::mended(value, log)
    }

    fn from_toml(node: Node<'_>, log: &mut Log<'_>) -> Option<Self> {
        let bare = node.value.get_ref().as_str().filter(|text| units::split_number(text.trim()).0.is_empty());
        let Some(text) = bare else { return Size::from_toml(node, log).map(|size| Self { si: size.si }) };
        let one = format!("1 {text}");
        if let Some(unit) = units::parse(&one).ok().filter(|q| q.dimension == units::LENGTH) {
            return Some(Self { si: unit.si });
        }
        let nearest = units::nearest_unit(text.trim(), units::LENGTH).map(|unit| format!("\"{unit}\""));
        let suggestion = nearest.unwrap_or_else(|| Self::sample(log));
        log.push(
            Diagnostic::at(
                &node.span(),
                format!("{}: expected {}, found \"{}\"", node.place(), Self::expected(), shown(text)),
            )
            .label("no unit of length")
            .help(format!("write for example {}", node.assign(&suggestion))),
        );
        None
    }

    fn schema() -> Value {
        let unit = units::pattern(units::LENGTH);
        json!({
            "type": "string",
            "pattern": format!("^\\s*(\\+?([0-9]+\\.?[0-9]*|\\.[0-9]+)([eE][+-]?[0-9]+)?)?\\s*{unit}\\s*$"),
            "examples": ["mm"],
        })
    }
}
