//! Energy, stress and tangent in plane strain.

use elastocap_materials::plane::Tensor;
use elastocap_materials::{HyperelasticLaw, Rubber, Volume};

use crate::every_law::{rubbers, slope};

const STATES: [Tensor; 5] = [
    [1.0, 0.0, 0.0, 1.0],
    [1.001, 0.002, -0.0005, 0.9995],
    [1.2, 0.4, -0.1, 0.8],
    [2.5, 1.0, 0.3, 0.6],
    [0.3, -2.0, 0.9, 0.7],
];

/// The derivative by entry `a` of a function of `f`.
fn difference(f: &Tensor, a: usize, value: impl Fn(&Tensor) -> f64) -> f64 {
    slope(2e-3, |s| {
        let mut moved = *f;
        moved[a] += s;
        value(&moved)
    })
}

#[test]
fn stress_is_the_slope_of_the_energy_and_the_tangent_that_of_the_stress() {
    for rubber in rubbers() {
        for f in &STATES {
            let d = rubber.derivatives(f);
            let (p, a) = (d.first_piola(f), d.tangent(f));
            for k in 0..4 {
                let slope = difference(f, k, |g| rubber.derivatives(g).w);
                assert!(
                    (slope - p[k]).abs() < 2e-9 * (1.0 + p[k].abs()),
                    "{rubber:?} {f:?} P[{k}] {slope} {}",
                    p[k]
                );
                for m in 0..4 {
                    let slope = difference(f, k, |g| rubber.derivatives(g).first_piola(g)[m]);
                    assert!(
                        (slope - a[m][k]).abs() < 2e-8 * (1.0 + a[m][k].abs()),
                        "{rubber:?} {f:?} A[{m}][{k}] {slope} {}",
                        a[m][k]
                    );
                }
            }
        }
    }
}

#[test]
fn at_rest_there_is_no_stress_and_the_shear_modulus_is_the_one_announced() {
    for rubber in rubbers() {
        let f = [1.0, 0.0, 0.0, 1.0];
        let d = rubber.derivatives(&f);
        assert!(d.w.abs() < 1e-14 && d.first_piola(&f).iter().all(|p| p.abs() < 1e-13), "{rubber:?}");
        assert!((d.tangent(&f)[1][1] - rubber.shear_modulus()).abs() < 1e-12, "{rubber:?}");
    }
}

#[test]
fn the_energy_does_not_see_rotations() {
    for rubber in rubbers() {
        for f in &STATES {
            let (s, c) = 0.7f64.sin_cos();
            let turned = [c * f[0] - s * f[2], c * f[1] - s * f[3], s * f[0] + c * f[2], s * f[1] + c * f[3]];
            let (one, two) = (rubber.derivatives(f).w, rubber.derivatives(&turned).w);
            assert!((one - two).abs() < 1e-13 * (1.0 + one.abs()));
        }
    }
}

#[test]
fn ogden_with_one_exponent_two_is_neo_hookean() {
    let ogden = Rubber {
        distortion: HyperelasticLaw::Ogden { terms: vec![(1.3, 2.0)] },
        volume: Volume::Incompressible,
        volume_barrier: Rubber::USUAL_BARRIER,
    };
    let neo = Rubber::neo_hookean(1.3);
    assert_ne!(ogden.derivatives(&STATES[3]).w, 0.0);
    for f in &STATES {
        let (a, b) = (ogden.derivatives(f), neo.derivatives(f));
        for (x, y) in [(a.w, b.w), (a.i, b.i), (a.j, b.j), (a.ii, b.ii), (a.ij, b.ij), (a.jj, b.jj)] {
            assert!((x - y).abs() < 1e-11 * (1.0 + y.abs()), "{f:?}: {a:?} {b:?}");
        }
    }
}

#[test]
fn ogden_is_a_sum_of_powers_of_the_principal_stretches() {
    let (mu, alpha) = (0.8, -3.3);
    let rubber = Rubber {
        distortion: HyperelasticLaw::Ogden { terms: vec![(mu, alpha)] },
        volume: Volume::BulkModulus(1.0),
        volume_barrier: 0.0,
    };
    let (l1, l2) = (1.9f64, 0.4f64);
    let scale = (l1 * l2).powf(-1.0 / 3.0);
    let direct = mu / alpha * ([l1, l2, 1.0].iter().map(|l| (l * scale).powf(alpha)).sum::<f64>() - 3.0);
    assert!((rubber.derivatives(&[l1, 0.0, 0.0, l2]).w - direct).abs() < 1e-13 * direct.abs());
}
