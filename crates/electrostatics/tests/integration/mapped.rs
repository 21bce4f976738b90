//! Scenes that a map bends: against the box solver where the bent scene is one of boxes, and against what no map can change.

use std::sync::Arc;

use elastocap_electrostatics::{MapAxis, SceneMap, Settings, Solution, solve, solve_mapped};
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

/// Checks that both contain `exact` (or each other's) and that the first is as close as asked.
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
