//! A mesh from Gmsh as the scene of a case: the rules of its keys, and what comes out. `make_msh.py` beside
//! the meshes in the geometry crate writes them.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use elastocap_case::{Case, CaseError, Pose, Shape, Wall};
use elastocap_coupling::outcome::{Missed, Outcome, Status};
use elastocap_coupling::plan::{Options, Plan};
use elastocap_coupling::run::run;
use elastocap_coupling::scene::scene_of;
use elastocap_electrostatics::{Bounded, VACUUM_PERMITTIVITY};
use elastocap_geometry::import::gmsh::mesh_from_path;
use elastocap_geometry::import::obj::Placement;

/// Cube of side 1 in a grounded one of side 2: F per metre of the inner side.
const CUBE_IN_CUBE: f64 = 1.693_552_455_8e-10;
/// Isolated cube: F per metre of its side.
const CUBE: f64 = 7.351_035_848e-11;

const NESTED: &str = r#"
format = 1
[mesh]
file = "boxes-41-ascii.msh"
unit = "mm"
[[conductor]]
name = "cube"
physical = "inner"
[[dielectric]]
name = "bottom"
relative_permittivity = 1.0
physical = "filling"
[surroundings]
boundary = "grounded"
[electrostatics]
solver = "tetrahedra"
relative_tolerance = 0.9
"#;

/// The path of a mesh that data/make_msh.py writes: in the folder `ELASTOCAP_MSH` if it is set, else the
/// stored one.
fn data(name: &str) -> PathBuf {
    let fresh = std::env::var_os("ELASTOCAP_MSH").map(|folder| Path::new(&folder).join(name));
    let stored = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../geometry/tests/data").join(name);
    fresh.filter(|path| path.is_file()).unwrap_or_else(stored)
}

/// Parses a case as if its file were beside the meshes.
fn parse(text: &str) -> Result<Case, CaseError> {
    elastocap_case::parse(text, &data("test.toml"))
}

fn changed(changes: &[(&str, &str)]) -> String {
    changes.iter().fold(NESTED.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "{from:?} is not in the file");
        text.replacen(from, to, 1)
    })
}

fn accepted(changes: &[(&str, &str)]) -> Case {
    parse(&changed(changes)).unwrap_or_else(|e| panic!("{e}"))
}

/// Exactly one message, pointing at `at`, with these words in what is printed.
fn refused(changes: &[(&str, &str)], at: &str, words: &[&str]) {
    let text = changed(changes);
    let error = parse(&text).expect_err(&text);
    let shown = error.render(false);
    let [diagnostic] = error.diagnostics() else { panic!("one message expected:\n{shown}") };
    let pointed = &text[diagnostic.span.clone().expect("a place")];
    assert!(pointed.starts_with(at), "points at {pointed:?}, not {at:?}:\n{shown}");
    for word in words {
        assert!(shown.contains(word), "{word:?} is not in\n{shown}");
    }
}

fn solved(case: &Case) -> Outcome {
    let options = Options { prune: true, fields: false, scene: false, model_error: false };
    let plan = Plan::new(case, &options);
    run(case, &plan, &options, &Arc::new(AtomicBool::new(false)), &())
}

fn matrix(outcome: &Outcome) -> &[Vec<Bounded>] {
    let step = &outcome.steps[0];
    step.maxwell.as_deref().unwrap_or_else(|| panic!("{:?}", step.reason))
}

#[track_caller]
fn assert_holds(bounds: &Bounded, [low, high]: [f64; 2]) {
    assert!(bounds.lower <= high && low <= bounds.upper, "{low:e} to {high:e} is not in {bounds:?}");
}

#[test]
fn what_tetrahedra_take_is_forecast_on_request() {
    let case = parse(NESTED).unwrap();
    let options = Options::default();
    let mut plan = Plan::new(&case, &options);
    assert_eq!((plan.unknowns, plan.memory_bytes), (0, 0));
    plan.forecast(&case, &options);
    assert!(plan.unknowns > 0 && plan.seconds > 0.0);
    assert!(plan.memory_bytes > 0 && plan.memory_bytes <= plan.memory_limit);
}

#[test]
fn both_versions_of_the_format_as_text_and_binary_give_one_capacitance() {
    let names = ["boxes-41-ascii.msh", "boxes-41-binary.msh", "boxes-22-ascii.msh", "boxes-22-binary.msh"];
    let found = names.map(|name| {
        let outcome = solved(&accepted(&[("boxes-41-ascii.msh", name)]));
        assert_eq!(outcome.conductors, ["cube"]);
        let [row] = matrix(&outcome) else { panic!("one conductor") };
        assert_holds(&row[0], [1e-3 * CUBE_IN_CUBE; 2]);
        row[0]
    });
    for other in &found[1..] {
        // On the mesh as it is: the same numbers but for what the iteration leaves.
        assert!((other.upper / found[0].upper - 1.0).abs() < 1e-6, "{found:?}");
        assert!((other.lower / found[0].lower - 1.0).abs() < 1e-6, "{found:?}");
    }
}

#[test]
fn refined_bounds_close_on_the_capacitance_of_the_cube_in_a_cube() {
    let outcome = solved(&accepted(&[("0.9", "1e-2")]));
    assert_eq!(outcome.steps[0].row.status, Status::Ok);
    let found = matrix(&outcome)[0][0];
    assert!(found.upper - found.lower <= 1e-2 * found.value, "{found:?}");
    assert_holds(&found, [1e-3 * CUBE_IN_CUBE; 2]);
    assert!(outcome.plan.warnings.is_empty(), "flat faces are exact: {:?}", outcome.plan.warnings);
}

#[test]
fn the_outer_surface_may_be_a_conductor_and_permittivity_scales() {
    let outer = "[[conductor]]\nname = \"can\"\nphysical = \"outer\"\n[[dielectric]]";
    let changes = [
        ("[[dielectric]]", outer),
        ("1.0", "3.0"),
        ("grounded\"", "insulated\"\nrelative_permittivity = 3.0"),
    ];
    let outcome = solved(&accepted(&changes));
    assert_eq!(outcome.conductors, ["cube", "can"]);
    let pair = outcome.steps[0].measured.unwrap();
    assert_holds(&pair, [3e-3 * CUBE_IN_CUBE; 2]);
    for row in matrix(&outcome) {
        row.iter().for_each(|c| assert_holds(c, [c.value.signum() * 3e-3 * CUBE_IN_CUBE; 2]));
    }
}

#[test]
fn a_group_of_surfaces_inside_the_mesh_is_a_sheet() {
    let case = accepted(&[("inner", "top of inner"), ("0.9", "5e-2")]);
    let mesh = &case.mesh.as_ref().unwrap().tets;
    let volume: f64 = (0..mesh.tets.len()).map(|t| mesh.determinant(t) / 6.0).sum();
    assert!((volume / 8e-9 - 1.0).abs() < 1e-9, "no cell is left out: {volume:e}");
    let found = matrix(&solved(&case))[0][0];
    // More than alone in open space, 0.3667 of 4 pi eps0 times the side; less than the cube of which it is a
    // part.
    let alone = 0.3667 * 4.0 * std::f64::consts::PI * VACUUM_PERMITTIVITY * 1e-3;
    assert!(alone < found.lower && found.upper < 1e-3 * CUBE_IN_CUBE, "{found:?}");
}

#[test]
fn groups_that_are_boxes_are_solved_as_boxes_unless_tetrahedra_are_asked_for() {
    let by_default = ("solver = \"tetrahedra\"\n", "");
    let case = accepted(&[by_default, ("0.9", "1e-4")]);
    assert!(case.has_only_boxes() && case.mesh.is_none(), "{:?}", case.bodies);
    assert_eq!(case.recognised, ["cube", "bottom"]);
    let outcome = solved(&case);
    assert_eq!(outcome.steps[0].row.status, Status::Ok);
    assert_holds(&matrix(&outcome)[0][0], [1e-3 * CUBE_IN_CUBE; 2]);

    let open = solved(&accepted(&[by_default, ("0.9", "1e-3"), ("grounded", "open")]));
    assert_holds(&matrix(&open)[0][0], [1e-3 * CUBE; 2]);

    // A group of surfaces becomes a sheet: both solvers' bounds hold its capacitance.
    let sheet = accepted(&[by_default, ("0.9", "1e-3"), ("inner", "top of inner")]);
    assert!(sheet.has_only_boxes(), "{:?}", sheet.bodies);
    let found = matrix(&solved(&sheet))[0][0];
    let as_given = matrix(&solved(&accepted(&[("0.9", "5e-2"), ("inner", "top of inner")])))[0][0];
    assert!(as_given.lower <= found.upper && found.lower <= as_given.upper, "{found:?} {as_given:?}");
}

#[test]
fn open_outer_faces_bound_the_isolated_cube() {
    let outcome = solved(&accepted(&[("grounded", "open")]));
    assert_holds(&matrix(&outcome)[0][0], [1e-3 * CUBE; 2]);
}

#[test]
fn a_mesh_that_ends_too_near_says_so_instead_of_being_refined_without_end() {
    let outcome = solved(&accepted(&[("grounded", "open"), ("0.9", "2e-3")]));
    let step = &outcome.steps[0];
    assert_eq!(step.row.status, Status::ToleranceNotReached(Missed::Field));
    assert!(
        step.reason.as_ref().unwrap().to_string().contains("ends too near the conductors"),
        "{:?}",
        step.reason
    );
    let found = matrix(&outcome)[0][0];
    assert_holds(&found, [1e-3 * CUBE; 2]);
    assert!(found.upper - found.lower < 2e-2 * found.value, "{found:?}");
}

#[test]
fn polyhedra_in_place_of_spheres_have_a_capacitance_between_those_of_the_spheres_in_and_around_them() {
    let text = NESTED
        .replace("boxes-41-ascii", "shells-41-binary")
        .replace("\"mm\"", "\"2 mm\"")
        .replace("0.9", "2e-2");
    let (head, tail) = text.split_once("[[dielectric]]").unwrap();
    let tail = tail.split_once("[surroundings]").unwrap().1;
    let outer = "[[conductor]]\nname = \"outer\"\nphysical = \"outer\"\n[surroundings]";
    let case = parse(&format!("{head}{outer}{tail}")).unwrap();
    let outcome = solved(&case);
    let found = outcome.steps[0].measured.unwrap();
    assert!(found.upper - found.lower <= 2e-2 * found.value, "{found:?}");
    // The flat faces stand for spheres, and that is not known to 2e-2.
    let row = &outcome.steps[0].row;
    assert_eq!(row.status, Status::ToleranceNotReached(Missed::Geometry));
    assert!((0.02..0.05).contains(&row.geometry_error_estimate.unwrap()), "{row:?}");

    let [warning] = outcome.plan.warnings.as_slice() else { panic!("{:?}", outcome.plan.warnings) };
    assert!(warning.contains("`shells-41-binary.msh`") && warning.contains("about 3e-2"), "{warning}");

    // How near the faces of each group come to the middle, m.
    let mesh = mesh_from_path(&data("shells-41-binary.msh"), Placement { unit: 2e-3, translate: [0.0; 3] })
        .unwrap()
        .0;
    let nearest = |name: &str| {
        let group = 1 + mesh.groups.iter().position(|g| g.name == name).unwrap() as u32;
        let faces = mesh.faces.iter().zip(&mesh.face_groups).filter(|f| *f.1 == group);
        let distance = |face: &[u32; 3]| {
            let [a, b, c] = face.map(|p| mesh.points[p as usize]);
            let (u, v) = ([0, 1, 2].map(|k| b[k] - a[k]), [0, 1, 2].map(|k| c[k] - a[k]));
            let n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
            let dot = |p: [f64; 3], q: [f64; 3]| p.iter().zip(q).map(|(x, y)| x * y).sum::<f64>();
            dot(n, a).abs() / dot(n, n).sqrt()
        };
        faces.map(|(face, _)| distance(face)).fold(f64::INFINITY, f64::min)
    };
    let spheres = |a: f64, b: f64| 4.0 * std::f64::consts::PI * VACUUM_PERMITTIVITY * a * b / (b - a);
    let (inner, outer) = (nearest("inner"), nearest("outer"));
    assert!(1.5e-3 < inner && inner < 2e-3 && 3e-3 < outer && outer < 4e-3, "{inner} {outer}");
    assert_holds(&found, [spheres(inner, 4e-3), spheres(2e-3, outer)]);
    assert!((found.value / spheres(2e-3, 4e-3) - 1.0).abs() < 0.1, "{found:?}");
}

#[test]
fn the_case_says_what_the_mesh_is_and_what_no_body_names() {
    let case = accepted(&[]);
    assert_eq!(case.bodies[0].parts, [Shape::Physical("inner".into())]);
    assert_eq!(scene_of(&case, None, &Pose::default()).unwrap().scene.walls, [[Wall::Grounded; 2]; 3]);
    let mesh = case.mesh.as_ref().unwrap();
    assert_eq!(
        (mesh.file.as_str(), mesh.unnamed.as_slice()),
        ("boxes-41-ascii.msh", &["air".to_owned()][..])
    );
    let longest = mesh.tets.points.iter().flatten().fold(0.0_f64, |most, x| most.max(x.abs()));
    assert!((longest - 1e-3).abs() < 1e-15, "a unit alone is one of it: {longest}");
    let inches = accepted(&[("\"mm\"", "\"25.4 mm\"")]);
    let longest =
        inches.mesh.unwrap().tets.points.iter().flatten().fold(0.0_f64, |most, x| most.max(x.abs()));
    assert!((longest - 25.4e-3).abs() < 1e-15);
    let plan = Plan::new(&case, &Options::default());
    let what = &plan.solved.iter().find(|p| p.part == "mesh").unwrap().what;
    assert!(what.contains("tetrahedra of `boxes-41-ascii.msh`") && what.contains("`air`"), "{what}");
}

#[test]
fn an_unknown_group_is_answered_with_the_nearest_and_with_all() {
    let known = ["\"inner\"", "\"filling\"", "\"air\"", "\"outer\"", "\"top of inner\""];
    refused(
        &[("\"inner\"", "\"iner\"")],
        "\"iner\"",
        &["no physical group \"iner\"", "write `physical = \"inner\"`"],
    );
    refused(&[("\"inner\"", "\"zzz\"")], "\"zzz\"", &known);
    refused(&[("\"filling\"", "\"outer\"")], "\"outer\"", &["a dielectric fills volumes", "\"filling\""]);
}

#[test]
fn a_file_that_is_no_mesh_is_refused_with_its_path_and_the_cause() {
    refused(
        &[("boxes-41-ascii.msh", "none.msh")],
        "\"none.msh\"",
        &["cannot be read", "tests/data/none.msh", "relative to"],
    );
    refused(
        &[("boxes-41-ascii.msh", "cube.obj")],
        "\"cube.obj\"",
        &["OBJ", "name it as the `surface` of a body"],
    );
    refused(
        &[("boxes-41-ascii.msh", "second-order-41-ascii.msh")],
        "\"second-order",
        &["curved elements", "Mesh.ElementOrder = 1"],
    );
    refused(&[("\"mm\"", "\"1e9 m\"")], "\"boxes-41", &["1e-12 m to 1e6 m is allowed"]);
}

#[test]
fn a_unit_is_a_length_or_the_unit_of_one() {
    refused(&[("\"mm\"", "\"milimeter\"")], "\"milimeter\"", &["such as \"mm\""]);
    refused(&[("\"mm\"", "\"N\"")], "\"N\"", &["no unit of length"]);
    refused(&[("\"mm\"", "\"-1 mm\"")], "\"-1 mm\"", &["greater than zero"]);
    refused(&[("\"mm\"", "1.0")], "1.0", &["needs a unit"]);
    refused(&[("unit = \"mm\"\n", "")], "[mesh]", &["[mesh] lacks `unit`", "`unit = "]);
}

#[test]
fn a_mesh_and_its_groups_need_one_another() {
    refused(
        &[("[mesh]\nfile = \"boxes-41-ascii.msh\"\nunit = \"mm\"\n", "")],
        "\"inner\"",
        &["this case has no [mesh]", "`file = \"sensor.msh\"`"],
    );
    let cube = "box = { min = [\"0 mm\", \"0 mm\", \"0 mm\"], max = [\"1 mm\", \"1 mm\", \"1 mm\"] }";
    refused(
        &[("physical = \"inner\"", cube)],
        "{ min",
        &["`box` beside [mesh]", "no body can be added", "Physical Volume"],
    );
    refused(
        &[("physical = \"filling\"", "slab = { axis = \"x1\", from = \"0 mm\", to = \"1 mm\" }")],
        "{ axis",
        &["`slab` beside [mesh]", "leave [mesh] out"],
    );
    refused(
        &[("physical = \"inner\"", &format!("physical = \"inner\"\n{cube}"))],
        "box",
        &["both `physical` and `box`"],
    );
    refused(
        &[
            ("[surroundings]", "[layer]\nthickness = \"1 mm\"\nrelative_permittivity = 2.0\n[surroundings]"),
            ("\"grounded\"", "\"open\""),
        ],
        "[mesh]",
        &["[mesh] beside [layer]", "a volume of the mesh"],
    );
    refused(&[("[mesh]", "[msh]")], "msh", &["unknown key `msh`", "`mesh`"]);
}

#[test]
fn walls_are_those_of_the_mesh() {
    let walls = "\nwalls = { min = [\"0 mm\", \"0 mm\", \"0 mm\"], max = [\"1 mm\", \"1 mm\", \"1 mm\"] }";
    for wall in ["grounded", "open", "insulated"] {
        let boundary = format!("\"{wall}\"{walls}");
        refused(&[("\"grounded\"", &boundary)], "{ min", &["`walls`", "outer faces of [mesh]"]);
    }
}

#[test]
fn conductors_that_touch_are_refused_with_the_place() {
    let second = |group: &str| format!("[[conductor]]\nname = \"b\"\nphysical = \"{group}\"\n[[dielectric]]");
    refused(
        &[("[[dielectric]]", &second("top of inner"))],
        "\"top of inner\"",
        &["\"cube\" and \"b\" touch", "at ("],
    );
    refused(
        &[("[[dielectric]]", &second("inner"))],
        "\"inner\"",
        &["the same physical group", "first used here"],
    );
    refused(&[("\"inner\"", "\"air\"")], "\"air\"", &["touches a grounded wall", "make the wall insulated"]);
}

#[test]
fn a_conductor_whose_flux_can_end_nowhere_is_refused() {
    refused(
        &[("grounded", "insulated")],
        "\"inner\"",
        &["alone inside insulated walls", "\"open\" or \"grounded\""],
    );
    refused(
        &[("physical = \"inner\"", "physical = \"inner\"\ncharge = \"0 C\"")],
        "\"inner\"",
        &["all conductors float"],
    );
}

#[test]
fn the_schema_knows_the_keys_of_a_mesh() {
    let validator = jsonschema::validator_for(&elastocap_case::json_schema()).unwrap();
    let valid = |changes: &[(&str, &str)]| {
        validator.is_valid(&serde_json::to_value(changed(changes).parse::<toml::Table>().unwrap()).unwrap())
    };
    assert!(valid(&[]) && valid(&[("\"mm\"", "\"25.4 mm\"")]));
    assert!(!valid(&[("\"mm\"", "\"N\"")]) && !valid(&[("\"mm\"", "\"-1 mm\"")]));
    assert!(!valid(&[("unit = \"mm\"", "")]) && !valid(&[("physical = \"inner\"", "physical = 1")]));
    assert!(!valid(&[("physical = \"inner\"", "")]));
}
