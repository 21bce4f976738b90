//! Sheets that contain the axis along which a scene is extruded: segments of the plan, pulled over an
//! interval of the axis.

use crate::extruded::{block, disc, on_one_mesh, open, settings, solved, tube};
use elastocap_electrostatics::{
    ResolutionLevel, Settings, SolveError, Target, VACUUM_PERMITTIVITY, extrusion_axis, solve, solve_extruded,
};
use elastocap_geometry::scene::{Body, Box3, Scene, Wall};
use elastocap_geometry::shapes::Shape;

/// The scene with a prism of the background's permittivity, which leaves only one axis to pull outlines
/// along.
fn along(axis: usize, mut scene: Scene) -> Scene {
    let outline = vec![[0.7, 0.7], [0.9, 0.7], [0.7, 0.85]];
    let prism = Shape::Extrusion { axis, from: -0.1, to: 0.2, outline, arcs: Vec::new() };
    scene.bodies.push(Body::dielectric("nothing", prism, scene.background_permittivity));
    assert_eq!(extrusion_axis(&scene), Some(axis));
    scene
}

fn closed(walls: [[Wall; 2]; 3], bodies: Vec<Body>) -> Scene {
    let domain = Box3 { min: [-1.0; 3], max: [1.0; 3] };
    Scene { bodies, background_permittivity: 1.0, domain, walls }
}

/// A sheet normal to x1.
fn foil(name: &str, x: f64, [y0, y1]: [f64; 2], [z0, z1]: [f64; 2]) -> Body {
    block(name, [x, y0, z0], [x, y1, z1])
}

const INSULATED: [[Wall; 2]; 3] = [[Wall::Insulated; 2]; 3];

#[test]
fn two_sheets_have_the_same_capacitance_by_the_axis_they_contain_and_by_the_one_they_are_normal_to() {
    let pair = || {
        open(vec![
            block("a", [-0.5, 0.0, -0.4], [0.5, 0.0, 0.4]),
            block("b", [-0.4, 0.2, -0.4], [0.5, 0.2, 0.5]),
        ])
    };
    let flat = solved(&along(1, pair()), 1e-2, Target::TwoTerminal);
    for axis in [0, 2] {
        let upright = solved(&along(axis, pair()), 1e-2, Target::TwoTerminal);
        let [a, b] = [&flat, &upright].map(|found| found.two_terminal.unwrap());
        assert!(a.lower <= b.upper && b.lower <= a.upper, "{axis}: {a:?} {b:?}");
        assert!(a.spread_over_value() <= 1e-2 && b.spread_over_value() <= 1e-2, "{axis}: {a:?} {b:?}");
    }
}

#[test]
fn plates_without_thickness_that_cut_an_insulated_box_are_an_ideal_capacitor() {
    let plate = |name: &str, x: f64| foil(name, x, [-1.0, 1.0], [-1.0, 1.0]);
    for axis in [1, 2] {
        let scene = along(axis, closed(INSULATED, vec![plate("a", -0.3), plate("b", 0.2)]));
        let c = solved(&scene, 1e-8, Target::TwoTerminal).two_terminal.unwrap();
        let exact = VACUUM_PERMITTIVITY * 4.0 / 0.5;
        assert!(c.lower <= exact && exact <= c.upper && c.spread_over_value() < 1e-8, "{c:?} {exact:e}");
    }
}

#[test]
fn a_foil_in_a_round_tube_has_the_capacitance_of_the_closed_form_in_the_middle_and_beside_it() {
    // Groetzsch's ring, the unit disc without the segment from 0 to k, has 4 K(k) / K'(k); a Moebius
    // transformation moves its segment to the middle, from -0.5 to 0.5 for k = 0.8.
    let mean = |mut a: f64, mut b: f64| {
        for _ in 0..10 {
            (a, b) = (0.5 * (a + b), (a * b).sqrt());
        }
        a
    };
    let exact = 4.0 * VACUUM_PERMITTIVITY * mean(1.0, 0.8) / mean(1.0, 0.6);
    for ends in [[-0.5, 0.5], [0.0, 0.8]] {
        let foil = block("foil", [ends[0], 0.0, 0.0], [ends[1], 1.0, 0.0]);
        let scene = Scene {
            domain: Box3 { min: [-1.5, 0.0, -1.5], max: [1.5, 1.0, 1.5] },
            ..closed(INSULATED, vec![foil, tube("tube", [0.0; 3], [1.0, 1.2], 1.0)])
        };
        let c = solved(&scene, 1e-5, Target::TwoTerminal).two_terminal.unwrap();
        assert!(c.lower <= exact && exact <= c.upper, "{ends:?}: {c:?} {exact:e}");
        assert!(c.spread_over_value() <= 1e-5, "{ends:?}: {c:?}");
    }
}

#[test]
fn bounds_are_those_of_the_box_solver_wherever_the_sheets_stand() {
    let bar = |x: f64| block("bar", [x, -0.5, -0.4], [x + 0.2, 0.3, 0.5]);
    let slab =
        Body::dielectric("slab", Shape::Box(Box3 { min: [-1.0, -0.6, -1.0], max: [1.0, -0.2, 1.0] }), 4.0);
    let (g, i, o) = ([Wall::Grounded; 2], [Wall::Insulated; 2], [Wall::Open; 2]);
    let inner = || foil("foil", 0.1, [-0.5, 0.4], [-0.6, 0.3]);
    let whole = || foil("whole", 0.1, [-1.0, 1.0], [-0.6, 0.3]);
    // Two sheets at a right angle, a plate and a sheet on it, and two halves at different heights.
    let corner = |parts: [Body; 2]| Body {
        parts: parts.iter().flat_map(|b| b.parts.clone()).collect(),
        ..block("corner", [0.0; 3], [1.0; 3])
    };
    let across = block("", [0.1, -0.5, 0.3], [0.5, 0.4, 0.3]);
    let plate = block("", [-0.1, -0.5, -0.6], [0.3, -0.5, 0.3]);
    let upper = foil("", 0.1, [0.1, 0.7], [-0.2, 0.3]);
    let lower = foil("", 0.1, [-0.6, -0.1], [-0.6, 0.0]);
    let between_halves = [[Wall::Insulated, Wall::Open], o, o];
    let half = Scene {
        domain: Box3 { min: [0.1, f64::NEG_INFINITY, f64::NEG_INFINITY], ..Box3::SPACE },
        walls: between_halves,
        ..open(vec![inner(), bar(0.5)])
    };
    let scenes = [
        closed(INSULATED, vec![bar(-0.6), whole()]),
        closed([g, i, i], vec![bar(-0.6), inner(), slab.clone()]),
        closed([i, g, g], vec![bar(-0.6), floating(inner())]),
        closed([g, g, g], vec![bar(-0.6), corner([inner(), across])]),
        closed([g, g, i], vec![bar(-0.6), corner([inner(), plate])]),
        closed([i, i, g], vec![bar(-0.6), corner([upper, lower]), slab]),
        closed(
            [g; 3],
            vec![
                foil("left", -0.3, [-0.5, 0.4], [-0.3, 0.3]),
                foil("right", 0.3, [-0.5, 0.4], [-0.3, 0.3]),
                foil("middle", 0.0, [-0.2, 0.6], [-0.4, 0.4]),
            ],
        ),
        closed([i; 3], vec![foil("wall", -1.0, [-0.5, 0.4], [-0.3, 0.3]), bar(0.1)]),
        open(vec![inner(), bar(-0.6)]),
        half,
    ];
    for (k, scene) in scenes.into_iter().enumerate() {
        let fixed = Settings {
            resolution: Some(ResolutionLevel { order: 3, levels: 1 }),
            ..settings(1e-2, Target::Matrix)
        };
        let boxes = solve(&scene, &fixed).unwrap();
        for axis in [1, 2] {
            let found = on_one_mesh(&along(axis, scene.clone()), true);
            for (a, b) in boxes.maxwell.iter().flatten().zip(found.maxwell.iter().flatten()) {
                assert!(a.lower <= b.upper && b.lower <= a.upper, "{k} {axis}: {a:?} {b:?}");
            }
            let diagonal = found.maxwell[0][0];
            assert!(diagonal.spread_over_value() < 0.05, "{k} {axis}: {diagonal:?}");
            assert!(found.iterations <= 15, "{k} {axis}: {}", found.iterations);
        }
    }
}

fn floating(body: Body) -> Body {
    Body::floating("free", body.parts[0].clone(), 0.0)
}

#[test]
fn sheets_that_touch_or_cross_what_else_stands_in_the_plan_are_refused_by_name() {
    let touching = |a: Body, b: Body| {
        let (first, second) = (a.name.clone(), b.name.clone());
        let refused =
            solve_extruded(&along(1, open(vec![a, b])), &settings(1e-2, Target::Matrix)).map(|_| ());
        assert_eq!(refused, Err(SolveError::Touching { first, second }));
    };
    let sheet = || foil("sheet", 0.0, [0.0, 1.0], [-1.0, 1.0]);
    touching(sheet(), block("across", [-0.5, 0.5, 0.2], [0.5, 1.5, 0.2]));
    touching(sheet(), block("on its rim", [-0.5, 1.0, -0.5], [0.5, 1.2, 0.5]));
    touching(sheet(), foil("beside", 0.0, [1.0, 2.0], [0.5, 1.5]));
    touching(sheet(), foil("the same", 0.0, [0.2, 0.4], [0.5, 1.5]));
    touching(disc("disc", [0.9, 0.3, 0.1], 1.0, 0.2), sheet());
    touching(block("at its side", [0.0, 0.2, 0.2], [0.5, 0.4, 0.4]), sheet());
    let mut scene = closed(INSULATED, vec![foil("sheet", -1.0, [-0.5, 0.4], [-0.3, 0.3])]);
    scene.walls[0][0] = Wall::Grounded;
    let refused = solve_extruded(&along(2, scene), &settings(1e-2, Target::Matrix)).map(|_| ());
    assert_eq!(refused, Err(SolveError::OnGround { conductor: "sheet".into() }));
}

#[test]
fn mirror_planes_cut_sheets_in_two_and_exchange_them_and_there_is_none_that_contains_one() {
    let name = |x: f64| if x < 0.0 { "left" } else { "right" };
    let middle = || foil("middle", 0.0, [-0.3, 0.3], [-0.4, 0.4]);
    let [left, right] = [-0.3, 0.3].map(|x| foil(name(x), x, [-0.5, 0.5], [-0.4, 0.4]));
    let bars = [-0.5, 0.3].map(|x| block(name(x), [x, -0.5, -0.4], [x + 0.2, 0.5, 0.4]));
    let scenes = [
        vec![left.clone(), right.clone()],
        vec![left, right, middle()],
        [bars.to_vec(), vec![middle()]].concat(),
    ];
    for bodies in scenes {
        let outline = vec![[0.95, 0.0], [0.0, 0.95], [-0.95, 0.0], [0.0, -0.95]];
        for walls in [[Wall::Insulated; 2], [Wall::Grounded; 2]] {
            let scene = closed([walls; 3], bodies.clone());
            let fixed = Settings {
                resolution: Some(ResolutionLevel { order: 3, levels: 1 }),
                ..settings(1e-2, Target::Matrix)
            };
            let boxes = solve(&scene, &fixed).unwrap();
            for axis in [1, 2] {
                let mut scene = scene.clone();
                let prism = Shape::Extrusion {
                    axis,
                    from: -0.9,
                    to: 0.9,
                    outline: outline.clone(),
                    arcs: Vec::new(),
                };
                scene.bodies.push(Body::dielectric("nothing", prism, 1.0));
                let [with, without] = [true, false].map(|symmetry| on_one_mesh(&scene, symmetry));
                let in_plane = bodies.len() == 3;
                assert_eq!([with.mirrored, without.mirrored], [[!in_plane, true, true], [false; 3]]);
                for found in [&with, &without] {
                    for (a, b) in boxes.maxwell.iter().flatten().zip(found.maxwell.iter().flatten()) {
                        assert!(a.lower <= b.upper && b.lower <= a.upper, "{axis}: {a:?} {b:?}");
                    }
                    let diagonal = found.maxwell[0][0];
                    assert!(diagonal.spread_over_value() < 0.1, "{axis}: {diagonal:?}");
                }
            }
        }
    }
}
