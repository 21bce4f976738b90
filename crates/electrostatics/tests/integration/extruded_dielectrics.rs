//! Edges at which three or more dielectrics meet across the axis of an extruded scene.

use elastocap_electrostatics::{Target, solve, solve_extruded};
use elastocap_geometry::scene::{Body, Box3, Scene, Wall};
use elastocap_geometry::shapes::Shape;

use crate::extruded::{block, settings};

const MM: f64 = 1e-3;

/// A film on one of two plates, and a liquid of a permittivity up to a third of their height.
fn level(permittivity: f64) -> Scene {
    let place = |x: [f64; 3]| x.map(|x| x * MM);
    let filled = |lo, hi| Shape::Box(Box3 { min: place(lo), max: place(hi) });
    Scene {
        bodies: vec![
            block("a", place([0.0; 3]), place([0.8, 30.0, 5.0])),
            block("b", place([3.0, 0.0, 0.0]), place([3.5, 30.0, 5.0])),
            Body::dielectric("liquid", filled([0.8, 0.0, 0.0], [3.0, 10.0, 5.0]), permittivity),
            Body::dielectric("film", filled([0.8, 0.0, 0.0], [1.0, 30.0, 5.0]), 2.3),
        ],
        background_permittivity: 1.0,
        domain: Box3 { min: [0.0; 3], max: place([3.5, 30.0, 5.0]) },
        walls: [[Wall::Insulated; 2]; 3],
    }
}

#[test]
fn a_level_between_plates_is_known_to_the_tolerance_whatever_the_contrast_of_what_meets_there() {
    for permittivity in [2.3, 4.5, 10.0, 80.0] {
        let settings = settings(1e-3, Target::TwoTerminal);
        let boxes = solve(&level(permittivity), &settings).unwrap().two_terminal.unwrap();
        let found = solve_extruded(&level(permittivity), &settings).unwrap().solution;
        assert!(found.reached, "{permittivity}: {:?}", found.shortfall);
        let bounds = found.two_terminal.unwrap();
        assert!(
            bounds.lower <= boxes.upper && boxes.lower <= bounds.upper,
            "{permittivity}: {bounds:?} {boxes:?}"
        );
    }
    // By finite elements of high degree in the plane, which agree to 1e-6.
    let found = solve_extruded(&level(80.0), &settings(1e-3, Target::TwoTerminal)).unwrap().solution;
    let bounds = found.two_terminal.unwrap();
    assert!(bounds.lower < 4.430_221e-12 && 4.430_221e-12 < bounds.upper, "{bounds:?}");
}

#[test]
fn a_level_in_a_coated_tube_around_a_wire_is_known_to_the_tolerance() {
    let radius = MM;
    let tube = |radii: [f64; 2], height: f64| Shape::Tube { axis: 1, base: [0.0; 3], radii, height };
    let scene = Scene {
        bodies: vec![
            Body::conductor(
                "wire",
                Shape::Cylinder { axis: 1, base: [0.0; 3], radius: 0.5 * radius, height: 10.0 * radius },
            ),
            Body::conductor("tube", tube([3.0 * radius, 3.5 * radius], 10.0 * radius)),
            Body::dielectric("water", tube([0.5 * radius, 3.0 * radius], 4.0 * radius), 80.0),
            Body::dielectric("coat", tube([0.5 * radius, 0.8 * radius], 10.0 * radius), 2.3),
        ],
        background_permittivity: 1.0,
        domain: Box3 { min: [-4e-3, 0.0, -4e-3], max: [4e-3, 10e-3, 4e-3] },
        walls: [[Wall::Insulated; 2]; 3],
    };
    let found = solve_extruded(&scene, &settings(1e-3, Target::TwoTerminal)).unwrap().solution;
    assert!(found.reached, "{:?}", found.shortfall);
    // Coaxial layers: water and coat below, coat and air above, each with a field that is radial away from
    // the level.
    let per_length = |inner: &[(f64, f64)]| {
        let series: f64 = inner.windows(2).map(|two| (two[1].0 / two[0].0).ln() / two[1].1).sum();
        std::f64::consts::TAU * elastocap_electrostatics::VACUUM_PERMITTIVITY / series
    };
    let below = per_length(&[(0.5, 1.0), (0.8, 2.3), (3.0, 80.0)]) * 4e-3;
    let above = per_length(&[(0.5, 1.0), (0.8, 2.3), (3.0, 1.0)]) * 6e-3;
    let bounds = found.two_terminal.unwrap();
    // The bent field at the level adds a few per cent.
    assert!(
        bounds.value > below + above && bounds.value < 1.1 * (below + above),
        "{bounds:?}, {below:e} + {above:e}"
    );
}
