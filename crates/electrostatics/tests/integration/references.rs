//! Box scenes whose capacitance is known: both bounds must hold it.

use elastocap_electrostatics::{Settings, Solution, Target, VACUUM_PERMITTIVITY, solve};
use elastocap_geometry::scene::{Body, Box3, Scene, Wall};
use elastocap_geometry::shapes::Shape;
use std::f64::consts::PI;

fn conductor(name: &str, min: [f64; 3], max: [f64; 3]) -> Body {
    Body::conductor(name, Shape::Box(Box3 { min, max }))
}

fn closed(bodies: Vec<Body>, min: [f64; 3], max: [f64; 3], wall: Wall) -> Scene {
    Scene { bodies, background_permittivity: 1.0, domain: Box3 { min, max }, walls: [[wall; 2]; 3] }
}

fn open(bodies: Vec<Body>) -> Scene {
    Scene { bodies, background_permittivity: 1.0, domain: Box3::SPACE, walls: [[Wall::Open; 2]; 3] }
}

fn settings(relative_tolerance: f64) -> Settings {
    Settings { relative_tolerance, ..Settings::default() }
}

/// The bounds hold `exact`, are as tight as asked, and the value lies between them.
fn check(solution: &Solution, exact: f64, tolerance: f64, slack: f64) {
    let c = solution.two_terminal.unwrap();
    assert!(solution.reached, "{:?}", solution.shortfall);
    assert!(c.lower <= c.value && c.value <= c.upper);
    assert!(c.lower <= exact * (1.0 + slack) && exact * (1.0 - slack) <= c.upper, "{c:?} against {exact:e}");
    assert!((c.upper - c.lower) / c.value <= tolerance);
}

fn cube_in_cube() -> Scene {
    closed(vec![conductor("inner", [-0.5; 3], [0.5; 3])], [-1.0; 3], [1.0; 3], Wall::Grounded)
}

fn square_plates(gap: f64) -> Scene {
    open(vec![
        conductor("lower", [0.0; 3], [1.0, 0.0, 1.0]),
        conductor("upper", [0.0, gap, 0.0], [1.0, gap, 1.0]),
    ])
}

#[test]
fn the_cube_in_a_cube_lies_between_its_bounds_at_every_tolerance() {
    for tolerance in [1e-2, 1e-4, 1e-6] {
        check(
            &solve(&cube_in_cube(), &settings(tolerance)).unwrap(),
            19.127134997 * VACUUM_PERMITTIVITY,
            tolerance,
            1e-9,
        );
    }
}

#[test]
fn the_isolated_cube_lies_between_its_bounds_with_open_space_in_both() {
    for tolerance in [1e-2, 1e-3, 1e-4] {
        let scene = open(vec![conductor("cube", [0.0; 3], [1.0; 3])]);
        check(
            &solve(&scene, &settings(tolerance)).unwrap(),
            0.66067815409957 * 4.0 * PI * VACUUM_PERMITTIVITY,
            tolerance,
            1e-12,
        );
    }
}

#[test]
fn square_plates_of_zero_thickness_lie_between_their_bounds() {
    for (gap, exact) in [(0.1, 1.039044814755), (1.0, 0.266026251586)] {
        check(
            &solve(&square_plates(gap), &settings(1e-3)).unwrap(),
            exact * 4.0 * PI * VACUUM_PERMITTIVITY,
            1e-3,
            1e-11,
        );
    }
}

#[test]
fn a_square_coaxial_line_between_insulated_end_walls_has_its_capacitance_per_length() {
    // 2D: no flux leaves through the ends, so the length only multiplies.
    let mut scene = closed(
        vec![conductor("inner", [-0.5, -0.5, 0.0], [0.5, 0.5, 3.0])],
        [-1.0, -1.0, 0.0],
        [1.0, 1.0, 3.0],
        Wall::Grounded,
    );
    scene.walls[2] = [Wall::Insulated; 2];
    check(
        &solve(&scene, &settings(1e-5)).unwrap(),
        3.0 * 10.234092569368052 * VACUUM_PERMITTIVITY,
        1e-5,
        1e-12,
    );
}

#[test]
fn a_layered_plate_capacitor_filling_its_walls_is_exact() {
    let mut scene = closed(
        vec![conductor("a", [0.0; 3], [1.0, 0.1, 1.0]), conductor("b", [0.0, 0.5, 0.0], [1.0, 0.6, 1.0])],
        [0.0; 3],
        [1.0, 0.6, 1.0],
        Wall::Insulated,
    );
    let slab =
        Box3 { min: [f64::NEG_INFINITY, 0.1, f64::NEG_INFINITY], max: [f64::INFINITY, 0.2, f64::INFINITY] };
    scene.bodies.push(Body::dielectric("slab", Shape::Box(slab), 1e6));
    let solution = solve(&scene, &settings(1e-5)).unwrap();
    check(&solution, VACUUM_PERMITTIVITY / (0.1e-6 + 0.3), 1e-5, 1e-10);
    // All walls insulated: a common potential has no field.
    let m = &solution.maxwell;
    assert!((m[0][0].value + m[0][1].value).abs() <= 1e-12 * m[0][0].value);
}

#[test]
fn the_part_and_the_whole_give_the_same_matrix() {
    // The linear solvers stop when their error is about 2e-3 of the tolerance.
    for (scene, tolerances) in [(cube_in_cube(), [1e-2, 1e-6]), (square_plates(0.3), [1e-2, 1e-3])] {
        for tolerance in tolerances {
            let apart = 2e-3 * tolerance;
            let part = solve(&scene, &settings(tolerance)).unwrap();
            let whole = solve(&scene, &Settings { symmetry: false, ..settings(tolerance) }).unwrap();
            assert_eq!(part.mirrored, [true; 3]);
            assert_eq!(whole.mirrored, [false; 3]);
            for (p, w) in part.maxwell.iter().flatten().zip(whole.maxwell.iter().flatten()) {
                assert!((p.value - w.value).abs() <= apart * w.value.abs(), "{p:?} against {w:?}");
                assert!((p.lower - w.lower).abs() <= 10.0 * apart * w.value.abs());
            }
        }
    }
}

/// eps_r = 4 below x2 = `top`, endless.
fn ground(bottom: f64, top: f64) -> Body {
    let (low, high) = (f64::NEG_INFINITY, f64::INFINITY);
    let region = Box3 { min: [low, bottom, low], max: [high, top, high] };
    Body::dielectric("ground", Shape::Box(region), 4.0)
}

#[test]
fn a_cube_half_sunk_in_the_ground_has_the_mean_permittivity_of_both_halves() {
    // The field of the cube alone is symmetric: it has no normal component on the plane through its middle.
    let cube = conductor("cube", [-0.5; 3], [0.5; 3]);
    let scene = open(vec![cube, ground(f64::NEG_INFINITY, 0.0)]);
    let exact = 2.5 * 0.66067815409957 * 4.0 * PI * VACUUM_PERMITTIVITY;
    for tolerance in [1e-2, 1e-4] {
        check(&solve(&scene, &settings(tolerance)).unwrap(), exact, tolerance, 0.0);
    }
}

#[test]
fn bounds_close_in_on_one_another_where_rays_cross_layers() {
    // Bounds that are no bounds cross before they come this close: the cube stands on the ground, then on a
    // plate that is endless sideways, so that rays from its middle pass from one permittivity to another.
    let cube = || conductor("cube", [-0.5, 0.0, -0.5], [0.5, 1.0, 0.5]);
    for [bottom, top] in [[f64::NEG_INFINITY, 0.0], [f64::NEG_INFINITY, -0.1], [-0.2, 0.0]] {
        let scene = open(vec![cube(), ground(bottom, top)]);
        let [wide, narrow] = [3e-3, 3e-5].map(|t| solve(&scene, &settings(t)).unwrap());
        assert!(narrow.reached, "{:?}", narrow.shortfall);
        let (wide, narrow) = (wide.two_terminal.unwrap(), narrow.two_terminal.unwrap());
        assert!(narrow.lower < narrow.upper);
        assert!(wide.lower <= narrow.lower && narrow.upper <= wide.upper, "{wide:?} {narrow:?}");
    }
}

#[test]
fn without_bounds_the_estimate_covers_the_error_and_is_at_most_ten_times_it() {
    let cases = [
        (cube_in_cube(), 19.127134997 * VACUUM_PERMITTIVITY, [1e-2, 1e-3, 1e-4]),
        (
            open(vec![conductor("cube", [0.0; 3], [1.0; 3])]),
            0.66067815409957 * 4.0 * PI * VACUUM_PERMITTIVITY,
            [1e-2, 1e-3, 3e-4],
        ),
        (square_plates(0.1), 1.039044814755 * 4.0 * PI * VACUUM_PERMITTIVITY, [2e-2, 1e-2, 1e-3]),
        (square_plates(1.0), 0.266026251586 * 4.0 * PI * VACUUM_PERMITTIVITY, [2e-2, 1e-2, 1e-3]),
    ];
    for (scene, exact, tolerances) in cases {
        for tolerance in tolerances {
            let solution = solve(&scene, &Settings { bounds: false, ..settings(tolerance) }).unwrap();
            let c = solution.two_terminal.unwrap();
            let (error, estimate) = ((c.value / exact - 1.0).abs(), c.relative_error());
            assert!(solution.reached && estimate <= tolerance);
            assert!(error <= estimate && estimate <= 10.0 * error, "error {error:e}, estimate {estimate:e}");
        }
    }
}

#[test]
fn capacitance_scales_with_length_and_permittivity_from_nanometres_to_kilometres() {
    let reference = solve(&square_plates(0.5), &settings(1e-2)).unwrap().two_terminal.unwrap().value;
    for scale in [1e-9, 1e3] {
        let mut scene = square_plates(0.5);
        for body in &mut scene.bodies {
            for Box3 { min, max } in body.boxes().unwrap() {
                body.parts =
                    vec![Shape::Box(Box3 { min: min.map(|x| x * scale), max: max.map(|x| x * scale) })];
            }
        }
        scene.background_permittivity = 7.0;
        let value = solve(&scene, &settings(1e-2)).unwrap().two_terminal.unwrap().value;
        assert!((value / (7.0 * scale * reference) - 1.0).abs() < 1e-9);
    }
}

#[test]
fn a_dielectric_box_raises_the_capacitance_and_its_bounds_stay_consistent() {
    // Not a product of one factor per axis: the operator's corrections and the approximate preconditioner are
    // at work.
    let with = |eps: f64| {
        let mut scene = cube_in_cube();
        let region = Box3 { min: [0.6, -0.3, -0.4], max: [0.9, 0.3, 0.2] };
        scene.bodies.push(Body::dielectric("block", Shape::Box(region), eps));
        let s = solve(&scene, &settings(1e-3)).unwrap();
        assert!(s.reached, "{:?}", s.shortfall);
        s.two_terminal.unwrap()
    };
    let (one, ten) = (with(1.0), with(10.0));
    assert!(
        one.lower <= 19.127134997 * VACUUM_PERMITTIVITY && 19.127134997 * VACUUM_PERMITTIVITY <= one.upper
    );
    assert!(ten.lower > one.upper);
    assert!(ten.upper - ten.lower <= 1e-3 * ten.value);
}

#[test]
fn a_pair_in_an_endless_layer_is_solved_to_what_is_asked_for_and_not_far_beyond() {
    for permittivity in [1.0, 2.8, 20.0] {
        let mut scene = open(vec![
            conductor("a", [-2.0, 0.0, 0.0], [-0.5, 0.1, 3.0]),
            conductor("b", [0.5, 0.0, 0.0], [2.0, 0.1, 3.0]),
        ]);
        let layer = Box3 {
            min: [f64::NEG_INFINITY, -1.0, f64::NEG_INFINITY],
            max: [f64::INFINITY, 1.0, f64::INFINITY],
        };
        scene.bodies.push(Body::dielectric("layer", Shape::Box(layer), permittivity));
        for tolerance in [1e-2, 1e-3] {
            let settings = Settings { target: Target::TwoTerminal, ..settings(tolerance) };
            let solution = solve(&scene, &settings).unwrap();
            let spread = solution.two_terminal.unwrap().spread_over_value();
            assert!(solution.reached && spread <= tolerance, "{permittivity}: {:?}", solution.shortfall);
            assert!(spread > 0.1 * tolerance, "{permittivity}: {spread:e} at {tolerance:e}");
        }
    }
}
