//! Elements with what lives at their nodes as a `.vtu`: those of a deformed body, or tetrahedra around bodies.
//!
//! Points are where the material is after loading; the displacement among the arrays takes a viewer back. Curved
//! elements are written as such (VTK's biquadratic quadrilateral and triquadratic hexahedron).

use std::fmt::Write as _;

use super::vtk::{VtkError, array, comment, le_bytes};

/// Which elements a body is made of. Nodes of an element count up along `s` first, then `t`, then `r`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Element {
    /// Nine nodes in the plane.
    Quadrilateral,
    /// 27 nodes.
    Hexahedron,
    /// Four nodes, straight.
    Tetrahedron,
}

/// VTK's corner, edge, face and middle nodes by their number here.
const QUADRILATERAL: [usize; 9] = [0, 2, 8, 6, 1, 5, 7, 3, 4];
const HEXAHEDRON: [usize; 27] =
    [0, 2, 8, 6, 18, 20, 26, 24, 1, 5, 7, 3, 19, 23, 25, 21, 9, 11, 17, 15, 12, 14, 10, 16, 4, 22, 13];

impl Element {
    fn order(self) -> &'static [usize] {
        match self {
            Self::Quadrilateral => &QUADRILATERAL,
            Self::Hexahedron => &HEXAHEDRON,
            Self::Tetrahedron => &[0, 1, 2, 3],
        }
    }

    fn vtk_type(self) -> u8 {
        match self {
            Self::Quadrilateral => 28,
            Self::Hexahedron => 29,
            Self::Tetrahedron => 10,
        }
    }
}

/// Values at the nodes of a body, or in its elements.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedArray {
    /// Its name in the file.
    pub name: &'static str,
    /// Numbers for each node or element: 1, 3 for a vector, 6 for a symmetric tensor (11, 22, 33, 12, 23, 13).
    pub components: usize,
    /// The numbers, node after node or element after element.
    pub values: Vec<f64>,
}

/// A body as deformed at one load step.
#[derive(Debug, Clone, PartialEq)]
pub struct BodyMesh {
    /// What its elements are.
    pub element: Element,
    /// Deformed positions of the nodes in m.
    pub points: Vec<[f64; 3]>,
    /// Nodes of each element, all elements one after the other.
    pub nodes: Vec<u32>,
    /// What lives at the nodes.
    pub arrays: Vec<NamedArray>,
    /// What lives in the elements.
    pub in_elements: Vec<NamedArray>,
    /// Which body each element belongs to: a position in `body_names`.
    pub body_id: Vec<i32>,
    /// What the ids mean.
    pub body_names: Vec<String>,
}

/// The body as a `.vtu` file: its arrays as point data, those in elements and `body_id` as cell data.
///
/// # Errors
/// When the arrays do not fit the mesh or hold numbers that are not finite: see [`VtkError`].
pub fn body_vtu(body: &BodyMesh) -> Result<Vec<u8>, VtkError> {
    let order = body.element.order();
    let (points, cells) = (body.points.len(), body.nodes.len() / order.len());
    check(body, points, cells)?;
    let mut file = String::from("<?xml version=\"1.0\"?>\n");
    let _ = writeln!(
        file,
        "<!-- elastocap {}: SI units. {} -->",
        env!("CARGO_PKG_VERSION"),
        comment(&body.body_names)
    );
    file.push_str(
        "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\" \
         compressor=\"vtkZLibDataCompressor\">\n<UnstructuredGrid>\n",
    );
    let _ = writeln!(file, "<Piece NumberOfPoints=\"{points}\" NumberOfCells=\"{cells}\">\n<PointData>");
    for of in &body.arrays {
        array(&mut file, "Float64", of.name, of.components, &le_bytes(&of.values, f64::to_le_bytes))?;
    }
    file.push_str("</PointData>\n<CellData>\n");
    for of in &body.in_elements {
        array(&mut file, "Float64", of.name, of.components, &le_bytes(&of.values, f64::to_le_bytes))?;
    }
    array(&mut file, "Int32", "body_id", 1, &le_bytes(&body.body_id, i32::to_le_bytes))?;
    file.push_str("</CellData>\n<Points>\n");
    array(&mut file, "Float64", "Points", 3, &le_bytes(body.points.as_flattened(), f64::to_le_bytes))?;
    file.push_str("</Points>\n<Cells>\n");
    let connectivity: Vec<u8> = body
        .nodes
        .chunks_exact(order.len())
        .flat_map(|nodes| order.iter().flat_map(|&k| (nodes[k] as i32).to_le_bytes()))
        .collect();
    array(&mut file, "Int32", "connectivity", 1, &connectivity)?;
    let offsets = (1..=cells).flat_map(|c| ((order.len() * c) as i32).to_le_bytes());
    array(&mut file, "Int32", "offsets", 1, &offsets.collect::<Vec<_>>())?;
    array(&mut file, "UInt8", "types", 1, &vec![body.element.vtk_type(); cells])?;
    file.push_str("</Cells>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n");
    Ok(file.into_bytes())
}

fn check(body: &BodyMesh, points: usize, cells: usize) -> Result<(), VtkError> {
    let per_cell = body.element.order().len();
    if body.nodes.len().max(points) > i32::MAX as usize {
        return Err(VtkError::TooLarge { cells });
    }
    let fits = |array, expected, found| {
        if expected == found { Ok(()) } else { Err(VtkError::Length { array, expected, found }) }
    };
    fits("nodes", per_cell * cells, body.nodes.len())?;
    fits("body_id", cells, body.body_id.len())?;
    if let Some(&n) = body.nodes.iter().find(|n| **n as usize >= points) {
        return Err(VtkError::Length { array: "points", expected: n as usize + 1, found: points });
    }
    let finite = |array, values: &[f64]| match values.iter().position(|x| !x.is_finite()) {
        Some(index) => Err(VtkError::NotFinite { array, index }),
        None => Ok(()),
    };
    finite("points", body.points.as_flattened())?;
    let nodal = body.arrays.iter().map(|of| (of, points));
    for (of, count) in nodal.chain(body.in_elements.iter().map(|of| (of, cells))) {
        fits(of.name, of.components * count, of.values.len())?;
        finite(of.name, &of.values)?;
    }
    Ok(())
}
