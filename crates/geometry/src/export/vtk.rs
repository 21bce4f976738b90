//! One `.vtu` for each load step and a `.pvd` that makes a series of them: for ParaView, VTK and meshio.
//!
//! The potential lives at the nodes, where it is continuous; the electric field, the permittivity and the body id jump
//! from one body to the next and live in the cells. Arrays are inline, little-endian, compressed by zlib and in base64:
//! the one compressed form that VTK and meshio both read.
//!
//! Written by hand, not through `vtkio` (0.7.0-rc2), which reads these files back in the tests: it takes 0.7 s to
//! compress a grid of 100 000 cells where this takes 0.03 s, and always writes 64-bit connectivity; a load curve of
//! six steps has 0.5 s in all. Measured by `cargo run --release -p elastocap-geometry --example export_samples`.

use std::fmt::Write as _;
use std::io::Write as _;

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use flate2::Compression;
use flate2::write::ZlibEncoder;

/// Fields on a grid of boxes: the tensor product of three axes, as deformed at one load step.
///
/// Every array is in C order: x1 slowest, x3 fastest. With `n[a]` coordinates along axis `a`, node `(i, j, k)` is at
/// `(i * n[1] + j) * n[2] + k`; cells likewise, with `n[a] - 1` of them along each axis.
#[derive(Debug, Clone, PartialEq)]
pub struct FieldGrid {
    /// Coordinates along x1, x2, x3 in m, strictly increasing, at least two on each axis.
    pub axes: [Vec<f64>; 3],
    /// Potential at the nodes, V.
    pub potential: Vec<f64>,
    /// Electric field at the centres of the cells, V/m; written in single precision.
    pub electric_field: Vec<[f64; 3]>,
    /// eps_r of the cells; 1 inside conductors by convention.
    pub relative_permittivity: Vec<f64>,
    /// Which body each cell belongs to: a position in `body_names`.
    pub body_id: Vec<i32>,
    /// What the ids mean; a comment at the head of the file says so.
    pub body_names: Vec<String>,
}

/// Why a field cannot be written as VTK.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum VtkError {
    /// Fewer than two coordinates on an axis, or coordinates that do not increase.
    #[error("the grid's coordinates along x{} do not increase, or are fewer than two", axis + 1)]
    Axis {
        /// 0, 1, 2 for x1, x2, x3.
        axis: usize,
    },
    /// An array does not fit the grid.
    #[error("the grid has {expected} values of `{array}`, but {found} were given")]
    Length {
        /// Name in the file.
        array: &'static str,
        /// Nodes or cells of the grid.
        expected: usize,
        /// Values given.
        found: usize,
    },
    /// A value is infinite, not a number, or beyond single precision where that is what is written.
    #[error("value {index} of `{array}` is not a finite number")]
    NotFinite {
        /// Name in the file.
        array: &'static str,
        /// Position in the array.
        index: usize,
    },
    /// More than the 268 million cells that 32-bit connectivity can address.
    #[error("a grid of {cells} cells is too large for one .vtu file; write a coarser one")]
    TooLarge {
        /// Cells of the grid.
        cells: usize,
    },
    /// A file in a series that is named by its place on this machine.
    #[error("`{file}` must be named relative to the .pvd file")]
    AbsolutePath {
        /// The name.
        file: String,
    },
    /// The compressor refused; not expected.
    #[error("compression failed: {0}")]
    Compression(String),
}

/// The grid and its fields as a `.vtu` file: point data `potential`; cell data `electric_field`,
/// `relative_permittivity`, `body_id`.
///
/// # Errors
/// When the arrays do not fit the grid or hold numbers that are not finite: see [`VtkError`].
pub fn vtu(grid: &FieldGrid) -> Result<Vec<u8>, VtkError> {
    let (nodes, cells) = grid.checked_counts()?;
    let n = [0, 1, 2].map(|a| grid.axes[a].len());

    let mut file = String::new();
    file.push_str("<?xml version=\"1.0\"?>\n");
    let _ = writeln!(
        file,
        "<!-- elastocap {}: SI units. {} -->",
        env!("CARGO_PKG_VERSION"),
        comment(&grid.body_names)
    );
    file.push_str(
        "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\" \
         compressor=\"vtkZLibDataCompressor\">\n<UnstructuredGrid>\n",
    );
    let _ = writeln!(file, "<Piece NumberOfPoints=\"{nodes}\" NumberOfCells=\"{cells}\">");

    file.push_str("<PointData Scalars=\"potential\">\n");
    array(&mut file, "Float64", "potential", 1, &le_bytes(&grid.potential, |x| x.to_le_bytes()))?;
    file.push_str("</PointData>\n<CellData Vectors=\"electric_field\">\n");
    let field = le_bytes(grid.electric_field.as_flattened(), |x| (x as f32).to_le_bytes());
    array(&mut file, "Float32", "electric_field", 3, &field)?;
    let permittivity = le_bytes(&grid.relative_permittivity, |x| x.to_le_bytes());
    array(&mut file, "Float64", "relative_permittivity", 1, &permittivity)?;
    array(&mut file, "Int32", "body_id", 1, &le_bytes(&grid.body_id, |x| x.to_le_bytes()))?;

    file.push_str("</CellData>\n<Points>\n");
    let mut points = Vec::with_capacity(24 * nodes);
    for x1 in &grid.axes[0] {
        for x2 in &grid.axes[1] {
            for x3 in &grid.axes[2] {
                points.extend([x1, x2, x3].into_iter().flat_map(|x| x.to_le_bytes()));
            }
        }
    }
    array(&mut file, "Float64", "Points", 3, &points)?;

    file.push_str("</Points>\n<Cells>\n");
    array(&mut file, "Int32", "connectivity", 1, &connectivity(n))?;
    let offsets = (1..=cells).flat_map(|c| (8 * c as i32).to_le_bytes());
    array(&mut file, "Int32", "offsets", 1, &offsets.collect::<Vec<_>>())?;
    array(&mut file, "UInt8", "types", 1, &vec![VTK_HEXAHEDRON; cells])?;

    file.push_str("</Cells>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n");
    Ok(file.into_bytes())
}

/// A `.pvd` file that lists `.vtu` files by time: `(time, file name relative to the .pvd)`.
///
/// The time is what the reader's slider shows: the compression U/H, or the force. Where the times do not strictly
/// increase, a reader would show only one of two equal ones, so the position in the list takes their place.
///
/// # Errors
/// When a file name is not relative.
pub fn pvd(series: &[(f64, String)]) -> Result<String, VtkError> {
    let ordered = series.iter().all(|(time, _)| time.is_finite()) && series.is_sorted_by(|a, b| a.0 < b.0);
    let mut file = String::from(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" byte_order=\"LittleEndian\">\n<Collection>\n",
    );
    for (step, (time, name)) in series.iter().enumerate() {
        if name.starts_with(['/', '\\']) || name.contains(':') {
            return Err(VtkError::AbsolutePath { file: name.clone() });
        }
        let time = if ordered { *time } else { step as f64 };
        let _ = writeln!(
            file,
            "<DataSet timestep=\"{time:?}\" group=\"\" part=\"0\" file=\"{}\"/>",
            attribute(name)
        );
    }
    file.push_str("</Collection>\n</VTKFile>\n");
    Ok(file)
}

const VTK_HEXAHEDRON: u8 = 12;

/// Bytes compressed at a time. Where an array fills its last block to the last byte there is no empty one after it, as
/// VTK writes it; VTK and meshio read that (the 32-node samples of the example), vtkio 0.7.0-rc2 wants the empty one.
const BLOCK: usize = 1 << 18;

impl FieldGrid {
    /// (nodes, cells), once every array is known to fit them.
    fn checked_counts(&self) -> Result<(usize, usize), VtkError> {
        for (axis, x) in self.axes.iter().enumerate() {
            let increases = x.is_sorted_by(|a, b| a < b) && x.iter().all(|x| x.is_finite());
            if x.len() < 2 || !increases {
                return Err(VtkError::Axis { axis });
            }
        }
        let product = |less: usize| self.axes.iter().try_fold(1_usize, |n, x| n.checked_mul(x.len() - less));
        let (nodes, cells) = match (product(0), product(1)) {
            (Some(nodes), Some(cells)) if nodes.max(8 * cells) <= i32::MAX as usize => (nodes, cells),
            (_, cells) => return Err(VtkError::TooLarge { cells: cells.unwrap_or(usize::MAX) }),
        };
        let lengths = [
            ("potential", nodes, self.potential.len()),
            ("electric_field", cells, self.electric_field.len()),
            ("relative_permittivity", cells, self.relative_permittivity.len()),
            ("body_id", cells, self.body_id.len()),
        ];
        for (array, expected, found) in lengths {
            if expected != found {
                return Err(VtkError::Length { array, expected, found });
            }
        }
        let finite = |array, index: Option<usize>| match index {
            Some(index) => Err(VtkError::NotFinite { array, index }),
            None => Ok(()),
        };
        finite("potential", self.potential.iter().position(|x| !x.is_finite()))?;
        let single = |x: &f64| (*x as f32).is_finite();
        finite("electric_field", self.electric_field.iter().position(|e| !e.iter().all(single)))?;
        finite("relative_permittivity", self.relative_permittivity.iter().position(|x| !x.is_finite()))?;
        Ok((nodes, cells))
    }
}

/// The corners of every cell, in VTK's order: around the lower face in x3, then around the upper one.
fn connectivity(n: [usize; 3]) -> Vec<u8> {
    let node = |i: usize, j: usize, k: usize| ((i * n[1] + j) * n[2] + k) as i32;
    let mut out = Vec::with_capacity(32 * (n[0] - 1) * (n[1] - 1) * (n[2] - 1));
    for i in 0..n[0] - 1 {
        for j in 0..n[1] - 1 {
            let around = [node(i, j, 0), node(i + 1, j, 0), node(i + 1, j + 1, 0), node(i, j + 1, 0)];
            for k in 0..(n[2] - 1) as i32 {
                out.extend(around.iter().flat_map(|first| (first + k).to_le_bytes()));
                out.extend(around.iter().flat_map(|first| (first + k + 1).to_le_bytes()));
            }
        }
    }
    out
}

pub(super) fn le_bytes<T: Copy, const N: usize>(values: &[T], bytes: impl Fn(T) -> [u8; N]) -> Vec<u8> {
    values.iter().flat_map(|&x| bytes(x)).collect()
}

/// Appends one `DataArray`: a table of block sizes, then the compressed blocks, each part in base64.
pub(super) fn array(
    file: &mut String,
    kind: &str,
    name: &str,
    components: usize,
    bytes: &[u8],
) -> Result<(), VtkError> {
    let mut sizes = Vec::new();
    let mut data = Vec::with_capacity(bytes.len() / 3);
    for block in bytes.chunks(BLOCK) {
        let before = data.len();
        let mut encoder = ZlibEncoder::new(data, Compression::fast());
        data = (encoder.write_all(block).and_then(|()| encoder.finish()))
            .map_err(|e| VtkError::Compression(e.to_string()))?;
        sizes.push((data.len() - before) as u64);
    }
    // How many blocks, how long each is, and how long the last one is if it is shorter.
    let mut table = vec![sizes.len() as u64, BLOCK as u64, (bytes.len() % BLOCK) as u64];
    table.extend(sizes);
    let _ = write!(file, "<DataArray type=\"{kind}\" Name=\"{name}\"");
    if components > 1 {
        // meshio makes a matrix of one column of a scalar array that says so.
        let _ = write!(file, " NumberOfComponents=\"{components}\"");
    }
    file.push_str(" format=\"binary\">");
    BASE64_STANDARD.encode_string(le_bytes(&table, u64::to_le_bytes), file);
    BASE64_STANDARD.encode_string(data, file);
    file.push_str("</DataArray>\n");
    Ok(())
}

/// What the body ids mean, as the text of an XML comment.
pub(super) fn comment(body_names: &[String]) -> String {
    let names = body_names.iter().enumerate().map(|(id, name)| format!("{id} = {name}"));
    let text = format!("body_id: {}", names.collect::<Vec<_>>().join("; "));
    // A comment may hold anything but two hyphens in a row and what XML forbids everywhere.
    text.replace(|c: char| c.is_control() || matches!(c, '\u{FFFE}' | '\u{FFFF}'), " ")
        .replace("--", "- -")
        .replace("--", "- -")
}

fn attribute(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '"' => out.push_str("&quot;"),
            c if c.is_control() => out.push(' '),
            c => out.push(c),
        }
    }
    out
}
