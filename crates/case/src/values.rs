//! Values of a case file that are not quantities: texts, counts, flags, arrays, and alternatives of two
//! types.

use std::ops::RangeInclusive;

use serde_json::{Value, json};
use toml::Spanned;
use toml::de::DeValue;

use super::diagnostics::{Diagnostic, shown};
use super::quantities::UNIT_MEANT;
use super::reader::{FromToml, Log, Node, Read};

/// The number of the file format that this version reads.
const FORMAT: i64 = 1;

/// The largest count, for example of load steps in one case.
const MAX_COUNT: i64 = 100_000;

/// The value of a TOML integer that fits into an `i64`.
fn integer(value: &DeValue<'_>) -> Option<i64> {
    match value {
        DeValue::Integer(integer) => i64::from_str_radix(integer.as_str(), integer.radix()).ok(),
        _ => None,
    }
}

/// A whole number in the range; `wrong` gives the message for any other.
fn whole_number<T: FromToml, N: TryFrom<i64>>(
    node: Node<'_>,
    log: &mut Log<'_>,
    range: RangeInclusive<i64>,
    wrong: impl FnOnce() -> Diagnostic,
) -> Option<N> {
    if !T::accepts(node.value.get_ref()) {
        log.wrong_type::<T>(node);
        return None;
    }
    let number =
        integer(node.value.get_ref()).filter(|n| range.contains(n)).and_then(|n| N::try_from(n).ok());
    if number.is_none() {
        log.push(wrong());
    }
    number
}

/// The number of the file format, which has been checked.
#[derive(Debug, Clone, Copy)]
pub(super) struct FormatNumber;

impl FromToml for FormatNumber {
    fn expected() -> String {
        format!("the number of the file format, {FORMAT}")
    }
    fn sample(_: &Log<'_>) -> String {
        FORMAT.to_string()
    }
    fn accepts(value: &DeValue<'_>) -> bool {
        matches!(value, DeValue::Integer(_))
    }
    fn from_toml(node: Node<'_>, log: &mut Log<'_>) -> Option<Self> {
        if !Self::accepts(node.value.get_ref()) {
            log.wrong_type::<Self>(node);
            return None;
        }
        let version = env!("CARGO_PKG_VERSION");
        match integer(node.value.get_ref()) {
            Some(FORMAT) => Some(Self),
            Some(older) if older < FORMAT => {
                log.push(
                    Diagnostic::at(&node.span(), format!("there is no case format {older}"))
                        .label(format!("this version of elastocap ({version}) reads format {FORMAT}"))
                        .help(format!("write {}", node.assign("1"))),
                );
                None
            }
            _ => {
                // Only this is reported: what are errors here may be valid in the newer format.
                log.push_sole(
                    Diagnostic::at(&node.span(), "this case file is written for a newer elastocap")
                        .label(format!("this version ({version}) reads format {FORMAT}"))
                        .help(format!(
                            "update elastocap, or write the case in format {FORMAT}: {}",
                            node.assign("1")
                        )),
                );
                None
            }
        }
    }
    fn schema() -> Value {
        json!({ "const": FORMAT })
    }
}

/// A line of text, such as a title, a name or a path.
#[derive(Debug, Clone)]
pub(super) struct Text(pub(super) String);

impl FromToml for Text {
    fn expected() -> String {
        "a line of text in quotes".to_owned()
    }
    fn sample(_: &Log<'_>) -> String {
        "\"...\"".to_owned()
    }
    fn accepts(value: &DeValue<'_>) -> bool {
        matches!(value, DeValue::String(_))
    }
    fn mended(value: &Spanned<DeValue<'_>>, _: &Log<'_>) -> Option<String> {
        match value.get_ref() {
            DeValue::Integer(integer) => Some(format!("\"{integer}\"")),
            DeValue::Float(float) => Some(format!("\"{float}\"")),
            _ => None,
        }
    }
    fn from_toml(node: Node<'_>, log: &mut Log<'_>) -> Option<Self> {
        let Some(text) = node.value.get_ref().as_str() else {
            log.wrong_type::<Self>(node);
            return None;
        };
        let reordering = text.chars().any(reorders_text);
        if text.trim().is_empty() || reordering || text.chars().any(char::is_control) {
            let what = match (text.trim().is_empty(), reordering) {
                (true, _) => "empty",
                (false, true) => "characters in it that change the direction of writing",
                (false, false) => "control characters in it",
            };
            log.push(
                Diagnostic::at(&node.span(), format!("{} must be a line of text", node.place())).label(what),
            );
            return None;
        }
        Some(Self(text.to_owned()))
    }
    fn schema() -> Value {
        json!({ "type": "string", "pattern": "\\S" })
    }
}

/// Whether a character is one of Unicode's marks for the direction of writing. They are invisible, but change
/// the order in which the text around them is shown, so that one name looks like another.
fn reorders_text(c: char) -> bool {
    matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// The order of potentials on tetrahedra.
#[derive(Debug, Clone, Copy)]
pub(super) struct PotentialOrder(pub(super) u8);

impl FromToml for PotentialOrder {
    fn expected() -> String {
        "a whole number such as 2".to_owned()
    }
    fn sample(_: &Log<'_>) -> String {
        "2".to_owned()
    }
    fn accepts(value: &DeValue<'_>) -> bool {
        matches!(value, DeValue::Integer(_))
    }
    fn from_toml(node: Node<'_>, log: &mut Log<'_>) -> Option<Self> {
        let wrong = || {
            Diagnostic::at(&node.span(), format!("{} must be 1, 2 or 3", node.place()))
                .label("the order of the potentials")
                .help("leave it out for 2, the best at edges")
        };
        whole_number::<Self, u8>(node, log, 1..=3, wrong).map(Self)
    }
    fn schema() -> Value {
        json!({ "type": "integer", "minimum": 1, "maximum": 3 })
    }
}

/// A count of at least one: of load steps, or of parts of an electrode.
#[derive(Debug, Clone, Copy)]
pub(super) struct Count(pub(super) u32);

impl FromToml for Count {
    fn expected() -> String {
        "a whole number such as 9".to_owned()
    }
    fn sample(_: &Log<'_>) -> String {
        "9".to_owned()
    }
    fn accepts(value: &DeValue<'_>) -> bool {
        matches!(value, DeValue::Integer(_))
    }
    fn from_toml(node: Node<'_>, log: &mut Log<'_>) -> Option<Self> {
        let wrong = || {
            Diagnostic::at(&node.span(), format!("{} must be between 1 and {MAX_COUNT}", node.place()))
                .label("not in this range")
                .help(format!("write for example {}", node.assign("9")))
        };
        whole_number::<Self, u32>(node, log, 1..=MAX_COUNT, wrong).map(Self)
    }
    fn schema() -> Value {
        json!({ "type": "integer", "minimum": 1, "maximum": MAX_COUNT })
    }
}

/// `true` or `false`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Flag(pub(super) bool);

impl FromToml for Flag {
    fn expected() -> String {
        "true or false".to_owned()
    }
    fn sample(_: &Log<'_>) -> String {
        "true".to_owned()
    }
    fn accepts(value: &DeValue<'_>) -> bool {
        matches!(value, DeValue::Boolean(_))
    }
    fn mended(value: &Spanned<DeValue<'_>>, _: &Log<'_>) -> Option<String> {
        value.get_ref().as_str()?.trim().to_lowercase().parse::<bool>().ok().map(|flag| flag.to_string())
    }
    fn from_toml(node: Node<'_>, log: &mut Log<'_>) -> Option<Self> {
        let flag = node.value.get_ref().as_bool();
        if flag.is_none() {
            log.wrong_type::<Self>(node);
        }
        flag.map(Self)
    }
    fn schema() -> Value {
        json!({ "type": "boolean" })
    }
}

/// One of two types, distinguished by the TOML type of the value.
#[derive(Debug)]
pub(super) enum Either<A, B> {
    First(A),
    Second(B),
}

impl<A: FromToml, B: FromToml> FromToml for Either<A, B> {
    fn expected() -> String {
        [A::expected(), B::expected()].into_iter().filter(|s| !s.is_empty()).collect::<Vec<_>>().join(" or ")
    }
    fn sample(log: &Log<'_>) -> String {
        if A::expected().is_empty() { B::sample(log) } else { A::sample(log) }
    }
    fn accepts(value: &DeValue<'_>) -> bool {
        A::accepts(value) || B::accepts(value)
    }
    fn mended(value: &Spanned<DeValue<'_>>, log: &Log<'_>) -> Option<String> {
        if Self::accepts(value.get_ref()) {
            return None;
        }
        A::mended(value, log).or_else(|| B::mended(value, log))
    }
    fn from_toml(node: Node<'_>, log: &mut Log<'_>) -> Option<Self> {
        let value = node.value.get_ref();
        if A::accepts(value) {
            A::from_toml(node, log).map(Self::First)
        } else if B::accepts(value) {
            let before = log.len();
            let read = B::from_toml(node, log).map(Self::Second);
            // The help for a text that is of neither type says what the first type expects, too.
            if let (None, DeValue::String(_), false) = (&read, value, A::expected().is_empty())
                && log.len() > before
                && let Some(help) = log.last_mut().and_then(|last| last.help.as_mut())
            {
                help.push_str(&format!(", or {}", A::expected()));
            }
            read
        } else {
            log.wrong_type::<Self>(node);
            None
        }
    }
    fn schema() -> Value {
        let alternatives = [A::schema(), B::schema()].into_iter().filter(|s| *s != Value::Bool(false));
        json!({ "anyOf": alternatives.collect::<Vec<_>>() })
    }
}

/// Reads the entries of an array. Entries of a wrong type whose right form can be guessed are reported once,
/// with the whole line as it should be.
fn entries<'a, T: FromToml>(node: Node<'a>, log: &mut Log<'_>) -> Option<Vec<Read<T>>> {
    let items = node.value.get_ref().as_array()?;
    let mended: Vec<_> = items.iter().map(|item| T::mended(item, log)).collect();
    let line = |log: &Log<'_>| {
        let texts: Vec<_> = items
            .iter()
            .zip(&mended)
            .map(|(item, mended)| mended.clone().unwrap_or_else(|| log.text(&item.span()).to_owned()))
            .collect();
        node.assign(&format!("[{}]", texts.join(", ")))
    };
    let mut is_reported = false;
    let mut reads = Vec::with_capacity(items.len());
    for (item, mended) in items.iter().zip(&mended) {
        if log.is_full() || (is_reported && mended.is_some()) {
            reads.push(Read { span: item.span(), value: None });
            continue;
        }
        reads.push(Read::from_node(Node { value: item, entry: true, ..node }, log));
        if mended.is_some() && items.len() <= 8 {
            let line = line(log);
            if let Some(help) = log.last_mut().and_then(|last| last.help.as_mut()) {
                let unit =
                    if help.contains(UNIT_MEANT) { ", or with another unit, whichever is meant" } else { "" };
                *help = format!("write {line}{unit}");
            }
        }
        is_reported |= mended.is_some();
    }
    Some(reads)
}

impl<T: FromToml> FromToml for Vec<Read<T>> {
    fn expected() -> String {
        format!("an array, of which each entry is {}", T::expected())
    }
    fn sample(log: &Log<'_>) -> String {
        format!("[{}]", T::sample(log))
    }
    fn accepts(value: &DeValue<'_>) -> bool {
        matches!(value, DeValue::Array(_))
    }
    fn mended(value: &Spanned<DeValue<'_>>, log: &Log<'_>) -> Option<String> {
        // A value that is an array already is not wrapped, even where entries may be arrays themselves.
        let is_array_of_entries = value
            .get_ref()
            .as_array()
            .is_some_and(|items| items.iter().all(|item| T::accepts(item.get_ref())));
        let as_written = || {
            (!is_array_of_entries && T::accepts(value.get_ref())).then(|| log.text(&value.span()).to_owned())
        };
        T::mended(value, log).or_else(as_written).map(|entry| format!("[{entry}]"))
    }
    fn from_toml(node: Node<'_>, log: &mut Log<'_>) -> Option<Self> {
        let reads = entries(node, log);
        match node.value.get_ref() {
            _ if reads.is_some() => {}
            DeValue::Table(_) => log.push(
                Diagnostic::at(&node.span(), format!("{}: there may be several", node.place()))
                    .label("a single table")
                    .help(format!("write the header in double brackets: `[[{}]]`", node.path())),
            ),
            _ => log.wrong_type::<Self>(node),
        }
        reads
    }
    fn schema() -> Value {
        json!({ "type": "array", "items": T::schema() })
    }
}

impl<T: FromToml, const N: usize> FromToml for [Read<T>; N] {
    fn expected() -> String {
        format!("an array of {N}, each {}", T::expected())
    }
    fn sample(log: &Log<'_>) -> String {
        format!("[{}]", vec![T::sample(log); N].join(", "))
    }
    fn accepts(value: &DeValue<'_>) -> bool {
        matches!(value, DeValue::Array(_))
    }
    fn from_toml(node: Node<'_>, log: &mut Log<'_>) -> Option<Self> {
        let Some(items) = node.value.get_ref().as_array() else {
            log.wrong_type::<Self>(node);
            return None;
        };
        if items.len() != N {
            let sample = Self::sample(log);
            log.push(
                Diagnostic::at(
                    &node.span(),
                    format!("{} must have {N} entries, it has {}", node.place(), items.len()),
                )
                .label(shown(&Self::expected()))
                .help(format!("write for example {}", node.assign(&sample))),
            );
            return None;
        }
        entries(node, log)?.try_into().ok()
    }
    fn schema() -> Value {
        json!({ "type": "array", "items": T::schema(), "minItems": N, "maxItems": N })
    }
}
