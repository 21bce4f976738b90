//! Shapes and meshes from the files of other programs, audited before anything is computed from them.
//!
//! [`obj`] and [`gmsh`] read files without trusting them: whatever the bytes, the result is a valid shape or
//! mesh, or an [`ImportError`] that names the file, the place and the remedy.

pub mod audit;
mod error;
pub mod gmsh;
mod kinds;
pub mod obj;
mod polygon;
mod triangles;

pub use error::{ImportError, ImportProblem, Place};

use kinds::Wanted;
use std::fs::File;
use std::io::Read as _;
use std::path::Path;

/// The largest file that is read, bytes. Not tuned: a limit that ordinary cases do not reach.
const LARGEST_FILE: u64 = 512 << 20;

/// Reads the bytes of a file. Anything but a regular file is refused before it is opened: a pipe would wait
/// for its other end, and a device never ends. A file whose extension is that of another kind is refused as
/// well.
fn read_file(path: &Path, wanted: Wanted) -> Result<Vec<u8>, ImportProblem> {
    let unreadable = |error: std::io::Error| ImportProblem::Unreadable(error.to_string());
    if !std::fs::metadata(path).map_err(unreadable)?.is_file() {
        return Err(ImportProblem::NotAFile);
    }
    if let Some(kind) = wanted.other(path) {
        return Err(ImportProblem::OtherKind { kind, cure: wanted.cure(kind) });
    }
    let mut bytes = Vec::new();
    // Files such as those of /proc report a length of zero, so that the length is not relied upon.
    File::open(path)
        .map_err(unreadable)?
        .take(LARGEST_FILE + 1)
        .read_to_end(&mut bytes)
        .map_err(unreadable)?;
    if bytes.len() as u64 > LARGEST_FILE { Err(ImportProblem::LargeFile) } else { Ok(bytes) }
}

/// A word of a file in a message: quoted if it may be a keyword or a number, otherwise described by its
/// length. The user may have named a file with private contents by mistake.
fn shown_word(word: &[u8]) -> String {
    let plain = |b: &u8| b.is_ascii_alphanumeric() || b"+-._/".contains(b);
    match std::str::from_utf8(word) {
        Ok(text) if word.len() <= 12 && word.iter().all(plain) => format!("{text:?}"),
        _ => format!("a word of {} bytes", word.len()),
    }
}
