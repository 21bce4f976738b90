//! The solver for extruded scenes against closed forms, against the box solver and against itself.

use elastocap_electrostatics::{
    ResolutionLevel, Settings, Solution, SolveError, Target, VACUUM_PERMITTIVITY, extrusion_axis,
    has_few_edges, is_extruded, solve, solve_extruded,
};
use elastocap_geometry::drawing::{Drawn, Entry, drawn};
use elastocap_geometry::scene::{Body, Box3, Scene, Wall};
use elastocap_geometry::shapes::{Shape, TriangleSurface};
use std::f64::consts::{PI, TAU};

pub(crate) fn open(bodies: Vec<Body>) -> Scene {
    Scene { bodies, background_permittivity: 1.0, domain: Box3::SPACE, walls: [[Wall::Open; 2]; 3] }
}

pub(crate) fn settings(relative_tolerance: f64, target: Target) -> Settings {
    Settings { relative_tolerance, target, ..Settings::default() }
}

pub(crate) fn solved(scene: &Scene, relative_tolerance: f64, target: Target) -> Solution {
    solve_extruded(scene, &settings(relative_tolerance, target)).unwrap().solution
}

/// Solves on one coarse mesh: bounds hold on any mesh.
pub(crate) fn on_one_mesh(scene: &Scene, symmetry: bool) -> Solution {
    let resolution = Some(ResolutionLevel { order: 3, levels: 1 });
    solve_extruded(scene, &Settings { symmetry, resolution, ..settings(1e-3, Target::Matrix) })
        .unwrap()
        .solution
}

/// The in-plane electrode pair: two bars in a layer under air, between insulated walls.
fn pair() -> Scene {
    let um = |lo: [f64; 3], hi: [f64; 3]| {
        Shape::Box(Box3 { min: lo.map(|x| x * 1e-6), max: hi.map(|x| x * 1e-6) })
    };
    Scene {
        bodies: vec![
            Body::conductor("left", um([-325.0, 215.0, -250.0], [-25.0, 235.0, 250.0])),
            Body::conductor("right", um([25.0, 215.0, -250.0], [325.0, 235.0, 250.0])),
            Body::dielectric("layer", um([-1325.0, 0.0, -1250.0], [1325.0, 450.0, 1250.0]), 2.8),
        ],
        background_permittivity: 1.0,
        domain: Box3 { min: [-1325e-6, 0.0, -1250e-6], max: [1325e-6, 1450e-6, 1250e-6] },
        walls: [[Wall::Insulated; 2]; 3],
    }
}

pub(crate) fn disc(name: &str, center: [f64; 3], radius: f64, height: f64) -> Body {
    Body::conductor(name, Shape::Cylinder { axis: 1, base: center, radius, height })
}

pub(crate) fn block(name: &str, lo: [f64; 3], hi: [f64; 3]) -> Body {
    Body::conductor(name, Shape::Box(Box3 { min: lo, max: hi }))
}

#[test]
fn bounds_on_a_pair_contain_the_truth_at_every_degree_and_close_in_on_it() {
    let truth = 43.96589e-15;
    let mut before = f64::INFINITY;
    for order in 2..=8 {
        let levels = (order - 1).min(3);
        let fixed = Settings {
            resolution: Some(ResolutionLevel { order, levels }),
            ..settings(1e-2, Target::TwoTerminal)
        };
        let c = solve_extruded(&pair(), &fixed).unwrap().solution.two_terminal.unwrap();
        assert!(c.lower < truth + 5e-21 && c.upper > truth - 5e-21, "{order}: {c:?}");
        assert!(c.spread_over_value() < before, "{order}: {c:?}");
        before = c.spread_over_value();
    }
    assert!(before < 4e-4, "{before:e}");
}

#[test]
fn discs_without_thickness_have_the_capacitance_of_the_integral_equation() {
    for (gap, ratio) in [(0.02, 1.044_079_653_3), (0.1, 1.175_592_319_4)] {
        let scene = open(vec![disc("a", [0.0; 3], 1.0, 0.0), disc("b", [0.0, gap, 0.0], 1.0, 0.0)]);
        let c = solved(&scene, 1e-4, Target::TwoTerminal).two_terminal.unwrap();
        let exact = ratio * VACUUM_PERMITTIVITY * PI / gap;
        assert!(
            c.lower <= exact && exact <= c.upper && c.spread_over_value() <= 1e-4,
            "{gap}: {c:?} {exact:e}"
        );
    }
}

pub(crate) fn tube(name: &str, center: [f64; 3], radii: [f64; 2], height: f64) -> Body {
    Body::conductor(name, Shape::Tube { axis: 1, base: center, radii, height })
}

#[test]
fn a_cylinder_in_a_tube_has_the_capacitance_of_the_closed_form_in_the_middle_and_beside_it() {
    for offset in [0.0_f64, 0.5] {
        let scene = Scene {
            bodies: vec![
                disc("inner", [offset, 0.0, 0.0], 1.0, 1.0),
                tube("outer", [0.0; 3], [2.0, 2.5], 1.0),
            ],
            background_permittivity: 1.0,
            domain: Box3 { min: [-3.0, 0.0, -3.0], max: [3.0, 1.0, 3.0] },
            walls: [[Wall::Insulated; 2]; 3],
        };
        let c = solved(&scene, 1e-8, Target::TwoTerminal).two_terminal.unwrap();
        let exact = TAU * VACUUM_PERMITTIVITY / ((5.0 - offset * offset) / 4.0).acosh();
        assert!(c.lower <= exact && exact <= c.upper, "{offset}: {c:?} {exact:e}");
        assert!(c.spread_over_value() <= 1e-8, "{offset}: {:e}", c.spread_over_value());
    }
}

/// An outline along x2 from its entries.
pub(crate) fn drawing(name: &str, entries: &[Entry], [from, to]: [f64; 2]) -> Body {
    let Drawn { outline, arcs, .. } = drawn(entries).unwrap();
    Body::conductor(name, Shape::Extrusion { axis: 1, from, to, outline, arcs })
}

/// Points on a circle of radius 1 about (x, 0).
fn on_circle(x: f64, angle: f64) -> [f64; 2] {
    [x + angle.cos(), angle.sin()]
}

#[test]
fn a_cylinder_drawn_by_arcs_is_as_round_as_one_that_is_given_as_such() {
    let (offset, height) = (0.5_f64, [0.0, 1.0]);
    let arc =
        |through: f64, to: f64| Entry::Arc { through: on_circle(offset, through), to: on_circle(offset, to) };
    let three = drawing("inner", &[arc(0.4, 0.9), arc(2.0, 3.3), arc(4.6, 6.0)], height);
    // Half of it, whose straight side lies on an insulated wall, with the entries either way round.
    let half = |sign: f64| {
        let [top, bottom] = [1.0, -1.0].map(|y| [offset, sign * y]);
        drawing(
            "inner",
            &[Entry::Corner(bottom), Entry::Arc { through: [offset + 1.0, 0.0], to: top }],
            height,
        )
    };
    let whole = Box3 { min: [-3.0, 0.0, -3.0], max: [3.0, 1.0, 3.0] };
    let beside = Box3 { min: [offset, 0.0, -3.0], ..whole };
    let exact = TAU * VACUUM_PERMITTIVITY / 2.0_f64.ln();
    for (inner, domain, share) in [(three, whole, 1.0), (half(1.0), beside, 0.5), (half(-1.0), beside, 0.5)] {
        let outer = tube("outer", [offset, 0.0, 0.0], [2.0, 2.5], 1.0);
        let walls = [[Wall::Insulated; 2]; 3];
        let scene = Scene { bodies: vec![inner, outer], background_permittivity: 1.0, domain, walls };
        let c = solved(&scene, 1e-8, Target::TwoTerminal).two_terminal.unwrap();
        let exact = share * exact;
        assert!(c.lower <= exact && exact <= c.upper, "{share}: {c:?} {exact:e}");
        assert!(c.spread_over_value() <= 1e-8, "{share}: {:e}", c.spread_over_value());
    }
}

#[test]
fn bounds_hold_where_a_circle_touches_a_wall() {
    // An insulated wall along which the field reaches into the corner between the two, seen by a grounded
    // box.
    let mut walls = [[Wall::Grounded; 2]; 3];
    walls[0][1] = Wall::Insulated;
    walls[1] = [Wall::Insulated; 2];
    let domain = Box3 { min: [-2.0, 0.0, -1.5], max: [1.0, 0.5, 1.5] };
    let scene = |body: Body| Scene { bodies: vec![body], background_permittivity: 1.0, domain, walls };
    let polygon = |radius: f64, first: f64| {
        let corner = |k: u32| TAU / 32.0 * (f64::from(k) + first);
        let corners = (0..32).map(|k| Entry::Corner([radius * corner(k).cos(), radius * corner(k).sin()]));
        drawing("polygon", &corners.collect::<Vec<_>>(), [0.0, 0.5])
    };
    let [inner, outer] = [polygon(1.0, 0.0), polygon(1.0 / (PI / 32.0).cos(), 0.5)]
        .map(|body| solved(&scene(body), 1e-3, Target::Matrix).maxwell[0][0]);
    let circle = scene(disc("circle", [0.0; 3], 1.0, 0.5));
    let fine = solved(&circle, 1e-7, Target::Matrix).maxwell[0][0];
    assert!(fine.spread_over_value() <= 1e-7, "{fine:?}");
    assert!(inner.upper < fine.lower && fine.upper < outer.lower, "{inner:?} {fine:?} {outer:?}");
    for order in 2..=6 {
        let resolution = Some(ResolutionLevel { order, levels: 1 });
        let fixed = Settings { resolution, ..settings(1e-3, Target::Matrix) };
        let c = solve_extruded(&circle, &fixed).unwrap().solution.maxwell[0][0];
        assert!(c.lower < fine.upper && fine.lower < c.upper, "{order}: {c:?} {fine:?}");
    }
}

#[test]
fn a_plate_with_rounded_corners_lies_between_those_with_cut_and_with_sharp_ones() {
    let corners = [[-1.0, -0.7], [1.0, -0.7], [1.0, 0.7], [-1.0, 0.7]];
    let radius = 0.4;
    let cut = |[x, y]: [f64; 2]| {
        let (across, along) = ([x - radius * x.signum(), y], [x, y - radius * y.signum()]);
        if x * y > 0.0 { [across, along] } else { [along, across] }
    };
    let sharp: Vec<Entry> = corners.map(Entry::Corner).to_vec();
    let rounded: Vec<Entry> = corners.map(|corner| Entry::Rounded { corner, radius }).to_vec();
    let chamfered: Vec<Entry> = corners.iter().rev().flat_map(|c| cut(*c)).map(Entry::Corner).collect();
    // In a grounded box, where a larger conductor has a larger capacitance. Sheets and thin metal.
    for to in [0.2, 0.25] {
        let [inner, round, outer] = [&chamfered, &rounded, &sharp].map(|entries| {
            let bodies = vec![drawing("plate", entries, [0.2, to])];
            let domain = Box3 { min: [-1.5, 0.0, -1.2], max: [1.5, 0.6, 1.2] };
            let walls = [[Wall::Grounded; 2]; 3];
            let scene = Scene { bodies, background_permittivity: 1.0, domain, walls };
            solved(&scene, 1e-3, Target::Matrix).maxwell[0][0]
        });
        assert!(inner.upper < round.lower && round.upper < outer.lower, "{inner:?} {round:?} {outer:?}");
        // A rounded corner lacks 0.43 of the area that a chamfered one lacks, and 0.73 of the perimeter.
        let share = (outer.value - round.value) / (outer.value - inner.value);
        assert!((0.4..0.75).contains(&share), "{share}");
    }
}

#[test]
fn round_bodies_whose_outlines_cross_in_the_plan_are_solved_and_a_ring_lies_between_its_disc_and_nothing() {
    let below = || disc("below", [0.0; 3], 1.0, 0.0);
    let with = |above: Body| on_one_mesh(&open(vec![below(), above]), true).maxwell[1][1];
    let whole = with(disc("above", [0.7, 0.3, 0.2], 0.8, 0.05));
    let ring = with(tube("above", [0.7, 0.3, 0.2], [0.5, 0.8], 0.05));
    assert!(ring.upper < whole.lower && ring.lower > 0.5 * whole.upper, "{ring:?} {whole:?}");
    // Polygons with very many sides agree, up to their difference from circles.
    let polygon = |radius: f64| {
        let turn = |k: u32| TAU * f64::from(k) / 96.0;
        let corner = |k: u32| [0.7 + radius * turn(k).cos(), 0.2 + radius * turn(k).sin()];
        (0..96).map(corner).collect::<Vec<_>>()
    };
    let polygonal = with(Body::conductor(
        "above",
        Shape::Extrusion { axis: 1, from: 0.3, to: 0.35, outline: polygon(0.8), arcs: Vec::new() },
    ));
    assert!(
        polygonal.lower <= whole.upper && whole.lower <= 1.01 * polygonal.upper,
        "{polygonal:?} {whole:?}"
    );
}

#[test]
fn conductors_that_touch_each_other_or_a_grounded_wall_are_refused_by_name() {
    let extruded = |scene: &Scene| solve_extruded(scene, &settings(1e-2, Target::Matrix)).map(|_| ());
    let touching = |a: Body, b: Body| {
        let (first, second) = (a.name.clone(), b.name.clone());
        assert_eq!(extruded(&open(vec![a, b])), Err(SolveError::Touching { first, second }));
    };
    let outline = |corners: &[[f64; 2]]| Shape::Extrusion {
        axis: 1,
        from: 0.0,
        to: 0.2,
        outline: corners.to_vec(),
        arcs: Vec::new(),
    };
    let triangle = || Body::conductor("triangle", outline(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]));
    // Inside, at a side, at a corner, on top of it.
    touching(triangle(), block("block", [0.1, 0.1, 0.1], [0.3, 0.3, 0.3]));
    touching(triangle(), block("block", [-1.0, 0.0, 0.0], [0.0, 0.2, 1.0]));
    touching(triangle(), block("block", [1.0, 0.0, -1.0], [2.0, 0.2, 0.0]));
    touching(triangle(), block("block", [-1.0, 0.2, -1.0], [2.0, 0.4, 1.0]));
    touching(disc("a", [0.0; 3], 1.0, 0.1), disc("b", [1.5, 0.0, 0.0], 1.0, 0.2));
    let mut in_walls = open(vec![triangle()]);
    in_walls.domain = Box3 { min: [0.0, -1.0, -1.0], max: [2.0, 1.0, 2.0] };
    in_walls.walls = [[Wall::Grounded; 2]; 3];
    assert_eq!(extruded(&in_walls), Err(SolveError::OnGround { conductor: "triangle".into() }));
}

#[test]
fn a_round_plate_capacitor_that_fills_a_round_well_is_exact() {
    // Between insulated walls the field of two plates is uniform wherever they are cut.
    let scene = Scene {
        bodies: vec![
            block("lower", [-1.0, 0.0, -1.0], [1.0, 0.1, 1.0]),
            block("upper", [-1.0, 0.4, -1.0], [1.0, 0.5, 1.0]),
            Body::dielectric(
                "disc",
                Shape::Cylinder { axis: 1, base: [0.1, 0.1, -0.05], radius: 0.6, height: 0.3 },
                5.0,
            ),
        ],
        background_permittivity: 1.0,
        domain: Box3 { min: [-1.0, 0.0, -1.0], max: [1.0, 0.5, 1.0] },
        walls: [[Wall::Insulated; 2]; 3],
    };
    let c = solved(&scene, 1e-8, Target::TwoTerminal).two_terminal.unwrap();
    let exact = VACUUM_PERMITTIVITY * (4.0 + 4.0 * PI * 0.36) / 0.3;
    assert!(c.lower <= exact && exact <= c.upper && c.spread_over_value() < 1e-8, "{c:?} {exact:e}");
}

#[test]
fn boxes_have_the_same_bounds_as_in_the_box_solver_whatever_surrounds_them() {
    let bar = || block("bar", [0.1, 0.2, -0.4], [0.5, 0.3, 0.5]);
    let plate = || block("plate", [-0.6, 0.5, -0.5], [0.4, 0.5, 0.3]);
    let slab = |e: f64| {
        let inf = f64::INFINITY;
        Body::dielectric("slab", Shape::Box(Box3 { min: [-inf, -0.3, -inf], max: [inf, 0.4, inf] }), e)
    };
    let block_of = |e: f64| {
        Body::dielectric("block", Shape::Box(Box3 { min: [-0.8, 0.1, -0.7], max: [0.2, 0.45, 0.6] }), e)
    };
    let closed = |walls: [[Wall; 2]; 3], bodies: Vec<Body>| Scene {
        bodies,
        background_permittivity: 1.0,
        domain: Box3 { min: [-1.0, -0.5, -1.0], max: [1.0, 1.0, 1.0] },
        walls,
    };
    let (g, i) = (Wall::Grounded, Wall::Insulated);
    let scenes = [
        open(vec![bar(), plate()]),
        open(vec![bar(), plate(), slab(4.0)]),
        closed([[i; 2]; 3], vec![bar(), plate(), slab(3.0), block_of(20.0)]),
        closed([[g, i], [i, g], [i, i]], vec![bar(), plate(), block_of(0.2)]),
        closed([[g; 2], [i; 2], [i; 2]], vec![bar(), plate()]),
        closed([[g; 2]; 3], vec![bar(), Body::floating("free", plate().parts[0].clone(), 1e-12)]),
    ];
    for (k, scene) in scenes.iter().enumerate() {
        let boxes = solve(scene, &settings(3e-2, Target::Matrix)).unwrap();
        let extruded = on_one_mesh(scene, true);
        for (a, b) in boxes.maxwell.iter().flatten().zip(extruded.maxwell.iter().flatten()) {
            assert!(a.lower <= b.upper && b.lower <= a.upper, "{k}: {a:?} {b:?}");
        }
        for (a, b) in boxes.floating.iter().zip(&extruded.floating) {
            let (a, b) = (a.from_charges, b.from_charges);
            assert!(a.lower <= b.upper && b.lower <= a.upper, "{k}: {a:?} {b:?}");
        }
        // More iterations where the permittivity is not a product of one along the axis and one across it.
        assert!(extruded.iterations <= 45, "{k}: {}", extruded.iterations);
    }
}

/// The surface of a square plate on which a square frame stands, its faces normal to x2, turned about x2.
fn frame_on_plate(angle: f64) -> TriangleSurface {
    let corner = |half: f64, k: usize| {
        let [x, z] = [[-half, -half], [half, -half], [half, half], [-half, half]][k];
        let (sine, cosine) = angle.sin_cos();
        [cosine * x + sine * z, cosine * z - sine * x]
    };
    let points = [(0.0, 1.0), (0.4, 1.0), (0.4, 0.5), (0.2, 0.5)].into_iter().flat_map(|(y, half)| {
        (0..4).map(move |k| {
            let [x, z] = corner(half, k);
            [x, y, z]
        })
    });
    let mut faces = vec![[0, 1, 2], [0, 2, 3], [12, 14, 13], [12, 15, 14]];
    for ring in [0, 4, 8] {
        for k in 0..4 {
            let [a, b] = [ring + k, ring + (k + 1) % 4];
            faces.extend([[a, b + 4, b], [a, a + 4, b + 4]]);
        }
    }
    TriangleSurface { points: points.collect(), faces }
}

#[test]
fn a_surface_with_a_hole_and_a_step_is_solved_as_its_boxes_are_and_also_after_a_turn() {
    let lid = || block("lid", [-1.0, 0.6, -1.0], [1.0, 0.7, 1.0]);
    let sides = [
        ([-1.0, 0.0, -1.0], [1.0, 0.2, 1.0]),
        ([-1.0, 0.2, -1.0], [-0.5, 0.4, 1.0]),
        ([0.5, 0.2, -1.0], [1.0, 0.4, 1.0]),
        ([-0.5, 0.2, -1.0], [0.5, 0.4, -0.5]),
        ([-0.5, 0.2, 0.5], [0.5, 0.4, 1.0]),
    ];
    let parts = sides.map(|(min, max)| Shape::Box(Box3 { min, max })).to_vec();
    let boxes = open(vec![Body { parts, ..lid() }, lid()]);
    let truth = solve(&boxes, &settings(3e-3, Target::Matrix)).unwrap().maxwell;
    for angle in [0.0, 0.4] {
        let mut turned = lid();
        if angle != 0.0 {
            let (sine, cosine) = f64::sin_cos(angle);
            let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
            turned.parts = vec![Shape::Extrusion {
                axis: 1,
                from: 0.6,
                to: 0.7,
                outline: corners.map(|[x, z]| [cosine * x + sine * z, cosine * z - sine * x]).to_vec(),
                arcs: Vec::new(),
            }];
        }
        let framed = Body::conductor("framed", Shape::Surface(frame_on_plate(angle)));
        let scene = open(vec![framed, turned]);
        // Straight, the same bodies end at fewer places along x1.
        assert_eq!(extrusion_axis(&scene), Some(if angle == 0.0 { 0 } else { 1 }));
        assert!(has_few_edges(&scene));
        let found = solved(&scene, 1e-2, Target::Matrix);
        assert!(found.reached, "{:?}", found.shortfall);
        for (a, b) in truth.iter().flatten().zip(found.maxwell.iter().flatten()) {
            assert!(a.lower <= b.upper && b.lower <= a.upper, "{angle}: {a:?} {b:?}");
        }
    }
}

#[test]
fn conductors_at_several_levels_with_other_outlines_are_solved_with_and_without_mirror_planes() {
    let cross = |from: f64, to: f64| Shape::Extrusion {
        axis: 1,
        from,
        to,
        outline: [
            [1.0, 3.0],
            [1.0, 1.0],
            [3.0, 1.0],
            [3.0, -1.0],
            [1.0, -1.0],
            [1.0, -3.0],
            [-1.0, -3.0],
            [-1.0, -1.0],
            [-3.0, -1.0],
            [-3.0, 1.0],
            [-1.0, 1.0],
            [-1.0, 3.0],
        ]
        .to_vec(),
        arcs: Vec::new(),
    };
    let scene = open(vec![
        Body::conductor("cross", cross(0.0, 0.2)),
        disc("disc", [0.0, 0.7, 0.0], 2.0, 0.1),
        Body::conductor("sheet", Shape::Box(Box3 { min: [-1.5, 1.5, -1.5], max: [1.5, 1.5, 1.5] })),
    ]);
    let with = on_one_mesh(&scene, true);
    assert_eq!(with.mirrored, [true, false, true]);
    let without = on_one_mesh(&scene, false);
    for (a, b) in with.maxwell.iter().flatten().zip(without.maxwell.iter().flatten()) {
        assert!(a.lower <= b.upper && b.lower <= a.upper, "{a:?} {b:?}");
    }
}

#[test]
fn scenes_that_mirror_planes_cut_at_any_angle_are_turned_and_give_the_same_bounds() {
    let arm = vec![[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [1.0, 1.0], [1.0, 3.0], [0.0, 3.0]];
    let arm = Shape::Extrusion { axis: 1, from: 0.0, to: 0.1, outline: arm, arcs: Vec::new() };
    let (low, high) = (f64::NEG_INFINITY, f64::INFINITY);
    let board = Shape::Box(Box3 { min: [low, -1.0, low], max: [high, 0.0, high] });
    let on_diagonal = open(vec![
        Body::conductor("arm", arm),
        disc("disc", [2.2, 0.0, 2.2], 0.8, 0.1),
        Body::dielectric("board", Shape::Box(Box3 { min: [1.5, 0.2, 1.5], max: [2.5, 0.4, 2.5] }), 3.0),
        Body::dielectric("board", board, 4.5),
    ]);
    // Planes normal to x2, through both discs, and one about which they change places.
    let apart = open(vec![disc("a", [0.4, 0.0, 0.1], 1.0, 0.1), disc("b", [2.8, 0.0, 1.9], 1.0, 0.1)]);
    for (scene, planes) in [(on_diagonal, 1), (apart, 3)] {
        let with = on_one_mesh(&scene, true);
        let without = on_one_mesh(&scene, false);
        assert_eq!(with.mirrored.iter().filter(|m| **m).count(), planes);
        assert!(with.unknowns < without.unknowns, "{} {}", with.unknowns, without.unknowns);
        for (a, b) in with.maxwell.iter().flatten().zip(without.maxwell.iter().flatten()) {
            assert!(a.lower <= b.upper && b.lower <= a.upper, "{a:?} {b:?}");
            assert!((a.value - b.value).abs() < 0.3 * (a.upper - a.lower), "{a:?} {b:?}");
        }
    }
}

#[test]
fn conductors_that_change_places_about_a_mirror_plane_are_even_and_odd() {
    let whole = Settings { symmetry: false, ..settings(1e-3, Target::TwoTerminal) };
    let with = solved(&pair(), 1e-3, Target::TwoTerminal);
    let without = solve_extruded(&pair(), &whole).unwrap().solution;
    assert_eq!((with.mirrored[0], without.mirrored[0]), (true, false));
    let [a, b] = [with, without].map(|s| s.two_terminal.unwrap());
    assert!((a.value - b.value).abs() < 2e-4 * a.value, "{a:?} {b:?}");
}

#[test]
fn scenes_of_other_bodies_are_refused_and_the_axis_is_the_one_with_the_fewest_ends() {
    let ball = Body::conductor("ball", Shape::Sphere { center: [0.0; 3], radius: 1.0 });
    let with_ball = open(vec![ball, block("a", [2.0, 0.0, 0.0], [3.0, 1.0, 1.0])]);
    assert_eq!(extrusion_axis(&with_ball), None);
    assert!(!has_few_edges(&with_ball));
    let refused = solve_extruded(&with_ball, &Settings::default()).err();
    assert_eq!(refused, Some(SolveError::NotExtruded));
    // Two cylinders along different axes.
    let other =
        Body::conductor("b", Shape::Cylinder { axis: 0, base: [0.0, 3.0, 0.0], radius: 0.5, height: 1.0 });
    assert_eq!(extrusion_axis(&open(vec![disc("a", [0.0; 3], 1.0, 1.0), other])), None);
    assert_eq!(extrusion_axis(&pair()), Some(2));
    // Closed across x1 and open along x2.
    let mut confined = pair();
    confined.walls[1] = [Wall::Open; 2];
    (confined.domain.min[1], confined.domain.max[1]) = (f64::NEG_INFINITY, f64::INFINITY);
    assert!((0..3).all(|axis| is_extruded(&confined, axis)));
}

#[test]
fn the_field_is_at_the_potentials_of_the_conductors_and_between_them() {
    let scene = open(vec![disc("a", [0.0; 3], 1.0, 0.1), disc("b", [0.0, 0.5, 0.0], 1.0, 0.1)]);
    let with_field = Settings { field: true, ..settings(3e-2, Target::TwoTerminal) };
    let found = solve_extruded(&scene, &with_field).unwrap();
    let (mesh, potentials) = found.field.unwrap();
    assert_eq!(potentials.len(), 2);
    for t in 0..mesh.tets.len() {
        assert!(
            mesh.determinant(t) > 0.0,
            "{t}: {:e} {:?}",
            mesh.determinant(t),
            mesh.tets[t].map(|p| mesh.points[p as usize])
        );
    }
    for (p, point) in mesh.points.iter().enumerate() {
        let near = |low: f64| point[0].hypot(point[2]) <= 1.0 - 1e-9 && (low..=low + 0.1).contains(&point[1]);
        let expected = match (near(0.0), near(0.5)) {
            (true, _) => Some([1.0, 0.0]),
            (_, true) => Some([0.0, 1.0]),
            _ => None,
        };
        let at_point = [0, 1].map(|c| potentials[c][p]);
        if let Some(expected) = expected {
            assert!((0..2).all(|c| (at_point[c] - expected[c]).abs() < 1e-9), "{point:?}: {at_point:?}");
        }
        assert!(at_point.iter().all(|u| (-0.05..1.05).contains(u)), "{point:?}: {at_point:?}");
    }
}
