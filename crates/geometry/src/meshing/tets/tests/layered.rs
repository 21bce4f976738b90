//! Meshes of scenes in layers: sizes, conformity, faces, errors.

use super::mesh_checks::{areas, conforming, volume};
use crate::meshing::tets::{FaceRole, LayeredError, LayeredSizing, TetMesh, layered};
use crate::scene::{Body, Box3, Scene, Wall};
use crate::shapes::Shape;
use std::f64::consts::TAU;

const FAR: f64 = f64::INFINITY;

fn cuboid(min: [f64; 3], max: [f64; 3]) -> Shape {
    Shape::Box(Box3 { min, max })
}

fn scene(conductors: Vec<(&str, Shape)>, dielectrics: Vec<(Shape, f64)>) -> Scene {
    let conductors = conductors.into_iter().map(|(name, shape)| Body::conductor(name, shape));
    let dielectrics = dielectrics.into_iter().map(|(shape, eps)| Body::dielectric("filling", shape, eps));
    Scene {
        bodies: conductors.chain(dielectrics).collect(),
        background_permittivity: 1.0,
        domain: Box3::SPACE,
        walls: [[Wall::Open; 2]; 3],
    }
}

fn walled(mut scene: Scene, domain: Box3, wall: Wall) -> Scene {
    scene.domain = domain;
    scene.walls = [[wall; 2]; 3];
    scene
}

fn meshed(scene: &Scene) -> TetMesh {
    let mesh = layered(scene, &LayeredSizing::default()).unwrap().unwrap();
    conforming(&mesh);
    println!("{} points, {} tetrahedra", mesh.points.len(), mesh.tets.len());
    mesh
}

fn area_of(mesh: &TetMesh, role: &str) -> f64 {
    areas(mesh).iter().find(|(name, _)| name == role).unwrap().1
}

fn volume_of(mesh: &TetMesh, region: u32) -> f64 {
    let tets = (0..mesh.tets.len()).filter(|&t| mesh.regions[t] == region);
    tets.map(|t| mesh.determinant(t) / 6.0).sum()
}

#[track_caller]
fn near(value: f64, expected: f64) {
    assert!((value - expected).abs() < 1e-9 * expected.abs(), "{value:e} {expected:e}");
}

/// Every open face sees the centre from its inner side, and the open faces close around it as the box does.
fn open_faces_see_the_center(mesh: &TetMesh) {
    let end = |a: usize, sign: f64| mesh.points.iter().map(|p| sign * p[a]).fold(f64::MIN, f64::max) * sign;
    for face in mesh.boundary.iter().filter(|f| matches!(f.role, FaceRole::Open { .. })) {
        let corners = face.face.map(|p| mesh.points[p as usize]);
        let flat = (0..3).any(|a| {
            [-1.0, 1.0].iter().any(|&sign| {
                let out = end(a, sign);
                corners.iter().all(|p| p[a] == out) && (out - mesh.center[a]) * sign > 0.0
            })
        });
        assert!(flat);
    }
}

fn pattern() -> Scene {
    let um = |points: &[[f64; 2]]| points.iter().map(|p| p.map(|x| x * 1e-6)).collect::<Vec<_>>();
    let corners = [[0.0, 0.0], [300.0, 0.0], [300.0, 100.0], [100.0, 100.0], [100.0, 300.0], [0.0, 300.0]];
    let pad = Shape::Extrusion { axis: 1, from: 0.0, to: 10e-6, outline: um(&corners), arcs: Vec::new() };
    let disc = Shape::Cylinder { axis: 1, base: [220e-6, 0.0, 220e-6], radius: 80e-6, height: 10e-6 };
    let slab = |from: f64, to: f64| cuboid([-FAR, from, -FAR], [FAR, to, FAR]);
    scene(vec![("pad", pad), ("disc", disc)], vec![(slab(-1e-3, 0.0), 4.5), (slab(0.0, 400e-6), 2.8)])
}

#[test]
fn a_pad_beside_a_disc_has_their_areas_and_the_space_around_them() {
    let mesh = meshed(&pattern());
    near(area_of(&mesh, "conductor 0"), 2.0 * 5e-8 + 1.2e-3 * 10e-6);
    let turn = TAU / 32.0;
    let wide = 80e-6 * (turn / turn.sin()).sqrt();
    let disc = TAU / 2.0 * 80e-6 * 80e-6;
    near(area_of(&mesh, "conductor 1"), 2.0 * disc + 32.0 * 2.0 * wide * (turn / 2.0).sin() * 10e-6);
    let side = 2.0 * mesh.points.iter().map(|p| (p[0] - mesh.center[0]).abs()).fold(0.0, f64::max);
    near(volume(&mesh), side.powi(3) - (5e-8 + disc) * 10e-6);
    near(area_of(&mesh, "open"), 6.0 * side * side);
    near(volume_of(&mesh, 1), side * side * 1e-3);
    near(volume_of(&mesh, 2), side * side * 400e-6 - (5e-8 + disc) * 10e-6);
    open_faces_see_the_center(&mesh);
    assert!(mesh.tets.len() < 150_000);
}

#[test]
fn rays_count_only_the_slabs_that_they_can_meet() {
    let mesh = meshed(&pattern());
    let top = mesh.points.iter().map(|p| p[1]).fold(f64::MIN, f64::max);
    for face in &mesh.boundary {
        let FaceRole::Open { permittivity } = face.role else { continue };
        let heights = face.face.map(|p| mesh.points[p as usize][1]);
        let (low, high) =
            (heights.iter().copied().fold(FAR, f64::min), heights.iter().copied().fold(-FAR, f64::max));
        if low == top || low > 400e-6 || high < -1e-3 {
            assert_eq!(permittivity, [1.0, 1.0]);
        }
        if low < 5e-6 && high > 5e-6 {
            assert_eq!(permittivity, [1.0, 4.5]);
        }
    }
    let all = scene(vec![("a", cuboid([0.0; 3], [1.0; 3]))], vec![(Shape::Box(Box3::SPACE), 3.0)]);
    let mesh = meshed(&all);
    assert!(
        mesh.boundary
            .iter()
            .all(|f| !matches!(f.role, FaceRole::Open { permittivity } if permittivity != [3.0; 2]))
    );
    assert!(mesh.regions.iter().all(|&r| r == 1));
}

#[test]
fn thin_gaps_under_a_wide_plate_do_not_ask_for_small_triangles() {
    let mm = |min: [f64; 3], max: [f64; 3]| cuboid(min.map(|x| x * 1e-3), max.map(|x| x * 1e-3));
    let floating = scene(
        vec![
            ("lower", mm([0.0, 0.0, 0.0], [1.0, 0.02, 1.0])),
            ("float", mm([0.2, 0.1, 0.2], [0.8, 0.12, 0.8])),
            ("upper", mm([0.0, 0.2, 0.0], [1.0, 0.22, 1.0])),
        ],
        vec![],
    );
    let mesh = meshed(&floating);
    near(area_of(&mesh, "conductor 1"), 2.0 * 0.36e-6 + 2.4e-3 * 0.02e-3);
    assert!(mesh.tets.len() < 150_000);
    for gap in [1e-2, 1e-4] {
        let plates = scene(
            vec![
                ("plate", mm([0.0, gap, 0.0], [1.0, gap + 0.1, 1.0])),
                ("sheet", mm([0.0, 0.0, 0.0], [1.0, 0.0, 1.0])),
            ],
            vec![],
        );
        let mesh = meshed(&plates);
        near(area_of(&mesh, "conductor 1"), 1e-6);
        assert!(mesh.tets.len() < 100_000);
        open_faces_see_the_center(&mesh);
    }
}

#[test]
fn a_cube_in_a_cube_leaves_seven_eighths() {
    let cube = |a: f64| Box3 { min: [-a; 3], max: [a; 3] };
    let inner = scene(vec![("inner", Shape::Box(cube(0.5)))], vec![]);
    let mesh = meshed(&walled(inner.clone(), cube(1.0), Wall::Grounded));
    near(volume(&mesh), 7.0);
    near(area_of(&mesh, "conductor 0"), 6.0);
    near(area_of(&mesh, "grounded"), 24.0);
    let mesh = meshed(&walled(inner, cube(1.0), Wall::Insulated));
    near(area_of(&mesh, "~insulated"), 24.0);
}

#[test]
fn an_electrode_pair_in_a_layer_keeps_gap_layer_and_walls() {
    let um = |min: [f64; 3], max: [f64; 3]| Box3 { min: min.map(|x| x * 1e-6), max: max.map(|x| x * 1e-6) };
    let pair = scene(
        vec![
            ("left", Shape::Box(um([-325.0, 215.0, -250.0], [-25.0, 235.0, 250.0]))),
            ("right", Shape::Box(um([25.0, 215.0, -250.0], [325.0, 235.0, 250.0]))),
        ],
        vec![(cuboid([-FAR, 0.0, -FAR], [FAR, 450e-6, FAR]), 2.8)],
    );
    let pair = walled(pair, um([-1325.0, 0.0, -1250.0], [1325.0, 1450.0, 1250.0]), Wall::Insulated);
    let mesh = meshed(&pair);
    near(volume_of(&mesh, 0), 2650e-6 * 1000e-6 * 2500e-6);
    near(volume_of(&mesh, 1), 2650e-6 * 450e-6 * 2500e-6 - 2.0 * 300e-6 * 20e-6 * 500e-6);
    for k in ["conductor 0", "conductor 1"] {
        near(area_of(&mesh, k), 2.0 * (300.0 * 500.0 + 800.0 * 20.0) * 1e-12);
    }
    assert!(mesh.tets.len() < 100_000);
}

#[test]
fn bodies_along_any_axis_give_the_same_sizes() {
    let mut counts = Vec::new();
    for axis in 0..3 {
        let turned = |p: [f64; 3]| [0, 1, 2].map(|k| p[(k + 3 - axis) % 3]);
        let disc = Shape::Cylinder { axis, base: [0.0; 3], radius: 1.0, height: 0.5 };
        let block = cuboid(turned([1.0, -1.0, -1.0]), turned([1.5, 1.0, 1.0]));
        let mesh = meshed(&scene(vec![("disc", disc), ("block", block)], vec![]));
        near(area_of(&mesh, "conductor 1"), 12.0);
        counts.push(mesh.tets.len());
    }
    assert!(counts.iter().all(|&n| 2 * n > counts[0] && n < 2 * counts[0]), "{counts:?}");
}

/// A comb: a spine with fingers upward, their ends at `to`.
fn comb(fingers: usize, from: f64, to: f64, shift: f64) -> Vec<[f64; 2]> {
    let mut outline = vec![[shift, from], [shift + 4.0 * fingers as f64, from]];
    for k in (0..fingers).rev() {
        let x = shift + 4.0 * k as f64;
        let root = from + 0.1 * (to - from);
        outline.extend([[x + 1.0, root], [x + 1.0, to], [x, to], [x, root]]);
    }
    outline
}

#[test]
fn combs_and_spirals_are_met_exactly() {
    let pull =
        |outline: Vec<[f64; 2]>| Shape::Extrusion { axis: 2, from: 0.0, to: 0.1, outline, arcs: Vec::new() };
    let up = comb(20, 0.0, 40.0, 0.0);
    let down = comb(20, 44.0, 5.0, 2.0);
    let area = crate::meshing::plane::area(&up).abs();
    let mesh = meshed(&scene(vec![("up", pull(up.clone())), ("down", pull(down))], vec![]));
    let around: f64 = (0..up.len())
        .map(|i| {
            let (a, b) = (up[i], up[(i + 1) % up.len()]);
            (a[0] - b[0]).hypot(a[1] - b[1])
        })
        .sum();
    near(area_of(&mesh, "conductor 0"), 2.0 * area + 0.1 * around);
    assert!(mesh.tets.len() < 700_000);

    let arm = |wide: f64| {
        (0..=120).map(move |i| {
            let turn = TAU * i as f64 / 40.0;
            let r = 2.0 + 3.0 * turn / TAU + wide;
            [r * turn.cos(), r * turn.sin()]
        })
    };
    let spiral: Vec<_> = arm(0.0).chain(arm(1.0).collect::<Vec<_>>().into_iter().rev()).collect();
    let area = crate::meshing::plane::area(&spiral).abs();
    let mesh = meshed(&scene(vec![("spiral", pull(spiral))], vec![]));
    let top: f64 = mesh
        .boundary
        .iter()
        .filter(|f| {
            matches!(f.role, FaceRole::Conductor(0))
                && f.face.iter().all(|&p| mesh.points[p as usize][2] == 0.1)
        })
        .map(|f| super::mesh_checks::area(&mesh, f.face))
        .sum();
    near(top, area);
}

#[test]
fn nasty_outlines_are_meshed_or_named() {
    let flat = |outline: &[[f64; 2]]| {
        let shape =
            Shape::Extrusion { axis: 2, from: 0.0, to: 0.0, outline: outline.to_vec(), arcs: Vec::new() };
        layered(&scene(vec![("odd", shape)], vec![]), &LayeredSizing::default()).unwrap()
    };
    let e = 1e-12;
    let odd =
        [[0.0, 1.0], [0.5, 1.0], [1.0, 1.0], [1.0, 1.0 + e], [1.0, 0.0], [e, 0.0], [0.0, 0.0], [0.0, 0.5]];
    let mesh = flat(&odd).unwrap();
    conforming(&mesh);
    assert!((area_of(&mesh, "conductor 0") - 1.0).abs() < 1e-9);
    let name = || "odd".to_string();
    let bow = [[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]];
    assert_eq!(flat(&bow), Err(LayeredError::Crossing { name: name() }));
    let spike = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [1.0, 2.0], [1.0, 1.0], [0.0, 1.0]];
    assert_eq!(flat(&spike), Err(LayeredError::Crossing { name: name() }));
    assert_eq!(flat(&[[0.0, 0.0], [1.0, 0.0]]), Err(LayeredError::Degenerate { name: name() }));
    assert_eq!(flat(&[[0.0, 0.0], [f64::NAN, 0.0], [1.0, 1.0]]), Err(LayeredError::Size { name: name() }));
    assert!(flat(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]]).is_err());
}

#[test]
fn conductors_that_touch_or_overlap_are_named() {
    let first = || ("a", cuboid([0.0; 3], [1.0; 3]));
    for second in [
        cuboid([1.0, 0.0, 0.0], [2.0, 1.0, 1.0]),
        cuboid([0.5, 0.5, 0.0], [2.0, 1.0, 1.0]),
        cuboid([0.25; 3], [0.75; 3]),
        cuboid([1.0; 3], [2.0; 3]),
        cuboid([0.0, 0.0, 1.0], [1.0, 1.0, 1.0]),
    ] {
        let scene = scene(vec![first(), ("b", second)], vec![]);
        let error = layered(&scene, &LayeredSizing::default()).unwrap();
        assert!(error.is_err(), "meshed");
        assert_eq!(error, Err(LayeredError::Touching { first: "a".into(), second: "b".into() }));
    }
}

#[test]
fn outlines_of_different_layers_may_cross_and_the_later_dielectric_wins() {
    let crossed = scene(
        vec![
            ("a", cuboid([0.0, 0.0, 0.0], [3.0, 1.0, 0.1])),
            ("b", cuboid([1.0, -1.0, 0.3], [2.0, 2.0, 0.4])),
        ],
        vec![
            (cuboid([-1.0, -1.0, -1.0], [1.0, 1.0, -0.5]), 2.0),
            (Shape::Cylinder { axis: 2, base: [0.0, 0.0, -1.0], radius: 0.5, height: 0.5 }, 4.0),
            (cuboid([-FAR, -FAR, 5.0], [1.0 / 3.0, FAR, FAR]), 3.0),
        ],
    );
    let mesh = meshed(&crossed);
    let disc = TAU / 2.0 * 0.25 * 0.5;
    near(volume_of(&mesh, 1), 2.0 - disc);
    near(volume_of(&mesh, 2), disc);
    assert_eq!(mesh, meshed(&crossed));
}

#[test]
fn other_scenes_are_left_to_others() {
    let ball = Shape::Sphere { center: [0.0; 3], radius: 1.0 };
    assert!(layered(&scene(vec![("ball", ball)], vec![]), &LayeredSizing::default()).is_none());
    let disc = |axis| Shape::Cylinder { axis, base: [3.0 * axis as f64; 3], radius: 1.0, height: 1.0 };
    assert!(
        layered(&scene(vec![("a", disc(0)), ("b", disc(1))], vec![]), &LayeredSizing::default()).is_none()
    );
}

#[test]
fn over_a_grounded_floor_rays_start_from_the_floor() {
    let mut over = scene(
        vec![("plate", cuboid([0.0, 0.1, 0.0], [1.0, 0.2, 1.0]))],
        vec![(cuboid([-FAR, 0.0, -FAR], [FAR, 0.1, FAR]), 2.0)],
    );
    over.domain.min[1] = 0.0;
    over.walls[1][0] = Wall::Grounded;
    let mesh = meshed(&over);
    assert_eq!(mesh.center, [0.5, 0.0, 0.5]);
    let side = 2.0 * mesh.points.iter().map(|p| p[1]).fold(0.0, f64::max);
    near(area_of(&mesh, "grounded"), side * side);
    near(area_of(&mesh, "open"), 3.0 * side * side);
    open_faces_see_the_center(&mesh);
    over.walls[1][1] = Wall::Grounded;
    over.domain.max[1] = 1.0;
    assert_eq!(layered(&over, &LayeredSizing::default()), Some(Err(LayeredError::OpenBetweenWalls)));
}

#[test]
fn a_refined_mesh_of_layers_conforms_and_keeps_its_areas() {
    let mesh = meshed(&pattern());
    let marked: Vec<u32> = (0..mesh.tets.len() as u32).step_by(97).collect();
    let fine = mesh.bisected(&marked, 3).mesh;
    conforming(&fine);
    assert!((volume(&fine) / volume(&mesh) - 1.0).abs() < 1e-9);
    let open =
        |mesh: &TetMesh| areas(mesh).into_iter().filter(|(name, _)| name != "~insulated").collect::<Vec<_>>();
    for ((role, old), (other, new)) in open(&mesh).into_iter().zip(open(&fine)) {
        assert_eq!(role, other);
        near(new, old);
    }
    println!("{} to {}", mesh.tets.len(), fine.tets.len());
}

#[test]
fn random_polygons_give_a_conforming_mesh_or_an_error() {
    let mut state = 5_u64;
    let mut next = |n: u64| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) % n
    };
    let mut meshes = 0;
    for _ in 0..30 {
        // Few places and tiny shifts: doubled corners, common sides, sides within rounding of one another.
        let mut outline = |corners: u64| -> Vec<[f64; 2]> {
            let mut place = || next(5) as f64 + [0.0, 0.0, 1e-15, 1e-10, 0.1][next(5) as usize];
            (0..corners).map(|_| [place(), place()]).collect()
        };
        let (a, b, c) = (outline(3), outline(3), outline(4));
        let pull = |outline, from: f64| Shape::Extrusion {
            axis: 2,
            from,
            to: from + 0.5,
            outline,
            arcs: Vec::new(),
        };
        let scene = scene(vec![("a", pull(a, 0.0)), ("b", pull(b, 1.0))], vec![(pull(c, 0.25), 2.0)]);
        if let Some(Ok(mesh)) = layered(&scene, &LayeredSizing { growth: 1.5, ..LayeredSizing::default() }) {
            conforming(&mesh);
            meshes += 1;
        }
    }
    println!("{meshes} meshes");
    assert!(meshes > 2);
}

/// Boxes that follow one another along the first axis, between the walls across the second and third.
fn row_of_boxes(ends: &[f64], across: [f64; 2]) -> Vec<(Shape, f64)> {
    let slab = |w: &[f64]| cuboid([w[0], 0.0, 0.0], [w[1], across[0], across[1]]);
    ends.windows(2).map(|w| (slab(w), 2.0)).collect()
}

/// Rounding once set the points of a common side apart by its last digit, and refinement went down to there.
#[test]
fn points_of_a_side_that_two_outlines_have_in_common_are_the_same_from_both() {
    let (ends, across) =
        ([0.0, 0.05, 0.606_597_567_353_568_6, 1.147_866_730_890_955_4], [1.0, 1.050_531_365_301_284_2]);
    let sheet = cuboid([0.0, 0.5, 0.0], [ends[3], 0.5, across[1]]);
    let domain = Box3 { min: [0.0; 3], max: [ends[3], across[0], across[1]] };
    let whole = scene(vec![("sheet", sheet)], row_of_boxes(&ends, across));
    let mesh = meshed(&walled(whole, domain, Wall::Insulated));
    let edges = mesh.tets.iter().flat_map(|t| (0..4).flat_map(move |i| (0..i).map(move |j| [t[i], t[j]])));
    let length = |[a, b]: [u32; 2]| {
        let [a, b] = [a, b].map(|p| mesh.points[p as usize]);
        (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
    };
    let shortest = edges.map(length).fold(f64::INFINITY, f64::min);
    assert!(shortest > 1e-3, "{shortest:e}");
}

#[test]
fn layers_follow_the_axis_across_which_bodies_fill_the_walls() {
    // The second axis has the shortest conductors, but all outlines across it are long and narrow.
    let across = [0.4, 3.0];
    let ends = [0.0, 0.01, 0.02, 0.6, 0.61, 1.0];
    let plate = cuboid([1.0, 0.0, 0.0], [1.01, across[0], across[1]]);
    let last = cuboid([-0.01, 0.0, 0.0], [0.0, across[0], across[1]]);
    let domain = Box3 { min: [-0.01, 0.0, 0.0], max: [1.01, across[0], across[1]] };
    let whole = scene(vec![("low", last), ("high", plate)], row_of_boxes(&ends, across));
    let mesh = meshed(&walled(whole, domain, Wall::Insulated));
    assert!(mesh.tets.len() < 2_000, "{}", mesh.tets.len());
}
