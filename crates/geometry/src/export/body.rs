//! Meshes of one kind of element as `.vtu` files: a deformed body, or the tetrahedra around and inside
//! bodies.
//!
//! Points are where the material is after loading; subtracting the array `displacement`, where there is one,
//! gives the state at rest. Curved elements are written as such (VTK's biquadratic quadrilateral and
//! triquadratic hexahedron). `vtkio` writes the file (`unstructured.rs`).

use vtkio::model::CellType;

use super::unstructured::{Array, UnstructuredGrid};
use super::vtk_error::VtkError;

/// The elements of a mesh. The nodes of a curved element are numbered along its first local axis first, then
/// along the second, then along the third.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Element {
    /// Nine nodes in the plane, quadratic.
    Quadrilateral,
    /// 27 nodes, quadratic.
    Hexahedron,
    /// Four nodes, straight edges.
    Tetrahedron,
}

/// For each node of a quadrilateral in VTK's order (corners, middles of edges, of the element), its number in
/// the order of [`Element`].
const QUADRILATERAL: [usize; 9] = [0, 2, 8, 6, 1, 5, 7, 3, 4];
/// For each node of a hexahedron in VTK's order (corners, middles of edges, of faces, of the element), its
/// number in the order of [`Element`].
const HEXAHEDRON: [usize; 27] =
    [0, 2, 8, 6, 18, 20, 26, 24, 1, 5, 7, 3, 19, 23, 25, 21, 9, 11, 17, 15, 12, 14, 10, 16, 4, 22, 13];

impl Element {
    /// For each node in VTK's order, its number in the order of [`Element`].
    fn order(self) -> &'static [usize] {
        match self {
            Self::Quadrilateral => &QUADRILATERAL,
            Self::Hexahedron => &HEXAHEDRON,
            Self::Tetrahedron => &[0, 1, 2, 3],
        }
    }

    /// VTK's type of the element.
    fn vtk_type(self) -> CellType {
        match self {
            Self::Quadrilateral => CellType::BiquadraticQuad,
            Self::Hexahedron => CellType::TriquadraticHexahedron,
            Self::Tetrahedron => CellType::Tetra,
        }
    }
}

/// Values at the nodes of a mesh, or in its elements.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedArray {
    /// Its name in the file.
    pub name: &'static str,
    /// How many numbers each node or element has: 1 for a scalar, 3 for a vector, 6 for a symmetric tensor
    /// (11, 22, 33, 12, 23, 13).
    pub components: usize,
    /// The numbers, node after node or element after element, in SI units.
    pub values: Vec<f64>,
}

/// A mesh and its fields at one load step.
#[derive(Debug, Clone, PartialEq)]
pub struct BodyMesh {
    /// The kind of all its elements.
    pub element: Element,
    /// Positions of the nodes after loading, m.
    pub points: Vec<[f64; 3]>,
    /// Positions in `points` of the nodes of each element, one element after the other.
    pub nodes: Vec<u32>,
    /// Fields at the nodes.
    pub arrays: Vec<NamedArray>,
    /// Fields in the elements.
    pub in_elements: Vec<NamedArray>,
    /// The body that each element belongs to: its position in `body_names`.
    pub body_id: Vec<i32>,
    /// Names of the bodies; a comment at the head of the file lists them.
    pub body_names: Vec<String>,
}

/// The mesh as a `.vtu` file: `arrays` as point data, `in_elements` and `body_id` as cell data.
///
/// # Errors
/// When the arrays do not fit the mesh or hold numbers that are not finite: see [`VtkError`].
pub fn body_vtu(body: &BodyMesh) -> Result<Vec<u8>, VtkError> {
    let order = body.element.order();
    check(body, body.points.len(), body.nodes.len() / order.len())?;
    let named = |array: &NamedArray| Array {
        name: array.name,
        components: array.components,
        values: array.values.clone().into(),
    };
    let mut cell_data: Vec<Array> = body.in_elements.iter().map(named).collect();
    cell_data.push(Array { name: "body_id", components: 1, values: body.body_id.clone().into() });
    UnstructuredGrid {
        points: body.points.as_flattened().to_vec(),
        cell: body.element.vtk_type(),
        nodes_per_cell: order.len(),
        connectivity: body
            .nodes
            .chunks_exact(order.len())
            .flat_map(|nodes| order.iter().map(|&k| nodes[k] as i32))
            .collect(),
        point_data: body.arrays.iter().map(named).collect(),
        cell_data,
        body_names: &body.body_names,
    }
    .vtu()
}

/// Checks that every array fits the `points` and `cells` of the mesh, and that all numbers are finite.
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
    let nodal = body.arrays.iter().map(|array| (array, points));
    for (array, count) in nodal.chain(body.in_elements.iter().map(|array| (array, cells))) {
        fits(array.name, array.components * count, array.values.len())?;
        finite(array.name, &array.values)?;
    }
    Ok(())
}
