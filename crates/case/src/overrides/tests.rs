use super::{OverrideErrorKind, files_of, value_at, with_value};

const SOURCE: &str = r#"# The sensor.
format = 1
title  = "pair"   # of pads

[layer]
thickness = "450 um"   # over the substrate
material.neo_hookean.shear_modulus = "90 kPa"

[load]
compression = [0.0, 0.1, # tenth
               0.2]

# What carries charge.
[[conductor]]
name = "a"
box = { min = ["0 mm", "0 mm", "0 mm"], max = ["1 mm", "1 mm", "1 mm"] }

[[conductor]]   # the second
name = "b"

[surroundings]
above = { relative_permittivity = 1.0, thickness = "1 mm" }
"#;

/// Checks that the override replaces exactly this part of the source.
#[track_caller]
fn replaces(path: &str, value: &str, old: &str, new: &str) {
    assert_eq!(SOURCE.matches(old).count(), 1, "{old} must stand in the source once");
    assert_eq!(with_value(SOURCE, path, value).unwrap(), SOURCE.replace(old, new));
}

#[track_caller]
fn refused(path: &str, value: &str, words: &str) {
    let message = with_value(SOURCE, path, value).unwrap_err().to_string();
    assert!(message.contains(words), "{message}\nlacks: {words}");
    assert!(message.starts_with("cannot set `"), "{message}");
}

#[test]
fn a_value_is_replaced_and_all_comments_stay() {
    replaces("layer.thickness", "400 um", "\"450 um\"   # over", "\"400 um\"   # over");
    replaces("layer.thickness", "\"400 um\"", "\"450 um\"", "\"400 um\"");
    replaces("layer.thickness", "'400 um'", "\"450 um\"", "'400 um'");
    replaces("title", "pair of \"pads\"", "\"pair\"", "'pair of \"pads\"'");
    replaces("format", "2", "format = 1", "format = 2");
    replaces(" layer . thickness ", " 400um ", "\"450 um\"", "\"400um\"");
}

#[test]
fn numbers_and_words_of_toml_stay_what_they_are() {
    for number in ["1e-3", "0.5", "-7", "true", "inf", "[0.0, 0.5]", "{ a = 1 }"] {
        let text = with_value("[x]\ny = 1.0\n", "x.y", number).unwrap();
        assert_eq!(text, format!("[x]\ny = {number}\n"));
    }
}

#[test]
fn an_entry_of_an_array_is_replaced_between_its_comments() {
    replaces("load.compression[1]", "0.15", "0.1, # tenth", "0.15, # tenth");
    replaces("conductor[0].box.max[2]", "2 mm", "\"1 mm\", \"1 mm\"] }", "\"1 mm\", \"2 mm\"] }");
    replaces("conductor[1].name", "c", "\"b\"", "\"c\"");
}

#[test]
fn dotted_keys_and_inline_tables_are_entered() {
    replaces("layer.material.neo_hookean.shear_modulus", "80 kPa", "90 kPa", "80 kPa");
    replaces("surroundings.above.thickness", "2 mm", "thickness = \"1 mm\" }", "thickness = \"2 mm\" }");
}

#[test]
fn a_new_key_goes_to_the_end_of_its_table() {
    replaces("layer.half_length", "3 mm", "\"90 kPa\"\n", "\"90 kPa\"\nhalf_length = \"3 mm\"\n");
    replaces(
        "layer.material.neo_hookean.bulk_modulus",
        "1 GPa",
        "\"90 kPa\"\n",
        "\"90 kPa\"\nmaterial.neo_hookean.bulk_modulus = \"1 GPa\"\n",
    );
    replaces("surroundings.above.then", "grounded", "\"1 mm\" }\n", "\"1 mm\", then = \"grounded\" }\n");
    replaces("conductor[1].potential", "1 V", "name = \"b\"\n", "name = \"b\"\npotential = \"1 V\"\n");
}

#[test]
fn tables_that_do_not_exist_are_made() {
    let text = with_value(SOURCE, "mechanics.plane_strain.indenter.cylinder.radius", "1 mm").unwrap();
    let added = "\n[mechanics.plane_strain.indenter.cylinder]\nradius = \"1 mm\"\n";
    assert_eq!(text, format!("{SOURCE}{added}"));
    assert_eq!(with_value("", "a.b", "1").unwrap(), "[a]\nb = 1\n");
    let inline = with_value("x = { y = 1 }\n", "x.z.w", "2").unwrap();
    assert_eq!(inline, "x = { y = 1, z = { w = 2 } }\n");
    let empty = with_value("x = {}\n", "x.z", "2").unwrap();
    assert_eq!(value_at(&empty, "x.z").unwrap().as_deref(), Some("2"));
}

#[test]
fn a_table_under_a_header_gives_way_to_an_inline_one() {
    let source = "[layer]\nthickness = \"1 mm\"\n[layer.material.gent]\nlimit = 3.0\n[load]\nforce = 1\n";
    let text = with_value(source, "layer.material", "{ yeoh = { c1 = \"1 kPa\" } }").unwrap();
    let value = "material = { yeoh = { c1 = \"1 kPa\" } }\n";
    assert_eq!(text, format!("[layer]\nthickness = \"1 mm\"\n{value}[load]\nforce = 1\n"));
}

#[test]
fn an_entry_of_an_array_of_tables_is_replaced_by_a_table_only() {
    let text = with_value(SOURCE, "conductor[1]", "{ name = \"z\", potential = 0 }").unwrap();
    assert_eq!(text, SOURCE.replace("name = \"b\"\n", "name = \"z\"\npotential = 0\n"));
    refused("conductor[1]", "5", "this entry is a table");
}

#[test]
fn keys_in_quotes_may_hold_anything() {
    let source = "[\"a.b\"]\n'x y' = 1\n";
    assert_eq!(with_value(source, "\"a.b\".'x y'", "2").unwrap(), "[\"a.b\"]\n'x y' = 2\n");
    assert_eq!(with_value("", "\"q\\\"[0]\"", "2").unwrap(), "'q\"[0]' = 2\n");
}

#[test]
fn later_overrides_apply_to_what_earlier_ones_made() {
    let once = with_value(SOURCE, "layer.end.free", "true").unwrap();
    let twice = with_value(&once, "layer.end.free", "false").unwrap();
    assert_eq!(twice, once.replace("free = true", "free = false"));
}

#[test]
fn a_path_that_cannot_be_read_is_refused_with_the_right_form() {
    refused("", "1", "the path is empty");
    refused("layer.", "1", "a key is missing");
    refused(".layer", "1", "a key is missing");
    refused("layer..thickness", "1", "a key is missing");
    refused("[0].name", "1", "a key is missing");
    refused("layer thickness", "1", "`t` cannot stand in a key");
    refused("layer/thickness", "1", "`/` cannot stand in a key");
    refused("conductor[0]name", "1", "`n` cannot stand in a key");
    refused("\"layer", "1", "a quotation mark is not closed");
    refused("conductor[a].name", "1", "`[a]` is not the number of an entry");
    refused("conductor[-1].name", "1", "`[-1]` is not the number of an entry");
    refused("conductor[0", "1", "`[0` is not the number of an entry");
    refused(&"a.".repeat(4000), "1", "more than 32 parts");
}

#[test]
fn a_path_that_does_not_fit_the_file_is_refused_with_what_is_there() {
    refused("conductor.name", "c", "`conductor` is an array with 2 entries; say which one");
    refused("load.compression.first", "0", "`load.compression` is an array with 3 entries");
    refused("conductor[2].name", "c", "`conductor` has 2 entries");
    refused("load.compression[3]", "0.4", "`load.compression` has 3 entries");
    refused("layer[0].thickness", "1", "`layer` is a table and has no entries");
    refused("layer.thickness[0]", "1", "`layer.thickness` is a text and has no entries");
    refused("layer.thickness.value", "1", "`layer.thickness` is a text and not a table");
    refused("dielectric[0].name", "c", "no array `dielectric`");
    refused("layer.force[0]", "1", "no array `layer.force`");
}

#[test]
fn a_value_that_begins_like_toml_must_be_toml() {
    refused("layer.thickness", "  ", "the value is empty");
    refused("load.compression", "[0.0, 0.1", "not valid TOML");
    refused("title", "\"open", "not valid TOML");
    refused("surroundings.above", "{ thickness = }", "not valid TOML");
    let error = with_value("format = \n", "title", "x").unwrap_err();
    assert!(matches!(error.kind, OverrideErrorKind::NotToml(_)), "{error}");
    assert!(error.to_string().contains("line 1"), "{error}");
}

#[test]
fn the_value_of_a_path_is_read_as_it_is_written() {
    let at = |path| value_at(SOURCE, path).unwrap();
    assert_eq!(at("layer.thickness").as_deref(), Some("\"450 um\""));
    assert_eq!(at("layer.material.neo_hookean.shear_modulus").as_deref(), Some("\"90 kPa\""));
    assert_eq!(at("load.compression[2]").as_deref(), Some("0.2"));
    assert_eq!(at("conductor[0].box.min[1]").as_deref(), Some("\"0 mm\""));
    assert_eq!(at("conductor[1].name").as_deref(), Some("\"b\""));
    assert_eq!(at("surroundings.above.relative_permittivity").as_deref(), Some("1.0"));
    for absent in ["layer", "conductor", "conductor[0]", "conductor[5].name", "layer.x.y", "title.x"] {
        assert_eq!(at(absent), None, "{absent}");
    }
}

#[test]
fn the_files_of_a_case_are_found_wherever_they_are_named() {
    let source = "mesh.file = 'a.msh'\n[[conductor]]\nsurface = { file = \"b.obj\", unit = \"mm\" }\n[[conductor]]\n\
                  [conductor.surface]\nfile = \"c.obj\"\n[x]\nlist = [{ file = \"b.obj\" }, { file = \"d\" }]\nfile = 3\n";
    assert_eq!(files_of(source), ["a.msh", "b.obj", "c.obj", "d"]);
    assert!(files_of("not toml").is_empty());
}

#[test]
fn an_overridden_case_finds_its_files_and_names_the_line_of_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("case.toml");
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    std::fs::write(folder.path().join("body.obj"), obj).unwrap();
    let source = "format = 1\n[[conductor]]\nname = \"a\"\nsurface = { file = \"body.obj\", unit = \"mm\" }\n\
                  [surroundings]\nboundary = \"open\"\n[electrostatics]\nrelative_tolerance = 1e-2\n";
    let changed = with_value(source, "electrostatics.relative_tolerance", "5e-2").unwrap();
    crate::parse(&changed, &path).unwrap();
    let moved = with_value(source, "conductor[0].surface.file", "other.obj").unwrap();
    let message = crate::parse(&moved, &path).unwrap_err().to_string();
    assert!(message.contains("case.toml:4:") && message.contains("other.obj"), "{message}");
}
