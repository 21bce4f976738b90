mod crossing_bodies;
mod flat_tetrahedra;
mod sharp_surfaces;
mod thin_metal;

use super::delaunay::{Delaunay, Insertion, Refusal};
use super::{MeshError, Meshed, Sizing, mesh, mesh_unless};
use crate::meshing::tets::tetrahedron::FACES;
use crate::meshing::tets::{BoundaryFace, FaceRole, TetMesh, determinant};
use crate::samples::{self, scene};
use crate::scene::{Body, Box3, Wall};
use crate::shapes::{Shape, TriangleSurface};
use std::collections::HashMap;
use std::f64::consts::PI;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

fn cube(a: f64) -> Box3 {
    Box3 { min: [-a; 3], max: [a; 3] }
}

fn volume(mesh: &TetMesh, region: Option<u32>) -> f64 {
    let is_in_region = |t: &usize| region.is_none_or(|r| mesh.regions[*t] == r);
    (0..mesh.tets.len()).filter(is_in_region).map(|t| mesh.determinant(t) / 6.0).sum()
}

/// Positive tetrahedra; faces of one or two of them; faces with a role are there.
fn check(meshed: &Meshed) {
    let mesh = &meshed.mesh;
    let mut faces: HashMap<[u32; 3], usize> = HashMap::new();
    for (t, tet) in mesh.tets.iter().enumerate() {
        assert!(mesh.determinant(t) > 0.0, "tetrahedron {t}: {}", mesh.determinant(t));
        for face in FACES {
            let mut ids = face.map(|k| tet[k]);
            ids.sort_unstable();
            *faces.entry(ids).or_default() += 1;
        }
    }
    assert!(faces.values().all(|&n| n <= 2));
    for b in &mesh.boundary {
        let mut ids = b.face;
        ids.sort_unstable();
        assert!(faces.contains_key(&ids));
    }
    assert!(meshed.quality.smallest_angle > 0.1 && meshed.refined);
}

fn area(mesh: &TetMesh, role: impl Fn(FaceRole) -> bool) -> f64 {
    let has_role = |f: &&BoundaryFace| role(f.role);
    mesh.boundary
        .iter()
        .filter(has_role)
        .map(|f| {
            let [a, b, c] = f.face.map(|p| mesh.points[p as usize]);
            let [u, v] = [b, c].map(|q| [0, 1, 2].map(|k| q[k] - a[k]));
            let n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
            0.5 * (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt()
        })
        .sum()
}

#[test]
fn a_regular_grid_is_triangulated_without_gaps() {
    let mut mesh = Delaunay::new([0.0; 3], [8.0; 3]);
    for k in 0..729_u32 {
        let p = [k % 9, k / 9 % 9, k / 81].map(f64::from);
        let hint = mesh.tet_at(mesh.points.len() as u32 - 1);
        let taken = mesh.insert(&Insertion::free(p, hint));
        assert!(matches!(taken, Ok(_) | Err(Refusal::Duplicate(_))), "{p:?}: {taken:?}");
    }
    let whole: f64 = (0..mesh.tets.len() as u32)
        .filter(|&t| mesh.alive(t))
        .map(|t| {
            let [a, b, c, d] = mesh.corners(t);
            determinant(a, b, c, d) / 6.0
        })
        .sum();
    assert!((whole - 512.0).abs() < 1e-9, "{whole}");
}

#[test]
fn a_ball_in_a_grounded_box_leaves_the_volume_around_it() {
    let sphere = Shape::Sphere { center: [0.1, 0.0, 0.05], radius: 0.5 };
    let out = mesh(&scene(cube(1.0), Wall::Grounded, vec![sphere]), &Sizing::default()).unwrap();
    check(&out);
    assert!(out.refined);
    assert!((volume(&out.mesh, None) - 8.0 + PI / 6.0).abs() < 1e-12);
    assert!((area(&out.mesh, |r| r == FaceRole::Grounded) - 24.0).abs() < 1e-12);
    assert!((area(&out.mesh, |r| r == FaceRole::Conductor(0)) / PI - 1.0).abs() < 0.02);
}

#[test]
fn layered_balls_have_their_volumes() {
    let center = [0.0; 3];
    let mut scene = scene(
        Box3::SPACE,
        Wall::Open,
        vec![Shape::Sphere { center, radius: 1e-3 }, Shape::Shell { center, radius: 2e-3 }],
    );
    scene.bodies.push(Body::dielectric("layer", Shape::Sphere { center, radius: 1.5e-3 }, 3.0));
    let out = mesh(&scene, &Sizing::default()).unwrap();
    check(&out);
    let ball = |r: f64| 4.0 / 3.0 * PI * r.powi(3);
    assert!((volume(&out.mesh, Some(1)) / (ball(1.5e-3) - ball(1e-3)) - 1.0).abs() < 1e-9);
    assert!((volume(&out.mesh, Some(0)) / (ball(2e-3) - ball(1.5e-3)) - 1.0).abs() < 1e-9);
}

#[test]
fn two_balls_in_open_space_end_far_out() {
    let a = Shape::Sphere { center: [0.0; 3], radius: 0.01 };
    let b = Shape::Sphere { center: [0.05, 0.0, 0.0], radius: 0.02 };
    let out = mesh(&scene(Box3::SPACE, Wall::Open, vec![a, b]), &Sizing::default()).unwrap();
    check(&out);
    let side: f64 = 20.0 * 0.08;
    let open = area(&out.mesh, |r| matches!(r, FaceRole::Open { permittivity } if permittivity == [1.0; 2]));
    assert!((open / (6.0 * side * side) - 1.0).abs() < 1e-12);
    assert!((out.mesh.center[0] - 0.03).abs() < 1e-15);
}

fn cube_surface(turned: bool) -> TriangleSurface {
    let mut surface = samples::cube([0.0; 3], 0.5);
    if turned {
        let (s, c) = 0.3_f64.sin_cos();
        for p in &mut surface.points {
            *p = [c * p[0] - s * p[1], s * p[0] + c * p[1], p[2]];
            *p = [p[0], c * p[1] - s * p[2], s * p[1] + c * p[2]];
        }
    }
    surface
}

#[test]
fn an_imported_cube_is_exact_straight_or_turned() {
    for turned in [false, true] {
        let shape = Shape::Surface(cube_surface(turned));
        let out = mesh(&scene(cube(1.0), Wall::Grounded, vec![shape]), &Sizing::default()).unwrap();
        check(&out);
        assert!((volume(&out.mesh, None) - 7.0).abs() < 1e-12);
        assert!((area(&out.mesh, |r| r == FaceRole::Conductor(0)) - 6.0).abs() < 1e-12);
    }
}

#[test]
fn a_plate_and_a_disc_lie_on_the_board_they_share_a_plane_with() {
    let slab = |from, to| {
        let mut b = Box3::SPACE;
        (b.min[1], b.max[1]) = (from, to);
        Shape::Box(b)
    };
    let outline = vec![[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [1.0, 1.0], [1.0, 3.0], [0.0, 3.0]];
    let pad = Shape::Extrusion { axis: 1, from: 0.0, to: 0.1, outline, arcs: Vec::new() };
    let disc = Shape::Cylinder { axis: 1, base: [2.2, 0.0, 2.2], radius: 0.8, height: 0.1 };
    let mut scene = scene(Box3::SPACE, Wall::Open, vec![pad, disc]);
    for (name, from, to, eps) in [("board", -10.0, 0.0, 4.5), ("layer", 0.0, 4.0, 2.8)] {
        scene.bodies.push(Body::dielectric(name, slab(from, to), eps));
    }
    let out = mesh(&scene, &Sizing::default()).unwrap();
    check(&out);
    let side = 20.0 * 14.0;
    assert!((volume(&out.mesh, Some(1)) / (10.0 * side * side) - 1.0).abs() < 1e-12);
    let metal = 0.1 * (5.0 + PI * 0.64);
    assert!((volume(&out.mesh, Some(2)) / (4.0 * side * side - metal) - 1.0).abs() < 1e-12);
    assert!((area(&out.mesh, |r| r == FaceRole::Conductor(0)) - 10.0 - 1.2).abs() < 1e-9);
}

#[test]
fn a_tube_and_a_ring_without_thickness_leave_their_middle_free() {
    let tube = Shape::Tube { axis: 2, base: [0.0, 0.0, -0.4], radii: [0.3, 0.6], height: 0.5 };
    let ring = Shape::Tube { axis: 2, base: [0.0, 0.0, 0.5], radii: [0.2, 0.7], height: 0.0 };
    let out = mesh(&scene(cube(1.0), Wall::Grounded, vec![tube, ring]), &Sizing::default()).unwrap();
    check(&out);
    // Polygons have the areas of their circles.
    assert!((volume(&out.mesh, None) - (8.0 - 0.5 * PI * 0.27)).abs() < 1e-12);
    assert!((area(&out.mesh, |r| r == FaceRole::Conductor(1)) - PI * 0.45).abs() < 1e-12);
}

#[test]
fn a_sheet_in_a_box_has_faces_of_its_own_on_it() {
    let sheet = Shape::Box(Box3 { min: [-0.5, 0.0, -0.5], max: [0.5, 0.0, 0.5] });
    let out = mesh(&scene(cube(1.0), Wall::Grounded, vec![sheet]), &Sizing::default()).unwrap();
    check(&out);
    assert!((volume(&out.mesh, None) - 8.0).abs() < 1e-12);
    assert!((area(&out.mesh, |r| r == FaceRole::Conductor(0)) - 1.0).abs() < 1e-12);
}

#[test]
fn surfaces_that_cross_are_refused_by_name() {
    let a = Shape::Sphere { center: [0.0; 3], radius: 0.3 };
    let b = Shape::Sphere { center: [0.4, 0.0, 0.0], radius: 0.3 };
    let crossing = mesh(&scene(cube(1.0), Wall::Grounded, vec![a, b]), &Sizing::default());
    assert!(matches!(&crossing, Err(MeshError::Crossing { .. })), "{crossing:?}");
    assert!(crossing.unwrap_err().to_string().contains("c1"));
}

#[test]
fn the_walls_stay_flat_at_any_size_of_elements() {
    let scene = scene(cube(1.0), Wall::Grounded, vec![Shape::Surface(cube_surface(false))]);
    for facet in [0.3, 0.2, 0.15, 0.1, 0.0632, 0.05] {
        let meshed = mesh(&scene, &Sizing { facet, ..Sizing::default() }).unwrap();
        check(&meshed);
        assert!((volume(&meshed.mesh, None) - 7.0).abs() < 1e-11, "{facet}: {}", volume(&meshed.mesh, None));
        let walls = area(&meshed.mesh, |r| r == FaceRole::Grounded);
        assert!((walls - 24.0).abs() < 1e-11, "{facet}: {walls}");
    }
}

#[test]
fn a_face_whose_middle_is_on_the_seam_of_two_triangles_is_in_one_of_them() {
    // Bodies of 300 x 20 x 500 um at many places: rounding differs at each.
    for k in 0..12 {
        let shift = -175e-6 - 0.5e-6 * f64::from(k);
        let mut surface = cube_surface(false);
        for p in &mut surface.points {
            *p = [300e-6 * p[0] + shift, 20e-6 * p[1] + 225e-6, 500e-6 * p[2]];
        }
        let domain = Box3 { min: [-1325e-6, 0.0, -1250e-6], max: [1325e-6, 1450e-6, 1250e-6] };
        let scene = scene(domain, Wall::Insulated, vec![Shape::Surface(surface)]);
        let out = mesh(&scene, &Sizing::default()).unwrap();
        let outside = 2650e-6 * 1450e-6 * 2500e-6 - 300e-6 * 20e-6 * 500e-6;
        assert!((volume(&out.mesh, None) / outside - 1.0).abs() < 1e-9, "{shift:e}");
    }
}

#[test]
fn planes_of_bodies_cut_nothing_where_the_mesh_ends_far_away() {
    let plate = |low: f64, high: f64| Shape::Box(Box3 { min: [0.0, low, 0.0], max: [1e-3, high, 1e-3] });
    let plates = vec![plate(0.0, 2e-5), plate(1e-4, 1.2e-4), plate(2e-4, 2.2e-4)];
    let out = mesh(&scene(Box3::SPACE, Wall::Open, plates), &Sizing::default()).unwrap();
    let planes = [0.0, 2e-5, 1e-4, 1.2e-4, 2e-4, 2.2e-4];
    let far = out.mesh.points.iter().filter(|p| p[0] > 5e-3 && planes.contains(&p[1]));
    assert_eq!(far.count(), 0, "points in the planes of plates 5 mm away");
}

#[test]
fn bodies_go_through_the_planes_of_slabs() {
    let mut slab = Box3::SPACE;
    (slab.min[1], slab.max[1]) = (-1.0, 0.0);
    let via = Shape::Cylinder { axis: 1, base: [0.0, -2.0, 0.0], radius: 0.3, height: 3.0 };
    let ball = Shape::Sphere { center: [2.0, 0.0, 0.0], radius: 0.5 };
    let sheet = Shape::Extrusion {
        axis: 0,
        from: -2.0,
        to: -2.0,
        outline: vec![[-0.5, -0.5], [0.7, -0.5], [0.7, 0.5], [-0.5, 0.5]],
        arcs: Vec::new(),
    };
    let domain = Box3 { min: [-4.0; 3], max: [4.0; 3] };
    let mut scene = scene(domain, Wall::Insulated, vec![via, ball, sheet]);
    scene.bodies.push(Body::dielectric("board", Shape::Box(slab), 4.0));
    let out = mesh(&scene, &Sizing::default()).unwrap();
    check(&out);
    let (circle, half_ball) = (PI * 0.09, 2.0 / 3.0 * PI * 0.125);
    let board = 64.0 - circle - half_ball;
    assert!((volume(&out.mesh, Some(1)) / board - 1.0).abs() < 1e-3, "{}", volume(&out.mesh, Some(1)));
    let above = 512.0 - 64.0 - 2.0 * circle - half_ball;
    assert!((volume(&out.mesh, Some(0)) / above - 1.0).abs() < 1e-3);
    let total = volume(&out.mesh, None);
    assert!((total / (512.0 - 3.0 * circle - 2.0 * half_ball) - 1.0).abs() < 1e-9, "{total}");
    assert!((area(&out.mesh, |r| r == FaceRole::Conductor(2)) - 1.2).abs() < 1e-12);
}

#[test]
fn a_mesher_that_is_asked_to_stop_leaves_minutes_of_work_undone() {
    let ball = Shape::Sphere { center: [0.0; 3], radius: 1.0 };
    let scene = scene(Box3::SPACE, Wall::Open, vec![ball]);
    // Some minutes of work.
    let fine = Sizing { facet: 0.05, far: 10.0, max_points: 10_000_000, growth: 0.02, ..Sizing::default() };
    let cancel = Arc::new(AtomicBool::new(false));
    let stop = Arc::clone(&cancel);
    let stopper = std::thread::spawn(move || {
        std::thread::sleep(Duration::from_millis(300));
        stop.store(true, Ordering::Relaxed);
    });
    assert_eq!(mesh_unless(&scene, &fine, Some(&cancel)), Err(MeshError::Cancelled));
    stopper.join().unwrap();
}
