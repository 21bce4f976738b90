//! Meshes of scenes whose bodies reach across walls, and of parts of symmetric scenes.

use super::mesh_checks::{areas, conforming, volume};
use crate::meshing::tets::{
    BoundaryFace, FaceRole, LayeredSizing, MeshError, Sizing, TetMesh, layered, mesh,
};
use crate::mirror::{part, planes};
use crate::samples::{cube, scene};
use crate::scene::{Body, Box3, MirrorPlane, Scene, Wall};
use crate::shapes::{Shape, TriangleSurface};

fn walls(half: f64) -> Box3 {
    Box3 { min: [-half; 3], max: [half; 3] }
}

/// The surface of a cube, turned about x3.
fn turned(half: f64, turn: f64) -> TriangleSurface {
    let (s, c) = turn.sin_cos();
    let mut surface = cube([0.0; 3], half);
    for p in &mut surface.points {
        *p = [c * p[0] - s * p[1], s * p[0] + c * p[1], p[2]];
    }
    surface
}

/// Meshes a scene and the part of it above its mirror planes, of which there must be as many as `expected`.
/// Checks that the part conforms, has its share of the volume and of the areas, and makes up the whole
/// together with its reflections. Returns the meshes of the part and of the whole.
fn compared(scene: &Scene, expected: usize, sizing: &Sizing) -> [TetMesh; 2] {
    compared_by(scene, expected, |scene| mesh(scene, sizing).unwrap().mesh)
}

/// As [`compared`], with any mesher.
fn compared_by(scene: &Scene, expected: usize, mesh: impl Fn(&Scene) -> TetMesh) -> [TetMesh; 2] {
    let found = planes(scene);
    assert_eq!(found.iter().flatten().count(), expected, "{found:?}");
    let whole = mesh(scene);
    let piece = mesh(&part(scene, &found));
    conforming(&piece);
    let times = f64::from(1 << expected);
    let ratio = times * volume(&piece) / volume(&whole);
    assert!((ratio - 1.0).abs() < 1e-9, "{ratio}");
    let (of_part, of_whole) = (areas(&piece), areas(&whole));
    let keeps = found.iter().flatten().all(MirrorPlane::keeps_conductors);
    for (role, area) in of_whole.iter().filter(|(role, _)| keeps && role != "~insulated") {
        let found = of_part.iter().find(|(r, _)| r == role).map_or(0.0, |r| r.1);
        assert!((times * found / area - 1.0).abs() < 1e-9, "{role}: {found} {area}");
    }
    let mut together = piece.clone();
    for (axis, plane) in found.iter().enumerate() {
        if let Some(plane) = plane {
            together = together.reflected(axis, plane).mesh;
        }
    }
    conforming(&together);
    assert!((volume(&together) / volume(&whole) - 1.0).abs() < 1e-9);
    let regions = |m: &TetMesh| {
        let mut out = vec![0.0; scene.dielectrics().count() + 1];
        (0..m.tets.len()).for_each(|t| out[m.regions[t] as usize] += m.determinant(t) / 6.0);
        out
    };
    for (a, b) in regions(&together).iter().zip(regions(&whole)) {
        assert!((a - b).abs() < 1e-9 * volume(&whole), "{a} {b}");
    }
    for ((role, a), (other, b)) in areas(&together).iter().zip(of_whole) {
        assert!(*role == other && (a - b).abs() < 1e-9 * volume(&whole).powf(2.0 / 3.0), "{role}: {a} {b}");
    }
    [piece, whole]
}

#[test]
fn an_eighth_of_an_imported_cube_in_a_box_is_an_eighth_of_it() {
    let whole_scene = scene(walls(1.0), Wall::Grounded, vec![Shape::Surface(turned(0.5, 0.0))]);
    for facet in [0.5, 0.3, 0.2, 0.11] {
        let [part, whole] = compared(&whole_scene, 3, &Sizing { facet, ..Sizing::default() });
        assert!((volume(&part) - 7.0 / 8.0).abs() < 1e-12);
        let counts = [part.tets.len(), whole.tets.len()];
        assert!(2 * counts[0] < counts[1], "{counts:?}");
    }
}

#[test]
fn a_turned_cube_keeps_the_plane_across_its_axis() {
    let whole_scene = scene(walls(1.0), Wall::Grounded, vec![Shape::Surface(turned(0.5, 0.3))]);
    compared(&whole_scene, 1, &Sizing::default());
    // At 45 degrees, edges of the cube lie in mirror planes.
    let whole_scene =
        scene(walls(1.0), Wall::Grounded, vec![Shape::Surface(turned(0.5, std::f64::consts::FRAC_PI_4))]);
    compared(&whole_scene, 3, &Sizing::default());
}

#[test]
fn two_balls_in_open_space_are_cut_by_two_planes() {
    let a = Shape::Sphere { center: [0.0, 0.3, 0.1], radius: 0.01 };
    let b = Shape::Sphere { center: [0.05, 0.3, 0.1], radius: 0.02 };
    let whole_scene = scene(Box3::SPACE, Wall::Open, vec![a, b]);
    let [part, _] = compared(&whole_scene, 2, &Sizing::default());
    assert_eq!(part.center[1..], [0.3, 0.1]);
    assert!((part.center[0] - 0.03).abs() < 1e-15);
    assert!(part.boundary.iter().any(|f| matches!(f.role, FaceRole::Open { .. })));
}

#[test]
fn two_equal_balls_with_a_bead_each_change_places_about_the_plane_between_them() {
    let ball = |x: f64, radius: f64| Shape::Sphere { center: [x, 0.3, 0.1], radius };
    let mut whole_scene = scene(Box3::SPACE, Wall::Open, vec![ball(0.0, 0.01), ball(0.05, 0.01)]);
    for (name, x) in [("left", -0.03), ("right", 0.08)] {
        whole_scene.bodies.push(Body::dielectric(name, ball(x, 0.015), 3.0));
    }
    let [part, _] = compared(&whole_scene, 3, &Sizing::default());
    assert_eq!(part.center[1..], [0.3, 0.1]);
    assert!((part.center[0] - 0.025).abs() < 1e-15);
    assert!(part.boundary.iter().all(|f| f.role != FaceRole::Conductor(0)));
}

#[test]
fn layers_of_balls_are_cut_by_three_planes() {
    let center = [1e-3, 0.0, -2e-3];
    let inner = Shape::Sphere { center, radius: 1e-3 };
    let outer = Shape::Shell { center, radius: 2e-3 };
    let mut whole_scene = scene(Box3::SPACE, Wall::Open, vec![inner, outer]);
    let shape = Shape::Sphere { center, radius: 1.5e-3 };
    whole_scene.bodies.push(Body::dielectric("layer", shape, 3.0));
    for facet in [0.3, 0.15] {
        compared(&whole_scene, 3, &Sizing { facet, ..Sizing::default() });
    }
}

#[test]
fn an_l_over_a_board_is_cut_across_its_axis_only() {
    let outline = vec![[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [1.0, 1.0], [1.0, 3.0], [0.0, 3.0]];
    let pad = Shape::Extrusion { axis: 1, from: 0.5, to: 1.5, outline, arcs: Vec::new() };
    let rod = Shape::Cylinder { axis: 0, base: [-1.0, 1.0, -3.0], radius: 0.5, height: 1.0 };
    let whole_scene = scene(Box3::SPACE, Wall::Open, vec![pad, rod]);
    compared(&whole_scene, 1, &Sizing::default());
}

#[test]
fn an_outline_in_several_pieces_is_cut_where_it_crosses_the_wall() {
    // A comb of three teeth that a wall cuts off its back; the wall also meets a corner between two teeth.
    let outline = vec![
        [0.0, -1.0],
        [5.0, -1.0],
        [5.0, 2.0],
        [4.0, 2.0],
        [4.0, 0.5],
        [3.0, 0.5],
        [3.0, 2.0],
        [2.0, 2.0],
        [1.5, 1.0],
        [1.0, 2.0],
        [0.0, 2.0],
    ];
    for at in [1.0, 0.5, 0.75] {
        let mut domain = Box3 { min: [-2.0, -2.0, at], max: [7.0, 2.0, 4.0] };
        let comb =
            Shape::Extrusion { axis: 1, from: -0.5, to: 0.5, outline: outline.clone(), arcs: Vec::new() };
        let mut whole_scene = scene(domain, Wall::Grounded, vec![comb]);
        whole_scene.walls[2][0] = Wall::Insulated;
        let out = mesh(&whole_scene, &Sizing::default()).unwrap().mesh;
        conforming(&out);
        let metal = 9.0 * 4.0 * (4.0 - at) - volume(&out);
        let area = 4.0 * (2.0 - at) - 0.5;
        assert!((metal - area).abs() < 1e-9, "{at}: {metal} {area}");
        // A body that lies wholly beyond the wall leaves no trace in the mesh.
        domain.min[2] = 2.5;
        whole_scene.domain = domain;
        let out = mesh(&whole_scene, &Sizing::default()).unwrap().mesh;
        assert!((volume(&out) - 9.0 * 4.0 * 1.5).abs() < 1e-9);
        assert!(!out.boundary.iter().any(|f| matches!(f.role, FaceRole::Conductor(_))));
    }
}

#[test]
fn a_conductor_through_a_grounded_wall_is_refused_by_name() {
    let ball = Shape::Sphere { center: [0.9, 0.0, 0.0], radius: 0.3 };
    let mut whole_scene = scene(walls(1.0), Wall::Grounded, vec![ball.clone()]);
    let refused = mesh(&whole_scene, &Sizing::default());
    assert!(matches!(&refused, Err(MeshError::Crossing { first, .. }) if first == "c0"), "{refused:?}");
    whole_scene.walls[0][1] = Wall::Insulated;
    conforming(&mesh(&whole_scene, &Sizing::default()).unwrap().mesh);
    // A dielectric may reach through the wall.
    let mut whole_scene = scene(walls(1.0), Wall::Grounded, Vec::new());
    whole_scene.bodies.push(Body::dielectric("bead", ball, 3.0));
    let out = mesh(&whole_scene, &Sizing::default()).unwrap().mesh;
    conforming(&out);
    assert!((volume(&out) - 8.0).abs() < 1e-12 && out.regions.contains(&1));
}

#[test]
fn scenes_in_layers_are_cut_by_their_planes() {
    let by_layers = |circle: usize| {
        move |scene: &Scene| {
            layered(scene, &LayeredSizing { circle, ..LayeredSizing::default() }).unwrap().unwrap()
        }
    };
    let t = [[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [2.0, 1.0], [2.0, 3.0], [1.0, 3.0], [1.0, 1.0], [0.0, 1.0]];
    let pad = Shape::Extrusion { axis: 1, from: 0.0, to: 0.1, outline: t.to_vec(), arcs: Vec::new() };
    let disc = Shape::Cylinder { axis: 1, base: [1.5, 0.0, 4.2], radius: 0.8, height: 0.1 };
    let mut whole_scene = scene(Box3::SPACE, Wall::Open, vec![pad.clone(), disc.clone()]);
    let mut board = Box3::SPACE;
    (board.min[1], board.max[1]) = (-10.0, 0.0);
    whole_scene.bodies.push(Body::dielectric("board", Shape::Box(board), 4.5));
    compared_by(&whole_scene, 1, by_layers(32));
    // The disc over the board alone has two mirror planes.
    whole_scene.bodies.remove(0);
    compared_by(&whole_scene, 2, by_layers(30));
    // A comb of two teeth has two as well, and a wall that cuts off its back leaves two pieces.
    let comb =
        [[0.0, 0.0], [6.0, 0.0], [6.0, 1.0], [1.0, 1.0], [1.0, 2.0], [6.0, 2.0], [6.0, 3.0], [0.0, 3.0]];
    let comb = |from: f64| Shape::Extrusion {
        axis: 2,
        from,
        to: from + 0.2,
        outline: comb.to_vec(),
        arcs: Vec::new(),
    };
    let whole_scene = scene(Box3::SPACE, Wall::Open, vec![comb(0.0)]);
    compared_by(&whole_scene, 2, by_layers(32));
    let domain = Box3 { min: [3.0, -1.0, -1.0], max: [7.0, 4.0, 1.0] };
    let mut whole_scene = scene(domain, Wall::Grounded, vec![comb(0.0)]);
    whole_scene.walls[0][0] = Wall::Insulated;
    let out = by_layers(32)(&whole_scene);
    conforming(&out);
    assert!((volume(&out) - (40.0 - 6.0 * 0.2)).abs() < 1e-9, "{}", volume(&out));
}

#[test]
fn open_space_between_walls_is_refused() {
    let ball = Shape::Sphere { center: [0.0; 3], radius: 0.3 };
    let mut whole_scene = scene(walls(1.0), Wall::Insulated, vec![ball]);
    whole_scene.walls[1] = [Wall::Open; 2];
    (whole_scene.domain.min[1], whole_scene.domain.max[1]) = (f64::NEG_INFINITY, f64::INFINITY);
    assert_eq!(mesh(&whole_scene, &Sizing::default()), Err(MeshError::OpenBetweenWalls));
}

#[test]
fn a_face_in_the_mirror_plane_is_kept_once_with_its_role() {
    let face = |face, k| BoundaryFace { face, role: FaceRole::Conductor(k) };
    let half = TetMesh {
        points: vec![[0.0, 0.0, 2.0], [1.0, 0.0, 2.0], [0.0, 1.0, 2.0], [0.0, 0.0, 3.0]],
        tets: vec![[0, 1, 2, 3]],
        regions: vec![0],
        boundary: vec![face([0, 1, 2], 0), face([0, 1, 3], 1)],
        ..TetMesh::default()
    };
    let plane = MirrorPlane { at: 2.0, conductors: vec![0, 1], dielectrics: Vec::new() };
    let whole = half.reflected(2, &plane);
    conforming(&whole.mesh);
    assert_eq!(whole.mesh.points[4], [0.0, 0.0, 1.0]);
    assert_eq!(whole.source, [0, 1, 2, 3, 3]);
    let expected = [("conductor 0", 0.5), ("conductor 1", 1.0)];
    for ((role, area), (name, exact)) in areas(&whole.mesh).iter().zip(expected) {
        assert!(role == name && (area - exact).abs() < 1e-15, "{role}: {area}");
    }
}
