//! The normal stress across the plane in plane strain, against the energy in three dimensions.

use elastocap_materials::{HyperelasticLaw, Rubber, Volume};

use crate::every_law::{rubbers, slope};
use crate::hyperfoam::foam_energy;

/// The energy in three dimensions, by principal stretches, without what holds the volume of an incompressible
/// rubber.
fn energy(rubber: &Rubber, l: [f64; 3]) -> f64 {
    let j = l[0] * l[1] * l[2];
    let split = matches!(rubber.volume, Volume::BulkModulus(_) | Volume::DisplacementOnly(_));
    let m = l.map(|x| if split { x / j.cbrt() } else { x });
    let i1 = m.iter().map(|x| x * x).sum::<f64>() - 3.0;
    let i2 = (m[0] * m[1]).powi(2) + (m[1] * m[2]).powi(2) + (m[2] * m[0]).powi(2) - 3.0;
    let distortion = match &rubber.distortion {
        HyperelasticLaw::NeoHookean { shear_modulus } => 0.5 * shear_modulus * i1,
        HyperelasticLaw::MooneyRivlin { c10, c01 } => c10 * i1 + c01 * i2,
        HyperelasticLaw::Yeoh { constants: [a, b, c] } => a * i1 + b * i1 * i1 + c * i1.powi(3),
        HyperelasticLaw::Ogden { terms } => {
            terms.iter().map(|(mu, a)| mu / a * m.iter().map(|x| x.powf(*a) - 1.0).sum::<f64>()).sum()
        }
        HyperelasticLaw::Gent { shear_modulus, limiting_invariant } => {
            -0.5 * shear_modulus * limiting_invariant * (1.0 - i1 / limiting_invariant).ln()
        }
        HyperelasticLaw::Hyperfoam { terms } => foam_energy(terms, m),
    };
    let mu = rubber.shear_modulus();
    match rubber.volume {
        Volume::Incompressible | Volume::BulkModulus(_) | Volume::OfLaw => distortion,
        Volume::LogLame(lambda) => 0.5 * mu * (i1 - 2.0 * j.ln()) + 0.5 * lambda * j.ln().powi(2),
        Volume::DisplacementOnly(kappa) => distortion + 0.25 * kappa * (j * j - 1.0 - 2.0 * j.ln()),
    }
}

#[test]
fn normal_stresses_are_the_slopes_of_the_energy_in_three_dimensions() {
    for rubber in rubbers() {
        let l: [f64; 3] = match rubber.volume {
            Volume::Incompressible => [1.7, 1.0 / 1.7, 1.0],
            Volume::BulkModulus(_) | Volume::LogLame(_) | Volume::DisplacementOnly(_) | Volume::OfLaw => {
                [1.7, 0.8, 1.0]
            }
        };
        let (f, j) = ([l[0], 0.0, 0.0, l[1]], l[0] * l[1]);
        let field = if rubber.pressure_compliance().is_some() { 0.6 } else { 0.0 };
        let d = rubber.derivatives(&f);
        let [s11, s22] = [l[0], l[1]].map(|l| 2.0 * d.i / j * l * l + d.j + field);
        let s33 = rubber.third_normal_stress(&f, &d, field, s11 + s22);
        let of_energy = |k: usize| {
            let by_stretch = slope(1e-3, |s| {
                let mut m = l;
                m[k] += s;
                energy(&rubber, m)
            });
            l[k] * by_stretch / j
        };
        // Where the volume is kept, the energy leaves an equal part of all three open: that of the pressure
        // field and of the slope at rest that the energy does without. A bulk modulus acts through the
        // pressure field.
        let open = match rubber.volume {
            Volume::Incompressible => s11 - of_energy(0),
            Volume::BulkModulus(_) => field,
            Volume::LogLame(_) | Volume::DisplacementOnly(_) | Volume::OfLaw => 0.0,
        };
        for (k, stress) in [s11, s22, s33].into_iter().enumerate() {
            let right = of_energy(k) + open;
            assert!((stress - right).abs() < 1e-9, "{rubber:?} {k}: {stress} {right}");
        }
    }
}
