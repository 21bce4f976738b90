//! Tests of `[mechanics.auto]`: the chosen model of the layer, and the values for what the file leaves out.

use std::path::Path;

use elastocap_case::{Case, CaseError, Indenter, LayerEnd, LayerSide, Mechanics, PlaneStrain, Solid};

fn parse(layer: &str, width: &str, mechanics: &str) -> Result<Case, CaseError> {
    let text = format!(
        r#"
format = 1
[layer]
thickness = "450 um"
relative_permittivity = 2.8
material.neo_hookean = {{ shear_modulus = "90 kPa" }}
{layer}
[electrodes.in_plane_pair]
gap = "50 um"
length = "300 um"
thickness = "20 um"
width = "{width}"
height = "225 um"
shear_modulus = "1 MPa"
[load]
compression = [0.1]
[surroundings]
boundary = "open"
{mechanics}
"#
    );
    elastocap_case::parse(&text, Path::new("test.toml"))
}

fn plane_strain(case: &Case) -> PlaneStrain {
    match case.mechanics {
        Some(Mechanics::PlaneStrain(model)) => model,
        other => panic!("{other:?}"),
    }
}

fn solid(case: &Case) -> Solid {
    match case.mechanics {
        Some(Mechanics::Solid(model)) => model,
        other => panic!("{other:?}"),
    }
}

fn near(value: f64, wanted: f64) {
    assert!((value / wanted - 1.0).abs() < 1e-12, "{value} for {wanted}");
}

#[test]
fn a_rod_along_a_long_pair_is_solved_in_plane_strain_on_a_layer_that_goes_on() {
    let rod = "[mechanics.auto]\nindenter = { cylinder = { radius = \"2 mm\" } }\nwidth = \"40 mm\"";
    let case = parse("", "40 mm", rod).unwrap();
    let model = plane_strain(&case);
    assert_eq!(model.indenter, Indenter::Cylinder { radius: 2e-3, position: 0.0 });
    assert_eq!((model.end, model.width), (LayerEnd::Far, 40e-3));
    // Four thicknesses beyond the largest contact of a rod with a layer that is not pressed through, sqrt(R
    // H).
    near(case.layer.unwrap().half_length.unwrap(), (2e-3f64 * 450e-6).sqrt() + 4.0 * 450e-6);
    let why = case.mechanics_chosen.unwrap();
    assert!(why.starts_with("plane strain is chosen, because"), "{why}");
}

#[test]
fn a_block_that_is_long_along_x3_is_a_punch_in_the_plane_with_its_own_length() {
    let block = "[mechanics.auto]\nindenter = { flat_punch = { half_width = \"0.5 mm\", half_depth = \"10 mm\", corner_radius = \"50 um\" } }";
    let model = plane_strain(&parse("", "19 mm", block).unwrap());
    near(model.width, 20e-3);
    let Indenter::FlatPunch { half_width, contact, .. } = model.indenter else { panic!("{model:?}") };
    assert_eq!((half_width, contact.corner_radius()), (0.5e-3, Some(50e-6)));
}

#[test]
fn what_is_not_long_against_its_own_width_is_solved_in_three_dimensions() {
    let block = |depth: &str| {
        format!(
            "[mechanics.auto]\nindenter = {{ flat_punch = {{ half_width = \"0.5 mm\", half_depth = \"{depth}\", corner_radius = \"50 um\" }} }}"
        )
    };
    // 8 mm are 18 thicknesses of the layer, but only 8 widths of the block.
    let case = parse("", "7 mm", &block("4 mm")).unwrap();
    let model = solid(&case);
    assert_eq!(model.indenter, Indenter::Block { half_widths: [0.5e-3, 4e-3], corner_radius: 50e-6 });
    assert_eq!((model.end, model.side), (LayerEnd::Far, LayerSide::Symmetric));
    near(model.width, 2.0 * (4e-3 + 4.0 * 450e-6));
    // A pair that ends beneath a long block, and one that reaches beyond it.
    solid(&parse("", "500 um", &block("10 mm")).unwrap());
    solid(&parse("", "21 mm", &block("10 mm")).unwrap());
}

#[test]
fn a_ball_is_solved_in_three_dimensions_and_needs_no_width() {
    let ball = "[mechanics.auto]\nindenter = { sphere = { radius = \"3 mm\" } }";
    let case = parse("", "500 um", ball).unwrap();
    assert_eq!(solid(&case).indenter, Indenter::Sphere { radius: 3e-3 });
    let why = case.mechanics_chosen.unwrap();
    assert!(why.contains("a sphere presses"), "{why}");
}

#[test]
fn a_layer_with_a_half_length_ends_there_on_its_substrate() {
    let plate = "[mechanics.auto]\nindenter = \"whole-top\"\nwidth = \"40 mm\"";
    let model = plane_strain(&parse("half_length = \"1.5 mm\"", "38 mm", plate).unwrap());
    assert_eq!((model.indenter, model.end), (Indenter::WholeTop, LayerEnd::FreeOnSubstrate));
    let ended = format!("{plate}\nend = \"free\"");
    assert_eq!(
        plane_strain(&parse("half_length = \"1.5 mm\"", "38 mm", &ended).unwrap()).end,
        LayerEnd::Free
    );
}

#[test]
fn what_presses_has_no_default_and_neither_has_a_width_that_the_force_depends_on() {
    let message = |mechanics: &str| parse("", "500 um", mechanics).unwrap_err().to_string();
    assert!(message("").contains("[load] needs [mechanics.auto]"), "{}", message(""));
    let rod = "[mechanics.auto]\nindenter = { cylinder = { radius = \"2 mm\" } }";
    assert!(message(rod).contains("[mechanics.auto] lacks `width`"), "{}", message(rod));
    let ended = "[mechanics.auto]\nindenter = { sphere = { radius = \"2 mm\" } }\nend = \"free\"";
    assert!(message(ended).contains("[layer] lacks `half_length`"), "{}", message(ended));
    let plate = "[mechanics.auto]\nwidth = \"5 mm\"\nindenter = \"whole-top\"";
    assert!(message(plate).contains("[layer] lacks `half_length`"), "{}", message(plate));
    assert!(message(plate).contains("goes all along x1"), "{}", message(plate));
    let nothing = "[mechanics.auto]\nwidth = \"2 mm\"";
    assert!(message(nothing).contains("lacks `indenter`"), "{}", message(nothing));
}
