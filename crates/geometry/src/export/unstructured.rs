//! `.vtu` files by `vtkio`: its model of an unstructured grid, its encoding of the arrays, its XML.
//!
//! Four things are added around it. A comment at the head of the file says what the body ids mean, because `vtkio` has
//! no comments. Connectivity and offsets are declared as signed, because `vtkio` declares them as unsigned and meshio
//! 5.3.5 then makes floating-point numbers of them, which are no indices. The callers check sizes and numbers first,
//! because `vtkio` panics where a count does not fit 32 bits. And `.pvd` series are written in `vtk.rs`, because `vtkio`
//! does not know that format.
//!
//! The arrays are inline, little-endian, in base64 and not compressed. `vtkio` 0.7.0-rc2 hands its compressor one number
//! at a time: a grid of 100,000 cells takes it 0.7 s, more than a whole load curve, and it ends an array that fills its
//! last block with an empty block where VTK has none. A file is therefore about six times as large as a compressed
//! one: 1.4 MB instead of 0.24 MB for a grid of 7,680 cells, a third of it the 64-bit connectivity of `vtkio`.

use std::fmt::{Display, Write as _};

use vtkio::model::{
    Attribute, ByteOrder, CellType, Cells, DataArray, DataSet, ElementType, IOBuffer, Piece,
    UnstructuredGridPiece, Version, VertexNumbers, Vtk,
};
use vtkio::xml::{VTKFile, se};

use super::vtk_error::VtkError;

/// An array over points or cells: `components` numbers for each of them, and a name.
pub(super) fn array(name: &str, components: u32, data: IOBuffer) -> Attribute {
    element_array(name, ElementType::Generic(components), data)
}

/// An array that a viewer shows first, because its element type (scalars or vectors) makes it the active one.
pub(super) fn element_array(name: &str, elem: ElementType, data: IOBuffer) -> Attribute {
    Attribute::DataArray(DataArray { name: name.to_owned(), elem, data })
}

/// Cells of one type, `connectivity` holding their nodes in VTK's order, `per_cell` for each.
pub(super) fn cells(cell: CellType, per_cell: usize, connectivity: Vec<u64>) -> Cells {
    let count = connectivity.len() / per_cell;
    let offsets = (1..=count).map(|c| (per_cell * c) as u64).collect();
    Cells { cell_verts: VertexNumbers::XML { connectivity, offsets }, types: vec![cell; count] }
}

/// The whole file.
///
/// # Errors
/// [`VtkError::Writer`] if `vtkio` refuses the grid; not expected.
pub(super) fn vtu_file(grid: UnstructuredGridPiece, body_names: &[String]) -> Result<Vec<u8>, VtkError> {
    fn refused(error: impl Display) -> VtkError {
        VtkError::Writer(error.to_string())
    }
    let model = Vtk {
        version: Version::new_xml(1, 0),
        title: String::new(),
        byte_order: ByteOrder::LittleEndian,
        data: DataSet::UnstructuredGrid { meta: None, pieces: vec![Piece::Inline(Box::new(grid))] },
        file_path: None,
    };
    let document = VTKFile::try_from(model).map_err(refused)?;
    let mut file = String::from("<?xml version=\"1.0\"?>\n");
    let _ =
        writeln!(file, "<!-- elastocap {}: SI units. {} -->", env!("CARGO_PKG_VERSION"), comment(body_names));
    se::to_fmt_writer(&mut file, &document).map_err(refused)?;
    for name in ["offsets", "connectivity"] {
        declare_signed(&mut file, name)?;
    }
    file.push('\n');
    Ok(file.into_bytes())
}

/// Declares an array of unsigned numbers as signed; below 2^63 both have the same bytes.
///
/// # Errors
/// [`VtkError::Writer`] if there is no such array; not expected.
fn declare_signed(file: &mut String, name: &str) -> Result<(), VtkError> {
    let unsigned = format!("<DataArray type=\"UInt64\" Name=\"{name}\"");
    // Cells come last in the file.
    let start =
        file.rfind(&unsigned).ok_or_else(|| VtkError::Writer(format!("no array `{name}` of integers")))?;
    // A second space keeps the length, and with it all that follows in its place.
    let signed = format!("<DataArray type=\"Int64\"  Name=\"{name}\"");
    file.replace_range(start..start + unsigned.len(), &signed);
    Ok(())
}

/// What the body ids mean, as the text of an XML comment.
fn comment(body_names: &[String]) -> String {
    let names = body_names.iter().enumerate().map(|(id, name)| format!("{id} = {name}"));
    let text = format!("body_id: {}", names.collect::<Vec<_>>().join("; "));
    // A comment must not hold two hyphens in a row, nor the characters that XML forbids everywhere.
    text.replace(|c: char| c.is_control() || matches!(c, '\u{FFFE}' | '\u{FFFF}'), " ")
        .replace("--", "- -")
        .replace("--", "- -")
}
