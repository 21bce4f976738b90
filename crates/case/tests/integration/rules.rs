//! Tests of the rules between parts of a case file: each changes a valid file in one place and expects one
//! message.

use std::path::Path;

use elastocap_case::{
    self, Box3, Case, CaseError, Extent, Face, HyperelasticLaw, Indenter, LayerEnd, LayerSide, Load,
    Mechanics, PunchContact, Role, Shape, ShearLength, Stiffness, Wall,
};
use elastocap_geometry::scene::Potential;

const LAYERED: &str = r#"
format = 1
title = "pair"
[layer]
thickness = "450 um"
relative_permittivity = 2.8
[layer.material.mooney_rivlin]
c10 = "682.15 Pa"
c01 = "43931.9 Pa"
[electrodes.in_plane_pair]
gap = "50 um"
length = "300 um"
thickness = "20 um"
width = "500 um"
height = "225 um"
shear_modulus = "1 MPa"
[mechanics.closed_form]
contact_half_length = "500 um"
contact_width = "500 um"
shear_length = "500 um"
[load]
compression = [0.3, 0.1]
[surroundings]
boundary = "insulated"
side_margin = "1 mm"
below = "insulated"
above = { relative_permittivity = 1.0, thickness = "1 mm" }
[electrostatics]
relative_tolerance = 1e-3
"#;

const BOXES: &str = r#"
format = 1
[[conductor]]
name = "a"
box = { min = ["0 mm", "0 mm", "0 mm"], max = ["1 mm", "1 mm", "1 mm"] }
[[conductor]]
name = "b"
sheet = { normal = "x3", at = "2 mm", min = ["0 mm", "0 mm"], max = ["1 mm", "1 mm"] }
[[dielectric]]
name = "board"
relative_permittivity = 4.5
slab = { axis = "x2", from = "-1 mm", to = "-0.5 mm" }
[surroundings]
boundary = "grounded"
walls = { min = ["-5 mm", "-5 mm", "-5 mm"], max = ["5 mm", "5 mm", "5 mm"] }
"#;

fn parse(text: &str) -> Result<Case, CaseError> {
    elastocap_case::parse(text, Path::new("cases/test.toml"))
}

fn changed(base: &str, changes: &[(&str, &str)]) -> String {
    changes.iter().fold(base.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "{from:?} is not in the file");
        text.replacen(from, to, 1)
    })
}

fn accepted(base: &str, changes: &[(&str, &str)]) -> Case {
    parse(&changed(base, changes)).unwrap_or_else(|e| panic!("{changes:?}\n{e}"))
}

/// Checks that there is exactly one error, at `at`, with these words in its text.
fn refused(base: &str, changes: &[(&str, &str)], at: &str, words: &[&str]) {
    let text = changed(base, changes);
    let error = parse(&text).expect_err(&text);
    let shown = error.render(false);
    let [diagnostic] = error.diagnostics() else { panic!("one message expected:\n{shown}") };
    let pointed = &text[diagnostic.span.clone().expect("a place")];
    assert!(pointed.starts_with(at), "points at {pointed:?}, not {at:?}:\n{shown}");
    for word in words {
        assert!(shown.contains(word), "{word:?} is not in\n{shown}");
    }
}

#[test]
fn the_two_base_files_are_good() {
    let layered = accepted(LAYERED, &[]);
    assert_eq!(layered.load, Some(Load::Compression(vec![0.3, 0.1])), "the order of the steps is kept");
    let boxes = accepted(BOXES, &[]);
    assert_eq!(boxes.title, "test", "the title is the file's name where none is given");
    let (low, high) = (f64::NEG_INFINITY, f64::INFINITY);
    let slab = Box3 { min: [low, -1e-3, low], max: [high, -0.5e-3, high] };
    assert_eq!(boxes.bodies.last().unwrap().boxes(), Some(vec![slab]));
    assert_eq!(boxes.electrostatics.map(|e| (e.relative_tolerance, e.bounds)), Some((1e-3, true)));
}

#[test]
fn only_tetrahedra_have_an_order_from_1_to_3() {
    let with = |text: &str| BOXES.to_owned() + "[electrostatics]\n" + text;
    let good = accepted(&with("solver = \"tetrahedra\"\norder = 3\n"), &[]);
    assert_eq!(good.electrostatics.and_then(|e| e.order), Some(3));
    for base in [with("order = 2\n"), with("solver = \"boxes\"\norder = 2\n")] {
        refused(&base, &[], "2", &["only the solver on tetrahedra", "solver = \"tetrahedra\""]);
    }
    for order in ["0", "4"] {
        let base = with(&format!("solver = \"tetrahedra\"\norder = {order}\n"));
        refused(&base, &[], order, &["must be 1, 2 or 3"]);
    }
}

#[test]
fn an_absolute_tolerance_is_a_capacitance_above_zero() {
    let with = |value: &str| BOXES.to_owned() + "[electrostatics]\nabsolute_tolerance = " + value + "\n";
    for (value, farads) in [("\"1 aF\"", 1e-18), ("\"0.5 fF\"", 5e-16)] {
        let tolerance = accepted(&with(value), &[]).electrostatics.and_then(|e| e.absolute_tolerance);
        assert!(
            tolerance.is_some_and(|tolerance| (tolerance / farads - 1.0_f64).abs() < 1e-12),
            "{tolerance:?}"
        );
    }
    assert_eq!(accepted(BOXES, &[]).electrostatics.and_then(|e| e.absolute_tolerance), None);
    refused(&with("1e-18"), &[], "1e-18", &["needs a unit"]);
    refused(&with("\"1 V\""), &[], "\"1 V\"", &["expected a capacitance, found a voltage"]);
    refused(
        &with("\"0 fF\""),
        &[],
        "\"0 fF\"",
        &["`absolute_tolerance` in [electrostatics] must be greater than zero"],
    );
}

#[test]
fn a_quantity_says_what_is_wrong_with_it() {
    let at = "thickness = \"450 um\"";
    for (value, words) in [
        ("0.45", &["needs a unit", "\"0.45 um\" (450 nm), \"0.45 mm\" (450 um) or \"0.45 m\" (450 mm)"][..]),
        ("\"450\"", &["needs a unit", "\"450 um\" or \"450 mm\""]),
        ("\"450 microns\"", &["unknown unit `microns`", "`thickness = \"450 um\"`"]),
        ("\"450 UM\"", &["unknown unit `UM`", "`thickness = \"450 um\"`"]),
        ("\"450 parsec\"", &["unknown unit `parsec`", "in m with an SI prefix"]),
        ("\"4,5 um\"", &["the decimal sign is a point", "`thickness = \"4.5 um\"`"]),
        ("\"thick\"", &["expected a length, found \"thick\""]),
        ("\"inf m\"", &["must be a finite number"]),
        ("\"1e400 m\"", &["beyond what elastocap computes", "too large"]),
        ("\"1e10 m\"", &["beyond what elastocap computes", "1 fm to 1 Gm"]),
        ("\"1e-20 m\"", &["beyond what elastocap computes", "too small"]),
        ("\"0 um\"", &["must be greater than zero"]),
        ("\"1 N/m\"", &["expected a length, found a force per length"]),
        ("true", &["expected a length", "this is a boolean"]),
        ("[\"450 um\"]", &["expected a length", "this is an array"]),
        ("1979-05-27", &["this is a date"]),
        ("nan", &["expected a length"]),
    ] {
        refused(LAYERED, &[(at, &format!("thickness = {value}"))], value, words);
    }
}

#[test]
fn a_number_without_a_unit_says_what_is_wrong_with_it() {
    let at = "relative_permittivity = 2.8";
    for (value, words) in [
        ("\"2.8\"", &["a bare number", "`relative_permittivity = 2.8`"][..]),
        ("\"2.8 F/m\"", &["a bare number such as 2.8", "this is a text"]),
        ("-2.8", &["greater than zero", "was `relative_permittivity = 2.8` meant?"]),
        ("0", &["greater than zero"]),
        ("nan", &["must be a finite number"]),
        ("inf", &["must be a finite number"]),
        ("1e13", &["between 1e-12 and 1e12"]),
    ] {
        refused(LAYERED, &[(at, &format!("relative_permittivity = {value}"))], value, words);
    }
    let integer = accepted(LAYERED, &[(at, "relative_permittivity = 3")]);
    assert_eq!(integer.layer.and_then(|l| l.relative_permittivity), Some(3.0));
}

#[test]
fn entries_of_an_array_that_lack_a_unit_are_told_once_with_the_whole_line() {
    refused(
        BOXES,
        &[("min = [\"0 mm\", \"0 mm\", \"0 mm\"]", "min = [0, 0.5, \"0 mm\"]")],
        "0",
        &["needs a unit", "`min = [\"0 mm\", \"0.5 mm\", \"0 mm\"]`"],
    );
    refused(
        LAYERED,
        &[("[0.3, 0.1]", "[\"30 %\", \"10 %\"]")],
        "\"30 %\"",
        &["a bare number", "`compression = [0.3, 0.1]`"],
    );
}

#[test]
fn a_sheet_and_a_box_have_as_many_entries_as_axes() {
    refused(
        BOXES,
        &[("max = [\"1 mm\", \"1 mm\", \"1 mm\"]", "max = [\"1 mm\", \"1 mm\"]")],
        "[\"1 mm\", \"1 mm\"]",
        &["`max` in [conductor.box] must have 3 entries, it has 2"],
    );
    refused(BOXES, &[("normal = \"x3\"", "normal = \"z\"")], "\"z\"", &["expected \"x1\", \"x2\" or \"x3\""]);
}

#[test]
fn loads_are_lists_or_ranges_of_one_kind() {
    let load = |text: &str| [("compression = [0.3, 0.1]", text.to_owned())];
    let steps = |text: &str| {
        let [(from, to)] = load(text);
        accepted(LAYERED, &[(from, &to)]).load.unwrap()
    };
    assert_eq!(
        steps("compression = { from = 0, to = 0.3, points = 4 }"),
        Load::Compression(vec![0.0, 0.1, 0.2, 0.3])
    );
    assert_eq!(steps("compression = { from = 0.2, to = 0.2, points = 1 }"), Load::Compression(vec![0.2]));
    assert_eq!(
        steps("force = { from = \"0.3 N\", to = \"0 N\", points = 3 }"),
        Load::Force(vec![0.3, 0.15, 0.0])
    );
    assert_eq!(steps("force = [\"10 mN\"]"), Load::Force(vec![0.01]));
    for (text, at, words) in [
        ("compression = [0.1, 1.0]", "1.0", &["at least 0 and less than 1"][..]),
        ("compression = [0.1, 40]", "40", &["was `0.4` meant?"]),
        ("compression = [-0.1]", "-0.1", &["at least 0 and less than 1"]),
        ("compression = 0.1", "0.1", &["an array", "`compression = [0.1]`"]),
        ("compression = []", "[]", &["no load steps"]),
        ("force = []", "[]", &["no load steps", "`force = [\"0.1 N\"]`"]),
        ("force = [\"-1 N\"]", "\"-1 N\"", &["must not be negative"]),
        ("force = [\"1 Pa\"]", "\"1 Pa\"", &["expected a force, found a pressure"]),
        ("force = [1]", "1", &["needs a unit", "`force = [\"1 N\"]`"]),
        ("force = \"1 N\"", "\"1 N\"", &["`force = [\"1 N\"]`"]),
        ("compression = { from = 0.0, to = 0.4, points = 0 }", "0", &["between 1 and 100000"]),
        ("compression = { from = 0.0, to = 0.4, points = 1 }", "1", &["`points = 2`"]),
        ("compression = { from = 0.0, to = 0.4, points = 2.5 }", "2.5", &["a whole number"]),
        ("compression = { from = 0.0, to = 0.4, points = 4000000000 }", "4000000000", &["between 1"]),
        ("compression = { from = 0.0, to = 1.0, points = 3 }", "1.0", &["less than 1"]),
        ("compression = { from = 0.0, to = 0.4 }", "{", &["lacks `points`"]),
        ("compression = { from = 0.0, too = 0.4, points = 3 }", "too", &["unknown key `too`", "`to = 0.4`"]),
        ("compression = [0.1]\nforce = [\"1 N\"]", "force", &["both `compression` and `force`"]),
        ("", "[load]", &["lacks one of `compression`, `force` and `steps`"]),
    ] {
        let [(from, to)] = load(text);
        refused(LAYERED, &[(from, &to)], at, words);
    }
}

#[test]
fn words_are_told_apart_from_quantities() {
    let stiffness = |value: &str| [("\"1 MPa\"", value.to_owned())];
    let [(from, to)] = stiffness("\"rigid\"");
    assert_eq!(accepted(LAYERED, &[(from, &to)]).electrodes.unwrap().stiffness, Stiffness::Rigid);
    for (value, words) in [
        ("\"ridgid\"", &["expected \"rigid\", found \"ridgid\"", "`shear_modulus = \"rigid\"`"][..]),
        ("\"stiff\"", &["expected a pressure, found \"stiff\"", "or \"rigid\""]),
        ("\"1 m\"", &["expected a pressure, found a length"]),
        ("1", &["needs a unit"]),
    ] {
        let [(from, to)] = stiffness(value);
        refused(LAYERED, &[(from, &to)], value, words);
    }
    refused(
        LAYERED,
        &[("boundary = \"insulated\"", "boundary = \"isolated\"")],
        "\"isolated\"",
        &["expected \"insulated\", \"grounded\" or \"open\"", "`boundary = \"insulated\"`"],
    );
    refused(
        LAYERED,
        &[("below = \"insulated\"", "below = \"vacuum\"")],
        "\"vacuum\"",
        &["expected \"insulated\" or \"grounded\" or a table"],
    );
    let found = accepted(LAYERED, &[("shear_length = \"500 um\"", "shear_length = \"finite-element\"")]);
    assert!(matches!(
        found.mechanics,
        Some(Mechanics::ClosedForm { shear_length: ShearLength::FiniteElement, .. })
    ));
    refused(
        LAYERED,
        &[("shear_length = \"500 um\"", "shear_length = \"finite-elemnt\"")],
        "\"finite-elemnt\"",
        &["finite-element"],
    );
}

const PRESSED: &str = r#"
format = 1
[layer]
thickness = "1 mm"
half_length = "4 mm"
[layer.material.yeoh]
c10 = "50 kPa"
c20 = "-1 kPa"
bulk_modulus = "1 GPa"
[mechanics.plane_strain]
end = "far"
width = "1 mm"
[mechanics.plane_strain.indenter.flat_punch]
half_width = "1 mm"
corner_radius = "0.1 mm"
[load]
compression = [0.1]
"#;

#[test]
fn what_the_finite_elements_need_is_asked_for() {
    let case = parse(PRESSED).unwrap();
    let layer = case.layer.unwrap();
    assert_eq!(layer.material, Some(HyperelasticLaw::Yeoh { constants: [5e4, -1e3, 0.0] }));
    assert_eq!(layer.bulk_modulus, Some(1e9));
    let ogden = "terms = [{ mu = \"100 kPa\", alpha = 2.0 }, { mu = \"-5 kPa\", alpha = -2.0 }]";
    let ogden = [("yeoh", "ogden"), ("c10 = \"50 kPa\"\nc20 = \"-1 kPa\"", ogden)];
    let text = ogden.iter().fold(PRESSED.to_owned(), |text, (from, to)| text.replacen(from, to, 1));
    let terms = vec![(1e5, 2.0), (-5e3, -2.0)];
    assert_eq!(parse(&text).unwrap().layer.unwrap().material, Some(HyperelasticLaw::Ogden { terms }));

    refused(PRESSED, &[("half_length = \"4 mm\"", "")], "[layer]", &["[layer] lacks `half_length`"]);
    refused(PRESSED, &[("\"0.1 mm\"", "\"1.1 mm\"")], "\"1.1 mm\"", &["larger than half the width"]);
    refused(PRESSED, &[("half_width = \"1 mm\"", "half_width = \"4 mm\"")], "", &["over the end"]);
    refused(
        PRESSED,
        &[("corner_radius", "corner_raduis")],
        "corner_raduis",
        &["unknown key", "corner_radius"],
    );
    refused(
        PRESSED,
        &[("\"far\"", "\"fixed\"")],
        "\"fixed\"",
        &["\"free\", \"free-on-substrate\" or \"far\""],
    );
    refused(PRESSED, &[("flat_punch", "sphere")], "sphere", &["unknown key", "`flat_punch` and `cylinder`"]);
    let bonded = [("corner_radius = \"0.1 mm\"", "corner_radius = \"0.1 mm\"\ncontact = \"bonded\"")];
    refused(PRESSED, &bonded, "\"bonded\"", &["rounded corners cannot be bonded"]);
    let held = [("corner_radius = \"0.1 mm\"", "corner_radius = \"0.1 mm\"\ncontact = \"held\"")];
    refused(PRESSED, &held, "\"held\"", &["held has no rounded corners"]);
    let aside = [("corner_radius = \"0.1 mm\"", "contact = \"held\"\nposition = \"0.5 mm\"")];
    refused(PRESSED, &aside, "\"0.5 mm\"", &["must lie in the middle"]);
    let nothing = ogden[1].1.replace("100 kPa", "1 kPa").replace("-5 kPa", "5 kPa");
    refused(&text, &[(ogden[1].1, &nothing)], "[{", &["not positive"]);
}

const PRESSED_IN_SPACE: &str = r#"
format = 1
[layer]
thickness = "1 mm"
half_length = "4 mm"
[layer.material.neo_hookean]
shear_modulus = "100 kPa"
[mechanics.solid]
end = "free"
width = "3 mm"
[mechanics.solid.indenter.flat_punch]
half_width = "1 mm"
half_depth = "0.8 mm"
corner_radius = "0.2 mm"
[load]
force = ["1 N"]
"#;

#[test]
fn what_the_finite_elements_in_three_dimensions_need_is_asked_for() {
    let model = |text: &str| match parse(text).unwrap().mechanics {
        Some(Mechanics::Solid(model)) => model,
        other => panic!("{other:?}"),
    };
    let found = model(PRESSED_IN_SPACE);
    assert_eq!(found.indenter, Indenter::Block { half_widths: [1e-3, 0.8e-3], corner_radius: 0.2e-3 });
    assert_eq!((found.end, found.side, found.width), (LayerEnd::Free, LayerSide::Free, 3e-3));
    assert_eq!(found.relative_tolerance, 2e-2);
    let (depth, radius) = ("half_depth = \"0.8 mm\"\n", "corner_radius = \"0.2 mm\"\n");
    let long = PRESSED_IN_SPACE.replace(depth, "");
    let held = "contact = \"held\"\n";
    let sharp = long.replace(radius, held);
    let punch = |contact| Indenter::FlatPunch { half_width: 1e-3, contact, position: 0.0 };
    assert_eq!(model(&long).indenter, punch(PunchContact::Smooth { corner_radius: Some(0.2e-3) }));
    assert_eq!(model(&sharp).indenter, punch(PunchContact::Held));
    refused(&sharp, &[(held, "")], "\"1 mm\"", &["needs a `corner_radius`", "`contact = \"held\"`"]);
    let both = format!("{radius}{held}");
    refused(&long, &[(radius, &both)], "\"0.2 mm\"", &["held has no rounded corners"]);
    let sphere = PRESSED_IN_SPACE.replace("flat_punch", "sphere").replace("half_width", "radius");
    let sphere = sphere.replace(depth, "").replace(radius, "");
    assert_eq!(model(&sphere).indenter, Indenter::Sphere { radius: 1e-3 });

    refused(PRESSED_IN_SPACE, &[("half_length = \"4 mm\"", "")], "[layer]", &["[layer] lacks `half_length`"]);
    let short = PRESSED_IN_SPACE.replace("\"4 mm\"", "\"0.9 mm\"");
    assert!(parse(&short).is_ok(), "a block may reach over a free end");
    refused(&short, &[("\"free\"", "\"far\"")], "", &["over the end or the side"]);
    refused(PRESSED_IN_SPACE, &[(radius, "")], "\"0.8 mm\"", &["needs a `corner_radius`"]);
    refused(PRESSED_IN_SPACE, &[("0.2 mm", "0.9 mm")], "\"0.9 mm\"", &["larger than half the depth"]);
    let symmetric = PRESSED_IN_SPACE.replace("\"free\"", "\"free\"\nside = \"symmetric\"");
    refused(&symmetric, &[("0.8 mm", "1.6 mm")], "", &["over the end or the side"]);
    refused(
        PRESSED_IN_SPACE,
        &[("half_width", "position = \"1 mm\"\nhalf_width")],
        "position",
        &["not supported"],
    );
    let bonded = format!("{radius}contact = \"bonded\"\n");
    refused(&long, &[(radius, &bonded)], "\"0.2 mm\"", &["no rounded corners"]);
    refused(&sharp, &[("half_width = \"1 mm\"", "half_width = \"4 mm\"")], "", &["over the end or the side"]);
    refused(&sharp, &[("\"free\"", "\"free\"\nside = \"far\"")], "\"far\"", &["\"free\" or \"symmetric\""]);
}

#[test]
fn an_incompressible_layer_under_a_plate_needs_a_way_out() {
    let punch =
        "[mechanics.plane_strain.indenter.flat_punch]\nhalf_width = \"1 mm\"\ncorner_radius = \"0.1 mm\"\n";
    let plate =
        PRESSED.replace(punch, "").replace("end = \"far\"", "end = \"far\"\nindenter = \"whole-top\"");
    let incompressible = ("bulk_modulus = \"1 GPa\"\n", "");
    let words = ["cannot be pressed over its whole top", "no `bulk_modulus`", "`\"free-on-substrate\"`"];
    refused(&plate, &[incompressible], "\"far\"", &words);
    // Each of the three remedies.
    assert!(parse(&plate).is_ok());
    let cured = |text: &str, from: &str, to: &str| {
        parse(&text.replacen(incompressible.0, "", 1).replacen(from, to, 1))
    };
    assert!(cured(&plate, "\"far\"", "\"free-on-substrate\"").is_ok());
    assert!(cured(PRESSED, "", "").is_ok());

    let plate = plate.replace("plane_strain", "solid");
    let held = plate.replace("end =", "side = \"symmetric\"\nend =");
    refused(&held, &[incompressible], "\"far\"", &[words[0], "`side = \"symmetric\"`"]);
    assert!(parse(&held).is_ok());
    assert!(cured(&plate, "", "").is_ok(), "the sides are free");
}

#[test]
fn the_closed_form_refuses_what_it_has_no_formula_for() {
    let yeoh = [("mooney_rivlin", "yeoh"), ("c01 = \"43931.9 Pa\"\n", "")];
    refused(LAYERED, &yeoh, "", &["[mechanics.closed_form] does not know a Yeoh material"]);
    let bulk = [("c10 =", "bulk_modulus = \"1 GPa\"\nc10 =")];
    refused(LAYERED, &bulk, "\"1 GPa\"", &["does not know a bulk modulus"]);
    let constants = "c10 = \"682.15 Pa\"\nc01 = \"43931.9 Pa\"";
    let gent =
        [("mooney_rivlin", "gent"), (constants, "shear_modulus = \"90 kPa\"\nlimiting_invariant = 30.0")];
    refused(LAYERED, &gent, "", &["[mechanics.closed_form] does not know a Gent material"]);
}

#[test]
fn a_gent_material_has_a_shear_modulus_and_a_limiting_invariant_above_zero() {
    let gent = "shear_modulus = \"90 kPa\"\nlimiting_invariant = 30.0";
    let text = PRESSED.replace("yeoh", "gent").replace("c10 = \"50 kPa\"\nc20 = \"-1 kPa\"", gent);
    let layer = parse(&text).unwrap().layer.unwrap();
    let law = HyperelasticLaw::Gent { shear_modulus: 9e4, limiting_invariant: 30.0 };
    assert_eq!((layer.material, layer.bulk_modulus), (Some(law), Some(1e9)));
    for bad in ["0.0", "-30.0", "1e10"] {
        refused(&text, &[("30.0", bad)], bad, &["greater than 0 and at most 1e9", "I1 - 3"]);
    }
    refused(&text, &[("30.0", "\"30 kPa\"")], "\"30 kPa\"", &["a bare number such as 30.0"]);
    refused(&text, &[("limiting_invariant = 30.0\n", "")], "", &["limiting_invariant"]);
}

#[test]
fn unknown_and_later_keys_are_told_apart() {
    refused(LAYERED, &[("[load]", "[laod]")], "laod", &["unknown key `laod` at the top level", "`load`"]);
    refused(
        LAYERED,
        &[("title", "zzz")],
        "zzz",
        &["unknown key `zzz`", "known keys here: `format`, `title`"],
    );
    // A misspelled key does not stand for a key that is given already.
    let gap = "gap = \"50 um\"";
    refused(
        LAYERED,
        &[(gap, &format!("{gap}\nlenght = \"50 um\""))],
        "lenght",
        &["unknown key `lenght`", "known keys here: `gap`, `length`"],
    );
    refused(BOXES, &[("name = \"a\"", "")], "[[conductor]]", &["[[conductor]] lacks `name`"]);
    refused(BOXES, &[("[[dielectric]]", "[dielectric]")], "[dielectric]", &["`[[dielectric]]`"]);
    refused(
        LAYERED,
        &[("[layer]", "[[layer]]"), ("[layer.material.mooney_rivlin]\n", "")],
        "",
        &["`layer`: expected a table"],
    );
}

#[test]
fn format_must_be_there_and_be_one() {
    refused(BOXES, &[("format = 1", "")], "", &["the top level lacks `format`", "`format = 1`"]);
    refused(BOXES, &[("format = 1", "format = 0")], "0", &["there is no case format 0"]);
    refused(BOXES, &[("format = 1", "format = \"1\"")], "\"1\"", &["the number of the file format"]);
    refused(BOXES, &[("format = 1", "format = 2"), ("walls", "wolls")], "2", &["a newer elastocap"]);
}

#[test]
fn a_load_needs_layer_material_and_mechanics() {
    let mechanics = "[mechanics.closed_form]\ncontact_half_length = \"500 um\"\ncontact_width = \"500 um\"\nshear_length = \"500 um\"\n";
    let material = "[layer.material.mooney_rivlin]\nc10 = \"682.15 Pa\"\nc01 = \"43931.9 Pa\"\n";
    let load = "[load]\ncompression = [0.3, 0.1]\n";
    refused(LAYERED, &[(mechanics, "")], "[load]", &["[load] needs [mechanics.auto]"]);
    refused(LAYERED, &[(material, "")], "[layer]", &["lacks a material, which [load] needs"]);
    refused(LAYERED, &[("shear_modulus = \"1 MPa\"\n", "")], "electrodes", &["lack `shear_modulus`"]);
    let unloaded = accepted(
        LAYERED,
        &[(mechanics, ""), (material, ""), (load, ""), ("shear_modulus = \"1 MPa\"\n", "")],
    );
    assert_eq!(unloaded.load, None);
    assert_eq!(unloaded.electrodes.map(|e| e.stiffness), Some(Stiffness::Rigid));
    let error = parse("format = 1\n[load]\ncompression = [0.1]\n").unwrap_err().render(false);
    assert!(error.contains("[load] needs [layer]") && error.contains("[load] needs [mechanics.auto]"));
}

#[test]
fn a_loaded_layer_alone_needs_nothing_electrostatic() {
    let from = LAYERED.find("[electrodes").unwrap();
    let to = LAYERED.find("[mechanics").unwrap();
    let text = changed(LAYERED, &[(&LAYERED[from..to], ""), ("relative_permittivity = 2.8\n", "")]);
    let case = parse(&text).unwrap();
    assert!(!case.has_conductors());
    assert_eq!((case.surroundings, case.electrostatics), (None, None));
}

#[test]
fn nothing_to_solve_is_refused() {
    refused("format = 1\n[layer]\nthickness = \"1 mm\"\n", &[], "", &["nothing to solve"]);
    refused("format = 1\n", &[], "", &["nothing to solve"]);
}

#[test]
fn a_material_must_be_stiff() {
    let c10 = accepted(LAYERED, &[("682.15 Pa", "0 Pa")]);
    assert_eq!(c10.layer.unwrap().material.unwrap().shear_modulus(), 2.0 * 43931.9);
    refused(
        LAYERED,
        &[("682.15 Pa", "0 Pa"), ("43931.9 Pa", "0 Pa")],
        "\"0 Pa\"",
        &["no stiffness", "zero too"],
    );
    refused(
        LAYERED,
        &[("[electrodes", "[layer.material.neo_hookean]\nshear_modulus = \"1 kPa\"\n[electrodes")],
        "neo_hookean",
        &["[layer.material] has both `mooney_rivlin` and `neo_hookean`"],
    );
}

#[test]
fn electrodes_may_touch_the_faces_of_the_layer_but_not_leave_it() {
    for height in ["10 um", "440 um"] {
        accepted(LAYERED, &[("height = \"225 um\"", &format!("height = \"{height}\""))]);
    }
    refused(
        LAYERED,
        &[("\"225 um\"", "\"9 um\"")],
        "\"9 um\"",
        &["at the bottom", "overshoot by 1 um", "\"10 um\""],
    );
    refused(
        LAYERED,
        &[("thickness = \"20 um\"", "thickness = \"460 um\"")],
        "\"225 um\"",
        &["a layer of at least 460 um"],
    );
    let stacked = [("in_plane_pair", "stacked_pair"), ("gap = \"50 um\"", "gap = \"420 um\"")];
    refused(LAYERED, &stacked, "\"225 um\"", &["height, half the gap and the thickness", "at least 460 um"]);
    accepted(LAYERED, &[stacked[0], ("gap = \"50 um\"", "gap = \"410 um\"")]);
    refused(
        LAYERED,
        &[("\"225 um\"", "\"10 um\""), ("below = \"insulated\"", "below = \"grounded\"")],
        "\"10 um\"",
        &["touches the grounded plane below the layer"],
    );
}

#[test]
fn surroundings_of_a_layer_have_a_margin_exactly_where_they_have_walls() {
    refused(LAYERED, &[("side_margin = \"1 mm\"\n", "")], "[surroundings]", &["lacks `side_margin`"]);
    refused(
        LAYERED,
        &[("boundary = \"insulated\"", "boundary = \"open\"")],
        "\"1 mm\"",
        &["`side_margin`", "open"],
    );
    refused(
        LAYERED,
        &[(
            "side_margin",
            "walls = { min = [\"0 m\", \"0 m\", \"0 m\"], max = [\"1 m\", \"1 m\", \"1 m\"] }\nside_margin",
        )],
        "{ min",
        &["`walls` in [surroundings] has no meaning here"],
    );
    refused(
        LAYERED,
        &[("thickness = \"1 mm\"", "thickness = \"open\"")],
        "\"open\"",
        &["cannot be open where the boundary is not"],
    );
    let below_and_above =
        "below = \"insulated\"\nabove = { relative_permittivity = 1.0, thickness = \"1 mm\" }\n";
    for (boundary, face) in [("insulated", Face::Insulated), ("grounded", Face::Grounded)] {
        let change = format!("boundary = \"{boundary}\"");
        let case = accepted(LAYERED, &[("boundary = \"insulated\"", &change), (below_and_above, "")]);
        let Extent::AroundLayer { below, above, .. } = case.surroundings.unwrap().extent else { panic!() };
        assert_eq!((below, above), (face, face));
    }
    let open = "boundary = \"open\"\nrelative_permittivity = 3.0";
    let case = accepted(
        LAYERED,
        &[("boundary = \"insulated\"\nside_margin = \"1 mm\"", open), (below_and_above, "")],
    );
    let space = Face::Medium { relative_permittivity: 3.0, thickness: None, then: Wall::Open };
    let extent = case.surroundings.unwrap().extent;
    assert_eq!(extent, Extent::AroundLayer { side_margin: None, below: space, above: space });
}

#[test]
fn surroundings_without_a_layer_have_walls_exactly_where_the_boundary_is_not_open() {
    let walls = "walls = { min = [\"-5 mm\", \"-5 mm\", \"-5 mm\"], max = [\"5 mm\", \"5 mm\", \"5 mm\"] }\n";
    refused(BOXES, &[(walls, "")], "[surroundings]", &["lacks `walls`", "`boundary = \"open\"`"]);
    refused(BOXES, &[("\"grounded\"", "\"open\"")], "{ min", &["`walls`", "the boundary is open"]);
    let open = accepted(BOXES, &[("\"grounded\"", "\"open\""), (walls, "")]);
    assert_eq!(open.surroundings.map(|s| (s.boundary, s.extent)), Some((Wall::Open, Extent::Everywhere)));
    refused(BOXES, &[("walls =", "side_margin = \"1 mm\"\nwalls =")], "\"1 mm\"", &["there is no layer"]);
    refused(BOXES, &[("walls =", "below = \"grounded\"\nwalls =")], "\"grounded\"", &["there is no layer"]);
    refused(
        BOXES,
        &[(walls, "walls = { min = [\"5 mm\", \"0 m\", \"0 m\"], max = [\"-5 mm\", \"1 m\", \"1 m\"] }\n")],
        "\"-5 mm\"",
        &["inside-out along x1"],
    );
    let surroundings = BOXES.find("[surroundings]").unwrap();
    refused(&BOXES[..surroundings], &[], "[[conductor]]", &["[[conductor]] needs [surroundings]"]);
}

#[test]
fn bodies_lie_inside_the_walls_and_conductors_do_not_touch_grounded_ones() {
    let at_wall = [("at = \"2 mm\"", "at = \"5 mm\"")];
    refused(BOXES, &at_wall, "{ normal", &["\"b\" touches the grounded wall", "the walls"]);
    accepted(BOXES, &[at_wall[0], ("\"grounded\"", "\"insulated\"")]);
    refused(
        BOXES,
        &[("at = \"2 mm\"", "at = \"6 mm\"")],
        "{ normal",
        &["\"b\" reaches outside the walls along x3"],
    );
    let slab = "slab = { axis = \"x2\", from = \"-1 mm\", to = \"-0.5 mm\" }";
    let wide = "box = { min = [\"-9 mm\", \"-1 mm\", \"-1 mm\"], max = [\"9 mm\", \"-0.5 mm\", \"1 mm\"] }";
    refused(
        BOXES,
        &[(slab, wide)],
        "{ min",
        &["the dielectric \"board\" reaches outside the walls along x1"],
    );
    refused(
        BOXES,
        &[("\"-1 mm\", to = \"-0.5 mm\"", "\"-9 mm\", to = \"-8 mm\"")],
        "{ axis",
        &["outside the walls"],
    );
    refused(
        BOXES,
        &[("to = \"-0.5 mm\"", "to = \"-2 mm\"")],
        "\"-2 mm\"",
        &["inside-out", "`from = \"-2 mm\", to = \"-1 mm\"`"],
    );
}

/// A ball of a radius of 2 mm, and beside it a body of this shape.
fn beside_a_ball(shape: &str) -> String {
    format!(
        "format = 1\n[[conductor]]\nname = \"ball\"\nsphere = {{ center = [\"0 mm\", \"0 mm\", \"0 mm\"], radius = \"2 mm\" }}\n\
         [[conductor]]\nname = \"other\"\n{shape}\n[surroundings]\nboundary = \"open\"\n"
    )
}

#[test]
fn a_conductor_of_any_shape_that_lies_in_another_one_is_refused() {
    let inside = [
        "sphere = { center = [\"0 mm\", \"0 mm\", \"0 mm\"], radius = \"1 mm\" }",
        "sphere = { center = [\"0 mm\", \"0 mm\", \"0 mm\"], radius = \"3 mm\" }",
        "box = { min = [\"1 mm\", \"1 mm\", \"1 mm\"], max = [\"5 mm\", \"5 mm\", \"5 mm\"] }",
        "box = { min = [\"-5 mm\", \"-5 mm\", \"-5 mm\"], max = [\"5 mm\", \"5 mm\", \"5 mm\"] }",
        "sheet = { normal = \"x2\", at = \"0 mm\", min = [\"-1 mm\", \"-1 mm\"], max = [\"1 mm\", \"1 mm\"] }",
        "cylinder = { axis = \"x2\", base = [\"0 mm\", \"1 mm\", \"0 mm\"], radius = \"0.5 mm\", height = \"0 mm\" }",
        "cylinder = { axis = \"x1\", base = [\"0 mm\", \"0 mm\", \"0 mm\"], radius = \"1 mm\", inner_radius = \"0.5 mm\", height = \"9 mm\" }",
        "capsule = { from = [\"9 mm\", \"0 mm\", \"0 mm\"], to = [\"1 mm\", \"0 mm\", \"0 mm\"], radius = \"0.1 mm\" }",
        "extrusion = { axis = \"x3\", from = \"0 mm\", to = \"9 mm\", outline = [[\"0 mm\", \"0 mm\"], [\"9 mm\", \"0 mm\"], [\"0 mm\", \"9 mm\"]] }",
    ];
    for shape in inside {
        let error = parse(&beside_a_ball(shape)).expect_err(shape).render(false);
        assert!(error.contains("\"ball\" and \"other\" touch or overlap"), "{shape}: {error}");
        let one_wire = "[[terminal]]\nname = \"wire\"\nconductors = [\"ball\", \"other\"]\n";
        let joined = parse(&(beside_a_ball(shape) + one_wire));
        assert!(joined.is_ok(), "{shape}: {}", joined.expect_err("refused").render(false));
    }
    // A ball in a tube, and one beside the corner of a box.
    let apart = [
        "cylinder = { axis = \"x2\", base = [\"0 mm\", \"-5 mm\", \"0 mm\"], radius = \"4 mm\", inner_radius = \"3 mm\", height = \"9 mm\" }",
        "box = { min = [\"1.9 mm\", \"1.9 mm\", \"1.9 mm\"], max = [\"5 mm\", \"5 mm\", \"5 mm\"] }",
        "shell = { center = [\"0 mm\", \"0 mm\", \"0 mm\"], radius = \"3 mm\" }",
    ];
    for shape in apart {
        let read = parse(&beside_a_ball(shape));
        assert!(read.is_ok(), "{shape}: {}", read.expect_err("refused").render(false));
    }
}

#[test]
fn conductors_have_names_of_their_own_and_no_common_point() {
    refused(BOXES, &[("name = \"b\"", "name = \"a\"")], "\"a\"", &["\"a\" is used twice", "first used here"]);
    refused(BOXES, &[("name = \"board\"", "name = \"a\"")], "\"a\"", &["\"a\" is used twice"]);
    refused(BOXES, &[("name = \"b\"", "name = \" \"")], "\" \"", &["must be a line of text"]);
    // A mark for the direction of writing would make the name look like another one.
    let turned = r#""b\u202e""#;
    let rule = &["must be a line of text", "change the direction of writing"];
    refused(BOXES, &[("name = \"b\"", &format!("name = {turned}"))], turned, rule);
    refused(BOXES, &[("name = \"b\"", "name = 2")], "2", &["a line of text in quotes", "`name = \"2\"`"]);
    refused(BOXES, &[("at = \"2 mm\"", "at = \"1 mm\"")], "{ normal", &["\"a\" and \"b\" touch or overlap"]);
    refused(
        BOXES,
        &[("max = [\"1 mm\", \"1 mm\", \"1 mm\"]", "max = [\"1 mm\", \"0 mm\", \"1 mm\"]")],
        "\"0 mm\"",
        &["no thickness along x2", "a flat conductor is a sheet: `sheet = { normal = \"x2\", at = \"0 mm\""],
    );
    refused(
        BOXES,
        &[("max = [\"1 mm\", \"1 mm\"] }", "max = [\"1 mm\", \"-1 mm\"] }")],
        "\"-1 mm\"",
        &["the sheet is inside-out along x2"],
    );
    refused(
        BOXES,
        &[(
            "name = \"a\"",
            "name = \"a\"\nsheet = { normal = \"x1\", at = \"9 mm\", min = [\"0 m\", \"0 m\"], max = [\"1 m\", \"1 m\"] }",
        )],
        "box",
        &["both `sheet` and `box`"],
    );
}

#[test]
fn a_conductor_alone_in_insulated_walls_is_refused() {
    let second =
        &BOXES[BOXES.find("[[conductor]]\nname = \"b\"").unwrap()..BOXES.find("[[dielectric]]").unwrap()];
    refused(
        BOXES,
        &[(second, ""), ("\"grounded\"", "\"insulated\"")],
        "{ min",
        &["alone inside insulated walls"],
    );
}

/// Scenes in which the search for a relative error of zero would not end.
#[test]
fn a_body_of_any_shape_or_several_on_one_wire_alone_in_insulated_walls_are_refused() {
    let walls = "[surroundings]\nboundary = \"insulated\"\nwalls = { min = [\"-1 mm\", \"-1 mm\", \"-1 mm\"], max = [\"1 mm\", \"1 mm\", \"1 mm\"] }\n";
    let body = |name: &str, shape: &str| format!("[[conductor]]\nname = \"{name}\"\n{shape}\n");
    let tube = |y: &str| {
        format!(
            "cylinder = {{ axis = \"x2\", base = [\"0 m\", \"{y}\", \"0 m\"], radius = \"100 um\", height = \"50 um\" }}"
        )
    };
    let ball = "sphere = { center = [\"0 m\", \"0 m\", \"0 m\"], radius = \"100 um\" }";
    let cuboid = |x: &str| {
        format!("box = {{ min = [\"{x}\", \"0 m\", \"0 m\"], max = [\"500 um\", \"100 um\", \"100 um\"] }}")
    };
    let wire = "[[terminal]]\nname = \"wire\"\nconductors = [\"a\", \"b\"]\n";
    let alone = |bodies: &str, who: &str| {
        let source = format!("format = 1\n{bodies}{walls}");
        refused(&source, &[], "{ ", &[&format!("\"{who}\" is alone inside insulated walls")]);
    };
    alone(&body("a", &tube("0 m")), "a");
    alone(&body("a", ball), "a");
    let floating = format!("{}charge = \"0 C\"\n", body("b", &tube("200 um")));
    alone(&(body("a", ball) + &floating), "a");
    alone(&(body("a", &tube("0 m")) + &body("b", &tube("100 um")) + wire), "wire");
    alone(&(body("a", &cuboid("0 m")) + &body("b", &cuboid("200 um")) + wire), "wire");
    // On two wires they form a capacitor.
    accepted(&format!("format = 1\n{}{}{walls}", body("a", &tube("0 m")), body("b", &tube("100 um"))), &[]);
}

#[test]
fn a_conductor_with_a_charge_floats() {
    for (text, charge) in [("0 C", 0.0), ("-2.5 pC", -2.5e-12), ("3 uC", 3e-6)] {
        let to = format!("name = \"a\"\ncharge = \"{text}\"");
        let case = accepted(BOXES, &[("name = \"a\"", &to)]);
        let roles: Vec<_> = case.bodies[..2].iter().map(|body| body.role).collect();
        let conductor = |charge| Role::Conductor { potential: Potential::of_charge(charge) };
        assert_eq!(roles, [conductor(Some(charge)), conductor(None)]);
    }
    let a = "name = \"a\"";
    refused(BOXES, &[(a, "name = \"a\"\ncharge = 0")], "0", &["needs a unit", "\"0 C\""]);
    refused(
        BOXES,
        &[(a, "name = \"a\"\ncharge = \"1 V\"")],
        "\"1 V\"",
        &["expected a charge, found a voltage"],
    );
    refused(BOXES, &[(a, "name = \"a\"\ncharge = \"1 coulomb\"")], "\"1 coulomb\"", &["\"1 C\""]);
}

#[test]
fn a_scene_in_which_all_conductors_float_is_refused() {
    let changes = [
        ("name = \"a\"", "name = \"a\"\ncharge = \"1 pC\""),
        ("name = \"b\"", "name = \"b\"\ncharge = \"0 C\""),
    ];
    refused(BOXES, &changes, "\"1 pC\"", &["all conductors float", "leave out `charge`"]);
}

#[test]
fn one_driven_conductor_among_floating_ones_in_insulated_walls_is_refused() {
    let changes = [("name = \"a\"", "name = \"a\"\ncharge = \"0 C\""), ("\"grounded\"", "\"insulated\"")];
    refused(BOXES, &changes, "{ normal", &["\"b\" is alone inside insulated walls"]);
}

#[test]
fn electrodes_have_no_charge_of_their_own() {
    refused(
        LAYERED,
        &[("[electrodes.in_plane_pair]", "[electrodes.in_plane_pair]\ncharge = \"0 C\"")],
        "charge",
        &["unknown key `charge`"],
    );
}

#[test]
fn conductors_beside_a_layer_lie_where_there_is_a_field_and_off_the_layer() {
    let plate = |low: &str, high: &str| {
        format!(
            "[surroundings]\n[[conductor]]\nname = \"plate\"\nbox = {{ min = [\"0 mm\", \"{low}\", \"0 mm\"], max = [\"1 mm\", \"{high}\", \"1 mm\"] }}\n[surroundings2]"
        )
    };
    let with = |low: &str, high: &str| {
        plate(low, high).replacen("[surroundings]\n", "", 1).replace("[surroundings2]", "[surroundings]")
    };
    let change = |low: &str, high: &str| [("[surroundings]", with(low, high))];
    let [(from, to)] = change("0.5 mm", "0.6 mm");
    assert_eq!(accepted(LAYERED, &[(from, &to)]).bodies.len(), 1);
    let board = ("below = \"insulated\"", "below = { relative_permittivity = 4.5, thickness = \"1.6 mm\" }");
    let [(from, to)] = change("-0.5 mm", "-0.1 mm");
    accepted(LAYERED, &[(from, &to), board]);
    for (low, high, words) in [
        ("450 um", "0.6 mm", &["\"plate\" lies on the layer", "`attached = \"layer-top\"`"][..]),
        ("100 um", "200 um", &["reaches into the layer", "x2 = 450 um"]),
        ("-0.1 mm", "0 mm", &["lies where there is no field"]),
        ("-0.2 mm", "-0.1 mm", &["where there is no field", "the plane below"]),
        ("1 mm", "1.5 mm", &["reaches the wall above the layer", "1000 um"]),
    ] {
        let [(from, to)] = change(low, high);
        refused(LAYERED, &[(from, &to)], "{ min", words);
    }
    // The same rules for other shapes, by their bounding boxes.
    let ball = |at: &str| {
        format!(
            "[[conductor]]\nname = \"ball\"\nsphere = {{ center = [\"0 mm\", \"{at}\", \"0 mm\"], radius = \"0.1 mm\" }}\n[surroundings]"
        )
    };
    let found = accepted(LAYERED, &[("[surroundings]", &ball("0.6 mm"))]);
    let names: Vec<&str> = found.bodies.iter().map(|body| body.name.as_str()).collect();
    assert!(names == ["ball"] && !found.has_only_boxes());
    for (at, words) in [
        ("0.5 mm", &["the conductor \"ball\" reaches into the layer", "x2 = 450 um"][..]),
        ("-0.2 mm", &["where there is no field", "the plane below"]),
        ("1.4 mm", &["reaches the wall above the layer", "1000 um"]),
    ] {
        refused(LAYERED, &[("[surroundings]", &ball(at))], "{ center", words);
    }
    let [(from, to)] = change("0.5 mm", "0.6 mm");
    let renamed = to.replace("plate", "electrode-left");
    refused(LAYERED, &[(from, &renamed)], "\"electrode-left\"", &["used twice"]);
}

#[test]
fn toml_that_does_not_parse_points_at_the_place() {
    refused(
        LAYERED,
        &[("\"450 um\"", "450 um")],
        "",
        &["not valid TOML", "`thickness = \"450 um\"`", "cases/test.toml:5"],
    );
    refused(
        LAYERED,
        &[("thickness", "thickness = \"1 mm\"\nthickness")],
        "thickness",
        &["duplicate key", ":6:1"],
    );
    refused(LAYERED, &[("[load]", "[load")], "", &["not valid TOML"]);
}

#[test]
fn independent_problems_are_all_told_in_the_order_of_the_file() {
    let text = changed(
        LAYERED,
        &[
            ("\"450 um\"", "450"),
            ("\"682.15 Pa\"", "\"682.15 m\""),
            ("gap = ", "gapp = "),
            ("[0.3, 0.1]", "[0.3, 1.1]"),
            ("1e-3", "2"),
        ],
    );
    let error = parse(&text).unwrap_err();
    let lines: Vec<_> = error.diagnostics().iter().map(|d| error.line_column(d).unwrap().0).collect();
    assert_eq!(lines, [5, 8, 11, 22, 29], "{error}");
}

#[test]
fn a_flood_of_problems_is_counted_not_printed() {
    let text = format!("format = 1\n[load]\ncompression = [{}]\n", "7, ".repeat(10_000));
    let error = parse(&text).unwrap_err();
    assert!(error.diagnostics().len() <= 50);
    assert!(error.render(false).len() < 100_000);
    let keys: String = (0..1000).map(|k| format!("k{k} = 1\n")).collect();
    let shown = parse(&format!("format = 1\n{keys}")).unwrap_err().render(false);
    assert!(shown.contains("more problems in cases/test.toml"), "{shown}");
}

#[test]
fn a_cylinder_with_an_inner_radius_is_a_tube_and_only_conductors_may_be_without_thickness() {
    let case = |body: &str, radii: &str, height: &str| {
        let dielectric = if body == "dielectric" { "relative_permittivity = 2\n" } else { "" };
        format!(
            "format = 1\n[[conductor]]\nname = \"ball\"\nsphere = {{ center = [\"0 um\", \"90 um\", \"0 um\"], radius = \"9 um\" }}\n\
             [[{body}]]\nname = \"round\"\n{dielectric}cylinder = {{ axis = \"x2\", base = [\"0 um\", \"0 um\", \"0 um\"], {radii}, \
             height = \"{height}\" }}\n[surroundings]\nboundary = \"open\"\n"
        )
    };
    let shape = |text: &str| {
        let case = parse(text).unwrap();
        case.bodies.iter().find(|body| body.name == "round").unwrap().parts[0].clone()
    };
    let (base, solid, hollow) = ([0.0; 3], "radius = \"9 um\"", "radius = \"9 um\", inner_radius = \"4 um\"");
    let disc = Shape::Cylinder { axis: 1, base, radius: 9e-6, height: 0.0 };
    assert_eq!(shape(&case("conductor", solid, "0 um")), disc);
    let ring = Shape::Tube { axis: 1, base, radii: [4e-6, 9e-6], height: 0.0 };
    assert_eq!(shape(&case("conductor", hollow, "0 um")), ring);
    let tube = Shape::Tube { axis: 1, base, radii: [4e-6, 9e-6], height: 1e-6 };
    assert_eq!(shape(&case("dielectric", hollow, "1 um")), tube);
    let inside_out = "radius = \"4 um\", inner_radius = \"4 um\"";
    for (text, words) in [
        (case("dielectric", solid, "0 um"), "a dielectric without thickness has no effect"),
        (case("conductor", inside_out, "1 um"), "`inner_radius` must be less than `radius`"),
        (case("conductor", solid, "-1 um"), "must not be negative"),
    ] {
        let error = parse(&text).unwrap_err();
        assert!(error.to_string().contains(words), "{error}");
    }
}

#[test]
fn a_change_needs_two_load_steps_and_their_bounds() {
    let from = "relative_tolerance = 1e-3";
    let with_change = "relative_tolerance = 1e-3\nchange_tolerance = 0.01";
    let case = accepted(LAYERED, &[(from, with_change)]);
    assert_eq!(case.electrostatics.unwrap().change_tolerance, Some(0.01));
    assert_eq!(accepted(LAYERED, &[]).electrostatics.unwrap().change_tolerance, None);
    let one = [(from, with_change), ("[0.3, 0.1]", "[0.3]")];
    refused(LAYERED, &one, "0.01", &["at least two load steps", "[load] has one step"]);
    let alone = format!("{BOXES}[electrostatics]\nchange_tolerance = 0.01\n");
    refused(&alone, &[], "0.01", &["at least two load steps", "there is no [load]"]);
    let estimated = format!("{with_change}\nbounds = false");
    refused(LAYERED, &[(from, &estimated)], "0.01", &["needs bounds", "`bounds = false`"]);
    for wrong in ["0.0", "1.0", "-0.1"] {
        let with_change = format!("{from}\nchange_tolerance = {wrong}");
        refused(LAYERED, &[(from, &with_change)], wrong, &["greater than 0 and less than 1"]);
    }
}

#[test]
fn a_capsule_has_two_ends_and_a_radius_with_units_and_keeps_to_the_walls() {
    let walls = "[surroundings]\nboundary = \"grounded\"\n\
                 walls = { min = [\"-9 mm\", \"-9 mm\", \"-9 mm\"], max = [\"9 mm\", \"9 mm\", \"9 mm\"] }\n";
    let case = |body: &str, keys: &str| {
        let dielectric = if body == "dielectric" { "relative_permittivity = 2\n" } else { "" };
        format!(
            "format = 1\n[[conductor]]\nname = \"ball\"\nsphere = {{ center = [\"0 mm\", \"5 mm\", \"0 mm\"], radius = \"1 mm\" }}\n\
             [[{body}]]\nname = \"finger\"\n{dielectric}capsule = {{ {keys} }}\n{walls}"
        )
    };
    let good =
        "from = [\"0 mm\", \"0 mm\", \"0 mm\"], to = [\"1 mm\", \"-2 mm\", \"3 mm\"], radius = \"2 mm\"";
    let capsule = Shape::Capsule { from: [0.0; 3], to: [1e-3, -2e-3, 3e-3], radius: 2e-3 };
    for body in ["conductor", "dielectric"] {
        let found = parse(&case(body, good)).unwrap();
        let finger = found.bodies.iter().find(|body| body.name == "finger").unwrap();
        assert_eq!(finger.parts, std::slice::from_ref(&capsule));
        for (from, to, words) in [
            ("\"2 mm\"", "2", "unit"),
            ("\"2 mm\"", "\"2 kPa\"", "length"),
            ("\"2 mm\"", "\"0 mm\"", "greater than zero"),
            (", radius = \"2 mm\"", "", "`radius`"),
            ("to = ", "too = ", "write `to ="),
            ("\"2 mm\"", "\"2 mm\", height = \"1 mm\"", "height"),
            ("\"3 mm\"", "\"7.5 mm\"", "reaches outside the walls along x3"),
        ] {
            assert!(good.contains(from));
            let error = parse(&case(body, &good.replace(from, to))).expect_err(to);
            let shown = error.render(false);
            assert!(shown.contains(words), "{body}: {words} is not in\n{shown}");
        }
    }
    let touching = good.replace("\"3 mm\"", "\"4.5 mm\"").replace("\"2 mm\"", "\"4.5 mm\"");
    let touching = case("conductor", &touching);
    let error = parse(&touching).unwrap_err();
    assert!(error.to_string().contains("\"finger\" touches the grounded wall along x3"), "{error}");
    // A second shape is refused.
    let two = case("conductor", good).replace(
        "capsule",
        "sphere = { center = [\"0 mm\", \"0 mm\", \"0 mm\"], radius = \"1 mm\" }\ncapsule",
    );
    assert!(parse(&two).is_err());
}
