//! The shared library of an FMU, by the C compiler of the machine.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;

use super::sources;
use crate::model::Model;

/// The folder for binaries of the machine that this program was built for, by the names of FMI 3.0; empty where it has none.
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

/// Why there is no binary.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BinaryError {
    /// No compiler, or none that starts.
    #[error("the C compiler `{}` cannot be started ({source})", compiler.display())]
    NoCompiler {
        /// Its name.
        compiler: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// It refuses the sources.
    #[error("the C compiler `{}` failed: {said}", compiler.display())]
    Failed {
        /// Its name.
        compiler: PathBuf,
        /// Its first lines.
        said: String,
    },
    /// No folder for temporary files, for instance.
    #[error("the sources cannot be written or the library read ({0})")]
    Files(#[from] io::Error),
    /// FMI has a name for few machines.
    #[error("no binary is made for this kind of machine")]
    Platform,
}

/// Compiles the sources of a model in a temporary folder, and gives the bytes of the library.
///
/// # Errors
/// [`BinaryError`]; the sources serve without a binary too.
pub fn compile(model: &Model, compiler: &Path) -> Result<Vec<u8>, BinaryError> {
    if PLATFORM.is_empty() {
        return Err(BinaryError::Platform);
    }
    let folder = tempfile::tempdir()?;
    for (name, text) in sources(model) {
        fs::write(folder.path().join(name), text)?;
    }
    let mut command = Command::new(compiler);
    // No paths and no times get into the library, so that its bytes depend on sources and compiler alone.
    command.current_dir(folder.path()).args(["-std=c99", "-O2", "-fPIC", "-shared", "-fvisibility=hidden"]);
    if cfg!(target_os = "linux") {
        command.args(["-s", "-Wl,--build-id=none"]);
    }
    let ran = command.args(["-o", "model.library", "model.c"]).output();
    let ran = ran.map_err(|source| BinaryError::NoCompiler { compiler: compiler.to_owned(), source })?;
    if !ran.status.success() {
        let text = String::from_utf8_lossy(&ran.stderr);
        let said: Vec<&str> = text.lines().filter(|line| !line.trim().is_empty()).take(5).collect();
        return Err(BinaryError::Failed { compiler: compiler.to_owned(), said: said.join("; ") });
    }
    Ok(fs::read(folder.path().join("model.library"))?)
}
