//! The deformation: theta, f, g.

use elastocap_mechanics::LayerMap;

use super::support::{assert_close, derivative, integrate};

const HEIGHTS: [f64; 6] = [0.0, 0.1, 0.35, 0.6, 0.9, 1.0];

fn map(compression: f64) -> LayerMap {
    LayerMap::new(1.0, compression).unwrap()
}

/// Compression, n, theta, lambda: mpmath, for the `f64` nearest to the compression written here.
const REFERENCE: [(f64, f64, f64, f64); 14] = [
    (1e-300, 1.732_050_807_568_877_3e-150, 1.732_050_807_568_877_3e-150, 1.0),
    (1e-12, 1.732_050_807_569_743_3e-6, 1.732_050_807_568_877_3e-6, 1.000_000_000_001_5),
    (1e-8, 1.732_050_816_229_131_4e-4, 1.732_050_807_568_877_3e-4, 1.000_000_015_000_000_2),
    (1e-6, 0.001_732_051_673_594_856_3, 0.001_732_050_807_568_803, 1.000_001_500_001_875),
    (1e-4, 0.017_321_374_158_625_44, 0.017_320_508_068_265_204, 1.000_150_018_752_159_2),
    (0.01, 0.174_076_899_862_737_66, 0.173_204_333_477_614_63, 1.015_189_682_937_864_2),
    (0.05, 0.397_314_148_863_753_1, 0.387_255_422_500_571_06, 1.079_973_050_231_376_7),
    (0.2, 0.864_050_933_994_429_2, 0.773_074_183_177_702_5, 1.397_102_232_871_703_4),
    (0.34, 1.232_896_833_790_612_6, 1.003_612_874_611_439, 1.861_300_859_125_169_8),
    (0.35, 1.259_663_135_287_992, 1.017_831_714_284_436_4, 1.903_991_846_452_609_6),
    (0.5, 1.690_544_365_325_056_8, 1.206_056_253_936_874, 2.803_425_395_468_396),
    (0.95, 4.820_410_375_906_54, 1.554_669_721_497_985_4, 62.012_018_491_771_75),
    (0.999, 9.388_960_873_659_108, 1.570_629_042_143_208, 5_977.834_753_932_321),
    (1.0 - 1e-12, 31.316_761_167_954_343, 1.570_796_326_794_846_5, 19_937_310_413_634.59),
];

#[test]
fn table_1_of_the_paper_is_met_to_all_its_twelve_digits() {
    // The columns headed "alpha H" and "alpha H^2 (x 1e-3)" are alpha and 1e3 alpha^2 for H = 50.
    for (percent, alpha, alpha_squared) in [
        (5.0, 0.007745108450011, 0.059986704902432),
        (10.0, 0.010949428377488, 0.119889981793739),
        (15.0, 0.013402082218189, 0.179615807783098),
        (20.0, 0.015461483663554, 0.239057477078347),
        (25.0, 0.017265407642140, 0.298094301049266),
        (30.0, 0.018883597411389, 0.356590251195417),
        (40.0, 0.021710142543939, 0.471330289278150),
    ] {
        let map = LayerMap::new(50.0, percent / 100.0).unwrap();
        assert_close(map.alpha(), alpha, 1e-12, "alpha");
        assert_close(1e3 * map.alpha().powi(2), alpha_squared, 1e-12, "1e3 alpha^2");
    }
}

#[test]
fn theta_is_the_audited_one() {
    for (percent, theta) in [
        (5.0, 0.387255422501),
        (10.0, 0.547471418874),
        (15.0, 0.670104110909),
        (20.0, 0.773074183178),
        (25.0, 0.863270382107),
        (30.0, 0.944179870569),
        (40.0, 1.085507127197),
    ] {
        assert!((map(percent / 100.0).theta() - theta).abs() < 6e-13, "{percent} %");
    }
}

#[test]
fn theta_has_full_precision_at_every_compression() {
    for (compression, n, theta, lambda) in REFERENCE {
        let map = map(compression);
        assert_close(map.theta(), theta, 6e-16, &format!("theta at {compression}"));
        assert_close(map.n(), n, 1e-15, &format!("n at {compression}"));
        // A relative error of n is one n times as large in lambda = cosh(n).
        assert_close(map.lambda(), lambda, 1e-15 * n.max(1.0), &format!("lambda at {compression}"));
    }
}

#[test]
fn theta_grows_with_the_compression_from_nothing_to_nearly_everything() {
    let mut last = map(0.0);
    for k in 0..2000 {
        let compression = if k < 1000 {
            10_f64.powf(-18.0 + 0.0175 * f64::from(k))
        } else {
            let rest = f64::from(2000 - k) / 1000.0;
            1.0 - 0.69 * rest.powi(3)
        };
        let next = map(compression);
        assert!(next.n() > last.n() && next.theta() > last.theta(), "at {compression}");
        last = next;
    }
}

#[test]
fn no_compression_is_the_identity() {
    for zero in [0.0, -0.0] {
        let map = LayerMap::new(450e-6, zero).unwrap();
        assert_eq!((map.theta(), map.n(), map.lambda()), (0.0, 0.0, 1.0));
        assert!(map.compression().is_sign_positive());
        assert_eq!((map.top_displacement(), map.deformed_thickness()), (0.0, 450e-6));
        for x2 in HEIGHTS {
            let x = [3e-4, 450e-6 * x2, 1e-4];
            assert_eq!(map.deform(x), x);
            assert_eq!(map.displacement(x).map(f64::abs), [0.0; 3]);
            assert_eq!(map.deformation_gradient(x), nalgebra::Matrix3::identity());
        }
    }
}

#[test]
fn the_boundary_conditions_hold() {
    for compression in [1e-12, 1e-3, 0.05, 0.33, 0.4, 0.7, 0.95, 0.999] {
        let map = LayerMap::new(2.5, compression).unwrap();
        assert_eq!((map.stretch(0.0), map.stretch_excess(0.0), map.height(0.0)), (1.0, 0.0, 0.0));
        assert_eq!(map.stretch_slope(2.5), 0.0);
        assert_close(map.stretch(2.5), map.lambda(), 1e-15, "f(H) = lambda");
        assert_close(map.height(2.5), 2.5 * (1.0 - compression), 2e-14, "g(H) = h");
        assert_close(map.deformed_thickness(), 2.5 * (1.0 - compression), 1e-15, "h");
        assert_close(-map.displacement([0.0, 2.5, 0.0])[1], 2.5 * compression, 2e-15, "u2(H) = -U");
        assert_eq!(map.displacement([0.7, 0.0, 0.2]), [0.0; 3]);
    }
}

#[test]
fn volume_is_kept() {
    for compression in [1e-12, 0.05, 0.4, 0.95] {
        let map = map(compression);
        for x2 in HEIGHTS {
            assert_close(map.stretch(x2) * map.height_slope(x2), 1.0, 3e-16, "f g'");
            assert_close(map.deformation_gradient([0.7, x2, 0.1]).determinant(), 1.0, 3e-16, "det F");
        }
    }
}

#[test]
fn the_slopes_are_the_derivatives_of_what_they_belong_to() {
    for compression in [0.05, 0.4, 0.6] {
        let map = map(compression);
        for x2 in [0.1, 0.35, 0.6, 0.9] {
            let f_slope = derivative(x2, 0.01, |s| map.stretch(s));
            let g_slope = derivative(x2, 0.01, |s| map.height(s));
            assert_close(map.stretch_slope(x2), f_slope, 1e-10, "f'");
            assert_close(map.height_slope(x2), g_slope, 1e-10, "g'");
            let curvature = derivative(x2, 0.01, |s| map.stretch_slope(s));
            assert_close(-map.alpha().powi(2) * map.stretch(x2), curvature, 1e-10, "f'' = -alpha^2 f");
            assert_close(map.stretch_excess(x2), map.stretch(x2) - 1.0, 1e-14, "f - 1");
        }
    }
}

#[test]
fn heights_are_the_integral_of_the_vertical_stretch() {
    for compression in [1e-9, 0.05, 0.4, 0.95] {
        let map = map(compression);
        for x2 in [1e-6, 0.1, 0.6, 1.0] {
            let expected = integrate(0.0, x2, |s| 1.0 / map.stretch(s));
            assert_close(map.height(x2), expected, 1e-14, &format!("g({x2}) at {compression}"));
        }
    }
}

#[test]
fn the_printed_equations_give_the_same_deformation() {
    let map = map(0.3);
    let (theta, x2) = (map.theta(), 0.35_f64);
    let printed_f = (theta * x2).cos() + theta.tan() * (theta * x2).sin();
    let log_ratio = |z: f64| ((1.0 + z) / (1.0 - z)).ln();
    let inner = (theta.tan() - (0.5 * theta * x2).tan()) * theta.cos();
    let printed_g = theta.cos() / theta * (log_ratio(theta.sin()) - log_ratio(inner));
    let half = 0.5 * theta;
    let printed_n = (2.0 * half.sin() / (half.cos() - half.sin()) + 1.0).ln();
    assert_close(map.stretch(x2), printed_f, 1e-15, "(37)");
    assert_close(map.height(x2), printed_g, 1e-14, "(38)");
    assert_close(map.n(), printed_n, 1e-15, "(46)");
}

#[test]
fn displacements_keep_their_digits_at_any_compression() {
    // Compression, f - 1, f', g, u2 at x2 = 0.3 H: mpmath.
    for (compression, excess, slope, height, up) in [
        (
            1e-12,
            7.650_000_000_008_625e-13,
            2.100_000_000_002_635_5e-12,
            0.299_999_999_999_878_5,
            -1.215_000_000_000_682_7e-13,
        ),
        (
            0.3,
            0.346_204_379_249_168_6,
            0.988_362_319_880_038_9,
            0.255_885_445_059_883_9,
            -0.044_114_554_940_116_06,
        ),
        (
            0.999,
            2_713.503_873_259_898,
            8_365.126_200_958_052,
            8.480_630_218_620_196e-4,
            -0.299_151_936_978_138,
        ),
    ] {
        let map = map(compression);
        let what = format!("at {compression}");
        assert_close(map.stretch_excess(0.3), excess, 1e-14, &what);
        assert_close(map.stretch_slope(0.3), slope, 1e-14, &what);
        assert_close(map.height(0.3), height, 1e-14, &what);
        let displacement = map.displacement([2.0, 0.3, 5.0]);
        assert_close(displacement[0], 2.0 * excess, 1e-14, &what);
        assert_close(displacement[1], up, 3e-15, &what);
        assert_eq!(displacement[2], 0.0);
    }
}

#[test]
fn the_deformation_scales_with_the_thickness() {
    let (small, large) = (map(0.37), LayerMap::new(450e-6, 0.37).unwrap());
    assert_eq!(small.theta(), large.theta());
    assert_close(large.height(0.4 * 450e-6), 450e-6 * small.height(0.4), 1e-14, "g");
    assert_close(large.stretch(0.4 * 450e-6), small.stretch(0.4), 1e-14, "f");
}
