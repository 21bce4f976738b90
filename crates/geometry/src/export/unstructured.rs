//! Writing of `.vtu` files. `vtkio` encodes the arrays, and writes the XML of each of them.
//!
//! The elements around the arrays, and a comment that says what the body ids mean, are written here. `vtkio`
//! can write them too, but it hands a whole document to its serialiser, which keeps the text of every element
//! that is open: four copies of all arrays, 90 MB for a file of 7 MB. Array by array it is two copies of one
//! of them. The callers check sizes and numbers first, because `vtkio` panics where a count does not fit 32
//! bits. `.pvd` series are written in `vtk.rs`, because `vtkio` does not know that format.
//!
//! The arrays are inline, little-endian, in base64 and not compressed. `vtkio` 0.7.0-rc2 hands its compressor
//! one number at a time: a grid of 100,000 cells takes it 0.7 s, more than a whole load curve, and it ends an
//! array that fills its last block with an empty block where VTK has none.

use std::fmt::{Display, Write as _};

use vtkio::IOBuffer;
use vtkio::model::{ByteOrder, CellType};
use vtkio::xml::{Compressor, DataArray, EncodingInfo, ScalarType, se};

use super::vtk_error::VtkError;

/// The encoding of all arrays.
const ENCODING: EncodingInfo = EncodingInfo {
    byte_order: ByteOrder::LittleEndian,
    header_type: ScalarType::UInt64,
    compressor: Compressor::None,
    compression_level: 0,
};

/// A mesh of cells of one type with arrays over its points and its cells.
pub(super) struct UnstructuredGrid<'a> {
    /// Coordinates of the points, three for each, m.
    pub(super) points: Vec<f64>,
    /// The type of all cells.
    pub(super) cell: CellType,
    /// The number of nodes of a cell.
    pub(super) nodes_per_cell: usize,
    /// The nodes of the cells in VTK's order, one cell after the other. Signed, because meshio 5.3.5 reads
    /// unsigned integers as floating-point numbers, which cannot be indices.
    pub(super) connectivity: Vec<i32>,
    /// Arrays over the points. A viewer shows the first scalar and the first vector of them first.
    pub(super) point_data: Vec<Array>,
    /// Arrays over the cells.
    pub(super) cell_data: Vec<Array>,
    /// Names of the bodies, for the comment.
    pub(super) body_names: &'a [String],
}

/// An array over points or cells: `components` numbers for each of them, and a name.
pub(super) struct Array {
    /// The name in the file.
    pub(super) name: &'static str,
    /// How many numbers each point or cell has.
    pub(super) components: usize,
    /// The numbers, one point or cell after the other.
    pub(super) values: IOBuffer,
}

impl UnstructuredGrid<'_> {
    /// The whole file.
    ///
    /// # Errors
    /// [`VtkError::Writer`] if `vtkio` refuses an array; not expected.
    pub(super) fn vtu(self) -> Result<Vec<u8>, VtkError> {
        let cells = self.connectivity.len() / self.nodes_per_cell;
        let offsets: Vec<i32> = (1..=cells).map(|c| (self.nodes_per_cell * c) as i32).collect();
        let counts = format!("NumberOfPoints=\"{}\" NumberOfCells=\"{cells}\"", self.points.len() / 3);
        let points = Array { name: "Points", components: 3, values: self.points.into() };
        let active = |(kind, components): (&str, usize)| match (self.point_data.iter())
            .find(|array| array.components == components)
        {
            Some(first) => format!(" {kind}=\"{}\"", first.name),
            None => String::new(),
        };
        let active: String = [("Scalars", 1), ("Vectors", 3)].map(active).concat();
        let cell_arrays = [
            Array { name: "connectivity", components: 1, values: self.connectivity.into() },
            Array { name: "offsets", components: 1, values: offsets.into() },
            Array { name: "types", components: 1, values: vec![self.cell as u8; cells].into() },
        ];
        let sections = [
            ("Points", String::new(), vec![points]),
            ("Cells", String::new(), cell_arrays.into()),
            ("PointData", active, self.point_data),
            ("CellData", String::new(), self.cell_data),
        ];
        // Base64 takes four characters for three bytes; the rest is for the elements.
        let length = sections
            .iter()
            .flat_map(|(.., arrays)| arrays)
            .map(|a| a.values.num_bytes() * 4 / 3 + 256)
            .sum::<usize>()
            + 1024;
        let mut file = String::with_capacity(length);
        let version = env!("CARGO_PKG_VERSION");
        let _ = write!(
            file,
            "<?xml version=\"1.0\"?>\n<!-- elastocap {version}: SI units. {} -->\n\
             <VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n\
             <UnstructuredGrid>\n<Piece {counts}>\n",
            comment(self.body_names)
        );
        for (element, attributes, arrays) in sections {
            let _ = writeln!(file, "<{element}{attributes}>");
            for array in arrays {
                array.write(&mut file)?;
            }
            let _ = writeln!(file, "</{element}>");
        }
        file.push_str("</Piece>\n</UnstructuredGrid>\n</VTKFile>\n");
        Ok(file.into_bytes())
    }
}

impl Array {
    /// Appends the array as an XML element.
    fn write(self, file: &mut String) -> Result<(), VtkError> {
        fn refused(error: impl Display) -> VtkError {
            VtkError::Writer(error.to_string())
        }
        let array = DataArray::from_io_buffer(self.values, ENCODING).map_err(refused)?;
        // The range that `vtkio` states is that of the components, where VTK expects that of a vector's
        // length.
        let array = DataArray { range_min: None, range_max: None, ..array }
            .with_name(self.name)
            .with_num_comp(self.components as u32);
        se::to_fmt_writer(&mut *file, &array).map_err(refused)?;
        file.push('\n');
        Ok(())
    }
}

/// The meaning of the body ids, as the text of an XML comment.
fn comment(body_names: &[String]) -> String {
    let names = body_names.iter().enumerate().map(|(id, name)| format!("{id} = {name}"));
    let text = format!("body_id: {}", names.collect::<Vec<_>>().join("; "));
    // A comment must not hold two hyphens in a row, nor the characters that XML forbids everywhere.
    text.replace(|c: char| c.is_control() || matches!(c, '\u{FFFE}' | '\u{FFFF}'), " ")
        .replace("--", "- -")
        .replace("--", "- -")
}
