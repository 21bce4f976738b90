//! The electric field of a load step on a grid of boxes as a `.vtu` file, and the `.pvd` file that makes a
//! series of them: for ParaView, VTK and meshio.
//!
//! The potential and the electric field are given at points, so that a viewer shows them smooth. The field
//! jumps from one body to the next: where bodies meet, each has separate points. The permittivity and the
//! body id are given in the cells.
//!
//! `vtkio` writes the `.vtu` (`unstructured.rs` says how, and what is added); the few lines of a `.pvd` are
//! written here, because `vtkio` does not know that format.

use std::fmt::Write as _;

use vtkio::model::CellType;

use super::unstructured::{Array, UnstructuredGrid};
pub use super::vtk_error::VtkError;

/// Fields on a grid of boxes, the tensor product of three axes, at one load step.
///
/// Every array is in C order: x1 slowest, x3 fastest. With `n[a]` coordinates along axis `a`, node `(i, j,
/// k)` is at `(i * n[1] + j) * n[2] + k`; cells likewise, with `n[a] - 1` of them along each axis.
#[derive(Debug, Clone, PartialEq)]
pub struct FieldGrid {
    /// Coordinates along x1, x2, x3 in m, strictly increasing, at least two on each axis.
    pub axes: [Vec<f64>; 3],
    /// The positions of the nodes, m, of a grid that is bent; those that follow from `axes` then do not
    /// count.
    pub bent: Option<Vec<[f64; 3]>>,
    /// Potential at each node, V.
    pub potential: Vec<f64>,
    /// Electric field at each node, V/m; written in single precision. The field may jump there, so that each
    /// component has two values: the first array has its value in the cells below the node along the axis of
    /// the component, the second array that in the cells above.
    pub electric_field: Vec<[[f64; 3]; 2]>,
    /// Relative permittivity of each cell; 1 inside conductors by convention.
    pub relative_permittivity: Vec<f64>,
    /// The body that each cell belongs to: its position in `body_names`.
    pub body_id: Vec<i32>,
    /// Names of the bodies; a comment at the head of the file lists them.
    pub body_names: Vec<String>,
}

/// The grid and its fields as a `.vtu` file: point data `potential`, `electric_field`; cell data
/// `relative_permittivity`, `body_id`.
///
/// # Errors
/// When the arrays do not fit the grid or hold numbers that are not finite: see [`VtkError`].
pub fn vtu(grid: &FieldGrid) -> Result<Vec<u8>, VtkError> {
    grid.check()?;
    let Points { coordinates, potential, electric_field, connectivity } = grid.points();
    let single = |values: &[f64]| -> Vec<f32> { values.iter().map(|&x| x as f32).collect() };
    UnstructuredGrid {
        points: coordinates,
        cell: CellType::Hexahedron,
        nodes_per_cell: 8,
        connectivity,
        point_data: vec![
            Array { name: "potential", components: 1, values: potential.into() },
            Array { name: "electric_field", components: 3, values: electric_field.into() },
        ],
        cell_data: vec![
            Array {
                name: "relative_permittivity",
                components: 1,
                values: single(&grid.relative_permittivity).into(),
            },
            Array { name: "body_id", components: 1, values: grid.body_id.clone().into() },
        ],
        body_names: &grid.body_names,
    }
    .vtu()
}

/// The points of the file, node after node, and the cells between them.
#[derive(Default)]
struct Points {
    /// Three coordinates for each point, m.
    coordinates: Vec<f64>,
    /// The potential at each point, V.
    potential: Vec<f64>,
    /// Three components of the electric field for each point, V/m.
    electric_field: Vec<f32>,
    /// The corners of every cell, in VTK's order: around the lower face in x3, then around the upper one.
    connectivity: Vec<i32>,
}

/// A `.pvd` file that lists `.vtu` files by time: `(time, file name relative to the .pvd)`.
///
/// The time is the value on the slider of a viewer: the compression U/H, or the force. Of two steps with
/// equal times a viewer would show only one, so times that do not strictly increase are replaced by indices
/// in the list.
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
            ("electric_field", nodes, self.electric_field.len()),
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
        let field = self.electric_field.iter().position(|e| !e.as_flattened().iter().all(single));
        finite("electric_field", field)?;
        finite("relative_permittivity", self.relative_permittivity.iter().position(|x| !single(x)))
    }

    /// A point at each node for each body that the cells around it belong to, with the mean of the field in
    /// these cells.
    fn points(&self) -> Points {
        let nodes = self.axes.each_ref().map(Vec::len);
        let cells = nodes.map(|n| n - 1);
        let mut out = Points { connectivity: vec![0; 8 * self.body_id.len()], ..Points::default() };
        for node in 0..self.potential.len() {
            let indices = [node / (nodes[1] * nodes[2]), node / nodes[2] % nodes[1], node % nodes[2]];
            let limits = &self.electric_field[node];
            // For each body at the node: its id, the number of its point, the number of its cells around the
            // node, and the sum of their fields.
            let mut bodies_here: Vec<(i32, i32, f64, [f64; 3])> = Vec::with_capacity(2);
            // For each axis, whether the cell lies above the node.
            for above in (0..8).map(|bits| [0, 1, 2].map(|a| bits >> a & 1)) {
                if (0..3).any(|a| indices[a] + above[a] == 0 || indices[a] + above[a] > cells[a]) {
                    continue;
                }
                let [i, j, k] = [0, 1, 2].map(|a| indices[a] + above[a] - 1);
                let cell = (i * cells[1] + j) * cells[2] + k;
                let body = self.body_id[cell];
                let entry = bodies_here.iter().position(|known| known.0 == body).unwrap_or(bodies_here.len());
                if entry == bodies_here.len() {
                    bodies_here.push((body, out.potential.len() as i32, 0.0, [0.0; 3]));
                    let straight = [0, 1, 2].map(|a| self.axes[a][indices[a]]);
                    out.coordinates.extend(self.bent.as_ref().map_or(straight, |bent| bent[node]));
                    out.potential.push(self.potential[node]);
                }
                let (_, point, count, sum) = &mut bodies_here[entry];
                *count += 1.0;
                (0..3).for_each(|a| sum[a] += limits[above[a]][a]);
                // A node is the upper corner of the cells below it.
                let around = [[2, 1], [3, 0]][above[0]][above[1]];
                out.connectivity[8 * cell + around + 4 * (1 - above[2])] = *point;
            }
            for (.., count, sum) in bodies_here {
                out.electric_field.extend(sum.map(|e| (e / count) as f32));
            }
        }
        out
    }
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
