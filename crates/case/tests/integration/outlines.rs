//! Outlines of extrusions: corners, arcs and rounded corners.

use std::path::Path;

use elastocap_case::{Case, CaseError, Shape};

/// A conductor pulled along an axis, with the entries of its outline.
fn case(outline: &str) -> Result<Case, CaseError> {
    let text = format!(
        "format = 1\n[[conductor]]\nname = \"x\"\nextrusion = {{ axis = \"x2\", from = \"0 um\", to = \"9 um\", outline = \
         [{outline}] }}\n[surroundings]\nboundary = \"open\"\n"
    );
    elastocap_case::parse(&text, Path::new("cases/test.toml"))
}

#[test]
fn outlines_that_cross_or_touch_themselves_are_refused() {
    let corner = |x: i32, y: i32| format!("[\"{x} um\", \"{y} um\"]");
    let outline =
        |corners: &[(i32, i32)]| corners.iter().map(|&(x, y)| corner(x, y)).collect::<Vec<_>>().join(", ");
    assert!(case(&outline(&[(0, 0), (9, 0), (9, 9), (0, 9)])).is_ok());
    for crossing in [
        &[(0, 0), (9, 9), (9, 0), (0, 9)][..],
        &[(0, 0), (9, 0), (4, 0), (4, 9)],
        &[(0, 0), (9, 0), (9, 9), (5, 0), (0, 9)],
    ] {
        let error = case(&outline(crossing)).unwrap_err();
        assert!(error.to_string().contains("the outline crosses or touches itself"), "{error}");
    }
}

#[test]
fn outlines_have_arcs_and_rounded_corners() {
    let corner = |x: f64, y: f64| format!("[\"{x} mm\", \"{y} mm\"]");
    let arc = |x: f64, y: f64, to: (f64, f64)| {
        format!("{{ through = {}, to = {} }}", corner(x, y), corner(to.0, to.1))
    };
    let rounded =
        |x: f64, y: f64, radius: f64| format!("{{ corner = {}, radius = \"{radius} mm\" }}", corner(x, y));
    let pad = [rounded(0.0, 0.0, 0.5), rounded(4.0, 0.0, 1.0), corner(4.0, 3.0), arc(2.0, 4.0, (0.0, 3.0))];
    let Shape::Extrusion { outline, arcs, .. } = case(&pad.join(", ")).unwrap().bodies[0].parts[0].clone()
    else {
        panic!("no extrusion")
    };
    let radii: Vec<f64> = arcs.iter().map(|arc| (arc.radius * 1e9).round() / 1e6).collect();
    assert_eq!(radii, [0.5, 1.0, 2.5]);
    for arc in &arcs {
        for side in arc.sides.clone() {
            let [x, y] = outline[side];
            let distance = (x - arc.center[0]).hypot(y - arc.center[1]);
            assert!((distance / arc.radius - 1.0).abs() < 1e-12);
        }
    }
    let (a, b, c) = (corner(0.0, 0.0), corner(4.0, 0.0), corner(4.0, 3.0));
    let place = "write an arc as";
    for (entries, message) in [
        (vec![a.clone(), b.clone(), arc(4.0, 1.0, (4.0, 3.0))], "the arc has no circle"),
        (vec![a.clone(), rounded(4.0, 0.0, 9.0), c.clone()], "too short for this rounding"),
        (vec![a.clone(), rounded(4.0, 0.0, 0.1), arc(5.0, 1.0, (4.0, 3.0))], "between two straight sides"),
        (vec![a.clone(), rounded(2.0, 0.0, 0.1), b.clone(), c.clone()], "cannot be rounded"),
        (vec![a.clone(), b.clone(), arc(2.0, -1.0, (0.0, 3.0))], "crosses or touches itself"),
        (vec![a.clone(), format!("{{ to = {b} }}"), c.clone()], place),
        (vec![a.clone(), format!("{{ corner = {b} }}"), c.clone()], place),
        (vec![a.clone(), format!("{{ corner = {b}, to = {b} }}"), c.clone()], "`corner`"),
        (vec![a.clone(), "{ }".to_owned(), c.clone()], "`corner`"),
        (vec![a, rounded(4.0, 0.0, -1.0), c], "radius"),
    ] {
        let error = case(&entries.join(", ")).unwrap_err().to_string();
        assert!(error.contains(message), "{error}");
    }
}
