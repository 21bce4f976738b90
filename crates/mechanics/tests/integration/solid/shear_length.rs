//! The shear length that finite elements give the closed form.

use std::sync::atomic::AtomicBool;

use elastocap_mechanics::solid::layer::End;
use elastocap_mechanics::solid::shear_length::{Contact, ShearLength, shear_lengths};
use elastocap_mechanics::{ClosedFormSettings, LayerState, LayerStress, MooneyRivlin};

use super::patch::Block;

#[test]
fn the_closed_form_under_its_own_tractions_has_its_own_shear_length() {
    // The tractions of L = H on x1 = H, whose mean along x1 vanishes (31).
    let mut block = Block::new(16, 1.5);
    for compression in [0.05, 0.2] {
        block.press(compression);
        let equations = &block.equations;
        let mu = equations.body().rubbers[0].shear_modulus();
        let axial = equations.reaction(0, |x| x[0] == 0.0) / mu;
        let force = -2.0 * equations.reaction(1, |x| x[1] == 1.0) / mu;
        let found = ShearLength::from_forces(compression, 1.0, axial, force).unwrap();
        println!("{found:?}");
        assert!((found.from_balance.unwrap() - 1.0).abs() < 1e-5);
        assert!((found.from_force.unwrap() - 1.0).abs() < 1e-5);
    }
}

#[test]
fn a_punch_is_sheared_farther_than_it_is_long_and_the_closed_form_then_has_its_forces() {
    let found = shear_lengths(Contact::Punch(1.0), End::Free, &[0.05, 0.1], 6, None).unwrap();
    let finer = shear_lengths(Contact::Punch(1.0), End::Free, &[0.05], 10, None).unwrap();
    assert!(found.stopped.is_none() && found.points.len() == 2);
    let [length, force] = found.disagreement.unwrap();
    // The coarsest fan against the finest: it is only used where the finer ones stop.
    assert!(length < 0.03 && force < 0.08, "{length} {force}");
    assert_eq!(found.points[0].fan, 0);
    let point = found.points[0].shear;
    let (a, b) = (point.from_balance.unwrap(), finer.points[0].shear.from_balance.unwrap());
    println!("{a} {b}");
    assert!((a / b - 1.0).abs() < 1e-3 && a > 2.1 && a < 2.3);
    let rubber = MooneyRivlin::neo_hookean(1.0);
    let state = |shear_length| {
        let settings = ClosedFormSettings { contact_half_length: 1.0, contact_width: 1.0, shear_length };
        LayerState::new(1.0, rubber, point.compression, settings).unwrap()
    };
    assert!((state(point.from_force.unwrap()).force() / point.force - 1.0).abs() < 1e-12);
    // The section x1 = 0 of the closed form, T11 over the thickness.
    let stress: LayerStress = *state(a).stress();
    let (points, weights) = elastocap_fem::quadrature::gauss_legendre(20);
    let axial: f64 = (points.iter().zip(&weights))
        .map(|(s, w)| -0.5 * w * stress.nominal([0.0, 0.5 * (1.0 + s), 0.0])[(0, 0)])
        .sum();
    assert!((axial / point.axial_force - 1.0).abs() < 1e-9, "{axial}");
}

#[test]
fn a_search_for_shear_lengths_that_is_asked_to_stop_at_once_solves_nothing() {
    let cancel = AtomicBool::new(true);
    let found = shear_lengths(Contact::Punch(1.0), End::Free, &[0.05, 0.4], 8, Some(&cancel)).unwrap();
    assert!(found.points.is_empty() && found.stopped.is_some());
}
