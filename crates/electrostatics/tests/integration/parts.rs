//! Conductors of several parts: boxes that touch, overlap or are disjoint, at one potential.

use elastocap_electrostatics::{
    Bounded, MeshScene, ResolutionLevel, Settings, Solution, SolveError, Target, TetrahedraSettings, solve,
    solve_mesh,
};
use elastocap_geometry::meshing::tets::{LayeredError, LayeredSizing, MeshError, Sizing, layered, mesh};
use elastocap_geometry::scene::{Body, Box3, Potential, Role, Scene, Wall};
use elastocap_geometry::shapes::Shape;

/// Random scenes that are tried.
const SEEDS: u64 = 5;

fn cuboid(min: [f64; 3], max: [f64; 3]) -> Shape {
    Shape::Box(Box3 { min, max })
}

fn of_parts(name: &str, parts: &[Shape]) -> Body {
    Body { parts: parts.to_vec(), ..Body::conductor(name, parts[0].clone()) }
}

fn grounded(bodies: Vec<Body>) -> Scene {
    let domain = Box3 { min: [-1.0, -1.2, -1.1], max: [1.3, 1.0, 1.4] };
    Scene { bodies, background_permittivity: 1.0, domain, walls: [[Wall::Grounded; 2]; 3] }
}

fn settings(relative_tolerance: f64) -> Settings {
    Settings { relative_tolerance, ..Settings::default() }
}

fn by_boxes(bodies: Vec<Body>, tolerance: f64) -> Vec<Vec<Bounded>> {
    let found = solve(&grounded(bodies), &settings(tolerance)).unwrap();
    assert!(found.reached, "{:?}", found.shortfall);
    found.maxwell
}

#[track_caller]
fn overlap(a: Bounded, b: Bounded) {
    assert!(a.lower <= b.upper && b.lower <= a.upper, "{a:?} {b:?}");
}

/// A block next to the bar.
fn block() -> Body {
    Body::conductor("block", cuboid([0.5, -0.5, -0.5], [0.9, 0.4, 0.6]))
}

fn whole() -> Vec<Shape> {
    vec![cuboid([-0.6, -0.3, -0.4], [0.3, 0.2, 0.5])]
}

fn cut() -> Vec<Shape> {
    vec![cuboid([-0.6, -0.3, -0.4], [-0.1, 0.2, 0.5]), cuboid([-0.1, -0.3, -0.4], [0.3, 0.2, 0.5])]
}

fn overlapping() -> Vec<Shape> {
    // One long part and one within it along x1, so that lines meet the end of the second before that of the
    // first.
    vec![
        cuboid([-0.6, -0.3, -0.4], [0.3, 0.1, 0.5]),
        cuboid([-0.6, -0.1, -0.4], [0.3, 0.2, 0.5]),
        cuboid([-0.4, -0.2, -0.3], [0.1, 0.05, 0.4]),
    ]
}

#[test]
fn a_conductor_in_parts_that_touch_or_overlap_has_the_bounds_of_the_whole() {
    let expected = by_boxes(vec![of_parts("bar", &whole()), block()], 5e-4);
    for parts in [cut(), overlapping()] {
        let found = by_boxes(vec![of_parts("bar", &parts), block()], 5e-4);
        for (row, other) in expected.iter().zip(&found) {
            row.iter().zip(other).for_each(|(a, b)| overlap(*a, *b));
        }
        // The field is the same, and the grids differ by the planes of the parts only: the errors agree to
        // 1e-6.
        let relative = found[0][1].value / expected[0][1].value - 1.0;
        assert!(relative.abs() < 1e-5, "{relative:e}");
    }
}

#[test]
fn boxes_on_one_wire_have_the_sum_of_the_entries_of_separate_boxes() {
    // In a row, with two mirror planes, so that a quarter is solved.
    let [one, other, last] =
        [[-0.8, -0.5], [-0.2, 0.2], [0.5, 0.9]].map(|[from, to]| cuboid([from, -0.3, -0.4], [to, 0.3, 0.4]));
    let matrix = |bodies: Vec<Body>| {
        let domain = Box3 { min: [-1.2, -1.0, -1.0], max: [1.3, 1.0, 1.0] };
        let found = solve(&Scene { domain, ..grounded(bodies) }, &settings(3e-4)).unwrap();
        assert!(found.reached, "{:?}", found.shortfall);
        found.maxwell
    };
    let alone = |name: &str, shape: &Shape| Body::conductor(name, shape.clone());
    let separate = matrix(vec![alone("one", &one), alone("other", &other), alone("last", &last)]);
    let wired = matrix(vec![of_parts("pair", &[one, other]), alone("last", &last)]);
    let sum = |entries: &[Bounded]| Bounded {
        value: entries.iter().map(|b| b.value).sum(),
        lower: entries.iter().map(|b| b.lower).sum(),
        upper: entries.iter().map(|b| b.upper).sum(),
    };
    overlap(wired[0][0], sum(&[separate[0][0], separate[0][1], separate[1][0], separate[1][1]]));
    overlap(wired[0][1], sum(&[separate[0][2], separate[1][2]]));
    overlap(wired[1][1], separate[2][2]);
    // The planes are the same, and so is the field where both boxes are at one potential: the errors agree to
    // 1e-6.
    let relative = wired[0][1].value / (separate[0][2].value + separate[1][2].value) - 1.0;
    assert!(relative.abs() < 1e-5, "{relative:e}");
}

#[test]
fn a_pair_of_combs_is_its_own_mirror_image_and_gives_the_same_with_and_without_symmetry() {
    // Two fingers each, in turn; the mirror image of one comb is the other.
    let finger = |x: f64| cuboid([x - 0.08, -0.1, -0.5], [x + 0.08, 0.1, 0.5]);
    let combs =
        vec![of_parts("a", &[finger(-0.6), finger(0.2)]), of_parts("b", &[finger(-0.2), finger(0.6)])];
    let mut scene = grounded(combs);
    scene.domain = Box3 { min: [-1.0; 3], max: [1.0; 3] };
    let with = solve(&scene, &settings(1e-3)).unwrap();
    assert_eq!(with.mirrored, [true; 3]);
    let without = solve(&scene, &Settings { symmetry: false, ..settings(1e-3) }).unwrap();
    // The whole has the grid of a part and its mirror images. The iterations leave an error of 3e-8 of an
    // energy, and each repair lowers its bound.
    let left = 2.0 * 3e-8 + with.repair_share + without.repair_share;
    let scale = with.maxwell[0][0].value;
    for (a, b) in with.maxwell.iter().flatten().zip(without.maxwell.iter().flatten()) {
        for (a, b) in [(a.lower, b.lower), (a.value, b.value), (a.upper, b.upper)] {
            assert!((a - b).abs() <= left * scale, "{a:e} {b:e} {left:e}");
        }
    }
}

/// Two hooks, of two boxes each, which the mirrors across the marked axes exchange together, and no mirror
/// alone.
fn hooks(across: [bool; 3]) -> Vec<Body> {
    let boxes =
        [([-0.7, -0.25, -0.6], [-0.45, -0.1, 0.5]), ([-0.7, -0.25, -0.6], [0.3, -0.1, -0.4])].to_vec();
    let turned = |(low, high): &([f64; 3], [f64; 3])| {
        let ends = [0, 1, 2].map(|a| if across[a] { [-high[a], -low[a]] } else { [low[a], high[a]] });
        cuboid(ends.map(|e| e[0]), ends.map(|e| e[1]))
    };
    // The second hook is cut into boxes in another way.
    let mut other: Vec<Shape> = boxes.iter().map(turned).collect();
    other.push(turned(&([-0.7, -0.25, -0.6], [-0.45, -0.1, -0.4])));
    let one: Vec<Shape> = boxes.iter().map(|(low, high)| cuboid(*low, *high)).collect();
    vec![of_parts("one", &one), of_parts("other", &other)]
}

#[test]
fn conductors_that_a_half_turn_brings_to_each_others_place_are_solved_once() {
    let resolution = Some(ResolutionLevel { order: 3, levels: 1 });
    let settings = Settings { resolution, ..settings(1e-3) };
    let turns = [[true, false, true], [true, true, false], [true; 3]];
    for (across, wall) in turns.into_iter().zip([Wall::Open, Wall::Grounded, Wall::Grounded]) {
        let mut scene = Scene { walls: [[wall; 2]; 3], ..grounded(hooks(across)) };
        scene.domain = if wall == Wall::Open { Box3::SPACE } else { Box3 { min: [-1.0; 3], max: [1.0; 3] } };
        let once = solve(&scene, &settings).unwrap();
        assert!(once.mirrored.iter().filter(|m| **m).count() < 2, "{:?}", once.mirrored);
        let each = solve(&scene, &Settings { symmetry: false, ..settings.clone() }).unwrap();
        if across == [true, false, true] {
            // Each of the two problems is on half of the part that a mirror leaves.
            assert!(3 * once.unknowns <= each.unknowns, "{} {}", once.unknowns, each.unknowns);
        } else {
            assert!(once.iterations < each.iterations, "{} {}", once.iterations, each.iterations);
        }
        // Iterations leave 2e-3 of the tolerance.
        let left = 4.0 * 2e-6 + once.repair_share + each.repair_share;
        let scale = once.maxwell[0][0].value;
        for (a, b) in once.maxwell.iter().flatten().zip(each.maxwell.iter().flatten()) {
            for (a, b) in [(a.lower, b.lower), (a.upper, b.upper)] {
                assert!((a - b).abs() <= left * scale, "{across:?} {wall:?}: {a:e} {b:e} {left:e}");
            }
        }
        let [a, b] = [once.maxwell[0][0], once.maxwell[1][1]];
        assert!((a.upper - b.upper).abs() < 1e-11 * scale && (a.lower - b.lower).abs() < 1e-9 * scale);
    }
}

/// The hooks that a half turn about the second axis exchanges, in open space.
fn open_hooks() -> Scene {
    let scene = grounded(hooks([true, false, true]));
    Scene { domain: Box3::SPACE, walls: [[Wall::Open; 2]; 3], ..scene }
}

#[test]
fn the_field_of_what_a_half_turn_takes_to_itself_is_that_without_symmetry() {
    let resolution = Some(ResolutionLevel { order: 3, levels: 1 });
    let settings = Settings { resolution, field: true, ..settings(1e-3) };
    for target in [Target::Matrix, Target::Own(0)] {
        let scene = open_hooks();
        let sampled = |symmetry: bool| {
            solve(&scene, &Settings { symmetry, target, ..settings.clone() }).unwrap().field.unwrap()
        };
        let (half, whole) = (sampled(true), sampled(false));
        assert_eq!(half.nodes, whole.nodes);
        assert_eq!(half.body, whole.body);
        let most = whole.electric_field.iter().flatten().flatten().fold(0.0_f64, |most, e| most.max(e.abs()));
        for (a, b) in half.potential.iter().zip(&whole.potential) {
            assert!((a - b).abs() < 1e-3, "{a} {b}");
        }
        for (a, b) in half
            .electric_field
            .iter()
            .flatten()
            .flatten()
            .zip(whole.electric_field.iter().flatten().flatten())
        {
            assert!((a - b).abs() < 1e-2 * most, "{a} {b} of {most}");
        }
    }
}

#[test]
fn opposite_potentials_alone_give_the_two_terminal_capacitance_without_the_matrix() {
    let hooks = |beside: Option<Shape>| {
        let mut scene = open_hooks();
        scene.bodies.push(Body::grounded("plate", cuboid([-0.8, -0.6, -0.7], [0.8, -0.5, 0.7])));
        scene.bodies.extend(beside.map(|shape| Body::dielectric("beside", shape, 5.0)));
        scene
    };
    let settings_for = |relative_tolerance: f64, target_alone: bool| Settings {
        target: Target::TwoTerminal,
        target_alone,
        ..settings(relative_tolerance)
    };
    let exact = solve(&hooks(None), &settings_for(1e-3, false)).unwrap().two_terminal.unwrap();
    for tolerance in [1e-1, 1e-2] {
        let alone = solve(&hooks(None), &settings_for(tolerance, true)).unwrap();
        let found = alone.two_terminal.unwrap();
        assert!(alone.maxwell.is_empty() && alone.reached && found.spread_over_value() <= tolerance);
        assert!(found.lower <= exact.upper && exact.lower <= found.upper, "{found:?} {exact:?}");
        assert_eq!(alone.measured, alone.two_terminal);
    }
    // Where the turn leads to another scene, or a floating body takes a potential, the whole matrix is solved
    // for.
    let other = hooks(Some(cuboid([0.5, 0.2, -0.2], [0.7, 0.5, 0.2])));
    assert_eq!(solve(&other, &settings_for(1e-1, true)).unwrap().maxwell.len(), 2);
    let mut floating = hooks(None);
    floating.bodies.push(Body {
        role: Role::Conductor { potential: Potential::Floating { charge: 0.0 } },
        ..Body::conductor("patch", cuboid([-0.2, 0.1, -0.2], [0.2, 0.2, 0.2]))
    });
    assert_eq!(solve(&floating, &settings_for(1e-1, true)).unwrap().maxwell.len(), 2);
}

/// Boxes and sheets between places of a lattice, so that they begin, end and lie in the middle of the scene,
/// each with its turned image; the images are a second conductor, or parts of the same one, which may be
/// grounded. None touches one of another conductor.
fn turned_scene(seed: u64) -> Scene {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    let mut next = move |below: u64| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) % below
    };
    let turned = |(min, max): ([f64; 3], [f64; 3])| ([-max[0], min[1], -max[2]], [-min[0], max[1], -min[2]]);
    let apart = |a: &([f64; 3], [f64; 3]), b: &([f64; 3], [f64; 3])| {
        (0..3).any(|k| a.1[k] + 0.05 < b.0[k] || b.1[k] + 0.05 < a.0[k])
    };
    let mut placed: Vec<Vec<([f64; 3], [f64; 3])>> = Vec::new();
    let mut bodies = Vec::new();
    for attempt in 0..40 {
        let range =
            |from: u64, length: u64| [0.2 * (from as f64 - 3.0), 0.2 * ((from + length).min(6) as f64 - 3.0)];
        let [x, y, z] = [range(next(6), next(4)), range(next(4), next(2)), range(next(6), next(4))];
        if [x, y, z].iter().filter(|r| r[0] == r[1]).count() > 1 {
            continue;
        }
        let one = ([x[0], y[0], z[0]], [x[1], y[1], z[1]]);
        let other = turned(one);
        let is_free = |b: &([f64; 3], [f64; 3])| placed.iter().flatten().all(|k| apart(k, b));
        if !is_free(&one) || !is_free(&other) || bodies.len() > 3 {
            continue;
        }
        let [a, b] = [one, other].map(|(min, max)| cuboid(min, max));
        match apart(&one, &other) && next(3) > 0 {
            true => bodies.extend([
                Body::conductor(format!("{attempt}"), a),
                Body::conductor(format!("{attempt} turned"), b),
            ]),
            false => {
                let body = if next(2) == 0 {
                    Body::conductor(format!("{attempt}"), a)
                } else {
                    Body::grounded(format!("{attempt}"), a)
                };
                bodies.push(Body { parts: [body.parts.clone(), vec![b]].concat(), ..body });
            }
        }
        placed.push(vec![one, other]);
    }
    bodies.push(Body::dielectric("layer", cuboid([-0.7, -0.2, -0.7], [0.7, 0.3, 0.7]), 3.0));
    let walls = [[Wall::Open; 2], [Wall::Grounded; 2], [Wall::Insulated; 2]][next(3) as usize];
    let walls = [walls; 3];
    let domain = if walls[0][0] == Wall::Open { Box3::SPACE } else { Box3 { min: [-0.9; 3], max: [0.9; 3] } };
    Scene { bodies, background_permittivity: 1.0, domain, walls }
}

#[test]
fn half_of_any_scene_that_a_half_turn_takes_to_itself_gives_the_bounds_of_the_whole() {
    let resolution = Some(ResolutionLevel { order: 2, levels: 0 });
    let (mut turned, mut compared) = (0, 0);
    for seed in 1..=SEEDS {
        let scene = turned_scene(seed);
        if !scene.conductors().any(|c| c.potential == Potential::Driven) {
            continue;
        }
        let bounds = |symmetry: bool| {
            solve(&scene, &Settings { resolution, symmetry, ..settings(1e-6) })
                .map_err(|e| format!("{seed}: {e}"))
        };
        let (half, whole) = (bounds(true).unwrap(), bounds(false).unwrap());
        compared += 1;
        turned += usize::from(half.mirrored == [false; 3] && 10 * half.unknowns < 7 * whole.unknowns);
        let n = half.maxwell.len();
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            let scale = (half.maxwell[i][i].upper * half.maxwell[j][j].upper).sqrt();
            let (a, b) = (half.maxwell[i][j], whole.maxwell[i][j]);
            let left = 1e-5 + half.repair_share + whole.repair_share;
            for (a, b) in [(a.lower, b.lower), (a.upper, b.upper)] {
                assert!(
                    (a - b).abs() <= left * scale,
                    "{seed}: {i} {j}: {a:e} {b:e} of {scale:e}\n{scene:?}"
                );
            }
        }
    }
    println!("{turned} of {compared}");
    assert!(2 * turned > compared, "{turned} of {compared}");
}

#[test]
fn a_little_more_than_the_tolerance_is_accepted_where_that_is_allowed() {
    let scene = open_hooks();
    let strict = solve(&scene, &settings(1e-2)).unwrap();
    let spread = |solution: &Solution| solution.maxwell[0][0].spread_over_value();
    // A tolerance that the same grid misses by a little.
    let missed = Settings { relative_tolerance: 0.9 * spread(&strict), ..settings(1e-2) };
    let again = solve(&scene, &missed).unwrap();
    assert!(spread(&again) <= missed.relative_tolerance && again.reached);
    let accepted = solve(&scene, &Settings { accepted: 1.5, ..missed.clone() }).unwrap();
    assert!(accepted.reached && spread(&accepted) <= 1.5 * missed.relative_tolerance);
    assert!(accepted.grids <= again.grids && accepted.unknowns <= again.unknowns);
}

#[test]
fn a_dielectric_on_one_side_makes_a_half_turn_another_scene() {
    let resolution = Some(ResolutionLevel { order: 3, levels: 1 });
    let settings = Settings { resolution, ..settings(1e-3) };
    let domain = Box3 { min: [-1.0; 3], max: [1.0; 3] };
    let mut scene = Scene { domain, ..grounded(hooks([true, false, true])) };
    let shape = cuboid([0.5, 0.2, -0.2], [0.7, 0.5, 0.2]);
    scene.bodies.push(Body {
        role: Role::Dielectric { relative_permittivity: 5.0 },
        ..Body::conductor("beside", shape)
    });
    let with = solve(&scene, &settings).unwrap();
    let without = solve(&scene, &Settings { symmetry: false, ..settings }).unwrap();
    assert_eq!(with.iterations, without.iterations);
    assert_eq!(with.maxwell, without.maxwell);
    assert!((with.maxwell[0][0].upper / with.maxwell[1][1].upper - 1.0).abs() > 1e-4);
}

#[test]
fn the_box_solver_refuses_other_shapes_by_name() {
    let ball = Shape::Sphere { center: [0.0; 3], radius: 0.2 };
    let mut scene = grounded(vec![block(), of_parts("lamp", &[cuboid([-0.5; 3], [-0.3; 3]), ball])]);
    let refused = solve(&scene, &settings(1e-2)).unwrap_err();
    assert_eq!(refused, SolveError::NotBoxes { body: "lamp".into() });
    scene.bodies[1].parts.pop();
    assert!(solve(&scene, &settings(1e-1)).is_ok());
}

#[test]
fn meshes_hold_conductors_of_several_parts() {
    let known = by_boxes(vec![of_parts("bar", &whole()), block()], 1e-3);
    let of_mesh = |mesh| {
        let shapes = MeshScene {
            permittivity: &[1.0],
            potentials: &[Potential::Driven; 2],
            planes: &[None, None, None],
        };
        let settings = TetrahedraSettings { relative_tolerance: 1e-1, ..TetrahedraSettings::default() };
        solve_mesh(mesh, shapes, &settings).unwrap().solution.maxwell
    };
    for parts in [cut(), overlapping()] {
        let scene = grounded(vec![of_parts("bar", &parts), block()]);
        let by_layers = layered(&scene, &LayeredSizing::default()).unwrap().unwrap();
        let by_facets = mesh(&scene, &Sizing::default()).unwrap().mesh;
        for mesh in [by_layers, by_facets] {
            let found = of_mesh(mesh);
            for (row, other) in known.iter().zip(&found) {
                row.iter().zip(other).for_each(|(a, b)| overlap(*a, *b));
            }
        }
    }
}

#[test]
fn parts_of_different_conductors_that_touch_are_refused_by_the_meshers() {
    let [first, second] = [cut()[0].clone(), cut()[1].clone()];
    let scene = grounded(vec![
        of_parts("a", &[first, cuboid([-0.9, 0.6, 0.7], [-0.7, 0.8, 0.9])]),
        Body::conductor("b", second),
    ]);
    let touching = layered(&scene, &LayeredSizing::default()).unwrap();
    assert_eq!(touching, Err(LayeredError::Touching { first: "a".into(), second: "b".into() }));
    let crossing = mesh(&scene, &Sizing::default());
    assert!(
        matches!(&crossing, Err(MeshError::Crossing { first, second, .. }) if first == "a" && second == "b"),
        "{crossing:?}"
    );
}

#[test]
fn a_ball_on_a_rod_is_one_conductor() {
    // A round part that crosses another one of the same conductor: refused if they were two.
    let rod = Shape::Cylinder { axis: 1, base: [0.0, -0.8, 0.0], radius: 0.15, height: 0.8 };
    let ball = Shape::Sphere { center: [0.0, 0.1, 0.0], radius: 0.3 };
    let scene = grounded(vec![of_parts("pin", &[rod.clone(), ball.clone()])]);
    let meshed = mesh(&scene, &Sizing::default()).unwrap();
    assert!(
        meshed
            .mesh
            .boundary
            .iter()
            .any(|face| { face.role == elastocap_geometry::meshing::tets::FaceRole::Conductor(0) })
    );
    let two = grounded(vec![Body::conductor("rod", rod), Body::conductor("ball", ball)]);
    assert!(matches!(mesh(&two, &Sizing::default()), Err(MeshError::Crossing { .. })));
}
