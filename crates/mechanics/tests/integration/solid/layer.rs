//! The layer of section 3.2.

use std::sync::atomic::AtomicBool;

use elastocap_mechanics::materials::{HyperelasticLaw, Rubber};
use elastocap_mechanics::solid::layer::{End, Indenter, LayerMesh, LayerModel};
use elastocap_mechanics::solid::newton::{NewtonSettings, StopReason};
use elastocap_mechanics::solid::plane::press::PlaneLayer;
use elastocap_mechanics::solid::press::{Goal, Refinement};

fn whole_top(mesh: &LayerMesh, end: End) -> LayerModel {
    LayerModel::new(mesh, Rubber::neo_hookean(1.0), Indenter::WholeTop, end).unwrap()
}

#[test]
fn the_free_layer_at_five_per_cent_is_the_one_of_two_independent_codes() {
    let mut model = whole_top(&LayerMesh::uniform(1.0, 4.0, 8, 0.7, 10), End::Free);
    let step = model.press(0.05, &NewtonSettings::default()).unwrap();
    let (inside, top) = (model.displacement_near([0.5, 0.5]), model.displacement_near([0.5, 1.0]));
    println!("force {:.4}, u1 {:.6} and {:.6}", step.force, inside[0], top[0]);
    // 8.618 +- 0.005; from above, as every mesh here, because no quadrature point may turn inside out.
    assert!(step.force > 8.61 && step.force < 8.618 * 1.0035, "{}", step.force);
    assert!((inside[0] - 0.029896).abs() < 1e-6 && (top[0] - 0.039986).abs() < 1e-6);
    assert!(step.imbalance < 1e-9);
}

#[test]
fn the_layer_on_the_substrate_goes_to_forty_per_cent_with_a_force_that_meshes_agree_on() {
    let mut forces = Vec::new();
    for (ratio, rings) in [(0.7, 8), (0.8, 12)] {
        let mut model = whole_top(&LayerMesh::uniform(1.0, 4.0, 8, ratio, rings), End::FreeOnSubstrate);
        let mut row = Vec::new();
        for compression in [0.05, 0.1, 0.2, 0.3, 0.4] {
            let step = model.press(compression, &NewtonSettings::default()).unwrap();
            assert!((step.compression - compression).abs() < 1e-12);
            assert!(
                step.penetration < 1e-12 && step.imbalance < 1e-8 && step.effort.smallest_j > 0.5,
                "{step:?}"
            );
            row.push(step.force);
        }
        let contact = &model.state().contact;
        assert!(contact.iter().all(|force| *force >= 0.0) && contact.iter().any(|force| *force > 0.0));
        println!("ratio {ratio}: {row:.4?}");
        forces.push(row);
    }
    for (a, b) in forces[0].iter().zip(&forces[1]) {
        assert!((a / b - 1.0).abs() < 2e-3, "{forces:?}");
    }
    // One code, contact by penalty: 0.7735 N and 1.762 N over mu H w = 0.0892281 N, to 1 %.
    assert!((forces[1][0] / 8.669 - 1.0).abs() < 1e-2 && (forces[1][1] / 19.747 - 1.0).abs() < 1e-2);
}

#[test]
fn without_the_fan_the_bonded_end_stops_the_solver_and_is_named() {
    let mut mesh = LayerMesh::uniform(1.0, 4.0, 8, 0.7, 1);
    mesh.radii.clear();
    let rubber = Rubber { volume_barrier: 0.0, ..Rubber::neo_hookean(1.0) };
    let mut model = LayerModel::new(&mesh, rubber, Indenter::WholeTop, End::Free).unwrap();
    let stopped = model.press(0.2, &NewtonSettings::default()).unwrap_err();
    println!("{stopped}");
    assert_eq!(stopped.reason, StopReason::Inversion);
    assert!(stopped.reached > 0.3 && stopped.reached < 0.7, "{stopped}");
    // The last of the bottom row, at the bonded end.
    assert_eq!(stopped.element, 31, "{stopped}");
    // What was reached is an equilibrium and can be asked for its force.
    let step = model.step(stopped.effort);
    assert!((step.compression - 0.2 * stopped.reached).abs() < 1e-12);
}

#[test]
fn the_error_stated_for_an_end_that_folds_covers_the_true_one() {
    // The rubber of the paper, mu = 2 (c10 + c01) = 1.
    let distortion = HyperelasticLaw::MooneyRivlin { c10: 0.007646, c01: 0.492354 };
    let problem = PlaneLayer {
        thickness: 1.0,
        half_length: 4.0,
        rubber: Rubber { distortion, volume_barrier: 0.0, ..Rubber::neo_hookean(1.0) },
        inclusions: Vec::new(),
        indenter: Indenter::WholeTop,
        position: 0.0,
        end: End::Free,
    };
    // docs/free-end.md.
    let limits = [(0.05, 8.58), (0.1, 19.134), (0.2, 47.19)];
    let goals = limits.map(|(compression, _)| Goal::Compression(compression));
    let found =
        problem.press(&goals, &Refinement::to(1e-2), None, &AtomicBool::new(false), &|_, _| ()).unwrap();
    for (found, (compression, limit)) in found.goals.iter().zip(limits) {
        let found = found.as_ref().unwrap();
        let (stated, truth) = (found.error.unwrap(), (found.step.force - limit).abs());
        println!("{compression}: {:?}, {stated} for {truth}", found.refinement);
        assert!(truth <= stated && truth < 1.5e-3 * limit, "{compression}: {truth} and not {stated}");
        assert!(found.converged, "{compression}: {stated}");
        assert_eq!(found.step.effort.negative_pivots, 0);
    }
}
