//! The binary part of the file: sections of bytes, typed views of them, and the file put together.

use std::ops::Range;

use gltf::binary::{Glb, Header};
use gltf_json as json;
use json::Index;
use json::accessor::{ComponentType, GenericComponentType, Type};
use json::validation::Checked::Valid;
use json::validation::USize64;

use super::GltfError;
use super::document::File;

/// The number of the section of vertices. Accessors name their section of the binary part by its number until
/// [`File::into_bytes`] makes a buffer view of each section that is not empty.
pub(super) const VERTICES: u32 = 0;
/// The number of the section of indices.
pub(super) const INDICES: u32 = 1;
/// The number of the section of key frames.
pub(super) const KEYFRAMES: u32 = 2;

/// A typed view of the range `bytes` of a section.
pub(super) fn accessor(
    section: u32,
    bytes: Range<usize>,
    component: ComponentType,
    kind: Type,
) -> json::Accessor {
    let size = component.size() * kind.multiplicity();
    json::Accessor {
        buffer_view: Some(Index::new(section)),
        byte_offset: Some(USize64::from(bytes.start)),
        count: USize64::from(bytes.len() / size),
        component_type: Valid(GenericComponentType(component)),
        extensions: None,
        extras: None,
        type_: Valid(kind),
        min: None,
        max: None,
        name: None,
        normalized: false,
        sparse: None,
    }
}

/// Appends items to a section. Returns their range of bytes in it.
pub(super) fn append<const N: usize>(
    section: &mut Vec<u8>,
    items: impl IntoIterator<Item = [u8; N]>,
) -> Range<usize> {
    let start = section.len();
    section.extend(items.into_iter().flatten());
    start..section.len()
}

/// A mesh of triangles, without indices yet: each three corners in a row are a triangle.
pub(in crate::export) fn triangles(
    name: &str,
    material: Index<json::Material>,
    positions: Index<json::Accessor>,
    normals: Index<json::Accessor>,
) -> json::Mesh {
    json::Mesh {
        extensions: None,
        extras: None,
        name: Some(name.to_owned()),
        weights: None,
        primitives: vec![json::mesh::Primitive {
            attributes: [
                (Valid(json::mesh::Semantic::Positions), positions),
                (Valid(json::mesh::Semantic::Normals), normals),
            ]
            .into(),
            extensions: None,
            extras: None,
            indices: None,
            material: Some(material),
            mode: Valid(json::mesh::Mode::Triangles),
            targets: None,
        }],
    }
}

impl File {
    /// Appends vectors, with their exact bounds if `bounds` is set: the format demands these for positions.
    pub(in crate::export) fn vectors(&mut self, vectors: &[[f32; 3]], bounds: bool) -> Index<json::Accessor> {
        let bytes = append(&mut self.vertices, vectors.iter().flatten().map(|x| x.to_le_bytes()));
        let mut entry = accessor(VERTICES, bytes, ComponentType::F32, Type::Vec3);
        if bounds {
            let extreme = |pick: fn(f32, f32) -> f32, start: f32| {
                vectors.iter().fold([start; 3], |b, v| [0, 1, 2].map(|a| pick(b[a], v[a])))
            };
            entry.min = Some(extreme(f32::min, f32::INFINITY).to_vec().into());
            entry.max = Some(extreme(f32::max, f32::NEG_INFINITY).to_vec().into());
        }
        self.root.push(entry)
    }

    /// The whole file: JSON, then the sections one after the other.
    pub(super) fn into_bytes(mut self) -> Result<Vec<u8>, GltfError> {
        use json::buffer::{Buffer, Stride, Target, View};
        if !self.channels.is_empty() {
            self.root.animations.push(json::Animation {
                extensions: None,
                extras: None,
                channels: std::mem::take(&mut self.channels),
                name: Some("load steps".into()),
                samplers: std::mem::take(&mut self.samplers),
            });
        }
        let mut bin: Vec<u8> = Vec::new();
        let sections = [
            (&self.vertices, Some(12), Some(Target::ArrayBuffer), "vertices"),
            (&self.indices, None, Some(Target::ElementArrayBuffer), "indices"),
            (&self.keyframes, None, None, "keyframes"),
        ];
        let mut views = [Index::new(0); 3];
        for ((section, stride, target, name), view) in sections.into_iter().zip(&mut views) {
            if section.is_empty() {
                continue;
            }
            *view = Index::new(self.root.buffer_views.len() as u32);
            bin.resize(bin.len().next_multiple_of(4), 0);
            self.root.buffer_views.push(View {
                buffer: Index::new(0),
                byte_length: USize64::from(section.len()),
                byte_offset: Some(USize64::from(bin.len())),
                byte_stride: stride.map(Stride),
                name: Some(name.into()),
                target: target.map(Valid),
                extensions: None,
                extras: None,
            });
            bin.extend_from_slice(section);
        }
        for accessor in &mut self.root.accessors {
            accessor.buffer_view =
                accessor.buffer_view.and_then(|section| views.get(section.value()).copied());
        }
        bin.resize(bin.len().next_multiple_of(4), 0);
        self.root.buffers.push(Buffer {
            byte_length: USize64::from(bin.len()),
            name: None,
            uri: None,
            extensions: None,
            extras: None,
        });
        let json = self.root.to_vec().map_err(|e| GltfError::Writer(e.to_string()))?;
        // Two headers of 8 bytes, one of 12, and padding.
        let length = u32::try_from(json.len() + bin.len() + 32).map_err(|_| GltfError::TooLarge)?;
        let file = Glb {
            header: Header { magic: *b"glTF", version: 2, length },
            json: json.into(),
            bin: Some(bin.into()),
        };
        file.to_vec().map_err(|e| GltfError::Writer(e.to_string()))
    }
}
