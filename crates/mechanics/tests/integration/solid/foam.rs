//! Foams by the law of Ogden and Storåkers: bodies of finite elements against what is known without them.

use std::sync::atomic::AtomicBool;

use elastocap_mechanics::materials::hyperfoam::{pressed_between_walls, pressed_freely};
use elastocap_mechanics::materials::{HyperelasticLaw, HyperfoamTerm, Rubber};
use elastocap_mechanics::solid::layer::{End, Indenter};
use elastocap_mechanics::solid::mesh::Mesh;
use elastocap_mechanics::solid::model::{Body, Equations};
use elastocap_mechanics::solid::newton::NewtonSettings;
use elastocap_mechanics::solid::plane::press::PlaneLayer;
use elastocap_mechanics::solid::press::{Goal, Refinement};

fn term(shear_modulus: f64, exponent: f64, poisson_ratio: f64) -> HyperfoamTerm {
    HyperfoamTerm { shear_modulus, exponent, poisson_ratio }
}

fn foam(terms: &[HyperfoamTerm]) -> Rubber {
    Rubber::of_law(HyperelasticLaw::Hyperfoam { terms: terms.to_vec() }, None)
}

/// Force per width on the layer at each compression with the error that is stated for it, pressed over its
/// whole top without friction.
fn layer(terms: &[HyperfoamTerm], half_length: f64, compressions: &[f64]) -> Vec<[f64; 2]> {
    let problem = PlaneLayer {
        thickness: 1.0,
        half_length,
        rubber: foam(terms),
        inclusions: Vec::new(),
        indenter: Indenter::WholeTop,
        position: 0.0,
        end: End::Free,
    };
    let goals: Vec<Goal> = compressions.iter().map(|c| Goal::Compression(*c)).collect();
    let refinement = Refinement::to(2e-3);
    let found = problem.press(&goals, &refinement, None, &AtomicBool::new(false), &|_, _| ()).unwrap();
    let result = |found: &Result<_, _>| -> [f64; 2] {
        let found: &elastocap_mechanics::solid::press::Pressed = found.as_ref().unwrap();
        assert_eq!(found.step.effort.negative_pivots, 0);
        [found.step.force, found.error.unwrap_or(0.0)]
    };
    found.goals.iter().map(result).collect()
}

#[test]
fn a_square_in_plane_strain_has_the_force_of_its_closed_form() {
    // Without stress along x1 the stretch there is l^(-nu / (1 - nu)).
    for (a, nu) in [(2.0, 0.0), (6.0, 0.3), (-2.0, 0.2)] {
        let mut body = Body::new(Mesh::rectangle(1.0, 1.0, 2, 2), foam(&[term(1.0, a, nu)]));
        body.hold(0, |x| x[0] == 0.0);
        body.hold(1, |x| x[1] == 0.0 || x[1] == 1.0);
        let mut equations = Equations::new(body).unwrap();
        let (mut state, mut load) = (equations.body().at_rest(), equations.body().no_load());
        for l in [0.9f64, 0.5, 0.3] {
            let mut goal = load.clone();
            for (n, x) in equations.body().mesh.nodes.iter().enumerate() {
                if x[1] == 1.0 {
                    goal.displacement[2 * n + 1] = l - 1.0;
                }
            }
            equations.advance(&mut state, &mut load, &goal, &NewtonSettings::default()).unwrap();
            let force = equations.reaction(1, |x| x[1] == 1.0);
            let t = l.powf(-nu / (1.0 - nu));
            let exact = 2.0 / a * (l.powf(a - 1.0) - (l * t).powf(-a * nu / (1.0 - 2.0 * nu)) / l);
            assert!((force / exact - 1.0).abs() < 1e-9, "{a} {nu} {l}: {force} {exact}");
        }
    }
}

#[test]
fn a_bonded_layer_that_does_not_get_wider_has_the_force_of_the_even_compression() {
    let terms = [term(0.7, 8.0, 0.0), term(0.3, -2.0, 0.0)];
    let compressions = [0.1, 0.5, 0.8];
    for ([force, _], compression) in layer(&terms, 2.0, &compressions).into_iter().zip(compressions) {
        let exact = 4.0 * pressed_freely(&terms, compression).nominal_pressure;
        assert!((force / exact - 1.0).abs() < 1e-9, "{compression}: {force} {exact}");
    }
}

#[test]
fn what_a_longer_bonded_layer_takes_more_is_the_force_of_a_foam_between_walls() {
    // Far from the end nothing moves along the layer: the ends' part of the force is the same in both.
    let terms = [term(1.0, 4.0, 0.3)];
    let compressions = [0.1, 0.3, 0.5];
    let [short, long] = [12.0, 20.0].map(|half_length| layer(&terms, half_length, &compressions));
    for (k, compression) in compressions.into_iter().enumerate() {
        let ([short, of_short], [long, of_long]) = (short[k], long[k]);
        let exact = 16.0 * pressed_between_walls(&terms, compression).nominal_pressure;
        let (more, error) = (long - short, of_short + of_long);
        println!("{compression}: {more} for {exact}, stated {error}");
        assert!((more - exact).abs() < 1e-6 * exact + error, "{compression}: {more} {exact} {error}");
        assert!((more / exact - 1.0).abs() < 2e-3, "{compression}: {more} {exact}");
    }
}
