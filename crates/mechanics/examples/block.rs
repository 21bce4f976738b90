//! The block of Reese and others under a dead pressure on the inner quarter of its top: compression of the
//! top's centre.
//!
//! `cargo run --release -p elastocap-mechanics --example block -- 8`
//! takes the hexahedra along each edge of the quarter, an even number.
//!
//! 1. A quarter of a block, 1 x 1 x 1 mm, with planes of symmetry `x1 = 0` and `x3 = 0`; the bottom moves
//!    freely in its plane, the top only up and down.
//! 2. Nearly incompressible neo-Hookean rubber, mu = 80.194 MPa and nu = 0.4999.
//! 3. A dead pressure p on a quarter of the quarter's top, p/p0 = 20, 40, ..., 100 with p0 = 4 MPa.
//!
//! | hexahedra | 20 | 40 | 60 | 80 | 100 |
//! |---|---|---|---|---|---|
//! | 4 x 4 x 4 | 21.862 | 42.329 | 58.523 | 69.775 | 77.192 % |
//! | 8 x 8 x 8 | 21.968 | 42.489 | 58.568 | 69.380 | 76.115 % |
//! | 12 x 12 x 12 | 21.975 | 42.504 | 58.585 | 69.379 | 76.067 % |
//!
//! Trilinear hexahedra with constant pressure (an independent code) come down to the same values, and more
//! slowly: 70.1 and 77.8 % under the two largest loads with 8 x 8 x 8, 69.7 and 76.8 % with 12 x 12 x 12.

use elastocap_mechanics::materials::{HyperelasticLaw, Rubber, Volume};
use elastocap_mechanics::solid::mesh::{Mesh, uniform};
use elastocap_mechanics::solid::model::{Body, Equations};
use elastocap_mechanics::solid::newton::NewtonSettings;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let words: Vec<String> = std::env::args().collect();
    let n: usize = words.get(1).map_or(Ok(4), |w| w.parse())?;
    let (mu, nu) = (80.194, 0.4999);
    let kappa = 2.0 * mu * (1.0 + nu) / (3.0 * (1.0 - 2.0 * nu));
    let rubber = Rubber {
        distortion: HyperelasticLaw::NeoHookean { shear_modulus: mu },
        volume: Volume::BulkModulus(kappa),
        volume_barrier: 0.0,
    };
    // Lengths in mm, stresses in MPa.
    let cuts = uniform(0.0, 1.0, n);
    let mut body = Body::new(Mesh::tensor(&cuts, &cuts, &cuts), rubber);
    body.hold(0, |x| x[0] == 0.0 || x[1] == 1.0);
    body.hold(1, |x| x[1] == 0.0);
    body.hold(2, |x| x[2] == 0.0 || x[1] == 1.0);
    let inner = body.mesh.boundary_where(|x| x[1] == 1.0 && x[0] <= 0.5 && x[2] <= 0.5);
    let (mut state, mut from) = (body.at_rest(), body.no_load());
    let mut to = from.clone();
    body.add_traction(&inner, |_, normal| normal.map(|n| -4.0 * n), &mut to.force);
    let unit = to.force.clone();
    let centre = body.mesh.nearest_node([0.0, 1.0, 0.0]);
    let start = std::time::Instant::now();
    let mut equations = Equations::new(body)?;
    println!(
        "# {} hexahedra, {} displacements, {} unknowns with the pressures, {} in the factor, {:.2} s",
        n * n * n,
        equations.unknowns(),
        equations.mixed_unknowns(),
        equations.factor_entries(),
        start.elapsed().as_secs_f64()
    );
    for level in [20.0, 40.0, 60.0, 80.0, 100.0] {
        to.force = unit.iter().map(|f| level * f).collect();
        let effort = equations.advance(&mut state, &mut from, &to, &NewtonSettings::default())?;
        println!(
            "p/p0 {level:5.0}  compression {:.4} %  | {} steps, {} cuts, {} solves, J {:.3}, {} negative pivots, {:.1} s",
            -100.0 * state.displacement[3 * centre + 1],
            effort.steps,
            effort.cuts,
            effort.solves,
            effort.smallest_j,
            effort.negative_pivots,
            start.elapsed().as_secs_f64()
        );
    }
    Ok(())
}
