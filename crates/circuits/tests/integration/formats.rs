//! Tests of the files of a model.

use std::collections::BTreeSet;
use std::path::Path;

use elastocap_circuits::{fmu, spice, table, verilog_a};
use serde_json::json;

use crate::results::{matrix, pair, read};

const HOSTILE: [&str; 3] = ["*/ exit(1); /*", "\n.include /etc/passwd", "<module name=\"x\">"];

#[test]
fn the_same_result_gives_the_same_bytes() {
    for result in [pair(), matrix(["a", "b", "c"])] {
        let files = || {
            let model = read(&result).expect("a model");
            let texts = [spice::subcircuit(&model), verilog_a::module(&model), table::csv(&model, 20)];
            let json = table::json(&model, 20).expect("a table");
            (texts, json, fmu::archive(&model, Some(b"library")).expect("an archive"))
        };
        assert!(files() == files());
    }
}

#[test]
fn hostile_names_stay_in_comments_and_descriptions() {
    let mut result = matrix(HOSTILE);
    result["title"] = json!("x\n.control\nshell rm -rf /\n.endc \\");
    let model = read(&result).expect("a model");
    let spice = spice::subcircuit(&model);
    let is_ours = |line: &str| {
        let known = [
            "*",
            ".subckt sensor ",
            ".param elc_",
            "Belc_",
            "Celc_",
            "Velc_",
            "Felc_",
            "+ +({",
            ".ends sensor",
        ];
        line.is_empty() || known.iter().any(|begin| line.starts_with(begin))
    };
    assert!(spice.is_ascii());
    assert!(spice.lines().all(is_ours), "{:?}", spice.lines().find(|line| !is_ours(line)));
    let verilog = verilog_a::module(&model);
    let code: Vec<&str> = verilog.lines().filter(|line| !line.trim_start().starts_with("//")).collect();
    assert!(verilog.is_ascii() && !code.iter().any(|line| line.contains("exit") && line.contains("(1)")));
    for (name, text) in fmu::sources(&model) {
        let comments = text.matches("/*").count();
        assert_eq!(comments, text.matches("*/").count(), "{name}");
        assert!(!text.contains("\n.include"), "{name}");
    }
    let archive = fmu::archive(&model, None).expect("an archive");
    let text = String::from_utf8_lossy(&archive);
    let (description, _) = text.split_once("</fmiModelDescription>").expect("a description");
    assert!(
        !description.contains("<module name") && description.contains("&lt;module name=&quot;x&quot;&gt;")
    );
}

#[test]
fn the_pins_of_a_subcircuit_differ_from_each_other_and_from_its_inner_nodes() {
    let model = read(&matrix(["elc_t1", "ELC-T1", "force"])).expect("a model");
    let joined = spice::pins(&model);
    let pins: BTreeSet<String> = joined.split(' ').map(str::to_ascii_lowercase).collect();
    assert_eq!(pins.len(), 6, "{joined}");
    assert!(pins.iter().all(|pin| !pin.starts_with("elc_")), "{joined}");
}

#[test]
fn the_variables_of_an_fmu_differ_where_names_read_the_same_when_they_are_joined() {
    let model = read(&matrix(["a_b", "a", "b_lower"])).expect("a model");
    let archive = fmu::archive(&model, None).expect("an archive");
    let text = String::from_utf8_lossy(&archive);
    let (description, _) = text.split_once("</ModelVariables>").expect("variables");
    let (_, variables) = description.split_once("<ModelVariables>").expect("variables");
    let names: Vec<&str> =
        variables.split(" name=\"").skip(1).filter_map(|rest| rest.split('"').next()).collect();
    let unlike: BTreeSet<&str> = names.iter().copied().collect();
    assert!(names.len() == 36 && unlike.len() == names.len(), "{names:?}");
}

#[test]
fn a_table_has_a_line_for_each_force_with_the_steps_among_them() {
    let model = read(&pair()).expect("a model");
    let table = table::csv(&model, 5);
    let forces: Vec<f64> = table
        .lines()
        .skip(1)
        .map(|line| line.split(',').nth(2).expect("a force").parse().expect("a number"))
        .collect();
    assert_eq!(forces.len(), 16);
    assert!([0.0, 0.1, 0.3, 0.8].iter().all(|force| forces.contains(force)), "{forces:?}");
    let json: serde_json::Value =
        serde_json::from_str(&table::json(&model, 5).expect("a table")).expect("JSON");
    let capacitor = &json["capacitors"][0];
    assert_eq!(capacitor["value_f"].as_array().map(Vec::len), Some(3));
    assert_eq!(capacitor["value_f"][0][0].as_f64(), Some(40e-15));
    assert_eq!(capacitor["table"].as_array().map(Vec::len), Some(16));
}

#[test]
fn an_fmu_of_another_result_has_another_token() {
    let token = |result| {
        let model = read(&result).expect("a model");
        let archive = fmu::archive(&model, None).expect("an archive");
        let text = String::from_utf8_lossy(&archive).into_owned();
        let begin = text.find("instantiationToken=\"").expect("a token") + 20;
        text[begin..begin + 38].to_owned()
    };
    let mut other = pair();
    other["steps"][1]["capacitance_upper_f"] = json!(37e-15);
    assert_ne!(token(pair()), token(other));
    assert!(token(pair()).starts_with('{') && token(pair()).ends_with('}'));
}

#[test]
fn a_compiler_that_is_not_there_is_told() {
    let model = read(&pair()).expect("a model");
    let message = fmu::compile(&model, Path::new("/no/such/compiler")).expect_err("no compiler").to_string();
    assert!(message.contains("/no/such/compiler"), "{message}");
}
