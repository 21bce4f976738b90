//! Tests of the outlines of extrusions: corners, arcs, splines and rounded corners.

use std::path::Path;

use elastocap_case::{Case, CaseError, Curve, Shape};

/// A conductor extruded along an axis, with these entries of its outline.
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
    let mut radii = Vec::new();
    for arc in &arcs {
        let Curve::Circle { center, radius } = arc.curve else { panic!("{arc:?}") };
        radii.push((radius * 1e9).round() / 1e6);
        for side in arc.sides.clone() {
            let [x, y] = outline[side];
            let distance = (x - center[0]).hypot(y - center[1]);
            assert!((distance / radius - 1.0).abs() < 1e-12);
        }
    }
    assert_eq!(radii, [0.5, 1.0, 2.5]);
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

#[test]
fn outlines_have_splines() {
    let corner = |x: f64, y: f64| format!("[\"{x} mm\", \"{y} mm\"]");
    let spline = |points: &[(f64, f64)], to: (f64, f64)| {
        let points: Vec<String> = points.iter().map(|(x, y)| corner(*x, *y)).collect();
        format!("{{ spline = [{}], to = {} }}", points.join(", "), corner(to.0, to.1))
    };
    let drop = [corner(0.0, 0.0), corner(4.0, 0.0), spline(&[(5.0, 2.0), (3.0, 4.0)], (0.0, 3.0))];
    let Shape::Extrusion { outline, arcs, .. } = case(&drop.join(", ")).unwrap().bodies[0].parts[0].clone()
    else {
        panic!("no extrusion")
    };
    assert_eq!(arcs.len(), 3);
    for arc in &arcs {
        let Curve::Cubic(cubic) = arc.curve else { panic!("{arc:?}") };
        assert_eq!(outline[arc.sides.start], cubic.control[0]);
        assert_eq!(outline[arc.sides.end], cubic.control[3]);
    }
    assert!(outline.iter().any(|[x, y]| (x - 5e-3).abs() + (y - 2e-3).abs() < 1e-15));
    let closed = [spline(&[(5.0, 2.0), (3.0, 4.0)], (0.0, 3.0))];
    assert!(case(&closed[0]).is_ok());
    let (a, b) = (corner(0.0, 0.0), corner(4.0, 0.0));
    for (entries, message) in [
        (
            vec![a.clone(), b.clone(), spline(&[(4.0, 2.0), (4.0, 2.0)], (0.0, 3.0))],
            "points of the spline are one",
        ),
        (vec![a.clone(), b.clone(), spline(&[(4.0, 0.0)], (0.0, 3.0))], "points of the spline are one"),
        (vec![spline(&[(4.0, 0.0)], (0.0, 3.0))], "needs two other points"),
        (vec![a.clone(), b.clone(), spline(&[], (0.0, 3.0))], "one point or more"),
        (vec![a.clone(), b.clone(), spline(&[(2.0, -1.0)], (0.0, 3.0))], "crosses or touches itself"),
        (vec![a.clone(), b.clone(), format!("{{ spline = [{a}] }}")], "`to`"),
        (
            vec![a.clone(), b.clone(), format!("{{ spline = [{a}], through = {a}, to = {b} }}")],
            "write an arc as",
        ),
        (vec![a.clone(), b.clone(), format!("{{ spline = {a}, to = {b} }}")], "spline"),
        (
            vec![a, format!("{{ corner = {b}, radius = \"0.1 mm\" }}"), spline(&[(4.0, 2.0)], (0.0, 3.0))],
            "between two straight sides",
        ),
    ] {
        let error = case(&entries.join(", ")).unwrap_err().to_string();
        assert!(error.contains(message), "{error}");
    }
}
