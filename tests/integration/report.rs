//! Tests of `report.html`, of the choice of files by `--only`, and of `compare`.

use crate::support::{STEPS, Sandbox, quick_pair};

/// Checks that every element is closed in order.
fn assert_balanced(page: &str) {
    const EMPTY: [&str; 8] = ["meta", "br", "img", "input", "hr", "link", "!doctype", "wbr"];
    let mut open: Vec<String> = Vec::new();
    let mut rest = page;
    while let Some(at) = rest.find('<') {
        rest = &rest[at + 1..];
        let end = rest.find('>').expect("a tag ends");
        let tag = &rest[..end];
        rest = &rest[end + 1..];
        let name: String = tag
            .trim_start_matches('/')
            .chars()
            .take_while(|c| !c.is_whitespace() && *c != '/')
            .collect::<String>()
            .to_lowercase();
        if tag.starts_with('/') {
            assert_eq!(open.pop().as_deref(), Some(name.as_str()), "closes before {:.80}", rest);
        } else if !tag.ends_with('/') && !EMPTY.contains(&name.as_str()) {
            // The content of these is text.
            if name == "script" || name == "style" {
                let close = format!("</{name}>");
                rest = &rest[rest.find(&close).expect("a script ends") + close.len()..];
                continue;
            }
            open.push(name);
        }
    }
    assert!(open.is_empty(), "left open: {open:?}");
}

#[test]
fn the_report_is_well_formed_and_holds_every_number_of_the_curve() {
    let sandbox = Sandbox::new();
    let case = sandbox.case("pair.toml", &quick_pair(STEPS, "compression = [0.0, 0.1, 0.3]"));
    sandbox.run(&case, &[]).exits_with(0);
    let page = sandbox.read("out/report.html");
    assert_balanced(&page);
    for line in sandbox.read("out/curve.csv").lines().skip(1) {
        for cell in line.split(',').filter(|cell| !cell.is_empty()) {
            assert!(page.contains(&format!(">{cell}<")), "{cell} is not in a cell of the page");
        }
    }
    // The pictures of the field, the text of the case, and the command.
    assert_eq!(page.matches("<figure class=\"section\">").count(), 2);
    assert!(page.contains("[electrodes.in_plane_pair]") && page.contains("elastocap run "));
    assert!(page.len() < 3_000_000, "{}", page.len());
    let json = sandbox.json("out/result.json");
    assert!(json["files"].as_array().is_some_and(|files| files.contains(&"report.html".into())));
    assert_eq!(json["case_text"], std::fs::read_to_string(case).expect("the case"));
}

#[test]
fn a_title_that_closes_scripts_stays_a_title() {
    let sandbox = Sandbox::new();
    let text = quick_pair(STEPS, "compression = [0.0, 0.2]");
    let title = "title  = \"In-plane electrode pair, 50 um gap, 450 um layer\"";
    assert!(text.contains(title), "{text}");
    let hostile = "title = '</script></title><img src=x onerror=alert(1)><!--'";
    let case = sandbox.case("hostile.toml", &text.replace(title, hostile));
    sandbox.run(&case, &["--only", "report"]).exits_with(0);
    let page = sandbox.read("out/report.html");
    assert_balanced(&page);
    assert!(!page.contains("<img src=x") && page.contains("&lt;img src=x"));
}

#[test]
fn only_writes_the_files_that_are_asked_for_and_their_list() {
    let sandbox = Sandbox::new();
    let case = sandbox.case("pair.toml", &quick_pair(STEPS, "compression = [0.0, 0.2]"));
    let all = [
        "capacitance.csv",
        "curve.csv",
        "curve.svg",
        "fields.pvd",
        "report.html",
        "result.json",
        "scene.glb",
        "section_000.svg",
        "section_001.svg",
        "step_000.vtu",
        "step_001.vtu",
    ];
    for (arguments, expected) in [
        (vec!["--only", "curve"], vec!["curve.csv", "curve.svg", "result.json"]),
        (vec!["--only", "curve,report"], vec!["curve.csv", "curve.svg", "report.html", "result.json"]),
        (vec!["--only", "json"], vec!["result.json"]),
        (
            vec!["--only", "fields", "--only", "scene"],
            vec!["fields.pvd", "result.json", "scene.glb", "step_000.vtu", "step_001.vtu"],
        ),
        (
            vec!["--only", "sections,capacitance"],
            vec!["capacitance.csv", "result.json", "section_000.svg", "section_001.svg"],
        ),
        (vec!["--only", "fields,report", "--no-fields"], vec!["report.html", "result.json"]),
        (
            vec!["--no-fields", "--no-scene"],
            vec!["capacitance.csv", "curve.csv", "curve.svg", "report.html", "result.json"],
        ),
        (vec![], all.to_vec()),
    ] {
        sandbox.run(&case, &arguments).exits_with(0);
        assert_eq!(sandbox.names("out"), expected, "{arguments:?}");
        let json = sandbox.json("out/result.json");
        assert_eq!(json["files"], serde_json::json!(expected), "{arguments:?}");
        // The plan says the same as the folder.
        let planned = json["plan"]["solved"].to_string();
        for name in ["curve.csv", "scene.glb", "report.html", "capacitance.csv", "fields.pvd"] {
            assert_eq!(
                planned.contains(name),
                expected.contains(&name),
                "{name} with {arguments:?}: {planned}"
            );
        }
    }
    // The report has its pictures even if their files are not wanted.
    sandbox.run(&case, &["--only", "report"]).exits_with(0);
    assert_eq!(sandbox.read("out/report.html").matches("<figure class=\"section\">").count(), 2);
    let output = sandbox.run(&case, &["--only", "curve,pictures"]).exits_with(2);
    assert!(output.stderr.contains("`pictures` names no files of a run: curve, "), "{}", output.stderr);
}

#[test]
fn results_side_by_side_tell_what_differs_in_case_and_capacitance() {
    let sandbox = Sandbox::new();
    let text = quick_pair(STEPS, "compression = [0.0, 0.2]");
    let case = sandbox.case("pair.toml", &text);
    sandbox.run(&case, &["--only", "curve"]).exits_with(0);
    let wider = text.replacen("\"50 um\"", "\"80 um\"", 1);
    assert_ne!(wider, text);
    let wider = sandbox.case("wider.toml", &wider.replace("[0.0, 0.2]", "[0.0, 0.2, 0.3]"));
    sandbox
        .elastocap(&["run", wider.to_str().expect("UTF-8"), "-o", "wider", "--only", "curve"])
        .exits_with(0);
    let output = sandbox.elastocap(&["compare", "out", "wider", "--html", "both.html"]).exits_with(0);
    assert!(output.stdout.contains("50 um") && output.stdout.contains("80 um"), "{}", output.stdout);
    assert!(
        output.stdout.contains("differ by") && output.stdout.contains("not comparable"),
        "{}",
        output.stdout
    );
    assert!(output.stdout.contains("at 0 of 2 steps"), "{}", output.stdout);
    let page = sandbox.read("both.html");
    assert_balanced(&page);
    assert!(page.contains("id=\"curves\"") && page.contains("80 um"));
    let output = sandbox.elastocap(&["compare", "out/result.json", "out", "--json"]).exits_with(0);
    let json: serde_json::Value = serde_json::from_str(&output.stdout).expect("JSON and nothing else");
    assert_eq!(json["case_keys"], serde_json::json!([]));
    assert_eq!(json["steps"][1]["against_first"][0]["agrees"], true);
    assert_eq!(json["steps"][1]["against_first"][0]["difference_f"], 0.0);
    sandbox.elastocap(&["compare", "out"]).exits_with(2);
    let output = sandbox.elastocap(&["compare", "out", "nowhere"]).exits_with(2);
    assert!(output.stderr.contains("nowhere"), "{}", output.stderr);
    let output =
        sandbox.elastocap(&["compare", "out", "wider", "--html", "no/such/folder.html"]).exits_with(1);
    assert!(output.stderr.contains("cannot write"), "{}", output.stderr);
}
