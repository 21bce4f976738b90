//! A layer in plane strain, pressed to given loads on finer and finer meshes; see [`crate::solid::press`].

use std::sync::atomic::AtomicBool;

use super::around_corner::halvings;
use super::meshes::halved;
use crate::solid::adaptive::{Adaptive, HalvingsAt, Limits};
use crate::solid::dimension::Plane;
use crate::solid::first_mesh::FirstMesh;
use crate::solid::forecast::{MeshSize, PressingRegime};
use crate::solid::layer::{End, Inclusion, Indenter, LayerMesh, LayerModel, Symmetry, include};
use crate::solid::layer_mesh::check_elements;
use crate::solid::mesh::Mesh;
use crate::solid::model::{Body, ModelError, State};
use crate::solid::newton::NewtonSettings;
use crate::solid::press::{
    Goal, Layers, Level, Meshed, Places, Pressing, Refinement, Remesh, deepest, press_on,
};
use elastocap_materials::Rubber;

/// A layer in plane strain, the bodies in it and its indenter. Lengths in m.
#[derive(Debug, Clone, PartialEq)]
pub struct PlaneLayer {
    /// Thickness `H` at rest.
    pub thickness: f64,
    /// From the middle of the layer to its end, at rest.
    pub half_length: f64,
    /// The rubber of the layer.
    pub rubber: Rubber,
    /// Bodies of another rubber in it.
    pub inclusions: Vec<Inclusion>,
    /// The indenter.
    pub indenter: Indenter,
    /// `x1` of the middle of a smooth indenter; off the middle of the layer, both its halves are solved. 0 for sharp punches and patches.
    pub position: f64,
    /// The condition at the end.
    pub end: End,
}

const LIMITS: Limits =
    Limits { meshes: 12, elements: 20_000, finer: 1.85, for_places: 4, smallest_at_corner: 0.01 };
/// Elements over the thickness on the first mesh that is refined where the errors are made.
const COARSEST: usize = 2;
/// Least radius of the corners of a punch on the first of them, over the thickness; each further mesh halves it.
const FIRST_RADIUS: f64 = 0.25;

/// Barrier against `J -> 0` where the surface passes a rounded corner; see [`Rubber::volume_barrier`].
const ROUNDED_BARRIER: f64 = 20.0;
/// Barrier against `J -> 0` where the surface piles up at a sharp corner.
const SHARP_BARRIER: f64 = 5.0;

/// Least relative error of a force, or of a compression, where a surface rolls up: the force goes up and down by so much as the roll passes
/// from element to element, on every mesh, so that the difference between meshes may be smaller by accident.
const JUMPS: f64 = 3e-3;

impl Refinement {
    /// As many meshes as a layer in the plane may need.
    pub fn to(relative_tolerance: f64) -> Self {
        Self { relative_tolerance, meshes: (0..LIMITS.meshes).collect() }
    }
}

impl PlaneLayer {
    /// Presses the layer to each of `goals`, all of them compressions or all of them forces.
    ///
    /// Each mesh is the one before with those elements cut in which the errors are made, so that the `places` are known too.
    /// Punches with sharp corners and ends that fold need elements of the right shapes there: they have up to four meshes made
    /// for that, and places are not asked for. `cancel` stops the work before the next linear system; `tell` is called with the
    /// number of the mesh and the number of goals done on it.
    ///
    /// # Errors
    /// [`ModelError`] where there is no mesh. A goal that is not reached has its own error in the result.
    pub fn press(
        &self,
        goals: &[Goal],
        refinement: &Refinement,
        places: Option<&Places<'_, Plane>>,
        cancel: &AtomicBool,
        tell: &(dyn Fn(usize, usize) + Sync),
    ) -> Result<Pressing, ModelError> {
        if self.regime().has_levels() {
            return self.press_on_levels(goals, refinement, cancel, tell);
        }
        let deepest = deepest(goals);
        let first = || Ok(self.mesh_within_limit(0, deepest)?.mesh());
        let model = |mesh: Mesh, k: usize| {
            let mut model = self.model(mesh, None)?;
            model.round_corners(self.least_corner_radius(k));
            Ok(model)
        };
        let corners =
            |model: &LayerModel, state: &State, k: usize| halvings(model, state, self.least_corner_radius(k));
        let has_corners = self.indenter.corner_radius(0.0).is_some();
        let adaptive = Adaptive {
            thickness: self.thickness,
            first: &first,
            model: &model,
            halvings: has_corners.then_some(&corners as &HalvingsAt<'_, Plane>),
            is_rounded: self.indenter.is_rounded(),
            limits: LIMITS,
            memory_limit: u64::MAX, // they are small in the plane
        };
        adaptive.press(goals, refinement, places, cancel, tell)
    }

    /// Presses it on the meshes of [`PlaneLayer::mesh`], each of which halves what limits the accuracy of the one before.
    fn press_on_levels(
        &self,
        goals: &[Goal],
        refinement: &Refinement,
        cancel: &AtomicBool,
        tell: &(dyn Fn(usize, usize) + Sync),
    ) -> Result<Pressing, ModelError> {
        let deepest = deepest(goals);
        // The surface slides around sharp corners: each load has a mesh of its own.
        let press_sharp = match self.indenter {
            Indenter::Sharp { half_width } => {
                Some(move |k: usize, coarser: Option<(&LayerModel, &State)>, goal: Goal| {
                    let settings = NewtonSettings { cancel: Some(cancel), ..NewtonSettings::default() };
                    self.press_sharp(half_width, refinement.meshes[k], coarser, goal, &settings)
                })
            }
            _ => None,
        };
        let settings = if self.folds() { NewtonSettings::through_folds() } else { NewtonSettings::default() };
        let meshed = |k: usize, _: &[Level], _: &[usize]| {
            let level = *refinement.meshes.get(k)?;
            let mesh = self.levels().contains(&level).then(|| self.mesh_within_limit(level, deepest))?;
            let model = mesh.and_then(|mesh| self.model_on(&mesh));
            Some(model.map(|model| Meshed { model, mesh: None, size: halved(level), settings }))
        };
        let layers = Layers {
            meshed: &meshed,
            room_for_two: &|_| true, // they are small in the plane
            remesh: press_sharp.as_ref().map(|press| press as &Remesh<'_, Plane>),
            estimates: false,
            scatter: if self.folds() { JUMPS } else { 0.0 },
            places: None,
            for_places: 0,
        };
        press_on(goals, refinement, &layers, cancel, tell)
    }

    /// The least radius (m) of the corners that the surface bends around on mesh number `k`. It is larger than that of a punch on
    /// the first meshes, on whose long sides the surface could not slide around it. What is found there lies inside the punch,
    /// which is a fault unless it is by as little as in any state that counts.
    fn least_corner_radius(&self, k: usize) -> f64 {
        FIRST_RADIUS * self.thickness * halved(k)
    }

    /// This layer at rest on a mesh.
    ///
    /// # Errors
    /// See [`ModelError`].
    pub(super) fn model_on(&self, mesh: &LayerMesh) -> Result<LayerModel, ModelError> {
        mesh.check()?;
        self.model(mesh.mesh(), mesh.punch.as_ref().map(|fan| fan.corner))
    }

    /// This layer at rest on a mesh; the point `contact_end` (m) of the surface, if there is one, lies at the corner of a sharp punch.
    fn model(&self, mesh: Mesh, contact_end: Option<f64>) -> Result<LayerModel, ModelError> {
        if self.position != 0.0 && self.indenter.sharp_corner().is_some() {
            return Err(ModelError::SharpOffTheMiddle);
        }
        let symmetry = if self.position == 0.0 { Symmetry::Half } else { Symmetry::None };
        let length = (1.0 - 1e-9) * self.half_length;
        let mut body = Body::new(mesh, self.rubber_in_use());
        include(&mut body, &self.inclusions);
        let indenter = (self.indenter, self.position);
        LayerModel::with(body, self.thickness, indenter, contact_end, self.end, symmetry, |x| {
            x[0].abs() > length
        })
    }

    /// The first of the meshes that are refined where the errors are made, for compressions up to `deepest`.
    pub(super) fn first_mesh(&self, deepest: f64) -> FirstMesh {
        FirstMesh {
            thickness: self.thickness,
            half_length: self.half_length,
            edges: [self.edges(0).collect(), self.edges(1).collect(), Vec::new()],
            indenter: self.indenter,
            position: self.position,
            end: self.end,
            deepest,
        }
    }

    /// Elements over the thickness on the first of these meshes, and on those that halve its elements.
    pub(super) fn cells(level: usize) -> usize {
        COARSEST << level
    }

    /// The sizes of the meshes that may be solved on, coarse to fine: of those that are refined the first as it is, the finer ones
    /// about.
    ///
    /// # Errors
    /// [`ModelError`] where there is no first mesh.
    pub fn mesh_sizes(&self, deepest: f64) -> Result<Vec<MeshSize>, ModelError> {
        let size = |mesh: &LayerMesh| {
            let mesh = mesh.mesh();
            let elements = mesh.elements.len();
            MeshSize { elements, unknowns: 2 * mesh.nodes.len() + 3 * elements }
        };
        if self.regime().has_levels() {
            let on_level = |level: usize| self.mesh_within_limit(level, deepest);
            let first = size(&on_level(0)?);
            // The first mesh with too many elements ends the refinement.
            let finer = self.levels().skip(1).map_while(|level| on_level(level).ok());
            return Ok(std::iter::once(first).chain(finer.map(|mesh| size(&mesh))).collect());
        }
        Ok(LIMITS.sizes(&self.mesh_within_limit(0, deepest)?.mesh()))
    }

    /// The kind of pressing, which decides how many linear systems a load takes.
    pub fn regime(&self) -> PressingRegime {
        match self.indenter {
            Indenter::WholeTop if self.folds() => PressingRegime::Folds,
            Indenter::Sharp { .. } => PressingRegime::Sharp,
            Indenter::Held { .. } | Indenter::Bonded { .. } => PressingRegime::Patch,
            Indenter::WholeTop | Indenter::Smooth(_) => PressingRegime::Smooth,
        }
    }

    /// The rubber with the barrier that the corners need; see [`Rubber::volume_barrier`].
    pub(super) fn rubber_in_use(&self) -> Rubber {
        let without = self.rubber.volume_barrier == 0.0 || self.folds();
        let needed = match self.indenter {
            Indenter::Smooth(_) => ROUNDED_BARRIER,
            Indenter::Sharp { .. } | Indenter::Held { .. } | Indenter::Bonded { .. } => SHARP_BARRIER,
            Indenter::WholeTop => self.rubber.volume_barrier,
        };
        let volume_barrier = if without { 0.0 } else { needed };
        Rubber { volume_barrier, ..self.rubber.clone() }
    }

    /// Whether the end folds through itself at the bonded corner, as a free end without a substrate does. A rubber whose energy is
    /// defined for `J > 0` only cannot follow: its mesh gets a fan there, and is too stiff.
    pub(super) fn folds(&self) -> bool {
        let smooth = Rubber { volume_barrier: 0.0, ..self.rubber.clone() };
        self.indenter == Indenter::WholeTop && self.end == End::Free && smooth.knows_inside_out()
    }

    /// The mesh of [`PlaneLayer::mesh`], unless it has too many elements.
    ///
    /// # Errors
    /// [`ModelError::TooManyElements`], [`ModelError::NoRoom`].
    pub fn mesh_within_limit(&self, level: usize, deepest: f64) -> Result<LayerMesh, ModelError> {
        let mesh = self.mesh(level, deepest)?;
        check_elements(mesh.elements_at_most())?;
        mesh.check()?;
        Ok(mesh)
    }
}
