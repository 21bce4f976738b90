//! Sharp punches on finer and finer meshes: what is stated of the error of the force, and what is true.

use std::sync::atomic::AtomicBool;

use elastocap_mechanics::materials::Rubber;
use elastocap_mechanics::solid::layer::{End, Indenter};
use elastocap_mechanics::solid::press::{Goal, PlaneLayer, Pressed, Refinement};

const HALF_WIDTH: f64 = 500.0 / 450.0;

fn pressed(
    indenter: Indenter,
    half_length: f64,
    refinement: &Refinement,
    compressions: &[f64],
) -> Vec<Pressed> {
    let problem = PlaneLayer {
        thickness: 1.0,
        half_length,
        rubber: Rubber::neo_hookean(1.0),
        inclusions: Vec::new(),
        indenter,
        position: 0.0,
        end: End::Free,
    };
    let goals: Vec<Goal> = compressions.iter().map(|c| Goal::Compression(*c)).collect();
    let pressing = problem.press(&goals, refinement, &AtomicBool::new(false), &|_, _| ()).unwrap();
    pressing.goals.into_iter().map(Result::unwrap).collect()
}

/// Four meshes: nothing is good enough for this tolerance.
fn all_meshes() -> Refinement {
    Refinement::to(1e-12)
}

#[test]
fn the_error_stated_for_a_sharp_punch_covers_the_distance_to_linear_elasticity() {
    // A smooth flat punch on an incompressible layer, bonded below and endless: the pressure p solves
    // int p(k) G(k) cos(k x) dk = pi U for |x| < a, G = (sinh 2k - 2k) / (2 k (cosh 2k + 1 + 2 k^2)), with a = 10/9, H = mu = 1.
    // Galerkin's method with T_2n(x/a) / sqrt(1 - (x/a)^2) has 29.080355025 with 4 functions and this with 6, 8 and 12.
    const LINEAR: f64 = 29.0803554;
    let compression = 1e-6;
    let found = &pressed(Indenter::Held { half_width: HALF_WIDTH }, 12.0, &all_meshes(), &[compression])[0];
    assert_eq!(found.refinement.len(), 4);
    assert!(found.refinement.windows(2).all(|two| two[1] < (1.0 - 1e-5) * two[0]), "{:?}", found.refinement);
    let (stated, truth) = (found.error.unwrap() / compression, found.step.force / compression - LINEAR);
    println!("{:?}: {truth} of {stated}", found.refinement);
    // From above, since a coarse mesh is too stiff.
    assert!(truth > 0.0 && truth <= stated && stated < 1.5 * truth, "{truth} and not {stated}");
    assert!(stated < 5e-4 * LINEAR);
}

#[test]
fn three_meshes_state_an_error_for_a_punch_that_covers_the_fourth() {
    let compressions = [0.02, 0.05, 0.1, 0.15, 0.2];
    for indenter in [Indenter::Held { half_width: HALF_WIDTH }, Indenter::Bonded { half_width: HALF_WIDTH }] {
        let three = Refinement { meshes: vec![0, 1, 2], ..all_meshes() };
        let coarse = pressed(indenter, 6.0, &three, &compressions);
        let fine = pressed(indenter, 6.0, &Refinement { meshes: vec![3], ..all_meshes() }, &compressions);
        for ((coarse, fine), compression) in coarse.iter().zip(&fine).zip(compressions) {
            let (stated, apart) = (coarse.error.unwrap(), (coarse.step.force - fine.step.force).abs());
            println!("{indenter:?}, {compression}: {:?}, {stated} for {apart}", coarse.refinement);
            assert_eq!(coarse.level, 2);
            assert!(apart > 0.0 && apart <= stated, "{indenter:?}, {compression}: {apart} and not {stated}");
            assert!(stated < 5e-2 * fine.step.force);
        }
    }
}

#[test]
fn a_load_whose_force_is_known_is_not_pressed_on_a_finer_mesh() {
    let found = pressed(Indenter::Held { half_width: HALF_WIDTH }, 6.0, &Refinement::to(1e-3), &[1e-6, 0.02]);
    for (known, meshes) in found.iter().zip([3, 4]) {
        assert!(known.converged && known.error.unwrap() < 1e-3 * known.step.force);
        assert_eq!((known.refinement.len(), known.level), (meshes, meshes - 1), "{:?}", known.refinement);
    }
}
