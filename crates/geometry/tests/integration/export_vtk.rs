//! `.vtu` files read back by `vtkio`. What VTK and meshio say of them: tests/readers/read_vtu.py.

use elastocap_geometry::export::vtk::{FieldGrid, VtkError, pvd, vtu};
use vtkio::model::{Attribute, DataSet, Piece, UnstructuredGridPiece, VertexNumbers};

/// 2 x 3 x 4 nodes; every value tells where it belongs.
fn small() -> FieldGrid {
    let axes = [vec![0.0, 1e-6], vec![0.0, 1e-6, 3e-6], vec![-1e-3, 0.0, 0.1, 0.3]];
    let cells = 6;
    FieldGrid {
        axes,
        bent: None,
        potential: (0..24).map(|n| f64::from(n) / 3.0).collect(),
        electric_field: (0..cells).map(|c| [f64::from(c), 0.5, -1e9]).collect(),
        relative_permittivity: vec![2.8; 6],
        body_id: (0..cells).collect(),
        body_names: vec!["air".into(), "a--b---c & <d>\u{1}".into()],
    }
}

fn read_back(bytes: &[u8]) -> UnstructuredGridPiece {
    let DataSet::UnstructuredGrid { mut pieces, .. } = vtkio::Vtk::parse_xml(bytes).unwrap().data else {
        panic!("not an unstructured grid");
    };
    let Piece::Inline(piece) = pieces.remove(0) else { panic!("not inline") };
    *piece
}

fn values(attributes: &[Attribute], name: &str) -> Vec<f64> {
    let found = attributes.iter().find(|a| a.name() == name).unwrap();
    let Attribute::DataArray(array) = found else { panic!("{name} is not a data array") };
    array.data.cast_into().unwrap()
}

#[test]
fn fields_come_back_as_they_went_in() {
    let grid = small();
    let piece = read_back(&vtu(&grid).unwrap());
    assert_eq!(values(&piece.data.point, "potential"), grid.potential);
    assert_eq!(values(&piece.data.cell, "electric_field"), grid.electric_field.as_flattened());
    assert_eq!(values(&piece.data.cell, "relative_permittivity"), grid.relative_permittivity);
    assert_eq!(values(&piece.data.cell, "body_id"), [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
}

#[test]
fn points_follow_the_arrays_with_x3_fastest() {
    let grid = small();
    let points: Vec<f64> = read_back(&vtu(&grid).unwrap()).points.cast_into().unwrap();
    // Node (1, 2, 3).
    let node = (3 + 2) * 4 + 3;
    assert_eq!(points[3 * node..], [1e-6, 3e-6, 0.3]);
    assert_eq!(points[3..6], [0.0, 0.0, 0.0]);
}

#[test]
fn cells_are_hexahedra_with_vtk_corners_in_the_order_of_the_cell_arrays() {
    let VertexNumbers::XML { connectivity, offsets } = read_back(&vtu(&small()).unwrap()).cells.cell_verts
    else {
        panic!("not XML");
    };
    assert_eq!(offsets, [8, 16, 24, 32, 40, 48]);
    // meshio makes floating-point numbers of unsigned ones.
    let text = String::from_utf8(vtu(&small()).unwrap()).unwrap();
    for name in ["connectivity", "offsets"] {
        assert!(text.contains(&format!("<DataArray type=\"Int32\" Name=\"{name}\"")), "{text}");
    }
    // Cell (0, 1, 2) is number 5; node (i, j, k) is (3 i + j) 4 + k.
    assert_eq!(connectivity[40..], [6, 18, 22, 10, 7, 19, 23, 11]);
}

#[test]
fn the_head_of_the_file_says_what_the_body_ids_mean() {
    let bytes = vtu(&small()).unwrap();
    let head = String::from_utf8_lossy(&bytes[..200]).into_owned();
    assert!(head.contains("body_id: 0 = air; 1 = a- -b- - -c & <d> "), "{head}");
}

#[test]
fn arrays_that_do_not_fit_the_grid_are_refused_by_name() {
    let mut grid = small();
    grid.body_id.pop();
    assert_eq!(vtu(&grid), Err(VtkError::Length { array: "body_id", expected: 6, found: 5 }));
    let mut grid = small();
    grid.potential[7] = f64::NAN;
    assert_eq!(vtu(&grid), Err(VtkError::NotFinite { array: "potential", index: 7 }));
    let mut grid = small();
    grid.electric_field[2][1] = 1e39;
    assert_eq!(vtu(&grid), Err(VtkError::NotFinite { array: "electric_field", index: 2 }));
    let mut grid = small();
    grid.axes[1][2] = grid.axes[1][1];
    assert_eq!(vtu(&grid), Err(VtkError::Axis { axis: 1 }));
    grid.axes[1].clear();
    assert_eq!(vtu(&grid), Err(VtkError::Axis { axis: 1 }));
}

#[test]
fn a_series_lists_its_steps_by_time_with_relative_names() {
    let text = pvd(&[(0.0, "step-0.vtu".into()), (0.05, "a & \"b\".vtu".into())]).unwrap();
    assert!(text.contains(r#"<DataSet timestep="0.0" group="" part="0" file="step-0.vtu"/>"#), "{text}");
    assert!(
        text.contains(r#"<DataSet timestep="0.05" group="" part="0" file="a &amp; &quot;b&quot;.vtu"/>"#),
        "{text}"
    );
    let absolute = pvd(&[(0.0, "/tmp/x.vtu".into())]);
    assert_eq!(absolute, Err(VtkError::AbsolutePath { file: "/tmp/x.vtu".into() }));
}

#[test]
fn steps_of_equal_time_are_told_apart_by_their_number() {
    let text = pvd(&[(0.1, "a.vtu".into()), (0.1, "b.vtu".into())]).unwrap();
    assert!(text.contains(r#"timestep="0.0""#) && text.contains(r#"timestep="1.0""#), "{text}");
}
