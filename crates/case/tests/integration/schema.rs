//! Checks that the JSON Schema accepts what the reader accepts, and refuses the mistakes that a schema can
//! express.

use std::path::Path;

use serde_json::Value;

fn acceptance(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/acceptance").join(name);
    std::fs::read_to_string(path).unwrap()
}

fn json(text: &str) -> Value {
    serde_json::to_value(text.parse::<toml::Table>().unwrap()).unwrap()
}

fn validator() -> jsonschema::Validator {
    let schema = elastocap_case::json_schema();
    assert!(jsonschema::meta::is_valid(&schema));
    jsonschema::validator_for(&schema).unwrap()
}

const SUPPORTED: [&str; 9] = [
    "layer-free-end.toml",
    "layer-on-substrate.toml",
    "flat-punch.toml",
    "in-plane-pair.toml",
    "in-plane-pair-by-force.toml",
    "stacked-pair.toml",
    "isolated-cube.toml",
    "cube-in-cube.toml",
    "square-plates.toml",
];

#[test]
fn every_supported_acceptance_file_is_valid() {
    let validator = validator();
    for name in SUPPORTED {
        let errors: Vec<_> = validator.iter_errors(&json(&acceptance(name))).map(|e| e.to_string()).collect();
        assert!(errors.is_empty(), "{name}: {errors:?}");
    }
}

#[test]
fn a_layer_in_three_dimensions_is_valid_with_indenters_of_its_own() {
    let validator = validator();
    let case = |indenter: &str| {
        let text = acceptance("layer-on-substrate.toml").replace("plane_strain", "solid");
        json(&text.replace("\"whole-top\"", indenter))
    };
    assert!(validator.is_valid(&case("\"whole-top\"")));
    assert!(validator.is_valid(&case("{ sphere = { radius = \"1 mm\" } }")));
    assert!(!validator.is_valid(&case("{ sphere = { radius = \"1 mm\", position = \"1 mm\" } }")));
}

#[test]
fn a_gent_material_is_valid_with_both_its_constants() {
    let validator = validator();
    let case = |constants: &str| {
        let text = acceptance("layer-on-substrate.toml").replace("mooney_rivlin", "gent");
        let is_other = |line: &&str| !line.starts_with("c10") && !line.starts_with("c01");
        let lines: Vec<&str> = text.lines().filter(is_other).collect();
        json(
            &lines
                .join("\n")
                .replace("[layer.material.gent]", &format!("[layer.material.gent]\n{constants}\n#")),
        )
    };
    assert!(validator.is_valid(&case("shear_modulus = \"90 kPa\"\nlimiting_invariant = 30.0")));
    assert!(!validator.is_valid(&case("shear_modulus = \"90 kPa\"")));
    assert!(!validator.is_valid(&case("shear_modulus = \"90 kPa\"\nlimiting_invariant = 0.0")));
}

#[test]
fn measured_points_and_a_foam_are_valid_with_their_keys() {
    let validator = validator();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../cases/fits");
    for name in ["pair.toml", "orthosis.toml"] {
        let text = std::fs::read_to_string(path.join(name)).unwrap();
        let errors: Vec<_> = validator.iter_errors(&json(&text)).map(|e| e.to_string()).collect();
        assert!(errors.is_empty(), "{name}: {errors:?}");
        assert!(!validator.is_valid(&json(&text.replace("[measurement.columns]", "[measurement.column]"))));
        let corrected =
            |line: &str| json(&text.replace("[measurement]\n", &format!("[measurement]\n{line}\n")));
        assert!(validator.is_valid(&corrected("offset = \"2 mN\"\nparasitic = \"-1 fF\"\ngain = 1.1")));
        assert!(!validator.is_valid(&corrected("parasitic = 1.0")));
    }
}

#[test]
fn slips_that_a_schema_can_see_are_invalid() {
    let validator = validator();
    for name in [
        "unknown-key",
        "missing-unit",
        "wrong-dimension",
        "negative-gap",
        "negative-modulus",
        "not-a-number",
        "crushed-flat",
        "newer-format",
        "zero-tolerance",
        "cut-off",
    ] {
        let text = acceptance(&format!("bad/{name}.toml"));
        assert!(!validator.is_valid(&json(&text)), "{name}");
    }
}

#[test]
fn every_key_carries_a_description() {
    fn walk(schema: &Value, path: &str) {
        if let Some(properties) = schema.get("properties").and_then(Value::as_object) {
            for (key, inner) in properties {
                let path = format!("{path}.{key}");
                assert!(inner.get("description").is_some_and(|d| d != ""), "{path}");
                assert!(
                    inner.get("type") != Some(&"object".into())
                        || inner.get("additionalProperties") == Some(&Value::Bool(false)),
                    "{path}"
                );
                walk(inner, &path);
                inner.get("items").into_iter().for_each(|items| walk(items, &path));
                inner
                    .get("anyOf")
                    .and_then(Value::as_array)
                    .into_iter()
                    .flatten()
                    .for_each(|one| walk(one, &path));
            }
        }
    }
    walk(&elastocap_case::json_schema(), "");
}
