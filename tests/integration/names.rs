//! Checks that names from a case remain names in every written file, whatever they hold.

use crate::support::Sandbox;

/// A name with the ends of texts, comments, tags, lines and fields in several formats, and with the
/// beginnings of directives in others.
const HOSTILE: &str = r#"a"b'</script><!--&]]>--> .include x `include \ */ {x} $(x) %n ,;=1 ??/ é"#;

/// Checks that every tag is closed, that every attribute and every text can be read, and that no comment
/// holds two hyphens.
fn is_well_formed(name: &str, text: &str) {
    use quick_xml::events::Event;
    let mut reader = quick_xml::Reader::from_str(text);
    reader.config_mut().check_comments = true;
    reader.config_mut().check_end_names = true;
    let mut depth = 0_i32;
    loop {
        let event = reader.read_event().unwrap_or_else(|error| panic!("{name}: {error}"));
        match event {
            Event::Eof => break,
            Event::Start(ref tag) | Event::Empty(ref tag) => {
                for attribute in tag.attributes() {
                    let attribute = attribute.unwrap_or_else(|error| panic!("{name}: {error}"));
                    attribute.unescape_value().unwrap_or_else(|error| panic!("{name}: {error}"));
                }
                depth += i32::from(matches!(event, Event::Start(_)));
            }
            Event::End(_) => depth -= 1,
            Event::Text(text) => drop(text.unescape().unwrap_or_else(|error| panic!("{name}: {error}"))),
            _ => {}
        }
    }
    assert_eq!(depth, 0, "{name}: a tag is not closed");
}

/// Checks that a page has only the scripts of the program, and that no part of the name is a tag or a
/// comment.
fn is_a_sound_page(name: &str, text: &str) {
    let lower = text.to_lowercase();
    assert_eq!(lower.matches("<script").count(), lower.matches("</script>").count(), "{name}");
    assert!(!text.contains("b'</script>") && !text.contains("<!--&]]"), "{name}");
    assert!(text.contains("a&quot;b&#39;&lt;/script&gt;"), "{name}");
}

/// Checks that only comments contain parts of the name.
fn only_comments_have_the_name(name: &str, text: &str, comment: &str) {
    let mut named = 0;
    for line in text.lines() {
        let is_comment = line.trim_start().starts_with(comment);
        let of_name = line.contains("include x") || line.contains("$(x)") || line.contains("script>");
        assert!(is_comment || !of_name, "{name}: {line}");
        named += u32::from(is_comment && of_name);
        assert!(!of_name || !(line.ends_with('\\') || line.contains("*/")), "{name}: {line}");
    }
    assert!(named > 0, "{name} does not name the terminals");
}

#[test]
fn one_hostile_name_stays_a_name_in_every_format() {
    let sandbox = Sandbox::new();
    let quoted = |text: &str| serde_json::to_string(text).expect("a text");
    let text = format!(
        r#"format = 1
title = {title}
[layer]
thickness = "450 um"
relative_permittivity = 2.8
[layer.material.neo_hookean]
shear_modulus = "90 kPa"
[electrodes.in_plane_pair]
gap = "50 um"
length = "300 um"
thickness = "20 um"
width = "500 um"
height = "225 um"
shear_modulus = "rigid"
[mechanics.closed_form]
contact_half_length = "500 um"
contact_width = "500 um"
shear_length = "500 um"
[load]
compression = [0.0, 0.1]
[[conductor]]
name = {body}
box = {{ min = ["-200 um", "600 um", "-200 um"], max = ["200 um", "700 um", "200 um"] }}
[[terminal]]
name = {left}
conductors = ["electrode-left"]
[[terminal]]
name = {right}
conductors = ["electrode-right"]
[surroundings]
boundary = "open"
[electrostatics]
relative_tolerance = 1e-1
"#,
        title = quoted(HOSTILE),
        body = quoted(HOSTILE),
        left = quoted(&format!("{HOSTILE} left")),
        right = quoted(&format!("={HOSTILE}")),
    );
    // The name of the file is in most of them as well.
    let case = "h'<b>&{x}é.toml";
    sandbox.case(case, &text);
    let output = sandbox.elastocap(&["run", case, "-o", "out"]).exits_with(0);
    assert!(output.stdout.contains(HOSTILE), "{output:?}");
    for name in sandbox.names("out") {
        let path = format!("out/{name}");
        match name.rsplit('.').next() {
            Some("svg" | "vtu" | "pvd") => is_well_formed(&name, &sandbox.read(&path)),
            Some("html") => is_a_sound_page(&name, &sandbox.read(&path)),
            Some("csv") => drop(sandbox.table(&path)),
            Some("json") => assert_eq!(sandbox.json(&path)["title"], HOSTILE),
            Some("glb") => {
                let bytes = std::fs::read(sandbox.path(&path)).expect("a scene");
                let length = u32::from_le_bytes(bytes[12..16].try_into().expect("four bytes")) as usize;
                let document: serde_json::Value =
                    serde_json::from_slice(&bytes[20..20 + length]).expect("JSON");
                assert!(document["nodes"].to_string().contains("include x"), "the bodies have names");
            }
            _ => panic!("{name} is in no format that is known here"),
        }
    }
    // In the fields that name a terminal, and with the mark that keeps a spreadsheet from computing it.
    let table = sandbox.table("out/capacitance.csv");
    let plain = HOSTILE.replace('"', "");
    assert!(table.texts("row").contains(&format!("{plain} left").as_str()), "{table:?}");
    assert!(table.texts("row").contains(&format!("'={plain}").as_str()), "{table:?}");

    sandbox.elastocap(&["compare", "out", "out", "--html", "page.html"]).exits_with(0);
    is_a_sound_page("page.html", &sandbox.read("page.html"));
    let export = |format: &str, more: &[&str]| {
        let arguments = [&["export", format, "out", "--matrix", "--name", HOSTILE][..], more].concat();
        sandbox.elastocap(&arguments).exits_with(0).stdout
    };
    only_comments_have_the_name("spice", &export("spice", &["-o", "-"]), "*");
    only_comments_have_the_name("Verilog-A", &export("verilog-a", &["-o", "-"]), "//");
    export("table", &["-o", "t.json"]);
    assert_eq!(sandbox.json("t.json")["title"], HOSTILE);
    export("table", &["-o", "t.csv"]);
    export("fmu", &["-o", "t.fmu", "--no-binary"]);
    // An archive without compression.
    let fmu =
        String::from_utf8_lossy(&std::fs::read(sandbox.path("t.fmu")).expect("an archive")).into_owned();
    let part = |from: &str, to: &str| {
        let start = fmu.find(from).unwrap_or_else(|| panic!("no {from}"));
        let end = fmu[start..].find(to).unwrap_or_else(|| panic!("no {to}"));
        fmu[start..start + end + to.len()].to_owned()
    };
    is_well_formed("FMU", &part("<?xml", "</fmiModelDescription>"));
    let about = fmu.find("sources/tables.h").expect("tables");
    let end = fmu[about..].find("#define ELC_TOKEN").expect("a token");
    only_comments_have_the_name(
        "C",
        fmu[about..about + end].split_once("// ").expect("a head").1.trim_start_matches(|c| c != '\n'),
        "//",
    );
}
