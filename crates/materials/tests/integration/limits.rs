//! Gent's law at its limits: without a limit of extension it is neo-Hookean, at the limit the energy is
//! infinite.

use elastocap_materials::{HyperelasticLaw, Rubber, Volume};

const VOLUMES: [Volume; 3] =
    [Volume::Incompressible, Volume::BulkModulus(30.0), Volume::DisplacementOnly(7.0)];

fn gent(limiting_invariant: f64, volume: Volume) -> Rubber {
    let distortion = HyperelasticLaw::Gent { shear_modulus: 1.3, limiting_invariant };
    Rubber { distortion, volume, volume_barrier: 0.0 }
}

/// A pure shear of the plane by this stretch; `I1 - 3 = l^2 + 1/l^2 - 2`.
fn sheared(stretch: f64) -> [f64; 4] {
    [stretch, 0.0, 0.0, 1.0 / stretch]
}

fn in_space(f: &[f64; 4]) -> [f64; 9] {
    [f[0], f[1], 0.0, f[2], f[3], 0.0, 0.0, 0.0, 1.0]
}

#[test]
fn a_gent_rubber_without_limit_is_neo_hookean() {
    for volume in VOLUMES {
        let neo = Rubber {
            distortion: HyperelasticLaw::NeoHookean { shear_modulus: 1.3 },
            volume,
            volume_barrier: 0.0,
        };
        let rubber = gent(1e12, volume);
        for f in [[1.2, 0.4, -0.1, 0.8], [2.5, 1.0, 0.3, 0.6], [0.3, -2.0, 0.9, 0.7]] {
            let (a, b) = (rubber.derivatives(&f), neo.derivatives(&f));
            assert!((a.w - b.w).abs() < 1e-10, "{volume:?} {f:?}: {a:?} {b:?}");
            for (a, b) in a.tangent(&f).iter().flatten().zip(b.tangent(&f).iter().flatten()) {
                assert!((a - b).abs() < 1e-9, "{volume:?} {f:?}: {a} {b}");
            }
            let (a, b) = (rubber.response(&in_space(&f)), neo.response(&in_space(&f)));
            assert!((a.energy - b.energy).abs() < 1e-10, "{volume:?} {f:?}");
            for (a, b) in a.tangent.iter().flatten().zip(b.tangent.iter().flatten()) {
                assert!((a - b).abs() < 1e-9, "{volume:?} {f:?}: {a} {b}");
            }
        }
    }
}

#[test]
fn at_and_beyond_the_limit_of_extension_the_energy_is_infinite_and_never_nan() {
    // l^2 + 1/l^2 - 2 = 2.25 at a stretch of 2.
    for (limit, finite) in [(2.2500001, true), (2.25, false), (2.0, false), (0.1, false)] {
        for volume in VOLUMES {
            let (rubber, f) = (gent(limit, volume), sheared(2.0));
            let plane = rubber.derivatives(&f);
            let space = rubber.response(&in_space(&f));
            assert_eq!(plane.w.is_finite(), finite, "{limit} {volume:?}: {plane:?}");
            assert_eq!(space.energy.is_finite(), finite, "{limit} {volume:?}");
            assert!(!plane.w.is_nan() && plane.first_piola(&f).iter().all(|p| p.is_finite()));
            assert!(!space.energy.is_nan() && space.stress.iter().all(|p| p.is_finite()));
            let left = [rubber.extension_left(&f), rubber.extension_left_in_space(&in_space(&f))]
                .map(Option::unwrap);
            assert!(left.iter().all(|left| (*left > 0.0) == finite), "{limit} {volume:?}: {left:?}");
        }
    }
}

#[test]
fn what_is_left_of_the_extension_falls_from_one_to_zero() {
    let rubber = gent(2.25, Volume::Incompressible);
    for (stretch, left) in [(1.0, 1.0), (1.5, 1.0 - (2.25 + 1.0 / 2.25 - 2.0) / 2.25), (2.0, 0.0)] {
        assert!((rubber.extension_left(&sheared(stretch)).unwrap() - left).abs() < 1e-15);
    }
    let without = [
        HyperelasticLaw::Yeoh { constants: [0.5, 0.0, 0.0] },
        HyperelasticLaw::NeoHookean { shear_modulus: 1.0 },
    ];
    for distortion in without {
        let rubber = Rubber::of_law(distortion, None);
        assert!(!rubber.has_extension_limit() && rubber.extension_left(&sheared(9.0)).is_none());
    }
    // Of the law, the logarithmic volume law takes the shear modulus only.
    assert!(!gent(2.25, Volume::LogLame(1.0)).has_extension_limit());
}

#[test]
fn the_constants_for_the_closed_form_give_the_energy_of_the_law() {
    let (c10, c01) = (0.2, 0.5);
    for law in
        [HyperelasticLaw::MooneyRivlin { c10, c01 }, HyperelasticLaw::NeoHookean { shear_modulus: 1.3 }]
    {
        let constants = law.as_mooney_rivlin().unwrap();
        assert_eq!(constants.shear_modulus(), law.shear_modulus());
        let rubber = Rubber { distortion: law, volume: Volume::Incompressible, volume_barrier: 0.0 };
        // Stretched by 2 in one direction at constant volume, thinner by 1/sqrt 2 in the others.
        let (l, t) = (2.0, 0.5_f64.sqrt());
        let energy = rubber.response(&[l, 0.0, 0.0, 0.0, t, 0.0, 0.0, 0.0, t]).energy;
        let by_hand =
            constants.c10 * (l * l + 2.0 / l - 3.0) + constants.c01 * (2.0 * l + 1.0 / (l * l) - 3.0);
        assert!((energy - by_hand).abs() < 1e-13, "{rubber:?}: {energy} {by_hand}");
    }
}
