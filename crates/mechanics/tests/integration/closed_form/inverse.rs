//! The compression that a force causes.

use elastocap_mechanics::{
    ClosedFormSettings, LayerState, MechanicsError, compression_for_force, force_limit,
};

use super::support::{PAPER, assert_close, equal_lengths};

const H: f64 = 450e-6;

#[test]
fn force_and_compression_go_round_trip_over_the_whole_range() {
    // Equal lengths in thicknesses, and how far the force rises with them.
    for (length, end) in
        [(0.1, 0.999), (0.4, 0.999), (1.0, 0.95), (10.0 / 9.0, 0.93), (4.0, 0.75), (40.0, 0.72)]
    {
        let settings = equal_lengths(length * H);
        let small = (0..=56).map(|k| 10_f64.powf(-14.0 + 0.25 * f64::from(k)));
        let large = (1..=99).map(|k| f64::from(k) / 100.0);
        for compression in small.chain(large).chain([0.999]).filter(|&c| c <= end) {
            let force = LayerState::new(H, PAPER, compression, settings).unwrap().force();
            let back = compression_for_force(H, PAPER, settings, force).unwrap();
            assert_close(back, compression, 1e-13, &format!("L = {length} H"));
        }
    }
}

#[test]
fn a_layer_under_force_carries_that_force() {
    let settings = equal_lengths(0.1 * H);
    for exponent in (-300..=40).step_by(4) {
        let force = 10_f64.powi(exponent);
        let layer = LayerState::under_force(H, PAPER, force, settings).unwrap();
        assert_close(layer.force(), force, 1e-13, "force");
        assert!(layer.compression() > 0.0 && layer.compression() < 1.0);
        assert_close(layer.deformed_thickness() + layer.top_displacement(), H, 1e-15, "h + U");
    }
}

#[test]
fn no_force_means_exactly_no_compression() {
    for zero in [0.0, -0.0] {
        let compression = compression_for_force(H, PAPER, equal_lengths(H), zero).unwrap();
        assert!(compression == 0.0 && compression.is_sign_positive());
        let layer = LayerState::under_force(H, PAPER, zero, equal_lengths(H)).unwrap();
        assert_eq!((layer.force(), layer.top_displacement()), (0.0, 0.0));
    }
}

#[test]
fn unequal_lengths_go_round_trip_too() {
    let settings =
        ClosedFormSettings { contact_half_length: 5.0 * H, contact_width: 1e-3, shear_length: 3.0 * H };
    let limit = force_limit(H, PAPER, settings).unwrap();
    for k in 1..=20 {
        let compression = limit.compression * f64::from(k) / 21.0;
        let force = LayerState::new(H, PAPER, compression, settings).unwrap().force();
        assert_close(compression_for_force(H, PAPER, settings, force).unwrap(), compression, 1e-13, "U/H");
    }
}

#[test]
fn the_largest_force_is_reached_and_more_is_refused() {
    for length in [0.1, 1.0, 4.0] {
        let settings = equal_lengths(length * H);
        let limit = force_limit(H, PAPER, settings).unwrap();
        let nearly = compression_for_force(H, PAPER, settings, limit.force * (1.0 - 1e-12)).unwrap();
        assert!(nearly <= limit.compression && nearly > limit.compression - 1e-5, "{nearly}, {limit:?}");
        for force in [limit.force * (1.0 + 1e-9), 1e300] {
            let refused = compression_for_force(H, PAPER, settings, force).unwrap_err();
            assert_eq!(
                refused,
                MechanicsError::ForceOutOfReach {
                    force,
                    largest_force: limit.force,
                    compression: limit.compression
                }
            );
        }
    }
}

#[test]
fn the_compression_rises_with_the_force() {
    let mut last = 0.0;
    for k in 1..=300 {
        let compression = compression_for_force(H, PAPER, equal_lengths(H), 1e-3 * f64::from(k * k)).unwrap();
        assert!(compression > last);
        last = compression;
    }
}
