//! The law of foams against its formula as Ogden and Storåkers print it, and foams pressed along one axis.

use elastocap_materials::hyperfoam::{
    bulk_modulus, compression_under, pressed_between_walls, pressed_freely,
};
use elastocap_materials::{HyperelasticLaw, HyperfoamTerm, Rubber};

use crate::every_law::{foams, slope};

/// The energy by principal stretches, as it is printed.
pub(crate) fn foam_energy(terms: &[HyperfoamTerm], stretches: [f64; 3]) -> f64 {
    let j: f64 = stretches.iter().product();
    let term = |term: &HyperfoamTerm| {
        let (a, beta) = (term.exponent, term.poisson_ratio / (1.0 - 2.0 * term.poisson_ratio));
        let volume = if beta == 0.0 { -a * j.ln() } else { (j.powf(-a * beta) - 1.0) / beta };
        let powers: f64 = stretches.iter().map(|l| l.powf(a)).sum();
        2.0 * term.shear_modulus / (a * a) * (powers - 3.0 + volume)
    };
    terms.iter().map(term).sum()
}

#[test]
fn the_energy_in_plane_and_in_space_is_the_printed_one() {
    for terms in foams() {
        let foam = Rubber::of_law(HyperelasticLaw::Hyperfoam { terms: terms.clone() }, None);
        for l in [[1.0, 1.0], [0.4, 1.1], [1.7, 0.8], [0.3, 0.3]] {
            let plane = foam.derivatives(&[l[0], 0.0, 0.0, l[1]]).w;
            let space = foam.response(&[l[0], 0.0, 0.0, 0.0, l[1], 0.0, 0.0, 0.0, 1.0]).energy;
            let printed = foam_energy(&terms, [l[0], l[1], 1.0]);
            assert!((plane - printed).abs() < 1e-13 * (1.0 + printed), "{terms:?} {l:?}: {plane} {printed}");
            assert!((space - printed).abs() < 1e-13 * (1.0 + printed), "{terms:?} {l:?}: {space} {printed}");
        }
        assert_eq!(foam.derivatives(&[0.5, 0.0, 0.0, -0.5]).w, f64::INFINITY);
        assert_eq!(foam.pressure_compliance(), None);
    }
}

#[test]
fn the_moduli_at_rest_are_those_of_the_terms() {
    for terms in foams() {
        // With the same stretch l along all axes the pressure is dW/dJ, and the bulk modulus is its slope by
        // J at J = 1.
        let pressure = |j: f64| slope(1e-3, |s| foam_energy(&terms, [(j + s).cbrt(); 3]));
        let bulk = slope(1e-2, |s| pressure(1.0 + s));
        assert!((bulk / bulk_modulus(&terms) - 1.0).abs() < 1e-7, "{bulk} {}", bulk_modulus(&terms));
        let shear: f64 = terms.iter().map(|term| term.shear_modulus).sum();
        assert_eq!(HyperelasticLaw::Hyperfoam { terms }.shear_modulus(), shear);
    }
}

#[test]
fn a_foam_of_one_poissons_ratio_is_pressed_as_its_closed_form_says() {
    // Zero lateral stress makes the lateral stretch l^-nu, and the nominal stress 2 mu / a (l^(a - 1) - l^(-a
    // nu - 1)).
    for (a, nu) in [(2.0, 0.0), (8.0, 0.0), (-3.0, 0.0), (2.0, 0.3), (-4.0, 0.1), (12.0, 0.45)] {
        let terms = [HyperfoamTerm { shear_modulus: 15e3, exponent: a, poisson_ratio: nu }];
        for compression in [1e-9, 1e-3, 0.1, 0.5, 0.9] {
            let l: f64 = 1.0 - compression;
            let found = pressed_freely(&terms, compression);
            assert!((found.lateral_stretch / l.powf(-nu) - 1.0).abs() < 1e-14, "{a} {nu} {compression}");
            let pressure = 2.0 * 15e3 / a * (l.powf(-a * nu - 1.0) - l.powf(a - 1.0));
            // The formula loses digits where the compression is tiny.
            let error = (found.nominal_pressure / pressure - 1.0).abs();
            assert!(error < 1e-14 + 1e-15 / compression, "{a} {nu} {compression}: {error:e}");
            let back =
                compression_under(found.nominal_pressure, |c| pressed_freely(&terms, c).nominal_pressure);
            assert!((back / compression - 1.0).abs() < 1e-12, "{a} {nu} {compression}: {back}");
        }
    }
}

#[test]
fn a_pressed_foam_has_no_lateral_stress_and_its_pressure_is_the_slope_of_the_least_energy() {
    for terms in foams() {
        for compression in [0.01, 0.3, 0.7] {
            let found = pressed_freely(&terms, compression);
            let (l, t) = (1.0 - compression, found.lateral_stretch);
            let lateral = slope(1e-3 * t, |s| foam_energy(&terms, [l, t + s, t]));
            assert!(lateral.abs() < 1e-8, "{terms:?} {compression}: {lateral}");
            let axial = slope(1e-3 * l, |s| foam_energy(&terms, [l + s, t, t]));
            assert!((axial + found.nominal_pressure).abs() < 1e-8, "{terms:?} {compression}: {axial}");
            let held = pressed_between_walls(&terms, compression).nominal_pressure;
            let axial = slope(1e-3 * l, |s| foam_energy(&terms, [l + s, 1.0, 1.0]));
            assert!((axial + held).abs() < 1e-8 * (1.0 + held), "{terms:?} {compression}: {axial} {held}");
            assert!(held >= found.nominal_pressure - 1e-12);
        }
    }
}
