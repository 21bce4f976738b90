//! Scenes in which some faces are many orders of magnitude farther away than conductors are large.

use elastocap_electrostatics::{Settings, Solution, SolveError, solve};
use elastocap_geometry::scene::{Body, Box3, Scene, Wall};
use elastocap_geometry::shapes::Shape;

/// A cube of 1 mm whose middle lies on the face of a slab of relative permittivity 3 that goes down to
/// `from`, m.
fn cube_in_slab(from: f64) -> Scene {
    let mut slab = Box3::SPACE;
    (slab.min[1], slab.max[1]) = (from, 0.0);
    let cube = Box3 { min: [-5e-4; 3], max: [5e-4; 3] };
    let bodies =
        vec![Body::conductor("cube", Shape::Box(cube)), Body::dielectric("slab", Shape::Box(slab), 3.0)];
    Scene { bodies, background_permittivity: 1.0, domain: Box3::SPACE, walls: [[Wall::Open; 2]; 3] }
}

fn solved(scene: &Scene, relative_tolerance: f64) -> Result<Solution, SolveError> {
    solve(scene, &Settings { relative_tolerance, memory_limit: 200_000_000, ..Settings::default() })
}

/// The capacitance on an endless slab is 147.0207 fF. A slab that ends 1e8 m below was once solved as if its
/// upper face lay at the top of the cube.
#[test]
fn where_a_slab_ends_that_is_much_deeper_than_the_cube_on_it_is_large_does_not_matter() {
    for from in [f64::NEG_INFINITY, -1e8, -1e6, -1e4] {
        let found = solved(&cube_in_slab(from), 1e-2).unwrap();
        let bounds = found.maxwell[0][0];
        assert!(
            found.reached && bounds.lower <= 147.0207e-15 && 147.0207e-15 <= bounds.upper,
            "{from}: {bounds:?}"
        );
    }
}

/// From a depth of ten sizes of the cube on, the lower face of the slab changes less than the distance
/// between the bounds.
#[test]
fn a_slab_of_any_depth_is_between_thinner_and_thicker_ones_or_refused() {
    let mut least = 0.0;
    for exponent in [-2.0, -1.0, 0.0, 1.0, 2.0, 3.0] {
        match solved(&cube_in_slab(-(10_f64.powf(exponent))), 3e-2) {
            Ok(found) => {
                let bounds = found.maxwell[0][0];
                assert!(bounds.upper >= least && bounds.lower <= 147.0207e-15, "1e{exponent}: {bounds:?}");
                least = bounds.lower.max(least);
            }
            Err(error) => assert_eq!(error, SolveError::NotConverged),
        }
    }
    assert!(least > 1.4e-13);
}

/// Two plates ten nanometres apart, one of them with a film on it, in walls that are up to a hundred million
/// times as far.
#[test]
fn a_thin_film_does_not_vanish_because_walls_are_far_away() {
    let film = 2e-9;
    for wall in [1e-3, 1.0] {
        let plate =
            |from: f64, to: f64| Shape::Box(Box3 { min: [-wall, from, -wall], max: [wall, to, wall] });
        let coating = Box3 { min: [-wall, 0.0, -wall], max: [wall, film, wall] };
        let scene = Scene {
            bodies: vec![
                Body::conductor("lower", plate(-1e-6, 0.0)),
                Body::conductor("upper", plate(1e-8, 1e-6)),
                Body::dielectric("film", Shape::Box(coating), 1e-2),
            ],
            background_permittivity: 1.0,
            domain: Box3 { min: [-wall; 3], max: [wall; 3] },
            walls: [[Wall::Insulated; 2]; 3],
        };
        let area = 4.0 * wall * wall;
        let exact = elastocap_electrostatics::VACUUM_PERMITTIVITY * area / (8e-9 + film / 1e-2);
        match solved(&scene, 1e-2) {
            Ok(found) => {
                let bounds = found.two_terminal.unwrap();
                assert!(bounds.lower <= exact && exact <= bounds.upper, "{wall}: {exact:e} {bounds:?}");
            }
            Err(error) => assert_eq!(error, SolveError::NotConverged),
        }
    }
}
