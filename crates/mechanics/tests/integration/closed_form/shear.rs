//! The horizontal force of a shifted plate against finite elements of a layer that is bonded on both faces.

use elastocap_mechanics::materials::{HyperelasticLaw, Rubber};
use elastocap_mechanics::solid::mesh::{Mesh, Patch, graded, uniform};
use elastocap_mechanics::solid::model::{Body, Equations};
use elastocap_mechanics::solid::newton::NewtonSettings;
use elastocap_mechanics::{ClosedFormSettings, LayerState, MooneyRivlin};

const RUBBER: MooneyRivlin = MooneyRivlin { c10: 0.2, c01: 0.3 };

/// A layer of thickness 1, the length `length` and the width 1.
fn layer(rubber: MooneyRivlin, length: f64, compression: f64) -> LayerState {
    let contact_half_length = 0.5 * length;
    let settings =
        ClosedFormSettings { contact_half_length, contact_width: 1.0, shear_length: contact_half_length };
    LayerState::new(1.0, rubber, compression, settings).unwrap()
}

/// The horizontal force in plane strain, over shear modulus and width, of the layer with free ends whose
/// upper face is pressed down, held by its bond, and then shifted. `n` elements over the thickness.
fn by_finite_elements(length: f64, compression: f64, shift: f64, n: usize) -> f64 {
    let half = 0.5 * length;
    // Fine at the free ends, where the shear falls to zero.
    let cell = 1.0 / n as f64;
    let along = graded(-half, half, |x| cell * (0.5 + (half - x.abs())).min(2.0));
    let distortion = HyperelasticLaw::MooneyRivlin { c10: RUBBER.c10, c01: RUBBER.c01 };
    let rubber = Rubber { distortion, volume_barrier: 0.0, ..Rubber::neo_hookean(1.0) };
    let mut body = Body::new(Mesh::from_patches(&[Patch::tensor(&along, &uniform(0.0, 1.0, n))]), rubber);
    let is_face = |x: [f64; 2]| x[1] == 0.0 || x[1] == 1.0;
    body.hold(0, is_face);
    body.hold(1, is_face);
    let top: Vec<usize> = (0..body.mesh.nodes.len()).filter(|&k| body.mesh.nodes[k][1] == 1.0).collect();
    let mut equations = Equations::new(body).unwrap();
    let (mut state, mut from) = (equations.body().at_rest(), equations.body().no_load());
    for sideways in [0.0, shift] {
        let mut to = from.clone();
        for &node in &top {
            to.displacement[2 * node] = sideways;
            to.displacement[2 * node + 1] = -compression;
        }
        if to != from {
            equations.advance(&mut state, &mut from, &to, &NewtonSettings::default()).unwrap();
        }
    }
    equations.reaction(0, |x| x[1] == 1.0)
}

#[test]
fn free_ends_make_the_layer_softer_than_simple_shear_by_a_quarter_of_its_thickness_over_its_length() {
    for (length, expected) in [(5.0, 0.048), (10.0, 0.024), (20.0, 0.012)] {
        let [coarse, found] = [8, 16].map(|n| by_finite_elements(length, 0.0, 0.01, n));
        let closed = layer(RUBBER, length, 0.0).shear_force([0.01, 0.0])[0].unwrap();
        let stiffer = closed / found - 1.0;
        println!(
            "l/H = {length}: {:.3} % too stiff; the coarse mesh {:.1e} off",
            1e2 * stiffer,
            coarse / found - 1.0
        );
        assert!((coarse / found - 1.0).abs() < 1e-3, "{length}: {coarse} {found}");
        assert!((stiffer - expected).abs() < 0.1 * expected, "{length}: {stiffer}");
    }
}

#[test]
fn the_force_stays_in_proportion_to_a_large_shift() {
    // A half of the thickness.
    let found = by_finite_elements(20.0, 0.0, 0.5, 12);
    let closed = layer(RUBBER, 20.0, 0.0).shear_force([0.5, 0.0])[0].unwrap();
    println!("shift H/2: {:.3} % too stiff", 1e2 * (closed / found - 1.0));
    assert!(found < closed && closed < 1.03 * found, "{closed} {found}");
}

#[test]
fn a_compressed_layer_is_sheared_as_its_energy_says() {
    // The second variation of the energy of a state that is sheared by u(x2) and v(x2), by finite differences
    // of the full invariants.
    let (length, compression) = (4.0, 0.3);
    for rubber in [RUBBER, MooneyRivlin { c10: 0.5, c01: 0.0 }, MooneyRivlin { c10: 0.01, c01: 0.4 }] {
        let state = layer(rubber, length, compression);
        let map = state.map();
        let n = 400_u32;
        let step = 1.0 / f64::from(n);
        let energy_slope = |x2: f64, axis: usize| {
            // d^2 W / d (shear)^2, mean of both sides of the axis.
            let energy = |shear: f64, x1: f64| {
                let mut gradient = map.deformation_gradient([x1, x2, 0.0]);
                gradient[(axis, 1)] += shear;
                let c = gradient.transpose() * gradient;
                let first = c.trace();
                let second = 0.5 * (first * first - (c * c).trace());
                rubber.c10 * (first - 3.0) + rubber.c01 * (second - 3.0)
            };
            let h = 1e-3;
            let curvature = |x1: f64| (energy(h, x1) - 2.0 * energy(0.0, x1) + energy(-h, x1)) / (h * h);
            0.5 * (curvature(0.7) + curvature(-0.7))
        };
        // Springs in series over the thickness.
        let force = |axis: usize| {
            let compliance: f64 =
                (0..n).map(|k| step / energy_slope((f64::from(k) + 0.5) * step, axis)).sum();
            0.1 * length / compliance
        };
        let found = state.shear_force([0.1, 0.1]).map(Option::unwrap);
        for (axis, found) in [(0, found[0]), (2, found[1])] {
            let expected = force(axis);
            assert!((found / expected - 1.0).abs() < 1e-5, "{rubber:?} {axis}: {found} {expected}");
        }
        assert!((found[1] > 1.001 * found[0]) == (rubber.c01 > 0.0), "{found:?}");
    }
}

#[test]
fn the_force_points_the_way_of_the_shift_and_is_exactly_zero_without_one() {
    let state = layer(RUBBER, 5.0, 0.1);
    assert_eq!(state.shear_force([0.0, 0.0]), [Some(0.0), Some(0.0)]);
    let [forth, back] = [[0.2, -0.1], [-0.2, 0.1]].map(|shift| state.shear_force(shift).map(Option::unwrap));
    assert!(forth[0] > 0.0 && forth[1] < 0.0);
    assert_eq!(forth, back.map(|force| -force));
    // c10 + c01 f^2 is negative at the top of a compressed layer.
    let soft = layer(MooneyRivlin { c10: 1.1, c01: -0.6 }, 5.0, 0.4);
    assert_eq!(soft.shear_force([0.0, 0.1])[1], None);
    assert!(soft.shear_force([0.1, 0.0])[0].unwrap() > 0.0);
}

#[test]
fn simple_shear_is_up_to_eight_per_cent_too_stiff_where_both_faces_are_bonded_and_pressed_by_2_per_cent() {
    // Pressure lowers the stiffness against shear of a layer with free ends; the closed form does not know of
    // it.
    for (length, compression, most) in
        [(5.0, 0.01, 0.06), (5.0, 0.02, 0.08), (10.0, 0.02, 0.05), (20.0, 0.02, 0.04)]
    {
        let found = by_finite_elements(length, compression, 0.01, 12);
        let closed = layer(RUBBER, length, compression).shear_force([0.01, 0.0])[0].unwrap();
        let unpressed = 0.23 / length;
        let stiffer = closed / found - 1.0;
        println!("l/H = {length}, U/H = {compression}: {:.2} % too stiff", 1e2 * stiffer);
        assert!(unpressed < stiffer && stiffer < most, "{length} {compression}: {stiffer}");
    }
}
