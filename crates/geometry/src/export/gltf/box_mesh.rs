//! Meshes of bodies that are boxes or sheets: faces, normals, and a morph target for each load step
//! but the first.

use gltf_json as json;
use json::Index;
use json::accessor::{ComponentType, Type};

use super::buffers::{INDICES, accessor, append, triangles};
use super::document::{File, extras};
use super::{GltfError, SceneBody};
use crate::scene::Box3;

/// The surface that a box is drawn with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum BoxSurface {
    /// Six faces with flat normals.
    Solid,
    /// One face across this axis, 0 to 2 for x1 to x3, seen from both sides.
    Sheet(usize),
}

/// A corner of a box: for each axis, whether it lies at the upper bound.
type Corner = [bool; 3];

impl BoxSurface {
    /// A sheet if the body is one at every step, across the same axis; a solid may be flat at some steps.
    pub(super) fn of(poses: &[Box3]) -> Self {
        match poses.first().and_then(Box3::sheet_normal) {
            Some(axis) if poses.iter().all(|p| p.extent(axis) == 0.0) => Self::Sheet(axis),
            _ => Self::Solid,
        }
    }

    /// Each face as the axis across it, and whether it is the upper one of the two.
    fn faces(self) -> Vec<(usize, bool)> {
        match self {
            Self::Sheet(axis) => vec![(axis, true)],
            Self::Solid => (0..3).flat_map(|axis| [(axis, false), (axis, true)]).collect(),
        }
    }

    /// The corners of all faces with their normals, four for each face, counter-clockwise as seen from
    /// outside.
    fn corners(self) -> Vec<(Corner, [f32; 3])> {
        let mut out = Vec::with_capacity(24);
        for (axis, upper) in self.faces() {
            // (axis, u, v) is a cyclic permutation, hence right-handed.
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let around = [(false, false), (true, false), (true, true), (false, true)];
            let mut normal = [0.0; 3];
            normal[axis] = if upper { 1.0 } else { -1.0 };
            for turn in 0..4 {
                let (at_u, at_v) = if upper { around[turn] } else { around[3 - turn] };
                let mut corner = [upper; 3];
                corner[u] = at_u;
                corner[v] = at_v;
                out.push((corner, normal));
            }
        }
        out
    }

    /// Two triangles for each face, as indices into the corners.
    fn indices(self) -> Vec<u16> {
        let faces = self.faces().len() as u16;
        (0..faces).flat_map(|f| [0, 1, 2, 0, 2, 3].map(|i| 4 * f + i)).collect()
    }
}

/// Normals and indices that are written once for all bodies with the same surface.
#[derive(Default)]
pub(super) struct SharedSurfaces {
    /// The surfaces written so far, each with its normals and its indices.
    known: Vec<(BoxSurface, Index<json::Accessor>, Index<json::Accessor>)>,
}

impl File {
    /// The mesh of a body, with positions relative to the point `home`, and its displacements from step 0 as
    /// morph targets.
    pub(super) fn mesh(
        &mut self,
        body: &SceneBody,
        surface: BoxSurface,
        home: [f64; 3],
        material: Index<json::Material>,
        step_labels: &[String],
        shared: &mut SharedSurfaces,
    ) -> Result<Index<json::Mesh>, GltfError> {
        let corners = surface.corners();
        let (normals, indices) = self.surface_accessors(surface, &corners, shared);
        let place = |pose: &Box3| -> Vec<[f64; 3]> {
            let at = |corner: &Corner, a: usize| if corner[a] { pose.max[a] } else { pose.min[a] };
            corners.iter().map(|(corner, _)| [0, 1, 2].map(|a| at(corner, a) - home[a])).collect()
        };
        let base: Vec<[f32; 3]> = match body.poses.first() {
            Some(pose) => place(pose).iter().map(|p| p.map(|x| x as f32)).collect(),
            None => Vec::new(),
        };
        let positions = self.vectors(&base, true);
        let mut targets = Vec::new();
        for pose in body.poses.iter().skip(1).filter(|_| body.moves()) {
            // The displacement starts from the rounded base, so that base + displacement is as near to the
            // pose as 32 bits allow.
            let displacement: Vec<[f32; 3]> = (place(pose).iter().zip(&base))
                .map(|(to, from)| [0, 1, 2].map(|a| (to[a] - f64::from(from[a])) as f32))
                .collect();
            targets.push(json::mesh::MorphTarget {
                positions: Some(self.vectors(&displacement, true)),
                normals: None,
                tangents: None,
            });
        }
        let target_names = serde_json::json!({ "targetNames": step_labels.get(1..) });
        let mut mesh = triangles(&body.name, material, positions, normals);
        mesh.primitives[0].indices = Some(indices);
        if body.moves() {
            mesh.extras = extras(&target_names)?;
            mesh.weights = Some(vec![0.0; targets.len()]);
            mesh.primitives[0].targets = Some(targets);
        }
        Ok(self.root.push(mesh))
    }

    /// Normals and indices of a surface, written at its first use.
    fn surface_accessors(
        &mut self,
        surface: BoxSurface,
        corners: &[(Corner, [f32; 3])],
        shared: &mut SharedSurfaces,
    ) -> (Index<json::Accessor>, Index<json::Accessor>) {
        if let Some((_, normals, indices)) = shared.known.iter().find(|(known, ..)| *known == surface) {
            return (*normals, *indices);
        }
        let directions: Vec<[f32; 3]> = corners.iter().map(|(_, normal)| *normal).collect();
        let normals = self.vectors(&directions, false);
        let bytes = append(&mut self.indices, surface.indices().into_iter().map(u16::to_le_bytes));
        let indices = self.root.push(accessor(INDICES, bytes, ComponentType::U16, Type::Scalar));
        shared.known.push((surface, normals, indices));
        (normals, indices)
    }
}
