//! Names of files and folders for results.

use std::path::{Component, Path};

/// The longest name, bytes: additions to it must still fit into the 255 bytes of a file name.
const LONGEST: usize = 120;

/// The name used if nothing is left of the name of a case.
const NAMELESS: &str = "case";

/// Endings of folders that elastocap makes beside results.
const RESERVED: [&str; 3] = [".partial", "-mesh", "-sweep"];

/// The name of the folder for the results of the case in `file`, by this rule:
///
/// 1. The name of the file is taken without its folder and without its last ending.
/// 2. Each of `/ \ : * ? " < > |`, each control character and each invisible mark that turns or joins text
///    becomes `_`.
/// 3. Dots and spaces at both ends are dropped; where nothing is left, the name is `case`.
/// 4. A name that Windows keeps for a device (`con`, `nul`, `com1` and so on, whatever follows after a dot)
///    gets a `_` before its first dot or at its end. A name that ends in `.partial`, `-mesh` or `-sweep`, as
///    other folders beside results do, gets a `_` at its end.
/// 5. A name of more than 120 bytes is cut, and a number made of all of it is added.
///
/// The result is a single name: it never leads to another folder, is not hidden, and is valid on every
/// system.
pub fn result_name(file: &Path) -> String {
    let stem = file.file_stem().unwrap_or_default().to_string_lossy();
    let plain: String = stem.chars().map(|c| if is_unfit(c) { '_' } else { c }).collect();
    let mut name = plain.trim_matches(['.', ' ']).to_owned();
    if name.is_empty() {
        name.push_str(NAMELESS);
    }
    let first = name.find('.').unwrap_or(name.len());
    if is_device(&name[..first]) {
        name.insert(first, '_');
    }
    let lower = name.to_lowercase();
    if RESERVED.iter().any(|ending| lower.ends_with(ending)) {
        name.push('_');
    }
    if name.len() > LONGEST {
        let number = format!("-{:016x}", checksum(&stem));
        while name.len() + number.len() > LONGEST {
            name.pop();
        }
        name.push_str(&number);
    }
    name
}

/// Whether a text is the name of a file or folder and not a path, so that it does not lead out of the folder
/// that it is joined to.
pub fn is_plain_name(name: &str) -> bool {
    let mut parts = Path::new(name).components();
    let is_one = matches!(parts.next(), Some(Component::Normal(part)) if part == name);
    is_one && parts.next().is_none()
}

fn is_unfit(c: char) -> bool {
    let is_invisible = matches!(
        c,
        '\u{ad}' | '\u{61c}' | '\u{180e}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}' | '\u{feff}'
    );
    c.is_control() || is_invisible || r#"/\:*?"<>|"#.contains(c)
}

/// Whether Windows treats a name as that of a device.
fn is_device(name: &str) -> bool {
    let name = name.trim_end().to_lowercase();
    if ["con", "prn", "aux", "nul", "conin$", "conout$"].contains(&name.as_str()) {
        return true;
    }
    let number = name.strip_prefix("com").or_else(|| name.strip_prefix("lpt"));
    number.is_some_and(|number| {
        let mut digits = number.chars();
        matches!(digits.next(), Some('0'..='9' | '\u{b9}' | '\u{b2}' | '\u{b3}')) && digits.next().is_none()
    })
}

/// Fowler, Noll and Vo's hash, of 64 bits: the same on every machine.
fn checksum(text: &str) -> u64 {
    text.bytes()
        .fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_name_of_a_result_is_that_of_its_case_and_never_leads_elsewhere() {
        for (file, expected) in [
            ("a/x.toml", "x"),
            ("y", "y"),
            ("x.tar.toml", "x.tar"),
            ("Größe 2.toml", "Größe 2"),
            ("a..b.toml", "a..b"),
            ("...toml", "case"),
            ("..toml", "case"),
            ("....toml", "case"),
            (".. .toml", "case"),
            (".toml", "toml"),
            ("..", "case"),
            ("", "case"),
            (".hidden.toml", "hidden"),
            ("x. .toml", "x"),
            (" x .toml", "x"),
            ("a\nb\tc\u{7f}\u{202e}.toml", "a_b_c__"),
            ("c:d*e?.toml", "c_d_e_"),
            ("a\\..\\b.toml", "a_.._b"),
            ("CON.toml", "CON_"),
            ("nul.x.toml", "nul_.x"),
            ("com1.toml", "com1_"),
            ("LPT\u{b9}.toml", "LPT\u{b9}_"),
            ("com10.toml", "com10"),
            ("console.toml", "console"),
            ("x.partial.toml", "x.partial_"),
            ("x-sweep.toml", "x-sweep_"),
        ] {
            let name = result_name(Path::new(file));
            assert_eq!(name, expected, "{file:?}");
            assert!(is_plain_name(&name), "{file:?}");
        }
    }

    #[test]
    fn a_long_name_is_cut_and_still_told_from_another_one() {
        let name_with = |last: &str| result_name(Path::new(&format!("{}{last}.toml", "ä".repeat(120))));
        let (one, other) = (name_with("1"), name_with("2"));
        assert!(one != other && one.len() <= LONGEST && one.starts_with("ää"), "{one} {other}");
        assert_eq!(one, name_with("1"));
    }

    #[test]
    fn a_path_is_no_plain_name() {
        for name in ["", ".", "..", "/", "/a", "a/", "a/b", "../a", "./a"] {
            assert!(!is_plain_name(name), "{name:?}");
        }
        assert!(["a", ".a", "a.b", "..a"].into_iter().all(is_plain_name));
    }
}
