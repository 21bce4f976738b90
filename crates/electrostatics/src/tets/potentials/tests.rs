use super::*;
use elastocap_geometry::meshing::tets::{BoundaryFace, FaceRole, of_boxes};
use elastocap_geometry::scene::{Body, Box3, Scene, Wall};
use elastocap_geometry::shapes::Shape;

const SETTINGS: PotentialSettings<'static> = PotentialSettings { order: 2, share: 1e-10, cancel: None };

fn cube(a: f64) -> Box3 {
    Box3 { min: [-a; 3], max: [a; 3] }
}

fn scene(regions: &[Box3], domain: Box3, wall: Wall) -> Scene {
    let name = |k: usize| format!("{k}");
    Scene {
        bodies: (0..).zip(regions).map(|(k, &region)| Body::conductor(name(k), Shape::Box(region))).collect(),
        background_permittivity: 1.0,
        domain,
        walls: [[wall; 2]; 3],
    }
}

/// From `from` to `to` in `n` steps, each next to `from` smaller by `ratio`.
fn graded(from: f64, to: f64, n: usize, ratio: f64) -> Vec<f64> {
    let mut at = vec![from];
    at.extend((0..n).rev().map(|k| from + (to - from) * ratio.powi(k as i32)));
    at
}

/// The axis of a cube in a cube: n layers of elements on both sides of +-1/2, out to `outer`.
fn axis(n: usize, ratio: f64, outer: f64) -> Vec<f64> {
    let mut half: Vec<f64> = graded(0.5, 0.0, n, ratio);
    half.reverse();
    half.extend(&graded(0.5, outer, n, ratio)[1..]);
    let mut line: Vec<f64> = half[1..].iter().rev().map(|x| -x).collect();
    line.extend(half);
    line
}

fn solve(mesh: &TetMesh, permittivity: &[f64], conductors: usize, order: usize) -> Potentials {
    let problem = PotentialProblem { mesh, permittivity, conductors };
    let solved = Potentials::solve(problem, PotentialSettings { order, ..SETTINGS }).unwrap();
    assert_eq!(solved.shortfall, None);
    solved
}

/// n + 1 points from `from` to `to`, evenly.
fn even(from: f64, to: f64, n: usize) -> Vec<f64> {
    (0..=n).map(|k| if k == n { to } else { from + (to - from) * k as f64 / n as f64 }).collect()
}

fn cube_in_cube(n: usize, ratio: f64, order: usize) -> (f64, Potentials) {
    let line = axis(n, ratio, 1.0);
    let mesh = of_boxes(&scene(&[cube(0.5)], cube(1.0), Wall::Grounded), &[line.clone(), line.clone(), line]);
    let problem = PotentialProblem { mesh: &mesh, permittivity: &[1.0], conductors: 1 };
    let solved = Potentials::solve(problem, PotentialSettings { order, ..SETTINGS }).unwrap();
    assert_eq!(solved.shortfall, None);
    (solved.energies[(0, 0)] / 19.127134997 - 1.0, solved)
}

#[test]
fn a_cube_in_a_cube_is_bounded_from_above_and_met() {
    for order in 1..=3 {
        let mut last = f64::INFINITY;
        for n in 1..=4 {
            let (error, solved) = cube_in_cube(n, 0.35, order);
            println!(
                "p{order} n{n}: {error:e}, {} iterations, {} unknowns",
                solved.iterations, solved.unknowns
            );
            assert!(error > 0.0 && error < last);
            last = error;
        }
    }
}

#[test]
fn an_isolated_cube_is_bounded_from_above_and_met() {
    for order in 1..=3 {
        let mut last = f64::INFINITY;
        for n in 1..=4 {
            let line = axis(n, 0.4, 1.5);
            let scene = scene(&[cube(0.5)], Box3::SPACE, Wall::Open);
            let mesh = of_boxes(&scene, &[line.clone(), line.clone(), line]);
            let solved = solve(&mesh, &[1.0], 1, order);
            let exact = 0.66067815409957 * 4.0 * std::f64::consts::PI;
            let error = solved.energies[(0, 0)] / exact - 1.0;
            println!("p{order} n{n}: {error:e}, {} iterations", solved.iterations);
            assert!(error > 0.0 && error < last);
            last = error;
        }
        assert!(last < [0.1, 8e-3, 4e-3][order - 1]);
    }
}

#[test]
fn plates_with_two_layers_between_are_exact() {
    let domain = Box3 { min: [0.0; 3], max: [1.0, 1.0, 2.0] };
    let layer = |min: f64, max: f64| Box3 { min: [0.0, 0.0, min], max: [1.0, 1.0, max] };
    let mut scene = scene(&[layer(0.0, 0.5), layer(1.5, 2.0)], domain, Wall::Insulated);
    let eps = [1.0, 3.0, 7e5];
    for (k, region) in [layer(0.5, 0.75), layer(0.75, 1.5)].into_iter().enumerate() {
        scene.bodies.push(Body::dielectric(format!("{k}"), Shape::Box(region), eps[k + 1]));
    }
    let lines = [vec![0.0, 0.3, 1.0], vec![0.0, 0.9, 1.0], vec![0.0, 0.5, 0.7, 0.75, 1.2, 1.5, 2.0]];
    let mesh = of_boxes(&scene, &lines);
    let exact = 1.0 / (0.25 / 3.0 + 0.75 / 7e5);
    for order in 1..=3 {
        let solved = solve(&mesh, &eps, 2, order);
        for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let sign = if i == j { 1.0 } else { -1.0 };
            assert!((solved.energies[(i, j)] / (sign * exact) - 1.0).abs() < 1e-9);
        }
        let gradients = solved.gradients(&mesh, 0);
        let each = gradients.len() / mesh.tets.len();
        assert_eq!(each, [1, 4, 10][order - 1]);
        for (t, at) in gradients.chunks(each).enumerate() {
            let slope = exact / eps[mesh.regions[t] as usize];
            assert!(at.iter().all(|g| (g[2] + slope).abs() + g[0].abs() + g[1].abs() < 1e-4 * exact));
        }
    }
}

/// exp(1.3 x) sin(0.5 y) cos(1.2 z), which is harmonic, and its gradient.
fn harmonic([x, y, z]: [f64; 3]) -> (f64, [f64; 3]) {
    let (e, (sy, cy), (sz, cz)) = ((1.3 * x).exp(), (0.5 * y).sin_cos(), (1.2 * z).sin_cos());
    (e * sy * cz, [1.3 * e * sy * cz, 0.5 * e * cy * cz, -1.2 * e * sy * sz])
}

/// Squared energy of the error for the harmonic potential on n^3 cells of which the inner points are moved.
fn error_of_harmonic(n: usize, order: usize) -> f64 {
    let line = even(0.0, 1.0, n);
    let domain = Box3 { min: [0.0; 3], max: [1.0; 3] };
    let mut mesh = of_boxes(&scene(&[], domain, Wall::Grounded), &[line.clone(), line.clone(), line]);
    for p in &mut mesh.points {
        let bump: f64 = p.iter().map(|x| x * (1.0 - x)).product();
        for a in 0..3 {
            p[a] += (1.0 - 0.5 * a as f64) * bump;
        }
    }
    let space = Space::new(&mesh, order).unwrap();
    let place = |dof: usize| {
        let points = space.linear(dof);
        [0, 1, 2].map(|a| points.iter().map(|(p, w)| w * mesh.points[*p as usize][a]).sum())
    };
    let value = |d: usize| if space.held()[d] == Held::Free { 0.0 } else { harmonic(place(d)).0 };
    let data = (0..space.functions()).map(value).collect();
    let problem = PotentialProblem { mesh: &mesh, permittivity: &[1.0], conductors: 0 };
    let settings = PotentialSettings { order, share: 1e-13, cancel: None };
    let solved = Potentials::solve_held(problem, settings, space.clone(), vec![data]).unwrap();
    let gradients = solved.gradients(&mesh, 0);
    let points = reference::lattice(order - 1, 4);
    let mut error = 0.0;
    for t in 0..mesh.tets.len() {
        let corners = mesh.tets[t].map(|p| mesh.points[p as usize]);
        for (at, weight) in reference::tetrahedron_rule() {
            let exact = harmonic([0, 1, 2].map(|a| (0..4).map(|k| at[k] * corners[k][a]).sum())).1;
            for a in 0..3 {
                let nodes = points.iter().zip(&gradients[t * points.len()..]);
                let found: f64 =
                    nodes.map(|(&point, g)| reference::shape(order - 1, point, at).0 * g[a]).sum();
                error += mesh.determinant(t) * weight * (found - exact[a]).powi(2);
            }
        }
    }
    error
}

#[test]
fn the_energy_of_the_error_of_a_smooth_potential_falls_with_twice_the_order() {
    for order in 1..=3 {
        let rate = (error_of_harmonic(3, order) / error_of_harmonic(6, order)).log2();
        println!("p{order}: rate {rate}");
        assert!((rate - 2.0 * order as f64).abs() < 0.35);
    }
}

#[test]
fn a_sheet_between_walls_has_two_sides() {
    let domain = Box3 { min: [0.0; 3], max: [1.0; 3] };
    let sheet = Box3 { min: [0.0, 0.0, 0.25], max: [1.0, 1.0, 0.25] };
    let mut scene = scene(&[sheet], domain, Wall::Insulated);
    scene.walls[2] = [Wall::Grounded; 2];
    let mesh = of_boxes(&scene, &[even(0.0, 1.0, 3), even(0.0, 1.0, 2), even(0.0, 1.0, 4)]);
    for order in 1..=3 {
        let solved = solve(&mesh, &[1.0], 1, order);
        assert!((solved.energies[(0, 0)] - (4.0 + 4.0 / 3.0)).abs() < 1e-9);
    }
}

/// Two conductors of which one lies at the edge of a dielectric, n^3 cells; n is a multiple of 8.
fn contrast(n: usize, eps: f64, order: usize) -> Potentials {
    let place = |min: [f64; 3], max: [f64; 3]| Box3 { min, max };
    let conductors = [place([0.25; 3], [0.5; 3]), place([0.5, 0.625, 0.75], [0.875; 3])];
    let mut scene = scene(&conductors, place([0.0; 3], [1.0; 3]), Wall::Grounded);
    scene.walls[1] = [Wall::Insulated; 2];
    let dielectrics = [place([0.5, 0.0, 0.0], [0.875, 1.0, 0.625]), place([0.125; 3], [0.25; 3])];
    for (k, region) in dielectrics.into_iter().enumerate() {
        scene.bodies.push(Body::dielectric(format!("{k}"), Shape::Box(region), eps));
    }
    let line = even(0.0, 1.0, n);
    let mesh = of_boxes(&scene, &[line.clone(), line.clone(), line]);
    solve(&mesh, &[1.0, eps, eps], 2, order)
}

#[test]
fn iterations_grow_neither_with_the_mesh_nor_with_the_contrast() {
    for order in 1..=3 {
        for eps in [1e-6, 1.0, 1e6] {
            let counts = if order == 1 { [8, 16, 32] } else { [8, 8, 16] }.map(|n| {
                let solved = contrast(n, eps, order);
                let [a, b, c] = [(0, 0), (0, 1), (1, 1)].map(|k| solved.energies[k]);
                assert!(a > 0.0 && c > 0.0 && b < 0.0 && a + b > 0.0 && c + b > 0.0);
                solved.iterations
            });
            println!("p{order}, contrast {eps:e}: {counts:?}");
            assert!(counts.iter().all(|c| *c <= 30));
        }
    }
}

#[test]
fn charges_are_those_of_the_energies_and_potentials_lie_between_the_conductors() {
    let solved = contrast(8, 4.0, 2);
    // a(u_0, v) is the same for every v with the boundary values of u_1.
    let mut potentials = solved.values.clone();
    for (u, held) in potentials[1].iter_mut().zip(solved.space.held()) {
        if *held == Held::Free {
            *u = 0.0;
        }
    }
    let charge = solved.stiffness.energies(&solved.space, &potentials)[(0, 1)];
    assert!((charge / solved.energies[(0, 1)] - 1.0).abs() < 1e-3);
    assert!(solved.values.iter().flatten().all(|u| (-0.05..1.05).contains(u)));
}

#[test]
fn results_are_the_same_at_any_number_of_threads() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| contrast(8, 4.0, 2))
    };
    let (one, three) = (run(1), run(3));
    assert_eq!(one.values, three.values);
    assert_eq!(one.energies, three.energies);
}

#[test]
fn what_cannot_be_solved_is_named() {
    let line = even(-1.0, 1.0, 4);
    let scene = scene(&[cube(0.5)], cube(1.0), Wall::Grounded);
    let mut mesh = of_boxes(&scene, &[line.clone(), line.clone(), line]);
    let run = |mesh: &TetMesh, conductors, permittivity: &[f64], order| {
        let problem = PotentialProblem { mesh, permittivity, conductors };
        Potentials::solve(problem, PotentialSettings { order, ..SETTINGS }).err()
    };
    assert_eq!(run(&mesh, 1, &[1.0], 4), Some(PotentialError::Order(4)));
    assert_eq!(run(&mesh, 0, &[1.0], 1), Some(PotentialError::Conductor(0)));
    assert_eq!(run(&mesh, 1, &[], 2), Some(PotentialError::Region(0)));
    let stop = AtomicBool::new(true);
    let settings = PotentialSettings { cancel: Some(&stop), ..SETTINGS };
    let problem = PotentialProblem { mesh: &mesh, permittivity: &[1.0], conductors: 1 };
    assert_eq!(Potentials::solve(problem, settings).err(), Some(PotentialError::Cancelled));
    let first = mesh.boundary[0];
    mesh.boundary.push(BoundaryFace { role: FaceRole::Conductor(7), ..first });
    assert!(matches!(run(&mesh, 8, &[1.0], 3), Some(PotentialError::HeldTwice(_))));
}

/// The isolated cube on a mesh of some layers, `shift` away from the origin.
fn isolated_cube(shift: [f64; 3]) -> TetMesh {
    let region = Box3 { min: shift.map(|x| x - 0.5), max: shift.map(|x| x + 0.5) };
    let lines = shift.map(|by| axis(2, 0.4, 1.5).into_iter().map(|x| x + by).collect::<Vec<_>>());
    of_boxes(&scene(&[region], Box3::SPACE, Wall::Open), &lines)
}

#[test]
fn an_isolated_cube_has_the_same_capacitance_anywhere() {
    let energy = |shift| solve(&isolated_cube(shift), &[1.0], 1, 2).energies[(0, 0)];
    let centred = energy([0.0; 3]);
    for shift in [[0.25, 0.0, -0.125], [3.0, -7.0, 50.0]] {
        let shifted = energy(shift);
        assert!((shifted / centred - 1.0).abs() < 1e-8, "{shift:?}: {shifted} {centred}");
    }
}

#[test]
fn beyond_the_mesh_the_largest_permittivity_on_the_rays_counts() {
    let mut mesh = isolated_cube([0.0; 3]);
    let mut energy = |permittivity: [f64; 2]| {
        for face in &mut mesh.boundary {
            if let FaceRole::Open { permittivity: on_face } = &mut face.role {
                *on_face = permittivity;
            }
        }
        solve(&mesh, &[1.0], 1, 2).energies[(0, 0)]
    };
    let [least, between, most] = [[1.0; 2], [1.0, 3.0], [3.0; 2]].map(&mut energy);
    assert_eq!(between, most);
    assert!(least < 0.9 * most, "{least} {most}");
}

/// Two cubes between insulated walls.
fn enclosed_pair() -> TetMesh {
    let block = |x: f64| Box3 { min: [x, 0.25, 0.25], max: [x + 0.25, 0.75, 0.5] };
    let domain = Box3 { min: [0.0; 3], max: [1.0; 3] };
    let line = even(0.0, 1.0, 8);
    of_boxes(
        &scene(&[block(0.125), block(0.5)], domain, Wall::Insulated),
        &[line.clone(), line.clone(), line],
    )
}

#[test]
fn the_last_potential_between_insulated_walls_is_what_it_would_be_solved_for() {
    let mesh = enclosed_pair();
    for order in 1..=3 {
        let pair = solve(&mesh, &[1.0], 2, order);
        let space = Space::new(&mesh, order).unwrap();
        let on_last = |h: &Held| f64::from(u8::from(*h == Held::Conductor(1)));
        let data = vec![space.held().iter().map(on_last).collect()];
        let problem = PotentialProblem { mesh: &mesh, permittivity: &[1.0], conductors: 2 };
        let settings = PotentialSettings { order, ..SETTINGS };
        let last = Potentials::solve_held(problem, settings, space, data).unwrap();
        assert!((pair.energies[(1, 1)] / last.energies[(0, 0)] - 1.0).abs() < 1e-9);
        assert!((pair.energies[(0, 1)] / last.energies[(0, 0)] + 1.0).abs() < 1e-9);
        let differences = pair.values[1].iter().zip(&last.values[0]).map(|(a, b)| (a - b).abs());
        assert!(differences.fold(0.0, f64::max) < 1e-4);
    }
}

#[test]
fn only_between_insulated_walls_do_potentials_add_up_to_one() {
    assert!(add_up_to_one(&enclosed_pair(), 2));
    // One conductor is left to the solver; a grounded wall holds the sum at zero.
    assert!(!add_up_to_one(&enclosed_pair(), 1));
    let mut grounded = enclosed_pair();
    grounded.boundary[0].role = FaceRole::Grounded;
    assert!(!add_up_to_one(&grounded, 2));
}

#[test]
fn polynomials_are_the_same_on_a_refined_mesh() {
    let mesh = enclosed_pair();
    let fine = mesh.bisected(&[0, 7, 100, 101, 102], 3);
    for order in 1..=3 {
        let polynomial = |[x, y, z]: [f64; 3]| (0.3 + x - 2.0 * y + 0.5 * z).powi(order as i32);
        let at_places = |mesh: &TetMesh, space: &Space| -> Vec<f64> {
            let place = |dof: usize| {
                let points = space.linear(dof);
                [0, 1, 2].map(|a| points.iter().map(|(p, w)| w * mesh.points[*p as usize][a]).sum())
            };
            (0..space.functions()).map(|d| polynomial(place(d))).collect()
        };
        let space = Space::new(&mesh, order).unwrap();
        let values = vec![at_places(&mesh, &space)];
        let potentials = CoarserPotentials { space, values };
        let start = Start { mesh: &mesh, potentials: &potentials, origin: &fine.origin };
        let space = Space::new(&fine.mesh, order).unwrap();
        let found = start.values(&fine.mesh, &space, 1);
        for (found, exact) in found[0].iter().zip(at_places(&fine.mesh, &space)) {
            assert!((found - exact).abs() < 1e-12);
        }
    }
}

#[test]
fn starting_from_the_mesh_before_saves_iterations_and_changes_no_energy() {
    let mesh = enclosed_pair();
    let marked: Vec<u32> = (0..mesh.tets.len() as u32).step_by(3).collect();
    let fine = mesh.bisected(&marked, 1);
    let potentials = solve(&mesh, &[1.0], 2, 2).into_coarser();
    let start = Start { mesh: &mesh, potentials: &potentials, origin: &fine.origin };
    let problem = PotentialProblem { mesh: &fine.mesh, permittivity: &[1.0], conductors: 2 };
    let warm = Potentials::solve_from(problem, SETTINGS, Some(start)).unwrap();
    let cold = Potentials::solve(problem, SETTINGS).unwrap();
    assert!(warm.iterations < cold.iterations, "{} {}", warm.iterations, cold.iterations);
    assert!((&warm.energies - &cold.energies).norm_max() < 1e-9 * cold.energies.norm_max());
}
