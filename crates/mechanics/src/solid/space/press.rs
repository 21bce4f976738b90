//! A layer of finite width, pressed to given loads on finer and finer meshes; see [`crate::solid::press`].

use std::sync::atomic::AtomicBool;

use super::layer::{SideCondition, SpaceLayerMesh};
use crate::solid::dimension::Space;
use crate::solid::estimate::{Estimate, marks};
use crate::solid::forecast::MeshSize;
use crate::solid::layer::{End, Inclusion, Indenter, LayerMesh, LayerModel};
use crate::solid::levels::{fit_to_edges, within_limit};
use crate::solid::mesh::{geometric, graded_to_edges, uniform};
use crate::solid::model::{Equations, ModelError};
use crate::solid::newton::NewtonSettings;
use crate::solid::obstacle::IndenterProfile;
use crate::solid::press::{Goal, Layers, Level, Meshed, Places, Pressing, Refinement, deepest, press_on};
use crate::solid::refinement::Refinable;
use elastocap_materials::Rubber;

/// A layer of finite width and its indenter, both symmetric about `x1 = 0` and `x3 = 0`. Lengths in m.
#[derive(Debug, Clone, PartialEq)]
pub struct SpaceLayer {
    /// Thickness `H` at rest.
    pub thickness: f64,
    /// From the middle of the layer to its end along `x1`, at rest; more than the thickness.
    pub half_length: f64,
    /// From the middle of the layer to its side along `x3`, at rest.
    pub half_width: f64,
    /// What the layer is made of.
    pub rubber: Rubber,
    /// Bodies of another rubber in the quarter with `x1 > 0` and `x3 > 0`, within [`SpaceLayer::room`].
    pub inclusions: Vec<Inclusion<Space>>,
    /// What presses.
    pub indenter: Indenter,
    /// The condition at the end.
    pub end: End,
    /// The condition at the side.
    pub side: SideCondition,
}

/// Square of the radius of the contact with a round indenter over its radius times its displacement, about: it is 1 on a half-space, and 2 where the
/// surface around the contact stays where it was.
const CONTACT: f64 = 1.5;
/// Size of the hexahedra at the edges of inclusions, over those where the layer is smooth.
const AT_EDGES: f64 = 0.4;
/// Growth of the size of hexahedra per distance, times the number of them over the thickness, where they are more than a thickness away
/// from the indenter: so it is halved where that number is doubled, and the meshes are refinements of one another.
const FAR_GROWTH: f64 = 2.0;
/// Distance over which they grow, over the thickness.
const FARTHEST_GROWTH: f64 = 2.0;

/// Fractions of the way from a bonded edge in a fan on the mesh with `n` hexahedra over the thickness. Its smallest ring is halved
/// where `n` grows by two.
fn fan(n: usize) -> Vec<f64> {
    let rings = n.div_ceil(2);
    geometric(0.5_f64.powf(0.5 * n as f64 / rings as f64), rings)
}

/// The first mesh has about this many hexahedra over the thickness.
const COARSEST: usize = 1;
/// The same where a fan around an edge needs an even number.
const COARSEST_WITH_FAN: usize = 2;
/// How many times as many elements the next mesh has by its marks alone, and about how many it has at the end.
const GROWTH: f64 = 1.8;
const FINER: f64 = 2.3;
/// Meshes, at most, and the elements from which on no finer one is made.
const MESHES: usize = 9;
const ENOUGH: usize = 8000;

/// Elements are not cut to less than this, over the thickness: stress is singular at the edges of stiff bodies, and what is there on the
/// smallest scales matters to nothing that is asked for.
const SMALLEST: f64 = 1e-3;
/// The same for elements in the middle of a fan: a free surface that folds at a bonded corner does so on all scales.
const SMALLEST_AT_CORNER: f64 = 0.05;

impl Refinement {
    /// Meshes that are refined where it is needed, for a layer in space.
    pub fn in_space(relative_tolerance: f64) -> Self {
        Self { relative_tolerance, meshes: (0..MESHES).collect() }
    }
}

impl SpaceLayer {
    /// The mesh of a quarter of this layer with about `n` hexahedra over its thickness, for compressions up to `deepest`.
    pub fn mesh(&self, n: usize, deepest: f64) -> SpaceLayerMesh {
        let (height, length) = (self.thickness, self.half_length);
        let edges: [Vec<f64>; 3] = std::array::from_fn(|axis| self.edges(axis).collect());
        let mut section = match self.indenter {
            // The fan takes up half the thickness, where an even number fits, but for what lies in the layer below it.
            Indenter::Sharp { half_width }
            | Indenter::Held { half_width }
            | Indenter::Bonded { half_width } => {
                let highest = self.edges(1).fold(0.0, f64::max);
                let reach = (0.5 * height).min(0.9 * (height - highest));
                LayerMesh::under_punch(height, length, [half_width, reach], n, 0.5, n / 2)
            }
            Indenter::WholeTop | Indenter::Smooth(_) => {
                let size = self.size(n, 0, deepest);
                LayerMesh {
                    along: graded_to_edges(0.0, length - height, &edges[0], &size),
                    up: graded_to_edges(0.0, height, &edges[1], |y| {
                        (self.finest(n) + 0.5 * (height - y)).min(height / n as f64)
                    }),
                    end_top: uniform(length - height, length, n.div_ceil(2)),
                    radii: if self.end == End::Far { Vec::new() } else { fan(n) },
                    punch: None,
                }
            }
        };
        let LayerMesh { along, up, punch, .. } = &mut section;
        let kept = punch.as_ref().map(|p| (p.along.map(|k| along[k]), up[p.up]));
        // Stress is singular at the edges of electrodes. Beside a fan, refinement there would take minutes for a load; the error states what
        // is missing.
        let smallest = if kept.is_none() { AT_EDGES * height / n as f64 } else { f64::INFINITY };
        fit_to_edges(along, kept.as_ref().map_or(&[][..], |k| &k.0[..]), &edges[0], smallest);
        fit_to_edges(up, kept.as_ref().map_or(&[][..], |k| std::slice::from_ref(&k.1)), &edges[1], smallest);
        if let (Some(punch), Some((ends, low))) = (punch, kept) {
            let at = |x: f64, of: &[f64]| of.iter().position(|y| *y == x).unwrap_or(0);
            (punch.along, punch.up) = (ends.map(|x| at(x, along)), at(low, up));
        }
        let side_fan = self.side_fan();
        let inner = self.half_width - side_fan.unwrap_or(0.0);
        let across = graded_to_edges(0.0, inner, &edges[2], self.size(n, 1, deepest));
        SpaceLayerMesh { section, across, side_fan }
    }

    /// About how many hexahedra the first mesh has over the thickness.
    pub fn coarsest(&self) -> usize {
        if self.indenter.sharp_corner().is_some() { COARSEST_WITH_FAN } else { COARSEST }
    }

    /// The elements of the meshes that may be solved on, coarse to fine: those of the first, and about those of the finer ones.
    ///
    /// # Errors
    /// [`ModelError`] where there is no first mesh.
    pub fn mesh_sizes(&self, deepest: f64) -> Result<Vec<MeshSize>, ModelError> {
        let first = self.mesh_within_limit(self.coarsest(), deepest)?.mesh();
        let (elements, nodes) = (first.elements.len() as f64, first.nodes.len() as f64);
        let of = |k: usize| {
            let elements = (elements * FINER.powi(k as i32)) as usize;
            // A finer mesh has as many nodes for each element, about.
            MeshSize { elements, unknowns: 3 * (nodes * FINER.powi(k as i32)) as usize + 4 * elements }
        };
        let begun = |k: &usize| *k == 0 || of(k - 1).elements <= ENOUGH;
        Ok((0..MESHES).take_while(begun).map(of).collect())
    }

    /// The mesh of [`SpaceLayer::mesh`], unless it has too many elements.
    ///
    /// # Errors
    /// [`ModelError::TooManyElements`].
    pub fn mesh_within_limit(&self, n: usize, deepest: f64) -> Result<SpaceLayerMesh, ModelError> {
        let mesh = self.mesh(n, deepest);
        within_limit(mesh.elements_at_most())?;
        Ok(mesh)
    }

    /// Inward reach of the fan at the side in m, if there is one: half the half width, and at most that of the fan at the end.
    fn side_fan(&self) -> Option<f64> {
        let straight = self.indenter.sharp_corner().is_some()
            || self.end == End::Far
            || self.side == SideCondition::Symmetric;
        (!straight).then(|| self.thickness.min(0.5 * self.half_width))
    }

    /// How far inclusions may reach from the middle along `x1` and `x3`, in m; the hexahedra beyond belong to fans.
    pub fn room(&self) -> [f64; 2] {
        [self.half_length - self.thickness, self.half_width - self.side_fan().unwrap_or(0.0)]
    }

    /// Lower and upper ends of the inclusions along an axis.
    fn edges(&self, axis: usize) -> impl Iterator<Item = f64> {
        self.inclusions.iter().flat_map(move |i| [i.min[axis], i.max[axis]])
    }

    /// Size of the smallest hexahedra at the surface, in m, with about `n` over the thickness.
    pub fn finest(&self, n: usize) -> f64 {
        let part = if self.indenter.is_rounded() { 0.5 } else { 1.0 };
        part * self.thickness / n as f64
    }

    /// Size in m of the hexahedra as a function of the distance from the middle along `x1` (`axis` 0) or `x3` (1). They are finer where
    /// the surface bends around the indenter: under a round one that is pressed to the compression `deepest` all over the
    /// contact, where less of it is in contact at smaller loads.
    fn size(&self, n: usize, axis: usize, deepest: f64) -> impl Fn(f64) -> f64 {
        let thickness = self.thickness;
        let round = |radius: f64| ((CONTACT * radius * deepest * thickness).sqrt().min(radius), thickness);
        let along_x1 = |edge: (f64, f64)| (axis == 0).then_some(edge);
        let edge = match self.indenter {
            Indenter::Smooth(profile) => match profile {
                IndenterProfile::Block { half_widths, .. } => Some((half_widths[axis], 0.0)),
                IndenterProfile::Sphere { radius } => Some(round(radius)),
                IndenterProfile::Cylinder { radius } => along_x1(round(radius)),
                IndenterProfile::Punch { half_width, .. } => along_x1((half_width, 0.0)),
            },
            Indenter::WholeTop | Indenter::Sharp { .. } | Indenter::Held { .. } | Indenter::Bonded { .. } => {
                None
            }
        };
        let (fine, coarse, growth) = (self.finest(n), thickness / n as f64, FAR_GROWTH / n as f64);
        move |x| {
            // Away from the indenter the layer is at rest but for what decays over a thickness or so.
            edge.map_or(coarse, |(edge, inside)| {
                let away = (x - edge).max(edge - inside - x).max(0.0);
                let far = (x - edge - thickness).clamp(0.0, FARTHEST_GROWTH * thickness);
                (fine + 0.5 * away).min(coarse) + growth * far
            })
        }
    }

    /// Presses the layer to each of `goals`, all of them compressions or all of them forces.
    ///
    /// Each mesh is the one before with those elements cut in which the errors are made. Where `places` are not known when the force is,
    /// up to two more meshes are solved on. No mesh that would take more than `memory_limit`
    /// bytes is started. `cancel` stops the work before the next linear system; `tell` is
    /// called with the number of the mesh and the number of goals done on it.
    ///
    /// # Errors
    /// [`ModelError`] where there is no mesh, or none that fits into the memory. A goal that is not reached has its own error in the
    /// result.
    pub fn press(
        &self,
        goals: &[Goal],
        refinement: &Refinement,
        places: Option<&Places<'_, Space>>,
        memory_limit: u64,
        cancel: &AtomicBool,
        tell: &(dyn Fn(usize, usize) + Sync),
    ) -> Result<Pressing<Space>, ModelError> {
        let rounded = self.indenter.is_rounded();
        // Gaps of 1e-5 sides of the mesh where the pressure is the shear modulus change a force by less than 1e-4.
        let settings = NewtonSettings {
            tolerance: 1e-7,
            first_step: if rounded { 0.5 } else { 1.0 },
            moving_gap: 3e-3,
            final_gap: 1e-5,
            first_gap: 3e-5,
            ..Default::default()
        };
        let deepest = deepest(goals);
        let fits = |elements: usize, bytes: u64| match bytes <= memory_limit {
            true => Ok(()),
            false => Err(ModelError::TooLarge { elements, bytes, limit: memory_limit }),
        };
        let on_mesh = |refinable: Refinable<Space>| {
            let mesh = refinable.mesh().clone();
            let elements = mesh.elements.len();
            // What the elements take is taken with the equations, what the factor takes only afterwards.
            fits(elements, Equations::<Space>::element_bytes(elements))?;
            let (rubber, inclusions) = (self.rubber.clone(), &self.inclusions);
            let model = LayerModel::of_quarter(mesh, rubber, inclusions, self.indenter, self.end, self.side)?;
            fits(elements, model.equations().memory_bytes())?;
            let size = 1.0 / model.equations().unknowns() as f64;
            Ok(Meshed { model, mesh: Some(refinable), size, settings })
        };
        let meshed = |k: usize, levels: &[Level<Space>], unknown: &[usize]| {
            let Some(last) = levels.last() else {
                let first = self.mesh_within_limit(self.coarsest(), deepest).and_then(|mesh| {
                    mesh.section.check()?;
                    Ok(Refinable::new(mesh.mesh()))
                });
                return Some(first.and_then(on_mesh));
            };
            let mesh = last.mesh.as_ref()?;
            let count = mesh.mesh().elements.len();
            if k >= refinement.meshes.len() || count > ENOUGH {
                return None;
            }
            let estimates: Vec<&Estimate> =
                unknown.iter().filter_map(|&g| last.estimates.get(g)?.as_ref()).collect();
            let every_axis = || vec![7; count];
            let may_be_cut = |e: usize, axis: usize| {
                let smallest = if mesh.is_collapsed(e) { SMALLEST_AT_CORNER } else { SMALLEST };
                mesh.length(e, axis) > 2.0 * smallest * self.thickness
            };
            Some(on_mesh(mesh.cut(&marks(&estimates, GROWTH, may_be_cut).unwrap_or_else(every_axis)).0))
        };
        let layers = Layers {
            meshed: &meshed,
            room_for_two: &|model| 2 * model.equations().memory_bytes() <= memory_limit,
            remesh: None,
            estimates: true,
            places,
        };
        press_on(goals, refinement, &layers, cancel, tell)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        let refinement = Refinement { relative_tolerance: 1e-9, meshes: vec![0, 1] };
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
        let both = on_threads(2, ANY);
        assert_eq!(both, on_threads(1, ANY));
        // There is memory for one layer on the second mesh, and not for two.
        let second = press(&layer, &goals, ANY).unwrap().levels[1].model.equations().memory_bytes();
        assert_eq!(both, on_threads(2, second));
        assert!(both.iter().all(|forces| forces.len() == 2), "{both:?}");
    }

    #[test]
    fn a_mesh_that_does_not_fit_into_the_memory_is_not_begun() {
        let (layer, goals) = (layer(), [Goal::Compression(0.05)]);
        assert!(matches!(press(&layer, &goals, 1000), Err(ModelError::TooLarge { limit: 1000, .. })));
        let all = press(&layer, &goals, ANY).unwrap();
        assert!(all.levels.len() == 2 && all.too_large.is_none());
        let [first, second] = [0, 1].map(|k| all.levels[k].model.equations().memory_bytes());
        assert!(first < second);
        let one = press(&layer, &goals, second - 1).unwrap();
        assert_eq!(one.levels.len(), 1);
        assert!(matches!(one.too_large, Some(ModelError::TooLarge { bytes, .. }) if bytes == second));
        assert!(one.goals[0].is_ok());
    }
}
