//! Sharp punches on finer and finer meshes: what is stated of the error of the force, and what is true.

use std::sync::atomic::AtomicBool;

use elastocap_mechanics::materials::Rubber;
use elastocap_mechanics::solid::layer::{End, Indenter};
use elastocap_mechanics::solid::obstacle::IndenterProfile;
use elastocap_mechanics::solid::plane::press::PlaneLayer;
use elastocap_mechanics::solid::press::{Goal, Pressed, Refinement};

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
    let pressing = problem.press(&goals, refinement, None, &AtomicBool::new(false), &|_, _| ()).unwrap();
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
fn a_sharp_punch_in_contact_has_the_same_limit_at_small_compressions() {
    // The surface has slid by 1.2 times the displacement of the punch, which changes the force by so much only.
    const LINEAR: f64 = 29.0803554;
    let compression = 1e-6;
    let found = &pressed(Indenter::Sharp { half_width: HALF_WIDTH }, 12.0, &all_meshes(), &[compression])[0];
    let (stated, truth) = (found.error.unwrap() / compression, found.step.force / compression - LINEAR);
    println!("{:?}: {truth} of {stated}", found.refinement);
    assert!(truth > 0.0 && truth <= stated && stated < 3e-3 * LINEAR, "{truth} and not {stated}");
}

#[test]
fn punches_with_rounded_corners_tend_to_the_sharp_one_from_below() {
    let radii = [0.16, 0.08];
    let compressions = [0.1, 0.2];
    let punch = |corner_radius| IndenterProfile::Punch { half_width: HALF_WIDTH, corner_radius };
    let of = |indenter, tolerance| {
        let found = pressed(indenter, 6.0, &Refinement::to(tolerance), &compressions);
        found.iter().map(|p| (p.step.force, p.error.unwrap())).collect::<Vec<_>>()
    };
    let sharp = of(Indenter::Sharp { half_width: HALF_WIDTH }, 1e-3);
    let rounded = radii.map(|radius| of(Indenter::Smooth(punch(radius)), 5e-3));
    for k in 0..compressions.len() {
        let [wide, narrow] = [0, 1].map(|r: usize| sharp[k].0 - rounded[r][k].0);
        println!("{:?}: {:?}, {:?}", sharp[k], rounded[0][k], rounded[1][k]);
        // A radius twice as small leaves half of the distance, about: something between r^(2/3) and r.
        let of_errors = sharp[k].1 + rounded[1][k].1;
        assert!(narrow > -of_errors && narrow < 0.7 * wide + of_errors, "{wide} {narrow} {of_errors}");
        // What is held under it at rest instead is much stiffer.
        assert!(wide < 0.12 * sharp[k].0);
    }
    // Measured with radii down to 0.005: see docs/mechanics.md.
    assert!(
        (sharp[0].0 - 2.8935).abs() < sharp[0].1 + 1e-3 && (sharp[1].0 - 5.8187).abs() < sharp[1].1 + 2e-3
    );
}

#[test]
fn three_meshes_state_an_error_for_a_punch_that_covers_the_fourth() {
    let compressions = [0.02, 0.05, 0.1, 0.15, 0.2];
    for indenter in [
        Indenter::Sharp { half_width: HALF_WIDTH },
        Indenter::Held { half_width: HALF_WIDTH },
        Indenter::Bonded { half_width: HALF_WIDTH },
    ] {
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
