//! A layer in plane strain, pressed to given loads on finer and finer meshes; see [`crate::solid::press`].

use std::sync::atomic::AtomicBool;

use super::around_corner::halvings;
use crate::solid::adaptive::{Adaptive, HalvingsAt, Limits};
use crate::solid::dimension::Plane;
use crate::solid::first_mesh::{FirstMesh, fit_to_edges};
use crate::solid::forecast::{MeshSize, PressingRegime};
use crate::solid::layer::{End, Inclusion, Indenter, LayerMesh, LayerModel, include};
use crate::solid::layer_mesh::{check_elements, end_reach};
use crate::solid::mesh::{Mesh, geometric};
use crate::solid::model::{Body, ModelError, State};
use crate::solid::obstacle::IndenterProfile;
use crate::solid::press::{Goal, LeastErrors, Places, Pressing, Refinement, deepest};
use crate::solid::symmetry::Symmetry;
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
    /// `x1` of the middle of a smooth indenter; off the middle of the layer, both its halves are solved. 0
    /// for patches that are held or bonded.
    pub position: f64,
    /// The condition at the end.
    pub end: End,
}

/// Radius of the rounded corners that replace sharp ones, over the thickness or half the width of the punch,
/// whichever is less. Measured:
/// `cargo run --release -p elastocap-mechanics --example sharp_punch -- 1 1e-3 0.01 : 0.01 0.1`.
const SHARP: f64 = FIRST_RADIUS / 64.0;
/// The least error that is stated for such corners. As measured against sharp ones, they take 0.7 % from the
/// force of the smallest loads, under which the surface does not reach their arcs, 0.44 % at a compression of
/// 1 %, and 0.11 to 0.03 % at 5 to 30 %; distances in the layer differ by up to 3e-4. Measured:
/// `cargo run --release -p elastocap-mechanics --example sharp_punch -- 1 1e-3 0.01 : 0.01 0.1`.
const ERRORS_OF_SHARP: LeastErrors = LeastErrors { force: 2e-3, force_at_rest: 8e-3, numbers: 5e-4 };
/// The least error that is stated where a surface slides around corners. The side of an element may pass a
/// corner earlier or later, depending on how Newton's method comes to the equilibrium, and forces differ by
/// up to this. Measured: `benches/layer_errors.py --plane`.
const ERRORS_OF_SLIDING: LeastErrors = LeastErrors { force: 1e-3, force_at_rest: 1e-3, numbers: 0.0 };
/// The least error that is stated where a surface rolls up: the force oscillates by this much, on every mesh,
/// as the roll passes from element to element. Measured:
/// `cargo run --release -p elastocap-mechanics --example free_end`.
const ERRORS_OF_FOLDING: LeastErrors = LeastErrors { force: 3e-3, force_at_rest: 3e-3, numbers: 0.0 };

/// The limits in the plane; `finer` is about the growth of adaptive refinement. Tuned:
/// `benches/layer_growth.py`.
const LIMITS: Limits =
    Limits { meshes: 12, elements: 20_000, finer: 1.85, for_places: 4, smallest_at_corner: 0.01 };
/// Elements over the thickness on the first of the adaptively refined meshes. Tuned:
/// `benches/layer_growth.py`.
const COARSEST: usize = 2;
/// Least radius of the corners of a punch on the first mesh, over the thickness; each further mesh halves it.
/// Tuned: `cargo run --release -p elastocap-mechanics --example sharp_punch -- 1 1e-3 0.01 : 0.01 0.1`.
const FIRST_RADIUS: f64 = 0.25;

/// Least length over the thickness between the edge of a patch and the end of the layer. It is not tuned.
const LEAST_ROOM: f64 = 0.01;
/// Rings around the edge of a patch, and the ratio of the sizes of successive ones: stress is singular there.
/// Tuned: `benches/layer_errors.py --plane`.
const PATCH_RINGS: usize = 8;
const PATCH_SHRINK: f64 = 0.6;
/// Extent of the equal quadrilaterals around the bonded corner of an end that folds, over the thickness, and
/// the growth of their sizes from there. Tuned:
/// `cargo run --release -p elastocap-mechanics --example free_end`, whose third and fourth argument they are.
const ROLL: f64 = 0.1;
const ROLL_GROWTH: f64 = 1.5;
/// Size of the elements at the edges of inclusions on the mesh for an end that folds, over the thickness.
const AT_EDGES: f64 = 0.1;

/// Barrier against `J -> 0` where the surface passes a rounded corner; see [`Rubber::volume_barrier`]. Tuned:
/// `benches/layer_errors.py --plane`.
const ROUNDED_BARRIER: f64 = 20.0;
/// Barrier against `J -> 0` where the surface piles up at a sharp corner. Tuned:
/// `benches/layer_errors.py --plane`.
const SHARP_BARRIER: f64 = 5.0;

/// The model of a flat punch with sharp corners in contact without friction, of this half width on a layer of
/// this thickness (m): its corners are so slightly rounded that the stated errors cover the difference.
pub fn sharp_punch(half_width: f64, thickness: f64) -> Indenter {
    let corner_radius = SHARP * thickness.min(half_width);
    Indenter::Smooth(IndenterProfile::Punch { half_width, corner_radius })
}

impl Refinement {
    /// A refinement to this tolerance, on as many meshes as a layer in the plane may need.
    pub fn to(relative_tolerance: f64) -> Self {
        Self { relative_tolerance, meshes: LIMITS.meshes }
    }
}

impl PlaneLayer {
    /// Presses the layer to each of `goals`, which are all compressions or all forces.
    ///
    /// Each mesh is the one before with the elements cut that have the largest errors in the force and in
    /// `places`. `cancel` stops the work before the next linear system; `report` is called with the number of
    /// the mesh and the number of goals done on it.
    ///
    /// # Errors
    /// [`ModelError`] if no mesh can be made. The error of a goal that is not reached is in the result for
    /// that goal.
    pub fn press(
        &self,
        goals: &[Goal],
        refinement: &Refinement,
        places: Option<&Places<'_, Plane>>,
        cancel: &AtomicBool,
        report: &(dyn Fn(usize, usize) + Sync),
    ) -> Result<Pressing, ModelError> {
        let deepest = deepest(goals);
        let first = || Ok(self.mesh_within_limit(COARSEST, deepest)?.mesh());
        let model = |mesh: Mesh, k: usize| {
            let mut model = self.model(mesh)?;
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
            folds: self.folds(),
            least_errors: self.least_errors(),
            limits: LIMITS,
            memory_limit: u64::MAX, // meshes are small in the plane
        };
        adaptive.press(goals, refinement, places, cancel, report, &|_| ())
    }

    /// The least errors that are stated under this indenter.
    fn least_errors(&self) -> LeastErrors {
        match self.indenter.corner_radius(0.0) {
            Some(radius) if radius <= SHARP * self.thickness => ERRORS_OF_SHARP,
            Some(_) => ERRORS_OF_SLIDING,
            None if self.folds() => ERRORS_OF_FOLDING,
            None => LeastErrors::default(),
        }
    }

    /// The least radius (m) of the corners that the surface bends around on mesh number `k`. On the first
    /// meshes it is larger than that of a punch, around which the surface could not slide with its long
    /// sides. The states found there are inside the punch, which is a fault unless the depth is within the
    /// accepted one.
    fn least_corner_radius(&self, k: usize) -> f64 {
        FIRST_RADIUS * self.thickness * 0.5_f64.powi(k as i32)
    }

    /// This layer at rest on a mesh.
    fn model(&self, mesh: Mesh) -> Result<LayerModel, ModelError> {
        if self.position != 0.0 && self.indenter.patch().is_some() {
            return Err(ModelError::PatchOffTheMiddle);
        }
        let symmetry = if self.position == 0.0 { Symmetry::Half } else { Symmetry::None };
        let length = (1.0 - 1e-9) * self.half_length;
        let mut body = Body::new(mesh, self.rubber_in_use());
        include(&mut body, &self.inclusions);
        let indenter = (self.indenter, self.position);
        LayerModel::with(body, self.thickness, indenter, self.end, symmetry, |x| x[0].abs() > length)
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

    /// The coordinates along an axis at which inclusions begin and end.
    fn edges(&self, axis: usize) -> impl Iterator<Item = f64> {
        self.inclusions.iter().flat_map(move |i| [i.min[axis], i.max[axis]])
    }

    /// A mesh with about `n` elements over the thickness, for compressions up to `deepest`.
    pub fn mesh(&self, n: usize, deepest: f64) -> LayerMesh {
        if !self.folds() {
            let mut section = self.first_mesh(deepest).section(n);
            if let Some(fan) = &mut section.punch {
                fan.radii = geometric(PATCH_SHRINK, PATCH_RINGS);
            }
            return section;
        }
        // The roll at the corner is small at small loads, and the rest of the layer is smooth.
        let (height, length) = (self.thickness, self.half_length);
        let mut mesh = LayerMesh::folding_end(height, length, 2 * n, 12 * n, ROLL, ROLL_GROWTH);
        for (axis, breakpoints) in [&mut mesh.along, &mut mesh.up].into_iter().enumerate() {
            fit_to_edges(breakpoints, &[], &self.edges(axis).collect::<Vec<f64>>(), AT_EDGES * height);
        }
        mesh
    }

    /// The largest distance from the middle along `x1` to which inclusions may extend, in m: the elements
    /// beyond are shaped by the end of the layer.
    pub fn room(&self) -> f64 {
        self.half_length - end_reach(self.thickness, self.half_length, self.indenter.patch().unwrap_or(0.0))
    }

    /// Refuses a patch whose edge has no room for elements around it before the end of the layer.
    ///
    /// # Errors
    /// [`ModelError::NoRoom`].
    pub fn check_room(&self) -> Result<(), ModelError> {
        let room = self.half_length - self.indenter.patch().unwrap_or(0.0);
        if room > LEAST_ROOM * self.thickness { Ok(()) } else { Err(ModelError::NoRoom) }
    }

    /// The sizes of the meshes that may be solved on, coarse to fine: that of the first mesh, and approximate
    /// sizes of the finer ones.
    ///
    /// # Errors
    /// [`ModelError`] where there is no first mesh.
    pub fn mesh_sizes(&self, deepest: f64) -> Result<Vec<MeshSize>, ModelError> {
        Ok(LIMITS.sizes(&self.mesh_within_limit(COARSEST, deepest)?.mesh()))
    }

    /// The kind of pressing, which decides how many linear systems a load takes.
    pub fn regime(&self) -> PressingRegime {
        match self.indenter {
            Indenter::WholeTop if self.folds() => PressingRegime::Folds,
            Indenter::Held { .. } | Indenter::Bonded { .. } => PressingRegime::Patch,
            Indenter::WholeTop | Indenter::Smooth(_) => PressingRegime::Smooth,
        }
    }

    /// The rubber with the barrier that the corners need; see [`Rubber::volume_barrier`].
    pub(super) fn rubber_in_use(&self) -> Rubber {
        let without = self.rubber.volume_barrier == 0.0 || self.folds();
        let needed = match self.indenter {
            Indenter::Smooth(_) => ROUNDED_BARRIER,
            Indenter::Held { .. } | Indenter::Bonded { .. } => SHARP_BARRIER,
            Indenter::WholeTop => self.rubber.volume_barrier,
        };
        let volume_barrier = if without { 0.0 } else { needed };
        Rubber { volume_barrier, ..self.rubber.clone() }
    }

    /// Whether the end folds through itself at the bonded corner, as a free end without a substrate does. A
    /// rubber whose energy is defined for `J > 0` only cannot follow: its mesh gets a fan there, and is too
    /// stiff.
    pub(super) fn folds(&self) -> bool {
        let smooth = Rubber { volume_barrier: 0.0, ..self.rubber.clone() };
        self.indenter == Indenter::WholeTop && self.end == End::Free && smooth.knows_inside_out()
    }

    /// The mesh of [`PlaneLayer::mesh`], unless it has too many elements.
    ///
    /// # Errors
    /// [`ModelError::TooManyElements`], [`ModelError::NoRoom`].
    pub fn mesh_within_limit(&self, n: usize, deepest: f64) -> Result<LayerMesh, ModelError> {
        let mesh = self.mesh(n, deepest);
        check_elements(mesh.elements_at_most())?;
        mesh.check()?;
        Ok(mesh)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn problem(indenter: Indenter, end: End) -> PlaneLayer {
        PlaneLayer {
            thickness: 1.0,
            half_length: 6.0,
            rubber: Rubber::neo_hookean(1.0),
            inclusions: Vec::new(),
            indenter,
            position: 0.0,
            end,
        }
    }

    #[test]
    fn an_indenter_anywhere_up_to_the_end_has_a_sound_mesh_or_no_room() {
        for half_length in [0.5, 1.0, 1.2, 2.0, 6.0] {
            for reach in (1..24).map(|k| 0.05 * f64::from(k) * half_length) {
                let profile = IndenterProfile::Punch { half_width: 0.5 * reach, corner_radius: 0.02 };
                for (indenter, position) in [
                    (sharp_punch(reach, 1.0), 0.0),
                    (Indenter::Held { half_width: reach }, 0.0),
                    (Indenter::Bonded { half_width: reach }, 0.0),
                    (Indenter::Smooth(profile), 0.0),
                    (Indenter::Smooth(profile), 0.5 * reach),
                    (Indenter::Smooth(IndenterProfile::Cylinder { radius: 1.0 }), -reach),
                ] {
                    let layer =
                        PlaneLayer { half_length, position, ..problem(indenter, End::FreeOnSubstrate) };
                    for compression in [0.01, 0.3] {
                        let mesh = layer.mesh_within_limit(COARSEST, compression);
                        let room = layer.check_room();
                        assert!(mesh.is_ok() || room.is_err(), "{indenter:?} on {half_length}: {mesh:?}");
                        assert!(room.is_ok() || reach > 0.98 * half_length, "{indenter:?} on {half_length}");
                        if let (Ok(mesh), Ok(())) = (mesh, room) {
                            let sound = layer.model(mesh.mesh()).map(|_| ());
                            assert_eq!(sound, Ok(()), "{indenter:?} on {half_length}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn the_edges_of_inclusions_are_sides_of_elements_under_any_indenter() {
        let inclusion = Inclusion { min: [0.1, 0.48], max: [0.7, 0.52], rubber: Rubber::neo_hookean(11.0) };
        let rounded = Indenter::Smooth(IndenterProfile::Punch { half_width: 1.0, corner_radius: 0.05 });
        let held = Indenter::Held { half_width: 1.0 };
        let cylinder = Indenter::Smooth(IndenterProfile::Cylinder { radius: 1.0 });
        for (indenter, position) in
            [(rounded, 0.0), (rounded, 0.4), (held, 0.0), (cylinder, 0.0), (Indenter::WholeTop, 0.0)]
        {
            let layer =
                PlaneLayer { inclusions: vec![inclusion.clone()], position, ..problem(indenter, End::Free) };
            let mesh = layer.mesh(COARSEST, 0.1);
            let has = |lines: &[f64], edge: f64| lines.iter().any(|x| (x - edge).abs() < 1e-9);
            for (axis, lines) in [&mesh.along, &mesh.up].into_iter().enumerate() {
                for edge in [inclusion.min[axis], inclusion.max[axis]] {
                    assert!(has(lines, edge), "{indenter:?} at {position}: {edge} is not in {lines:?}");
                }
            }
        }
    }
}
