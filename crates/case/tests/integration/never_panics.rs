//! Checks that the reader answers any text with a case or with messages that can be shown.

use std::path::Path;

use proptest::prelude::*;
use proptest::sample::Index;

const FILES: [&str; 10] = [
    "in-plane-pair.toml",
    "in-plane-pair-by-force.toml",
    "stacked-pair.toml",
    "isolated-cube.toml",
    "cube-in-cube.toml",
    "square-plates.toml",
    "layered-spheres.toml",
    "rounded-pattern.toml",
    "flat-punch.toml",
    "bad/touching-conductors.toml",
];

fn text_of(file: Index) -> String {
    let name = FILES[file.index(FILES.len())];
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/acceptance").join(name);
    std::fs::read_to_string(path).unwrap()
}

/// Reads the text; the places of errors must be inside it, and the errors must render.
fn answer(text: &str) {
    let Err(error) = elastocap_case::parse(text, Path::new("some/case.toml")) else { return };
    assert!(!error.diagnostics().is_empty());
    for diagnostic in error.diagnostics() {
        assert!(!diagnostic.message.is_empty());
        if let Some(span) = &diagnostic.span {
            assert!(span.start <= span.end && span.end <= text.len(), "{diagnostic:?}");
        }
    }
    assert!(error.render(false).contains("error: "));
    assert!(error.render(true).contains("error"));
}

#[derive(Debug, Clone)]
enum Edit {
    FlipByte(Index, u8),
    Truncate(Index),
    SwapLines(Index, Index),
    DropLine(Index),
    RepeatLine(Index, Index),
    ReplaceNumber(Index, String),
    ReplaceValue(Index, String),
}

fn number() -> impl Strategy<Value = String> {
    prop_oneof![
        any::<f64>().prop_map(|v| format!("{v:e}")),
        any::<i64>().prop_map(|v| v.to_string()),
        Just("nan".to_owned()),
        Just("-inf".to_owned()),
        Just("1e999".to_owned()),
        Just("0".to_owned()),
        Just("-0.0".to_owned()),
        Just("1e-320".to_owned()),
        Just("0xffffffffffffffffffffffff".to_owned()),
    ]
}

fn value() -> impl Strategy<Value = String> {
    prop_oneof![
        number(),
        number().prop_map(|n| format!("\"{n} um\"")),
        number().prop_map(|n| format!("[\"{n} m\", \"1 m\", 3]")),
        Just("true".to_owned()),
        Just("1979-05-27".to_owned()),
        Just("[]".to_owned()),
        Just("[[], {}]".to_owned()),
        Just("{}".to_owned()),
        Just("{ from = 0, to = 0.5, points = 3 }".to_owned()),
        Just("\"\"\"\na\nb\"\"\"".to_owned()),
        Just("\"\\u001b[31m\"".to_owned()),
        Just("\"\u{b5}m \u{1f9ea}\"".to_owned()),
        Just("\"rigid\"".to_owned()),
        Just("\"open\"".to_owned()),
        "\\PC{0,12}".prop_map(|s| format!("{s:?}")),
    ]
}

fn edit() -> impl Strategy<Value = Edit> {
    let index = any::<Index>;
    prop_oneof![
        (index(), any::<u8>()).prop_map(|(k, b)| Edit::FlipByte(k, b)),
        index().prop_map(Edit::Truncate),
        (index(), index()).prop_map(|(a, b)| Edit::SwapLines(a, b)),
        index().prop_map(Edit::DropLine),
        (index(), index()).prop_map(|(a, b)| Edit::RepeatLine(a, b)),
        (index(), number()).prop_map(|(k, n)| Edit::ReplaceNumber(k, n)),
        (index(), value()).prop_map(|(k, v)| Edit::ReplaceValue(k, v)),
    ]
}

fn apply(text: &str, edit: &Edit) -> String {
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    if lines.is_empty() || text.is_empty() {
        return text.to_owned();
    }
    match edit {
        Edit::FlipByte(at, with) => {
            let mut bytes = text.as_bytes().to_vec();
            let at = at.index(bytes.len());
            bytes[at] ^= with;
            return String::from_utf8_lossy(&bytes).into_owned();
        }
        Edit::Truncate(at) => {
            return String::from_utf8_lossy(&text.as_bytes()[..at.index(text.len())]).into_owned();
        }
        Edit::SwapLines(a, b) => {
            let (a, b) = (a.index(lines.len()), b.index(lines.len()));
            lines.swap(a, b);
        }
        Edit::DropLine(at) => {
            lines.remove(at.index(lines.len()));
        }
        Edit::RepeatLine(from, to) => {
            let line = lines[from.index(lines.len())].clone();
            lines.insert(to.index(lines.len()), line);
        }
        Edit::ReplaceNumber(at, with) => {
            let digits: Vec<_> = text.match_indices(|c: char| c.is_ascii_digit()).map(|(k, _)| k).collect();
            if digits.is_empty() {
                return text.to_owned();
            }
            let start = digits[at.index(digits.len())];
            let rest = text[start..].trim_start_matches(|c: char| c.is_ascii_digit() || c == '.');
            return format!("{}{with}{rest}", &text[..start]);
        }
        Edit::ReplaceValue(at, with) => {
            let at = at.index(lines.len());
            if let Some((key, _)) = lines[at].split_once('=') {
                lines[at] = format!("{key}= {with}");
            }
        }
    }
    lines.join("\n")
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1500, ..ProptestConfig::default() })]

    #[test]
    fn a_damaged_case_file_is_read_or_refused(
        file in any::<Index>(),
        edits in prop::collection::vec(edit(), 1..6),
    ) {
        let text = edits.iter().fold(text_of(file), |text, edit| apply(&text, edit));
        answer(&text);
    }

    #[test]
    fn any_text_at_all_is_read_or_refused(text in "\\PC{0,200}") {
        answer(&text);
    }

    #[test]
    fn any_value_for_any_key_is_read_or_refused(
        table in prop::sample::select(vec![
            "", "layer", "layer.material.mooney_rivlin", "electrodes.stacked_pair", "load", "surroundings",
            "surroundings.above", "electrostatics", "[conductor]", "[dielectric]",
        ]),
        key in prop::sample::select(vec![
            "format", "title", "thickness", "c10", "gap", "height", "compression", "force", "boundary", "walls",
            "above", "box", "sheet", "slab", "name", "relative_tolerance", "bounds", "charge", "layer", "conductor",
        ]),
        value in value(),
    ) {
        let header = if table.is_empty() { String::new() } else { format!("[{table}]\n") };
        answer(&format!("{header}{key} = {value}\n"));
        answer(&format!("format = 1\n{header}{key} = {value}"));
    }
}

#[test]
fn a_quantity_written_with_any_prefix_reads_as_its_decimal() {
    for (prefix, power) in
        [("", 0), ("m", -3), ("u", -6), ("\u{b5}", -6), ("\u{3bc}", -6), ("n", -9), ("k", 3)]
    {
        for number in ["1", "0.3", "450", "7.25", "123.456"] {
            let text = format!(
                "format = 1\n[[conductor]]\nname = \"a\"\nsheet = {{ normal = \"x1\", at = \"{number}{prefix}m\", \
                 min = [\"0 m\", \"0 m\"], max = [\"1 m\", \"1 m\"] }}\n[surroundings]\nboundary = \"open\"\n"
            );
            let case = elastocap_case::parse(&text, Path::new("a.toml")).unwrap_or_else(|e| panic!("{e}"));
            let expected: f64 = format!("{number}e{power}").parse().unwrap();
            assert_eq!(case.bodies[0].bounds().unwrap().min[0], expected);
        }
    }
}
