//! Floating conductors: closed forms, and the whole matrix reduced by hand.

use elastocap_electrostatics::{ResolutionLevel, Settings, Solution, VACUUM_PERMITTIVITY, solve};
use elastocap_geometry::scene::{Body, Box3, Potential, Role, Scene, Wall};
use elastocap_geometry::shapes::Shape;

fn conductor(name: &str, min: [f64; 3], max: [f64; 3], charge: Option<f64>) -> Body {
    let body = Body::conductor(name, Shape::Box(Box3 { min, max }));
    Body { role: Role::Conductor { potential: Potential::of_charge(charge) }, ..body }
}

fn settings(relative_tolerance: f64) -> Settings {
    Settings { relative_tolerance, ..Settings::default() }
}

/// Plates that fill the walls, gaps of 0.4 below and `above` over the floating one: no field but along x2.
fn stack(above: f64, charge: f64) -> Scene {
    let top = 0.6 + above;
    Scene {
        bodies: vec![
            conductor("lower", [0.0; 3], [1.0, 0.1, 1.0], None),
            conductor("float", [0.0, 0.5, 0.0], [1.0, 0.6, 1.0], Some(charge)),
            conductor("upper", [0.0, top, 0.0], [1.0, top + 0.1, 1.0], None),
        ],
        background_permittivity: 1.0,
        domain: Box3 { min: [0.0; 3], max: [1.0, top + 0.1, 1.0] },
        walls: [[Wall::Insulated; 2]; 3],
    }
}

/// Three boxes of different size in a grounded box, the middle one floating where `charge` says so.
fn boxes(charge: Option<f64>) -> Scene {
    Scene {
        bodies: vec![
            conductor("a", [0.0; 3], [1.0, 0.2, 1.0], None),
            conductor("b", [0.2, 0.4, 0.1], [0.9, 0.6, 0.7], charge),
            conductor("c", [0.3, 0.9, 0.0], [1.2, 1.0, 0.6], None),
        ],
        background_permittivity: 2.0,
        domain: Box3 { min: [-0.5; 3], max: [1.5; 3] },
        walls: [[Wall::Grounded; 2]; 3],
    }
}

fn close(found: f64, exact: f64, relative: f64) {
    assert!((found - exact).abs() <= relative * exact.abs(), "{found:e} against {exact:e}");
}

#[test]
fn a_floating_plate_between_plates_makes_two_capacitors_in_series() {
    // One coulomb over eps0, so that the potentials are of order one.
    for (above, charge) in [(0.4, 0.0), (0.4, 0.3 * VACUUM_PERMITTIVITY), (0.1, -0.2 * VACUUM_PERMITTIVITY)] {
        let solution = solve(&stack(above, charge), &settings(1e-6)).unwrap();
        assert!(solution.reached, "{:?}", solution.shortfall);
        assert_eq!((solution.maxwell.len(), solution.maxwell[0].len()), (2, 2));
        close(solution.two_terminal.unwrap().value, VACUUM_PERMITTIVITY / (0.4 + above), 1e-9);
        let [only] = solution.floating.as_slice() else { panic!("{:?}", solution.floating) };
        assert_eq!(only.conductor, 1);
        close(only.per_driven[0].value, above / (0.4 + above), 1e-9);
        close(only.per_driven[1].value, 0.4 / (0.4 + above), 1e-9);
        close(only.from_charges.value, charge / VACUUM_PERMITTIVITY / (1.0 / 0.4 + 1.0 / above), 1e-9);
    }
}

#[test]
fn the_potentials_shown_are_those_of_the_field() {
    let with_field = Settings { field: true, ..settings(1e-3) };
    let field = solve(&stack(0.1, 0.3 * VACUUM_PERMITTIVITY), &with_field).unwrap().field.unwrap();
    // +0.5 V below, -0.5 V above: 0.2 of the way up from 0.5, and 0.3/(2.5 + 10) from the charge.
    let float = 0.5 * 0.2 - 0.5 * 0.8 + 0.3 / 12.5;
    assert!((field.potentials[1] - float).abs() < 1e-9, "{:?}", field.potentials);
    let shown = field.nodes[1].iter().position(|x| (x - 0.5).abs() < 1e-12).unwrap();
    assert!((field.potential[shown * field.nodes[2].len()] - float).abs() < 1e-9);
}

#[test]
fn the_middle_of_a_symmetric_scene_is_halfway_between_the_two_driven_plates() {
    let plate = |name: &str, low: f64, half: f64, charge| {
        conductor(name, [-half, low, -half], [half, low + 0.1, half], charge)
    };
    let scene = Scene {
        bodies: vec![
            plate("lower", -0.45, 1.0, None),
            plate("float", -0.05, 0.7, Some(0.0)),
            plate("upper", 0.35, 1.0, None),
        ],
        background_permittivity: 1.0,
        domain: Box3 { min: [-2.0; 3], max: [2.0; 3] },
        walls: [[Wall::Insulated; 2]; 3],
    };
    let solution = solve(&scene, &settings(1e-2)).unwrap();
    for v in &solution.floating[0].per_driven {
        assert!((v.value - 0.5).abs() < 1e-9 && v.lower <= 0.5 && 0.5 <= v.upper, "{v:?}");
    }
}

fn by_hand(whole: &Solution, charge: f64) -> ([[f64; 2]; 2], [f64; 3]) {
    let c = |i: usize, j: usize| whole.maxwell[i][j].value;
    let reduced = [0, 2].map(|i| [0, 2].map(|j| c(i, j) - c(i, 1) * c(1, j) / c(1, 1)));
    (reduced, [-c(1, 0) / c(1, 1), -c(1, 2) / c(1, 1), charge / c(1, 1)])
}

#[test]
fn a_floating_box_among_three_gives_the_whole_matrix_without_it() {
    let charge = 1e-11;
    // On one grid the middle of the bounds on the whole matrix, reduced by hand, lies between the bounds on
    // the reduced matrix.
    let resolution = Some(ResolutionLevel { order: 3, levels: 0 });
    let coarse = Settings { resolution, ..settings(1e-3) };
    let (matrix, potentials) = by_hand(&solve(&boxes(None), &coarse).unwrap(), charge);
    let solution = solve(&boxes(Some(charge)), &coarse).unwrap();
    for (found, exact) in solution.maxwell.iter().flatten().zip(matrix.iter().flatten()) {
        let slack = 1e-9 * exact.abs();
        assert!(found.lower - slack <= *exact && *exact <= found.upper + slack, "{found:?}: {exact:e}");
        assert!(found.relative_error() < 0.3, "{found:?}");
    }
    let only = &solution.floating[0];
    for (found, exact) in only.per_driven.iter().chain([&only.from_charges]).zip(potentials) {
        close(found.value, exact, 1e-9);
        assert!(found.lower < exact && exact < found.upper && found.relative_error() < 0.3, "{found:?}");
    }
}
