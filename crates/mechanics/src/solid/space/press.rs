//! A layer of finite width, pressed to given loads on finer and finer meshes; see [`crate::solid::press`].

use std::sync::atomic::AtomicBool;

use super::layer::{SideCondition, SpaceLayerMesh};
use crate::solid::dimension::Space;
use crate::solid::layer::{End, Inclusion, Indenter, LayerMesh, LayerModel};
use crate::solid::levels::{fit_to_edges, within_limit};
use crate::solid::mesh::{geometric, graded_to_edges, uniform};
use crate::solid::model::{Equations, ModelError};
use crate::solid::newton::NewtonSettings;
use crate::solid::obstacle::IndenterProfile;
use crate::solid::press::{Goal, Layers, Places, Pressing, Refinement, deepest, press_on};
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

impl Refinement {
    /// Up to six meshes of hexahedra for a layer under `indenter`, with 1 to 8 over the thickness: in space it would cost too much to
    /// halve their size each time, since a mesh takes the sixth power of that number. Around an edge, sharp or rounded, the coarsest one has two,
    /// and an even number suits the fan there.
    pub fn in_space(relative_tolerance: f64, indenter: Indenter) -> Self {
        let has_edge = match indenter {
            Indenter::WholeTop => false,
            Indenter::Smooth(profile) => match profile {
                IndenterProfile::Sphere { .. } | IndenterProfile::Cylinder { .. } => false,
                IndenterProfile::Block { .. } | IndenterProfile::Punch { .. } => true,
            },
            Indenter::Sharp { .. } | Indenter::Held { .. } | Indenter::Bonded { .. } => true,
        };
        let meshes = if has_edge { vec![2, 4, 6, 8] } else { vec![1, 2, 3, 4, 6, 8] };
        Self { relative_tolerance, meshes }
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
    /// Where `places` are not known when the force is, but are about to be, one more mesh is solved on. No mesh that would take more than `memory_limit`
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
        let on_mesh = |n: usize| {
            let mesh = self.mesh_within_limit(n, deepest)?;
            let elements = mesh.mesh().elements.len();
            let fits = |bytes: u64| match bytes <= memory_limit {
                true => Ok(()),
                false => Err(ModelError::TooLarge { elements, bytes, limit: memory_limit }),
            };
            // What the elements take is taken with the equations, what the factor takes only afterwards.
            fits(Equations::<Space>::element_bytes(elements))?;
            let model = LayerModel::of_finite_width_with_inclusions(
                &mesh,
                self.rubber.clone(),
                &self.inclusions,
                self.indenter,
                self.end,
                self.side,
            )?;
            fits(model.equations().memory_bytes())?;
            Ok(model)
        };
        let layers = Layers {
            on_mesh: &on_mesh,
            size: &|n| 1.0 / n as f64,
            settings: &|_| settings,
            room_for_two: &|model| 2 * model.equations().memory_bytes() <= memory_limit,
            remesh: None,
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

    #[test]
    fn loads_side_by_side_are_those_one_after_the_other_to_the_last_digit() {
        let ball = Indenter::Smooth(IndenterProfile::Sphere { radius: 1.5 });
        let (layer, stop) = (SpaceLayer { indenter: ball, ..layer() }, AtomicBool::new(false));
        let goals = [0.02, 0.05, 0.1].map(Goal::Compression);
        let refinement = Refinement { relative_tolerance: 1e-9, meshes: vec![1, 2] };
        let on_threads = |threads: usize, limit: u64| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let pressing =
                pool.install(|| layer.press(&goals, &refinement, None, limit, &stop, &|_, _| ())).unwrap();
            pressing.goals.into_iter().map(|goal| goal.unwrap().refinement).collect::<Vec<_>>()
        };
        let both = on_threads(2, 1 << 40);
        assert_eq!(both, on_threads(1, 1 << 40));
        // There is memory for one layer on the second mesh, and not for two.
        let second = LayerModel::of_finite_width(
            &layer.mesh(2, 0.1),
            layer.rubber.clone(),
            ball,
            layer.end,
            layer.side,
        );
        let limit = second.unwrap().equations().memory_bytes();
        assert_eq!(both, on_threads(2, limit));
        assert!(both.iter().all(|forces| forces.len() == 2), "{both:?}");
    }

    #[test]
    fn a_mesh_that_does_not_fit_into_the_memory_is_not_begun() {
        let (layer, stop) = (layer(), AtomicBool::new(false));
        let press = |limit: u64| {
            let refinement = Refinement { relative_tolerance: 1e-9, meshes: vec![1, 2] };
            layer.press(&[Goal::Compression(0.05)], &refinement, None, limit, &stop, &|_, _| ())
        };
        assert!(matches!(press(1000), Err(ModelError::TooLarge { limit: 1000, .. })));
        let model = |n: usize| {
            let of = &layer;
            LayerModel::of_finite_width(&of.mesh(n, 0.05), of.rubber.clone(), of.indenter, of.end, of.side)
                .unwrap()
        };
        let [first, second] = [1, 2].map(|n| model(n).equations().memory_bytes());
        assert!(first < second);
        let pressing = press(second - 1).unwrap();
        assert_eq!(pressing.levels.len(), 1);
        assert!(matches!(pressing.too_large, Some(ModelError::TooLarge { bytes, .. }) if bytes == second));
        assert!(pressing.goals[0].is_ok());
        let all = press(second).unwrap();
        assert!(all.levels.len() == 2 && all.too_large.is_none());
    }
}
