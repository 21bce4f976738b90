//! Stress: equilibrium, energy, the constant B.

use elastocap_mechanics::{LayerMap, LayerStress, MooneyRivlin};
use nalgebra::Matrix3;

use super::support::{PAPER, PAPER_MU, assert_close, derivative, integrate};

const SOFT: MooneyRivlin = MooneyRivlin { c10: 0.1, c01: 0.4 };

fn stress(compression: f64, material: MooneyRivlin, shear_length: f64) -> LayerStress {
    LayerStress::new(LayerMap::new(1.0, compression).unwrap(), material, shear_length).unwrap()
}

/// Fails unless the matrices agree to `tolerance` times the largest entry of the second.
#[track_caller]
fn assert_matrices_close(got: Matrix3<f64>, expected: Matrix3<f64>, tolerance: f64) {
    assert!((got - expected).amax() <= tolerance * expected.amax(), "{got} instead of {expected}");
}

#[test]
fn the_nominal_stress_is_in_equilibrium() {
    for compression in [0.01, 0.2, 0.4, 0.6] {
        let stress = stress(compression, SOFT, 1.5);
        for (x1, x2) in [(0.0, 0.5), (0.4, 0.2), (1.3, 0.8)] {
            let along_1 = |i, j| derivative(x1, 0.01, |s| stress.nominal([s, x2, 0.0])[(i, j)]);
            let along_2 = |i, j| derivative(x2, 0.01, |s| stress.nominal([x1, s, 0.0])[(i, j)]);
            let (t11, t21, t12, t22) = (along_1(0, 0), along_2(1, 0), along_1(0, 1), along_2(1, 1));
            let size = 1e-10 * (t11.abs() + t21.abs() + t12.abs() + t22.abs());
            assert!((t11 + t21).abs() <= size, "(21a) at {compression}: {t11} + {t21}");
            assert!((t12 + t22).abs() <= size, "(21b) at {compression}: {t12} + {t22}");
        }
    }
}

/// `W` per reference volume of a Mooney-Rivlin material, from the invariants of `F`.
fn energy(gradient: &Matrix3<f64>, c10: f64, c01: f64) -> f64 {
    let right = gradient.transpose() * gradient;
    let i1 = right.trace();
    let i2 = 0.5 * (i1 * i1 - (right * right).trace());
    c10 * (i1 - 3.0) + c01 * (i2 - 3.0)
}

#[test]
fn the_stress_is_the_derivative_of_the_energy_up_to_the_pressure() {
    for compression in [0.05, 0.4, 0.8] {
        let stress = stress(compression, SOFT, 2.0);
        let x = [0.7, 0.3, 0.2];
        let gradient = stress.map().deformation_gradient(x);
        // W is a quartic in every entry of F, for which the differences are exact.
        let from_energy = Matrix3::from_fn(|i, j| {
            derivative(0.0, 0.2, |delta| {
                let mut moved = gradient;
                moved[(i, j)] += delta;
                energy(&moved, 0.1, 0.4)
            })
        }) * gradient.transpose();
        // dW/dF F^T = 2 c10 B + 2 c01 (I2 I - B^-1), so what is left is -P - 2 c01 I2.
        let i2 = (gradient * gradient.transpose()).try_inverse().unwrap().trace();
        let pressure = stress.pressure(x) + 2.0 * 0.4 * i2;
        assert_matrices_close(stress.cauchy(x), from_energy - Matrix3::identity() * pressure, 1e-12);
    }
}

#[test]
fn the_work_of_the_tractions_is_the_energy_stored() {
    // On the block 0 <= x1 <= L, 0 <= x2 <= H only the top and the face x1 = L do work.
    let length = 1.3;
    let stored = |compression: f64| {
        let map = LayerMap::new(1.0, compression).unwrap();
        integrate(0.0, 1.0, |x2| {
            let at = |x1| energy(&map.deformation_gradient([x1, x2, 0.0]), 0.1, 0.4);
            // W is quadratic in x1, for which Simpson's rule is exact.
            length / 6.0 * (at(0.0) + 4.0 * at(0.5 * length) + at(length))
        })
    };
    let compression = 0.3;
    let stress = stress(compression, SOFT, 1.3);
    let velocity = |x2: f64| {
        let component = |k: usize| {
            derivative(compression, 0.01, |u| {
                LayerMap::new(1.0, u).unwrap().displacement([length, x2, 0.0])[k]
            })
        };
        (component(0), component(1))
    };
    let top = integrate(0.0, length, |x1| -stress.nominal([x1, 1.0, 0.0])[(1, 1)]);
    let side = integrate(0.0, 1.0, |x2| {
        let traction = stress.nominal([length, x2, 0.0]);
        let (v1, v2) = velocity(x2);
        traction[(0, 0)] * v1 + traction[(0, 1)] * v2
    });
    assert_close(top + side, derivative(compression, 0.01, stored), 1e-10, "power");
}

#[test]
fn stresses_keep_their_digits_at_any_compression() {
    // At x = (0.7, 0.3) H with shear length H: mpmath.
    for (compression, s11, s22, s33, s12, pressure, b) in [
        (
            1e-12,
            -1.469_999_999_999_819_5e-12,
            -4.530_000_000_004_26e-12,
            -3.000_000_000_000_689e-12,
            1.470_000_000_000_720_3e-12,
            -0.599_999_999_997,
            0.500_000_000_004_5,
        ),
        (
            0.3,
            -0.345_068_677_643_308_3,
            -2.084_201_038_907_821,
            -0.961_817_966_073_691_3,
            0.513_929_114_019_003_1,
            0.361_817_966_073_691_3,
            2.755_918_530_238_81,
        ),
        (
            0.999,
            37_609_378.906_516_8,
            -4_047_067.186_823_942,
            29_278_089.087_848_736,
            2.157_148_640_808,
            -29_278_089.687_848_736,
            8_500_493.419_464_92,
        ),
    ] {
        let stress = stress(compression, SOFT, 1.0);
        let x = [0.7, 0.3, 0.0];
        let expected = Matrix3::new(s11, s12, 0.0, s12, s22, 0.0, 0.0, 0.0, s33);
        assert_matrices_close(stress.cauchy(x), expected, 5e-14);
        assert_close(stress.pressure(x), pressure, 5e-14, "P");
        assert_close(stress.integration_constant(), b, 2e-14, "B");
    }
}

#[test]
fn the_nominal_stress_is_the_pulled_back_cauchy_stress_and_the_printed_components() {
    let stress = stress(0.35, SOFT, 1.2);
    let x = [0.8, 0.45, 0.0];
    let map = stress.map();
    let gradient = map.deformation_gradient(x);
    let nominal = stress.nominal(x);
    assert_matrices_close(gradient * nominal, stress.cauchy(x), 1e-14);
    assert_eq!(stress.first_piola(x), nominal.transpose());

    let (c1, c2) = (2.0 * SOFT.c10, -2.0 * SOFT.c01);
    let (f, shear, p) = (map.stretch(x[1]), x[0] * map.stretch_slope(x[1]), stress.pressure(x));
    let mu = c1 - c2;
    let across = -p + c1 / (f * f) + c2 * (f * f + shear * shear);
    let printed = Matrix3::new(
        (-p + c1 * (f * f + shear * shear) + c2 / (f * f)) / f - mu * shear * shear / f,
        -shear * across + mu * shear / (f * f),
        0.0,
        mu * shear,
        f * across,
        0.0,
        0.0,
        0.0,
        -p + c1 + c2,
    );
    assert_matrices_close(nominal, printed, 1e-13);
}

#[test]
fn b_satisfies_the_balance_of_both_equation_29_and_equation_31() {
    for compression in [1e-6, 0.05, 0.4, 0.9, 0.999] {
        for length in [0.3, 1.0, 4.0] {
            let stress = stress(compression, PAPER, length);
            let map = stress.map();
            let (constant, mean_inverse) =
                (stress.integration_constant(), integrate(0.0, 1.0, |x2| map.height_slope(x2)));
            // T11 contains B as -B / f; solve the balance for it.
            let without_b = |x1: f64| {
                integrate(0.0, 1.0, |x2| {
                    stress.nominal([x1, x2, 0.0])[(0, 0)] + constant * map.height_slope(x2)
                })
            };
            let bottom_shear = integrate(0.0, length, |x1| stress.nominal([x1, 0.0, 0.0])[(1, 0)]);
            let what = format!("at {compression}, L = {length}");
            let from_29 = (without_b(0.0) + bottom_shear) / mean_inverse;
            assert_close(constant, from_29, 3e-13, &format!("(29) {what}"));
            let from_31 = without_b(length) / mean_inverse;
            assert_close(constant, from_31, 3e-13, &format!("(31) {what}"));
        }
    }
}

#[test]
fn b_is_the_printed_equation_45() {
    let stress = stress(0.4, PAPER, 4.0);
    let (theta, n) = (stress.map().theta(), stress.map().n());
    let cos = theta.cos();
    let printed = PAPER_MU / (n * cos)
        * (-0.25 * (0.5 * (2.0 * theta).sin() + n * cos.powi(3))
            + theta.tan() * (1.0 + 0.5 * theta * theta * 16.0));
    assert_close(stress.integration_constant(), printed, 1e-14, "(45)");
}

#[test]
fn at_40_percent_the_bottom_of_the_axis_carries_minus_1939_c1() {
    let sigma = stress(0.4, PAPER, 4.0).cauchy([0.0; 3]);
    assert_close(sigma[(0, 0)] / 1364.3, -1938.79214039, 1e-11, "sigma11 / C1");
    // F is the identity there.
    assert_close(sigma[(1, 1)], sigma[(0, 0)], 1e-15, "sigma22");
    assert_close(sigma[(2, 2)], sigma[(0, 0)], 1e-15, "sigma33");
    assert_eq!(sigma[(0, 1)], 0.0);
}

#[test]
fn the_punch_and_the_axis_are_free_of_shear() {
    let stress = stress(0.3, PAPER, 2.0);
    for s in [0.0, 0.4, 1.0] {
        assert_eq!(stress.cauchy([2.0 * s, 1.0, 0.0])[(0, 1)], 0.0);
        assert_eq!(stress.cauchy([0.0, s, 0.0])[(0, 1)], 0.0);
    }
}

#[test]
fn without_compression_there_is_no_stress() {
    let stress = stress(0.0, PAPER, 2.0);
    assert_eq!(stress.cauchy([0.7, 0.3, 0.0]).amax(), 0.0);
    assert_eq!(stress.nominal([0.7, 0.3, 0.0]).amax(), 0.0);
    assert_eq!(stress.integration_constant(), 0.5 * PAPER.shear_modulus());
}

#[test]
fn only_the_sum_of_the_constants_acts_in_the_plane() {
    let (one, other) = (stress(0.3, SOFT, 1.0), stress(0.3, MooneyRivlin::neo_hookean(1.0), 1.0));
    let x = [0.7, 0.3, 0.0];
    let (one, other) = (one.cauchy(x), other.cauchy(x));
    for (i, j) in [(0, 0), (0, 1), (1, 1)] {
        assert_close(one[(i, j)], other[(i, j)], 1e-15, "in-plane stress");
    }
    assert!((one[(2, 2)] - other[(2, 2)]).abs() > 0.1);
}
