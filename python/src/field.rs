//! The field of a step for Python: names, and arrays as bytes.

use elastocap::coupling::outcome::StepResult;
use elastocap::coupling::step::StepField;
use elastocap::geometry::export::body::{BodyMesh, NamedArray};
use elastocap::geometry::export::vtk::FieldGrid;
use elastocap::results::scene_files::field_grid;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::numbers::slice_bytes;

/// The field of a step; `None` if a grid has no scene.
pub(crate) fn of<'py>(
    py: Python<'py>,
    step: &StepResult,
    field: &StepField,
) -> PyResult<Option<Bound<'py, PyDict>>> {
    match (field, &step.scene) {
        (StepField::Grid(field), Some(scene)) => {
            on_grid(py, &field_grid(&scene.scene, field.clone())).map(Some)
        }
        (StepField::Grid(_), None) => Ok(None),
        (StepField::Tetrahedra(mesh), _) => on_mesh(py, mesh).map(Some),
    }
}

fn on_grid<'py>(py: Python<'py>, grid: &FieldGrid) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    let axes = grid.axes.iter().map(|axis| slice_bytes(py, axis)).collect::<PyResult<Vec<_>>>()?;
    dict.set_item("axes", axes)?;
    let bent = grid.bent.as_ref().map(|points| slice_bytes(py, points.as_flattened())).transpose()?;
    dict.set_item("points", bent)?;
    dict.set_item("potential", slice_bytes(py, &grid.potential)?)?;
    dict.set_item("electric_field", slice_bytes(py, grid.electric_field.as_flattened().as_flattened())?)?;
    dict.set_item("relative_permittivity", slice_bytes(py, &grid.relative_permittivity)?)?;
    dict.set_item("body_id", slice_bytes(py, &grid.body_id)?)?;
    dict.set_item("body_names", &grid.body_names)?;
    Ok(dict)
}

fn on_mesh<'py>(py: Python<'py>, mesh: &BodyMesh) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("points", slice_bytes(py, mesh.points.as_flattened())?)?;
    dict.set_item("cells", slice_bytes(py, &mesh.nodes)?)?;
    dict.set_item("point_data", named(py, &mesh.arrays)?)?;
    dict.set_item("cell_data", named(py, &mesh.in_elements)?)?;
    dict.set_item("body_id", slice_bytes(py, &mesh.body_id)?)?;
    dict.set_item("body_names", &mesh.body_names)?;
    Ok(dict)
}

/// A dictionary of the arrays by name, each with the number of components and the numbers.
fn named<'py>(py: Python<'py>, arrays: &[NamedArray]) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    for array in arrays {
        dict.set_item(array.name, (array.components, slice_bytes(py, &array.values)?))?;
    }
    Ok(dict)
}
