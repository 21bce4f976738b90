//! Scenes under a map that are solved as a base plus the changes by a body that is added to it.

use elastocap_electrostatics::{
    Additions, Base, MapAxis, SceneMap, Settings, Solution, SolveError, Target, solve, solve_base,
    solve_mapped, solve_superposed,
};
use elastocap_geometry::scene::{Body, Box3, Potential, Role, Scene, Wall};
use elastocap_geometry::shapes::Shape;
use std::sync::Arc;

fn cuboid(min: [f64; 3], max: [f64; 3]) -> Shape {
    Shape::Box(Box3 { min, max })
}

/// Two electrodes in a layer on a grounded plane, and possibly one more body, in open space.
fn scene(more: Option<Body>) -> Scene {
    let layer = [[f64::NEG_INFINITY, 0.0, f64::NEG_INFINITY], [f64::INFINITY, 0.4, f64::INFINITY]];
    let mut bodies = vec![
        Body::conductor("left", cuboid([-0.7, 0.1, -0.6], [-0.2, 0.2, 0.6])),
        Body::conductor("right", cuboid([0.2, 0.1, -0.6], [0.7, 0.2, 0.6])),
        Body::dielectric("layer", cuboid(layer[0], layer[1]), 3.0),
    ];
    bodies.extend(more);
    let mut domain = Box3::SPACE;
    domain.min[1] = 0.0;
    let mut walls = [[Wall::Open; 2]; 3];
    walls[1][0] = Wall::Grounded;
    Scene { bodies, background_permittivity: 1.0, domain, walls }
}

/// A box over the pair, and a map that makes it bulge and lowers it, beside the middle or not.
fn with_finger(potential: Potential, middle: f64) -> (Scene, Arc<SceneMap>) {
    with_finger_of(Role::Conductor { potential }, middle)
}

fn with_finger_of(role: Role, middle: f64) -> (Scene, Arc<SceneMap>) {
    let mut finger = Body::conductor("finger", cuboid([middle - 0.5, 1.4, -0.5], [middle + 0.5, 2.4, 0.5]));
    finger.role = role;
    let axis = |breaks: &[f64], mirrored: bool| {
        let degrees = vec![6; breaks.len() - 1];
        MapAxis { breaks: breaks.to_vec(), degrees, mirrored }
    };
    let along = match middle {
        0.0 => axis(&[0.0, 0.5, 1.5], true),
        _ => axis(&[-1.5, -0.5, 0.5, 1.5].map(|x| middle + x), false),
    };
    let axes = [along, axis(&[0.6, 1.4, 2.4, 3.4], false), axis(&[0.0, 0.5, 1.5], true)];
    let bend = |[x, y, z]: [f64; 3]| {
        let x = x - middle;
        let fall = |x: f64| if x.abs() > 0.5 { 1.5 - x.abs() } else { 1.0 };
        let up = match y {
            _ if y < 1.4 => (y - 0.6) / 0.8,
            _ if y > 2.4 => 3.4 - y,
            _ => 1.0,
        };
        let bulge = (1.0 - 0.3 * (x * x).min(0.25) - 0.3 * (z * z).min(0.25)) * fall(x) * fall(z) * up;
        [0.0, -0.3 * bulge, 0.0]
    };
    (scene(Some(finger)), Arc::new(SceneMap::new(axes, bend)))
}

fn to(relative_tolerance: f64, target: Target) -> Settings {
    Settings { relative_tolerance, target, ..Settings::default() }
}

const ADDITIONS: Additions = Additions { reach: 4.0, change: 1.0, share: 0.2, nearer: None };

fn base_of(full: &(Scene, Arc<SceneMap>), settings: &Settings) -> Base {
    solve_base(&scene(None), (&full.0, &full.1), ADDITIONS, settings).unwrap().unwrap()
}

/// Checks the bounds of both solves against each other, and the second against its tolerance.
fn agree(direct: &Solution, added: &Solution) {
    assert!(added.reached, "{:?}", added.shortfall);
    for (a, b) in direct.maxwell.iter().flatten().zip(added.maxwell.iter().flatten()) {
        println!("{:e} to {:e}, added {:e} to {:e}", a.lower, a.upper, b.lower, b.upper);
        assert!(a.lower <= b.upper && b.lower <= a.upper, "{a:?} {b:?}");
    }
}

#[test]
fn a_finger_that_is_added_to_a_pair_gives_the_capacitances_of_both_together() {
    let target = Target::Mutual([0, 1]);
    for middle in [0.0, 0.3] {
        let full = with_finger(Potential::Grounded, middle);
        let tolerances: &[f64] = if middle == 0.0 { &[3e-2, 3e-3] } else { &[3e-2] };
        let direct = solve_mapped(&full.0, &full.1, &to(tolerances[tolerances.len() - 1], target)).unwrap();
        for &tolerance in tolerances {
            let settings = to(tolerance, target);
            let added = solve_superposed(&full.0, &full.1, &base_of(&full, &settings), &settings).unwrap();
            agree(&direct, &added);
        }
    }
}

#[test]
fn so_does_a_finger_that_floats() {
    let full = with_finger(Potential::Floating { charge: 0.0 }, 0.0);
    let settings = to(3e-3, Target::TwoTerminal);
    let direct = solve_mapped(&full.0, &full.1, &settings).unwrap();
    let added = solve_superposed(&full.0, &full.1, &base_of(&full, &settings), &settings).unwrap();
    agree(&direct, &added);
    let [a, b] = [&direct, &added].map(|found| &found.floating[0].per_driven[0]);
    assert!(
        a.lower <= b.upper && b.lower <= a.upper && (a.value / b.value - 1.0).abs() < 1e-2,
        "{a:?} {b:?}"
    );
}

#[test]
fn so_does_a_finger_of_some_permittivity_in_air_or_in_what_has_a_higher_one() {
    for (around, inside, middle) in [(1.0, 20.0, 0.0), (4.0, 1.5, 0.3)] {
        let mut full = with_finger_of(Role::Dielectric { relative_permittivity: inside }, middle);
        full.0.background_permittivity = around;
        let settings = to(3e-3, Target::Mutual([0, 1]));
        let direct = solve_mapped(&full.0, &full.1, &settings).unwrap();
        let without = Scene { background_permittivity: around, ..scene(None) };
        let base = solve_base(&without, (&full.0, &full.1), ADDITIONS, &settings).unwrap().unwrap();
        let added = solve_superposed(&full.0, &full.1, &base, &settings).unwrap();
        agree(&direct, &added);
        // Without it, other bounds.
        let (with, alone) = (added.maxwell[0][1], solve(&without, &settings).unwrap().maxwell[0][1]);
        println!("without {:e} to {:e}", alone.lower, alone.upper);
        assert!(with.lower > alone.upper || alone.lower > with.upper, "{with:?} {alone:?}");
    }
}

#[test]
fn without_mirrors_the_bounds_are_the_same() {
    let full = with_finger(Potential::Grounded, 0.0);
    let solved = |symmetry: bool| {
        let settings = Settings { symmetry, ..to(3e-2, Target::Mutual([0, 1])) };
        solve_superposed(&full.0, &full.1, &base_of(&full, &settings), &settings).unwrap()
    };
    let (with, without) = (solved(true), solved(false));
    for (a, b) in with.maxwell.iter().flatten().zip(without.maxwell.iter().flatten()) {
        let scale = with.maxwell[0][0].value;
        assert!((a.lower - b.lower).abs() + (a.upper - b.upper).abs() < 1e-4 * scale, "{a:?} {b:?}");
    }
}

/// The pair in its layer, without a plane below it.
fn in_open_space(scene: Scene) -> Scene {
    Scene { domain: Box3::SPACE, walls: [[Wall::Open; 2]; 3], ..scene }
}

/// A grounded box high over the pair in open space, which a map makes bulge and lowers by as much as is
/// given.
fn far_finger(lowered: f64) -> (Scene, Arc<SceneMap>) {
    let finger = Body::grounded("finger", cuboid([-1.5, 28.5, -1.5], [1.5, 31.5, 1.5]));
    let axis = |breaks: &[f64], mirrored: bool| {
        let degrees = vec![4; breaks.len() - 1];
        MapAxis { breaks: breaks.to_vec(), degrees, mirrored }
    };
    let axes =
        [axis(&[0.0, 1.5, 3.5], true), axis(&[26.5, 28.5, 31.5, 33.5], false), axis(&[0.0, 1.5, 3.5], true)];
    let bend = move |[x, y, z]: [f64; 3]| {
        let fall = |x: f64| if x.abs() > 1.5 { 0.5 * (3.5 - x.abs()) } else { 1.0 };
        let up = match y {
            _ if y < 28.5 => (y - 26.5) / 2.0,
            _ if y > 31.5 => (33.5 - y) / 2.0,
            _ => 1.0,
        };
        let bulge = (1.0 - 0.1 * (x * x).min(1.0) - 0.1 * (z * z).min(1.0)) * fall(x) * fall(z) * up;
        [0.0, -lowered * bulge, 0.0]
    };
    (in_open_space(scene(Some(finger))), Arc::new(SceneMap::new(axes, bend)))
}

#[test]
fn the_error_of_a_base_cancels_in_the_change_between_two_fingers() {
    let target = Target::Mutual([0, 1]);
    let (scenes, without) = ([0.7, -0.7].map(far_finger), in_open_space(scene(None)));
    let direct = scenes.each_ref().map(|(scene, map)| solve_mapped(scene, map, &to(3e-5, target)).unwrap());
    let [from, now] = direct.each_ref().map(|solution| solution.measured.unwrap());
    let change = [now.lower - from.upper, now.upper - from.lower];
    let tolerance = 1e-4;
    let settings = to(tolerance, target);
    let additions = Additions { reach: 34.0, nearer: Some(0.0), ..ADDITIONS };
    let (first, map) = &scenes[0];
    let base = solve_base(&without, (first, map), additions, &settings).unwrap().unwrap();
    assert!(base.cancels());
    let [a, b] = scenes.each_ref().map(|(scene, map)| {
        let found = solve_superposed(scene, map, &base, &settings).unwrap();
        assert!(found.reached, "{:?}", found.shortfall);
        let (measured, with) = (found.measured.unwrap(), found.with_error_of_base.unwrap());
        assert!(with.upper - with.lower <= tolerance * with.value, "{with:?}");
        // The contribution of the error of the base is not negative, and at most the error of the
        // capacitance.
        assert!(with.upper >= measured.lower && measured.upper >= with.lower, "{measured:?} {with:?}");
        [measured, with]
    });
    for ([_, with], direct) in [a, b].iter().zip([from, now]) {
        println!("{:e} to {:e}: {:e} to {:e}", direct.lower, direct.upper, with.lower, with.upper);
    }
    let found = |k: usize| [b[k].lower - a[k].upper, b[k].upper - a[k].lower];
    let [by_itself, with] = [found(0), found(1)];
    println!("{tolerance:e}: {change:?}, {by_itself:?}, with the error of the base {with:?}");
    for range in [by_itself, with] {
        assert!(range[0] <= change[1] && change[0] <= range[1], "{range:?} {change:?}");
    }
    // The middle of the change by sharp solves lies within.
    let middle = 0.5 * (change[0] + change[1]);
    assert!(with[0] <= middle && middle <= with[1], "{with:?} {middle:e}");
    // The error of a base for fingers that come nearer does not cancel.
    let additions = Additions { reach: 34.0, nearer: Some(25.0), ..ADDITIONS };
    let base = solve_base(&without, (&scenes[0].0, &scenes[0].1), additions, &to(1e-3, target));
    assert!(!base.unwrap().unwrap().cancels());
}

#[test]
fn a_map_that_bends_an_electrode_is_refused() {
    let mut full = with_finger(Potential::Grounded, 0.0);
    let settings = to(3e-2, Target::Mutual([0, 1]));
    let base = base_of(&full, &settings);
    let axis = |breaks: &[f64], mirrored: bool| {
        let degrees = vec![2; breaks.len() - 1];
        MapAxis { breaks: breaks.to_vec(), degrees, mirrored }
    };
    let axes = [axis(&[0.0, 1.5], true), axis(&[0.15, 3.4], false), axis(&[0.0, 1.5], true)];
    let bend = |[x, y, z]: [f64; 3]| {
        [0.0, -0.02 * (y - 0.15) * (3.4 - y) * (2.25 - x * x) * (2.25 - z * z) / 5.0, 0.0]
    };
    full.1 = Arc::new(SceneMap::new(axes, bend));
    let refused = solve_superposed(&full.0, &full.1, &base, &settings);
    assert!(matches!(refused, Err(SolveError::Superposition)), "{refused:?}");
}
