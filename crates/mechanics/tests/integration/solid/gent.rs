//! Rubber of limited extensibility: Gent's law in bodies of finite elements.

use std::sync::atomic::AtomicBool;

use elastocap_mechanics::materials::{HyperelasticLaw, Rubber};
use elastocap_mechanics::solid::layer::{End, Indenter, LayerMesh, LayerModel};
use elastocap_mechanics::solid::mesh::Mesh;
use elastocap_mechanics::solid::model::{Body, Equations};
use elastocap_mechanics::solid::newton::{Effort, NewtonSettings, StopReason};
use elastocap_mechanics::solid::plane::press::PlaneLayer;
use elastocap_mechanics::solid::press::{Goal, PressError, Pressed, Refinement};

fn gent(limiting_invariant: f64, bulk_modulus: Option<f64>) -> Rubber {
    Rubber::of_law(HyperelasticLaw::Gent { shear_modulus: 1.0, limiting_invariant }, bulk_modulus)
}

/// A square that is pressed between smooth plates and free at its right: a homogeneous pure shear.
fn square(rubber: Rubber) -> Equations {
    let mut body = Body::new(Mesh::rectangle(1.0, 1.0, 2, 2), rubber);
    body.hold(0, |x| x[0] == 0.0);
    body.hold(1, |x| x[1] == 0.0 || x[1] == 1.0);
    Equations::new(body).unwrap()
}

/// Presses to each of `stretches`; the force at each, or why the last was not reached.
fn press(rubber: Rubber, stretches: &[f64]) -> Vec<Result<f64, StopReason>> {
    let mut equations = square(rubber);
    let (mut state, mut load) = (equations.body().at_rest(), equations.body().no_load());
    let mut forces = Vec::new();
    for stretch in stretches {
        let mut goal = load.clone();
        for (n, x) in equations.body().mesh.nodes.iter().enumerate() {
            if x[1] == 1.0 {
                goal.displacement[2 * n + 1] = stretch - 1.0;
            }
        }
        let found = equations.advance(&mut state, &mut load, &goal, &NewtonSettings::default());
        assert!(state.displacement.iter().all(|u| u.is_finite()));
        forces.push(match found {
            Ok(_) => Ok(equations.reaction(1, |x| x[1] == 1.0)),
            Err(stopped) => Err(stopped.reason),
        });
    }
    forces
}

#[test]
fn a_square_in_pure_shear_has_the_force_of_the_closed_form_up_to_the_limit_of_extension() {
    // l^2 + 1/l^2 - 2 is 2.25 at a stretch of one half.
    let limit = 2.25;
    let stretches = [0.9, 0.7, 0.55, 0.505];
    for (bulk_modulus, tolerance) in [(None, 1e-6), (Some(1e9), 1e-4)] {
        for (force, l) in press(gent(limit, bulk_modulus), &stretches).into_iter().zip(stretches) {
            let neo_hookean = l - 1.0 / (l * l * l);
            let exact = neo_hookean * limit / (limit - (l * l + 1.0 / (l * l) - 2.0));
            let force = force.unwrap();
            assert!((force / exact - 1.0).abs() < tolerance, "{bulk_modulus:?} {l}: {force} {exact}");
        }
    }
}

#[test]
fn beyond_the_limit_of_extension_the_solver_stops_and_says_why() {
    for bulk_modulus in [None, Some(1e9)] {
        let found = press(gent(2.25, bulk_modulus), &[0.6, 0.49]);
        assert!(found[0].is_ok());
        assert_eq!(found[1], Err(StopReason::ExtensionLimit), "{bulk_modulus:?}");
    }
}

/// The paper's layer, its end on the substrate, at 20 % compression on one mesh.
fn layer_at_twenty_per_cent(rubber: Rubber) -> Result<Pressed, PressError> {
    let layer = PlaneLayer {
        thickness: 1.0,
        half_length: 4.0,
        rubber,
        inclusions: Vec::new(),
        indenter: Indenter::WholeTop,
        position: 0.0,
        end: End::FreeOnSubstrate,
    };
    let refinement = Refinement { relative_tolerance: 5e-3, meshes: 1 };
    let goals = [Goal::Compression(0.2)];
    let mut found = layer.press(&goals, &refinement, None, &AtomicBool::new(false), &|_, _| {}).unwrap();
    found.goals.remove(0)
}

#[test]
fn a_layer_of_gent_rubber_is_stiffer_than_a_neo_hookean_one_and_the_same_without_limit() {
    let force = |rubber| layer_at_twenty_per_cent(rubber).unwrap().step.force;
    let neo_hookean = force(Rubber::neo_hookean(1.0));
    let forces = [1e9, 100.0, 30.0].map(|limit| force(gent(limit, None)));
    println!("{neo_hookean} {forces:?}");
    assert!((forces[0] / neo_hookean - 1.0).abs() < 1e-6, "{forces:?}");
    assert!(forces[1] > 1.001 * neo_hookean && forces[2] > 1.005 * neo_hookean, "{forces:?}");
    assert!(forces[1] < forces[2] && forces[2] < 1.2 * neo_hookean, "{forces:?}");
}

#[test]
fn a_layer_that_would_have_to_be_extended_beyond_the_limit_stops_and_says_why() {
    let Err(PressError::Stopped { compression, stopped }) = layer_at_twenty_per_cent(gent(0.2, None)) else {
        panic!("a layer of so little extensibility cannot be pressed by a fifth");
    };
    println!("{compression} {stopped}");
    assert_eq!(stopped.reason, StopReason::ExtensionLimit);
    // The load is followed to the limit, and then the gap to the substrate has to be closed a little before
    // it.
    assert!((compression - stopped.reached * 0.2).abs() < 1e-12, "{compression} {stopped}");
    assert!((0.05..0.07).contains(&compression), "{compression} {stopped}");
    assert!(stopped.to_string().contains("beyond the limit of its law"), "{stopped}");
}

#[test]
fn a_layer_at_rest_has_a_compression_of_zero_and_not_of_minus_zero() {
    let mesh = LayerMesh::uniform(1.0, 4.0, 2, 0.8, 4);
    let layer = LayerModel::new(&mesh, gent(0.2, None), Indenter::WholeTop, End::FreeOnSubstrate).unwrap();
    let compression = layer.step(Effort::default()).compression;
    assert!(compression == 0.0 && compression.is_sign_positive());
}
