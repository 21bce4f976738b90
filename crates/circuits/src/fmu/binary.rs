//! Builds the shared library of an FMU with the C compiler of the machine.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;

use super::sources;
use crate::model::Model;

/// The folder for binaries of the machine that this program was built for, by its name in FMI 3.0; empty if
/// it has none.
pub const PLATFORM: &str = if cfg!(all(target_os = "linux", target_arch = "x86_64")) {
    "x86_64-linux"
} else if cfg!(all(target_os = "linux", target_arch = "aarch64")) {
    "aarch64-linux"
} else if cfg!(all(target_os = "macos", target_arch = "x86_64")) {
    "x86_64-darwin"
} else if cfg!(all(target_os = "macos", target_arch = "aarch64")) {
    "aarch64-darwin"
} else {
    ""
};

/// The reason why the binary of an FMU could not be built.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BinaryError {
    /// The compiler is missing or cannot be started.
    #[error("the C compiler `{}` cannot be started ({source})", compiler.display())]
    NoCompiler {
        /// The name of the compiler.
        compiler: PathBuf,
        /// The error that the system reports.
        source: io::Error,
    },
    /// The compiler failed.
    #[error("the C compiler `{}` failed: {said}", compiler.display())]
    Failed {
        /// The name of the compiler.
        compiler: PathBuf,
        /// The first lines of its messages, or its exit status if it printed none.
        said: String,
    },
    /// A file could not be written or read, for instance because the folder for temporary files is missing.
    #[error("the sources cannot be written or the library read ({0})")]
    Files(#[from] io::Error),
    /// FMI has no name for this machine, or no binary is built for it here.
    #[error("no binary is made for this kind of machine")]
    Platform,
}

/// Compiles the sources of a model in a temporary folder, and returns the bytes of the library.
///
/// # Errors
/// [`BinaryError`]; an FMU works with its sources alone, too.
pub fn compile(model: &Model, compiler: &Path) -> Result<Vec<u8>, BinaryError> {
    if PLATFORM.is_empty() {
        return Err(BinaryError::Platform);
    }
    let folder = tempfile::tempdir()?;
    for (name, text) in sources(model) {
        fs::write(folder.path().join(name), text)?;
    }
    // A path is relative to the current folder of this program; a name alone is looked for in the folders of
    // PATH.
    let is_path = compiler.components().count() > 1;
    let program = if is_path { std::path::absolute(compiler)? } else { compiler.to_owned() };
    let mut command = Command::new(program);
    // No paths or times get into the library, so that its bytes depend on sources and compiler only.
    command.current_dir(folder.path()).args(["-std=c99", "-O2", "-fPIC", "-shared", "-fvisibility=hidden"]);
    if cfg!(target_os = "linux") {
        command.args(["-s", "-Wl,--build-id=none"]);
    }
    let output = command.args(["-o", "model.library", "model.c"]).output();
    let output =
        output.map_err(|source| BinaryError::NoCompiler { compiler: compiler.to_owned(), source })?;
    if !output.status.success() {
        let text = String::from_utf8_lossy(&output.stderr);
        let lines: Vec<&str> = text.lines().filter(|line| !line.trim().is_empty()).take(5).collect();
        let said = if lines.is_empty() { output.status.to_string() } else { lines.join("; ") };
        return Err(BinaryError::Failed { compiler: compiler.to_owned(), said });
    }
    Ok(fs::read(folder.path().join("model.library"))?)
}
