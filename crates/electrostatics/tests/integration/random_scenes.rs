//! Random scenes of boxes and sheets against one another.

use elastocap_electrostatics::{
    Bounded, ResolutionLevel, Settings, Solution, extrusion_axis, solve, solve_extruded,
};
use elastocap_geometry::scene::{Body, Box3, Role, Scene, Wall};
use elastocap_geometry::shapes::Shape;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

fn config(cases: u32) -> ProptestConfig {
    ProptestConfig {
        cases,
        rng_seed: RngSeed::Fixed(4),
        failure_persistence: None,
        // A scene that breaks a law is small enough to be looked at as it is, and takes seconds to solve
        // again.
        max_shrink_iters: 0,
        ..ProptestConfig::default()
    }
}

/// Up to two conductors (boxes, or sheets where the thickness is drawn so) in cells of a 3 x 3 x 3 lattice,
/// so that they never touch, at most one dielectric box anywhere, and a last one of `LAST_PERMITTIVITY`.
fn scene() -> impl Strategy<Value = Scene> {
    let wall = || prop_oneof![Just(Wall::Insulated), Just(Wall::Grounded), Just(Wall::Open)];
    let body =
        (0..27usize, prop::array::uniform3(0.1..0.4f64), prop::array::uniform3(0.5..0.9f64), 0..4usize);
    let dielectric = (prop::array::uniform3(-1.0..3.0f64), prop::array::uniform3(0.1..2.0f64), 1.0..20.0f64);
    (prop::collection::vec(body, 1..=2), prop::collection::vec(dielectric, 0..=1), wall(), wall()).prop_map(
        |(bodies, dielectrics, side, top)| {
            let mut used = Vec::new();
            let mut conductors = Vec::new();
            for (cell, lo, hi, flat) in bodies {
                if used.contains(&cell) {
                    continue;
                }
                used.push(cell);
                let corner = [cell / 9, cell / 3 % 3, cell % 3].map(|c| c as f64);
                let mut region = Box3 { min: corner, max: corner };
                for a in 0..3 {
                    region.min[a] += lo[a];
                    region.max[a] += if flat == a { lo[a] } else { hi[a] };
                }
                conductors.push(Body::conductor(format!("c{cell}"), Shape::Box(region)));
            }
            // With all walls insulated a single conductor holds no charge.
            let side = if conductors.len() == 1 && side == Wall::Insulated { Wall::Grounded } else { side };
            let boxes = dielectrics
                .into_iter()
                .map(|(min, size, eps)| (min, [0, 1, 2].map(|a| min[a] + size[a]), eps));
            in_walls(conductors, boxes.collect(), side, top)
        },
    )
}

/// The relative permittivity of the last dielectric of every scene here.
const LAST_PERMITTIVITY: f64 = 1.5;

fn in_walls(
    mut bodies: Vec<Body>,
    mut boxes: Vec<([f64; 3], [f64; 3], f64)>,
    side: Wall,
    top: Wall,
) -> Scene {
    boxes.push(([-0.2, 0.2, -0.3], [1.9, 2.2, 1.3], LAST_PERMITTIVITY));
    bodies.extend(boxes.into_iter().enumerate().map(|(k, (min, max, relative_permittivity))| {
        Body::dielectric(format!("dielectric {k}"), Shape::Box(Box3 { min, max }), relative_permittivity)
    }));
    let walls = [[side; 2], [side, top], [side; 2]];
    let mut domain = Box3::SPACE;
    for a in 0..3 {
        if walls[a][0] != Wall::Open {
            domain.min[a] = -0.5;
        }
        if walls[a][1] != Wall::Open {
            domain.max[a] = 3.6;
        }
    }
    Scene { bodies, background_permittivity: 1.0, domain, walls }
}

/// Solves on one coarse grid: bounds hold on any grid.
fn coarse(scene: &Scene) -> Solution {
    let resolution = Some(ResolutionLevel { order: 2, levels: 0 });
    solve(scene, &Settings { relative_tolerance: 1e-3, resolution, ..Settings::default() }).unwrap()
}

/// The scene with axis `a` in the place of axis `a + 1`, seen in a mirror across the first axis after that.
fn turned_and_mirrored(scene: &Scene) -> Scene {
    let region = |r: &Box3| {
        let turned = |corner: [f64; 3]| [corner[2], corner[0], corner[1]];
        let (mut min, mut max) = (turned(r.min), turned(r.max));
        (min[0], max[0]) = (-max[0], -min[0]);
        Box3 { min, max }
    };
    let mut out = scene.clone();
    for body in &mut out.bodies {
        let boxes = body.boxes().unwrap();
        body.parts = boxes.iter().map(|part| Shape::Box(region(part))).collect();
    }
    out.domain = region(&scene.domain);
    out.walls = [scene.walls[2], scene.walls[0], scene.walls[1]];
    out.walls[0].reverse();
    out
}

/// Share of an energy that the iterative solver may leave, whatever the tolerance of the solve.
const ITERATION: f64 = 3e-8;

/// Share of an energy by which a lower bound may be below the largest one on its grid: the error of the
/// iteration, and the energy of the repair.
fn left_below(solution: &Solution) -> f64 {
    ITERATION + solution.repair_share
}

/// Checks relations between the matrices of a scene and of others that follow from it. They are compared on
/// the same grid, in the same spaces of functions, so that they can differ by rounding and the error of the
/// iterative solver only.
fn assert_lawful(scene: &Scene) {
    let solution = coarse(scene);
    let m = &solution.maxwell;
    let n = m.len();
    let scale = |i: usize, j: usize| (m[i][i].value * m[j][j].value).sqrt();
    for i in 0..n {
        let mut row = 0.0;
        for j in 0..n {
            assert_eq!(m[i][j], m[j][i], "reciprocity");
            assert!(m[i][j].lower <= m[i][j].value && m[i][j].value <= m[i][j].upper);
            assert!(
                i == j || m[i][j].lower <= 1e-12 * m[i][i].value,
                "induced charge has the other sign: {m:?}"
            );
            row += m[i][j].upper;
        }
        assert!(row >= -1e-12 * m[i][i].value, "no more charge is induced than there is: {m:?}");
    }

    // Four times all permittivities: four times the matrix, to the last digit, since four is a power of two.
    let mut fourfold = scene.clone();
    fourfold.background_permittivity *= 4.0;
    for body in &mut fourfold.bodies {
        if let Role::Dielectric { relative_permittivity } = &mut body.role {
            *relative_permittivity *= 4.0;
        }
    }
    let fourfold = coarse(&fourfold).maxwell;
    // The axes named differently and one of them reversed: the same matrix.
    let turned = coarse(&turned_and_mirrored(scene));
    // Sums are cut at other places, and the preconditioner rounds to single precision: the two may stop at
    // different iterates.
    let left = left_below(&solution) + left_below(&turned);
    for i in 0..n {
        for j in 0..n {
            let Bounded { lower, value, upper } = m[i][j];
            let times_four = Bounded { lower: 4.0 * lower, value: 4.0 * value, upper: 4.0 * upper };
            assert_eq!(fourfold[i][j], times_four, "fourfold, {i} {j}");
            let other = turned.maxwell[i][j];
            for (a, b) in [(lower, other.lower), (value, other.value), (upper, other.upper)] {
                assert!((a - b).abs() <= left * scale(i, j), "turned, {i} {j}: {:?} {other:?}", m[i][j]);
            }
        }
    }

    // More permittivity on the same grid: both bounds rise, each the least or largest energy of the same
    // functions.
    let mut denser = scene.clone();
    denser.bodies.last_mut().unwrap().role = Role::Dielectric { relative_permittivity: 20.0 };
    let denser = coarse(&denser);
    for i in 0..n {
        let (less, more) = (m[i][i], denser.maxwell[i][i]);
        assert!(more.upper >= (1.0 - ITERATION) * less.upper, "{i}: {less:?} {more:?}");
        assert!((1.0 + left_below(&denser)) * more.lower >= less.lower, "{i}: {less:?} {more:?}");
    }
}

proptest! {
    #![proptest_config(config(6))]

    #[test]
    fn matrices_obey_reciprocity_and_do_not_depend_on_the_names_of_the_axes_and_grow_with_permittivity(
        scene in scene()
    ) {
        assert_lawful(&scene);
    }
}

/// Both solvers prove their bounds: those of either contain the truth, so that they overlap in every entry.
fn assert_same_by_boxes_and_outlines(scene: &Scene) {
    let resolution = Some(ResolutionLevel { order: 2, levels: 1 });
    let settings = Settings { relative_tolerance: 1e-3, resolution, ..Settings::default() };
    let by_boxes = coarse(scene).maxwell;
    let by_outlines = solve_extruded(scene, &settings).unwrap().solution.maxwell;
    for (a, b) in by_boxes.iter().flatten().zip(by_outlines.iter().flatten()) {
        assert!(a.lower <= b.upper && b.lower <= a.upper, "boxes {a:?}, outlines {b:?}");
    }
}

/// Scenes that boxes and outlines are compared on; `OUTLINE_SCENES` takes another number.
fn compared() -> u32 {
    std::env::var("OUTLINE_SCENES").ok().and_then(|n| n.parse().ok()).unwrap_or(12)
}

proptest! {
    #![proptest_config(config(compared()))]

    #[test]
    fn boxes_and_outlines_prove_bounds_that_overlap(scene in scene()) {
        prop_assume!(extrusion_axis(&scene).is_some());
        assert_same_by_boxes_and_outlines(&scene);
    }
}

#[test]
fn a_sheet_next_to_an_open_side_between_grounded_walls_obeys_the_same_laws() {
    // A scene that failed once when it was drawn at random.
    let region = Box3 { min: [0.1, 0.1, 0.1], max: [0.1, 0.5, 0.5] };
    let sheet = Body::conductor("sheet", Shape::Box(region));
    assert_lawful(&in_walls(vec![sheet], Vec::new(), Wall::Grounded, Wall::Open));
}
