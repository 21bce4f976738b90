//! Tests of the page of a run.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use elastocap_case::{Case, Measurement};
use elastocap_coupling::outcome::Outcome;
use elastocap_coupling::plan::{Options, Plan};
use elastocap_coupling::run::run;
use serde_json::Value;

use super::{MeasuredPoint, Report};
use crate::{FieldFiles, RunSeconds, scene_files};

fn pressed() -> (Case, Outcome) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../cases/in-plane-pair.toml");
    let case = elastocap_case::load(&path).unwrap();
    let options = Options { prune: true, fields: false, scene: true, model_error: false };
    let plan = Plan::new(&case, &options);
    let outcome = run(&case, &plan, &options, &Arc::new(AtomicBool::new(false)), &());
    (case, outcome)
}

fn page(case: &Case, outcome: &Outcome, text: &str, command: &str, measured: &[MeasuredPoint]) -> String {
    let report = Report {
        case,
        outcome,
        fields: &FieldFiles::default(),
        warnings: &["a <warning>".to_owned()],
        seconds: RunSeconds::default(),
        files: &["curve.csv".to_owned()],
        shown: &scene_files::shown(case, &outcome.steps),
        case_text: Some(text),
        command: Some(command),
        measured,
    };
    report.html()
}

/// The data that the page's scripts read.
fn data(page: &str) -> Value {
    let (_, rest) = page.split_once("id=\"data\">").unwrap();
    serde_json::from_str(rest.split_once("</script>").unwrap().0).unwrap()
}

#[test]
fn hostile_texts_stay_texts_wherever_they_stand() {
    let (mut case, mut outcome) = pressed();
    // A mutual capacitance puts the names into the legend of the chart, which a script reads.
    outcome.measurement = Some(Measurement::Mutual([0, 1]));
    let honest = page(&case, &outcome, "text", "command", &[]);
    let hostile =
        "</script></style></title></textarea><script>alert('x')</script><img src=x onerror=\"alert(1)\"><!--";
    case.title = hostile.to_owned();
    case.source = Path::new(hostile).to_owned();
    for name in &mut outcome.conductors {
        name.push_str(hostile);
    }
    for part in &mut outcome.plan.left_out {
        part.what = hostile.to_owned();
    }
    outcome.steps[1].warnings.push(hostile.to_owned());
    let attacked = page(&case, &outcome, hostile, hostile, &[]);
    for tag in ["<script", "</script", "<style", "</style", "<title", "</title", "<img", "<!--", "onerror=\""]
    {
        let count = |page: &str| page.matches(tag).count();
        assert_eq!(count(&attacked), count(&honest), "{tag}");
    }
    assert!(attacked.matches("&lt;img src=x").count() >= 7);
    assert!(honest.contains("<li>a &lt;warning&gt;</li>"));
    // The scripts read the names unescaped.
    assert!(data(&attacked).to_string().contains("onerror"));
}

/// Two pads on the substrate, and a wider one on the layer, which is pressed all over.
fn pressed_matrix() -> (Case, Outcome) {
    let text = r#"
        format = 1
        title = "matrix"
        [layer]
        thickness = "1 mm"
        relative_permittivity = 3.0
        material.neo_hookean = { shear_modulus = "50 kPa" }
        [[conductor]]
        name = "left"
        sheet = { normal = "x2", at = "0 mm", min = ["-3 mm", "-1 mm"], max = ["-1 mm", "1 mm"] }
        [[conductor]]
        name = "right"
        sheet = { normal = "x2", at = "0 mm", min = ["1 mm", "-1 mm"], max = ["2 mm", "1 mm"] }
        [[conductor]]
        name = "top"
        attached = "layer-top"
        sheet = { normal = "x2", at = "1 mm", min = ["-3 mm", "-1 mm"], max = ["2 mm", "1 mm"] }
        [mechanics.closed_form]
        contact_half_length = "4 mm"
        contact_width = "8 mm"
        shear_length = "4 mm"
        [load]
        compression = [0.0, 0.2]
        [surroundings]
        boundary = "open"
        [electrostatics]
        relative_tolerance = 2e-2
    "#;
    let case = elastocap_case::parse(text, Path::new("matrix.toml")).unwrap();
    let options = Options { prune: true, fields: false, scene: true, model_error: false };
    let plan = Plan::new(&case, &options);
    let outcome = run(&case, &plan, &options, &Arc::new(AtomicBool::new(false)), &());
    (case, outcome)
}

/// The sentence at the head of a page, and its figures.
fn lead(page: &str) -> &str {
    let (_, rest) = page.split_once("<p class=\"lead\">").unwrap();
    rest.split_once("</dl>").unwrap().0
}

#[test]
fn the_headline_of_a_matrix_is_about_the_pair_with_the_largest_certain_change_or_names_no_direction() {
    let (case, mut outcome) = pressed_matrix();
    let page_of = |outcome: &Outcome| page(&case, outcome, "", "", &[]);
    let found = page_of(&outcome);
    let head = lead(&found);
    // The larger pad is nearer to the top by the thinner layer; the curve is of the two pads.
    assert!(head.starts_with("The mutual capacitance of left and top is "), "{head}");
    assert!(head.contains(": it rises by ") && head.contains("Of all 3 capacitances"), "{head}");
    assert!(head.contains("The curve and its table are of left and right."), "{head}");
    for step in &mut outcome.steps {
        let row = &mut step.row;
        [row.change_lower_f, row.change_upper_f] = [Some(-1e-12), Some(1e-12)];
        for entry in step.maxwell.iter_mut().flatten().flatten() {
            let wide = 0.5 * entry.value.abs();
            (entry.lower, entry.upper) = (entry.value - wide, entry.value + wide);
        }
    }
    let found = page_of(&outcome);
    let head = lead(&found);
    assert!(head.contains("Of none of the 3 capacitances is it known"), "{head}");
    assert!(!head.contains("it rises by") && !head.contains("it falls by"), "{head}");
    assert!(head.contains("its sign is not known"), "{head}");
}

#[test]
fn a_sensitivity_whose_error_is_larger_than_itself_is_a_range_without_a_sign() {
    let (case, mut outcome) = pressed();
    let with_error = |outcome: &mut Outcome, share: f64| {
        for row in outcome.steps.iter_mut().map(|step| &mut step.row) {
            row.sensitivity_error_f_per_n = row.sensitivity_f_per_n.map(|slope| share * slope.abs());
        }
        let page = page(&case, outcome, "", "", &[]);
        lead(&page).split_once("<dt>Sensitivity</dt>").unwrap().1.to_owned()
    };
    let signed = with_error(&mut outcome, 0.5);
    assert!(signed.contains('\u{b1}') && !signed.contains("not known"), "{signed}");
    let open = with_error(&mut outcome, 1.5);
    assert!(open.contains("so that its sign is not known") && open.contains(" to "), "{open}");
}

#[test]
fn the_bodies_of_the_view_that_go_on_are_named() {
    let (case, outcome) = pressed_matrix();
    let drawn = data(&page(&case, &outcome, "", "", &[]));
    assert_eq!(drawn["scene"]["notes"][0], "Shown in part: layer, substrate, cover, which go on.");
}

#[test]
fn measured_points_are_drawn_over_the_curve_with_what_they_may_be_wrong_by() {
    let (case, outcome) = pressed();
    let points = [
        MeasuredPoint { force_n: 0.0, capacitance_f: 44.1e-15, deviation_f: Some(0.2e-15) },
        MeasuredPoint { force_n: 0.1, capacitance_f: 38.2e-15, deviation_f: None },
    ];
    let drawn = data(&page(&case, &outcome, "", "", &points));
    let curve =
        drawn["charts"].as_array().unwrap().iter().find(|chart| chart["id"] == "curve-chart").unwrap();
    let measured = curve["series"].as_array().unwrap().last().unwrap();
    assert_eq!((&measured["name"], &measured["style"]), (&"measured".into(), &"points".into()));
    assert_eq!(measured["y"], serde_json::json!([44.1e-15, 38.2e-15]));
    assert_eq!(measured["upper"], serde_json::json!([44.1e-15 + 0.2e-15, 38.2e-15]));
    let without = data(&page(&case, &outcome, "", "", &[]));
    assert_eq!(without["charts"][0]["series"].as_array().map(Vec::len), Some(2));
}

#[test]
fn a_shifted_step_is_a_point_beside_the_line_and_is_named_by_what_is_shifted() {
    let (case, mut outcome) = pressed();
    outcome.plan.steps[5].pose.shift = [0.0, 1e-4];
    let page = page(&case, &outcome, "", "", &[]);
    let shown = "shift 100\u{a0}\u{b5}m along x3";
    assert!(page.contains(&format!("5: U/H = 0.4, {shown}<")), "{page}");
    let drawn = data(&page);
    for (chart, styles) in [(0, &["line", "dashed", "points"][..]), (1, &["line", "points"])] {
        let series = drawn["charts"][chart]["series"].as_array().unwrap();
        let found: Vec<&str> = series.iter().filter_map(|one| one["style"].as_str()).collect();
        assert_eq!(found, styles);
        assert_eq!(series[0]["x"].as_array().map(Vec::len), Some(5));
        let beside = series.last().unwrap();
        assert_eq!((beside["name"].as_str(), beside["x"].as_array().map(Vec::len)), (Some(shown), Some(1)));
    }
}

#[test]
fn nothing_is_fetched_from_anywhere() {
    let (case, outcome) = pressed();
    let page = page(&case, &outcome, "", "", &[]);
    assert!(page.contains("default-src 'none'"));
    for loading in ["<link", "<iframe", "src=\"http", "href=\"http", "@import", "url("] {
        assert!(!page.contains(loading), "{loading}");
    }
}
