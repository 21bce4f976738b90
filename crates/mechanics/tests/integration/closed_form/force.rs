//! The force of the punch.

use elastocap_mechanics::{ClosedFormSettings, LayerState, MooneyRivlin, force_limit};

use super::support::{PAPER, PAPER_MU, assert_close, equal_lengths, integrate};

const UNIT: MooneyRivlin = MooneyRivlin::neo_hookean(1.0);

/// Force over `mu H w` with contact and shear length `length` (in thicknesses).
fn normalised_force(compression: f64, length: f64) -> f64 {
    LayerState::new(1.0, UNIT, compression, equal_lengths(length)).unwrap().force()
}

#[test]
fn the_audited_force_table_is_met() {
    for (compression, short, long) in [
        (0.05, 0.6089434352, 9.430809956),
        (0.1, 1.362952126, 21.88108564),
        (0.2, 3.543717402, 60.61180643),
        (0.4, 14.58933039, 267.4482963),
    ] {
        assert_close(normalised_force(compression, 1.0), short, 5e-10, "L = H");
        assert_close(normalised_force(compression, 4.0), long, 5e-10, "L = 4 H");
    }
}

#[test]
fn the_force_keeps_its_digits_at_any_compression() {
    // Force over mu H w for L/H = 1, 4 and 1/8: mpmath, for the `f64` nearest to the compression written
    // here.
    for (compression, forces) in [
        (1e-12, [1.100_000_000_002_13e-11, 1.640_000_000_004_452e-10, 1.128_906_250_001_924_2e-12]),
        (1e-8, [1.100_000_021_300_000_4e-7, 1.640_000_044_520_000_9e-6, 1.128_906_269_242_187_9e-8]),
        (1e-6, [1.100_002_130_004_179_6e-5, 1.640_004_452_008_679e-4, 1.128_908_174_222_537_5e-6]),
        (1e-4, [0.001_100_213_041_803_369_4, 0.016_404_452_868_038_693, 1.129_098_709_756_819_6e-4]),
        (0.01, [0.112_172_501_004_238_76, 1.685_401_966_052_136_5, 0.011_485_336_922_137_383]),
        (0.35, [10.341_961_643_555_478, 188.194_683_318_703_7, 0.991_635_481_652_040_5]),
        (0.5, [30.068_890_411_181_716, 541.924_897_728_294_1, 2.893_900_748_882_586]),
        (0.95, [26_350.418_578_231_28, -4_248_836.930_273_687, 12_223.393_210_591_298]),
        (0.999, [-74_024_774_675.116_99, -7_467_791_628_108.19, 5_454_475_735.684_806]),
        (1.0 - 1e-12, [-5.387_538_982_606_693e39, -3.751_696_506_979_07e41, 5.175_385_667_778_505e37]),
    ] {
        for (length, expected) in [1.0, 4.0, 0.125].into_iter().zip(forces) {
            // lambda^3 multiplies the rounding of n, and at 95 % the parts of opposite sign cancel a little.
            let tolerance = if compression > 0.9 { 1e-13 } else { 3e-15 };
            let got = normalised_force(compression, length);
            assert_close(got, expected, tolerance, &format!("at {compression}, L = {length} H"));
        }
    }
}

#[test]
fn no_compression_needs_no_force() {
    for length in [0.1, 1.0, 4.0] {
        let force = normalised_force(0.0, length);
        assert!(force == 0.0 && force.is_sign_positive());
    }
}

#[test]
fn the_force_is_the_printed_equation_50_with_the_opposite_sign() {
    let settings = ClosedFormSettings { contact_half_length: 0.8, contact_width: 0.3, shear_length: 1.1 };
    let layer = LayerState::new(1.0, PAPER, 0.25, settings).unwrap();
    let (theta, b) = (layer.map().theta(), layer.stress().integration_constant());
    let lambda = 1.0 / theta.cos();
    let printed = 2.0
        * 0.3
        * lambda
        * 0.8
        * (PAPER_MU * theta * theta * 0.64 * lambda * lambda / 6.0 + PAPER_MU / (2.0 * lambda * lambda) - b);
    assert_close(layer.force(), -printed, 1e-14, "(50)");
}

#[test]
fn the_force_is_the_integral_of_both_stresses_over_the_contact() {
    for compression in [1e-6, 0.05, 0.4, 0.7] {
        let settings = ClosedFormSettings { contact_half_length: 0.8, contact_width: 0.3, shear_length: 1.1 };
        let layer = LayerState::new(1.0, PAPER, compression, settings).unwrap();
        let stress = layer.stress();
        let reference = integrate(0.0, 0.8, |x1| -2.0 * 0.3 * stress.nominal([x1, 1.0, 0.0])[(1, 1)]);
        assert_close(layer.force(), reference, 1e-13, "(48)");
        let lambda = layer.map().lambda();
        let deformed =
            integrate(0.0, 0.8 * lambda, |y1| -2.0 * 0.3 * stress.cauchy([y1 / lambda, 1.0, 0.0])[(1, 1)]);
        assert_close(layer.force(), deformed, 1e-13, "(49)");
    }
}

#[test]
fn the_force_scales_with_modulus_width_and_thickness() {
    let (h, w) = (450e-6, 500e-6);
    let settings = ClosedFormSettings { contact_half_length: h, contact_width: w, shear_length: h };
    let force = LayerState::new(h, PAPER, 0.3, settings).unwrap().force();
    assert_close(force, PAPER_MU * h * w * normalised_force(0.3, 1.0), 1e-14, "force");
}

#[test]
fn the_force_rises_up_to_its_limit_and_falls_beyond() {
    // Compression and force over mu H w at the maximum: mpmath.
    for (length, compression, force) in [
        (0.5, 0.999_934_032_361_538, 4_855_081_023_127.56),
        (1.0, 0.960_145_588_958_997, 32_355.711_425_510_7),
        (4.0, 0.766_307_046_698_067, 3_187.834_358_528_37),
        (100.0, 0.736_225_139_441_094, 29_683_873.317_981_2),
    ] {
        let limit = force_limit(1.0, UNIT, equal_lengths(length)).unwrap();
        assert_close(limit.compression, compression, 1e-13, "compression at the limit");
        assert_close(limit.force, force, 1e-13, "largest force");
        let mut last = 0.0;
        for k in 1..=1000 {
            let force = normalised_force(limit.compression * f64::from(k) / 1000.0, length);
            assert!(force > last, "L = {length} H at step {k}");
            last = force;
        }
        assert_close(last, limit.force, 1e-12, "largest force");
        let beyond = limit.compression + 0.01 * (1.0 - limit.compression);
        assert!(normalised_force(beyond, length) < limit.force);
    }
}

#[test]
fn under_a_short_contact_the_force_rises_until_nothing_is_left() {
    let limit = force_limit(1.0, UNIT, equal_lengths(0.1)).unwrap();
    assert!(limit.compression > 1.0 - 1e-15 && limit.compression < 1.0);
    assert!(limit.force.is_finite());
    let mut last = 0.0;
    for k in -14..=0 {
        let force = normalised_force(0.9 * 10_f64.powi(k), 0.1);
        assert!(force > last);
        last = force;
    }
    for k in 2..=15 {
        let force = normalised_force(1.0 - 0.09 * 10_f64.powi(2 - k), 0.1);
        assert!(force > last, "1 - 9e-{k}");
        last = force;
    }
}
