//! Results as a run writes them, with the parts that a model reads.

use elastocap_circuits::model::{Content, Settings};
use elastocap_circuits::{Model, ModelError};
use serde_json::{Value, json};

/// A pair whose capacitance falls from 40 fF, known to 1e-3.
pub(crate) fn pair() -> Value {
    let step = |(k, force): (usize, f64)| {
        let c = 40e-15 / (1.0 + force);
        json!({
            "index": k, "compression": 0.1 * k as f64, "force_n": force, "force_error_estimate": 0.0, "status": "ok",
            "capacitance_f": c, "capacitance_lower_f": 0.999 * c, "capacitance_upper_f": 1.001 * c,
            "maxwell_matrix_f": null, "maxwell_matrix_lower_f": null, "maxwell_matrix_upper_f": null,
        })
    };
    let steps: Vec<Value> = [0.0, 0.1, 0.3, 0.8].into_iter().enumerate().map(step).collect();
    json!({
        "title": "Pair", "case": "pair.toml", "status": "complete", "conductors": ["left", "right"],
        "measurement": { "kind": "two_terminal", "terminals": ["left", "right"] },
        "bounds": "proved", "steps": steps, "versions": { "elastocap": "0.1.0" },
    })
}

/// Three conductors; the capacitance of the first to ground is within its bounds of zero.
pub(crate) fn matrix(names: [&str; 3]) -> Value {
    let step = |(k, force): (usize, f64)| {
        let [a, b, c] = [50e-15 / (1.0 + force), 30e-15 * (1.0 + force), 1e-15];
        let value = [[a + c, -a, -c], [-a, a + b + 9e-15, -b], [-c, -b, b + c + 5e-15]];
        let moved = |away: f64| value.map(|row| row.map(|entry| entry + away * 1e-3 * entry.abs()));
        json!({
            "index": k, "compression": 0.1 * k as f64, "force_n": force, "force_error_estimate": 0.0, "status": "ok",
            "capacitance_f": a, "capacitance_lower_f": a, "capacitance_upper_f": a,
            "maxwell_matrix_f": value, "maxwell_matrix_lower_f": moved(-1.0), "maxwell_matrix_upper_f": moved(1.0),
        })
    };
    let steps: Vec<Value> = [0.0, 0.2, 0.5].into_iter().enumerate().map(step).collect();
    json!({
        "title": "Three", "case": "three.toml", "status": "complete", "conductors": names,
        "measurement": { "kind": "matrix", "terminals": names },
        "bounds": "proved", "steps": steps, "versions": { "elastocap": "0.1.0" },
    })
}

pub(crate) fn read(result: &Value) -> Result<Model, ModelError> {
    Model::parse(&result.to_string(), "sensor", &Settings::default())
}

pub(crate) fn read_matrix(result: &Value) -> Result<Model, ModelError> {
    let settings = Settings { content: Content::Matrix, ..Settings::default() };
    Model::parse(&result.to_string(), "sensor", &settings)
}
