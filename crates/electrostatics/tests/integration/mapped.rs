//! Scenes that a map bends: against the box solver where the bent scene is one of boxes, and against
//! invariants of any map.

use std::sync::Arc;

use elastocap_electrostatics::{
    MapAxis, Rounded, SceneMap, Settings, Solution, SolveError, Target, VACUUM_PERMITTIVITY, solve,
    solve_extruded, solve_mapped,
};
use elastocap_geometry::scene::{Body, Box3, Scene, Wall};
use elastocap_geometry::shapes::Shape;

fn cube(half: f64) -> Box3 {
    Box3 { min: [-half; 3], max: [half; 3] }
}

/// A cube in a cube, insulated outside of a grounded one.
fn cube_in_cube() -> Scene {
    Scene {
        bodies: vec![Body::conductor("inner", Shape::Box(cube(0.5)))],
        background_permittivity: 2.0,
        domain: cube(1.0),
        walls: [[Wall::Grounded; 2]; 3],
    }
}

/// Two plates in a layer that a box closes.
fn plates() -> Scene {
    let plate =
        |x: [f64; 2], y: [f64; 2]| Shape::Box(Box3 { min: [x[0], y[0], -0.6], max: [x[1], y[1], 0.6] });
    let domain = Box3 { min: [-1.0, 0.0, -1.2], max: [1.0, 1.6, 1.2] };
    let slab = Box3 { min: [-1.0, 0.0, -1.2], max: [1.0, 1.0, 1.2] };
    Scene {
        bodies: vec![
            Body::conductor("left", plate([-0.7, -0.2], [0.3, 0.5])),
            Body::conductor("right", plate([0.2, 0.7], [0.3, 0.5])),
            Body::dielectric("layer", Shape::Box(slab), 3.0),
        ],
        background_permittivity: 1.0,
        domain,
        walls: [[Wall::Insulated; 2]; 3],
    }
}

fn axis(breaks: &[f64], degree: usize, mirrored: bool) -> MapAxis {
    MapAxis { breaks: breaks.to_vec(), degrees: vec![degree; breaks.len() - 1], mirrored }
}

fn settings(tolerance: f64) -> Settings {
    Settings { relative_tolerance: tolerance, field: false, ..Settings::default() }
}

/// Checks that the bounds of both solves overlap, and that the first meets its tolerance.
fn agree(mapped: &Solution, straight: &Solution, tolerance: f64) {
    for (row, other) in mapped.maxwell.iter().zip(&straight.maxwell) {
        for (c, d) in row.iter().zip(other) {
            println!("[{:.8e} {:.8e}] [{:.8e} {:.8e}]", c.lower, c.upper, d.lower, d.upper);
            assert!(c.lower <= d.upper && d.lower <= c.upper, "{c:?} {d:?}");
        }
    }
    if let (Some(c), Some(d)) = (mapped.two_terminal, straight.two_terminal) {
        println!("pair [{:.8e} {:.8e}] [{:.8e} {:.8e}]", c.lower, c.upper, d.lower, d.upper);
        assert!(c.lower <= d.upper && d.lower <= c.upper);
    }
    println!(
        "{:?} {} {} {:?} {:?}",
        mapped.unknowns, mapped.iterations, mapped.repair_share, mapped.shortfall, mapped.seconds
    );
    assert!(mapped.reached, "{:?} of {tolerance}", mapped.shortfall);
}

#[test]
fn the_identity_gives_the_digits_of_the_box_solver() {
    let grid = axis(&[0.0, 0.5, 1.0], 2, true);
    let map = Arc::new(SceneMap::new([grid.clone(), grid.clone(), grid], |_| [0.0; 3]));
    let (scene, settings) = (cube_in_cube(), settings(1e-3));
    let (mapped, straight) = (solve_mapped(&scene, &map, &settings), solve(&scene, &settings));
    let (mapped, straight) = (mapped.unwrap(), straight.unwrap());
    agree(&mapped, &straight, 1e-3);
    let (c, d) = (mapped.maxwell[0][0], straight.maxwell[0][0]);
    assert!((c.upper - d.upper).abs() < 1e-9 * d.upper, "{c:?} {d:?}");
    assert!((c.lower - d.lower).abs() < 1e-4 * d.upper, "{c:?} {d:?}");
}

#[test]
fn a_stretch_of_the_whole_scene_gives_that_of_the_stretched_boxes() {
    let stretch = |x: f64| x * 0.25;
    // Walls stay where they are: the inner cube alone becomes longer, the room beside it shorter.
    let along = move |x: f64| if x <= 0.5 { stretch(x) } else { stretch(0.5) * (1.0 - x) / 0.5 };
    let grid = axis(&[0.0, 0.5, 1.0], 1, true);
    let map =
        Arc::new(SceneMap::new([grid.clone(), grid.clone(), grid], move |[x, _, _]| [along(x), 0.0, 0.0]));
    let mut stretched = cube_in_cube();
    let long = Box3 { min: [-0.625, -0.5, -0.5], max: [0.625, 0.5, 0.5] };
    stretched.bodies = vec![Body::conductor("inner", Shape::Box(long))];
    let settings = settings(1e-3);
    let mapped = solve_mapped(&cube_in_cube(), &map, &settings).unwrap();
    agree(&mapped, &solve(&stretched, &settings).unwrap(), 1e-3);
}

#[test]
fn a_bend_that_leaves_conductors_and_walls_in_place_changes_nothing() {
    let bump = |x: f64, lo: f64, hi: f64| {
        if lo < x && x < hi { 16.0 * ((x - lo) * (hi - x) / (hi - lo).powi(2)).powi(2) } else { 0.0 }
    };
    let scene = plates();
    let axes = [
        axis(&[0.0, 0.2, 0.7, 1.0], 4, true),
        axis(&[0.0, 0.3, 0.5, 1.0, 1.6], 4, false),
        axis(&[0.0, 0.6, 1.2], 4, true),
    ];
    let map = SceneMap::new(axes, move |[x, y, z]| {
        let beside = bump(x, 0.0, 0.2) * bump(y, 0.0, 0.3) * bump(z, 0.0, 0.6);
        let above = bump(x, 0.2, 0.7) * bump(y, 0.5, 1.0) * bump(z, 0.0, 0.6);
        [0.02 * beside, 0.03 * above, -0.05 * above + 0.04 * beside]
    });
    let straight = solve(&scene, &settings(1e-4)).unwrap();
    for tolerance in [1e-2, 1e-3] {
        let mapped = solve_mapped(&scene, &Arc::new(map.clone()), &settings(tolerance)).unwrap();
        agree(&mapped, &straight, tolerance);
    }
}

#[test]
fn a_pressed_layer_is_the_layer_of_the_thickness_that_is_left() {
    // u2 = -0.2 x2 in the layer, back to 0 at the wall above.
    let axes = [axis(&[0.0, 1.0], 1, true), axis(&[0.0, 1.0, 1.6], 1, false), axis(&[0.0, 1.2], 1, true)];
    let map =
        SceneMap::new(axes, |[_, y, _]| [0.0, if y <= 1.0 { -0.2 * y } else { -0.2 * (1.6 - y) / 0.6 }, 0.0]);
    let mut pressed = plates();
    for body in &mut pressed.bodies {
        for part in &mut body.parts {
            if let Shape::Box(region) = part {
                (region.min[1], region.max[1]) = (0.8 * region.min[1], 0.8 * region.max[1]);
            }
        }
    }
    let settings = settings(1e-3);
    let mapped = solve_mapped(&plates(), &Arc::new(map), &settings).unwrap();
    agree(&mapped, &solve(&pressed, &settings).unwrap(), 1e-3);
}

/// A map in the plane of x1 and x2 alone, which bends both plates and the surface of the layer.
fn bent_in_the_plane() -> SceneMap {
    let axes = [
        axis(&[0.0, 0.2, 0.7, 1.0], 4, true),
        axis(&[0.0, 0.3, 0.5, 1.0, 1.6], 4, false),
        axis(&[0.0, 1.2], 1, true),
    ];
    SceneMap::new(axes, |[x, y, _]| [0.3 * x * (1.0 - x) * y, 0.4 * y * (1.6 - y) * (x * x - 0.4), 0.0])
}

/// The bodies of `plates` under such a map as outlines pulled along x3, with `pieces` sides in place of each
/// of the boxes'.
fn outlines(map: &SceneMap, pieces: usize) -> Scene {
    let mut scene = plates();
    for body in &mut scene.bodies {
        let whole = !body.is_conductor();
        for part in &mut body.parts {
            let Shape::Box(region) = part.clone() else { continue };
            let ([x0, y0, from], [x1, y1, to]) = (region.min, region.max);
            let corners = [[x0, y0], [x1, y0], [x1, y1], [x0, y1]];
            let mut outline = Vec::new();
            for (n, [x, y]) in corners.into_iter().enumerate() {
                let [u, v] = corners[(n + 1) % 4];
                // Walls and the bottom are straight.
                let count = if whole && n != 2 {
                    1
                } else if n % 2 == 1 {
                    2
                } else {
                    pieces
                };
                outline.extend((0..count).map(|i| {
                    let s = i as f64 / count as f64;
                    let [x, y, _] = map.image([x + s * (u - x), y + s * (v - y), 0.0]);
                    [x, y]
                }));
            }
            *part = Shape::Extrusion { axis: 2, from, to, outline, arcs: Vec::new() };
        }
    }
    scene
}

#[test]
fn plates_bent_in_the_plane_have_the_capacitance_of_their_outlines() {
    let map = bent_in_the_plane();
    let mapped = solve_mapped(&plates(), &Arc::new(map.clone()), &settings(1e-3)).unwrap();
    let straight = solve(&plates(), &settings(1e-3)).unwrap().two_terminal.unwrap();
    let of_outlines = |pieces: usize| {
        solve_extruded(&outlines(&map, pieces), &settings(1e-3)).unwrap().solution.two_terminal.unwrap()
    };
    let (coarse, fine) = (of_outlines(6), of_outlines(12));
    let found = mapped.two_terminal.unwrap();
    println!("{straight:?} {found:?} {coarse:?} {fine:?} {:?}", mapped.seconds);
    assert!(mapped.reached && (found.value / straight.value - 1.0).abs() > 0.05);
    // Chords in place of curves: their error falls with the square of their number.
    let chords = (fine.value - coarse.value).abs() / 3.0 + 3e-4 * fine.value;
    assert!(found.lower < fine.upper + chords && fine.lower < found.upper + chords);
}

#[test]
fn bounds_close_in_on_a_bend_from_both_sides_and_the_field_is_that_of_the_bent_scene() {
    let map = Arc::new(bent_in_the_plane());
    let solved = |tolerance: f64| {
        let settings = Settings { field: true, ..settings(tolerance) };
        solve_mapped(&plates(), &map, &settings).unwrap()
    };
    let found: Vec<Solution> = [3e-2, 3e-3, 3e-4].map(solved).into();
    for pair in found.windows(2) {
        let [loose, tight] = [0, 1].map(|n| pair[n].two_terminal.unwrap());
        println!("{loose:?} {tight:?}");
        assert!(loose.lower <= tight.lower && tight.upper <= loose.upper, "{loose:?} {tight:?}");
    }
    let field = found[1].field.as_ref().unwrap();
    let points = field.points.as_ref().unwrap();
    let [nx, ny, nz] = field.nodes.each_ref().map(Vec::len);
    let at = |i: usize, j: usize, k: usize| (i * ny + j) * nz + k;
    let (mut off, mut total, mut count) = (0.0, 0.0, 0);
    for (i, j, k) in
        (0..nx - 1).flat_map(|i| (0..ny - 1).flat_map(move |j| (0..nz - 1).map(move |k| (i, j, k))))
    {
        let image = map.image([field.nodes[0][i], field.nodes[1][j], field.nodes[2][k]]);
        let point = points[at(i, j, k)];
        assert!((0..3).all(|a| (image[a] - point[a]).abs() < 1e-12), "{image:?} {point:?}");
        // Above the plates, where the map shears most, away from edges.
        let [x, y, z] = [field.nodes[0][i], field.nodes[1][j], field.nodes[2][k]];
        if !(0.2..0.7).contains(&x) || !(0.55..1.0).contains(&y) || z.abs() > 0.5 {
            continue;
        }
        // The fall of the potential along the short edges of a cell against the mean of the field at their
        // ends, as it is in the cell.
        let field_at = |corner: [usize; 3]| {
            let limits = field.electric_field[at(i + corner[0], j + corner[1], k + corner[2])];
            [0, 1, 2].map(|a: usize| limits[1 - corner[a]][a])
        };
        for axis in 0..3 {
            for (s, t) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                let start = [[0, s, t], [s, 0, t], [s, t, 0]][axis];
                let mut end = start;
                end[axis] += 1;
                let [from, to] = [start, end].map(|c| at(i + c[0], j + c[1], k + c[2]));
                let path = [0, 1, 2].map(|n| points[to][n] - points[from][n]);
                if path.iter().map(|x| x * x).sum::<f64>() > 0.1_f64.powi(2) {
                    continue;
                }
                let fall = field.potential[from] - field.potential[to];
                let ends = [field_at(start), field_at(end)];
                let expected: f64 = (0..3).map(|n| 0.5 * (ends[0][n] + ends[1][n]) * path[n]).sum();
                total += fall * fall;
                off += (fall - expected).powi(2);
                count += 1;
            }
        }
    }
    println!("{} of {count}", (off / total).sqrt());
    assert!(count > 7 && off < 0.05_f64.powi(2) * total, "{}", (off / total).sqrt());
}

#[test]
fn a_solve_that_knows_how_far_the_bounds_of_another_were_from_what_was_foreseen_takes_no_finer_grid() {
    let (scene, map) = (plates(), Arc::new(bent_in_the_plane()));
    let rough = solve_mapped(&scene, &map, &settings(1e-2)).unwrap();
    let foresight = rough.foresight.unwrap();
    assert!(foresight.error <= 1e-2 && (0.1..2.0).contains(&foresight.amplification), "{foresight:?}");
    let to = |foresight| solve_mapped(&scene, &map, &Settings { foresight, ..settings(1e-3) }).unwrap();
    let (with, without) = (to(Some(foresight)), to(None));
    assert!(with.reached && without.reached);
    println!("{foresight:?}: {} {}", with.unknowns, without.unknowns);
    assert!(with.unknowns <= without.unknowns);
    agree(&with, &without, 1e-3);
}

#[test]
fn a_map_that_turns_space_inside_out_is_refused() {
    let axes = [axis(&[0.0, 1.0], 1, true), axis(&[0.0, 1.0, 1.6], 1, false), axis(&[0.0, 1.2], 1, true)];
    let map = SceneMap::new(axes, |[_, y, _]| [0.0, if y == 1.0 { -1.2 } else { 0.0 }, 0.0]);
    let found = solve_mapped(&plates(), &Arc::new(map), &settings(1e-2));
    assert_eq!(found.unwrap_err(), SolveError::InsideOut);
}

#[test]
fn a_map_that_moves_points_where_it_ends_inside_the_scene_is_refused() {
    let torn = [axis(&[0.0, 0.9], 1, true), axis(&[0.0, 1.6], 2, false), axis(&[0.0, 1.2], 1, true)];
    let map = SceneMap::new(torn, |[_, y, _]| [0.0, 0.1 * y * (1.6 - y), 0.0]);
    let found = solve_mapped(&plates(), &Arc::new(map), &settings(1e-2));
    assert_eq!(found.unwrap_err(), SolveError::TornMap);
}

#[test]
fn in_open_space_a_bend_between_bodies_changes_nothing_and_mirrors_may_be_left_out() {
    // Two plates above a substrate, all open; the map bends the space between them and the substrate, and
    // leaves all faces.
    let plate = |y: f64| Shape::Box(Box3 { min: [-0.5, y, -0.4], max: [0.5, y + 0.1, 0.4] });
    let mut slab = Box3::SPACE;
    slab.max[1] = 0.0;
    let scene = Scene {
        bodies: vec![
            Body::conductor("lower", plate(0.1)),
            Body::conductor("upper", plate(0.5)),
            Body::dielectric("substrate", Shape::Box(slab), 3.0),
        ],
        background_permittivity: 1.0,
        domain: Box3::SPACE,
        walls: [[Wall::Open; 2]; 3],
    };
    let axes = [
        axis(&[0.0, 0.5, 0.9], 4, true),
        axis(&[-0.4, 0.0, 0.1, 0.2, 0.5, 0.6, 1.0], 4, false),
        axis(&[0.0, 0.4, 0.8], 4, true),
    ];
    let bump = |x: f64, lo: f64, hi: f64| {
        if lo < x && x < hi { 4.0 * (x - lo) * (hi - x) / (hi - lo).powi(2) } else { 0.0 }
    };
    let map = Arc::new(SceneMap::new(axes, move |[x, y, z]| {
        let between = bump(y, 0.2, 0.5) * bump(x, -0.9, 0.9) * bump(z, -0.8, 0.8);
        let below = bump(y, -0.4, 0.0) * bump(x, -0.9, 0.9) * bump(z, -0.8, 0.8);
        [0.1 * x * between, 0.06 * between - 0.08 * below, -0.1 * z * below]
    }));
    let straight = solve(&scene, &settings(1e-3)).unwrap();
    let mapped = solve_mapped(&scene, &map, &settings(3e-3)).unwrap();
    agree(&mapped, &straight, 3e-3);
    let [half, whole] = [true, false].map(|symmetry| {
        let settings = Settings { symmetry, ..settings(1e-1) };
        solve_mapped(&scene, &map, &settings).unwrap().two_terminal.unwrap()
    });
    assert!((half.upper / whole.upper - 1.0).abs() < 1e-6 && (half.lower / whole.lower - 1.0).abs() < 1e-4);
}

/// A box that a map makes a ball of radius 1, in open space.
fn ball() -> (Scene, SceneMap, Rounded) {
    let half = 0.6;
    let region = cube(half);
    let scene = Scene {
        bodies: vec![Body::conductor("ball", Shape::Box(region))],
        background_permittivity: 1.0,
        domain: Box3::SPACE,
        walls: [[Wall::Open; 2]; 3],
    };
    let axes = [0, 1, 2].map(|_| axis(&[0.0, half, 2.0], 10, true));
    // Points of the faces go outwards to the ball, those beyond less and less far.
    let map = SceneMap::new(axes, move |x| {
        let most = x.map(f64::abs).into_iter().fold(0.0, f64::max);
        let near = if most > half { x.map(|x| x.clamp(-half, half)) } else { x };
        let length = near.iter().map(|x| x * x).sum::<f64>().sqrt();
        let out = if length > 0.0 { most.min(half) / half / length - 1.0 } else { 0.0 };
        let share: f64 = x.iter().map(|x| ((2.0 - x.abs()) / (2.0 - half)).min(1.0)).product();
        near.map(|x| share * out * x)
    });
    (scene, map, Rounded { region, across: [true; 3] })
}

#[test]
fn a_ball_made_of_a_box_has_its_capacitance_and_takes_fewer_unknowns_where_it_is_known_to_be_round() {
    let (scene, map, rounded) = ball();
    let exact = 4.0 * std::f64::consts::PI * VACUUM_PERMITTIVITY;
    let settings = Settings { target: Target::Own(0), ..settings(1e-3) };
    let [edged, round] = [map.clone(), map.with_rounded(rounded)].map(|map| {
        let found = solve_mapped(&scene, &Arc::new(map), &settings).unwrap();
        let c = found.maxwell[0][0];
        println!("{:e} to {:e}, exact {exact:e}, {} unknowns", c.lower, c.upper, found.unknowns);
        assert!(found.reached && c.lower <= exact && exact <= c.upper, "{c:?} {exact:e}");
        found.unknowns
    });
    assert!(3 * round < 2 * edged, "{round} {edged}");
}
