//! Cook's membrane: a tapered panel held on the left and sheared on the right.

use elastocap_mechanics::materials::{HyperelasticLaw, Rubber, Volume};
use elastocap_mechanics::solid::mesh::{Mesh, Patch, uniform};
use elastocap_mechanics::solid::model::{Body, Equations};
use elastocap_mechanics::solid::newton::NewtonSettings;

/// `u_y` at the upper right corner and at the middle of the right edge, for a shear per unit length of the
/// right edge.
fn cook(n: usize, rubber: Rubber, shear: f64) -> [f64; 2] {
    let unit = uniform(0.0, 1.0, n);
    let panel = Patch::tensor(&unit, &unit).mapped(|[s, t]| [48.0 * s, 44.0 * s + t * (44.0 - 28.0 * s)]);
    let mut body = Body::new(Mesh::from_patches(&[panel]), rubber);
    body.hold(0, |x| x[0] == 0.0);
    body.hold(1, |x| x[0] == 0.0);
    let right = body.mesh.boundary_where(|x| x[0] == 48.0);
    assert_eq!(right.len(), n);
    let mut equations = Equations::new(body).unwrap();
    let (mut state, mut load) = (equations.body().at_rest(), equations.body().no_load());
    let mut next = load.clone();
    equations.body().add_traction(&right, |_, _| [0.0, shear], &mut next.force);
    let effort = equations.advance(&mut state, &mut load, &next, &NewtonSettings::default()).unwrap();
    println!("{n} x {n}: {effort:?}");
    [[48.0, 60.0], [48.0, 52.0]].map(|x| state.displacement[2 * equations.body().mesh.nearest_node(x) + 1])
}

#[test]
fn the_incompressible_membrane_moves_as_an_independent_code_says() {
    let rubber = || Rubber { volume_barrier: 0.0, ..Rubber::neo_hookean(80.194) };
    let (coarse, fine) = (cook(8, rubber(), 6.25)[0], cook(64, rubber(), 6.25)[0]);
    println!("8 x 8: {coarse:.5}, 64 x 64: {fine:.5}");
    // The other code's pressure lives in the coordinates of the reference square, ours in those of the body.
    assert!((coarse - 6.9156).abs() < 2e-3, "{coarse}");
    assert!((fine - 6.9325).abs() < 1e-4, "{fine}");
}

#[test]
fn the_compressible_membrane_moves_as_an_independent_code_says() {
    // mu = 422.5 kPa, nu = 0.3, 1 N on 16 mm x 1 mm; lengths in mm, stresses in MPa. The value belongs to the
    // energy mu/2 (J^(-2/3) I1 - 3) + kappa/4 (J^2 - 1 - 2 ln J): others with the same moduli give 14.73
    // (kappa/2 (J - 1)^2) and 14.52 (mu/2 (I1 - 3 - 2 ln J) + lambda/2 (ln J)^2), so that the volume's law
    // has to be the same.
    let (mu, nu) = (0.4225, 0.3);
    let kappa = 2.0 * mu * (1.0 + nu) / (3.0 * (1.0 - 2.0 * nu));
    let solve = |volume| {
        let distortion = HyperelasticLaw::NeoHookean { shear_modulus: mu };
        cook(64, Rubber { distortion, volume, volume_barrier: 0.0 }, 1.0 / 16.0)[1]
    };
    let (same, quadratic) = (solve(Volume::DisplacementOnly(kappa)), solve(Volume::BulkModulus(kappa)));
    println!("{same:.4}, with the other law of the volume {quadratic:.4}");
    assert!((same - 14.74).abs() < 5e-3, "{same}");
    assert!((quadratic - 14.73).abs() < 5e-3, "{quadratic}");
}
