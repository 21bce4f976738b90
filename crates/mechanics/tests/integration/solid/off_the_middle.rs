//! Punches with rounded corners off the middle of the layer: against punches on the middle, mirror images,
//! and one mesh for all loads.

use std::sync::atomic::AtomicBool;

use elastocap_mechanics::materials::Rubber;
use elastocap_mechanics::solid::layer::{End, Inclusion, Indenter};
use elastocap_mechanics::solid::model::ModelError;
use elastocap_mechanics::solid::obstacle::IndenterProfile;
use elastocap_mechanics::solid::plane::press::PlaneLayer;
use elastocap_mechanics::solid::press::{Goal, Pressing, Refinement};

const HALF_WIDTH: f64 = 0.8;
const RADIUS: f64 = 0.1;

fn layer(position: f64) -> PlaneLayer {
    PlaneLayer {
        thickness: 1.0,
        half_length: 4.0,
        rubber: Rubber::neo_hookean(1.0),
        inclusions: Vec::new(),
        indenter: Indenter::Smooth(IndenterProfile::Punch { half_width: HALF_WIDTH, corner_radius: RADIUS }),
        position,
        end: End::Free,
    }
}

fn press(layer: &PlaneLayer, goals: &[Goal], meshes: usize) -> Pressing {
    let refinement = Refinement { relative_tolerance: 1e-9, meshes };
    layer.press(goals, &refinement, None, &AtomicBool::new(false), &|_, _| ()).unwrap()
}

/// Forces on each mesh at a compression of 20 %.
fn forces(layer: &PlaneLayer, meshes: usize) -> Vec<f64> {
    press(layer, &[Goal::Compression(0.2)], meshes).goals[0].as_ref().unwrap().refinement.clone()
}

#[test]
fn a_punch_moved_by_next_to_nothing_has_the_force_of_the_one_on_the_middle() {
    let refinement = Refinement::to(3e-3);
    let found = [0.0, 1e-7].map(|position| {
        let goals = [Goal::Compression(0.2)];
        let pressing =
            layer(position).press(&goals, &refinement, None, &AtomicBool::new(false), &|_, _| ()).unwrap();
        let pressed = pressing.goals[0].as_ref().unwrap();
        assert!(pressed.converged);
        (pressed.step.force, pressed.error.unwrap())
    });
    println!("{found:?}");
    let [(centred, one), (moved, other)] = found;
    assert!((centred - moved).abs() < one + other, "{found:?}");
}

#[test]
fn a_mirrored_layer_has_the_mirrored_deformation() {
    let inclusion = |min: f64, max: f64| Inclusion {
        min: [min, 0.45],
        max: [max, 0.55],
        rubber: Rubber::neo_hookean(10.0),
    };
    let right = PlaneLayer { inclusions: vec![inclusion(0.3, 0.9)], ..layer(0.7) };
    let left = PlaneLayer { inclusions: vec![inclusion(-0.9, -0.3)], ..layer(-0.7) };
    let pressings = [right, left].map(|layer| press(&layer, &[Goal::Compression(0.2)], 4));
    let [right, left] = pressings.each_ref().map(|pressing| pressing.goals[0].as_ref().unwrap());
    println!("{:?} {:?}", right.refinement, left.refinement);
    assert!((right.step.force / left.step.force - 1.0).abs() < 1e-6);
    let models = [pressings[0].model_of(right), pressings[1].model_of(left)];
    for x in [[0.0, 0.5], [0.6, 0.5], [1.7, 1.0], [-1.0, 1.0]] {
        let [a, b] = [models[0].displacement_near(x), models[1].displacement_near([-x[0], x[1]])];
        assert!((a[0] + b[0]).abs() < 1e-5 && (a[1] - b[1]).abs() < 1e-5, "{x:?}: {a:?} {b:?}");
    }
}

#[test]
fn near_an_end_the_force_is_that_of_following_the_load_on_a_mesh_that_is_fine_all_along() {
    // The right corner is 1.2 thicknesses from the end, the left one 5.2. The load was followed once in steps
    // of a twentieth of the radius, on a mesh with three sides over the radius wherever the surface passes a
    // corner, and few elements at the ends of the layer: that was too stiff, by some thousandths.
    const FOLLOWED: f64 = 3.37325;
    let refinement = Refinement::to(3e-3);
    let goals = [Goal::Compression(0.2)];
    let pressing = layer(2.0).press(&goals, &refinement, None, &AtomicBool::new(false), &|_, _| ()).unwrap();
    let found = pressing.goals[0].as_ref().unwrap();
    println!("{:?} +- {:?}", found.refinement, found.error);
    assert!((found.step.force - FOLLOWED).abs() < found.error.unwrap() + 3e-3 * FOLLOWED);
    // The end yields: on the middle it takes more.
    assert!(*forces(&layer(0.0), 4).last().unwrap() > 1.02 * FOLLOWED);
}

#[test]
fn a_force_leads_back_to_the_compression_that_it_came_from() {
    let layer = layer(0.7);
    let meshes = 4;
    let force = *forces(&layer, meshes).last().unwrap();
    let found = press(&layer, &[Goal::Force(force)], meshes);
    let step = found.goals[0].as_ref().unwrap().step;
    // The mesh was made for another compression.
    assert!((step.compression / 0.2 - 1.0).abs() < 2e-3, "{step:?}");
    assert!((step.force / force - 1.0).abs() < 1e-6, "{step:?}");
}

#[test]
fn patches_have_to_lie_on_the_middle() {
    let half_width = HALF_WIDTH;
    for indenter in [Indenter::Held { half_width }, Indenter::Bonded { half_width }] {
        let layer = PlaneLayer { indenter, ..layer(0.1) };
        let goals = [Goal::Compression(0.1)];
        let refused = layer.press(&goals, &Refinement::to(0.01), None, &AtomicBool::new(false), &|_, _| ());
        assert_eq!(refused.err(), Some(ModelError::PatchOffTheMiddle), "{indenter:?}");
    }
}
