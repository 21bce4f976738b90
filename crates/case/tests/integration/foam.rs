//! Tests of the foam laws, and of combinations that a foam does not allow.

use std::path::Path;

use elastocap_case::{Case, CaseError, HyperelasticLaw, Mechanics};

const CASE: &str = r#"format = 1
[layer]
thickness = "3 mm"
foam = { solid_permittivity = 5.0, solid_fraction = 0.15 }
[layer.material.hyperfoam]
terms = [{ shear_modulus = "15 kPa", exponent = 8.0, poisson_ratio = 0.1 }]
[electrodes.array]
on = "substrate"
pads = [1, 1]
size = ["20 mm", "20 mm"]
pitch = ["20 mm", "20 mm"]
thickness = "35 um"
[electrodes.array.common_plate]
on = "layer-top"
thickness = "50 um"
[mechanics.closed_form]
contact_half_length = "10 mm"
contact_width = "20 mm"
shear_length = "10 mm"
[load]
force = ["0 N", "5 N"]
[surroundings]
boundary = "open"
below = { relative_permittivity = 4.5, thickness = "1.6 mm" }
"#;

const TERM: &str = "terms = [{ shear_modulus = \"15 kPa\", exponent = 8.0, poisson_ratio = 0.1 }]";

const TABLE: &str = r#"compression = [0.0, 0.1, 0.5]
loading = ["0 kPa", "4 kPa", "6 kPa"]
unloading = ["0 kPa", "2 kPa", "6 kPa"]"#;

fn parse(text: &str) -> Result<Case, CaseError> {
    elastocap_case::parse(text, Path::new("foam.toml"))
}

fn with(pairs: &[(&str, &str)]) -> String {
    pairs.iter().fold(CASE.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "{from}");
        text.replace(from, to)
    })
}

fn by_table(pairs: &[(&str, &str)]) -> String {
    let text = with(&[("material.hyperfoam", "material.foam_table"), (TERM, TABLE)]);
    pairs.iter().fold(text, |text, (from, to)| {
        assert!(text.contains(from), "{from}");
        text.replace(from, to)
    })
}

/// Checks that there is one message, with these words.
fn refused(text: &str, words: &[&str]) {
    let error = parse(text).expect_err(text);
    let shown = error.render(false);
    assert_eq!(error.diagnostics().len(), 1, "{shown}");
    assert!(error.diagnostics()[0].span.is_some() && shown.contains("help"), "{shown}");
    for word in words {
        assert!(shown.contains(word), "`{word}` is not in\n{shown}");
    }
}

#[test]
fn a_hyperfoam_is_read_and_its_permittivity_follows_its_volume() {
    let case = parse(CASE).unwrap();
    assert!(case.is_foam() && !case.lacks_force());
    let layer = case.layer.unwrap();
    let Some(HyperelasticLaw::Hyperfoam { terms }) = &layer.material else { panic!("{layer:?}") };
    assert_eq!((terms[0].shear_modulus, terms[0].exponent, terms[0].poisson_ratio), (15e3, 8.0, 0.1));
    // One term widens by l^-nu along both axes.
    let share = 0.15 / 0.5f64.powf(1.0 - 2.0 * 0.1);
    let right = (1.0 + share * (5f64.cbrt() - 1.0)).powi(3);
    assert!((layer.permittivity_at(0.5).unwrap() / right - 1.0).abs() < 1e-14);
    assert!(matches!(case.mechanics, Some(Mechanics::ClosedForm { .. })));
}

#[test]
fn a_table_is_read_and_the_foam_gets_no_wider() {
    let layer = parse(&by_table(&[])).unwrap().layer.unwrap();
    assert!(layer.material.is_none() && layer.has_foam_law());
    let table = layer.stress_table.clone().unwrap();
    assert_eq!(table.compression, [0.0, 0.1, 0.5]);
    assert_eq!((table.loading, table.unloading), (vec![0.0, 4e3, 6e3], Some(vec![0.0, 2e3, 6e3])));
    let right = (1.0 + 0.3 * (5f64.cbrt() - 1.0)).powi(3);
    assert!((layer.permittivity_at(0.5).unwrap() / right - 1.0).abs() < 1e-14);
}

#[test]
fn without_a_law_of_foams_a_force_is_refused_and_the_laws_are_named() {
    let rubber = [("material.hyperfoam", "material.neo_hookean"), (TERM, "shear_modulus = \"15 kPa\"")];
    refused(
        &with(&rubber),
        &["cannot be loaded by a force", "[layer.material.hyperfoam]", "[layer.material.foam_table]"],
    );
    let compressed = with(&rubber).replace("force = [\"0 N\", \"5 N\"]", "compression = [0.0, 0.5]");
    assert!(parse(&compressed).unwrap().lacks_force());
}

#[test]
fn a_hyperfoam_that_is_none_says_what_is_wrong() {
    for (from, to, words) in [
        ("exponent = 8.0", "exponent = 0.0", ["`exponent` of a hyperfoam term must not be zero", "8.0"]),
        ("poisson_ratio = 0.1", "poisson_ratio = 0.5", ["poisson_ratio", "between 0 and 0.45"]),
        ("poisson_ratio = 0.1", "poisson_ratio = -0.1", ["poisson_ratio", "between 0 and 0.45"]),
        ("\"15 kPa\"", "\"-15 kPa\"", ["shear_modulus", "greater than zero"]),
        (TERM, "terms = []", ["`terms` is empty", "shear_modulus = "]),
        (", poisson_ratio = 0.1", "", ["lacks `poisson_ratio`", "0.0"]),
    ] {
        refused(&with(&[(from, to)]), &words);
    }
}

#[test]
fn a_table_that_is_none_says_what_is_wrong() {
    for (from, to, words) in [
        ("[0.0, 0.1, 0.5]", "[0.0, 0.1]", ["`loading` has 3 stresses", "2 entries"]),
        ("[0.0, 0.1, 0.5]", "[0.05, 0.1, 0.5]", ["begins at a compression of 0", "compression = [0.0"]),
        ("[0.0, 0.1, 0.5]", "[0.0, 0.5, 0.5]", ["do not rise", "sort"]),
        ("[\"0 kPa\", \"4 kPa\"", "[\"1 kPa\", \"4 kPa\"", ["begins with a stress of zero", "first contact"]),
        ("\"4 kPa\", \"6 kPa\"", "\"6.1 kPa\", \"6 kPa\"", ["stresses of a foam's table fall", "smooth"]),
        ("\"2 kPa\", \"6 kPa\"", "\"2 kPa\", \"6.1 kPa\"", ["`unloading` is above `loading`", "exchanged"]),
        ("\"4 kPa\"", "\"4 mm\"", ["is a length", "kPa"]),
    ] {
        refused(&by_table(&[(from, to)]), &words);
    }
    let zero = by_table(&[("\"4 kPa\", \"6 kPa\"", "\"0 kPa\", \"0 kPa\""), ("unloading", "# unloading")]);
    refused(&zero, &["all stresses are zero"]);
}

#[test]
fn what_a_foam_cannot_be_combined_with_is_refused_with_a_way_out() {
    let closed_form = &CASE[CASE.find("[mechanics").unwrap()..CASE.find("[load]").unwrap()];
    let elements = "[mechanics.plane_strain]\nend = \"free\"\nwidth = \"20 mm\"\nindenter = \"whole-top\"\n";
    let long = ("thickness = \"3 mm\"", "thickness = \"3 mm\"\nhalf_length = \"10 mm\"");
    refused(
        &by_table(&[(closed_form, elements), long]),
        &["[layer.material.foam_table] cannot be used", "fit `[layer.material.hyperfoam]`"],
    );
    let foam = "foam = { solid_permittivity = 5.0, solid_fraction = 0.15 }";
    let constant = (foam, "relative_permittivity = 1.3");
    assert!(parse(&with(&[(closed_form, elements), long, constant])).is_ok());
    refused(
        &with(&[(closed_form, elements), long]),
        &["by finite elements that is not compressed evenly", "`poisson_ratio = 0.0`"],
    );
    let even = [(closed_form, elements), long, ("poisson_ratio = 0.1", "poisson_ratio = 0.0")];
    assert!(parse(&with(&even)).is_ok());
    let punch = elements.replace("\"whole-top\"", "{ flat_punch = { half_width = \"5 mm\" } }");
    let plate = "[electrodes.array.common_plate]\non = \"layer-top\"\nthickness = \"50 um\"\n";
    let punched =
        [(plate, ""), (closed_form, punch.as_str()), long, ("poisson_ratio = 0.1", "poisson_ratio = 0.0")];
    refused(&with(&punched), &["is not compressed evenly"]);
    let array = &CASE[CASE.find("[electrodes").unwrap()..CASE.find("[mechanics").unwrap()];
    let pair = "[electrodes.in_plane_pair]\ngap = \"1 mm\"\nlength = \"1 mm\"\nthickness = \"50 um\"\nwidth = \"5 mm\"\n\
                height = \"1.5 mm\"\nshear_modulus = \"rigid\"\n";
    refused(&with(&[(array, pair)]), &["does not know what lies within a foam", "common_plate"]);
}
