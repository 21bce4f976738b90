//! A layer in plane strain on meshes that are refined where the errors are made: under plates and cylinders.

use std::sync::atomic::AtomicBool;

use super::adaptive::{Adaptive, Limits};
use super::dimension::Plane;
use super::first_mesh::FirstMesh;
use super::forecast::MeshSize;
use super::layer::{Indenter, LayerMesh, LayerModel, Symmetry, include};
use super::mesh::Mesh;
use super::model::{Body, ModelError};
use super::press::{Goal, LEVELS, Places, PlaneLayer, Pressing, Refinement, deepest};

const LIMITS: Limits =
    Limits { meshes: 12, elements: 20_000, finer: 1.85, for_places: 4, smallest_at_corner: 0.01 };
/// Elements over the thickness on the first mesh.
const COARSEST: usize = 2;

impl Refinement {
    /// As many meshes as a layer in the plane may need.
    pub fn to(relative_tolerance: f64) -> Self {
        Self { relative_tolerance, meshes: (0..LIMITS.meshes).collect() }
    }
}

impl PlaneLayer {
    /// Whether its meshes are refined where the errors are made. Where a surface slides around a corner or folds, elements have to be of the right
    /// shapes there before they are pressed.
    pub fn is_refined(&self) -> bool {
        match self.indenter {
            Indenter::WholeTop => !self.folds(),
            Indenter::Smooth(profile) => profile.flat_face().is_none(),
            Indenter::Sharp { .. } | Indenter::Held { .. } | Indenter::Bonded { .. } => false,
        }
    }

    /// Presses the layer to each of `goals` on such meshes; see [`PlaneLayer::press`].
    pub(super) fn press_refined(
        &self,
        goals: &[Goal],
        refinement: &Refinement,
        places: Option<&Places<'_, Plane>>,
        cancel: &AtomicBool,
        tell: &(dyn Fn(usize, usize) + Sync),
    ) -> Result<Pressing, ModelError> {
        let deepest = deepest(goals);
        let first = || Ok(self.mesh_within_limit(0, deepest)?.mesh());
        let model = |mesh: Mesh| {
            let length = (1.0 - 1e-9) * self.half_length;
            let mut body = Body::new(mesh, self.rubber_in_use());
            include(&mut body, &self.inclusions);
            let symmetry = if self.position == 0.0 { Symmetry::Half } else { Symmetry::None };
            let indenter = (self.indenter, self.position);
            let outside = |x: [f64; 2]| x[0].abs() > length;
            LayerModel::with(body, self.thickness, indenter, None, self.end, symmetry, outside)
        };
        let adaptive = Adaptive {
            thickness: self.thickness,
            first: &first,
            model: &model,
            is_rounded: self.indenter.is_rounded(),
            limits: LIMITS,
            memory_limit: u64::MAX, // they are small in the plane
        };
        adaptive.press(goals, refinement, places, cancel, tell)
    }

    /// The first of these meshes for compressions up to `deepest`, or one like it whose elements are half as large for each level.
    pub(super) fn first_mesh(&self, level: usize, deepest: f64) -> LayerMesh {
        let first = FirstMesh {
            thickness: self.thickness,
            half_length: self.half_length,
            edges: [self.edges(0).collect(), self.edges(1).collect(), Vec::new()],
            indenter: self.indenter,
            position: self.position,
            end: self.end,
            deepest,
        };
        first.section(COARSEST << level)
    }

    /// The sizes of the meshes that may be solved on, coarse to fine; where they are refined, the finer ones about.
    ///
    /// # Errors
    /// [`ModelError`] where there is no first mesh.
    pub fn mesh_sizes(&self, deepest: f64) -> Result<Vec<MeshSize>, ModelError> {
        let on_level = |level: usize| self.mesh_within_limit(level, deepest).map(|mesh| mesh.mesh());
        let first = on_level(0)?;
        if self.is_refined() {
            return Ok(LIMITS.sizes(&first));
        }
        let size = |mesh: Mesh| {
            let elements = mesh.elements.len();
            MeshSize { elements, unknowns: 2 * mesh.nodes.len() + 3 * elements }
        };
        // The first mesh with too many elements ends the refinement.
        let finer = (1..LEVELS).map_while(|level| on_level(level).ok());
        Ok(std::iter::once(first).chain(finer).map(size).collect())
    }
}
