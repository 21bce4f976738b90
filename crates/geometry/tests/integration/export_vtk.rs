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
        electric_field: (0..24)
            .map(|n| [[f64::from(n), 0.5, -1e9], [100.0 + f64::from(n), 0.5, 1e9]])
            .collect(),
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

/// The grid with all its cells in one body.
fn of_one_body() -> FieldGrid {
    FieldGrid { body_id: vec![0; 6], ..small() }
}

fn connectivity(piece: &UnstructuredGridPiece) -> &[u64] {
    let VertexNumbers::XML { connectivity, offsets } = &piece.cells.cell_verts else { panic!("not XML") };
    assert_eq!(*offsets, [8, 16, 24, 32, 40, 48]);
    connectivity
}

#[test]
fn fields_come_back_as_they_went_in() {
    let grid = of_one_body();
    let piece = read_back(&vtu(&grid).unwrap());
    assert_eq!(values(&piece.data.point, "potential"), grid.potential);
    assert_eq!(values(&piece.data.cell, "relative_permittivity"), vec![f64::from(2.8_f32); 6]);
    assert_eq!(values(&piece.data.cell, "body_id"), vec![0.0; 6]);
    // Within a body the field at a node is the mean of what it is on the node's sides; at an end of the axis
    // there is one.
    let field = values(&piece.data.point, "electric_field");
    let node = |i: usize, j: usize, k: usize| (3 * i + j) * 4 + k;
    for (at, x1, x3) in [((0, 1, 1), 100.0, 0.0), ((1, 1, 0), 0.0, 1e9), ((1, 2, 3), 0.0, -1e9)] {
        let n = node(at.0, at.1, at.2);
        assert_eq!(field[3 * n..3 * n + 3], [x1 + n as f64, 0.5, x3], "{at:?}");
    }
}

#[test]
fn bodies_that_meet_have_points_of_their_own_with_the_field_on_their_side() {
    // Two bodies that meet at the second node of x2.
    let grid = FieldGrid { body_id: vec![0, 0, 0, 1, 1, 1], ..small() };
    let grid = FieldGrid {
        electric_field: grid.electric_field.iter().map(|_| [[1.0, 2.0, 3.0], [1.0, 4.0, 3.0]]).collect(),
        ..grid
    };
    let piece = read_back(&vtu(&grid).unwrap());
    assert_eq!(piece.num_points(), 24 + 8);
    let points: Vec<f64> = piece.points.cast_into().unwrap();
    let field = values(&piece.data.point, "electric_field");
    let potential = values(&piece.data.point, "potential");
    for (cell, corners) in connectivity(&piece).chunks(8).enumerate() {
        for &point in corners {
            let point = point as usize;
            let [x1, x2, x3] = [0, 1, 2].map(|a| points[3 * point + a]);
            let on_plane = x2 == 1e-6;
            let expected = if on_plane && cell < 3 || x2 == 3e-6 { 2.0 } else { 4.0 };
            assert_eq!(field[3 * point..3 * point + 3], [1.0, expected, 3.0], "cell {cell}, {x1} {x2} {x3}");
            let place = |a: usize, x: f64| grid.axes[a].iter().position(|at| *at == x).unwrap();
            let node = (3 * place(0, x1) + place(1, x2)) * 4 + place(2, x3);
            assert_eq!(potential[point], grid.potential[node]);
        }
    }
}

#[test]
fn points_follow_the_arrays_with_x3_fastest() {
    let points: Vec<f64> = read_back(&vtu(&of_one_body()).unwrap()).points.cast_into().unwrap();
    // Node (1, 2, 3).
    let node = (3 + 2) * 4 + 3;
    assert_eq!(points[3 * node..], [1e-6, 3e-6, 0.3]);
    assert_eq!(points[3..6], [0.0, 0.0, 0.0]);
}

#[test]
fn cells_are_hexahedra_with_vtk_corners_in_the_order_of_the_cell_arrays() {
    // meshio makes floating-point numbers of unsigned ones.
    let bytes = vtu(&of_one_body()).unwrap();
    let text = String::from_utf8(bytes.clone()).unwrap();
    for name in ["connectivity", "offsets"] {
        assert!(text.contains(&format!("<DataArray type=\"Int32\" Name=\"{name}\"")), "{text}");
    }
    // Cell (0, 1, 2) is number 5; node (i, j, k) is (3 i + j) 4 + k.
    assert_eq!(connectivity(&read_back(&bytes))[40..], [6, 18, 22, 10, 7, 19, 23, 11]);
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
    grid.electric_field[2][1][1] = 1e39;
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
