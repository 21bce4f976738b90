//! Case files: TOML in, a valid [`Case`] in SI units out, or all errors in the file.
//!
//! The flow of data: text -> spanned TOML ([`toml::de`]) -> raw types (`raw`, read by `reader` and `tables`,
//! with spans kept) -> [`Case`] (`validate`). Raw types are declared once; reader, messages and
//! [`json_schema`] follow from the declaration.
//!
//! Defaults of missing keys: `title` is the file's name; `relative_permittivity` of the surroundings is 1;
//! `below` and `above` are the boundary itself, or infinite space if that is open; `relative_tolerance` is
//! 1e-3 and `bounds` true; electrodes are rigid if there is no load. Tables that the case does not need
//! (`[surroundings]` without conductors) are checked and then left out.

mod amount;
mod diagnostics;
mod file_unit;
mod imports;
mod material;
mod matrix_rows;
mod measured;
mod model;
mod overrides;
mod quantities;
mod raw;
mod reader;
mod schema;
mod tables;
mod terminals;
mod units;
mod validate;
mod values;

use std::io::{ErrorKind, Read};
use std::path::Path;

use elastocap_files::ReadError;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

pub use amount::{Amount, AmountError, Scale};
pub use diagnostics::{CaseError, Diagnostic};
pub use elastocap_materials::HyperelasticLaw;
pub use imports::imported_files;
pub use matrix_rows::Measurement;
pub use measured::{MeasuredCapacitance, MeasuredCapacitanceError};
pub use model::{
    Body, Box3, Case, Correction, Curve, Electrodes, Electrostatics, Extent, Face, FieldIndenter,
    FieldSolver, Foam, ImportedMesh, Indenter, Layer, LayerEnd, LayerSide, Layout, Load, Measured,
    MeasuredEntry, MeasuredLoad, MeasuredPoint, MeasuredPoints, Mechanics, PlaneStrain, Pose, PunchContact,
    Role, Shape, ShearLength, Solid, Stiffness, Surroundings, Terminal, Wall,
};
pub use overrides::{OverrideError, OverrideErrorKind, files_of, value_at, with_value};
pub use schema::json_schema;

/// The largest size of a case file, bytes.
const LARGEST_FILE: u64 = 16 << 20;

/// Reads and validates a case file.
///
/// # Errors
/// A file that cannot be read (missing, a folder, larger than 16 MiB, not UTF-8), or all errors in it.
pub fn load(path: &Path) -> Result<Case, CaseError> {
    parse(&read_source(path)?, path)
}

/// The text of a case file, for [`with_value`] and [`parse`].
///
/// # Errors
/// A file that cannot be read, as for [`load`].
pub fn read_source(path: &Path) -> Result<String, CaseError> {
    read_text(path).map_err(|diagnostic| CaseError::of_file(path, diagnostic))
}

/// Reads and validates a case from a stream, such as the standard input, up to its end. `origin` stands for
/// the file in messages (`<stdin>`); paths in the case are relative to its folder, which is the current one
/// for a bare name.
///
/// # Errors
/// A stream that cannot be read, is longer than 16 MiB or is not UTF-8, or all errors in the case.
pub fn load_from(stream: impl Read, origin: &Path) -> Result<Case, CaseError> {
    let shown = diagnostics::shown_path(origin);
    let mut bytes = Vec::new();
    let read = stream.take(LARGEST_FILE + 1).read_to_end(&mut bytes);
    let text = match read {
        Ok(_) => text_of(bytes, &shown),
        Err(error) => Err(Diagnostic::of_file(format!("cannot read the case from `{shown}`: {error}"))),
    };
    parse(&text.map_err(|diagnostic| CaseError::of_file(origin, diagnostic))?, origin)
}

fn read_text(path: &Path) -> Result<String, Diagnostic> {
    let shown = diagnostics::shown_path(path);
    let unreadable = |error: &std::io::Error| {
        let diagnostic = Diagnostic::of_file(match error.kind() {
            ErrorKind::NotFound => format!("there is no case file `{shown}`"),
            ErrorKind::PermissionDenied => format!("no permission to read the case file `{shown}`"),
            _ => format!("cannot read the case file `{shown}`: {error}"),
        });
        match error.kind() {
            ErrorKind::NotFound => diagnostic.help("check the path; case files end in .toml"),
            _ => diagnostic,
        }
    };
    if path.is_dir() {
        return Err(Diagnostic::of_file(format!("`{shown}` is a folder, not a case file"))
            .help("name a case file in it, one that ends in .toml"));
    }
    match elastocap_files::read(path, LARGEST_FILE) {
        Ok(bytes) => text_of(bytes, &shown),
        Err(ReadError::NotRegular) => Err(Diagnostic::of_file(format!(
            "`{shown}` is not a regular file but a device, a pipe or a socket"
        ))
        .help("name a file that ends by itself; case files end in .toml")),
        Err(ReadError::TooLarge { .. }) => Err(too_large(&shown)),
        Err(error) => Err(unreadable(&error.into())),
    }
}

fn too_large(shown: &str) -> Diagnostic {
    Diagnostic::of_file(format!("`{shown}` is larger than 16 MiB, so it is not a case file"))
        .help("a case file is a short text in TOML; meshes and results are other files")
}

/// The text of a case file with these bytes; a file that is too large has one byte more than allowed.
fn text_of(bytes: Vec<u8>, shown: &str) -> Result<String, Diagnostic> {
    if bytes.len() as u64 > LARGEST_FILE {
        return Err(too_large(shown));
    }
    String::from_utf8(bytes).map_err(|error| {
        let good = error.utf8_error().valid_up_to();
        let line = error.as_bytes().iter().take(good).filter(|b| **b == b'\n').count() + 1;
        Diagnostic::of_file(format!("`{shown}` is not a text file: line {line} is not UTF-8 (byte {good})"))
            .help("a case file is a text in TOML, saved as UTF-8")
    })
}

/// Validates the text of a case file; `origin` is its file, for messages and relative paths.
///
/// # Errors
/// All errors in the text.
pub fn parse(text: &str, origin: &Path) -> Result<Case, CaseError> {
    let document = DeTable::parse(text)
        .map_err(|error| CaseError::new(origin, text, vec![syntax_diagnostic(text, &error)], 0))?;
    let span = document.span();
    let document = Spanned::new(span, DeValue::Table(document.into_inner()));
    let mut log = reader::Log::new(text, &document);
    let mut case = None;
    if let DeValue::Table(table) = document.get_ref() {
        let (mut raw, flawed) = raw::Document::read(table, &mut log);
        validate::write_forms_out(&mut raw, &mut log);
        let chosen = validate::choose_mechanics(&mut raw, &mut log);
        case = validate::validate(&raw, chosen, flawed, origin, &mut log);
    }
    match case {
        Some(case) if log.is_empty() => Ok(case),
        _ => {
            if log.is_empty() {
                log.push(Diagnostic::of_file("this case file cannot be used, for a reason that got lost"));
            }
            let (diagnostics, unshown) = log.finish();
            Err(CaseError::new(origin, text, diagnostics, unshown))
        }
    }
}

/// Whether a text has the line that every case file has.
fn looks_like_a_case(text: &str) -> bool {
    text.lines().any(|line| {
        line.trim_start().strip_prefix("format").is_some_and(|rest| rest.trim_start().starts_with('='))
    })
}

/// The message of the TOML parser, with help for common mistakes.
fn syntax_diagnostic(text: &str, error: &toml::de::Error) -> Diagnostic {
    let span = error.span().unwrap_or(0..0);
    let message = error.message().lines().collect::<Vec<_>>().join("; ");
    if !looks_like_a_case(text) {
        // A file named by mistake may be anything, such as a list of passwords: nothing of it is printed.
        let line = text.get(..span.start.min(text.len())).unwrap_or("").matches('\n').count() + 1;
        return Diagnostic::of_file(format!("this is not a case file: line {line} is not valid TOML"))
            .help("a case file is a text in TOML with a line `format = 1`");
    }
    let diagnostic = Diagnostic::at(&span, format!("not valid TOML: {message}")).label("here");
    let at = span.start.min(text.len());
    let before = text.get(..at).unwrap_or("");
    let from = before.rfind('\n').map_or(0, |k| k + 1);
    let line = text.get(from..).and_then(|rest| rest.lines().next()).unwrap_or("");
    let unquoted = line.split('#').next().and_then(|line| line.split_once('='));
    match unquoted.map(|(key, value)| (key.trim(), value.trim())) {
        Some((key, value)) if units::parse(value).is_ok() => {
            diagnostic.help(format!("quantities stand in quotes: `{key} = \"{value}\"`"))
        }
        _ => diagnostic,
    }
}
