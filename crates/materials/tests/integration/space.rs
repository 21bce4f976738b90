//! Energy, stress and tangent in three dimensions.

use elastocap_materials::space::Tensor;
use elastocap_materials::{HyperelasticLaw, Rubber, Volume};
use nalgebra::Matrix3;

use crate::every_law::{rubbers, slope};

const STATES: [Tensor; 6] = [
    [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
    [1.001, 0.002, 0.0, -0.0005, 0.9995, 0.001, 0.0003, 0.0, 1.0002],
    [1.2, 0.4, 0.1, -0.1, 0.8, -0.2, 0.3, 0.2, 0.9],
    [2.5, 1.0, -0.4, 0.3, 0.6, 0.2, 0.5, 0.1, 0.7],
    [0.3, -2.0, 0.1, 0.9, 0.7, 0.3, -0.2, 0.4, 1.3],
    // Two stretches agree: a turned diag(1.4, 1.4, 0.5).
    [0.84, -1.12, 0.0, 1.12, 0.84, 0.0, 0.0, 0.0, 0.5],
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
            let response = rubber.response(f);
            let largest = response.tangent.iter().flatten().fold(1.0, |m: f64, x| m.max(x.abs()));
            for k in 0..9 {
                let slope = difference(f, k, |g| rubber.response(g).energy);
                let error = (slope - response.stress[k]).abs();
                assert!(error < 2e-9 * largest, "{rubber:?} {f:?} P[{k}] {slope} {}", response.stress[k]);
                for m in 0..9 {
                    let slope = difference(f, k, |g| rubber.response(g).stress[m]);
                    let exact = response.tangent[m][k];
                    let error = (slope - exact).abs();
                    assert!(error < 2e-8 * largest, "{rubber:?} {f:?} A[{m}][{k}] {slope} {exact}");
                }
            }
        }
    }
}

#[test]
fn at_rest_there_is_no_stress_and_the_shear_modulus_is_the_one_announced() {
    for rubber in rubbers() {
        let rest = rubber.response(&STATES[0]);
        assert!(rest.energy.abs() < 1e-14 && rest.stress.iter().all(|p| p.abs() < 1e-13), "{rubber:?}");
        for (a, b) in [(1, 1), (2, 2), (5, 5), (1, 3), (6, 2)] {
            assert!((rest.tangent[a][b] - rubber.shear_modulus()).abs() < 1e-12, "{rubber:?}");
        }
    }
}

#[test]
fn the_energy_does_not_see_rotations_before_or_after() {
    let (s, c) = 0.7f64.sin_cos();
    let turn = Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0)
        * Matrix3::new(1.0, 0.0, 0.0, 0.0, s, c, 0.0, -c, s);
    for rubber in rubbers() {
        for f in &STATES {
            let one = rubber.response(f).energy;
            let matrix = Matrix3::from_row_slice(f);
            for turned in [turn * matrix, matrix * turn] {
                let turned = std::array::from_fn(|a| turned[(a / 3, a % 3)]);
                let two = rubber.response(&turned).energy;
                assert!((one - two).abs() < 1e-12 * (1.0 + one.abs()), "{rubber:?} {one} {two}");
            }
        }
    }
}

#[test]
fn where_the_third_stretch_is_one_it_is_the_law_of_plane_strain() {
    for rubber in rubbers() {
        for p in [[1.0, 0.0, 0.0, 1.0], [1.2, 0.4, -0.1, 0.8], [0.3, -2.0, 0.9, 0.7], [1.1, 0.0, 0.0, 1.1]] {
            let plane = rubber.derivatives(&p);
            let space = rubber.response(&[p[0], p[1], 0.0, p[2], p[3], 0.0, 0.0, 0.0, 1.0]);
            let near = |a: f64, b: f64| (a - b).abs() < 1e-11 * (1.0 + a.abs());
            assert!(near(plane.w, space.energy), "{rubber:?} {p:?}");
            const PLANE: [usize; 4] = [0, 1, 3, 4];
            for a in 0..4 {
                assert!(near(plane.first_piola(&p)[a], space.stress[PLANE[a]]), "{rubber:?} {p:?}");
                for b in 0..4 {
                    let (one, two) = (plane.tangent(&p)[a][b], space.tangent[PLANE[a]][PLANE[b]]);
                    assert!(near(one, two), "{rubber:?} {p:?}: {one} {two}");
                }
            }
        }
    }
}

#[test]
fn ogden_with_the_exponents_two_and_minus_two_is_mooney_rivlin_where_the_volume_is_kept() {
    let (c10, c01) = (0.3, 0.4);
    let rubber = |distortion| Rubber { distortion, volume: Volume::BulkModulus(1.0), volume_barrier: 0.0 };
    let mooney = rubber(HyperelasticLaw::MooneyRivlin { c10, c01 });
    let ogden = rubber(HyperelasticLaw::Ogden { terms: vec![(2.0 * c10, 2.0), (-2.0 * c01, -2.0)] });
    for f in &STATES {
        // I2 / J^(4/3) = tr C^-1 J^(2/3) for any J: the two laws agree everywhere.
        let (one, two) = (mooney.response(f), ogden.response(f));
        assert!((one.energy - two.energy).abs() < 1e-12 * (1.0 + one.energy), "{f:?}");
        for (a, b) in one.tangent.iter().flatten().zip(two.tangent.iter().flatten()) {
            assert!((a - b).abs() < 1e-9 * (1.0 + a.abs()), "{f:?}: {a} {b}");
        }
    }
}
