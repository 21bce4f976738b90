//! The JSON part of the file: the scene under one root node that scales it for viewing, and the metadata.

use gltf_json as json;
use json::extras::{Extras, RawValue};
use json::{Index, Value};

use super::GltfError;
use super::units::SceneUnit;

/// A file under construction: the JSON part, and the three sections of the binary part.
#[derive(Default)]
pub(in crate::export) struct File {
    /// The JSON part, without its animation and its buffer views.
    pub(in crate::export) root: json::Root,
    /// The section of positions, normals and displacements.
    pub(super) vertices: Vec<u8>,
    /// The section of the indices of triangles.
    pub(super) indices: Vec<u8>,
    /// The section of the times and values of the animation.
    pub(super) keyframes: Vec<u8>,
    /// The nodes that the animation moves, each with its sampler.
    pub(super) channels: Vec<json::animation::Channel>,
    /// The key frames of the channels, and how to interpolate between them.
    pub(super) samplers: Vec<json::animation::Sampler>,
}

/// Extra data of a node or mesh, for programs that look for it.
pub(in crate::export) fn extras(value: &Value) -> Result<Extras, GltfError> {
    RawValue::from_string(value.to_string()).map(Some).map_err(|e| GltfError::Writer(e.to_string()))
}

impl File {
    /// Puts the nodes under a root node that scales them, and completes the file; `centre` is the scene's, m.
    pub(in crate::export) fn finish(
        mut self,
        children: Vec<Index<json::Node>>,
        unit: &SceneUnit,
        centre: [f64; 3],
        step_labels: &[String],
    ) -> Result<Vec<u8>, GltfError> {
        let root = self.root.push(json::Node {
            name: Some(format!("elastocap scene, scaled by {} (1 unit = {})", unit.scale, unit.label)),
            children: Some(children),
            scale: Some([unit.scale as f32; 3]),
            extras: extras(&serde_json::json!({
                "metres_per_unit": unit.metres,
                "scale": unit.scale,
                "scene_centre_m": centre,
            }))?,
            ..Default::default()
        });
        let scene = self.root.push(json::Scene {
            extensions: None,
            extras: None,
            name: Some("elastocap scene".into()),
            nodes: vec![root],
        });
        self.root.scene = Some(scene);
        self.root.asset = json::Asset {
            generator: Some(concat!("elastocap ", env!("CARGO_PKG_VERSION")).into()),
            extras: extras(&serde_json::json!({
                "about": "Mesh positions and node translations are in metres; the root node scales them for viewing.",
                "metres_per_unit": unit.metres,
                "scale": unit.scale,
                "axes": "x = x1 (in-plane), y = x2 (up), z = x3 (along the width)",
                "load_steps": step_labels,
            }))?,
            ..Default::default()
        };
        self.into_bytes()
    }
}
