//! Tests of the models of results.

use elastocap_circuits::Model;
use elastocap_circuits::model::{Content, Settings};
use serde_json::json;

use crate::results::{matrix, pair, read, read_matrix};

#[test]
fn a_pair_is_one_capacitor_that_has_the_results_numbers_at_the_steps() {
    let model = read(&pair()).expect("a model");
    assert_eq!((model.terminals.len(), model.has_common, model.branches.len()), (2, false, 1));
    assert_eq!(model.range(), [0.0, 0.8]);
    let curve = &model.branches[0].curve;
    for force in [0.0, 0.1, 0.3, 0.8] {
        let c = 40e-15 / (1.0 + force);
        let at = [-1.0, 0.0, 1.0].map(|band| curve.at(force, band).capacitance);
        assert_eq!(at, [0.999 * c, c, 1.001 * c]);
    }
    assert!((model.largest_relative_error() - 1e-3).abs() < 1e-9);
    assert!(model.notes.is_empty(), "{:?}", model.notes);
}

#[test]
fn a_matrix_is_a_network_whose_maxwell_matrix_is_that_of_the_result() {
    let result = matrix(["a", "b", "c"]);
    let model = read(&result).expect("a model");
    assert!(model.has_common && model.has_ground_band() && model.branches.len() == 6);
    for (k, force) in model.forces.iter().enumerate() {
        let mut maxwell = [[0.0; 3]; 3];
        for branch in &model.branches {
            let c = branch.curve.at(*force, 0.0).capacitance;
            let (i, j) = branch.ends;
            maxwell[i][i] += c;
            if let Some(j) = j {
                maxwell[j][j] += c;
                maxwell[i][j] -= c;
                maxwell[j][i] -= c;
            }
        }
        for (i, row) in maxwell.iter().enumerate() {
            for (j, entry) in row.iter().enumerate() {
                let known = result["steps"][k]["maxwell_matrix_f"][i][j].as_f64().expect("an entry");
                assert!((entry - known).abs() < 1e-12 * known.abs(), "{entry} {known}");
            }
        }
    }
}

#[test]
fn no_capacitor_of_a_matrix_is_negative_at_any_force_and_band() {
    // A network of nonnegative capacitors has a positive semidefinite Maxwell matrix.
    let model = read(&matrix(["a", "b", "c"])).expect("a model");
    let ground = |k: usize| model.branches.iter().find(|b| b.ends == (k, None)).expect("it is there");
    assert!(ground(0).curve.steps().iter().all(|step| step.lower == 0.0 && step.upper > 0.0));
    for branch in &model.branches {
        for k in 0..=1000 {
            for band in [-1.0, -0.5, 0.0, 0.5, 1.0] {
                let c = branch.curve.at(0.5e-3 * f64::from(k), band).capacitance;
                assert!(c >= 0.0, "{c}");
            }
        }
    }
}

#[test]
fn estimated_errors_of_mechanics_and_geometry_widen_the_bounds() {
    let mut result = pair();
    result["steps"][1]["mechanics_error_estimate"] = json!(0.01);
    result["steps"][1]["geometry_error_estimate"] = json!(0.02);
    let model = read(&result).expect("a model");
    let step = model.branches[0].curve.steps()[1];
    assert!(
        (step.upper / step.value - 1.031).abs() < 1e-12 && (step.lower / step.value - 0.969).abs() < 1e-12
    );
    assert!(model.notes.iter().any(|note| note.contains("not proved")), "{:?}", model.notes);
}

#[test]
fn the_errors_of_the_model_and_of_the_force_are_told_and_leave_the_bounds_as_they_are() {
    let mut result = pair();
    result["steps"][1]["model_error_estimate"] = json!(0.05);
    result["steps"][2]["force_error_estimate"] = json!(0.4);
    result["steps"][3]["force_error_estimate"] = json!(null);
    let model = read(&result).expect("a model");
    let step = model.branches[0].curve.steps()[1];
    assert!((step.upper / step.value - 1.001).abs() < 1e-12);
    for words in ["up to 5.00 % of the capacitance", "up to 40.00 %", "not known at all steps"] {
        assert!(model.notes.iter().any(|note| note.contains(words)), "{words}: {:?}", model.notes);
    }
}

#[test]
fn steps_before_contact_are_left_out_and_the_order_of_the_steps_does_not_matter() {
    let mut result = pair();
    let steps = result["steps"].as_array_mut().expect("steps");
    steps.reverse();
    let mut approach = steps[0].clone();
    approach["distance_m"] = json!(1e-3);
    approach["force_n"] = json!(0.0);
    approach["compression"] = json!(0.0);
    steps.push(approach);
    assert_eq!(read(&result).expect("a model").branches, read(&pair()).expect("a model").branches);
}

#[test]
fn mutual_and_own_capacitances_have_their_own_pins_and_words() {
    let mut result = pair();
    result["measurement"] = json!({ "kind": "own", "terminals": ["left"] });
    let against_ground = read(&result).expect("a model");
    assert!(
        against_ground.has_common
            && against_ground.terminals.len() == 1
            && against_ground.branches[0].ends == (0, None)
    );
    result["measurement"] = json!({ "kind": "mutual", "terminals": ["right", "left"] });
    let mutual = read(&result).expect("a model");
    assert!(!mutual.has_common && mutual.terminals[0].name == "right");
    assert!(mutual.notes.iter().any(|note| note.contains("those to ground")), "{:?}", mutual.notes);
}

#[test]
fn a_turn_is_allowed_on_request_and_told() {
    let mut result = pair();
    result["steps"][3]["capacitance_f"] = json!(39e-15);
    result["steps"][3]["capacitance_lower_f"] = json!(39e-15);
    result["steps"][3]["capacitance_upper_f"] = json!(39e-15);
    assert!(read(&result).is_err());
    let settings = Settings { allow_turns: true, content: Content::Measured, name: None };
    let model = Model::parse(&result.to_string(), "sensor", &settings).expect("a model");
    assert!(model.notes.iter().any(|note| note.contains("does not grow or fall")), "{:?}", model.notes);
}

#[test]
fn a_matrix_can_be_asked_for_where_one_capacitance_was_measured() {
    let mut result = matrix(["a", "b", "c"]);
    result["measurement"] = json!({ "kind": "mutual", "terminals": ["a", "b"] });
    assert_eq!(read(&result).expect("a model").branches.len(), 1);
    assert_eq!(read_matrix(&result).expect("a model").branches.len(), 6);
}
