//! Cook's membrane: a tapered panel held on the left and sheared on the right.

use elastocap_mechanics::solid::material::{Distortion, Rubber, Volume};
use elastocap_mechanics::solid::mesh::{Mesh, Patch, uniform};
use elastocap_mechanics::solid::model::{Body, Equations};
use elastocap_mechanics::solid::newton::NewtonSettings;

/// `u_y` at the upper right corner and at the middle of the right edge, for a shear per unit length of the right edge.
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
    let rubber = || Rubber::neo_hookean(80.194);
    let (coarse, fine) = (cook(8, rubber(), 6.25)[0], cook(64, rubber(), 6.25)[0]);
    println!("8 x 8: {coarse:.5}, 64 x 64: {fine:.5}");
    assert!((coarse - 6.9156).abs() < 0.03, "{coarse}");
    assert!((fine - 6.9325).abs() < 1e-3, "{fine}");
}

#[test]
fn the_compressible_membrane_moves_as_an_independent_code_says() {
    // mu = 422.5 kPa, nu = 0.3, 1 N on 16 mm x 1 mm; lengths in mm, stresses in MPa.
    let (mu, nu) = (0.4225, 0.3);
    let lambda = 2.0 * mu * nu / (1.0 - 2.0 * nu);
    for (n, volume) in
        [(16, Volume::LogLame(lambda)), (32, Volume::LogLame(lambda)), (16, Volume::DisplacementOnly(lambda + 2.0 / 3.0 * mu)),
         (16, Volume::BulkModulus(lambda + 2.0 / 3.0 * mu))]
    {
        let distortion = Distortion::NeoHookean { shear_modulus: mu };
        let middle = cook(n, Rubber { distortion, volume, volume_barrier: 0.0 }, 1.0 / 16.0)[1];
        println!("{n} {volume:?}: {middle:.4}");
    }
}
