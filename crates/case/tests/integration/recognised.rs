//! Tests of bodies that the file gives as surfaces or outlines and that consist of boxes.

use std::path::Path;

use elastocap_case::{Box3, Case, CaseError, Shape};

/// Two L-shaped pads side by side between walls, and the rest of the file.
fn pads(second_from: &str, rest: &str) -> String {
    let pad = |name: &str, [a, b, c]: [&str; 3]| {
        format!(
            "[[conductor]]\nname = \"{name}\"\nextrusion = {{ axis = \"x2\", from = \"0 um\", to = \"5 um\", outline = \
             [[\"{a} um\", \"0 um\"], [\"{c} um\", \"0 um\"], [\"{c} um\", \"10 um\"], [\"{b} um\", \"10 um\"], [\"{b} um\", \
             \"30 um\"], [\"{a} um\", \"30 um\"]] }}\n"
        )
    };
    format!(
        "format = 1\n{}{}[surroundings]\nboundary = \"insulated\"\nwalls = {{ min = [\"-50 um\", \"0 um\", \"-50 um\"], max = \
         [\"150 um\", \"50 um\", \"50 um\"] }}\n{rest}",
        pad("left", ["0", "10", "30"]),
        pad("right", [second_from, "50", "70"])
    )
}

fn parse(text: &str) -> Result<Case, CaseError> {
    elastocap_case::parse(text, Path::new("cases/test.toml"))
}

fn accepted(text: &str) -> Case {
    parse(text).unwrap_or_else(|error| panic!("{text}\n{}", error.render(false)))
}

#[test]
fn outlines_with_right_angles_become_boxes_and_keep_their_names() {
    for rest in ["", "[electrostatics]\nsolver = \"boxes\"\n"] {
        let case = accepted(&pads("40", rest));
        assert!(case.has_only_boxes() && case.recognised == ["left", "right"], "{:?}", case.recognised);
        let boxes: Vec<_> = case.bodies.iter().map(|body| body.boxes().unwrap().len()).collect();
        assert_eq!(boxes, [2, 2]);
        assert_eq!(case.driven_terminals(), ["left", "right"]);
    }
}

#[test]
fn bodies_stay_as_they_are_given_where_tetrahedra_or_their_order_are_asked_for() {
    for settings in ["solver = \"tetrahedra\"", "order = 2", "solver = \"tetrahedra\"\norder = 1"] {
        let case = accepted(&pads("40", &format!("[electrostatics]\n{settings}\n")));
        assert!(case.recognised.is_empty() && !case.has_only_boxes(), "{settings}");
        assert!(matches!(case.bodies[0].parts[0], Shape::Extrusion { .. }));
    }
}

#[test]
fn a_cube_from_an_obj_file_is_one_box_and_stays_a_surface_where_tetrahedra_are_asked_for() {
    let path =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/acceptance/imported-cube-in-cube.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    let case = elastocap_case::parse(&text, &path).unwrap_or_else(|error| panic!("{}", error.render(false)));
    assert_eq!(case.bodies[0].boxes(), Some(vec![Box3 { min: [-0.5; 3], max: [0.5; 3] }]));
    assert_eq!(case.recognised, ["inner"]);
    let text = text.replace("[electrostatics]\n", "[electrostatics]\nsolver = \"tetrahedra\"\n");
    let case = elastocap_case::parse(&text, &path).unwrap_or_else(|error| panic!("{}", error.render(false)));
    let Shape::Surface(surface) = &case.bodies[0].parts[0] else { panic!("no surface") };
    assert_eq!((surface.points.len(), surface.faces.len()), (8, 12));
}

#[test]
fn conductors_that_touch_each_other_are_left_to_the_mesher_which_refuses_them() {
    let case = accepted(&pads("30", ""));
    assert!(case.recognised.is_empty() && !case.has_only_boxes());
}

#[test]
fn one_body_of_another_shape_keeps_all_as_they_are_given() {
    let ball = "[[conductor]]\nname = \"ball\"\nsphere = { center = [\"100 um\", \"25 um\", \"0 um\"], radius = \"9 um\" }\n";
    let with_ball = |rest: &str| pads("40", &format!("{rest}{ball}"));
    let case = accepted(&with_ball(""));
    assert!(case.recognised.is_empty() && case.bodies.iter().all(|body| body.boxes().is_none()));
    let refused = parse(&with_ball("[electrostatics]\nsolver = \"boxes\"\n")).unwrap_err().render(false);
    assert!(refused.contains("the solver for boxes cannot take bodies of other shapes"), "{refused}");
}

#[test]
fn an_outline_with_very_many_steps_stays_as_it_is_given() {
    let steps = |n: usize| {
        let height = |k: usize| k % 7 + 1;
        let mut corners = vec![[0, 0], [n, 0]];
        for k in (0..n).rev() {
            corners.extend([[k + 1, height(k) * n + k], [k, height(k) * n + k]]);
        }
        let corners: Vec<_> = corners.iter().map(|[x, y]| format!("[\"{x} um\", \"{y} um\"]")).collect();
        format!(
            "format = 1\n[[conductor]]\nname = \"stairs\"\nextrusion = {{ axis = \"x2\", from = \"0 um\", to = \"5 um\", outline = \
             [{}] }}\n[surroundings]\nboundary = \"open\"\n",
            corners.join(", ")
        )
    };
    assert!(accepted(&steps(20)).has_only_boxes());
    assert!(!accepted(&steps(200)).has_only_boxes());
}

#[test]
fn unions_of_boxes_far_apart_in_open_space_stay_as_they_are_given_at_loose_tolerances_only() {
    let far = |tolerance: &str, from: &str| {
        pads("40", &format!("[electrostatics]\nrelative_tolerance = {tolerance}\n"))
            .replace("walls = { min = [\"-50 um\", \"0 um\", \"-50 um\"], max = [\"150 um\", \"50 um\", \"50 um\"] }\n", "")
            .replace("insulated", "open")
            .replace("\"0 um\", to = \"5 um\"", &format!("\"{from} um\", to = \"5 um\""))
            .replacen(&format!("\"{from} um\""), "\"-60 um\"", 1)
            .replacen("to = \"5 um\"", "to = \"-55 um\"", 1)
    };
    let by_boxes = "5e-2\nsolver = \"boxes\"";
    for (tolerance, from, recognised) in
        [("5e-2", "0", false), (by_boxes, "0", true), ("1e-2", "0", true), ("5e-2", "-30", true)]
    {
        let case = accepted(&far(tolerance, from));
        assert_eq!(case.has_only_boxes(), recognised, "{tolerance}, {from}: {:?}", case.bodies);
    }
}

/// A surface in OBJ between two copies of a polygon.
fn prism(corners: &[[f64; 2]]) -> String {
    let n = corners.len();
    let at = |y: f64| corners.iter().map(move |[x, z]| format!("v {x} {y} {z}\n"));
    let sides = (0..n).map(|k| {
        let [a, b] = [k + 1, (k + 1) % n + 1];
        format!("f {a} {} {} {b}\n", a + n, b + n)
    });
    let list = |order: &mut dyn Iterator<Item = usize>| order.map(|k| format!(" {k}")).collect::<String>();
    let ends = format!("f{}\nf{}\n", list(&mut (1..=n)), list(&mut (n + 1..=2 * n).rev()));
    at(0.0).chain(at(0.25)).chain(sides).collect::<String>() + &ends
}

#[test]
fn surfaces_that_are_polygons_pulled_along_an_axis_become_extrusions_where_all_bodies_are_outlines() {
    let folder = tempfile::tempdir().unwrap();
    let hexagon = [[2.0, 0.0], [1.0, 1.5], [-1.0, 1.5], [-2.0, 0.0], [-1.0, -1.5], [1.0, -1.5]];
    std::fs::write(folder.path().join("hexagon.obj"), prism(&hexagon)).unwrap();
    let case = |rest: &str| {
        let text = format!(
            "format = 1\n[[conductor]]\nname = \"pad\"\nsurface = {{ file = \"hexagon.obj\", unit = \"mm\" }}\n{rest}\
             [surroundings]\nboundary = \"open\"\n"
        );
        let case = elastocap_case::parse(&text, &folder.path().join("case.toml"));
        case.unwrap_or_else(|error| panic!("{}", error.render(false)))
    };
    let disc = "[[conductor]]\nname = \"disc\"\ncylinder = { axis = \"x2\", base = [\"0 mm\", \"1 mm\", \"0 mm\"], radius = \"2 mm\", \
                height = \"0 mm\" }\n";
    let found = case(disc);
    assert_eq!(found.recognised, ["pad"]);
    let Shape::Extrusion { axis: 1, from, to, outline, arcs } = &found.bodies[0].parts[0] else {
        panic!("{:?}", found.bodies[0].parts)
    };
    assert_eq!((*from, *to, outline.len(), arcs.len()), (0.0, 0.25e-3, 6, 0));
    let ball = "[[conductor]]\nname = \"ball\"\nsphere = { center = [\"0 mm\", \"3 mm\", \"0 mm\"], radius = \"1 mm\" }\n";
    let upright = disc.replace("x2", "x3");
    for rest in [ball, &upright, &format!("{disc}[electrostatics]\nsolver = \"tetrahedra\"\n")] {
        let found = case(rest);
        assert!(found.recognised.is_empty(), "{rest}");
        assert!(matches!(found.bodies[0].parts[0], Shape::Surface(_)), "{rest}");
    }
}
