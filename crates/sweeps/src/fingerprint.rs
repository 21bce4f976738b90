//! The fingerprint of a sweep, made from all inputs of its results, so that results of different sweeps are
//! never mixed.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::{self, Read as _};
use std::path::Path;

use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};

use crate::design::CaseValues;

/// The program that solves the cases.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Program {
    /// The version.
    pub version: String,
    /// The SHA-256 of its file, in hexadecimal digits, which distinguishes builds.
    pub build: String,
}

impl Program {
    /// The program that this process runs.
    ///
    /// # Errors
    /// An error if the file of the program cannot be found or read.
    pub fn of_this_process() -> io::Result<Self> {
        Self::of_file(&std::env::current_exe()?)
    }

    /// The program in a file: an executable, or the library that a process has loaded.
    ///
    /// # Errors
    /// An error if the file cannot be read.
    pub fn of_file(file: &Path) -> io::Result<Self> {
        Ok(Self { version: env!("CARGO_PKG_VERSION").to_owned(), build: sha256_of_file(file)? })
    }
}

/// The inputs that the results of a sweep depend on. Everything but the version is a SHA-256 in hexadecimal
/// digits, or a map to them.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fingerprint {
    /// The version of the program.
    pub version: String,
    /// The build of the program.
    pub build: String,
    /// The text of the case file.
    pub case: String,
    /// The files that the case names, with any of the values; `missing` for files that do not exist.
    pub files: BTreeMap<String, String>,
    /// The keys and the values of all cases.
    pub values: String,
    /// The other settings that the numbers depend on.
    pub settings: String,
}

impl Fingerprint {
    /// The SHA-256 of the whole fingerprint.
    pub fn digest(&self) -> String {
        // A map sorted by keys, and plain texts: the same on every machine.
        sha256(&serde_json::to_vec(self).unwrap_or_default())
    }

    /// The parts that differ, in words that complete "it has been made with".
    pub fn differences(&self, other: &Self) -> Vec<String> {
        let mut found = Vec::new();
        if self.version != other.version {
            found.push(format!("version {} of elastocap instead of {}", other.version, self.version));
        } else if self.build != other.build {
            found.push("another build of elastocap".to_owned());
        }
        if self.case != other.case {
            found.push("another text of the case file".to_owned());
        }
        let names =
            self.files.keys().chain(other.files.keys().filter(|name| !self.files.contains_key(*name)));
        for name in names {
            if self.files.get(name) != other.files.get(name) {
                found.push(format!("another content of `{name}`"));
            }
        }
        if self.values != other.values {
            found.push("other values (--set, --list, --random, --seed)".to_owned());
        }
        if self.settings != other.settings {
            found.push("other settings (--no-prune)".to_owned());
        }
        found
    }
}

/// SHA-256 of keys and values.
pub(crate) fn digest_of_values(keys: &[String], cases: &[CaseValues]) -> String {
    sha256(&serde_json::to_vec(&(keys, cases)).unwrap_or_default())
}

/// SHA-256 in hexadecimal digits.
pub(crate) fn sha256(bytes: &[u8]) -> String {
    hexadecimal(&Sha256::digest(bytes))
}

/// The largest part of a file that is hashed, bytes: a case refuses larger files.
const LARGEST_FILE: u64 = 1 << 30;

/// SHA-256 of the content of a file, in hexadecimal digits.
pub(crate) fn sha256_of_file(file: &Path) -> io::Result<String> {
    let mut hasher = Hasher(Sha256::new());
    io::copy(&mut elastocap_files::open(file)?.take(LARGEST_FILE), &mut hasher)?;
    Ok(hexadecimal(&hasher.0.finalize()))
}

/// A hash as a writer, for [`io::copy`].
struct Hasher(Sha256);

impl io::Write for Hasher {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.update(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().fold(String::with_capacity(2 * bytes.len()), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_digest_is_that_of_the_standard() {
        // FIPS 180-2, appendix B.1.
        let abc = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(sha256(b"abc"), abc);
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), "abc").unwrap();
        assert_eq!(sha256_of_file(file.path()).unwrap(), abc);
    }

    #[test]
    fn every_part_changes_the_digest_and_is_named() {
        let base = Fingerprint {
            version: "1".into(),
            build: "b".into(),
            case: "c".into(),
            files: BTreeMap::from([("a.obj".into(), "f".into())]),
            values: "v".into(),
            settings: "s".into(),
        };
        assert!(base.differences(&base).is_empty());
        type Change = fn(&mut Fingerprint);
        let changes: [(Change, &str); 7] = [
            (|f| f.version = "2".into(), "version 2 of elastocap instead of 1"),
            (|f| f.build = "x".into(), "another build"),
            (|f| f.case = "x".into(), "text of the case file"),
            (|f| drop(f.files.insert("a.obj".into(), "x".into())), "content of `a.obj`"),
            (|f| drop(f.files.insert("b.obj".into(), "x".into())), "content of `b.obj`"),
            (|f| f.values = "x".into(), "other values"),
            (|f| f.settings = "x".into(), "other settings"),
        ];
        for (change, words) in changes {
            let mut other = base.clone();
            change(&mut other);
            assert_ne!(other.digest(), base.digest(), "{words}");
            let differences = base.differences(&other);
            assert!(differences.len() == 1 && differences[0].contains(words), "{differences:?}");
        }
    }
}
