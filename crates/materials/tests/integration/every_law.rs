//! The laws that all tests go through: a new one belongs here.

use elastocap_materials::{HyperelasticLaw, HyperfoamTerm, Rubber, Volume};

/// One rubber of every law, with moduli around 1 Pa.
pub(crate) fn laws() -> Vec<HyperelasticLaw> {
    vec![
        HyperelasticLaw::NeoHookean { shear_modulus: 1.3 },
        HyperelasticLaw::MooneyRivlin { c10: 0.2, c01: 0.5 },
        HyperelasticLaw::Yeoh { constants: [0.5, -0.04, 0.02] },
        HyperelasticLaw::Ogden { terms: vec![(1.2, 1.3), (0.02, 5.0), (-0.1, -2.0)] },
        HyperelasticLaw::Gent { shear_modulus: 1.1, limiting_invariant: 20.0 },
    ]
}

/// Every law with every law of volume.
pub(crate) fn rubbers() -> Vec<Rubber> {
    let volumes = [
        Volume::Incompressible,
        Volume::BulkModulus(30.0),
        Volume::LogLame(3.0),
        Volume::DisplacementOnly(7.0),
    ];
    laws()
        .iter()
        .flat_map(|d| volumes.map(|volume| Rubber { distortion: d.clone(), volume, volume_barrier: 0.7 }))
        .chain(foams().into_iter().map(|terms| Rubber::of_law(HyperelasticLaw::Hyperfoam { terms }, None)))
        .collect()
}

/// Foams with and without a Poisson's ratio, one of which has terms of all kinds.
pub(crate) fn foams() -> Vec<Vec<HyperfoamTerm>> {
    let term =
        |shear_modulus, exponent, poisson_ratio| HyperfoamTerm { shear_modulus, exponent, poisson_ratio };
    vec![
        vec![term(1.2, 2.0, 0.0)],
        vec![term(0.8, 6.0, 0.3)],
        vec![term(0.7, 3.1, 0.2), term(0.4, -2.0, 0.0), term(0.2, 1.0, 0.4)],
    ]
}

/// The slope at 0 by central differences with a sixth-order stencil.
pub(crate) fn slope(h: f64, value: impl Fn(f64) -> f64) -> f64 {
    let difference = |k: f64| value(k * h) - value(-k * h);
    (45.0 * difference(1.0) - 9.0 * difference(2.0) + difference(3.0)) / (60.0 * h)
}
