//! Fits to points without errors: parameters that are recovered, and parameters that cannot be determined.

use elastocap_case::Correction;
use elastocap_fitting::fit::{FitError, fit_with, fitted_case};
use elastocap_fitting::picture::picture;

use crate::support::{curves, free, normal, pair, parse, points, with_noise};

const MODULUS: &str = "layer.material.neo_hookean.shear_modulus";

/// Twelve loads up to 0.2 N.
fn loads() -> impl Iterator<Item = f64> {
    (0..12).map(|k| 0.018 * f64::from(k))
}

#[test]
fn keys_that_change_the_field_are_found_by_differences() {
    let text = pair("0.01");
    let curves = curves(&text);
    let truth = Correction { parasitic: 5e-15, ..Correction::default() };
    let values = [(MODULUS, "\"70 kPa\"".to_owned()), ("layer.relative_permittivity", "3.1".to_owned())];
    let exact = points(&curves, &values, loads(), truth);
    let names = [
        "layer.material.neo_hookean.shear_modulus=20kPa..500kPa",
        "layer.relative_permittivity=2..4",
        "parasitic",
    ];
    let parameters = free(&text, &names, &exact);
    let noisy = with_noise(&exact, 0.01e-15, &mut normal(3));
    let found = fit_with(&curves, &parameters, &noisy).unwrap();
    assert!(found.converged, "{:?}", found.findings);
    for (parameter, truth) in found.parameters.iter().zip([70e3, 3.1, 5e-15]) {
        let half = parameter.standard_error.unwrap() * 4.0;
        // Grids differ between neighbouring values, but their errors vary by far less than the bounds.
        let shift = parameter.shift_by_curve.unwrap();
        assert!(
            (parameter.value - truth).abs() <= half + 0.2 * shift,
            "{}: {} {half} {shift}",
            parameter.name,
            parameter.value
        );
    }
    // The fitted values are written into the case, whose comments stay.
    let written = fitted_case(&format!("{text}[measurement]\n"), &parameters, &found).unwrap();
    assert!(written.contains("# a first guess") && written.contains("parasitic = "), "{written}");
    let svg = picture("a pair", &noisy, &found).to_svg();
    assert!(svg.contains("measured less computed") && svg.contains("where the fit began"));
}

#[test]
fn gain_and_permittivity_of_a_pair_in_one_medium_cannot_be_told_apart() {
    // The field is in the layer alone, so that its permittivity is a factor like the gain.
    let text = pair("0.02").replace(
        "above       = { relative_permittivity = 1.0, thickness = \"1 mm\" }",
        "above       = \"insulated\"",
    );
    parse(&text);
    let curves = curves(&text);
    let exact = points(&curves, &[(MODULUS, "\"70 kPa\"".to_owned())], loads(), Correction::default());
    let parameters = free(&text, &["layer.relative_permittivity=2..4", "gain=0.5..2"], &exact);
    let noisy = with_noise(&exact, 0.05e-15, &mut normal(5));
    let found = fit_with(&curves, &parameters, &noisy).unwrap();
    let findings = found.findings.join("\n");
    assert!(findings.contains("apart") && findings.contains("gain"), "{findings}");
}

#[test]
fn a_parameter_that_ends_at_its_limit_is_said_to_be_there() {
    let text = pair("0.02");
    let curves = curves(&text);
    let truth = Correction { parasitic: 5e-15, ..Correction::default() };
    let exact = points(&curves, &[(MODULUS, "\"70 kPa\"".to_owned())], loads(), truth);
    let parameters = free(
        &text,
        &["layer.material.neo_hookean.shear_modulus=20kPa..500kPa", "parasitic=0fF..3fF"],
        &exact,
    );
    let found = fit_with(&curves, &parameters, &exact).unwrap();
    let [_, parasitic] = found.parameters.as_slice() else { panic!("two parameters") };
    assert_eq!((parasitic.at_limit, parasitic.interval_95), (Some("upper"), None));
    assert!(
        found.findings.iter().any(|text| text.contains("ended at its upper limit")),
        "{:?}",
        found.findings
    );
}

#[test]
fn deviations_that_are_given_count_in_place_of_residuals() {
    let text = pair("0.02");
    let curves = curves(&text);
    let exact = points(&curves, &[(MODULUS, "\"70 kPa\"".to_owned())], loads(), Correction::default());
    let mut given = with_noise(&exact, 0.1e-15, &mut normal(8));
    given.points.iter_mut().for_each(|point| point.deviation = Some(0.1e-15));
    let parameters = free(&text, &["layer.material.neo_hookean.shear_modulus=20kPa..500kPa"], &given);
    let found = fit_with(&curves, &parameters, &given).unwrap();
    let reduced = found.reduced_chi_squared.unwrap();
    assert!(found.noise_is_given && reduced > 0.2 && reduced < 3.0, "{reduced}");
    // Points that scatter by more than their deviations are reported.
    given.points.iter_mut().for_each(|point| point.deviation = Some(0.01e-15));
    let found = fit_with(&curves, &parameters, &given).unwrap();
    assert!(
        found.findings.iter().any(|text| text.contains("deviations of the points allow")),
        "{:?}",
        found.findings
    );
}

#[test]
fn more_parameters_than_points_are_refused() {
    let text = pair("0.02");
    let curves = curves(&text);
    let mut exact = points(&curves, &[], loads(), Correction::default());
    exact.points.truncate(2);
    let parameters = free(&text, &["parasitic", "gain"], &exact);
    let refused = fit_with(&curves, &parameters, &exact);
    assert!(matches!(refused, Err(FitError::TooFewPoints { points: 2, parameters: 2 })));
}
