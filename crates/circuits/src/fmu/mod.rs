//! An FMU of FMI 3.0 for model exchange and co-simulation: C sources with the numbers as tables, and a binary
//! where there is a C compiler.
//!
//! The archive has the same bytes for the same model and the same compiler.

mod binary;
mod description;

use std::fmt::Write as _;
use std::io::{self, Write as _};

use rawzip::time::UtcDateTime;
use rawzip::{CompressionMethod, ZipArchiveWriter};

use crate::header;
use crate::model::Model;
pub use binary::{BinaryError, PLATFORM, compile};

/// The headers of the FMI standard, with their licence in each, and the code that is common to all models.
const FIXED: [(&str, &str); 4] = [
    ("model.c", include_str!("c/model.c")),
    ("fmi3Functions.h", include_str!("c/fmi3Functions.h")),
    ("fmi3FunctionTypes.h", include_str!("c/fmi3FunctionTypes.h")),
    ("fmi3PlatformTypes.h", include_str!("c/fmi3PlatformTypes.h")),
];

/// The reason why an FMU could not be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FmuError {
    /// The archive could not be laid out.
    #[error("cannot make the archive: {0}")]
    Archive(#[from] rawzip::Error),
    /// A file could not be written to the archive.
    #[error("cannot make the archive: {0}")]
    Write(#[from] io::Error),
}

/// The C sources of a model: names and texts.
pub fn sources(model: &Model) -> Vec<(&'static str, String)> {
    let mut out: Vec<_> = FIXED.iter().map(|(name, text)| (*name, (*text).to_owned())).collect();
    out.push(("tables.h", tables(model)));
    out
}

/// The FMU of a model, with a shared library for [`PLATFORM`] if one is given.
///
/// # Errors
/// [`FmuError`], which is not expected for any model.
pub fn archive(model: &Model, binary: Option<&[u8]>) -> Result<Vec<u8>, FmuError> {
    let mut zip = ZipArchiveWriter::new(Vec::new());
    // The earliest date in the format, so that the bytes do not depend on the day. Without compression, which
    // importers accept as well.
    let date = UtcDateTime::from_unix(315_532_800);
    let mut add = |name: &str, bytes: &[u8]| -> Result<(), FmuError> {
        let file = zip
            .new_file(name)
            .compression_method(CompressionMethod::STORE)
            .last_modified(date)
            .unix_permissions(0o644);
        let (mut entry, config) = file.start()?;
        let mut writer = config.wrap(&mut entry);
        writer.write_all(bytes)?;
        let (_, descriptor) = writer.finish()?;
        entry.finish(descriptor)?;
        Ok(())
    };
    add("modelDescription.xml", description::model_description(model).as_bytes())?;
    if let Some(binary) = binary {
        add(&format!("binaries/{PLATFORM}/{}{}", model.identifier, std::env::consts::DLL_SUFFIX), binary)?;
    }
    add("sources/buildDescription.xml", description::build_description(model).as_bytes())?;
    for (name, text) in sources(model) {
        add(&format!("sources/{name}"), text.as_bytes())?;
    }
    let about: String = header::lines(model).iter().map(|line| format!("{line}\n")).collect();
    add("documentation/about.txt", about.as_bytes())?;
    Ok(zip.finish()?)
}

/// Whether the model has one voltage and one charge: those between two terminals, or of one terminal against
/// ground.
fn has_one_voltage(model: &Model) -> bool {
    !model.has_common || model.terminals.len() == 1
}

/// The number of potentials that are inputs.
fn potentials(model: &Model) -> usize {
    if has_one_voltage(model) { 1 } else { model.terminals.len() }
}

/// A token of 128 bits of FNV-1a over the content of the model, so that another model is refused in its
/// place.
fn token(model: &Model) -> String {
    let text = numbers(model) + &header::lines(model).join("\n");
    let mut hash: u128 = 0x6c62_272e_07bb_0142_62b8_2175_6295_c58d;
    for byte in text.bytes() {
        hash = (hash ^ u128::from(byte)).wrapping_mul(0x0000_0000_0100_0000_0000_0000_0000_013b);
    }
    let hex = format!("{hash:032x}");
    format!("{{{}-{}-{}-{}-{}}}", &hex[..8], &hex[8..12], &hex[12..16], &hex[16..20], &hex[20..])
}

/// `tables.h`: the numbers of a model.
fn tables(model: &Model) -> String {
    let [first, last] = model.range();
    let mut out = String::new();
    for line in header::lines(model) {
        let _ = writeln!(out, "{}", format!("// {line}").trim_end());
    }
    let _ = write!(
        out,
        "\n#define ELC_TOKEN \"{}\"\n\
         #define ELC_OUTSIDE_MESSAGE \"the force is outside the range of the model, {first} N to {last} N; run the case with more load, or set \
         refuse_outside to false for the capacitance at the range's end\"\n",
        token(model)
    );
    out + &numbers(model)
}

/// The part of `tables.h` with the capacitors: their ends, bands and cubics over the forces.
fn numbers(model: &Model) -> String {
    let mut out = String::new();
    let list = |values: &[f64]| values.iter().map(|v| format!("{v:e}")).collect::<Vec<_>>().join(", ");
    let _ = write!(
        out,
        "#define ELC_POTENTIALS {}\n#define ELC_BRANCHES {}\n#define ELC_INTERVALS {}\n#define ELC_BANDS {}\n\n\
         /* Forces of the load steps, N. */\nstatic const double elc_forces[ELC_INTERVALS + 1] = {{{}}};\n\n\
         /* Between which terminals a capacitor is; -1 is the common node. */\nstatic const int elc_ends[ELC_BRANCHES][2] = {{",
        potentials(model),
        model.branches.len(),
        model.forces.len() - 1,
        if model.has_ground_band() { 2 } else { 1 },
        list(&model.forces)
    );
    for branch in &model.branches {
        let (i, j) = branch.ends;
        let other = j.filter(|_| !has_one_voltage(model)).map_or("-1".to_owned(), |j| j.to_string());
        let _ = write!(out, "{{{i}, {other}}}, ");
    }
    let _ =
        write!(out, "}};\n\n/* Which band it moves with. */\nstatic const int elc_band[ELC_BRANCHES] = {{");
    for branch in &model.branches {
        let _ = write!(out, "{}, ", u8::from(model.has_ground_band() && branch.ends.1.is_none()));
    }
    out.push_str(
        "};\n\n/* Cubics in Bernstein form, F: for each capacitor and interval those of the lower bound, the value and the upper bound. */\n\
         static const double elc_points[ELC_BRANCHES][ELC_INTERVALS][3][4] = {\n",
    );
    for branch in &model.branches {
        let _ = writeln!(out, "    {{ /* {} */", header::plain(&model.ends(branch).join(" - ")));
        for [lower, value, upper] in branch.curve.pieces() {
            let _ =
                writeln!(out, "        {{{{{}}}, {{{}}}, {{{}}}}},", list(lower), list(value), list(upper));
        }
        out.push_str("    },\n");
    }
    out.push_str("};\n");
    out
}
