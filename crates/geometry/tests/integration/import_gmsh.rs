//! Volume meshes from Gmsh; `data/make_msh.py` writes the files.

use elastocap_geometry::import::gmsh::{VolumeMesh, mesh, mesh_from_path};
use elastocap_geometry::import::obj::Placement;
use elastocap_geometry::import::{ImportError, ImportProblem};
use elastocap_geometry::meshing::tets::{FaceRole, TetMesh};
use elastocap_geometry::scene::{Body, Box3, Scene, Wall};
use elastocap_geometry::shapes::Shape;
use std::path::{Path, PathBuf};

const AS_IS: Placement = Placement { unit: 1.0, translate: [0.0; 3] };
const ONE: &str = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n6\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n5 1 1 1\n9 5 5 5\n$EndNodes\n\
    $Elements\n2\n1 4 2 7 1 1 2 3 4\n2 4 2 8 1 2 3 4 5\n$EndElements\n";

/// One of the meshes that data/make_msh.py makes: from the folder `ELASTOCAP_MSH` if it is set, otherwise
/// from `tests/data`.
fn data(name: &str) -> PathBuf {
    let generated = std::env::var_os("ELASTOCAP_MSH").map(|folder| Path::new(&folder).join(name));
    let stored = || Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name);
    generated.filter(|path| path.is_file()).unwrap_or_else(stored)
}

fn boxes() -> VolumeMesh {
    mesh_from_path(&data("boxes-41-ascii.msh"), AS_IS).unwrap().0
}

fn refused(text: &str) -> ImportProblem {
    mesh(text.as_bytes(), "test.msh", AS_IS).unwrap_err().problem
}

fn scene(conductors: &[&str], dielectrics: &[&str], wall: Wall) -> Scene {
    let shape = |name: &&str| Shape::Physical((*name).to_owned());
    let conductors = conductors.iter().map(|n| Body::conductor(format!("the {n}"), shape(n)));
    let dielectrics = dielectrics.iter().map(|n| Body::dielectric(*n, shape(n), 3.0));
    Scene {
        bodies: conductors.chain(dielectrics).collect(),
        background_permittivity: 1.0,
        domain: Box3::SPACE,
        walls: [[wall; 2]; 3],
    }
}

fn volume(mesh: &TetMesh, region: Option<u32>) -> f64 {
    let count = |t: &usize| region.is_none_or(|r| mesh.regions[*t] == r);
    (0..mesh.tets.len()).filter(count).map(|t| mesh.determinant(t) / 6.0).sum()
}

fn area(mesh: &TetMesh, role: FaceRole) -> f64 {
    let faces = mesh.boundary.iter().filter(|f| f.role == role);
    faces
        .map(|f| {
            let [a, b, c] = f.face.map(|p| mesh.points[p as usize]);
            let (u, v) = ([0, 1, 2].map(|k| b[k] - a[k]), [0, 1, 2].map(|k| c[k] - a[k]));
            let n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
            0.5 * n.iter().map(|x| x * x).sum::<f64>().sqrt()
        })
        .sum()
}

#[test]
fn both_versions_as_text_and_binary_hold_the_same_mesh() {
    let reference = boxes();
    assert_eq!((reference.points.len(), reference.tets.len()), (145, 548));
    for name in ["boxes-41-binary.msh", "boxes-22-ascii.msh", "boxes-22-binary.msh"] {
        let (other, repairs) = mesh_from_path(&data(name), AS_IS).unwrap();
        assert_eq!((repairs.turned_tets, repairs.unused_points), (0, 0));
        assert_eq!(
            (other.points.len(), other.tets.len(), other.faces.len()),
            (145, 548, reference.faces.len())
        );
        for group in &reference.groups {
            let volume = |m: &VolumeMesh| {
                let k = m.groups.iter().position(|g| g == group).unwrap() as u32 + 1;
                (0..m.tets.len()).filter(|&t| m.tet_groups[t] == k).count()
                    + m.face_groups.iter().filter(|&&g| g == k).count()
            };
            assert_eq!(volume(&reference), volume(&other), "{name} {group:?}");
        }
    }
}

#[test]
fn a_volume_group_as_conductor_is_left_out_and_its_faces_hold_its_potential() {
    let mesh = boxes().tet_mesh(&scene(&["inner"], &["filling"], Wall::Grounded)).unwrap();
    assert!((volume(&mesh, None) - 7.0).abs() < 1e-12);
    assert!((volume(&mesh, Some(1)) - 1.0).abs() < 1e-12);
    assert!((area(&mesh, FaceRole::Conductor(0)) - 6.0).abs() < 1e-12);
    assert!((area(&mesh, FaceRole::Grounded) - 24.0).abs() < 1e-12);
    let mut used = vec![false; mesh.points.len()];
    mesh.tets.iter().flatten().for_each(|&p| used[p as usize] = true);
    assert!(used.iter().all(|&u| u) && (0..mesh.tets.len()).all(|t| mesh.determinant(t) > 0.0));
}

#[test]
fn surface_groups_are_sheets_and_walls_have_their_roles() {
    let mut two = scene(&["top of inner", "outer"], &[], Wall::Insulated);
    let mesh = boxes().tet_mesh(&two).unwrap();
    assert!((volume(&mesh, None) - 8.0).abs() < 1e-12);
    assert!((area(&mesh, FaceRole::Conductor(0)) - 1.0).abs() < 1e-12);
    assert!((area(&mesh, FaceRole::Conductor(1)) - 24.0).abs() < 1e-12);
    two = scene(&["inner"], &["filling"], Wall::Open);
    let mesh = boxes().tet_mesh(&two).unwrap();
    assert!((area(&mesh, FaceRole::Open { permittivity: [1.0, 3.0] }) - 24.0).abs() < 1e-12);
    assert_eq!(mesh.center, [0.0; 3]);
    two.walls = [[Wall::Insulated; 2], [Wall::Insulated; 2], [Wall::Grounded, Wall::Insulated]];
    let mesh = boxes().tet_mesh(&two).unwrap();
    assert!((area(&mesh, FaceRole::Grounded) - 4.0).abs() < 1e-12);
}

#[test]
fn unknown_names_are_answered_with_those_there_are() {
    let error = boxes().tet_mesh(&scene(&["iner"], &[], Wall::Grounded)).unwrap_err().to_string();
    assert!(
        error.contains("\"iner\"") && error.contains("\"inner\"") && error.contains("\"top of inner\""),
        "{error}"
    );
    let error = boxes().tet_mesh(&scene(&["inner"], &["outer"], Wall::Grounded)).unwrap_err().to_string();
    assert!(
        error.contains("of volumes") && error.contains("\"filling\"") && !error.contains("top of"),
        "{error}"
    );
}

#[test]
fn conductors_that_touch_one_another_or_a_grounded_wall_are_refused() {
    let found = |s: &Scene| -> ImportError { boxes().tet_mesh(s).unwrap_err() };
    let error = found(&scene(&["inner", "air"], &[], Wall::Insulated));
    assert!(matches!(error.problem, ImportProblem::Touching { .. }), "{error}");
    let error = found(&scene(&["inner", "top of inner"], &[], Wall::Insulated));
    assert!(matches!(error.problem, ImportProblem::Touching { .. }), "{error}");
    let error = found(&scene(&["inner", "inner"], &[], Wall::Insulated));
    assert!(matches!(error.problem, ImportProblem::Touching { .. }), "{error}");
    let error = found(&scene(&["filling"], &[], Wall::Grounded));
    assert!(matches!(error.problem, ImportProblem::TouchingWall { .. }), "{error}");
}

#[test]
fn mirrored_tetrahedra_are_turned_and_unused_points_dropped() {
    let (read, repairs) = mesh(ONE.as_bytes(), "one.msh", AS_IS).unwrap();
    assert_eq!((read.points.len(), repairs.turned_tets, repairs.unused_points), (5, 0, 1));
    let (turned, repairs) = mesh(ONE.replace("1 1 2 3 4", "1 1 3 2 4").as_bytes(), "one.msh", AS_IS).unwrap();
    assert_eq!(repairs.turned_tets, 1);
    assert_eq!(turned.groups[0].name, "7");
}

#[test]
fn meshes_that_are_none_are_refused() {
    assert!(matches!(refused(&ONE.replace("5 1 1 1", "5 0.3 0.3 0.4")), ImportProblem::FlatTet(_)));
    assert!(matches!(
        refused(&ONE.replace("5 1 1 1", "5 0.1 0.1 0.1")),
        ImportProblem::SharedFace { count: 2, .. }
    ));
    assert!(matches!(refused(&ONE.replace("2 3 4 5\n", "1 2 3 4\n")), ImportProblem::SharedFace { .. }));
    // At the same place, but with separate points: a doubled interface.
    let split = ONE
        .replace("$Nodes\n6", "$Nodes\n7")
        .replace("9 5 5 5", "9 5 5 5\n12 1 0 0")
        .replace("2 3 4 5\n", "12 3 4 5\n");
    assert!(matches!(refused(&split), ImportProblem::NonConforming(..)));
    // A corner of one in the middle of the other's face.
    let hanging = ONE.replace("9 5 5 5", "9 0.25 0.25 0.5").replace("2 3 4 5\n", "9 3 4 5\n");
    assert!(matches!(refused(&hanging), ImportProblem::NonConforming(..)));
    assert!(matches!(
        refused(&ONE.replace("2 4 2 8 1 2 3 4 5", "2 2 2 8 1 2 3 5")),
        ImportProblem::LooseFace { .. }
    ));
    assert!(matches!(
        refused(&ONE.replace("1 4 2 7 1 1 2 3 4", "1 4 2 7 1 1 2 3 77")),
        ImportProblem::Malformed { .. }
    ));
    assert!(
        matches!(refused(&ONE.replace("3 0 1 0", "3 0 nan 0")), ImportProblem::Malformed { place, .. } if place == "line 8")
    );
    assert!(matches!(
        refused(&ONE.replace("$Elements\n2", "$Elements\n99999999999")),
        ImportProblem::Malformed { .. }
    ));
    assert!(matches!(refused(&ONE.replace("2.2 0", "1.0 0")), ImportProblem::Unsupported { .. }));
    assert!(matches!(refused(""), ImportProblem::Malformed { .. }));
}

#[test]
fn second_order_elements_are_refused_with_the_option_to_set() {
    let error = mesh_from_path(&data("second-order-41-ascii.msh"), AS_IS).unwrap_err().to_string();
    assert!(error.contains("Mesh.ElementOrder = 1"), "{error}");
}

#[test]
fn a_conductor_that_ends_the_mesh_beside_open_faces_is_refused() {
    let found = |group: &str, wall: Wall| boxes().tet_mesh(&scene(&[group], &[], wall));
    // At the bottom of the mesh, with nothing under it.
    let error = found("filling", Wall::Open).unwrap_err();
    assert!(
        matches!(&error.problem, ImportProblem::EndsAtOpenSpace { name, .. } if name == "the filling"),
        "{error}"
    );
    assert!(error.to_string().contains("name the air"), "{error}");
    assert!(found("filling", Wall::Insulated).is_ok(), "no flux goes there");
    assert!(found("outer", Wall::Open).is_ok(), "a shell around everything");
    let skin = mesh_from_path(&data("shells-41-binary.msh"), AS_IS).unwrap().0;
    assert!(skin.tet_mesh(&scene(&["inner"], &[], Wall::Open)).is_ok(), "the skin of a hollow");
}

#[test]
fn parts_that_nothing_holds_have_no_field_and_are_left_out() {
    // A second tetrahedron far away, and one that shares an edge with the first: no flux gets to either.
    let far = ONE
        .replace("$Nodes\n6", "$Nodes\n12")
        .replace("9 5 5 5\n", "9 5 5 5\n10 6 5 5\n11 5 6 5\n12 5 5 6\n13 -1 0 0\n14 0 -1 0\n20 0 0 -1\n")
        .replace(
            "$Elements\n2\n",
            "$Elements\n5\n3 4 2 9 1 9 10 11 12\n4 4 2 9 1 1 4 13 14\n5 2 2 6 1 1 2 3\n",
        );
    let (read, repairs) = mesh(far.as_bytes(), "far.msh", AS_IS).unwrap();
    assert_eq!((read.tets.len(), repairs.unused_points), (4, 1));
    let held = read.tet_mesh(&scene(&["6"], &[], Wall::Insulated)).unwrap();
    assert_eq!((held.tets.len(), held.points.len()), (2, 5));
    assert!((area(&held, FaceRole::Conductor(0)) - 0.5).abs() < 1e-15);
    let meshed = read.tet_mesh(&scene(&["6"], &[], Wall::Open));
    assert!(matches!(meshed.unwrap_err().problem, ImportProblem::EndsAtOpenSpace { .. }));
}
