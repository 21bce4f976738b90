//! The solver for extruded scenes that are closed across one axis and open along another.

use crate::extruded::{block, on_one_mesh, settings, solved};
use elastocap_electrostatics::{
    ResolutionLevel, Settings, Target, VACUUM_PERMITTIVITY, solve, solve_extruded,
};
use elastocap_geometry::scene::{Body, Box3, Scene, Wall};
use elastocap_geometry::shapes::Shape;
use std::f64::consts::PI;

const OPEN: [Wall; 2] = [Wall::Open; 2];
const INSULATED: [Wall; 2] = [Wall::Insulated; 2];
const GROUNDED: [Wall; 2] = [Wall::Grounded; 2];

/// A scene that ends at -1 and 1 on closed sides.
fn scene(walls: [[Wall; 2]; 3], bodies: Vec<Body>) -> Scene {
    let end = |side: usize| walls.map(|pair| if pair[side] == Wall::Open { f64::INFINITY } else { 1.0 });
    let domain = Box3 { min: end(0).map(|x: f64| -x), max: end(1) };
    Scene { bodies, background_permittivity: 1.0, domain, walls }
}

/// Two wires of 0.3 in radius and 1.2 apart, between walls across x2.
fn wires() -> Scene {
    let wire = |name: &str, x: f64| {
        Body::conductor(name, Shape::Cylinder { axis: 1, base: [x, -1.0, 0.1], radius: 0.3, height: 2.0 })
    };
    scene([OPEN, INSULATED, OPEN], vec![wire("a", -0.6), wire("b", 0.6)])
}

#[test]
fn two_wires_between_insulated_walls_have_the_capacitance_of_the_closed_form_and_so_has_each_of_them() {
    let scene = wires();
    let exact = 2.0 * PI * VACUUM_PERMITTIVITY / 2.0_f64.acosh();
    for target in [Target::TwoTerminal, Target::Matrix] {
        let found = solved(&scene, 1e-4, target);
        assert!(found.reached, "{:?}", found.shortfall);
        let c = found.two_terminal.unwrap();
        assert!(c.lower <= exact && exact <= c.upper && c.spread_over_value() <= 1e-4, "{c:?} {exact:e}");
        for (bounds, sign) in [(found.maxwell[0][0], 1.0), (found.maxwell[0][1], -1.0)] {
            assert!(bounds.lower <= sign * exact && sign * exact <= bounds.upper, "{bounds:?} {exact:e}");
        }
    }
}

#[test]
fn open_sides_that_end_nearby_cost_accuracy_but_the_bounds_hold() {
    // The ends are as far away as the tolerance asks for.
    let resolution = Some(ResolutionLevel { order: 6, levels: 3 });
    let loose = Settings { resolution, ..settings(0.5, Target::TwoTerminal) };
    let c = solve_extruded(&wires(), &loose).unwrap().solution.two_terminal.unwrap();
    let exact = 2.0 * PI * VACUUM_PERMITTIVITY / 2.0_f64.acosh();
    assert!(c.lower < 0.999 * exact && 1.001 * exact < c.upper, "{c:?} {exact:e}");
    assert!(c.spread_over_value() < 0.2, "{c:?}");
}

#[test]
fn bounds_are_those_of_the_box_solver_whatever_is_closed_and_open() {
    let bar = || block("bar", [-0.7, 0.2, -0.4], [-0.2, 0.3, 0.5]);
    let other = || block("other", [0.1, 0.0, -0.5], [0.4, 0.3, 0.3]);
    let through = || block("through", [0.1, -0.3, -1.0], [0.4, 0.3, 1.0]);
    let slab = |e: f64| {
        let inf = f64::INFINITY;
        Body::dielectric("slab", Shape::Box(Box3 { min: [-inf, -0.5, -inf], max: [inf, 0.1, inf] }), e)
    };
    let floating = || Body::floating("free", through().parts[0].clone(), 0.0);
    let (half, mixed) = ([Wall::Insulated, Wall::Open], [Wall::Grounded, Wall::Insulated]);
    let scenes = [
        scene([OPEN, OPEN, INSULATED], vec![bar(), through()]),
        scene([OPEN, INSULATED, OPEN], vec![bar(), other(), slab(4.0)]),
        scene([INSULATED, half, INSULATED], vec![bar(), other(), slab(3.0)]),
        scene([OPEN, GROUNDED, OPEN], vec![bar(), other()]),
        scene([OPEN, mixed, OPEN], vec![bar(), floating()]),
        scene([OPEN, OPEN, mixed], vec![bar(), other(), slab(0.3)]),
        scene([GROUNDED, half, INSULATED], vec![bar(), other()]),
        scene([INSULATED, INSULATED, OPEN], vec![bar(), other()]),
    ];
    for (k, scene) in scenes.iter().enumerate() {
        let resolution = Some(ResolutionLevel { order: 3, levels: 1 });
        let fixed = Settings { resolution, ..settings(1e-2, Target::Matrix) };
        let boxes = solve(scene, &fixed).unwrap();
        let extruded = on_one_mesh(scene, true);
        let fine = solved(scene, 1e-2, Target::Matrix);
        for other in [&extruded, &fine] {
            for (a, b) in boxes.maxwell.iter().flatten().zip(other.maxwell.iter().flatten()) {
                assert!(a.lower <= b.upper && b.lower <= a.upper, "{k}: {a:?} {b:?}");
            }
        }
        if let (Some(a), Some(b)) = (boxes.two_terminal, fine.two_terminal) {
            assert!(a.lower <= b.upper && b.lower <= a.upper, "{k}: {a:?} {b:?}");
        }
        assert!(fine.reached, "{k}: {:?}", fine.shortfall);
    }
}

#[test]
fn a_conductor_alone_between_insulated_walls_has_no_capacitance_to_infinity() {
    let bar = block("bar", [-0.7, 0.2, -0.4], [-0.2, 0.3, 0.5]);
    let found = solve_extruded(&scene([OPEN, OPEN, INSULATED], vec![bar]), &settings(1e-2, Target::Matrix));
    let bounds = found.unwrap().solution.maxwell[0][0];
    assert!(bounds.lower == 0.0 && bounds.upper < 1e-20, "{bounds:?}");
}
