//! A layer of finite width, pressed to given loads on finer and finer meshes; see [`crate::solid::press`].

use std::sync::atomic::AtomicBool;

use super::layer::{SideCondition, SpaceLayerMesh};
use crate::solid::adaptive::{Adaptive, Limits};
use crate::solid::dimension::Space;
use crate::solid::first_mesh::FirstMesh;
use crate::solid::forecast::MeshSize;
use crate::solid::layer::{End, Inclusion, Indenter, LayerModel};
use crate::solid::layer_mesh::{check_elements, end_reach};
use crate::solid::mesh::graded_to_edges;
use crate::solid::model::ModelError;
use crate::solid::press::{Drafted, Goal, LeastErrors, Places, Pressing, Refinement, deepest};
use elastocap_materials::Rubber;

/// A layer of finite width and its indenter, both symmetric about `x1 = 0` and `x3 = 0`. Lengths in m.
#[derive(Debug, Clone, PartialEq)]
pub struct SpaceLayer {
    /// Thickness `H` at rest.
    pub thickness: f64,
    /// From the middle of the layer to its end along `x1`, at rest.
    pub half_length: f64,
    /// From the middle of the layer to its side along `x3`, at rest.
    pub half_width: f64,
    /// The rubber that the layer is made of.
    pub rubber: Rubber,
    /// Bodies of another rubber in the quarter with `x1 > 0` and `x3 > 0`, within [`SpaceLayer::room`].
    pub inclusions: Vec<Inclusion<Space>>,
    /// The indenter that presses.
    pub indenter: Indenter,
    /// The condition at the end.
    pub end: End,
    /// The condition at the side.
    pub side: SideCondition,
}

/// The limits in space. Tuned: `benches/layer_growth.py`.
const LIMITS: Limits =
    Limits { meshes: 9, elements: 8000, finer: 2.3, for_places: 2, smallest_at_corner: 0.05 };

impl Refinement {
    /// A refinement to this tolerance, on as many meshes as a layer in space may need.
    pub fn in_space(relative_tolerance: f64) -> Self {
        Self { relative_tolerance, meshes: LIMITS.meshes }
    }
}

impl SpaceLayer {
    /// The mesh of a quarter of this layer with about `n` hexahedra over its thickness, for compressions up
    /// to `deepest`.
    pub fn mesh(&self, n: usize, deepest: f64) -> SpaceLayerMesh {
        let first = self.first_mesh(deepest);
        let section = first.section(n);
        let side_fan = self.side_fan();
        let inner = self.half_width - side_fan.unwrap_or(0.0);
        let across = graded_to_edges(0.0, inner, &first.edges[2], first.size(n, 1));
        SpaceLayerMesh { section, across, side_fan }
    }

    /// The approximate number of hexahedra over the thickness on the first mesh.
    pub fn coarsest(&self) -> usize {
        // A fan around the edge of a punch needs an even number.
        if self.indenter.patch().is_some() { 2 } else { 1 }
    }

    /// The data that the first mesh depends on, for compressions up to `deepest`.
    fn first_mesh(&self, deepest: f64) -> FirstMesh {
        let ends = |axis: usize| self.inclusions.iter().flat_map(move |i| [i.min[axis], i.max[axis]]);
        FirstMesh {
            thickness: self.thickness,
            half_length: self.half_length,
            edges: [0, 1, 2].map(|axis| ends(axis).collect()),
            indenter: self.indenter,
            position: 0.0,
            end: self.end,
            deepest,
        }
    }

    /// The sizes of the meshes that may be solved on, coarse to fine: that of the first mesh, and approximate
    /// sizes of the finer ones.
    ///
    /// # Errors
    /// [`ModelError`] where there is no first mesh.
    pub fn mesh_sizes(&self, deepest: f64) -> Result<Vec<MeshSize>, ModelError> {
        Ok(LIMITS.sizes(&self.mesh_within_limit(self.coarsest(), deepest)?.mesh()))
    }

    /// The mesh of [`SpaceLayer::mesh`], unless it has too many elements.
    ///
    /// # Errors
    /// [`ModelError::TooManyElements`].
    pub fn mesh_within_limit(&self, n: usize, deepest: f64) -> Result<SpaceLayerMesh, ModelError> {
        let mesh = self.mesh(n, deepest);
        check_elements(mesh.elements_at_most())?;
        Ok(mesh)
    }

    /// The distance over which the fan at the side extends inwards, in m, if there is one: half the half
    /// width, but at most the thickness.
    fn side_fan(&self) -> Option<f64> {
        let straight =
            self.indenter.patch().is_some() || self.end == End::Far || self.side == SideCondition::Symmetric;
        (!straight).then(|| self.thickness.min(0.5 * self.half_width))
    }

    /// The largest distances from the middle along `x1` and `x3` to which inclusions may extend, in m; the
    /// hexahedra beyond are shaped by the end and the side.
    pub fn room(&self) -> [f64; 2] {
        let end = end_reach(self.thickness, self.half_length, self.indenter.patch().unwrap_or(0.0));
        [self.half_length - end, self.half_width - self.side_fan().unwrap_or(0.0)]
    }

    /// Presses the layer to each of `goals`, which are all compressions or all forces.
    ///
    /// Each mesh is the one before with the elements cut that have the largest errors. Where `places` are not
    /// known when the force is, up to two more meshes are used. No mesh that would take more than
    /// `memory_limit` bytes is started. `cancel` stops the work before the next linear system; `report` is
    /// called with the number of the mesh and the number of goals done on it.
    ///
    /// # Errors
    /// [`ModelError`] if no mesh can be made, or none fits into the memory. The error of a goal that is not
    /// reached is in the result for that goal.
    pub fn press(
        &self,
        goals: &[Goal],
        refinement: &Refinement,
        places: Option<&Places<'_, Space>>,
        memory_limit: u64,
        cancel: &AtomicBool,
        report: &(dyn Fn(usize, usize) + Sync),
    ) -> Result<Pressing<Space>, ModelError> {
        self.press_with_drafts(goals, refinement, places, memory_limit, (cancel, report), &|_| ())
    }

    /// Presses the layer as [`SpaceLayer::press`] does, and passes the results of each mesh but the last to
    /// `drafted`.
    ///
    /// # Errors
    /// See [`SpaceLayer::press`].
    pub fn press_with_drafts(
        &self,
        goals: &[Goal],
        refinement: &Refinement,
        places: Option<&Places<'_, Space>>,
        memory_limit: u64,
        (cancel, report): (&AtomicBool, &(dyn Fn(usize, usize) + Sync)),
        drafted: &Drafted<'_, Space>,
    ) -> Result<Pressing<Space>, ModelError> {
        let deepest = deepest(goals);
        let first = || {
            let mesh = self.mesh_within_limit(self.coarsest(), deepest)?;
            mesh.section.check()?;
            Ok(mesh.mesh())
        };
        let model = |mesh, _| {
            let (rubber, inclusions) = (self.rubber.clone(), &self.inclusions);
            LayerModel::of_quarter(mesh, rubber, inclusions, self.indenter, self.end, self.side)
        };
        let adaptive = Adaptive {
            thickness: self.thickness,
            first: &first,
            model: &model,
            halvings: None,
            is_rounded: self.indenter.is_rounded(),
            folds: false,
            least_errors: LeastErrors::default(),
            limits: LIMITS,
            memory_limit,
        };
        adaptive.press(goals, refinement, places, cancel, report, drafted)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solid::obstacle::IndenterProfile;

    fn layer() -> SpaceLayer {
        SpaceLayer {
            thickness: 1.0,
            half_length: 2.0,
            half_width: 0.8,
            rubber: Rubber::neo_hookean(1.0),
            inclusions: Vec::new(),
            indenter: Indenter::WholeTop,
            end: End::Free,
            side: SideCondition::Free,
        }
    }

    /// Presses on two meshes within a memory.
    fn press(layer: &SpaceLayer, goals: &[Goal], limit: u64) -> Result<Pressing<Space>, ModelError> {
        let refinement = Refinement { relative_tolerance: 1e-9, meshes: 2 };
        layer.press(goals, &refinement, None, limit, &AtomicBool::new(false), &|_, _| ())
    }

    const ANY: u64 = 1 << 40;

    #[test]
    fn loads_side_by_side_are_those_one_after_the_other_to_the_last_digit() {
        let ball = Indenter::Smooth(IndenterProfile::Sphere { radius: 1.5 });
        let layer = SpaceLayer { indenter: ball, ..layer() };
        let goals = [0.02, 0.05, 0.1].map(Goal::Compression);
        let on_threads = |threads: usize, limit: u64| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let pressing = pool.install(|| press(&layer, &goals, limit)).unwrap();
            pressing.goals.into_iter().map(|goal| goal.unwrap().refinement).collect::<Vec<_>>()
        };
        let side_by_side = on_threads(2, ANY);
        assert_eq!(side_by_side, on_threads(1, ANY));
        // There is memory for one layer on the second mesh, and not for two.
        let second = press(&layer, &goals, ANY).unwrap().levels[1].model.equations().memory_bytes();
        assert_eq!(side_by_side, on_threads(2, second));
        assert!(side_by_side.iter().all(|forces| forces.len() == 2), "{side_by_side:?}");
    }

    #[test]
    fn a_mesh_that_does_not_fit_into_the_memory_is_not_begun() {
        let (layer, goals) = (layer(), [Goal::Compression(0.05)]);
        assert!(matches!(press(&layer, &goals, 1000), Err(ModelError::TooLarge { limit: 1000, .. })));
        let pressing = press(&layer, &goals, ANY).unwrap();
        assert!(pressing.levels.len() == 2 && pressing.too_large.is_none());
        let [first, second] = [0, 1].map(|k| pressing.levels[k].model.equations().memory_bytes());
        assert!(first < second);
        let one = press(&layer, &goals, second - 1).unwrap();
        assert_eq!(one.levels.len(), 1);
        assert!(matches!(one.too_large, Some(ModelError::TooLarge { bytes, .. }) if bytes == second));
        assert!(one.goals[0].is_ok());
    }
}
