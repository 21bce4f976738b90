use super::*;
use elastocap_geometry::scene::{Box3, BoxScene, Conductor, Dielectric, Wall};
use elastocap_geometry::tets::{FaceRole, of_boxes};

const SETTINGS: TetSettings<'static> = TetSettings { order: 2, share: 1e-10, cancel: None };

fn cube(a: f64) -> Box3 {
    Box3 { min: [-a; 3], max: [a; 3] }
}

fn scene(regions: &[Box3], domain: Box3, wall: Wall) -> BoxScene {
    let name = |k: usize| format!("{k}");
    BoxScene {
        conductors: regions
            .iter()
            .enumerate()
            .map(|(k, &region)| Conductor { name: name(k), region })
            .collect(),
        dielectrics: Vec::new(),
        background_permittivity: 1.0,
        domain,
        walls: [[wall; 2]; 3],
    }
}

/// From `from` to `to` in `n` steps, each next to `from` smaller by `ratio`.
fn graded(from: f64, to: f64, n: usize, ratio: f64) -> Vec<f64> {
    let mut at = vec![from];
    at.extend((0..n).rev().map(|k| from + (to - from) * ratio.powi(k as i32)));
    at
}

/// The axis of a cube in a cube: n layers of elements on both sides of +-1/2, out to `outer`.
fn axis(n: usize, ratio: f64, outer: f64) -> Vec<f64> {
    let mut half: Vec<f64> = graded(0.5, 0.0, n, ratio);
    half.reverse();
    half.extend(&graded(0.5, outer, n, ratio)[1..]);
    let mut all: Vec<f64> = half[1..].iter().rev().map(|x| -x).collect();
    all.extend(half);
    all
}

fn cube_in_cube(n: usize, ratio: f64, order: usize) -> (f64, Potentials) {
    let line = axis(n, ratio, 1.0);
    let mesh = of_boxes(&scene(&[cube(0.5)], cube(1.0), Wall::Grounded), &[line.clone(), line.clone(), line]);
    let problem = Problem { mesh: &mesh, permittivity: &[1.0], conductors: 1 };
    let solved = Potentials::solve(problem, TetSettings { order, ..SETTINGS }).unwrap();
    (solved.energies[(0, 0)] / 19.127134997 - 1.0, solved)
}

#[test]
fn a_cube_in_a_cube_is_bounded_from_above_and_met() {
    for order in 1..=3 {
        let mut last = f64::INFINITY;
        for n in 1..=4 {
            let (error, solved) = cube_in_cube(n, 0.35, order);
            println!(
                "p{order} n{n}: {error:e}, {} iterations, {} unknowns",
                solved.iterations, solved.unknowns
            );
            assert!(error > 0.0 && error < last);
            last = error;
        }
    }
}
