//! A layer in plane strain on meshes that are refined where the errors are made: under plates and cylinders.

use std::sync::atomic::AtomicBool;

use super::adaptive::Adaptive;
use super::dimension::Plane;
use super::first_mesh::FirstMesh;
use super::forecast::MeshSize;
use super::layer::{Indenter, LayerMesh, LayerModel, Symmetry, include};
use super::levels::within_limit;
use super::mesh::Mesh;
use super::model::{Body, ModelError};
use super::newton::NewtonSettings;
use super::press::{Goal, Places, PlaneLayer, Pressing, Refinement, deepest};

/// Meshes, at most, and the elements from which on no finer one is made.
const MESHES: usize = 12;
const ENOUGH: usize = 20_000;
/// About how many times as many elements the next one has.
const FINER: f64 = 1.85;
/// Elements over the thickness on the first one.
const COARSEST: usize = 2;
/// Meshes, at most, that are solved on for places after the force is known.
const FOR_PLACES: usize = 4;
/// Size of the elements in the middle of a fan, over the thickness, below which they are not cut.
const SMALLEST_AT_CORNER: f64 = 0.01;

impl Refinement {
    /// As many meshes as a layer in the plane may need.
    pub fn to(relative_tolerance: f64) -> Self {
        Self { relative_tolerance, meshes: (0..MESHES).collect() }
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
        // Gaps of 1e-5 sides of the mesh where the pressure is the shear modulus change a force by less than 1e-4.
        let settings = NewtonSettings {
            tolerance: 1e-7,
            first_step: if self.indenter.is_rounded() { 0.5 } else { 1.0 },
            moving_gap: 3e-3,
            final_gap: 1e-5,
            first_gap: 3e-5,
            ..Default::default()
        };
        let deepest = deepest(goals);
        let first = || Ok(self.first_mesh(deepest)?.mesh());
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
            settings,
            smallest_at_corner: SMALLEST_AT_CORNER,
            for_places: FOR_PLACES,
            enough: ENOUGH,
            memory_limit: u64::MAX, // they are small in the plane
        };
        adaptive.press(goals, refinement, places, cancel, tell)
    }

    /// The first of these meshes, for compressions up to `deepest`.
    ///
    /// # Errors
    /// [`ModelError::NoRoom`], [`ModelError::TooManyElements`].
    fn first_mesh(&self, deepest: f64) -> Result<LayerMesh, ModelError> {
        if self.half_length <= self.thickness {
            return Err(ModelError::NoRoom);
        }
        let first = FirstMesh {
            thickness: self.thickness,
            half_length: self.half_length,
            edges: [self.edges(0).collect(), self.edges(1).collect(), Vec::new()],
            indenter: self.indenter,
            position: self.position,
            end: self.end,
            deepest,
        };
        let section = first.section(COARSEST);
        within_limit(section.elements_at_most())?;
        section.check()?;
        Ok(section)
    }

    /// The sizes of the meshes that may be solved on, coarse to fine; where they are refined, the finer ones about.
    ///
    /// # Errors
    /// [`ModelError`] where there is no first mesh.
    pub fn mesh_sizes(&self, deepest: f64) -> Result<Vec<MeshSize>, ModelError> {
        let size = |mesh: &LayerMesh| {
            let mesh = mesh.mesh();
            let elements = mesh.elements.len();
            MeshSize { elements, unknowns: 2 * mesh.nodes.len() + 3 * elements }
        };
        if !self.is_refined() {
            let [first, finer @ ..] = [0, 1, 2, 3].map(|level| self.mesh_within_limit(level, deepest));
            // The first mesh with too many elements ends the refinement.
            let finer = finer.into_iter().map_while(Result::ok);
            return Ok(std::iter::once(first?).chain(finer).map(|mesh| size(&mesh)).collect());
        }
        let first = size(&self.first_mesh(deepest)?);
        let of = |k: usize| {
            let [elements, unknowns] =
                [first.elements, first.unknowns].map(|n| (n as f64 * FINER.powi(k as i32)) as usize);
            MeshSize { elements, unknowns }
        };
        let begun = |k: &usize| *k == 0 || of(k - 1).elements <= ENOUGH;
        Ok((0..MESHES).take_while(begun).map(of).collect())
    }
}
