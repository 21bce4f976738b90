//! The surfaces of finite-element layers that a viewer is shown.

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use elastocap_case::{Case, Mechanics};
use elastocap_coupling::outcome::Outcome;
use elastocap_coupling::plan::{Options, Plan};
use elastocap_coupling::run::run;
use elastocap_geometry::export::surfaces::Corners;

/// A shipped case with a coarse layer, pressed.
fn pressed(name: &str, change: impl Fn(&mut Case)) -> (Case, Outcome) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../cases").join(name);
    let mut case = elastocap_case::load(&path).unwrap();
    change(&mut case);
    let options = Options { prune: true, fields: false, scene: true, model_error: false };
    let plan = Plan::new(&case, &options);
    let outcome = run(&case, &plan, &options, &Arc::new(AtomicBool::new(false)), &());
    (case, outcome)
}

fn volume(surface: &[Corners]) -> f64 {
    let six = |[a, b, c]: &Corners| {
        a[0] * (b[1] * c[2] - b[2] * c[1])
            + a[1] * (b[2] * c[0] - b[0] * c[2])
            + a[2] * (b[0] * c[1] - b[1] * c[0])
    };
    surface.iter().map(six).sum::<f64>() / 6.0
}

/// Every side of a triangle is met once from the other side.
fn assert_closed(surface: &[Corners], size: f64) {
    let key = |p: &[f64; 3]| p.map(|x| (x / size * 1e7).round() as i64);
    let mut sides: HashMap<_, i32> = HashMap::new();
    for [a, b, c] in surface {
        for (p, q) in [(a, b), (b, c), (c, a)] {
            let (p, q) = (key(p), key(q));
            *sides.entry((p.min(q), p.max(q))).or_default() += if p < q { 1 } else { -1 };
        }
    }
    let open = sides.iter().filter(|((p, q), count)| p != q && **count != 0).count();
    assert_eq!(open, 0, "of {} sides", sides.len());
}

/// Height of the surface above the middle of the bottom.
fn height_in_the_middle(surface: &[Corners], size: f64) -> f64 {
    let middle = surface.iter().flatten().filter(|p| p[0].abs() < 1e-6 * size && p[2].abs() < 1e-6 * size);
    middle.map(|p| p[1]).fold(0.0, f64::max)
}

#[test]
fn a_pressed_layer_in_the_plane_is_closed_and_keeps_its_volume() {
    let (case, outcome) = pressed("layer-on-substrate.toml", |case| {
        if let Some(Mechanics::PlaneStrain(model)) = &mut case.mechanics {
            model.relative_tolerance = 0.1;
        }
    });
    let layer = case.layer.as_ref().unwrap();
    for step in &outcome.steps {
        let found = step.layer.as_ref().unwrap();
        let surface = &found.skin.layer;
        assert_closed(surface, 8e-3);
        // Nothing moves along x3 and nothing is compressible; 1 mm wide.
        let at_rest = 2.0 * layer.half_length.unwrap() * layer.thickness * 1e-3;
        assert!((volume(surface) / at_rest - 1.0).abs() < 5e-3, "{}", volume(surface) / at_rest);
        let top = surface.iter().flatten().map(|p| p[1]).fold(0.0, f64::max);
        assert!((top - found.deformed_thickness).abs() < 1e-3 * layer.thickness, "{top}");
    }
}

#[test]
fn a_pad_under_a_sphere_is_dented_and_its_electrodes_keep_their_volume() {
    let (case, outcome) = pressed("pair-under-sphere.toml", |case| {
        if let Some(Mechanics::Solid(model)) = &mut case.mechanics {
            model.relative_tolerance = 0.5;
        }
        case.electrostatics.as_mut().unwrap().relative_tolerance = 0.3;
    });
    let thickness = case.layer.as_ref().unwrap().thickness;
    let found = outcome.steps[1].layer.as_ref().unwrap();
    let (surface, size) = (&found.skin.layer, 2e-3);
    assert_closed(surface, size);
    assert!((volume(surface) / (2.25e-3 * 450e-6 * 1.4e-3) - 1.0).abs() < 5e-3, "{}", volume(surface));
    // The indenter is there, and beside it the pad bulges.
    let dent = height_in_the_middle(surface, size);
    assert!((dent - found.deformed_thickness).abs() < 0.02 * thickness, "{dent}");
    let top = surface.iter().flatten().map(|p| p[1]).fold(0.0, f64::max);
    assert!(top > thickness, "{top}");
    let [left, right] = found.skin.electrodes.as_slice() else { panic!("two electrodes") };
    for (electrode, side) in [(left, -1.0), (right, 1.0)] {
        assert_closed(electrode, size);
        assert!((volume(electrode) / (300e-6 * 20e-6 * 400e-6) - 1.0).abs() < 2e-2, "{}", volume(electrode));
        assert!(electrode.iter().flatten().all(|p| side * p[0] > 0.0));
    }
}
