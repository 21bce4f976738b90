//! Tests that the proposals of messages are accepted, and that messages say what is not possible.

use std::path::Path;

use elastocap_case::parse;

/// The printed errors of a case.
fn errors(text: &str) -> String {
    parse(text, Path::new("case.toml")).map_or_else(|error| error.render(false), |_| String::new())
}

fn pressed(bodies: &str, rest: &str) -> String {
    format!(
        "format = 1\n[layer]\nthickness = \"1 mm\"\nhalf_length = \"9 mm\"\nrelative_permittivity = 3.0\n[layer.material.neo_hookean]\n\
         shear_modulus = \"90 kPa\"\n{bodies}{rest}[surroundings]\nboundary = \"open\"\n"
    )
}

const CLOSED_FORM: &str = "[mechanics.closed_form]\ncontact_half_length = \"5 mm\"\ncontact_width = \"5 mm\"\nshear_length = \"5 mm\"\n\
                           [load]\ncompression = [0.1]\n";
const UNDER_BALL: &str = "[mechanics.solid]\nwidth = \"9 mm\"\nend = \"far\"\nindenter = { sphere = { radius = \"5 mm\" } }\n\
                          [load]\ncompression = [0.1]\n";

fn conductor(rest: &str) -> String {
    format!("[[conductor]]\nname = \"body\"\n{rest}\n")
}

#[test]
fn no_key_is_proposed_that_is_refused_there() {
    let ball = conductor("sphere = { center = [\"0 mm\", \"1 mm\", \"0 mm\"], radius = \"0.3 mm\" }");
    let of_ball = errors(&pressed(&ball, CLOSED_FORM));
    assert!(of_ball.contains("reaches into the layer") && of_ball.contains("boxes and sheets"), "{of_ball}");
    assert!(!of_ball.contains("add `attached"), "{of_ball}");
    let sheet = |x2: &str, rest: &str| {
        conductor(&format!(
            "sheet = {{ normal = \"x2\", at = \"{x2}\", min = [\"0 mm\", \"0 mm\"], max = [\"1 mm\", \"1 mm\"] }}\n{rest}"
        ))
    };
    let inside = errors(&pressed(&sheet("0.5 mm", ""), CLOSED_FORM));
    assert!(inside.contains("add `attached = \"layer\"`"), "{inside}");
    assert_eq!(errors(&pressed(&sheet("0.5 mm", "attached = \"layer\""), CLOSED_FORM)), "");
    let moved = CLOSED_FORM
        .replace("compression = [0.1]", "steps = [{ compression = 0.1, shift = [\"1 um\", \"0 um\"] }]");
    assert!(!errors(&pressed(&sheet("0.5 mm", ""), &moved)).contains("add `attached = \"layer\"`"));
    // On a top that does not stay flat.
    let on_top = errors(&pressed(&sheet("1 mm", ""), UNDER_BALL));
    assert!(
        on_top.contains("`attached = \"layer\"` for a sheet") && !on_top.contains("layer-top"),
        "{on_top}"
    );
    assert_eq!(errors(&pressed(&sheet("1 mm", "attached = \"layer\""), UNDER_BALL)), "");
}

#[test]
fn a_ground_plane_without_a_layer_is_a_conductor_on_the_ground() {
    let text = |below: &str| {
        format!(
            "format = 1\n{}[surroundings]\nboundary = \"open\"\n{below}",
            conductor("sphere = { center = [\"0 mm\", \"1 mm\", \"0 mm\"], radius = \"0.3 mm\" }")
        )
    };
    let grounded = errors(&text("below = \"grounded\"\n"));
    assert!(grounded.contains("[[terminal]]") && grounded.contains("`potential = \"ground\"`"), "{grounded}");
    let medium = errors(&text("below = { relative_permittivity = 4.4, thickness = \"1 mm\" }\n"));
    assert!(medium.contains("[[dielectric]]"), "{medium}");
}

#[test]
fn a_file_of_another_kind_is_named_as_what_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let errors_with = |name: &str, content: &str| {
        std::fs::write(folder.path().join(name), content).unwrap();
        let text = format!(
            "format = 1\n{}[surroundings]\nboundary = \"open\"\n",
            conductor(&format!("surface = {{ file = \"{name}\", unit = \"mm\" }}"))
        );
        parse(&text, &folder.path().join("case.toml")).unwrap_err().render(false)
    };
    let stl = errors_with("cube.STL", "solid cube\nendsolid\n");
    assert!(stl.contains("STL is not read here; OBJ is"), "{stl}");
    assert!(errors_with("cube.step", "ISO-10303-21;\n").contains("STEP is not read here"));
    let secret = errors_with("cube.txt", "hunter2\n");
    assert!(secret.contains("no OBJ file") && !secret.contains("hunter2"), "{secret}");
}

#[test]
fn one_mistake_in_a_form_gives_one_message() {
    let text = "format = 1\n[layer]\nthickness = \"1 mm\"\nrelative_permittivity = 3.0\n[electrodes.array]\non = \"layer-top\"\npads = [4, 4]\n\
                size = [\"1 mm\", \"1 mm\"]\npitch = [\"2 mm\", \"2 mm\"]\nthickness = \"35 um\"\n[surroundings]\nboundary = \"insulated\"\n\
                side_margin = \"1 mm\"\n";
    let error = parse(text, Path::new("case.toml")).unwrap_err();
    assert_eq!(error.diagnostics().len(), 1, "{error}");
}

#[test]
fn of_a_line_of_many_names_what_is_near_a_problem_is_shown() {
    let names: Vec<String> = (0..50_000).map(|k| format!("\"name {k}\"")).collect();
    let terminal = format!("[[terminal]]\nname = \"all\"\nconductors = [{}]\n", names.join(", "));
    let text = format!(
        "format = 1\n{}{terminal}[surroundings]\nboundary = \"open\"\n",
        conductor("box = { min = [\"0 mm\", \"0 mm\", \"0 mm\"], max = [\"1 mm\", \"1 mm\", \"1 mm\"] }")
    );
    let errors = errors(&text);
    assert!(
        errors.contains("there is no conductor") && errors.contains("and 49990 more problems"),
        "{errors}"
    );
    // Only the shown part of a line costs time.
    assert!(errors.lines().all(|line| line.len() < 500), "{errors}");
}

#[test]
fn the_grounded_indenter_may_be_listed_on_the_wire_of_the_ground_and_on_no_other() {
    let plate =
        conductor("box = { min = [\"0 mm\", \"2 mm\", \"0 mm\"], max = [\"1 mm\", \"3 mm\", \"1 mm\"] }");
    let other = plate.replace("body", "other").replace("2 mm", "20 mm").replace("3 mm", "21 mm");
    let text = |role: &str, potential: &str| {
        let terminal =
            format!("[[terminal]]\nname = \"wire\"\nconductors = [\"body\", \"indenter\"]\n{potential}");
        pressed(&format!("{plate}{other}{terminal}[indenter]\nrole = \"{role}\"\n"), CLOSED_FORM)
    };
    let ground = "potential = \"ground\"\n";
    assert_eq!(errors(&text("grounded", ground)), "");
    for (role, potential) in [("grounded", ""), ("floating", ground)] {
        let refused = errors(&text(role, potential));
        assert!(refused.contains("the indenter belongs to no wire but that of the ground"), "{refused}");
    }
}
