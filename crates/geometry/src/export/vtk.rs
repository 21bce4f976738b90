//! The electric field of a load step on a grid of boxes as a `.vtu` file, and the `.pvd` file that makes a series of them:
//! for ParaView, VTK and meshio.
//!
//! The potential is continuous and given at the nodes. The electric field, the permittivity and the body id jump from one
//! body to the next and are given in the cells.
//!
//! `vtkio` writes the `.vtu` (`unstructured.rs` says how, and what is added); the few lines of a `.pvd` are written
//! here, because `vtkio` does not know that format.

use std::fmt::Write as _;

use vtkio::model::CellType;

use super::unstructured::{Array, UnstructuredGrid};
pub use super::vtk_error::VtkError;

/// Fields on a grid of boxes, the tensor product of three axes, at one load step.
///
/// Every array is in C order: x1 slowest, x3 fastest. With `n[a]` coordinates along axis `a`, node `(i, j, k)` is at
/// `(i * n[1] + j) * n[2] + k`; cells likewise, with `n[a] - 1` of them along each axis.
#[derive(Debug, Clone, PartialEq)]
pub struct FieldGrid {
    /// Coordinates along x1, x2, x3 in m, strictly increasing, at least two on each axis.
    pub axes: [Vec<f64>; 3],
    /// Where the nodes are instead, m, on a grid that is bent.
    pub bent: Option<Vec<[f64; 3]>>,
    /// Potential at each node, V.
    pub potential: Vec<f64>,
    /// Electric field at the centre of each cell, V/m; written in single precision.
    pub electric_field: Vec<[f64; 3]>,
    /// Relative permittivity of each cell; 1 inside conductors by convention.
    pub relative_permittivity: Vec<f64>,
    /// The body that each cell belongs to: its position in `body_names`.
    pub body_id: Vec<i32>,
    /// Names of the bodies; a comment at the head of the file lists them.
    pub body_names: Vec<String>,
}

/// The grid and its fields as a `.vtu` file: point data `potential`; cell data `electric_field`,
/// `relative_permittivity`, `body_id`.
///
/// # Errors
/// When the arrays do not fit the grid or hold numbers that are not finite: see [`VtkError`].
pub fn vtu(grid: &FieldGrid) -> Result<Vec<u8>, VtkError> {
    grid.check()?;
    let field: Vec<f32> = grid.electric_field.as_flattened().iter().map(|&e| e as f32).collect();
    let permittivity = grid.relative_permittivity.clone().into();
    UnstructuredGrid {
        points: grid.points(),
        cell: CellType::Hexahedron,
        nodes_per_cell: 8,
        connectivity: connectivity(grid.axes.each_ref().map(Vec::len)),
        point_data: vec![Array { name: "potential", components: 1, values: grid.potential.clone().into() }],
        cell_data: vec![
            Array { name: "electric_field", components: 3, values: field.into() },
            Array { name: "relative_permittivity", components: 1, values: permittivity },
            Array { name: "body_id", components: 1, values: grid.body_id.clone().into() },
        ],
        body_names: &grid.body_names,
    }
    .vtu()
}

/// A `.pvd` file that lists `.vtu` files by time: `(time, file name relative to the .pvd)`.
///
/// The time is what a viewer's slider shows: the compression U/H, or the force. Of two steps with equal times a viewer
/// would show only one, so times that do not strictly increase are replaced by positions in the list.
///
/// # Errors
/// [`VtkError::AbsolutePath`] if a file name is not relative.
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

impl FieldGrid {
    /// Checks that the axes increase, every array fits them, and all numbers are finite as they are written.
    fn check(&self) -> Result<(), VtkError> {
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
            ("points", nodes, self.bent.as_ref().map_or(nodes, Vec::len)),
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
        let points = self.bent.iter().flatten().position(|x| !x.iter().all(|x| x.is_finite()));
        finite("points", points)?;
        finite("potential", self.potential.iter().position(|x| !x.is_finite()))?;
        let single = |x: &f64| (*x as f32).is_finite();
        finite("electric_field", self.electric_field.iter().position(|e| !e.iter().all(single)))?;
        finite("relative_permittivity", self.relative_permittivity.iter().position(|x| !x.is_finite()))
    }

    /// Coordinates of the nodes, m, three for each.
    fn points(&self) -> Vec<f64> {
        if let Some(points) = &self.bent {
            return points.as_flattened().to_vec();
        }
        let [axis_1, axis_2, axis_3] = &self.axes;
        let mut points = Vec::with_capacity(3 * axis_1.len() * axis_2.len() * axis_3.len());
        for &x1 in axis_1 {
            for &x2 in axis_2 {
                for &x3 in axis_3 {
                    points.extend([x1, x2, x3]);
                }
            }
        }
        points
    }
}

/// The corners of every cell, in VTK's order: around the lower face in x3, then around the upper one.
fn connectivity(n: [usize; 3]) -> Vec<i32> {
    let node = |i: usize, j: usize, k: usize| ((i * n[1] + j) * n[2] + k) as i32;
    let mut out = Vec::with_capacity(8 * (n[0] - 1) * (n[1] - 1) * (n[2] - 1));
    for i in 0..n[0] - 1 {
        for j in 0..n[1] - 1 {
            let around = [node(i, j, 0), node(i + 1, j, 0), node(i + 1, j + 1, 0), node(i, j + 1, 0)];
            for k in 0..(n[2] - 1) as i32 {
                out.extend(around.map(|first| first + k));
                out.extend(around.map(|first| first + k + 1));
            }
        }
    }
    out
}

/// The text as the value of an XML attribute.
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
