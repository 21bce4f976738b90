//! The JSON Schema of case files, for editors.

use serde_json::{Value, json};

use super::raw::Document;
use super::reader::FromToml;

/// The JSON Schema (draft 7) of case files.
///
/// It is built from the types that read the file. Rules that a schema cannot express, such as that an
/// electrode must fit into the layer, are checked only by [`load`](super::load).
pub fn json_schema() -> Value {
    let mut schema = Document::schema();
    schema["$schema"] = json!("http://json-schema.org/draft-07/schema#");
    schema["title"] = json!("elastocap case file");
    schema
}
