mod primal;

use super::*;
use elastocap_geometry::meshing::tets::{FaceRole, of_boxes};
use elastocap_geometry::scene::{Body, Box3, Scene, Wall};
use elastocap_geometry::shapes::Shape;
use primal::solve;

/// Capacitance of a cube of side 1 in a cube of side 2, over eps_0 (an edge-graded hp boundary-element code,
/// charge balance 2e-16).
const CUBE_IN_CUBE: f64 = 19.127134997;

fn cube(a: f64) -> Box3 {
    Box3 { min: [-a; 3], max: [a; 3] }
}

fn conductor(name: &str, region: Box3) -> Body {
    Body::conductor(name, Shape::Box(region))
}

fn cube_in_cube(cells: usize) -> TetMesh {
    let scene = Scene {
        bodies: vec![conductor("inner", cube(0.5))],
        background_permittivity: 1.0,
        domain: cube(1.0),
        walls: [[Wall::Grounded; 2]; 3],
    };
    let line: Vec<f64> = (0..=4 * cells).map(|i| -1.0 + 0.5 * i as f64 / cells as f64).collect();
    of_boxes(&scene, &[line.clone(), line.clone(), line])
}

fn lower(flux: &Flux) -> Mat<f64> {
    let n = flux.charges.nrows();
    flux.lower(Mat::<f64>::identity(n, n).as_ref())
}

fn close(a: &Mat<f64>, b: &Mat<f64>, share: f64) {
    assert!((a - b).norm_max() <= share * a.norm_max(), "{a:?} is not {b:?}");
}

/// Least eigenvalue of a symmetric matrix.
fn least(matrix: &Mat<f64>) -> f64 {
    matrix.self_adjoint_eigenvalues(faer::Side::Lower).unwrap().into_iter().fold(f64::INFINITY, f64::min)
}

/// Bounds of one order on one mesh; asserts what must hold on any closed mesh.
fn bounds(mesh: &TetMesh, permittivity: &[f64], order: usize) -> (Mat<f64>, Mat<f64>) {
    let primal = solve(mesh, permittivity, order);
    let flux = equilibrate(mesh, permittivity, order, &primal.gradients, false).unwrap();
    let lower = lower(&flux);
    // The upper energies keep this many digits where permittivities differ by a million.
    close(&primal.upper, &(&lower + &flux.gap), 1e-8);
    assert!(least(&(&primal.upper - &lower)) > -1e-8 * primal.upper.norm_max());
    assert!(flux.divergence < 1e-12, "{}", flux.divergence);
    for (s, gaps) in flux.gaps.iter().enumerate() {
        assert_eq!(gaps.len(), mesh.tets.len());
        assert!(gaps.iter().all(|&g| g >= 0.0));
        assert!((gaps.iter().sum::<f64>() - flux.gap[(s, s)]).abs() <= 1e-12 * flux.gap[(s, s)]);
    }
    (lower, primal.upper)
}

#[test]
fn the_capacitance_of_a_cube_in_a_cube_lies_between_the_bounds_which_close_together() {
    for (order, min, max) in [(1, 2.2, 2.5), (2, 1.8, 2.0), (3, 1.7, 1.9)] {
        for cells in 1..=if order == 3 { 2 } else { 3 } {
            let (l, u) = bounds(&cube_in_cube(cells), &[1.0], order);
            let (l, u) = (l[(0, 0)], u[(0, 0)]);
            assert!(l <= CUBE_IN_CUBE && CUBE_IN_CUBE <= u, "{l} {u}");
            // The spread over the error of the upper bound stays where it is: both fall at the same rate.
            let effectivity = (u - l) / (u - CUBE_IN_CUBE);
            let coarse = order == 1 && cells == 1;
            assert!(coarse || (min..max).contains(&effectivity), "{order} {cells} {effectivity}");
        }
    }
}

#[test]
fn contrasts_of_a_million_keep_the_bounds_of_all_orders_on_their_sides() {
    let block = Shape::Box(Box3 { min: [0.0, 0.2, 0.4], max: [0.8, 0.8, 1.0] });
    let mut scene = Scene {
        bodies: vec![
            conductor("low", Box3 { min: [0.2; 3], max: [0.4; 3] }),
            conductor("high", Box3 { min: [0.6; 3], max: [0.8; 3] }),
            Body::dielectric("block", block.clone(), 1e6),
        ],
        background_permittivity: 1.0,
        domain: Box3 { min: [0.0; 3], max: [1.0; 3] },
        walls: [[Wall::Grounded, Wall::Insulated], [Wall::Insulated; 2], [Wall::Insulated, Wall::Grounded]],
    };
    let line: Vec<f64> = (0..=5).map(|i| 0.2 * f64::from(i)).collect();
    for eps in [1e6, 1e-6] {
        scene.bodies[2] = Body::dielectric("block", block.clone(), eps);
        let mesh = of_boxes(&scene, &[line.clone(), line.clone(), line.clone()]);
        let each = [1, 2, 3].map(|order| bounds(&mesh, &[1.0, eps], order));
        for (lower, _) in &each {
            for (_, upper) in &each {
                assert!(least(&(upper - lower)) > -1e-8 * upper.norm_max());
            }
        }
        for c in 0..2 {
            let spread = each.each_ref().map(|(l, u)| (u[(c, c)] - l[(c, c)]) / u[(c, c)]);
            assert!(
                spread[1] < 0.5 && spread[2] < 0.25 && spread[1] < 0.5 * spread[0],
                "{eps} {c} {spread:?}"
            );
        }
    }
}

#[test]
fn layered_plates_between_insulated_walls_are_exact() {
    let slab = |from: f64, to: f64| Box3 { min: [0.0, 0.0, from], max: [1.0, 1.0, to] };
    let scene = Scene {
        bodies: vec![
            conductor("low", slab(-0.1, 0.0)),
            conductor("high", slab(1.0, 1.1)),
            Body::dielectric("a", Shape::Box(slab(0.0, 0.3)), 1e6),
            Body::dielectric("b", Shape::Box(slab(0.3, 0.5)), 3.0),
        ],
        background_permittivity: 1.0,
        domain: slab(-0.1, 1.1),
        walls: [[Wall::Insulated; 2]; 3],
    };
    let wide = vec![0.0, 0.5, 1.0];
    let mesh = of_boxes(&scene, &[wide.clone(), wide, vec![0.0, 0.3, 0.5, 0.8, 1.0]]);
    let exact = 1.0 / (0.3 / 1e6 + 0.2 / 3.0 + 0.5);
    let exact = Mat::from_fn(2, 2, |i, j| if i == j { exact } else { -exact });
    for order in 1..=3 {
        let (lower, upper) = bounds(&mesh, &[1.0, 1e6, 3.0], order);
        // The upper energy of a nearly constant potential in the layer of 1e6 has cancelled to this.
        close(&upper, &exact, 1e-8);
        close(&lower, &exact, 1e-8);
    }
}

#[test]
fn a_sheet_sends_flux_to_both_sides() {
    let scene = Scene {
        bodies: vec![
            conductor("sheet", Box3 { min: [-0.5, -0.5, 0.0], max: [0.5, 0.5, 0.0] }),
            conductor("cube", Box3 { min: [-0.5, -0.5, 0.5], max: [0.5, 0.5, 0.75] }),
        ],
        background_permittivity: 1.0,
        domain: cube(1.0),
        walls: [[Wall::Grounded; 2], [Wall::Insulated; 2], [Wall::Grounded; 2]],
    };
    let line: Vec<f64> = (0..=8).map(|i| -1.0 + 0.25 * f64::from(i)).collect();
    let mesh = of_boxes(&scene, &[line.clone(), line.clone(), line]);
    let (coarse, upper) = bounds(&mesh, &[1.0], 1);
    let (lower, finer) = bounds(&mesh, &[1.0], 2);
    for c in 0..2 {
        assert!(coarse[(c, c)] < lower[(c, c)] && finer[(c, c)] < upper[(c, c)]);
        assert!(lower[(c, c)] > 0.8 * finer[(c, c)], "{lower:?} {finer:?}");
    }
}

#[test]
fn an_isolated_cube_in_open_space_lies_between_the_bounds() {
    // Capacitance of the unit cube over that of a ball of radius 1 (Helsing and Perfekt, 2013).
    let exact = 0.66067815409957 * 4.0 * std::f64::consts::PI;
    let everywhere = Box3 { min: [f64::NEG_INFINITY; 3], max: [f64::INFINITY; 3] };
    let scene = Scene {
        bodies: vec![conductor("cube", cube(0.5))],
        background_permittivity: 1.0,
        domain: everywhere,
        walls: [[Wall::Open; 2]; 3],
    };
    for (line, order, spread) in [
        (vec![-1.0, -0.5, 0.0, 0.5, 1.0], 1, 0.5),
        (vec![-1.0, -0.5, 0.0, 0.5, 1.0], 2, 0.15),
        (vec![-1.5, -1.0, -0.7, -0.5, -0.35, 0.0, 0.35, 0.5, 0.7, 1.0, 1.5], 2, 0.05),
    ] {
        let mesh = of_boxes(&scene, &[line.clone(), line.clone(), line]);
        let primal = solve(&mesh, &[1.0], order);
        let flux = equilibrate(&mesh, &[1.0], order, &primal.gradients, false).unwrap();
        let (l, u) = (lower(&flux)[(0, 0)], primal.upper[(0, 0)]);
        assert!(l <= exact && exact <= u, "{l} {exact} {u}");
        assert!(u - l < spread * exact, "{l} {exact} {u}");
        // The gap of the mesh does not contain the difference of the two continuations beyond it.
        assert!(u - l >= flux.gap[(0, 0)] && flux.gap[(0, 0)] > 0.5 * (u - l));
    }
}

#[test]
fn arbitrary_gradients_still_give_a_bound() {
    let mesh = cube_in_cube(1);
    let mut seed = 1_u32;
    let mut noise = || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(seed) / f64::from(u32::MAX) - 0.5
    };
    for order in 1..=3 {
        let primal = solve(&mesh, &[1.0], order);
        let good = lower(&equilibrate(&mesh, &[1.0], order, &primal.gradients, false).unwrap())[(0, 0)];
        for size in [1e-9, 1e-3, 1.0] {
            let spoilt: Vec<_> = primal.gradients[0].iter().map(|g| g.map(|g| g + size * noise())).collect();
            let flux = equilibrate(&mesh, &[1.0], order, &[spoilt], false).unwrap();
            let bound = lower(&flux)[(0, 0)];
            assert!(bound < CUBE_IN_CUBE && flux.divergence < 1e-12);
            assert!((bound - good).abs() < 100.0 * size, "{order} {size} {bound} {good}");
        }
    }
}

#[test]
fn where_no_flux_can_leave_there_is_none() {
    // A separate tetrahedron that touches nothing.
    let mut mesh = cube_in_cube(1);
    let first = mesh.points.len() as u32;
    mesh.points.extend([[3.0, 0.0, 0.0], [4.0, 0.0, 0.0], [3.0, 1.0, 0.0], [3.0, 0.0, 1.0]]);
    mesh.tets.push([first, first + 1, first + 2, first + 3]);
    mesh.regions.push(0);
    let mut primal = solve(&cube_in_cube(1), &[1.0], 1);
    let alone = equilibrate(&cube_in_cube(1), &[1.0], 1, &primal.gradients, false).unwrap();
    primal.gradients[0].push([1.0, 0.0, 0.0]);
    let flux = equilibrate(&mesh, &[1.0], 1, &primal.gradients, false).unwrap();
    close(&flux.energy, &alone.energy, 1e-14);
    assert!((flux.gaps[0][mesh.tets.len() - 1] - 1.0 / 6.0).abs() < 1e-14);
}

#[test]
fn one_thread_and_several_give_the_same_bits() {
    let mesh = cube_in_cube(2);
    let primal = solve(&mesh, &[1.0], 2);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| equilibrate(&mesh, &[1.0], 2, &primal.gradients, false).unwrap())
    };
    let (one, three) = (on(1), on(3));
    assert_eq!(one.gaps, three.gaps);
    assert_eq!(one.energy, three.energy);
    assert_eq!(one.charges, three.charges);
}

#[test]
fn lists_that_do_not_fit_the_mesh_are_refused_by_name() {
    let mesh = cube_in_cube(1);
    let gradients = vec![[0.0; 3]; mesh.tets.len()];
    let refused = |permittivity: &[f64], order, gradients: &[Vec<[f64; 3]>]| {
        equilibrate(&mesh, permittivity, order, gradients, false).unwrap_err().to_string()
    };
    assert!(refused(&[1.0], 4, &[]).contains("order 4"));
    assert!(
        refused(&[1.0], 2, std::slice::from_ref(&gradients)).starts_with("gradients: 336 given, 1344 needed")
    );
    assert!(refused(&[], 1, &[]).starts_with("permittivities"));
    assert!(refused(&[-1.0], 1, &[]).contains("region 0 is -1"));
    let mut spoilt = gradients.clone();
    spoilt[7][1] = f64::NAN;
    assert!(refused(&[1.0], 1, &[spoilt]).contains("tetrahedron 7"));
    let mut open = mesh.clone();
    open.center = [5.0; 3];
    for boundary in &mut open.boundary {
        if boundary.role == FaceRole::Grounded {
            boundary.role = FaceRole::Open { permittivity: [1.0; 2] };
        }
    }
    let error = equilibrate(&open, &[1.0], 1, &[gradients], false).unwrap_err();
    assert!(matches!(error, FluxError::OpenFace { .. }));
}

/// The isolated cube, `shift` away from the origin.
fn isolated_cube(shift: [f64; 3]) -> TetMesh {
    let region = Box3 { min: shift.map(|x| x - 0.5), max: shift.map(|x| x + 0.5) };
    let scene = Scene {
        bodies: vec![conductor("cube", region)],
        background_permittivity: 1.0,
        domain: Box3::SPACE,
        walls: [[Wall::Open; 2]; 3],
    };
    let lines = shift.map(|by| [-1.0, -0.5, 0.0, 0.5, 1.0].map(|x: f64| x + by).to_vec());
    of_boxes(&scene, &lines)
}

#[test]
fn an_isolated_cube_has_the_same_lower_bound_anywhere() {
    let bound = |shift| {
        let mesh = isolated_cube(shift);
        let primal = solve(&mesh, &[1.0], 2);
        lower(&equilibrate(&mesh, &[1.0], 2, &primal.gradients, false).unwrap())[(0, 0)]
    };
    let centred = bound([0.0; 3]);
    for shift in [[0.25, 0.0, -0.125], [3.0, -7.0, 50.0]] {
        let shifted = bound(shift);
        assert!((shifted / centred - 1.0).abs() < 1e-8, "{shift:?}: {shifted} {centred}");
    }
}

#[test]
fn beyond_the_mesh_the_smallest_permittivity_on_the_rays_counts() {
    let mut mesh = isolated_cube([0.0; 3]);
    let gradients = solve(&mesh, &[1.0], 1).gradients;
    let mut bound = |permittivity: [f64; 2]| {
        for face in &mut mesh.boundary {
            if let FaceRole::Open { permittivity: on_face } = &mut face.role {
                *on_face = permittivity;
            }
        }
        lower(&equilibrate(&mesh, &[1.0], 1, &gradients, false).unwrap())[(0, 0)]
    };
    let [least, between, most] = [[1.0; 2], [1.0, 3.0], [3.0; 2]].map(&mut bound);
    assert_eq!(between, least);
    assert!(least < 0.9 * most, "{least} {most}");
}

#[test]
fn the_last_of_fluxes_that_add_up_to_zero_is_what_it_would_be_made_as() {
    let block = |x: f64| Box3 { min: [x, 0.25, 0.25], max: [x + 0.25, 0.75, 0.5] };
    let scene = Scene {
        bodies: vec![conductor("one", block(0.125)), conductor("other", block(0.5))],
        background_permittivity: 1.0,
        domain: Box3 { min: [0.0; 3], max: [1.0; 3] },
        walls: [[Wall::Insulated; 2]; 3],
    };
    let line: Vec<f64> = (0..=8).map(|i| 0.125 * f64::from(i)).collect();
    let mesh = of_boxes(&scene, &[line.clone(), line.clone(), line]);
    for order in 1..=2 {
        let primal = solve(&mesh, &[1.0], order);
        let full = equilibrate(&mesh, &[1.0], order, &primal.gradients, false).unwrap();
        let completed = equilibrate(&mesh, &[1.0], order, &primal.gradients, true).unwrap();
        close(&completed.energy, &full.energy, 1e-8);
        close(&completed.gap, &full.gap, 1e-6);
        close(&completed.charges, &full.charges, 1e-8);
        assert!(completed.divergence < 1e-12);
    }
}
