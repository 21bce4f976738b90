//! Deformed bodies read back by `vtkio`. What VTK and meshio say of them: tests/readers/read_vtu.py.

use elastocap_geometry::export::body::{BodyMesh, Element, NamedArray, body_vtu};
use elastocap_geometry::export::vtk::VtkError;
use vtkio::model::{DataSet, Piece, VertexNumbers};

/// One element whose nodes stand where their numbers say.
fn single(element: Element) -> BodyMesh {
    let count = if element == Element::Quadrilateral { 9 } else { 27 };
    let points = (0..count).map(|n| [n % 3, n / 3 % 3, n / 9].map(f64::from)).collect();
    let values = (0..count).map(f64::from).collect();
    BodyMesh {
        element,
        points,
        nodes: (0..count as u32).collect(),
        arrays: vec![NamedArray { name: "pressure", components: 1, values }],
        in_elements: vec![NamedArray { name: "field", components: 3, values: vec![1.0, 2.0, 3.0] }],
        body_id: vec![0],
        body_names: vec!["layer".into()],
    }
}

fn corners(body: &BodyMesh) -> Vec<[f64; 3]> {
    let DataSet::UnstructuredGrid { mut pieces, .. } =
        vtkio::Vtk::parse_xml(body_vtu(body).unwrap().as_slice()).unwrap().data
    else {
        panic!("not an unstructured grid");
    };
    let Piece::Inline(piece) = pieces.remove(0) else { panic!("not inline") };
    let VertexNumbers::XML { connectivity, .. } = piece.cells.cell_verts else { panic!("not XML") };
    let points: Vec<f64> = piece.points.cast_into().unwrap();
    connectivity.iter().map(|&n| [0, 1, 2].map(|k| points[3 * n as usize + k])).collect()
}

#[test]
fn nodes_stand_in_the_order_that_vtk_has_for_quadratic_elements() {
    let found = corners(&single(Element::Quadrilateral));
    let plane: Vec<[f64; 2]> = found.iter().map(|x| [x[0], x[1]]).collect();
    let expected =
        [[0, 0], [2, 0], [2, 2], [0, 2], [1, 0], [2, 1], [1, 2], [0, 1], [1, 1]].map(|x| x.map(f64::from));
    assert_eq!(plane, expected);

    let found = corners(&single(Element::Hexahedron));
    // vtkTriQuadraticHexahedron: corners, edges of the bottom, of the top, upright ones, then the faces
    // -x1, +x1, -x2, +x2, -x3, +x3 and the middle.
    let middle_of = |nodes: &[usize]| {
        let mean = |k: usize| nodes.iter().map(|&n| found[n][k]).sum::<f64>() / nodes.len() as f64;
        [mean(0), mean(1), mean(2)]
    };
    let edges =
        [[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]];
    for (k, edge) in edges.iter().enumerate() {
        assert_eq!(found[8 + k], middle_of(edge), "edge {k}");
    }
    let faces = [[0, 3, 7, 4], [1, 2, 6, 5], [0, 1, 5, 4], [3, 2, 6, 7], [0, 1, 2, 3], [4, 5, 6, 7]];
    for (k, face) in faces.iter().enumerate() {
        assert_eq!(found[20 + k], middle_of(face), "face {k}");
    }
    assert_eq!(found[26], [1.0; 3]);
}

#[test]
fn what_does_not_fit_is_refused() {
    let mut body = single(Element::Quadrilateral);
    body.arrays[0].values.pop();
    assert!(matches!(body_vtu(&body), Err(VtkError::Length { array: "pressure", .. })));
    let mut body = single(Element::Quadrilateral);
    body.points[4][1] = f64::NAN;
    assert!(matches!(body_vtu(&body), Err(VtkError::NotFinite { array: "points", index: 13 })));
    let mut body = single(Element::Quadrilateral);
    body.nodes[3] = 9;
    assert!(matches!(body_vtu(&body), Err(VtkError::Length { array: "points", .. })));
}
