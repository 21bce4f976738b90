//! A layer pressed to given loads on adaptively refined meshes.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use super::dimension::{Dimension, Numbers};
use super::estimate::{Estimate, marks};
use super::forecast::MeshSize;
use super::layer::LayerModel;
use super::mesh::Mesh;
use super::model::{Equations, ModelError, State};
use super::newton::NewtonSettings;
use super::press::{
    Drafted, Goal, Layers, LeastErrors, Level, Meshed, Places, Pressing, Refinement, press_on,
};
use super::refinement::Refinable;

/// The ratio of the numbers of elements of successive meshes, from the marks alone. Tuned:
/// `benches/layer_growth.py`.
const GROWTH: f64 = 1.8;
/// The ratio in place of [`GROWTH`] while every state found has a fault, so that none counts as reached yet.
/// Tuned:
/// `benches/layer_growth.py`.
const GROWTH_BEFORE: f64 = 1.5;
/// The smallest size to which elements are cut, over the thickness: stress is singular at the edges of stiff
/// bodies, but its smallest scales do not matter to any result. It is not tuned.
const SMALLEST: f64 = 1e-3;
/// An element is also cut along an axis on which it is longer, by more than this factor, than on the shortest
/// axis along which it is marked. In a slender element the quadrature points hardly resolve a stress that is
/// singular at one end, nor the axis along which it varies. Tuned: `benches/layer_errors.py`.
const SLENDER: f64 = 3.0;

/// A layer and the meshes that it may be pressed on.
pub(crate) struct Adaptive<'a, S: Dimension> {
    /// Thickness of the layer in m.
    pub(crate) thickness: f64,
    /// Makes the first mesh.
    pub(crate) first: &'a dyn Fn() -> Result<Mesh<S>, ModelError>,
    /// Makes the layer at rest on a mesh with the given index.
    pub(crate) model: &'a dyn Fn(Mesh<S>, usize) -> Result<LayerModel<S>, ModelError>,
    /// Additional halvings of elements at the surface, so that the surface can bend around the indenter.
    pub(crate) halvings: Option<&'a HalvingsAt<'a, S>>,
    /// Whether the indenter is a rounded body in contact with the surface.
    pub(crate) is_rounded: bool,
    /// Whether the end of the layer rolls up.
    pub(crate) folds: bool,
    /// The least errors that are stated.
    pub(crate) least_errors: LeastErrors,
    /// The limits of the refinement.
    pub(crate) limits: Limits,
    /// The largest memory of a mesh, in bytes.
    pub(crate) memory_limit: u64,
}

/// The number of halvings that an element needs, and the axes along which it needs them, as bits.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Halvings {
    /// The number of halvings.
    pub(crate) times: u8,
    /// The axes, as bits.
    pub(crate) axes: u8,
}

impl Halvings {
    /// The halvings that meet both needs.
    pub(crate) fn and(self, other: Self) -> Self {
        Self { times: self.times.max(other.times), axes: self.axes | other.axes }
    }
}

/// Returns the halvings that each element needs for the mesh with the given index, from a layer on the mesh
/// before and its configuration.
pub(crate) type HalvingsAt<'a, S> = dyn Fn(&LayerModel<S>, &State<S>, usize) -> Vec<Halvings> + 'a;

/// The limits of mesh refinement.
pub(crate) struct Limits {
    /// The largest number of meshes.
    pub(crate) meshes: usize,
    /// A mesh with more elements than this is not refined.
    pub(crate) elements: usize,
    /// The approximate ratio of the numbers of elements of successive meshes.
    pub(crate) finer: f64,
    /// The largest number of meshes for places after the force is known.
    pub(crate) for_places: usize,
    /// The smallest size to which elements in the middle of a fan are cut, over the thickness: a free surface
    /// that folds at a bonded corner does so on all scales.
    pub(crate) smallest_at_corner: f64,
}

impl Limits {
    /// The sizes of the meshes that may be used, coarse to fine: that of the `first` mesh, and approximate
    /// sizes of the finer ones, with the same ratio of nodes to elements.
    pub(crate) fn sizes<S: Dimension>(&self, first: &Mesh<S>) -> Vec<MeshSize> {
        let nodes = first.nodes.len();
        let size = |k: usize| {
            let [elements, nodes] =
                [first.elements.len(), nodes].map(|n| (n as f64 * self.finer.powi(k as i32)) as usize);
            MeshSize { elements, unknowns: S::AXES * nodes + S::Pressure::COUNT * elements }
        };
        let is_begun = |k: &usize| *k == 0 || size(k - 1).elements <= self.elements;
        (0..self.meshes).take_while(is_begun).map(size).collect()
    }
}

impl<S: Dimension> Adaptive<'_, S> {
    /// Presses the layer to each of `goals`. Each mesh is the one before with the elements cut that have the
    /// largest errors.
    ///
    /// # Errors
    /// [`ModelError`] where there is no mesh, or none that fits into the memory.
    pub(crate) fn press(
        &self,
        goals: &[Goal],
        refinement: &Refinement,
        places: Option<&Places<'_, S>>,
        cancel: &AtomicBool,
        report: &(dyn Fn(usize, usize) + Sync),
        drafted: &Drafted<'_, S>,
    ) -> Result<Pressing<S>, ModelError> {
        let meshed = |k: usize, levels: &[Arc<Level<S>>], unknown: &[usize]| {
            let Some(last) = levels.last() else {
                return Some((self.first)().and_then(|mesh| self.layer_on(Refinable::new(mesh), 0)));
            };
            let mesh = last.mesh.as_ref()?;
            let count = mesh.mesh().elements.len();
            if k >= refinement.meshes || count > self.limits.elements {
                return None;
            }
            let estimates: Vec<&Estimate> =
                unknown.iter().filter_map(|&g| last.estimates.get(g)?.as_ref()).collect();
            // The goals that are not known yet were reached on coarser meshes only, so that there is no
            // estimate to refine this mesh by.
            let was_found = |&g: &usize| levels.iter().any(|level| level.step(g).is_some());
            if estimates.is_empty() && unknown.iter().any(was_found) {
                return None;
            }
            let every_axis = || vec![(1_u8 << S::AXES) - 1; count];
            let cut_along = |e: usize, axes: u8| {
                let lengths: Vec<f64> = (0..S::AXES).map(|axis| mesh.length(e, axis)).collect();
                let smallest = if mesh.is_collapsed(e) { self.limits.smallest_at_corner } else { SMALLEST };
                cut_along(&lengths, axes, 2.0 * smallest * self.thickness)
            };
            // States with a fault lie inside the indenter, since its corners are still too round on this
            // mesh. Their errors say little about those of later states.
            let none_counts = unknown.iter().all(|&g| last.fault(g).is_some());
            let growth = if none_counts { GROWTH_BEFORE } else { GROWTH };
            let marks = marks(&estimates, growth, cut_along).unwrap_or_else(every_axis);
            let mut halvings = vec![Halvings::default(); count];
            if let Some(halvings_at) = self.halvings {
                for (model, state) in unknown.iter().filter_map(|&g| last.start(g)) {
                    let of_goal = halvings_at(model, state, k);
                    halvings.iter_mut().zip(of_goal).for_each(|(needed, one)| *needed = needed.and(one));
                }
            }
            Some(self.layer_on(cut(mesh, &marks, halvings), k))
        };
        let layers = Layers {
            meshed: &meshed,
            room_for_two: &|model| 2 * model.equations().memory_bytes() <= self.memory_limit,
            least_errors: self.least_errors,
            places,
            for_places: self.limits.for_places,
            drafted,
        };
        press_on(goals, refinement, &layers, cancel, report)
    }

    /// The layer at rest on mesh number `k`, where that fits into the memory.
    fn layer_on(&self, refinable: Refinable<S>, k: usize) -> Result<Meshed<S>, ModelError> {
        let limit = self.memory_limit;
        let fits = |elements: usize, bytes: u64| match bytes <= limit {
            true => Ok(()),
            false => Err(ModelError::TooLarge { elements, bytes, limit }),
        };
        let mesh = refinable.mesh().clone();
        let elements = mesh.elements.len();
        // The memory of the elements is allocated with the equations, that of the factor only afterwards.
        fits(elements, Equations::<S>::element_bytes(elements))?;
        let model = (self.model)(mesh, k)?;
        fits(elements, model.equations().memory_bytes())?;
        let size = 1.0 / model.equations().unknowns() as f64;
        // Gaps are those where the pressure equals the shear modulus. A gap of 1e-5 of the thickness changes
        // the force of a punch by 7e-6. The settings take gaps over the shortest side of the body.
        let gap = |of_thickness: f64| of_thickness * self.thickness / model.equations().shortest_side;
        let plain = if self.folds { NewtonSettings::through_folds() } else { NewtonSettings::default() };
        let settings = NewtonSettings {
            tolerance: 1e-7,
            first_step: if self.is_rounded { 0.5 } else { 1.0 },
            // Measured: in the plane, a third or three times this gap takes longer around corners; in space,
            // a share of the shortest side takes less time under a ball.
            moving_gap: if S::AXES == 2 { gap(3e-4) } else { 3e-3 },
            final_gap: gap(1e-5),
            first_gap: gap(1e-5),
            only_near: self.halvings.is_some(),
            ..plain
        };
        Ok(Meshed { model, mesh: Some(refinable), size, settings })
    }
}

/// Cuts the elements of a mesh along the axes of their `marks`, and those at the surface by the `halvings`
/// that they need.
fn cut<S: Dimension>(mesh: &Refinable<S>, marks: &[u8], mut halvings: Vec<Halvings>) -> Refinable<S> {
    let halved = |halvings: &Halvings| if halvings.times > 0 { halvings.axes } else { 0 };
    let axes: Vec<u8> = marks.iter().zip(&halvings).map(|(axes, halvings)| axes | halved(halvings)).collect();
    let (mut finer, mut parents) = mesh.cut(&axes);
    while halvings.iter().any(|halvings| halvings.times > 1) {
        let left = |(e, parent): (usize, &u32)| {
            let Halvings { times, axes } = halvings[*parent as usize];
            let times = if finer.is_at_surface(e) { times.saturating_sub(1) } else { 0 };
            Halvings { times, axes }
        };
        halvings = parents.iter().enumerate().map(left).collect();
        (finer, parents) = finer.cut(&halvings.iter().map(halved).collect::<Vec<u8>>());
    }
    finer
}

/// The axes, as bits, along which an element of these `lengths` (m) is cut if it is marked along `axes`. It
/// is not cut along axes on which it is no longer than `least` (m).
fn cut_along(lengths: &[f64], axes: u8, least: f64) -> u8 {
    let is_in = |axis: &usize| axes >> axis & 1 == 1;
    let every = || 0..lengths.len();
    let shortest = every().filter(is_in).map(|a| lengths[a]).fold(f64::INFINITY, f64::min);
    let cut = every().filter(|a| is_in(a) || lengths[*a] > SLENDER * shortest);
    cut.filter(|a| lengths[*a] > least).map(|a| 1 << a).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_element_that_would_become_too_slender_is_cut_along_its_length_too() {
        assert_eq!(cut_along(&[1.0, 2.0], 1, 0.0), 1);
        assert_eq!(cut_along(&[1.0, 4.0], 1, 0.0), 3);
        assert_eq!(cut_along(&[1.0, 4.0], 2, 0.0), 2);
        assert_eq!(cut_along(&[1.0, 4.0, 1.0], 5, 0.0), 7);
        // Not below the least length.
        assert_eq!(cut_along(&[1.0, 4.0], 1, 2.0), 2);
        assert_eq!(cut_along(&[1.0, 4.0], 0, 0.0), 0);
    }
}
