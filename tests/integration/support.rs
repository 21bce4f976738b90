//! Support for the tests: runs the `elastocap` binary in a temporary folder.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

pub(crate) const BINARY: &str = env!("CARGO_BIN_EXE_elastocap");

/// A temporary folder for one test.
pub(crate) struct Sandbox(tempfile::TempDir);

impl Sandbox {
    pub(crate) fn new() -> Self {
        Self(tempfile::tempdir().expect("a temporary folder"))
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Writes a case file.
    pub(crate) fn case(&self, name: &str, text: &str) -> PathBuf {
        let path = self.path(name);
        std::fs::write(&path, text).expect("a case file");
        path
    }

    /// A command in this folder.
    pub(crate) fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(BINARY);
        command.args(arguments).current_dir(self.0.path());
        command
    }

    pub(crate) fn elastocap(&self, arguments: &[&str]) -> Finished {
        Finished::from(self.command(arguments).output().expect("the binary starts"))
    }

    /// Runs a case into `out`.
    pub(crate) fn run(&self, case: &Path, more: &[&str]) -> Finished {
        let mut arguments = vec!["run", case.to_str().expect("a path in UTF-8"), "-o", "out"];
        arguments.extend(more);
        self.elastocap(&arguments)
    }

    /// The names in a folder, sorted; none without the folder.
    pub(crate) fn names(&self, folder: &str) -> Vec<String> {
        let entries = std::fs::read_dir(self.path(folder)).into_iter().flatten();
        let mut names: Vec<_> =
            entries.flatten().map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    pub(crate) fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    pub(crate) fn table(&self, name: &str) -> Table {
        Table::parse(&self.read(name))
    }

    pub(crate) fn json(&self, name: &str) -> serde_json::Value {
        serde_json::from_str(&self.read(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }
}

/// The exit status and the output of a process.
#[derive(Debug)]
pub(crate) struct Finished {
    pub(crate) status: Option<i32>,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl From<Output> for Finished {
    fn from(output: Output) -> Self {
        Self {
            status: output.status.code(),
            stdout: String::from_utf8(output.stdout).expect("UTF-8 on stdout"),
            stderr: String::from_utf8(output.stderr).expect("UTF-8 on stderr"),
        }
    }
}

impl Finished {
    /// Checks the exit status, and that nothing panicked.
    pub(crate) fn exits_with(self, status: i32) -> Self {
        assert!(!self.stderr.contains("panicked"), "{}", self.stderr);
        assert_eq!(self.status, Some(status), "stdout: {}\nstderr: {}", self.stdout, self.stderr);
        self
    }
}

/// A CSV file with a header.
#[derive(Debug)]
pub(crate) struct Table(pub(crate) Vec<BTreeMap<String, String>>);

impl Table {
    fn parse(text: &str) -> Self {
        let mut lines = text.lines().map(split);
        let head = lines.next().expect("a header");
        Self(
            lines
                .map(|fields| {
                    assert_eq!(fields.len(), head.len(), "{fields:?}");
                    head.iter().cloned().zip(fields).collect()
                })
                .collect(),
        )
    }

    pub(crate) fn texts(&self, column: &str) -> Vec<&str> {
        self.0.iter().map(|row| row.get(column).unwrap_or_else(|| panic!("no {column}")).as_str()).collect()
    }

    pub(crate) fn numbers(&self, column: &str) -> Vec<f64> {
        self.texts(column).iter().map(|t| t.parse().unwrap_or_else(|_| panic!("{column}: `{t}`"))).collect()
    }
}

/// The fields of a line, quoted ones unquoted.
fn split(line: &str) -> Vec<String> {
    let mut fields = vec![String::new()];
    let mut quoted = false;
    for character in line.chars() {
        match character {
            '"' => quoted = !quoted,
            ',' if !quoted => fields.push(String::new()),
            character => fields.last_mut().expect("a field").push(character),
        }
    }
    fields
}

pub(crate) fn acceptance(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/acceptance").join(name)
}

/// The in-plane pair with `[load]` and other replacements: quick, and accurate enough to show that things
/// work.
pub(crate) fn quick_pair(from: &str, to: &str) -> String {
    let text = std::fs::read_to_string(acceptance("in-plane-pair.toml")).expect("the acceptance files");
    let text = text.replace("relative_tolerance = 1e-3", "relative_tolerance = 0.05");
    assert!(text.contains(from), "`{from}` is not in the case");
    text.replace(from, to)
}

pub(crate) const STEPS: &str = "compression = [0.0, 0.05, 0.1, 0.2, 0.3, 0.4]   # U/H";
