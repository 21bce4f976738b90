//! Tests of results without a model, and of the messages about them.

use serde_json::{Value, json};

use crate::results::{matrix, pair, read, read_matrix};

/// Checks that the pair with a change has no model, and that the message has these words.
fn refused(change: impl Fn(&mut Value), words: &str) {
    let mut result = pair();
    change(&mut result);
    let message = read(&result).expect_err(words).to_string();
    assert!(message.contains(words), "{message}");
}

#[test]
fn stopped_and_failed_runs_are_refused() {
    refused(|r| r["status"] = json!("stopped"), "--resume");
    refused(
        |r| {
            r["steps"][2]["status"] = json!("failed: no equilibrium");
            r["steps"][2]["reason"] = json!("no equilibrium");
        },
        "step 2 of the run has no result (no equilibrium)",
    );
    refused(|r| r["steps"][3]["status"] = json!("not run"), "step 3 of the run has no result");
    refused(|r| r["steps"][1]["capacitance_f"] = Value::Null, "step 1 of the run has no result");
}

#[test]
fn runs_without_forces_or_capacitances_are_refused() {
    refused(|r| r["steps"][3]["force_n"] = Value::Null, "step 3 of the run has no force");
    refused(
        |r| {
            for step in r["steps"].as_array_mut().expect("steps") {
                step["force_n"] = Value::Null;
                step["compression"] = Value::Null;
            }
        },
        "give the case a `[load]`",
    );
    refused(|r| r["measurement"] = Value::Null, "no capacitances");
    refused(|r| r["steps"].as_array_mut().expect("steps").truncate(1), "load steps with a force is 1");
}

#[test]
fn a_force_with_two_capacitances_is_refused() {
    refused(
        |r| r["steps"][3]["force_n"] = json!(0.2),
        "the force does not grow from step 2 (0.3 N) to step 3 (0.2 N)",
    );
    refused(|r| r["steps"][3]["force_n"] = json!(0.3), "end `[load]` of the case before");
    refused(
        |r| {
            let pose = json!({ "pose": { "shift_m": [1e-4, 0.0] } });
            r["plan"] = json!({ "steps": [{}, {}, pose, {}] });
        },
        "shift or tilt",
    );
}

#[test]
fn capacitances_that_turn_or_may_be_negative_are_refused() {
    refused(
        |r| {
            r["steps"][3]["capacitance_lower_f"] = json!(39e-15);
            r["steps"][3]["capacitance_f"] = json!(39e-15);
            r["steps"][3]["capacitance_upper_f"] = json!(39e-15);
        },
        "between \"left\" and \"right\" grows with the force in one place and falls in another",
    );
    refused(|r| r["steps"][0]["capacitance_lower_f"] = json!(-1e-18), "smaller `relative_tolerance`");
    let mut result = matrix(["a", "b", "c"]);
    result["steps"][1]["maxwell_matrix_upper_f"][0][0] = json!(1e-15);
    let message = read(&result).expect_err("a row whose sum is below zero").to_string();
    assert!(message.contains("step 1 of the result has an impossible"), "{message}");
}

#[test]
fn numbers_that_cannot_be_are_refused() {
    refused(|r| r["steps"][1]["force_n"] = json!(-0.1), "impossible force");
    refused(|r| r["steps"][1]["capacitance_lower_f"] = json!(1.0), "impossible force");
    refused(
        |r| r["steps"][1]["force_n"] = json!(5e-324),
        "steps 0 and 1 of the run have nearly the same force",
    );
    let mut result = matrix(["a", "b", "c"]);
    result["steps"][0]["maxwell_matrix_f"] = json!([[1.0]]);
    assert!(read(&result).expect_err("no square").to_string().contains("impossible force"));
    assert!(read_matrix(&pair()).expect_err("no matrix").to_string().contains("without --matrix"));
    let text = "{ \"title\": 3 }";
    let settings = Default::default();
    assert!(elastocap_circuits::Model::parse(text, "x", &settings).is_err());
}

#[test]
fn a_matrix_of_too_many_terminals_is_refused() {
    let mut result = matrix(["a", "b", "c"]);
    result["conductors"] = json!((0..65).map(|k| k.to_string()).collect::<Vec<_>>());
    let message = read(&result).expect_err("too many").to_string();
    assert!(message.contains("65 terminals") && message.contains("at most 64"), "{message}");
}
